"""Backgrounds that go on under what hides them."""

import torch

from langflash_core.network.occlusion import extended, under_edges

K = torch.tensor([[40.0, 0, 16], [0, 40.0, 12], [0, 0, 1]])[None]


def _step() -> torch.Tensor:
    """(1, 24, 32): 2 m on the left, 4 m from column 16 on."""
    depths = torch.full((1, 24, 32), 2.0)
    depths[:, :, 16:] = 4.0
    return depths.log()


def test_only_the_last_pixel_of_the_background_moves_and_under_the_thing():
    logs = _step()
    pos, scales = torch.zeros(1, 24, 32, 3), torch.full((1, 24, 32, 3), 0.01)
    moved, wider = extended(pos, scales, logs, K)
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
        moved, wider = extended(pos, scales, logs, K.expand(len(logs), 3, 3))
        assert torch.equal(moved, pos) and torch.equal(wider, scales)
