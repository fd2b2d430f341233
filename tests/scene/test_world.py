"""Scenes in a given frame and unit: the same pictures from the same cameras."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from langflash_core.geometry import poses
from langflash_core.geometry.quaternions import quats_to_matrices
from langflash_core.geometry.rotations import matrix
from langflash_core.scene.bare import bare_scene
from langflash_core.scene.checks import check_scene
from langflash_core.scene.tour import read_tour, told_tour
from langflash_core.scene.world import in_world, transform_scene
from langflash_core.splat import render
from langflash_core.types import Scene
from tests.export.splats import random_gaussians
from tests.scene.test_tour import TOUR

TURN = quats_to_matrices(torch.tensor([0.8, 0.3, -0.4, 0.3], dtype=torch.float64))


def two_views(degree: int) -> Scene:
    gaussians = random_gaussians(60, degree)
    means = gaussians.means + torch.tensor([0.0, 0, 4])
    gaussians = replace(gaussians, means=means, scales=gaussians.scales.clamp(0.05, 0.5))
    second = torch.eye(4)
    second[0, 3] = -0.3
    K = torch.tensor([[30.0, 0, 16], [0, 30, 12], [0, 0, 1]])
    return replace(
        bare_scene(gaussians, "made"),
        viewmats=torch.stack((torch.eye(4), second)), Ks=K.repeat(2, 1, 1), view_size=(32, 24),
    )  # fmt: skip


def assert_its_views_show_the_same(scene: Scene, moved: Scene, unit: float) -> None:
    check_scene(moved)
    for view in range(2):
        before, after = render(scene, scene.camera(view)), render(moved, moved.camera(view))
        assert torch.allclose(before.rgb, after.rgb, atol=1e-3)
        assert torch.allclose(before.depths * unit, after.depths, rtol=1e-3, atol=1e-3)


@pytest.mark.parametrize("degree", [0, 2])
def test_moving_a_scene_does_not_change_what_its_cameras_see(degree):
    scene = two_views(degree)
    viewmat = torch.eye(4, dtype=torch.float64)
    viewmat[:3, :3] = TURN
    viewmat[:3, 3] = torch.tensor([2.0, -1, 5], dtype=torch.float64)
    moved = in_world(scene, viewmat, 2.5)
    assert torch.allclose(moved.viewmats[0].double(), viewmat, atol=1e-6)
    assert_its_views_show_the_same(scene, moved, 2.5)


def test_a_scene_that_is_placed_shows_its_views_the_same():
    key = {"centre": [0.1, 0.2, 0.3], "rotation": [1.0, 0, 0, 0], "reach": 2.0, "fov": 60.0, "span": None}
    scene = two_views(2).with_record(camera_path=(key, {"centre": "nowhere"}))
    turn, origin = TURN.numpy(), np.array([0.5, -1.0, 2.0])
    moved = transform_scene(scene, turn, origin, 2.5)
    assert_its_views_show_the_same(scene, moved, 2.5)
    first, odd = moved.record.camera_path
    assert np.allclose(first["centre"], 2.5 * turn @ (np.array(key["centre"]) - origin))
    assert np.allclose(matrix(tuple(first["rotation"])), turn, atol=1e-9)
    assert first["reach"] == 5.0 and first["fov"] == 60.0 and odd == {"centre": "nowhere"}
    assert moved.record.tour == {}
    back = transform_scene(moved, turn.T, -2.5 * turn @ origin, 1 / 2.5)
    assert torch.allclose(back.gaussians.means, scene.gaussians.means, atol=1e-5)
    assert torch.allclose(back.viewmats, scene.viewmats, atol=1e-5)


def test_stops_and_notes_stay_at_their_things():
    scene = bare_scene(random_gaussians(3), "made").with_record(tour=told_tour(TOUR))
    turn, origin = TURN.numpy(), np.array([0.5, -1.0, 2.0])
    moved = read_tour(transform_scene(scene, turn, origin, 2.5).record.tour)
    assert moved.names == TOUR.names and moved.start == TOUR.start
    for old, new in zip(TOUR.notes, moved.notes, strict=True):
        assert np.allclose(new.at, 2.5 * turn @ (np.array(old.at) - origin))
        assert (old.length is None) == (new.length is None)
        assert old.length is None or new.length == pytest.approx(2.5 * old.length)
    points = np.array([[0.0, 0, 3], [0.4, 0.3, 4]])
    for old, new in zip(TOUR.stops, moved.stops, strict=True):
        before = poses.project(points, old.pose, (640, 480))
        after = poses.project(2.5 * (points - origin) @ turn.T, new.pose, (640, 480))
        assert before is not None and after is not None and np.allclose(before[1], after[1])
