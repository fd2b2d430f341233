"""`langflash batch` on real photos, made small: what it writes is what the single commands write."""

import csv
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from PIL import Image

from app.cli import main
from langflash_core.base.files import held_alone
from langflash_core.base.resources import asset_path
from tests.app.cli.test_start import told

SMALL = ("--size", "84", "--backend", "torch")
ASKED = ("--prompt", "plant", "submarine", "--export", ".ply", ".csv", ".json", "transforms.json")


def small(name: str, folder: Path) -> list[Path]:
    """A shipped pair of photos, at a fraction of its size."""
    folder.mkdir(parents=True)
    paths = []
    for side in ("left", "right"):
        with Image.open(asset_path(f"photos/{name}_{side}.png")) as photo:
            shrunk = photo.convert("RGB")
        shrunk.thumbnail((240, 240))
        paths.append(folder / f"{side}.png")
        shrunk.save(paths[-1])
    return paths


@pytest.fixture(scope="module")
def sets(tmp_path_factory) -> Path:
    """Two good places, a damaged photo, and a folder without photos."""
    source = tmp_path_factory.mktemp("batch") / "sets"
    small("living_room", source / "living room")
    small("desk", source / "desk")
    damaged = small("toy", source / "damaged")[1]
    damaged.write_bytes(damaged.read_bytes()[:3000])
    (source / "empty").mkdir()
    return source


@pytest.fixture(scope="module")
def made(sets) -> tuple[Path, int, dict[str, dict[str, str]]]:
    """The output of a run over all sets, its exit code, and its ledger before other runs."""
    output = sets.parent / "out"
    code = main(["batch", str(sets), "-o", str(output), "--workers", "2", *ASKED, *SMALL])
    return output, code, rows(output)


def rows(output: Path) -> dict[str, dict[str, str]]:
    with (output / "ledger.csv").open(encoding="utf-8", newline="") as stream:
        return {row["name"]: row for row in csv.DictReader(stream)}


def written(folder: Path) -> dict[Path, int]:
    return {path: path.stat().st_mtime_ns for path in folder.rglob("*") if path.is_file()}


def test_ledger(made):
    _, code, ledger = made
    assert code == 1 and list(ledger) == ["damaged", "desk", "empty", "living room"]
    assert {name: row["status"] for name, row in ledger.items()} == {
        "damaged": "failed",
        "desk": "done",
        "empty": "failed",
        "living room": "done",
    }
    assert "right.png" in ledger["damaged"]["reason"] and "no photos" in ledger["empty"]["reason"]
    room = ledger["living room"]
    assert room["photos"] == "2" and int(room["gaussians"]) > 1000 and int(room["groups"]) > 1
    assert room["retried"] == "0" and room["found"].endswith("/2") and int(room["memory_mb"]) > 100
    assert "field of view" in room["warnings"]


def test_what_is_in_the_output(made):
    output, *_ = made
    assert sorted(os.listdir(output)) == ["desk", "ledger.csv", "living room", "summary.html"]
    files = set(os.listdir(output / "desk"))
    images = {"scene.langflash", "scene.ply", "scene.csv", "transforms.json", "images", "thumbnail.jpg"}
    assert images | {"answers", "scene.language.safetensors"} <= files
    # Masks of a phrase that is nowhere are left out, and that is said.
    note = "no scene.json" in rows(output)["desk"]["warnings"]
    assert note == ("scene.json" not in files)
    page = (output / "summary.html").read_text(encoding="utf-8")
    assert "living%20room/scene.langflash" in page and "data:image/jpeg;base64," in page


def test_scenes_are_those_of_reconstruct(made, sets, tmp_path):
    """Byte for byte, since both have as many threads (`OMP_NUM_THREADS`); in a process of its own, since
    tests before this one may have left torch with others."""
    (output, *_), name = made, "living room"
    photos = [str(path) for path in sorted((sets / name).iterdir())]
    alone = tmp_path / "scene.langflash"
    command = [sys.executable, "-m", "langflash_core", "reconstruct", *photos, "--size", "84", "-o", alone]
    subprocess.run(command, check=True, capture_output=True)
    assert alone.read_bytes() == (output / name / "scene.langflash").read_bytes()


def test_answers_are_those_of_query(made, run, tmp_path):
    output, *_ = made
    scene = output / "desk" / "scene.langflash"
    words = ("plant", "submarine", "-o", tmp_path, "--backend", "torch", "--json")
    single = run("query", scene, *words).json()
    batch = json.loads((output / "desk" / "answers" / "answers.json").read_text())
    for each in (*single["prompts"], *batch["prompts"]):
        each["files"] = {kind: Path(path).name for kind, path in each["files"].items()}
    assert batch.pop("scene") == "../scene.langflash" and single.pop("scene") and batch == single
    for path in tmp_path.iterdir():
        assert (output / "desk" / "answers" / path.name).read_bytes() == path.read_bytes()


def test_exports_are_those_of_export(made, run, done, tmp_path):
    output, *_ = made
    scene = output / "desk" / "scene.langflash"
    run("export", scene, "-o", tmp_path / "scene.ply")
    words = ("--prompt", "plant", "submarine", "--all-views", "--backend", "torch")
    done("export", scene, "-o", tmp_path / "scene.csv", *words)
    for name in ("scene.ply", "scene.csv"):
        assert (output / "desk" / name).read_bytes() == (tmp_path / name).read_bytes()


