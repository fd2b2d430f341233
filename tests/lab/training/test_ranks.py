"""Steps that are shared: by processes, by batches one after the other, by a run and its continuation."""

import json
import os
import subprocess
import sys
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import pytest
import torch

from langflash_core.errors import InputError, MissingPackageError
from langflash_core.lab.training.draws import begin_draws
from langflash_core.lab.training.loop import LoopOptions, train_stage
from langflash_core.lab.training.stages.stage import Loss
from langflash_core.lab.training.stages.table import STAGES
from tests.lab.training.reference import plain_training
from tests.lab.training.shared_steps import train

STAGE = STAGES["refine"]
# Time never ends a stage here, so that the rate follows the steps alone.
OPTIONS = LoopOptions(minutes=1e6, max_steps=4, pictures=2, report_s=0.0, save_s=0.0, precision="float32")


def _rows(run: Path, stage: str, kind: str) -> list[dict]:
    """Of a log, without the time."""
    rows = [json.loads(line) for line in (run / f"{stage}.jsonl").read_text().splitlines()]
    return [{**row, "seconds": 0} for row in rows if row["kind"] == kind]


def _losses(run: Path, stage: str) -> list[float]:
    return [row["loss"] for row in _rows(run, stage, "train")]


@pytest.fixture
def folder(rooms) -> Path:
    return rooms.folder


