"""Where points lie in a picture: one arithmetic, of numpy and of torch, against a plain twin."""

import numpy as np
import pytest
import torch

from langflash_core.geometry.cameras import intrinsics_from_fov
from langflash_core.geometry.pinhole import from_pixels, see, see_each
from langflash_core.rig.projected import project_points
from tests.geometry.twins import seen_at

WIDTH, HEIGHT = 40, 30
K = intrinsics_from_fov(60, WIDTH, HEIGHT).double()
VIEWMAT = torch.tensor([[0, 1.0, 0, 0.1], [-1, 0, 0, 0.2], [0, 0, 1, 0.3], [0, 0, 0, 1]], dtype=torch.float64)


def points(count: int = 500) -> torch.Tensor:
    return 2 * torch.randn(count, 3, generator=torch.Generator().manual_seed(1), dtype=torch.float64)


def test_numpy_and_torch_see_the_same():
    """Pixels up to 1e4 carry rounding of 1e-12; none of these points is nearer to a border."""
    own = points()
    pos_c = own @ VIEWMAT[:3, :3].T + VIEWMAT[:3, 3]
    found = see(own.numpy(), VIEWMAT.numpy(), K.numpy(), (WIDTH, HEIGHT))
    there = project_points(own.T, VIEWMAT, K, (HEIGHT, WIDTH))
    expected = seen_at(pos_c, K).numpy()
    ahead = pos_c[:, 2].numpy() > 1e-3
    for x, y, z in (found[:3], (there.x.numpy(), there.y.numpy(), there.z.numpy())):
        np.testing.assert_allclose(np.stack((x, y), 1)[ahead], expected[ahead], rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(z, pos_c[:, 2], atol=1e-12)
    inside = (expected >= 0).all(1) & (expected < (WIDTH, HEIGHT)).all(1) & (pos_c[:, 2].numpy() > 0)
    assert inside.any() and not inside.all()
    assert np.array_equal(found.inside, inside) and np.array_equal(there.inside.numpy(), inside)


def test_what_is_not_before_the_camera_is_not_inside():
    own = np.array([[0, 0, 1.0], [0, 0, 0.5], [0, 0, 0], [0, 0, -1], [np.nan, 0, 1], [0, 0, np.nan]])
    found = see(own, np.eye(4), K.numpy(), (WIDTH, HEIGHT), nearest=0.5)
    assert found.inside.tolist() == [True] + 5 * [False]
    assert np.array_equal(found.x[1:4], 3 * [WIDTH / 2])


def test_parallel_rays_divide_by_nothing():
    own = points().numpy()
    near, far = (
        see(own + np.array([0, 0, z]), np.eye(4), K.numpy(), (WIDTH, HEIGHT), 0.0, True) for z in (9.0, 90.0)
    )
    assert near.inside.any() and np.array_equal(near.x, far.x) and np.array_equal(near.inside, far.inside)
    assert near.x == pytest.approx(own[:, 0] * float(K[0, 0]) + WIDTH / 2)


def test_back_from_pixels():
    pixels = torch.tensor([[0.0, 0.0], [20.5, 3.0]], dtype=torch.float64)
    rays = torch.cat((from_pixels(pixels, K), torch.ones(2, 1)), 1)
    assert torch.allclose(seen_at(3 * rays, K), pixels, atol=1e-12)  # rounding of tens
    assert np.array_equal(from_pixels(pixels.numpy(), K.numpy()), rays[:, :2])


def test_each_point_in_a_camera_of_its_own_is_seen_as_in_that_camera():
    rng = np.random.default_rng(3)
    points, viewmats = rng.normal(size=(4, 3)) + np.array([0, 0, 4]), np.repeat(np.eye(4)[None], 4, 0)
    viewmats[:, :3, 3] = 0.1 * rng.normal(size=(4, 3))
    K = np.array([[60.0, 0, 48], [0, 50, 36], [0, 0, 1]])
    each = see_each(points, viewmats, np.repeat(K[None], 4, 0))
    for point, viewmat, pixel in zip(points, viewmats, each, strict=True):
        alone = see(point[None], viewmat, K, (96, 72))
        assert np.allclose(pixel, (alone.x[0], alone.y[0]), rtol=1e-12)  # the same sums in another order
    assert np.abs(see_each(-points, viewmats, np.repeat(K[None], 4, 0))).min() > 1e6  # behind: far outside
