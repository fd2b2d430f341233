"""Colours that change with the direction: as harmonics have them, and as ridge regression has them."""

import dataclasses

import numpy as np
import pytest
import torch
from torch import Tensor

from langflash_core.geometry.cameras import invert_rigid
from langflash_core.geometry.harmonics import colour_to_sh, sh_to_colour, slopes_to_sh
from langflash_core.splat.colours import solved_colours
from langflash_core.splat.mixing import mixing
from langflash_core.splat.projection import project
from langflash_core.splat.reference import rasterize
from langflash_core.splat.slopes import COLOURED, SPREAD, across, bases, directions, middles
from langflash_core.types import Camera, Gaussians
from tests.splat.scenes import camera, cloud, splats, turned

EXACT = 1e-6  # of float32 numbers of about 1, a few of them added
SEEN = 0.05  # contributions from which colours are solved for


def unit(*shape: int, seed: int = 0) -> np.ndarray:
    drawn = np.random.default_rng(seed).normal(size=(*shape, 3))
    return (drawn / np.linalg.norm(drawn, axis=-1, keepdims=True)).astype(np.float32)


def test_slopes_are_harmonics_of_degree_one():
    drawn = torch.Generator().manual_seed(0)
    colours, slopes = torch.rand(50, 3, generator=drawn), 0.1 * torch.randn(50, 3, 3, generator=drawn)
    ways = torch.from_numpy(unit(50))
    sh = torch.cat((colour_to_sh(colours)[:, None], slopes_to_sh(slopes)), 1)
    said = (colours.double() + torch.einsum("nk,nkc->nc", ways.double(), slopes.double())).clamp_min(0)
    assert (sh_to_colour(sh, ways) - said).abs().max() < EXACT


def test_along_the_middle_there_is_one_colour():
    """What is told of a middle stays, and its slopes lie across it."""
    rng = np.random.default_rng(1)
    looks, middle = rng.normal(size=(30, 4, 3)).astype(np.float32), unit(30)
    found = across(looks, middle)
    told = looks[:, 0] + np.einsum("nk,nkc->nc", middle, looks[:, 1:])
    assert np.abs(found[:, 0] - told).max() < 10 * EXACT
    assert np.abs(np.einsum("nk,nkc->nc", middle, found[:, 1:])).max() < 10 * EXACT
    assert np.abs(across(found, middle) - found).max() < 10 * EXACT
    assert np.abs(bases(middle, middle)[:, 1:]).max() < EXACT


def test_middles_are_means_weighed_by_what_is_shown():
    ids, ways = [np.array([0, 1]), np.array([1, 2])], [unit(2), unit(2, seed=1)]
    found = middles(4, zip(ids, [np.array([1.0, 3.0]), np.array([1.0, 0.0])], ways, strict=True))
    both = 3 * ways[0][1] + ways[1][0]
    assert np.abs(found[:2] - [ways[0][0], both / np.linalg.norm(both)]).max() < EXACT
    assert (found[2:] == 0).all(), "nobody sees these"
    assert np.abs(directions(np.zeros((1, 3), np.float32), np.zeros(3, np.float32))).max() == 0


def views(count: int, step: float = 0.15) -> list[Camera]:
    return [camera(24, 20, 20.0, pose=turned(0.03 * k, (-step * k, 0.01 * k, 0.0))) for k in range(count)]


def opaque(count: int, size: float) -> Gaussians:
    gaussians = cloud(count, size=size, dtype=torch.float32).gaussians
    return dataclasses.replace(gaussians, opacities=torch.full((count,), 0.95))


