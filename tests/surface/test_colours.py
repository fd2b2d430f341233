"""Colours solved for: back from a scene's own pictures, never worse, and from nothing nothing.

With D the sums of contributions, rows of the matrix C of 1, Landweber's step is 1 / L of the metric D, so
after k rounds (Beck and Teboulle 2009, theorem 4.4; the box is separable, so clipping is its projection in D)

    |C f_k - photo|^2 <= |C f - photo|^2 + 4 |f_0 - f|_D^2 / (k + 1)^2   for any colours f in [0, 1]

and sum of D is the number of pixels: from grey, whose square distance is at most 1/4 a channel, a picture's
mean square error is at most that of the true colours plus 1 / (k + 1)^2.
"""

import dataclasses
import math

import numpy as np
import pytest
import torch
from torch import Tensor

from langflash_core.splat.mixing import mixing
from langflash_core.splat.projection import project
from langflash_core.splat.reference import rasterize
from langflash_core.surface.colours import solved_colours
from langflash_core.surface.settings import COLOURS
from langflash_core.types import Camera, Gaussians
from tests.splat.scenes import camera, cloud, parallel, splats, turned

CLOSE = 1e-5  # sums of some tens of float32 numbers in [0, 1]
SIDE = turned(0.2, (-0.3, 0.02, 0.1))


def scene(count: int = 400, size: float = 0.05, seed: int = 0) -> tuple[Gaussians, Tensor]:
    """Gaussians as opaque as elements are, and colours that have nothing to do with each other."""
    gaussians = cloud(count, size=size, seed=seed, dtype=torch.float32).gaussians
    opaque = dataclasses.replace(gaussians, opacities=torch.full((count,), 0.95))
    return opaque, torch.rand(count, 3, generator=torch.Generator().manual_seed(seed + 1))


def picture(gaussians: Gaussians, colours: Tensor, seen: Camera) -> tuple[Tensor, Tensor]:
    """(3, h, w) and alphas (h, w), by the reference in float64; what shines through has no part in it."""
    maps, alphas = rasterize(gaussians.map(lambda v: v.double()), colours.double(), seen)
    return (maps / alphas.clamp_min(1e-9)[..., None]).movedim(-1, 0).float(), alphas


def grey(colours: Tensor) -> Tensor:
    return torch.full_like(colours, 0.5)


def mean_square(psnr: float) -> float:
    return 10 ** (-psnr / 10)


def seen_by(flat: bool = False) -> Camera:
    return parallel(camera(pose=SIDE)) if flat else camera(pose=SIDE)


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("flat", [False, True])
def test_rounds_come_as_near_as_is_proven(flat, seed):
    """One's own picture, by the reference, from grey; measured against what true colours leave, the pairs
    that `mixing` leaves out. And no round makes it worse."""
    gaussians, colours = scene(seed=seed)
    seen = seen_by(flat)
    photo = picture(gaussians, colours, seen)[0]
    left = mean_square(solved_colours(gaussians, colours, seen, photo, rounds=0).psnr[0])
    assert left < 1e-3, "2 % of the light at most"
    errors = []
    for rounds in (0, 1, 2, 4, 8, 16):
        solved = solved_colours(gaussians, grey(colours), seen, photo, rounds=rounds)
        errors.append(mean_square(solved.psnr[1]))
        # Mean over the pixels that are shown, at least half of them here, hence the factor.
        assert errors[-1] <= 2 * (left + 1 / (rounds + 1) ** 2)
        assert solved.colours.min() >= 0 and solved.colours.max() <= 1
    assert (np.diff(errors) <= 0).all()
    assert errors[4] < 0.1 * errors[0]


def _linear(count: int = 60) -> tuple[Gaussians, np.ndarray, Camera]:
    """A scene, and its matrix in float64, rows of 1 where at least half of a pixel's light is drawn."""
    gaussians, seen = scene(count, size=0.15)[0], camera(24, 20, 20.0)
    matrix = mixing(project(gaussians, seen), seen, count).toarray().astype(np.float64)
    light = matrix.sum(1)
    return gaussians, np.where(light >= 0.5, 1 / np.maximum(light, 0.5), 0)[:, None] * matrix, seen


def test_equals_dense_float64_rounds():
    """The twin: the same rounds with a dense matrix."""
    gaussians, matrix, seen = _linear()
    g = torch.Generator().manual_seed(2)
    photo, start = torch.rand(3, 20, 24, generator=g), torch.rand(60, 3, generator=g)
    shown, total = matrix.sum(1) > 0.5, matrix.sum(0)
    colours = ahead = start.double().numpy()
    pace = 1.0
    for _ in range(COLOURS.rounds):
        wrong = (photo.double().flatten(1).T.numpy() - matrix @ ahead) * shown[:, None]
        step = np.where(total > 0.05, 1 / np.maximum(total, 0.05), 0)[:, None] * (matrix.T @ wrong)
        found = np.clip(ahead + step, 0, 1)
        following = (1 + math.sqrt(1 + 4 * pace**2)) / 2
        ahead, colours, pace = found + (pace - 1) / following * (found - colours), found, following
    solved = solved_colours(gaussians, start, seen, photo)
    assert np.abs(solved.colours.numpy() - colours).max() < 10 * CLOSE  # eight rounds, each a little ahead


