"""The loop: rates, resuming, logs, and a loss that is not finite."""

import json
import math
from dataclasses import replace
from pathlib import Path

import pytest
import torch

from langflash_core.errors import InputError
from langflash_core.lab.training.loop import LoopOptions, train_stage
from langflash_core.lab.training.stages.stage import Loss
from langflash_core.lab.training.stages.table import STAGES
from langflash_core.lab.training.states import load_averaged

OPTIONS = LoopOptions(minutes=10, max_steps=2, pictures=2, report_s=0.0, validate_s=0.0, save_s=1e9)
STAGE = STAGES["refine"]  # the smallest


def test_a_run_continues_where_it_stopped(rooms, words, network, tmp_path: Path):
    first = train_stage(network(), STAGE, rooms, words, tmp_path, OPTIONS, lambda net: {"zero": 0.0})
    assert first.step == 2
    again = network()
    second = train_stage(again, STAGE, rooms, words, tmp_path, replace(OPTIONS, max_steps=3))
    assert second.step == 3
    assert second.seconds > first.seconds
    fresh = network()
    assert load_averaged(fresh, tmp_path, "refine") == (3, pytest.approx(second.seconds))
    assert all(torch.equal(fresh.state_dict()[k], v) for k, v in second.ema.items())
    assert load_averaged(fresh, tmp_path, "depth") is None
    rows = [json.loads(line) for line in (tmp_path / "refine.jsonl").read_text().splitlines()]
    assert {row["kind"] for row in rows} == {"train", "validation", "profile"}
    assert all(math.isfinite(row["loss"]) for row in rows if row["kind"] == "train")


def test_a_run_of_other_parts_does_not_go_on(rooms, words, network, tmp_path: Path):
    """As one from before a part was there: one sentence, not the optimiser's complaint."""
    train_stage(network(), STAGE, rooms, words, tmp_path, replace(OPTIONS, max_steps=1))
    saved = torch.load(tmp_path / "refine.pt", weights_only=True)
    saved["weights"].pop("refiner.sharpness")
    torch.save(saved, tmp_path / "refine.pt")
    with pytest.raises(InputError, match="other parts"):
        train_stage(network(), STAGE, rooms, words, tmp_path, OPTIONS)


def test_a_step_without_a_finite_loss_changes_nothing(rooms, words, network, tmp_path: Path):
    net = network()
    kept = {k: v.clone() for k, v in net.state_dict().items()}

    def broken(network, batch, words):
        return Loss(sum(p.sum() for p in network.refiner.parameters()) * torch.tensor(torch.nan))

    with pytest.raises(RuntimeError, match="no finite loss"):
        train_stage(net, replace(STAGE, loss=broken), rooms, words, tmp_path, OPTIONS)
    assert all(torch.equal(v, kept[k]) for k, v in net.state_dict().items())
