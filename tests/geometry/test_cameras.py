"""Projection and its inverse, fields of view, rigid inverses, angles."""

import math

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from langflash_core.geometry.cameras import (
    fov_degrees,
    intrinsics_from_fov,
    invert_rigid,
    pixel_grid,
    rotation_angle_degrees,
    transform,
    unproject,
)
from tests.geometry.twins import seen_at

K = torch.tensor([[55.0, 0, 18.5], [0, 60.0, 11.25], [0, 0, 1]], dtype=torch.float64)


def _pose(seed: int) -> torch.Tensor:
    pose = torch.eye(4, dtype=torch.float64)
    pose[:3, :3] = torch.from_numpy(Rotation.random(rng=np.random.default_rng(seed)).as_matrix())
    pose[:3, 3] = torch.randn(3, dtype=torch.float64, generator=torch.manual_seed(seed))
    return pose


def test_unproject_then_project_returns_the_pixel_centres():
    depths = torch.rand(24, 36, dtype=torch.float64) + 0.5
    assert torch.allclose(seen_at(unproject(depths, K), K), pixel_grid(36, 24, like=depths), atol=1e-12)


def test_the_first_pixel_centre_is_half_half():
    assert pixel_grid(3, 2, like=torch.zeros(1))[0, 0].tolist() == [0.5, 0.5]
    assert pixel_grid(3, 2, like=torch.zeros(1))[1, 2].tolist() == [2.5, 1.5]


@pytest.mark.parametrize("degrees", [10.0, 65.0, 120.0])
@pytest.mark.parametrize("size", [(640, 480), (480, 640)])
def test_fov_speaks_of_the_longer_side(degrees, size):
    horizontal, vertical = fov_degrees(intrinsics_from_fov(degrees, *size), *size)
    assert max(horizontal, vertical) == pytest.approx(degrees, abs=1e-4)  # float32 focal length


@pytest.mark.parametrize("degrees", [0.0, -5.0, 179.0, float("nan")])
def test_impossible_fields_of_view_are_refused(degrees):
    with pytest.raises(ValueError, match="fov_degrees"):
        intrinsics_from_fov(degrees, 10, 10)


def test_an_off_centre_camera_sums_both_halves():
    horizontal, _ = fov_degrees(K, 36, 24)
    expected = math.degrees(math.atan(18.5 / 55) + math.atan(17.5 / 55))
    assert horizontal == pytest.approx(expected, abs=1e-9)


def test_rigid_inverse_and_transform():
    poses = torch.stack([_pose(i) for i in range(5)])
    assert torch.allclose(invert_rigid(poses), torch.linalg.inv(poses), atol=1e-12)
    points = torch.randn(5, 7, 3, dtype=torch.float64)
    assert torch.allclose(transform(invert_rigid(poses), transform(poses, points)), points, atol=1e-12)


@pytest.mark.parametrize("degrees", [0.0, 1e-6, 0.5, 90.0, 179.9999, 180.0])
def test_rotation_angles_are_exact_at_both_ends(degrees):
    turn = torch.from_numpy(Rotation.from_rotvec(np.radians(degrees) * np.array([0.6, 0, 0.8])).as_matrix())
    base = _pose(3)[:3, :3]
    assert rotation_angle_degrees(base, base @ turn).item() == pytest.approx(degrees, abs=1e-6)
