"""What pictures gain without a Gaussian, against pictures drawn without it."""

import numpy as np
import pytest
import torch
from torch import Tensor

from langflash_core.splat.colours import ROUNDS, solved_colours
from langflash_core.splat.hindering import Pairs, Tally
from langflash_core.splat.mixing import mixed
from langflash_core.splat.projection import ALPHA_MIN, project
from langflash_core.splat.reference import rasterize
from langflash_core.types import Camera, Gaussians
from tests.splat.scenes import camera, cloud, splats, turned


def pairs_of(gaussians: Gaussians, seen: Camera) -> Pairs:
    """All pairs that a picture has, contributions in parts of each pixel's sum, as colours are solved for."""
    footprints = project(gaussians.map(lambda v: v.double()), seen)
    matrix, light = mixed(footprints, seen, len(gaussians), faint=ALPHA_MIN, small=0.0)
    sums = np.asarray(matrix.sum(1)).ravel()
    matrix.data /= np.repeat(np.maximum(sums, 1e-9), np.diff(matrix.indptr)).astype(np.float32)
    return Pairs.of(matrix, light.astype(np.float32))


def error(gaussians: Gaussians, colours: Tensor, photo: Tensor, seen: Camera) -> float:
    """Squared error of a picture by the reference in float64."""
    maps, _ = rasterize(gaussians.map(lambda v: v.double()), colours.double(), seen)
    return float((maps - photo).square().sum())


@pytest.mark.parametrize("seed", [0, 1])
def test_gains_are_those_of_pictures_without_each(seed):
    gaussians, seen = cloud(40, size=0.1, seed=seed).gaussians, camera(24, 20, 20.0)
    drawn = torch.Generator().manual_seed(seed)
    colours = torch.rand(40, 3, generator=drawn)
    rest = torch.arange(40) >= 10  # the photo knows nothing of the others
    photo = rasterize(gaussians.rows(rest).map(lambda v: v.double()), colours[rest].double(), seen)[0].float()
    shown = np.ones(480, bool)
    found = pairs_of(gaussians, seen).gains(colours.numpy(), photo.flatten(0, 1).numpy(), shown)
    whole = error(gaussians, colours, photo, seen)
    alone = torch.arange(40)
    true = [whole - error(gaussians.rows(alone != i), colours[alone != i], photo, seen) for i in range(40)]
    # A pair at 1/255 may fall on either side of the cut: 3 channels of an error of at most 1, times 2 / 255,
    # in one pixel of some; sums of hundreds of pixels in float32 are exact to 1e-4.
    assert np.abs(found - true).max() < 2 * 3 * 2 / 255
    assert min(true) < -0.5 and max(true) > 0.5, "some help and some hinder"


def test_what_is_left_is_what_is_drawn_without_the_rest():
    gaussians, seen = cloud(60, size=0.1).gaussians, camera(24, 20, 20.0)
    gone = np.arange(60) % 3 == 0
    matrix, light = pairs_of(gaussians, seen).without(gone)
    rest = gaussians.rows(torch.from_numpy(~gone))
    footprints = project(rest.map(lambda v: v.double()), seen)
    true, stays = mixed(footprints, seen, len(rest), faint=ALPHA_MIN, small=0.0)
    assert matrix[:, np.flatnonzero(gone)].nnz == 0
    # An alpha is a contribution by the light before it, both to 1e-7, of which 1e-4 is the least: 1e-3 there,
    # times that light.
    assert np.abs(matrix[:, np.flatnonzero(~gone)] - true).max() < 1e-5
    assert np.abs(light - stays).max() < 1e-4


def test_pixels_that_are_not_shown_say_nothing():
    gaussians, seen = cloud(40, size=0.1).gaussians, camera(24, 20, 20.0)
    colours, photo = np.full((40, 3), 0.5, np.float32), np.zeros((480, 3), np.float32)
    pairs = pairs_of(gaussians, seen)
    assert np.abs(pairs.gains(colours, photo, np.zeros(480, bool))).max() == 0
    tally = Tally.of(50)
    for _ in range(3):
        tally.take(np.arange(40) + 10, pairs.gains(colours, photo, np.ones(480, bool)), pairs.sums(40))
    assert not tally.hindering.any() and (tally.gains > 0).any(), "three views let nothing go"
    tally.take(np.arange(40) + 10, pairs.gains(colours, photo, np.ones(480, bool)), pairs.sums(40))
    assert tally.hindering.any() and not tally.hindering[:10].any()


def wall_and_floaters() -> tuple[Gaussians, Tensor, list[Camera], list[Tensor]]:
    """A wall of two colours, eight cameras before it, its pictures there; and six Gaussians that hang before
    it in the colour that the wall has behind them for the first camera."""
    side = torch.linspace(-0.9, 0.9, 40).tolist()
    places = [(x, y, 2.0) for y in side for x in side]
    hanging = [(0.06 * k - 0.3, 0.02 * k - 0.1, 1.2) for k in range(6)]
    gaussians = splats([*places, *hanging], 0.03, 0.95, dtype=torch.float32)
    across = gaussians.means[:, 0] / gaussians.means[:, 2]
    colours = torch.where(
        across[:, None] > -0.05, torch.tensor([0.9, 0.2, 0.1]), torch.tensor([0.1, 0.3, 0.9])
    )
    cameras = [camera(pose=turned(0.0, (0.12 * k, 0.0, 0.0))) for k in range(8)]
    wall = gaussians.rows(torch.arange(len(gaussians)) < len(places))
    photos = [
        rasterize(wall.map(lambda v: v.double()), colours[: len(wall)].double(), seen)[0]
        .movedim(-1, 0)
        .float()
        for seen in cameras
    ]
    return gaussians, colours, cameras, photos


def test_what_hangs_before_what_others_show_is_found():
    gaussians, colours, cameras, photos = wall_and_floaters()
    told: list[float] = []
    solved = solved_colours(gaussians, colours, cameras, photos, leave_out=True, progress=told.append)
    hanging = torch.arange(len(gaussians)) >= 1600
    at_edge = hanging & (gaussians.means[:, 0] / gaussians.means[:, 2] < -0.05)
    assert bool(solved.hinders[at_edge].any())
    # Of the wall, what shows its colour in all photos stays: hardly anything goes.
    assert solved.hinders[~hanging].float().mean() < 0.01
    before = solved_colours(gaussians, colours, cameras, photos)
    assert not bool(before.hinders.any())
    assert np.mean(solved.psnr, 0)[1] > np.mean(before.psnr, 0)[1]
    assert told == sorted(told) and len(told) == 8 + ROUNDS


def test_what_gains_little_stays():
    """A wall of two layers in the photo's own colours, which noise makes a little worse: nothing goes, though
    without each alone some pictures would be nearer. What hangs before it in another colour goes."""
    side = torch.linspace(-0.9, 0.9, 40).tolist()
    places = [(x, y, z) for z in (2.0, 2.01) for y in side for x in side] + [(0.0, 0.0, 1.2)]
    gaussians = splats(places, 0.03, 0.95, dtype=torch.float32)
    cameras = [camera(pose=turned(0.0, (0.12 * k, 0.0, 0.0))) for k in range(8)]
    colours = torch.full((len(gaussians), 3), 0.5)
    colours[-1] = 0.0
    drawn = torch.Generator().manual_seed(0)
    photos = [0.5 + 0.02 * torch.randn(3, 40, 48, generator=drawn) for _ in cameras]
    found = solved_colours(gaussians, colours, cameras, photos, rounds=2, leave_out=True)
    assert found.hinders.nonzero().flatten().tolist() == [3200]
