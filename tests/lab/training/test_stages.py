"""Every stage learns four small rooms: its loss falls clearly, and only its own modules move."""

from dataclasses import replace
from pathlib import Path

import pytest
import torch
from torch.nn import functional as F

from langflash_core.lab.training.loop import LoopOptions, train_stage
from langflash_core.lab.training.stages.depth import perturbed_poses
from langflash_core.lab.training.stages.grouping import group_masks
from langflash_core.lab.training.stages.language import thinned
from langflash_core.lab.training.stages.pixels import balanced_pixels, nearest
from langflash_core.lab.training.stages.stage import tokens_of
from langflash_core.lab.training.stages.table import STAGES
from langflash_core.lab.training.validation import MEASURES, Validator

# Steps, learning rate, and the share of the first loss that must be left: about twice what was seen.
OVERFIT = {
    "depth": (20, 2e-3, 0.6),
    "refine": (24, 2e-3, 0.85),
    "gaussians": (10, 2e-2, 0.9),
    "language": (14, 2e-3, 0.8),  # a thing has many names, unrelated here: they cannot all be met
    "grouping": (14, 2e-3, 0.85),
    "aggregation": (14, 1e-2, 0.9),  # likewise
}


def loss_of(network, stage, rooms, words) -> float:
    """Loss of one fixed batch."""
    fixed = replace(words, generator=torch.Generator().manual_seed(7))
    with torch.no_grad():
        views = max(stage.views)
        return float(stage.loss(network, rooms.draw(4, views, fixed.generator), fixed).total)


@pytest.mark.slow
@pytest.mark.parametrize("name", list(STAGES))
def test_a_stage_overfits_four_rooms(name, rooms, words, network, tmp_path: Path):
    stage, net = STAGES[name], network()
    steps, rate, share = OVERFIT[name]
    if name == "gaussians":  # starts nearly transparent and has to become visible
        with torch.no_grad():
            net.gaussian_head.head[-1].bias[0] = -4
    before = loss_of(net, stage, rooms, words)
    kept = {k: v.clone() for k, v in net.state_dict().items()}
    options = LoopOptions(
        minutes=10, max_steps=steps, pictures=4, learning_rate=rate, ema_decay=0.5, save_s=1e9
    )
    train_stage(net, stage, rooms, words, tmp_path, options)
    after = loss_of(net, stage, rooms, words)
    assert after < share * before
    own = tuple(f"{module}." for module in stage.modules)
    moved = {k for k, v in net.state_dict().items() if not torch.equal(v, kept[k])}
    assert moved
    assert all(k.startswith(own) for k in moved)


@pytest.mark.parametrize("name", list(STAGES))
def test_a_stage_can_be_measured(name, rooms, words, network):
    measure, views = MEASURES[name]
    with torch.inference_mode():
        values = Validator(rooms, words, measure, views)(network().eval())
    assert values
    assert all(v == v or "miou" in k for k, v in values.items())  # finite, or a class that never occurs


def test_the_drawn_pixels_read_what_the_whole_head_gives(rooms, words, network):
    net = network()
    head = net.language_head.eval()
    with torch.no_grad():
        tokens = tokens_of(net, rooms.draw(2, 1, words.generator))
        hidden = head.hidden(tokens)
        rows = hidden[1].flatten(1).T[[3, 100]]
        vectors = F.normalize(F.linear(rows, head.out.weight[:, :, 0, 0], head.out.bias), dim=-1)
        whole = head(tokens)[1, 0].flatten(1).T[[3, 100]]
    torch.testing.assert_close(vectors, whole, atol=1e-5, rtol=1e-4)  # float32, another order of sums


def test_thinned_tokens_lose_whole_channels_and_keep_their_mean(rooms, words):
    tokens = rooms.draw(2, 2, words.generator).tokens
    ones = replace(tokens, hooks=tuple(torch.ones_like(hook) for hook in tokens.hooks))
    thin = thinned(ones, 0.25, torch.Generator().manual_seed(0))
    for hook in thin.hooks:
        assert bool(((hook == 0) | (hook == 1 / 0.75)).all())
        assert bool((hook == hook[:, :, :1]).all())  # a channel goes from every token of a view
    # 4 hooks x 4 views x 384 channels: the mean's deviation is sqrt(.25 / .75 / 6144) = .007.
    means = torch.stack([hook[:, :, 0].mean() for hook in thin.hooks])
    assert abs(float(means.mean()) - 1) < 0.03
    assert len({tuple(hook[b, v, 0].tolist()) for hook in thin.hooks for b in (0, 1) for v in (0, 1)}) == 16


def test_pixels_are_drawn_evenly_over_instances():
    ids = torch.zeros(40, 40, dtype=torch.long)
    ids[:4, :4] = 1  # 16 of 1600 pixels
    ids[20, 20] = 255
    chosen = balanced_pixels(ids, torch.ones(2), 2000, torch.Generator().manual_seed(0))
    share = float((ids.flatten()[chosen] == 1).float().mean())
    # Chances go with the square root of areas: 4 / (4 + 39.8) = 0.091; 4 sigma are 0.026.
    assert 0.065 < share < 0.117
    assert not bool((ids.flatten()[chosen] == 255).any())
    nothing = torch.full((4, 4), 255)
    assert len(balanced_pixels(nothing, torch.ones(2), 10, torch.Generator())) == 0


def test_small_instances_are_no_groups():
    ids = torch.zeros(2, 10, 10, dtype=torch.long)
    ids[0, :3, :3], ids[1, :2, :2], ids[:, 9] = 1, 1, 255
    ids[0, 8, :5] = 2
    masks, kept = group_masks(ids)
    assert kept.tolist() == [0, 1]  # 13 pixels over both views are enough, 5 are not
    assert masks.shape == (2, 200)
    assert masks.sum(1).tolist() == [200 - 13 - 5 - 20, 13]


def test_nearest_keeps_ids():
    ids = torch.arange(16).reshape(4, 4)
    assert nearest(ids, (2, 2)).tolist() == [[5, 7], [13, 15]]
    assert torch.equal(nearest(ids, (4, 4)), ids)
    assert torch.equal(nearest(ids, (8, 8))[::2, ::2], ids)


def test_perturbed_poses_stay_rigid_and_near():
    poses = torch.eye(4).repeat(3, 2, 1, 1)
    poses[:, 1, 0, 3] = 0.5
    moved = perturbed_poses(poses, torch.Generator().manual_seed(0), degrees=0.2, share=0.02)
    rotations = moved[..., :3, :3]
    identity = rotations @ rotations.transpose(-1, -2)
    # Three products of numbers up to 1, and the turns before, in float32.
    torch.testing.assert_close(identity, torch.eye(3).expand_as(identity), atol=3e-6, rtol=0)
    assert torch.equal(moved[:, 0], poses[:, 0])
    assert 0 < float((moved - poses).abs().max()) < 0.06  # 5 sigma of 2 % of 0.5, and of 0.2 degrees