def regression(
    gaussians: Gaussians, cameras: list[Camera], photos: list[Tensor]
) -> tuple[np.ndarray, np.ndarray]:
    """Looks (N, 4, 3) of all Gaussians together in float64, and their contributions (N,)."""
    count, rows, targets, sights = len(gaussians), [], [], []
    for seen, photo in zip(cameras, photos, strict=True):
        matrix = mixing(project(gaussians, seen), seen, count).toarray().astype(np.float64)
        light = matrix.sum(1)
        rows.append(np.where(light >= 0.5, 1 / np.maximum(light, 0.5), 0)[:, None] * matrix)
        targets.append(photo.flatten(1).T.double().numpy() * (light >= 0.5)[:, None])
        ways = gaussians.means.double() - invert_rigid(seen.viewmat.double())[:3, 3]
        sights.append(torch.nn.functional.normalize(ways, dim=1).numpy())
    sums = [row.sum(0) for row in rows]
    middle = sum(s[:, None] * way for s, way in zip(sums, sights, strict=True))
    middle /= np.maximum(np.linalg.norm(middle, axis=1, keepdims=True), 1e-9)
    design = []
    for row, way in zip(rows, sights, strict=True):
        phi = way - (way * middle).sum(1, keepdims=True) * middle
        design.append(np.concatenate([row, *(row * phi[:, k] for k in range(3))], 1))
    whole, target = np.concatenate(design), np.concatenate(targets)
    grey, found = target.mean(1, keepdims=True), 0.0
    for held, part in ((SPREAD, grey), (COLOURED, target - grey)):
        ridge = np.concatenate([np.zeros(count), np.tile(held**2 * np.sum(sums, 0), 3)])
        found = found + np.linalg.solve(whole.T @ whole + np.diag(ridge + 1e-12), whole.T @ part)
    return found.reshape(4, count, 3).transpose(1, 0, 2), np.sum(sums, 0)


def test_equals_ridge_regression_in_float64():
    """The twin. What is off falls with the square of the rounds (`test_colours`), slowest of what little is
    shown of; photos of middling colours, so that no bound is met."""
    gaussians, cameras = opaque(25, 0.12), views(4)
    drawn = torch.Generator().manual_seed(3)
    photos = [0.5 + 0.005 * torch.randn(3, 20, 24, generator=drawn) for _ in cameras]
    start = torch.full((25, 3), 0.4)
    solved = solved_colours(gaussians, start, cameras, photos, rounds=400, slopes=True)
    truth, total = regression(gaussians, cameras, photos)
    some = total > 1
    assert some.sum() > 15 and truth[some, 0].min() > 0 and truth[some, 0].max() < 1
    assert solved.slopes is not None
    off = np.abs(np.concatenate((solved.colours.numpy()[:, None], solved.slopes.numpy()), 1) - truth)[some]
    assert off[:, 0].max() < 1e-4
    assert off[:, 1:].max() < 1e-4 / SPREAD
    assert np.abs(truth[some, 1:]).max() > 0.01, "there is something to find"


def test_no_round_makes_it_worse():
    gaussians, cameras = opaque(300, 0.06), views(4)
    photos = [torch.rand(3, 20, 24, generator=torch.Generator().manual_seed(k)) for k in range(4)]
    start, errors = torch.full((300, 3), 0.5), []
    for rounds in (0, 1, 2, 4, 8, 16):
        found = solved_colours(gaussians, start, cameras, photos, rounds=rounds, slopes=True)
        errors.append(np.mean([10 ** (-after / 10) for _, after in found.psnr]))
        assert found.colours.min() >= 0 and found.colours.max() <= 1
    plain = solved_colours(gaussians, start, cameras, photos, rounds=16)
    assert (np.diff(errors) <= 0).all()
    assert errors[-1] < np.mean([10 ** (-after / 10) for _, after in plain.psnr])


def wall() -> tuple[Gaussians, Tensor]:
    """Small opaque Gaussians on a plane 2 ahead, coloured in waves 14 pixels long, seen from there."""
    side = torch.linspace(-2, 2, 72).tolist()
    gaussians = splats([(x, y, 2.0) for y in side for x in side], 0.04, 0.98, dtype=torch.float32)
    x, y = gaussians.means[:, :2].T
    waves, tint = 0.3 * (9 * x).sin(), torch.tensor([0.5, 0.4, 0.3])
    return gaussians, (waves + 0.1 * y.sin())[:, None] + tint


