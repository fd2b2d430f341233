"""Depth maps to a surface: a sphere and a plane whose distances are known."""

import sys

import numpy as np
import pytest

from langflash_core.errors import MissingPackageError
from langflash_core.geometry.fusion import ColouredView, fuse
from langflash_core.geometry.settings import FUSION

CENTRE, RADIUS, VOXEL = np.array([0.0, 0.0, 2.0]), 0.5, 0.02
LOW, HIGH = CENTRE - 0.5, CENTRE + 0.5


def sphere_from(yaw: float, size: int = 160) -> ColouredView:
    """A sphere seen by a camera that orbits it, exact depths."""
    turn = np.array([[np.cos(yaw), 0, np.sin(yaw)], [0, 1, 0], [-np.sin(yaw), 0, np.cos(yaw)]])
    viewmat = np.eye(4)
    viewmat[:3, :3] = turn
    viewmat[:3, 3] = np.array([0, 0, 2.0]) - turn @ CENTRE
    K = np.array([[1.4 * size, 0, size / 2], [0, 1.4 * size, size / 2], [0, 0, 1.0]])
    ys, xs = np.mgrid[:size, :size] + 0.5
    rays = np.stack(((xs - K[0, 2]) / K[0, 0], (ys - K[1, 2]) / K[1, 1], np.ones_like(xs)), -1)
    along, square = 2.0 * rays[..., 2], (rays**2).sum(-1)
    under = along**2 - square * (4 - RADIUS**2)
    depths = np.where(under > 0, (along - np.sqrt(np.maximum(under, 0))) / square, 0.0)
    colours = np.broadcast_to(np.array([200, 100, 50], np.uint8), (size, size, 3))
    return ColouredView(depths, viewmat, K, colours)


@pytest.fixture(scope="module")
def ball():
    pytest.importorskip("skimage")
    mesh = fuse([sphere_from(yaw) for yaw in (0, 2.1, 4.2)], LOW, HIGH, VOXEL)
    assert mesh is not None
    return mesh


def test_a_sphere_comes_back(ball):
    away = np.linalg.norm(ball.vertices - CENTRE, axis=1)
    # A pixel's depth stands for its whole square: steep rims err by more than a voxel.
    assert np.quantile(abs(away - RADIUS), 0.95) < VOXEL
    assert abs(np.median(away) - RADIUS) < VOXEL / 4


def test_faces_look_outwards_and_have_the_photos_colours(ball):
    corners = ball.vertices[ball.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    outwards = ((corners.mean(1) - CENTRE) * normals).sum(1) > 0
    assert outwards.mean() > 0.99
    assert (ball.colours == [200, 100, 50]).all(1).mean() > 0.95


def test_what_no_view_saw_is_open():
    pytest.importorskip("skimage")
    front = fuse([sphere_from(0.0)], LOW, HIGH, VOXEL)
    assert front is not None and front.vertices[:, 2].max() < CENTRE[2] + 0.1


def test_a_fine_voxel_in_a_large_box_becomes_coarser():
    pytest.importorskip("skimage")
    mesh = fuse([sphere_from(0.0)], LOW, HIGH, 1e-4)
    assert mesh is not None and len(mesh.vertices) < 100_000


def test_a_surface_in_the_last_plane_of_voxels_is_there():
    pytest.importorskip("skimage")
    K = np.array([[16.0, 0, 16], [0, 16.0, 16], [0, 0, 1.0]])
    depths = np.full((32, 32), 2.0)
    depths[:, 16:] = 1.5  # so that something lies behind a surface
    view = ColouredView(depths, np.eye(4), K, np.zeros((32, 32, 3), np.uint8))
    voxel = 0.25  # as all numbers here, exact: the field is 0 at the farthest voxels
    last = 2.0 - FUSION.band * voxel
    mesh = fuse([view], np.array([-0.5, -0.5, 1.0]), np.array([0.5, 0.5, last]), voxel)
    assert mesh is not None and float(mesh.vertices[:, 2].max()) == 2.0


def test_nothing_seen_is_nothing():
    pytest.importorskip("skimage")
    seen = sphere_from(0.0)
    empty = ColouredView(np.zeros_like(seen.depths), seen.viewmat, seen.K, seen.colours)
    assert fuse([empty], LOW, HIGH, VOXEL) is None and fuse([], LOW, HIGH, VOXEL) is None
    assert fuse([seen], LOW + 10, HIGH + 10, VOXEL) is None


def test_without_its_package_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "skimage", None)
    monkeypatch.setitem(sys.modules, "skimage.measure", None)
    with pytest.raises(MissingPackageError, match=r"langflash\[views\]"):
        fuse([sphere_from(0.0)], LOW, HIGH, VOXEL)
