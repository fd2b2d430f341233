"""Where people would stand in a scene of Gaussians alone: in a room that was seen from one place in it, and
before a wall."""

import math
from dataclasses import replace

import numpy as np
import pytest
import torch

from langflash_core.geometry.cameras import invert_rigid
from langflash_core.scene.lookouts import lookouts
from langflash_core.scene.settings import LOOKOUTS
from langflash_core.types import Camera, Gaussians
from tests.splat.scenes import unturned

SIZE = (64, 48)
STOOD = (0.6, -1.5, -0.8)
HALF = (2.0, 1.5)  # of the room, along x and z; it is 2.4 high, its floor at 0


def surfels(means: np.ndarray, seen_from: tuple[float, float, float]) -> Gaussians:
    """Grey ones, as large as pixels of a photo from there."""
    points = torch.from_numpy(means).float()
    return unturned(points, 0.01 * (points - torch.tensor(seen_from)).norm(dim=1, keepdim=True))


@pytest.fixture(scope="module")
def room() -> Gaussians:
    rng = np.random.default_rng(0)
    u, v, side = rng.uniform(-1, 1, 12_000), rng.uniform(0, 1, 12_000), rng.integers(0, 5, 12_000)
    x = np.select([side == 0, side == 1], [-HALF[0], HALF[0]], u * HALF[0])
    z = np.select([side == 2, side == 3], [-HALF[1], HALF[1]], u * HALF[1])
    z = np.where(side == 4, (2 * v - 1) * HALF[1], z)
    return surfels(np.stack((x, np.where(side == 4, 0.0, -2.4 * v), z), 1), STOOD)


def eyes(cameras: list[Camera]) -> torch.Tensor:
    return torch.stack([invert_rigid(camera.viewmat)[:3, 3] for camera in cameras])


def test_one_stands_in_the_room_and_not_behind_its_walls(room):
    cameras = lookouts(room, 8, SIZE)
    assert 4 <= len(cameras) <= 8
    first = eyes(cameras[:4])
    assert bool((first[:, 0].abs() < HALF[0]).all()) and bool((first[:, 2].abs() < HALF[1]).all())
    assert bool((first[:, 1] < 0).all())  # above the floor
    assert float((first[0] - torch.tensor(STOOD)).norm()) < 1.0  # of the room's diagonal of 5


def test_every_camera_is_upright_and_of_the_size_asked_for(room):
    for camera in lookouts(room, 8, SIZE):
        assert (camera.width, camera.height) == SIZE
        turn = camera.viewmat[:3, :3]
        assert torch.allclose(turn @ turn.T, torch.eye(3), atol=1e-5)  # of float32
        assert float(torch.linalg.det(turn)) > 0 and abs(float(turn[0, 1])) < 1e-6  # no roll
        assert float(turn[1, 1]) > 0.9  # what is down is down
        assert 2 * math.degrees(math.atan(SIZE[0] / 2 / float(camera.K[0, 0]))) == pytest.approx(LOOKOUTS.fov)


def test_they_look_at_different_things(room):
    forwards = torch.stack([camera.viewmat[2, :3] for camera in lookouts(room, 4, SIZE)])
    assert float((forwards @ forwards.T - 2 * torch.eye(len(forwards))).max()) < 0.95  # 18 degrees


def test_unit_and_place_do_not_matter(room):
    moved = replace(room, means=room.means * 8 + torch.tensor([16.0, -8, 4]), scales=room.scales * 8)
    ours, theirs = eyes(lookouts(room, 5, SIZE)), eyes(lookouts(moved, 5, SIZE))
    # Powers of two: only sums with what the room was moved by round.
    assert torch.allclose((theirs - torch.tensor([16.0, -8, 4])) / 8, ours, atol=1e-3)


def test_before_a_wall_one_stands_before_it():
    rng = np.random.default_rng(1)
    wall = np.stack((rng.uniform(-1, 1, 4000), rng.uniform(-1, 1, 4000), np.full(4000, 2.0)), 1)
    cameras = lookouts(surfels(wall, (0, 0, 0)), 3, SIZE)
    assert cameras
    for camera in cameras:
        at = camera.viewmat[:3, :3] @ torch.tensor([0.0, 0, 2]) + camera.viewmat[:3, 3]
        assert float(at[2]) > 0.2


@pytest.mark.parametrize("count", [1, 2, 50])
def test_a_few_gaussians_in_one_place_are_looked_at(count):
    cameras = lookouts(surfels(np.tile([[1.0, 2.0, 3.0]], (count, 1)), (0, 0, 0)), 4, SIZE)
    assert cameras and all(bool(torch.isfinite(camera.viewmat).all()) for camera in cameras)


def test_nothing_that_one_sees_is_looked_at_all_the_same(room):
    assert lookouts(replace(room, opacities=torch.zeros_like(room.opacities)), 4, SIZE)
