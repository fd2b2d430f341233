"""Where points of photos lie in other photos: against a plain loop in numpy, one and several at once."""

import math

import numpy as np
import pytest
import torch
from torch import Tensor

from langflash_core.geometry.cameras import intrinsics_from_fov
from langflash_core.geometry.rotations import matrix
from langflash_core.rig.projected import project_points
from langflash_core.rig.rig import Rig

WIDTH, HEIGHT = 14, 10
TWIN = 1e-9
"""Pixels and units: rounding of float64, of pixels up to 1e4 and points divided by depths down to .1."""


def drawn(dtype: torch.dtype = torch.float64) -> Rig:
    """Three photos, turned and moved, of depths between one and three."""
    g = torch.Generator().manual_seed(5)
    viewmats = torch.eye(4, dtype=torch.float64).repeat(3, 1, 1)
    for view, turn in enumerate(((0.0, 0.1, 0.0), (0.2, -0.3, 0.1), (-0.1, 0.2, 0.6))):
        angle = math.hypot(*turn)
        x, y, z = (math.sin(angle / 2) / angle * part for part in turn)
        viewmats[view, :3, :3] = torch.from_numpy(matrix((math.cos(angle / 2), x, y, z))[:3, :3])
        viewmats[view, :3, 3] = torch.randn(3, generator=g, dtype=torch.float64) / 3
    depths = 1 + 2 * torch.rand(3, HEIGHT, WIDTH, generator=g, dtype=torch.float64)
    Ks = torch.stack([intrinsics_from_fov(fov, WIDTH, HEIGHT) for fov in (50, 60, 70)])
    Ks[1, 0, 2] += 1.5
    return Rig(viewmats, Ks, depths, torch.ones_like(depths)).map(lambda values: values.to(dtype))


def plain(rig: Rig, view: int, other: int) -> np.ndarray:
    """x, y, z (H*W, 3) by a loop over pixels."""
    (of, to), (K, L) = rig.viewmats[[view, other]].numpy(), rig.Ks[[view, other]].numpy()
    found = []
    for row in range(HEIGHT):
        for column in range(WIDTH):
            depth = float(rig.depths[view, row, column])
            ray = np.linalg.inv(K) @ (column + 0.5, row + 0.5, 1.0)
            world = np.linalg.inv(of) @ (*(depth * ray), 1.0)
            x, y, z = (to @ world)[:3]
            found.append((L[0, 0] * x / z + L[0, 2], L[1, 1] * y / z + L[1, 2], z))
    return np.array(found)


@pytest.mark.parametrize(("view", "other"), [(0, 1), (1, 0), (1, 2), (2, 2)])
def test_reprojection_is_that_of_a_loop(view, other):
    rig = drawn()
    expected = plain(rig, view, other)
    by_world = rig.project(rig.points(view), other)
    for found in (rig.reproject(view, other), by_world):
        np.testing.assert_allclose(torch.stack((found.x, found.y, found.z), 1), expected, atol=TWIN)
        x, y, z = expected.T
        inside = (z > 0) & (x >= 0) & (x < WIDTH) & (y >= 0) & (y < HEIGHT)
        assert inside.any() and np.array_equal(found.inside, inside)
        pixels = np.where(inside, np.floor(y) * WIDTH + np.floor(x), 0).astype(int)
        assert np.array_equal(found.pixels, pixels)
        across, down = found.normalised_coordinates
        assert np.allclose(across, x / WIDTH * 2 - 1) and np.allclose(down, y / HEIGHT * 2 - 1)
        theirs = rig.depths[other].flatten()
        assert torch.equal(found.looked_up(theirs), theirs[torch.from_numpy(pixels)])


def test_single_precision_is_near_its_twin():
    """float32 has 6e-8 of a number; pixels and units here are below 100, and some ten are summed."""
    found, twin = (drawn(dtype).reproject(0, 1) for dtype in (torch.float32, torch.float64))
    for name in ("x", "y", "z"):
        assert (getattr(found, name).double() - getattr(twin, name)).abs().max() < 100 * 10 * 6e-8


