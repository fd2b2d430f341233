"""Packs before a camera: all that a projection keeps, little more, and the same footprints."""

import dataclasses
import math

import pytest
import torch

from langflash_core.splat import frustum as module
from langflash_core.splat.frustum import Packs, reaches
from langflash_core.splat.projection import ALPHA_MIN, Footprints, project
from langflash_core.types import Camera, Gaussians
from tests.splat.scenes import camera, cloud, parallel, splats, turned


@pytest.fixture(autouse=True)
def small_packs(monkeypatch):
    monkeypatch.setattr(module, "_PACK", 8)


def around(count: int, size: float, seed: int = 0) -> Gaussians:
    """On all sides of the camera."""
    g = torch.Generator().manual_seed(seed)
    gaussians = cloud(count, size=size, seed=seed, dtype=torch.float32).gaussians
    return dataclasses.replace(gaussians, means=3 * torch.randn(count, 3, generator=g))


def rounding(kept: Footprints, gaussians: Gaussians, seen: Camera) -> torch.Tensor:
    """Pixels (n, 2) by which centres may differ that float32 made of rows of another number.

    A place before the camera is a product of three terms, whose sum may be rounded in any order: off by at
    most e = 2^-20 of its distance from the world's origin. u = f x / z + c is then off by f e / z for x, and
    for z by |u - c| e / z, which is much where z is next to nothing; of parallel rays by f e.
    """
    K, viewmat = seen.K.to(kept.centres), seen.viewmat.to(kept.centres)
    off = 2**-20 * (gaussians.means[kept.ids].norm(dim=-1, keepdim=True) + viewmat[:3, 3].norm())
    if seen.orthographic:
        return off * K.diagonal()[:2]
    return off / kept.depths[:, None] * (K.diagonal()[:2] + (kept.centres - K[:2, 2]).abs())


@pytest.mark.parametrize("size", [0.003, 0.03, 0.3, 3.0])
@pytest.mark.parametrize("pose", [None, turned(1.3, (0.5, -0.2, 0.7))])
def test_holds_all_that_a_projection_keeps(size, pose):
    gaussians, seen = around(2000, size), camera(pose=pose)
    rows = Packs.of(gaussians).before(seen)
    kept = project(gaussians, seen)
    assert (rows.diff() > 0).all() and torch.isin(kept.ids, rows).all()
    again = project(gaussians.rows(rows), seen)
    assert torch.equal(rows[again.ids], kept.ids)
    assert ((again.centres - kept.centres).abs() <= rounding(kept, gaussians, seen)).all()


def test_leaves_most_of_the_rest_out():
    """Of small ones on all sides: what is not kept lies within a pixel or two of the picture's edge."""
    gaussians, seen = around(5000, 0.003), camera(200, 160, focal=160.0)
    rows, kept = Packs.of(gaussians).before(seen), project(gaussians, seen).ids
    assert len(kept) > 100 and len(rows) < 1.15 * len(kept)


def test_off_centre_lenses():
    seen = camera()
    K = seen.K.clone()
    K[:2, 2] = torch.tensor([3.0, 39.0], dtype=K.dtype)
    seen, gaussians = dataclasses.replace(seen, K=K), around(2000, 0.1)
    assert torch.isin(project(gaussians, seen).ids, Packs.of(gaussians).before(seen)).all()


def test_parallel_rays_leave_nothing_out():
    gaussians = around(100, 0.1)
    assert torch.equal(Packs.of(gaussians).before(parallel(camera())), torch.arange(100))


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_what_is_no_number_is_left_out(value):
    gaussians = around(40, 0.1)
    means = gaussians.means.clone()
    means[7, 1] = value
    gaussians = dataclasses.replace(gaussians, means=means)
    rows = Packs.of(gaussians).before(camera())
    assert 7 not in rows and torch.isin(project(gaussians, camera()).ids, rows).all()


@pytest.mark.parametrize("count", [0, 1, 7, 8, 9])
def test_any_number(count):
    gaussians = splats([(0.01 * k, 0.0, 1.0) for k in range(count)]) if count else Gaussians.none()
    assert Packs.of(gaussians).before(camera()).tolist() == list(range(count))


@pytest.mark.parametrize("size", [0.003, 0.3, 3.0])
@pytest.mark.parametrize("seen", [camera(pose=turned(1.3, (0.5, -0.2, 0.7))), parallel(camera())])
def test_no_footprint_goes_farther_than_it_is_said_to_reach(size, seen):
    """Of what a projection keeps: the same centres, and boxes that end where it reaches, whose own pixel of
    slack the reach has too."""
    gaussians = around(2000, size)
    kept = project(gaussians, seen)
    centres, reach = (values[kept.ids] for values in reaches(gaussians, seen, ALPHA_MIN))
    assert ((centres - kept.centres).abs() <= rounding(kept, gaussians, seen)).all()
    boxes = kept.boxes()
    assert (boxes[:, :2] >= (centres - reach - 1).floor()).all()  # a box is of whole pixels
    assert (boxes[:, 2:] <= (centres + reach + 1).ceil()).all()
