"""Edges of depth: on smeared steps, slanted planes, thin bars, and against a pixel's own sums."""

import math

import numpy as np
import pytest
import torch
from torch.nn import functional as F

from langflash_core.depth import sharpening
from langflash_core.depth.sharpening import sharpen_depths
from langflash_core.rig.settings import SHARPENING

SIZE = 64


def _smeared(depths: torch.Tensor, sigma: float = 4.0) -> torch.Tensor:
    """Log depths (V, H, W) as a coarse network has them."""
    steps = torch.arange(-12, 13, dtype=depths.dtype)
    kernel = torch.exp(-(steps**2) / (2 * sigma**2))
    kernel = kernel / kernel.sum()
    wide = F.pad(depths.log()[:, None], (12,) * 4, mode="replicate")
    return F.conv2d(F.conv2d(wide, kernel.view(1, 1, 1, -1)), kernel.view(1, 1, -1, 1))[:, 0]


def _box(dtype: torch.dtype = torch.float32) -> tuple[torch.Tensor, torch.Tensor]:
    """A dark square at 1.5 m before a bright wall at 3 m: depths (1, H, W), images (1, 3, H, W)."""
    depths = torch.full((1, SIZE, SIZE), 3.0, dtype=dtype)
    depths[:, 16:48, 20:44] = 1.5
    images = torch.where(depths < 2, 0.2, 0.8)[:, None].expand(-1, 3, -1, -1).to(dtype)
    return depths, images.contiguous()


def test_a_smeared_step_becomes_the_photos_edge():
    depths, images = _box()
    smeared = _smeared(depths)
    before, after = ((d.exp() - depths).abs() > 0.15 for d in (smeared, sharpen_depths(smeared, images)))
    assert before.float().mean() > 0.15
    # What is left are corners, which the smear has rounded, and the feet of the slope, near one side anyway.
    assert after.sum() < 0.3 * before.sum()


def test_no_depth_between_the_two_is_left_on_a_straight_edge():
    depths, images = _box()
    row = sharpen_depths(_smeared(depths), images).exp()[0, 32]
    between = (row > 1.5 * 1.12) & (row < 3.0 / 1.12)
    assert int(between.sum()) <= 2  # a pixel at each of two edges


@pytest.mark.parametrize("slope", [0.5, 2.0, 6.0])
def test_a_slanted_plane_stays(slope):
    """Up to 80 degrees: 1/z is linear; stripes across it are no reason to cut."""
    column = torch.linspace(0, 1, SIZE)
    depths = (1.0 / (0.2 + 0.1 * slope * (0.2 + column))).expand(1, SIZE, SIZE)
    images = (torch.arange(SIZE) // 8 % 2).float().expand(1, 3, SIZE, SIZE)
    changed = (sharpen_depths(depths.log(), images) - depths.log()).abs()
    assert changed.max() < 0.02  # a slope of 80 degrees is .02 a pixel


def test_thin_bars_survive():
    """Bars two pixels wide that the map knows stay; the sharpened map has no fewer of their pixels near."""
    depths = torch.full((1, SIZE, SIZE), 3.0)
    for first in range(10, SIZE - 4, 16):
        depths[:, :, first : first + 2] = 1.5
    images = torch.where(depths < 2, 0.2, 0.8)[:, None].expand(-1, 3, -1, -1).contiguous()
    known = depths.log()
    kept = sharpen_depths(known, images)
    torch.testing.assert_close(kept[depths < 2], known[depths < 2], atol=0.02, rtol=0)
    assert (kept - known).abs()[depths > 2].max() < 0.1


def test_sums_are_those_of_a_pixel_by_itself():
    """The twin goes through the places of one pixel in numpy, float64."""
    torch.manual_seed(0)
    logs = torch.rand(1, 40, 36, dtype=torch.float64)
    images = torch.rand(1, 3, 40, 36, dtype=torch.float64)
    flat = sharpening._flatness(logs)
    colours = sharpening._colours(images)
    middle = torch.full_like(logs, 0.5)
    wide = [
        F.pad(m, (SHARPENING.reach,) * 4, mode="replicate") for m in (logs[:, None], flat[:, None], colours)
    ]
    found = sharpening._part_depths(wide[0], wide[1], middle, sharpening._places(), colours, wide[2])
    for row, column in ((20, 18), (0, 0), (39, 35), (3, 30)):
        sums = np.zeros((2, 2))
        for down, across in sharpening._places():
            r, c = min(max(row + down, 0), 39), min(max(column + across, 0), 35)
            gap = ((colours[0, :, r, c] - colours[0, :, row, column]) ** 2).sum()
            weight = float(flat[0, r, c]) * math.exp(-(down**2 + across**2) / (2 * 12.0**2))
            weight *= math.exp(max(-float(gap) / (2 * 0.08**2), -20.0))
            part = int(logs[0, r, c] >= 0.5)
            sums[part] += weight, weight * float(logs[0, r, c])
        for part in (0, 1):
            weight = float(found.weights[part, 0, row, column])
            assert weight == pytest.approx(sums[part, 0] + 1e-6, rel=1e-9)
            assert float(found.means[part, 0, row, column]) == pytest.approx(
                (sums[part, 1] + 0.5e-6) / weight, rel=1e-9
            )


@pytest.mark.parametrize("far", [5.0, 40.0])
def test_hard_cases_stay_finite_and_within_what_was_there(far):
    """Sky, a picture without texture, pictures smaller than the reach."""
    for size in ((14, 28), (56, 70)):
        logs = torch.zeros(2, *size)
        logs[:, :, size[1] // 2 :] = far
        for images in (torch.zeros(2, 3, *size), torch.rand(2, 3, *size)):
            kept = sharpen_depths(logs, images)
            assert torch.isfinite(kept).all()
            assert kept.min() >= -1e-3 and kept.max() <= far + 1e-3  # float32 of 40


def test_float32_chooses_as_float64():
    depths, images = _box(torch.float64)
    exact = sharpen_depths(_smeared(depths), images)
    fast = sharpen_depths(_smeared(depths).float(), images.float()).double()
    # A choice may fall the other way where both sides weigh the same to six digits.
    assert ((exact - fast).abs() > 1e-3).float().mean() < 0.002
