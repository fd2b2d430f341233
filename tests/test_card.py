"""`tests.tools.card`: one step's failure is said and costs nothing else."""

from pathlib import Path

from tests.tools.card import Step, document_text, run_step, steps


def test_a_failing_a_hanging_and_a_silent_step_are_said(tmp_path: Path):
    failing = Step("failing", ("-c", "raise SystemExit('no memory')"), 30, tmp_path / "a.json")
    hanging = Step(
        "hanging", ("-c", "import subprocess; subprocess.run(('sleep', '60'))"), 1, tmp_path / "b.json"
    )
    assert "no memory" in run_step(failing)["failed"]
    assert run_step(hanging)["failed"] == "longer than 1 s"


def test_an_old_result_is_never_taken_for_a_new_one(tmp_path: Path):
    (tmp_path / "a.json").write_text('{"ms": 1}', encoding="utf-8")
    assert "failed" in run_step(Step("silent", ("-c", ""), 30, tmp_path / "a.json"))


def test_steps_of_the_card_are_left_out_without_one(tmp_path: Path):
    names = {step.name for step in steps(tmp_path, quick=True, card=False)}
    assert names == {"pictures", "asking", "network-mini"}
    assert {"gsplat", "network-full-compiled"} <= {s.name for s in steps(tmp_path, quick=False, card=True)}


def test_failures_stand_in_the_table():
    document = {"machine": {}, "left_out": "", "steps": {"asking": {"failed": "status 1: x", "took_s": 2}}}
    assert "Failed: status 1: x" in document_text(document)


def test_a_limit_leaves_the_rows_that_were_done(tmp_path: Path):
    wait = "import pathlib, sys, time; pathlib.Path(sys.argv[1]).write_text(sys.argv[2]); time.sleep(60)"
    written = tmp_path / "a.json"
    found = run_step(Step("pictures", ("-c", wait, str(written), '{"rows": [{"ms": 1}]}'), 1, written))
    assert found["rows"] == [{"ms": 1}] and "1 s" in found["cut"]