def test_nothing_is_done_twice(made, sets, done):
    """A table of the good sets by other paths: names, sizes and times of their photos are the same."""
    output, *_ = made
    table = sets.parent / "good.csv"
    pairs = (
        (name, [f"sets/{name}/{side}.png" for side in ("left", "right")]) for name in ("desk", "living room")
    )
    table.write_text("".join(f"{name},{','.join(photos)}\n" for name, photos in pairs))
    folders = [output / "desk", output / "living room"]
    before = [written(folder) for folder in folders]
    outcome = done("batch", table, "-o", output, *ASKED, *SMALL, "--json")
    assert outcome.err == ""
    document = outcome.json()
    assert (document["sets"], document["done"], document["failed"], document["done_before"]) == (2, 2, 0, 2)
    assert [written(folder) for folder in folders] == before
    assert set(rows(output)) == {"desk", "living room", "damaged", "empty"}  # others' rows stay


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_interrupted(sets, tmp_path):
    """Ctrl-C after the first set, then the same command again."""
    for place in ("a", "b", "c"):
        small("living_room", tmp_path / "sets" / place)
    words = ("batch", tmp_path / "sets", "-o", tmp_path / "out", "--workers", "1", *SMALL)
    program = [sys.executable, "-m", "langflash_core", *map(str, words)]
    # A child would inherit that the signal is ignored, as it is in a shell's background.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        child = subprocess.Popen(program, stderr=subprocess.PIPE, text=True, start_new_session=True)
    finally:
        signal.signal(signal.SIGINT, before)
    assert child.stderr is not None
    assert child.stderr.readline().startswith("[1/3] a: done")
    os.killpg(child.pid, signal.SIGINT)  # as a terminal does: to the workers, too
    _, rest = child.communicate(timeout=600)
    assert child.returncode == 130 and rest == "langflash: stopped; the same command continues from here\n"
    first = rows(tmp_path / "out")
    assert first["a"]["status"] == "done"
    # On a busy machine the next set may have come to its end, before or after the ledger closed.
    assert set(os.listdir(tmp_path / "out")) - {"b", "c"} == {"a", "ledger.csv", "summary.html"}
    done = subprocess.run(program, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr
    assert f"3 of 3 sets done ({len(first)} before)" in done.stdout
    assert rows(tmp_path / "out").items() >= first.items()


def test_bad_input(sets, tmp_path):
    """None of it needs torch."""
    empty, table, out = tmp_path / "empty", tmp_path / "sets.csv", tmp_path / "out"
    empty.mkdir()
    table.write_text("den,a.jpg\nhall,b.jpg\nDen,c.jpg\n")
    cases = (
        (("nowhere", "-o", out), "neither a folder nor a table"),
        ((empty, "-o", out), "no sub-folders"),
        ((table, "-o", out), "lines 1 and 3 are both called 'Den'"),
        ((sets, "-o", out, "--export", ".doc"), "--export .doc is not an ending"),
        ((sets, "-o", out, "--export", ".langflash"), "--export .langflash is not an ending"),
        ((sets, "-o", out, "--export", ".json"), "needs a phrase"),
        ((sets, "-o", out, "--prompt", " "), "a prompt is empty"),
        ((sets, "-o", out, "--weights", table), "not a readable safetensors file"),
        ((sets, "-o", out, "--workers", "0"), "--workers"),
        ((sets, "-o", sets), "choose another -o"),
        ((sets, "-o", table), "is not a folder"),
    )
    found = told([("batch", *words) for words, _ in cases])
    for (words, said), (code, _, err) in zip(cases, found, strict=True):
        assert code == 2 and said in err and err.count("\n") == 1, (words, err)
    assert not out.exists()


def test_another_table_called_ledger(sets, run, tmp_path):
    (tmp_path / "ledger.csv").write_text("date,amount\n")
    outcome = run("batch", sets, "-o", tmp_path)
    assert outcome.code == 2 and "not a ledger" in outcome.err
    assert (tmp_path / "ledger.csv").read_text() == "date,amount\n"


def test_one_run_at_a_time(sets, run, tmp_path):
    with held_alone(tmp_path):
        outcome = run("batch", sets, "-o", tmp_path)
    assert outcome.code == 2 and "another run is writing" in outcome.err and not os.listdir(tmp_path)


@pytest.mark.skipif(sys.platform == "win32", reason="terminals of POSIX")
def test_the_table_on_a_terminal(sets, tmp_path):
    import pty

    (tmp_path / "sets").mkdir()
    (tmp_path / "sets" / "damaged").symlink_to(sets / "damaged")
    terminal, side = pty.openpty()
    words = ("batch", tmp_path / "sets", "-o", tmp_path / "out", *SMALL)
    child = subprocess.Popen([sys.executable, "-m", "langflash_core", *map(str, words)], stderr=side)
    os.close(side)
    shown, patience = b"", time.monotonic() + 600
    while time.monotonic() < patience:
        try:
            shown += os.read(terminal, 4096)
        except OSError:  # the other side is closed
            break
    os.close(terminal)
    assert child.wait(600) == 1
    assert b"0/1 sets" in shown and b"  damaged  0 s" in shown
    assert shown.endswith(b"\x1b[J")  # nothing of it stays
