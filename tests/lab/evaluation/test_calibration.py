"""The threshold of several sets, and what the diagram says of their scores."""

import io

import numpy as np
import pytest
import torch
from PIL import Image

from langflash_core.errors import InputError
from langflash_core.lab.evaluation.calibration import (
    Asked,
    best_threshold,
    calibration,
    reliability,
    trade_off,
)
from langflash_core.lab.evaluation.rooms.phrases import MASK_THRESHOLDS
from langflash_core.language.leads import nearer_threshold
from langflash_core.network import MINI, GuidedDepthNet


def asked(border: float, seed: int = 0, scenes: int = 16) -> Asked:
    """Phrases that are there score above `border`, others below; masks are best right at it."""
    numbers = torch.Generator().manual_seed(seed)
    scores, truths, ious = [], [], []
    for _ in range(scenes):
        truth = torch.arange(10) < 5
        spread = torch.rand(10, generator=numbers) * 0.2
        scores.append(torch.where(truth, border + 0.005 + spread, border - 0.005 - spread))
        truths.append(truth)
        off = (torch.tensor(MASK_THRESHOLDS) - border).abs()
        ious += [1 - off for _ in range(5)]
    return Asked.of(scores, truths, ious)


def test_the_threshold_lies_where_the_set_is_parted():
    found = asked(0.7)
    assert MASK_THRESHOLDS[best_threshold({"rooms": found})] == pytest.approx(0.7, abs=0.006)


def test_sets_count_the_same_however_large():
    """A large set of rooms does not drown a small one of photos."""
    few = MASK_THRESHOLDS[best_threshold({"rooms": asked(0.5, 0, 64), "photos": asked(0.62, 1, 8)})]
    many = MASK_THRESHOLDS[best_threshold({"rooms": asked(0.5, 0, 8), "photos": asked(0.62, 1, 64)})]
    assert few == pytest.approx(many, abs=0.021)
    both = torch.cat((asked(0.5, 0, 64).scores, asked(0.62, 1, 8).scores))
    assert len(both) == 720  # joined, the rooms would have nine tenths of the say


def test_what_the_header_keeps():
    net = GuidedDepthNet(MINI)
    found = calibration(net, {"rooms": asked(0.7), "photos": asked(0.7, 1)})
    assert nearer_threshold(found["threshold"], found["temperature"]) == pytest.approx(0.7, abs=0.006)
    assert found["threshold"] > 0.75 and found["negatives"]
    for name in ("rooms", "photos"):
        row = found["validation"][name]
        assert row["precision"] == row["recall"] == row["crossed_precision"] == 1 and row["phrases"] == 160
        assert sum(r["phrases"] for r in found["reliability"][name]) == 160


def test_crossing_shows_what_was_fitted_by_chance():
    """Scores that say nothing: a threshold fits half of them by chance, and not the other half."""
    numbers = torch.Generator().manual_seed(3)
    scores = [torch.rand(10, generator=numbers) for _ in range(16)]
    truths = [torch.rand(10, generator=numbers) < 0.5 for _ in range(16)]
    ious = [torch.zeros(len(MASK_THRESHOLDS)) for t in truths for _ in range(int(t.sum()))]
    row = calibration(GuidedDepthNet(MINI), {"noise": Asked.of(scores, truths, ious)})["validation"]["noise"]
    level = min(row["precision"], row["recall"])
    assert min(row["crossed_precision"], row["crossed_recall"]) < level


def test_halves_are_whole_neighbouring_scenes():
    found = asked(0.7)
    assert found.halves.unflatten(0, (16, 10)).float().std(1).max() == 0
    assert found.halves[::10].tolist() == [0, 0, 1, 1] * 4
    assert len(found.half(0).scores) == len(found.half(1).scores) == 80
    assert len(found.half(0).ious) == 40


def test_reliability_of_known_scores():
    scores = torch.linspace(0.01, 0.99, 200)
    found = Asked(scores, scores > 0.5, torch.zeros(1, 70), torch.zeros(200), torch.zeros(1))
    rows = reliability(found, bins=10)
    assert [row["present"] for row in rows] == [0] * 5 + [1] * 5
    assert rows[0]["score"] == pytest.approx(float(scores[:20].mean()), abs=1e-4)
    assert all(precision == 1 for t, precision, _ in trade_off(found) if t > 0.5)


def test_nothing_asked_is_refused():
    with pytest.raises(InputError, match="nothing could be asked"):
        Asked.of([], [], [])


def test_the_diagram_is_drawn():
    pytest.importorskip("matplotlib")
    from langflash_core.lab.evaluation.calibration_plot import calibration_png

    png = calibration_png({"rooms": asked(0.7), "photos": asked(0.6, 1)}, 0.66)
    picture = np.asarray(Image.open(io.BytesIO(png)).convert("RGB"))
    assert picture.shape[1] > 600 and len(np.unique(picture.reshape(-1, 3), axis=0)) > 20
