"""Ripples that go, and what stays: planes, edges, creases, things on a wall; against a pixel's own fit."""

import math

import numpy as np
import pytest
import torch

from langflash_core.depth.planes import fitted_planes, flatten_ripples
from langflash_core.geometry.cameras import rays
from langflash_core.rig.settings import FLATTENING

SIZE = (96, 112)
K = torch.tensor([[100.0, 0, 56], [0, 100.0, 48], [0, 0, 1]], dtype=torch.float64)


def _wall(tilt: float = 0.5) -> torch.Tensor:
    """Log depths (1, H, W) of a slanted wall at 2 m in the middle."""
    x = rays(K, SIZE[1], SIZE[0])[..., 0]
    return (2 / (1 - tilt * x)).log()[None]


def _rippled(logs: torch.Tensor, height: float) -> torch.Tensor:
    """A wave of a token's length in both directions."""
    y, x = torch.meshgrid(torch.arange(SIZE[0]), torch.arange(SIZE[1]), indexing="ij")
    return logs + height * torch.sin(2 * math.pi * x / 16) * torch.cos(2 * math.pi * y / 16)


def _errors(of: float) -> torch.Tensor:
    return torch.full((1, *SIZE), math.log(of), dtype=torch.float64)


@pytest.mark.parametrize("tilt", [0.0, 0.5, -1.0])
def test_ripples_of_a_slanted_wall_go(tilt):
    wall = _wall(tilt)
    flat = flatten_ripples(_rippled(wall, 0.01), _errors(0.08))
    inner = (slice(None), slice(14, -14), slice(14, -14))  # at the border a window may hold half a wave
    assert (flat - wall)[inner].abs().mean() < 0.3 * 0.01 * (2 / math.pi) ** 2  # of a sine's mean


def test_a_plane_stays_to_the_last_digit():
    """Plane in inverse depth, so fits are exact; sums of float64 and two bilinear steps are left."""
    wall = _wall()
    assert (flatten_ripples(wall, _errors(0.08)) - wall).abs().max() < 1e-9


def test_what_is_more_than_a_ripple_stays():
    """An edge, a thing on the wall, and waves where the map is sure of itself."""
    edge = _wall(0.0)
    edge[:, :, 56:] += 0.3
    assert (flatten_ripples(edge, _errors(0.08)) - edge).abs().max() < 1e-6
    thing = _wall(0.0)
    thing[:, 30:50, 40:64] -= 0.1  # 20 cm before a wall at 2 m
    kept = flatten_ripples(thing, _errors(0.08))
    assert (kept - thing).abs().max() < 0.01
    waves = _rippled(_wall(), 0.03)
    changed = (flatten_ripples(waves, _errors(0.01)) - waves).abs()
    # At the border a window may hold half a wave, which is a slope: at most 2.5 of its ripples of .004.
    assert changed[:, 14:-14, 14:-14].max() < 1e-3 and changed.max() < 0.01


def test_a_corner_of_two_walls_keeps_its_depth():
    """45 degrees to either side: within a ripple of where it was."""
    x = rays(K, SIZE[1], SIZE[0])[..., 0]
    corner = (2 / (1 + x.abs())).log()[None]
    changed = (flatten_ripples(corner, _errors(0.08)) - corner).abs()
    assert changed.max() < 0.02 and changed[:, :, : 56 - 2 * max(FLATTENING.radii) - 2].max() < 1e-9


@pytest.mark.parametrize("radius", FLATTENING.radii)
def test_planes_are_those_of_least_squares(radius):
    """numpy's lstsq in a window of every kind of place is the twin."""
    maps = torch.rand(2, 1, 19, 23, dtype=torch.float64, generator=torch.Generator().manual_seed(0)) + 1
    fit, squares = fitted_planes(maps, radius)
    for row, column in ((0, 0), (9, 11), (18, 3), (4, 22)):
        rows, columns = (
            np.arange(max(place - radius, 0), min(place + radius + 1, size))
            for place, size in ((row, 19), (column, 23))
        )
        v, u = (m.ravel() for m in np.meshgrid(rows - row, columns - column, indexing="ij"))
        values = maps[1, 0, rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1].numpy().ravel()
        design = np.column_stack((np.ones(len(u)), u, v))
        best = np.linalg.lstsq(design, values, rcond=None)[0]
        assert float(fit[1, 0, row, column]) == pytest.approx(best[0], rel=1e-9)
        left = ((design @ best - values) ** 2).mean() / values.mean() ** 2
        assert float(squares[1, 0, row, column]) == pytest.approx(left, rel=1e-7)


def test_float32_is_close_to_float64_and_odd_sizes_work():
    logs = _rippled(_wall(), 0.01)
    exact, fast = (flatten_ripples(logs, _errors(0.08)), flatten_ripples(logs.float(), _errors(0.08).float()))
    assert (fast.double() - exact).abs().max() < 1e-5  # sums are float64; depths come with 7 digits
    for size in ((7, 5), (1, 1), (2, 33)):
        odd = torch.rand(3, *size)
        kept = flatten_ripples(odd, torch.full_like(odd, -2.0))
        assert kept.shape == odd.shape and torch.isfinite(kept).all()


def test_far_and_near_stay_finite():
    for depth in (-4.0, 5.0, 40.0):
        logs = torch.zeros(1, 28, 28)
        logs[:, :, 14:] = depth
        kept = flatten_ripples(logs, torch.full_like(logs, -5.0))
        assert torch.isfinite(kept).all() and (kept - logs).abs().max() < 0.05
