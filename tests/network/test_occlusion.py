"""Backgrounds that go on under what hides them, and things that end at their edges."""

import torch

from langflash_core.network.gaussians import footprints
from langflash_core.network.occlusion import extend_surfaces, over_edges, under_edges

K = torch.tensor([[40.0, 0, 16], [0, 40.0, 12], [0, 0, 1]])[None]


def _step() -> torch.Tensor:
    """(1, 24, 32): 2 m on the left, 4 m from column 16 on."""
    depths = torch.full((1, 24, 32), 2.0)
    depths[:, :, 16:] = 4.0
    return depths.log()


def test_only_the_last_pixel_of_the_background_moves_and_under_the_thing():
    logs = _step()
    pos, scales = torch.zeros(1, 24, 32, 3), torch.full((1, 24, 32, 3), 0.01)
    moved, wider = extend_surfaces(pos, scales, logs, K)
    changed = (moved != pos).any(-1)
    assert changed[0, :, 16].all() and int(changed.sum()) == 24
    torch.testing.assert_close(moved[0, 5, 16], torch.tensor([-5 * 4.0 / 40, 0.0, 0.0]))
    torch.testing.assert_close(wider[0, 5, 16], torch.tensor([0.5, 0.5, 0.01]))
    assert (wider[0, :, :16] == 0.01).all()


def test_slopes_and_gaps_one_pixel_wide_stay():
    slope = torch.linspace(0, 1, 32).expand(1, 24, 32)  # .03 a pixel: 70 degrees
    assert not under_edges(slope).any()
    gap = torch.zeros(1, 24, 32)
    gap[:, :, 10] = 0.7
    assert not under_edges(gap).any()


def test_one_pixel_and_no_jump():
    for logs in (torch.zeros(1, 1, 1), torch.zeros(2, 6, 5)):
        pos, scales = torch.rand(*logs.shape, 3), torch.rand(*logs.shape, 3)
        moved, wider = extend_surfaces(pos, scales, logs, K.expand(len(logs), 3, 3))
        assert torch.equal(moved, pos) and torch.equal(wider, scales)


def test_the_last_element_of_a_thing_is_drawn_back_from_its_edge():
    """By .3 of a pixel, and half as long across the edge; along it, and all others, stay."""
    logs = _step()
    edges = over_edges(logs)
    assert (edges[0, :, 15, 0] == 1).all() and int(edges.abs().sum()) == 24
    plain, back = footprints(logs.exp(), K), footprints(logs.exp(), K, edges)
    moved = back[0] - plain[0]
    torch.testing.assert_close(moved[0, 5, 15], torch.tensor([-0.3 * 2.0 / 40, 0.0, 0.0]))
    assert int((moved != 0).any(-1).sum()) == 24
    ratio = (back[2] / plain[2])[0, 5, 15].sort().values
    torch.testing.assert_close(ratio, torch.tensor([0.5, 1.0, 1.0]))


def test_edges_are_the_same_from_either_side_and_upside_down():
    logs = _step()
    assert torch.equal(over_edges(logs.flip(-1)).flip(2)[..., 0], -over_edges(logs)[..., 0])
    assert torch.equal(over_edges(logs.mT).transpose(1, 2).flip(-1), over_edges(logs))


def test_steep_slopes_and_their_feet_have_no_edge():
    column = torch.arange(32.0)
    slope = (0.09 * column).expand(1, 24, 32)  # 74 degrees at 40 pixels of focal length
    assert not over_edges(slope)[:, :, 1:].any()
    foot = (0.04 * (column - 16).clamp_min(0)).expand(1, 24, 32)
    assert not over_edges(foot).any()


def test_a_bar_one_pixel_wide_is_not_drawn_anywhere():
    bar = torch.full((1, 24, 32), 4.0).log()
    bar[:, :, 10] = 0.0
    assert not over_edges(bar)[:, :, 10].any()