def test_colours_stay_between_black_and_white():
    """A hard edge under wide Gaussians asks for more than white and less than black."""
    gaussians, colours = scene(size=0.1)
    photo = torch.zeros(3, 40, 48)
    photo[:, :, 24:] = 1
    solved = solved_colours(gaussians, grey(colours), camera(), photo, rounds=50)
    assert solved.colours.min() == 0 and solved.colours.max() == 1
    assert solved.colours.isfinite().all() and solved.colours.dtype == torch.float32


def test_who_is_not_seen_keeps_its_colour():
    """Behind the camera, beside it, no number, hidden by what is opaque, and too faint."""
    means = [(0, 0, 1.0), (0, 0, -1.0), (9, 0, 1.0), (math.nan, 0, 1.0), (0, 0, 9.0), (0.1, 0, 0.5)]
    gaussians = splats(means, [1.0, 1.0, 0.1, 1.0, 0.05, 0.1], [1.0] * 5 + [0.001], dtype=torch.float32)
    start = torch.rand(6, 3, generator=torch.Generator().manual_seed(0))
    solved = solved_colours(gaussians, start, camera(), torch.ones(3, 40, 48))
    assert torch.equal(solved.colours[1:], start[1:])
    assert (solved.colours[0] - 1).abs().max() < CLOSE


def test_a_colour_that_is_no_number_stays_with_its_gaussian():
    """Those whose stored colour is none are not drawn."""
    gaussians, colours = scene(50)
    sh = gaussians.sh.clone()
    sh[7], start = torch.nan, grey(colours)
    start[7] = torch.nan
    gaussians = dataclasses.replace(gaussians, sh=sh)
    solved = solved_colours(gaussians, start, camera(), torch.rand(3, 40, 48))
    assert solved.colours[7].isnan().all() and solved.colours.isnan().sum() == 3
    assert all(math.isfinite(psnr) for psnr in solved.psnr)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_pixels_that_are_no_numbers_say_nothing(value):
    """As if they were not covered: colours are those of the rest of the photo, all the same."""
    gaussians, colours = scene()
    photo = picture(gaussians, colours, camera())[0]
    broken = photo.clone()
    broken[1, 10:20, 10:30] = value
    broken[0, 0, 0] = value
    solved = solved_colours(gaussians, grey(colours), camera(), broken)
    assert solved.colours.isfinite().all() and math.isfinite(solved.psnr[1])
    assert solved.psnr[1] > solved.psnr[0] + 10
    of_nothing = solved_colours(gaussians, grey(colours), camera(), torch.full_like(photo, value))
    assert torch.equal(of_nothing.colours, grey(colours)) and of_nothing.psnr == (100.0, 100.0)


def test_a_camera_that_shows_nothing():
    """It looks away, or there are no Gaussians: the start, nothing wrong."""
    gaussians, colours = scene()
    away, photo = camera(pose=turned(math.pi, (0, 0, 0))), torch.rand(3, 40, 48)
    none = solved_colours(gaussians, colours, away, photo)
    assert torch.equal(none.colours, colours) and none.psnr == (100.0, 100.0)
    empty = solved_colours(Gaussians.none(), torch.zeros(0, 3), camera(), photo)
    assert empty.colours.shape == (0, 3) and empty.psnr == (100.0, 100.0)


def test_footprints_larger_than_the_picture():
    """One that fills it has the photo's mean."""
    gaussians = splats([(0, 0, 1.0)], 1e3, 0.99, dtype=torch.float32)
    photo = torch.rand(3, 40, 48, generator=torch.Generator().manual_seed(0))
    solved = solved_colours(gaussians, torch.zeros(1, 3), camera(), photo, rounds=1)
    assert (solved.colours[0] - photo.mean((1, 2))).abs().max() < CLOSE


def test_psnr_is_that_of_the_drawn_picture():
    """Against the reference's picture with the solved colours, over pixels that are half covered: pairs left
    out move a pixel by about the 2 % of its light, of the error here less than a tenth of a decibel."""
    gaussians, colours = scene()
    seen, photo = camera(), torch.rand(3, 40, 48, generator=torch.Generator().manual_seed(3))
    solved = solved_colours(gaussians, colours, seen, photo)
    light = mixing(project(gaussians, seen), seen, 400).sum(1).reshape(40, 48)
    for drawn, psnr in zip((colours, solved.colours), solved.psnr, strict=True):
        found, _ = picture(gaussians, drawn, seen)
        off = (found - photo)[:, torch.from_numpy(np.asarray(light)) >= 0.5]
        assert psnr == pytest.approx(-10 * math.log10(off.square().mean()), abs=0.1)
    assert solved.psnr[1] > solved.psnr[0]