@pytest.mark.slow
def test_two_processes_learn_what_one_learns_of_the_same_batches(folder, tmp_path):
    stages, steps = ["language", "grouping", "refine!"], 2
    script = Path(__file__).with_name("shared_steps.py")
    launcher = [sys.executable, "-m", "torch.distributed.run", "--standalone", "--nproc-per-node=2"]
    words = [str(script), str(folder), str(tmp_path / "two"), "2", str(steps), *stages]
    done = subprocess.run([*launcher, *words], env=os.environ, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr
    train(folder, tmp_path / "one", 2, steps, stages)
    for name in stages:
        one, two = _losses(tmp_path / "one", name), _losses(tmp_path / "two", name)
        assert len(one) == steps and len(set(one)) == steps
        assert two == pytest.approx(one, rel=1e-5, abs=2e-7), name  # the log keeps seven digits
        skipped = _rows(tmp_path / "one", name, "skipped")
        assert skipped == _rows(tmp_path / "two", name, "skipped") and len(skipped) == name.count("!")
        a, b = (torch.load(tmp_path / run / f"{name}.pt", weights_only=True) for run in ("one", "two"))
        for key, value in a["weights"].items():
            # Gradients are added in another order: a few 1e-7 of each, and AdamW's first steps are their
            # signs, so where one is nearly 0 a weight may go the other way. Few do.
            far = (value - b["weights"][key]).abs() > 1e-6
            assert far.float().mean() < 0.01, key
        assert len(a["draws"]) == len(b["draws"]) == 2 and a["begun"] == b["begun"]
        for mine, theirs in zip(a["draws"], b["draws"], strict=True):
            assert torch.equal(mine["own"], theirs["own"]) and torch.equal(mine["common"], theirs["common"])


def test_one_process_with_one_batch_learns_as_ever(rooms, words, network, tmp_path):
    """Weights to the bit: recipes written down before steps could be shared still give their networks."""
    run = network()
    train_stage(run, STAGE, rooms, words, tmp_path, replace(OPTIONS, precision="auto"))
    again = replace(words, generator=torch.Generator().manual_seed(0))
    averaged, losses = plain_training(network(), STAGE, rooms, again, steps=4, pictures=2)
    assert _losses(tmp_path, "refine") == [round(loss, 7) for loss in losses]
    own = run.state_dict()
    assert averaged and all(torch.equal(own[key], value) for key, value in averaged.items())


@pytest.mark.parametrize("batches", [1, 2])
def test_an_interrupted_run_has_the_same_curve(batches, rooms, words, network, tmp_path):
    options = replace(OPTIONS, batches=batches)

    def noisy(net, batch, words):  # as layers that draw from torch's common generator
        found = STAGE.loss(net, batch, words)
        return Loss(found.total * (1 + 0.1 * torch.rand(())), found.parts)

    stage, net = replace(STAGE, loss=noisy), network()
    torch.manual_seed(5)
    whole = train_stage(net, stage, rooms, words, tmp_path / "whole", options)

    class Cut(Exception):
        """Stands for a machine that stops."""

    def cut(net, batch, words, seen=[]):  # noqa: B006 - counts the calls
        seen.append(batch)
        if len(seen) > 2 * batches:
            raise Cut
        return noisy(net, batch, words)

    begin = replace(words, generator=torch.Generator().manual_seed(0))
    net = network()
    torch.manual_seed(5)
    with pytest.raises(Cut):
        train_stage(net, replace(STAGE, loss=cut), rooms, begin, tmp_path / "cut", options)
    later = replace(words, generator=torch.Generator().manual_seed(77))  # what it draws is in the run
    net = network()
    torch.manual_seed(99)
    with (tmp_path / "cut" / "refine.jsonl").open("a") as log:  # as if the last save had come before
        log.write(json.dumps({"stage": "refine", "step": 3, "kind": "train", "loss": 1.0}) + "\n")
    ended = train_stage(net, stage, rooms, later, tmp_path / "cut", options)
    assert ended.step == whole.step == 4
    assert _losses(tmp_path / "cut", "refine") == _losses(tmp_path / "whole", "refine")
    for key, value in whole.ema.items():
        assert torch.equal(value, ended.ema[key]), key


def test_a_run_of_other_batches_is_refused_in_one_sentence(rooms, words, network, tmp_path):
    options = replace(OPTIONS, max_steps=1, batches=2)
    train_stage(network(), STAGE, rooms, words, tmp_path, options)
    with pytest.raises(InputError, match=r"has 2 batches a step, not 1; go on with --batches 2"):
        train_stage(network(), STAGE, rooms, words, tmp_path, replace(options, batches=1, max_steps=2))
    with pytest.raises(InputError, match=r"0 batches a step cannot be shared by 1 processes"):
        begin_draws(words, 0, 0)


def test_batches_of_a_step_see_different_rooms(words):
    first, second, third = begin_draws(words, 3, 0)
    drawn = [torch.randint(10**6, (8,), generator=each.words.generator) for each in (first, second, third)]
    assert len({tuple(row.tolist()) for row in drawn}) == 3
    common = []
    for each in (first, second, third):
        with each.drawing():
            common.append(tuple(torch.rand(8).tolist()))
    assert len(set(common)) == 3


def test_what_gives_no_finite_loss_is_named(rooms, words, network, tmp_path):
    def broken(net, batch, words):
        return Loss(sum(p.sum() for p in net.refiner.parameters()) * torch.tensor(torch.nan))

    with pytest.raises(RuntimeError, match=r"no finite loss, the last with the batches \[\(\d+, *\d*\)\]"):
        train_stage(network(), replace(STAGE, loss=broken), rooms, words, tmp_path, OPTIONS)
    rows = [json.loads(line) for line in (tmp_path / "refine.jsonl").read_text().splitlines()]
    assert len(rows) == 20 and all(row["kind"] == "skipped" for row in rows)
    assert set(rows[0]["seeds"][0]) <= set(range(4))  # the toy rooms


def test_the_profile_says_where_time_went(rooms, words, network, tmp_path):
    state = train_stage(network(), STAGE, rooms, words, tmp_path, replace(OPTIONS, max_steps=2))
    last = json.loads((tmp_path / "refine.jsonl").read_text().splitlines()[-1])
    assert last["kind"] == "profile"
    parts = [last[name] for name in ("reading", "forward", "backward", "update")]
    assert all(part > 0 for part in parts)
    assert sum(parts) <= state.seconds + 0.01 and sum(parts) > 0.9 * state.seconds


def test_tensorboard_is_asked_for_in_one_sentence_where_it_is_missing(rooms, words, network, tmp_path):
    if find_spec("tensorboard") is None:
        with pytest.raises(MissingPackageError, match=r"tensorboard.*pip install 'langflash\[board\]'"):
            train_stage(network(), STAGE, rooms, words, tmp_path, replace(OPTIONS, board=True))
        assert not list(tmp_path.iterdir())
        return
    train_stage(network(), STAGE, rooms, words, tmp_path, replace(OPTIONS, max_steps=1, board=True))
    assert list((tmp_path / "board" / "refine").glob("events.*"))
