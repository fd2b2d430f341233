"""The paper's network in small learns four small rooms through the same stages as `mini`."""

from dataclasses import replace
from pathlib import Path

import pytest
import torch

from langflash_core.errors import InputError
from langflash_core.lab.training.loop import LoopOptions, train_stage
from langflash_core.lab.training.losses import point_loss
from langflash_core.lab.training.stages.stage import modules_of
from langflash_core.lab.training.stages.table import POINT_STAGES, STAGES
from langflash_core.network import PointMapNet, build_network
from tests.lab.training.test_stages import loss_of
from tests.network.sizes import TINY

# As `full`, but with masks by tau_exist: a freshly trained existence head knows no predicted IoU.
SIZES = replace(TINY, mask_filter=None, language_dim=384)
# Steps, learning rate, and the share of the first loss that may be left; seen: .49, .8, .30.
OVERFIT = {"points": (20, 1.5e-2, 0.65), "grouping": (12, 1e-2, 0.88), "aggregation": (8, 1e-2, 0.6)}


@pytest.fixture
def tiny() -> PointMapNet:
    torch.manual_seed(0)
    return build_network(SIZES).eval()


@pytest.mark.slow
@pytest.mark.parametrize("name", list(POINT_STAGES))
def test_a_stage_overfits_four_rooms(name, rooms, words, tiny, tmp_path: Path):
    stage = POINT_STAGES[name]
    steps, rate, share = OVERFIT[name]
    if name == "aggregation":  # reads groups, which need masks first
        first = POINT_STAGES["grouping"]
        options = LoopOptions(minutes=10, max_steps=6, pictures=4, learning_rate=1e-2)
        train_stage(tiny, first, rooms, words, tmp_path, replace(options, ema_decay=0.5, save_s=1e9))
    before = loss_of(tiny, stage, rooms, words)
    kept = {k: v.clone() for k, v in tiny.state_dict().items()}
    options = LoopOptions(
        minutes=10, max_steps=steps, pictures=4, learning_rate=rate, ema_decay=0.5, save_s=1e9
    )
    train_stage(tiny, stage, rooms, words, tmp_path, options)
    after = loss_of(tiny, stage, rooms, words)
    assert after < share * before
    own = tuple(f"{module}." for module in modules_of(tiny, stage))
    moved = {k for k, v in tiny.state_dict().items() if not torch.equal(v, kept[k])}
    assert moved and all(k.startswith(own) for k in moved)


@pytest.mark.parametrize("name", ["depth", "refine", "gaussians", "language"])
def test_stages_of_guided_depth_say_that_they_do_not_fit(name, rooms, words, tiny):
    batch = rooms.draw(1, 3, words.generator)
    with pytest.raises(InputError, match="has no such stage; train points, grouping, aggregation"):
        STAGES[name].loss(tiny, batch, words)


def test_points_do_not_fit_guided_depth(rooms, words, network):
    with pytest.raises(InputError, match="predicts depth"):
        POINT_STAGES["points"].loss(network(), rooms.draw(1, 2, words.generator), words)


def test_point_loss_knows_no_unit_and_counts_what_is_valid():
    torch.manual_seed(0)
    targets = torch.randn(2, 2, 4, 5, 3)
    valid = torch.rand(2, 2, 4, 5) > 0.3
    assert point_loss(7 * targets, targets, valid) < 1e-6  # float32
    spoiled = torch.where(valid[..., None], targets, torch.full_like(targets, torch.nan))
    points = targets + torch.randn_like(targets)
    assert torch.equal(point_loss(points, spoiled, valid), point_loss(points, targets, valid))
    scenes = []
    for x, t, v in zip(points, targets, valid, strict=True):
        x, t = x[v] / x[v].norm(dim=-1).mean(), t[v] / t[v].norm(dim=-1).mean()
        scenes.append((x - t).norm(dim=-1))
    torch.testing.assert_close(point_loss(points, targets, valid), torch.cat(scenes).mean())
    nothing = point_loss(points.requires_grad_(), targets, torch.zeros_like(valid))
    assert nothing == 0 and nothing.requires_grad