def test_several_photos_at_once_are_each_by_itself():
    rig = drawn()
    flat = rig.depths.flatten(1)
    for others in (slice(None), [0, 2]):
        many, views = rig.reproject(1, others), [*range(3)][others] if isinstance(others, slice) else others
        for number, other in enumerate(views):
            one = rig.reproject(1, other)
            for name in ("x", "y", "z"):
                # a product of several matrices may sum its three terms in another order
                assert (getattr(many, name)[number] - getattr(one, name)).abs().max() < TWIN
            assert torch.equal(many.looked_up(flat[others])[number], one.looked_up(flat[other]))


def test_points_of_each_photo_by_itself():
    """(V, 3, n) points, one picture each."""
    rig = drawn()
    points = torch.stack([rig.points(view) for view in range(3)])
    found = project_points(points, rig.viewmats, rig.Ks, rig.size)
    own = torch.arange(HEIGHT * WIDTH).expand(3, -1)
    assert torch.equal(found.pixels, own) and torch.allclose(found.z, rig.depths.flatten(1))


def test_behind_beside_and_no_number_are_outside():
    K = torch.tensor([[1.0, 0, 2], [0, 1, 1], [0, 0, 1]])
    before, behind, beside = (0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (9.0, 0.0, 1.0)
    corners, nothing = ((-2.0, -1.0, 1.0), (2.0, 0.0, 1.0)), (0.0, math.nan, 1.0)
    points = torch.tensor((before, behind, (0.0, 0.0, 0.0), beside, nothing, *corners)).T
    found = project_points(points, torch.eye(4), K, (3, 4))
    assert found.inside.tolist() == [True, False, False, False, False, True, False]
    assert found.pixels.tolist() == [6, 0, 0, 0, 0, 0, 0]
    assert found.within(0.9).tolist() == [True] + 6 * [False] and not found.within(1).any()
    assert project_points(points[:, :0], torch.eye(4), K, (3, 4)).pixels.shape == (0,)


def test_logarithms_stay_bit_by_bit():
    logs = torch.linspace(-1, 3, 24).view(1, 4, 6)
    rig = Rig.of_logs(logs, torch.eye(4)[None], torch.eye(3)[None])
    assert rig.log_depths is logs and torch.equal(rig.depths, logs.exp())
    assert (rig.depths.log() != logs).any()  # so it matters
    moved, errors = Rig.of_logs(logs, rig.viewmats, rig.Ks, logs - 4), rig.with_logs(logs + 1).log_depths
    assert torch.equal(errors, logs + 1) and moved.some([0]).log_errors.equal(logs - 4)
    # An error of log depth of .1 is a confidence of 1/2; float32 of a logit of up to 8 has 1e-6.
    sure = Rig(rig.viewmats, rig.Ks, rig.depths, moved.confidences)
    assert (sure.log_errors - (logs - 4)).abs().max() < 1e-4
    assert moved.with_logs(logs + 1).log_errors.equal(logs - 4)


@pytest.mark.parametrize(
    ("name", "shape"), [("viewmats", (2, 4, 4)), ("Ks", (2, 3, 3)), ("photos", (3, 3, 1, 1))]
)
def test_fields_of_other_photos_are_refused(name, shape, unchecked):
    own = drawn()
    fields = {"viewmats": own.viewmats, "Ks": own.Ks, "depths": own.depths, name: torch.ones(shape)}
    with pytest.raises(ValueError, match=name):
        Rig(**fields)


@pytest.mark.skipif(not torch.cuda.is_available(), reason="there is no graphics card")
def test_a_graphics_card_finds_the_same():
    rig = drawn()
    there, here = rig.map(Tensor.cuda).reproject(0, slice(None)), rig.reproject(0, slice(None))
    assert torch.equal(there.pixels.cpu(), here.pixels)