def walked(count: int, step: float) -> list[Camera]:
    """Cameras side by side, the middle one before the wall's middle."""
    places = [step * (k - (count - 1) / 2) for k in range(count)]
    return [camera(48, 40, 40.0, pose=turned(0.0, (x, 0.0, 0.0))) for x in places]


def pictured(gaussians: Gaussians, colours: Tensor, seen: Camera) -> Tensor:
    """(3, h, w), by the reference in float64; what shines through has no part in it."""
    rgb, alpha = rasterize(gaussians.map(lambda v: v.double()), colours.double(), seen)
    return (rgb / alpha.clamp_min(1e-9)[..., None]).movedim(-1, 0).float()


def moved(gaussians: Gaussians, scale: float) -> Gaussians:
    """The same picture from the origin, so many times as far."""
    return dataclasses.replace(gaussians, means=scale * gaussians.means, scales=scale * gaussians.scales)


@pytest.mark.parametrize("depth", [1.7, 2.4])
def test_what_is_off_its_surface_shows_the_surface_between_the_photos(depth):
    """The wall at another depth, so that each Gaussian shows another part of it from place to place, three
    pixels on from the first to the last; judged where nobody stood, away from the picture's borders."""
    true, colours = wall()
    cameras = walked(5, 0.25)
    photos = [pictured(true, colours, seen) for seen in cameras]
    wrong, kept = moved(true, depth / 2), cameras.pop(1)
    truth, errors = photos.pop(1), []
    for slopes in (False, True):
        found = solved_colours(wrong, colours, cameras, photos, slopes=slopes)
        shown = found.colours
        if found.slopes is not None:
            centre = invert_rigid(kept.viewmat)[:3, 3].float().numpy()
            ways = torch.from_numpy(directions(wrong.means.numpy(), centre))
            shown = shown + torch.einsum("nk,nkc->nc", ways, found.slopes)
        off = pictured(wrong, shown, kept) - truth
        errors.append(float(off[:, 8:-8, 8:-8].square().mean().sqrt()))
    assert errors[1] < 0.5 * errors[0], errors


def test_one_place_tells_no_slope():
    """Photos from one place that differ, as in light: their mean, and no change with directions."""
    gaussians = opaque(100, 0.1)
    cameras, photos = views(1) * 3, [torch.rand(3, 20, 24) for _ in range(3)]
    start = torch.full((100, 3), 0.5)
    found = solved_colours(gaussians, start, cameras, photos, slopes=True)
    plain = solved_colours(gaussians, start, cameras, photos)
    assert found.slopes is not None and found.slopes.abs().max() < 1e-3
    assert (found.colours - plain.colours).abs().max() < 1e-4
    assert plain.slopes is None


def test_what_nobody_sees_keeps_its_colour_from_everywhere():
    gaussians = splats([(0, 0, 1.0), (0, 0, -1.0), (9, 0, 1.0)], [1.0, 1.0, 0.1], 1.0, dtype=torch.float32)
    start = torch.rand(3, 3, generator=torch.Generator().manual_seed(0))
    found = solved_colours(gaussians, start, [camera()] * 3, [torch.ones(3, 40, 48)] * 3, slopes=True)
    assert torch.equal(found.colours[1:], start[1:])
    assert found.slopes is not None and bool((found.slopes[1:] == 0).all())


def test_of_many_photos_each_speaks_in_turn(monkeypatch):
    """What each sees of the wall in blocks of its own: slopes come from those that speak."""
    true, colours = wall()
    cameras = walked(12, 0.08)
    photos = [pictured(true, colours, seen) for seen in cameras]
    wrong, owners = moved(true, 1.2), torch.full((len(true),), -1)
    for name, value in (("_MANY", 3), ("_EVERY", 4), ("_BLOCK", 8)):
        monkeypatch.setattr(f"langflash_core.splat.colours.{name}", value)
    plain = solved_colours(wrong, colours, cameras, photos, owners=owners)
    found = solved_colours(wrong, colours, cameras, photos, owners=owners, slopes=True)
    assert np.mean(found.psnr, 0)[1] > np.mean(plain.psnr, 0)[1] + 3
