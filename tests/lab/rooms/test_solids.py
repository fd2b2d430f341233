"""Solids: closed, facing one way, of the volume that the formula says, where they should be."""

import math

import numpy as np
import pytest

from langflash_core.lab.rooms.solids import (
    Triangles,
    box,
    cylinder,
    grid_triangles,
    lathe,
    rounded,
    scaled,
    shifted,
    tube,
    turned,
)

EXACT = 1e-12  # metres and cubic metres: a few roundings of doubles about 1
PLACE = (0.3, -0.2, 0.7)
FACING = {  # 1: out, -1: in
    "box": (box((0.4, 1.2, 0.7), PLACE), 1),
    "rounded": (rounded((0.4, 1.2, 0.7), PLACE), -1),
    "ellipsoid": (rounded((0.4, 1.2, 0.7), PLACE, 2.0), -1),
    "cylinder": (cylinder(0.3, 0.9, PLACE), -1),
    "frustum": (cylinder(0.3, 0.9, PLACE, 0.1), -1),
}


def crosses(triangles: Triangles) -> np.ndarray:
    """Normals, twice the area long."""
    return np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])


def solid_parts(triangles: Triangles) -> Triangles:
    """Without the triangles that have collapsed to a line, as at the poles of a sphere."""
    return triangles[np.linalg.norm(crosses(triangles), axis=1) > EXACT]


def volume(triangles: Triangles) -> float:
    """Sum of signed tetrahedra to the origin (divergence theorem); positive when facing out."""
    return float(np.einsum("fc,fc->", triangles[:, 0], np.cross(triangles[:, 1], triangles[:, 2])) / 6)


@pytest.mark.parametrize("name", FACING)
def test_all_triangles_face_one_way(name: str) -> None:
    """The solids are convex: away from the centre is out."""
    triangles, sign = FACING[name]
    triangles = solid_parts(triangles)
    outwards = triangles.mean(1) - triangles.reshape(-1, 3).mean(0)
    assert np.all(sign * np.einsum("fc,fc->f", crosses(triangles), outwards) > 0)
    assert sign * volume(triangles) > 0


@pytest.mark.parametrize("name", FACING)
def test_surfaces_are_closed(name: str) -> None:
    """Every edge belongs to two triangles, which run along it in opposite directions."""
    triangles = solid_parts(FACING[name][0])
    nanometres = np.round(triangles.reshape(-1, 3) * 1e9).astype(np.int64)  # merges equal points
    _, point = np.unique(nanometres, axis=0, return_inverse=True)
    corners = point.reshape(-1, 3)
    edges = np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]]).tolist()
    directed = {(a, b) for a, b in edges}
    assert len(directed) == len(edges)
    assert directed == {(b, a) for a, b in edges}


def test_box_has_its_size_place_and_volume() -> None:
    triangles = box((0.4, 1.2, 0.7), PLACE)
    assert triangles.shape == (12, 3, 3)
    points = triangles.reshape(-1, 3)
    np.testing.assert_allclose(np.ptp(points, axis=0), (0.4, 1.2, 0.7), atol=EXACT)
    np.testing.assert_allclose((points.min(0) + points.max(0)) / 2, PLACE, atol=EXACT)
    assert volume(triangles) == pytest.approx(0.4 * 1.2 * 0.7, abs=EXACT)


@pytest.mark.parametrize("segments", [3, 16, 200])
def test_cylinder_volume_is_that_of_its_prism(segments: int) -> None:
    radius, height = 0.3, 0.9
    base = segments / 2 * math.sin(2 * math.pi / segments) * radius**2  # a regular polygon
    found = abs(volume(cylinder(radius, height, PLACE, segments=segments)))
    assert found == pytest.approx(base * height, abs=EXACT)
    if segments == 200:  # the polygon lacks 1 - sin(x) / x = x^2 / 6 of the circle, x = 2 pi / 200: 0.00016
        assert found == pytest.approx(math.pi * radius**2 * height, rel=2e-4)


def test_frustum_volume() -> None:
    radius, top, height, segments = 0.3, 0.1, 0.9, 16
    unit = segments / 2 * math.sin(2 * math.pi / segments)
    wanted = unit * height / 3 * (radius**2 + radius * top + top**2)
    assert abs(volume(cylinder(radius, height, PLACE, top))) == pytest.approx(wanted, abs=EXACT)


def test_rounded_lies_between_ellipsoid_and_box() -> None:
    size = np.array((0.4, 1.2, 0.7))
    volumes = [abs(volume(rounded((0.4, 1.2, 0.7), PLACE, p))) for p in (2.0, 5.0, 30.0)]
    assert volumes[0] < volumes[1] < volumes[2] < size.prod()
    # 24 x 12 chords of 15 degrees: each direction lacks at most 1 - sin(x) / x = 1.1 % of the ellipse,
    # twice in the plane and once in height.
    assert volumes[0] == pytest.approx(math.pi / 6 * size.prod(), rel=0.035)
    points = rounded((0.4, 1.2, 0.7), PLACE, 2.0).reshape(-1, 3)
    np.testing.assert_allclose(np.ptp(points, axis=0), size, atol=EXACT)


def test_lathe_keeps_to_its_profile() -> None:
    profile, squash = [(0.1, 0.0), (0.3, 0.2), (0.2, 0.5)], 0.5
    points = lathe(profile, PLACE, 12, squash).reshape(-1, 3) - PLACE
    radii = np.hypot(points[:, 0], points[:, 2] / squash)
    wanted = np.interp(points[:, 1], [0.0, 0.2, 0.5], [0.1, 0.3, 0.2])
    np.testing.assert_allclose(radii, wanted, atol=EXACT)
    assert scaled([(0.5, 1.0), (1.0, 0.0)], 0.2, 3.0) == [(0.1, 3.0), (0.2, 0.0)]


@pytest.mark.parametrize("end", [(0.0, 0.8, 0.0), (0.5, 0.1, 0.0), (0.0, 0.1, 0.9), (0.2, -0.4, 0.6)])
def test_tube_follows_its_path(end: tuple[float, float, float]) -> None:
    """All of a straight rod lies at its radius from the line, from half a radius before to half past it."""
    radius, start = 0.05, np.array(PLACE)
    triangles = tube([PLACE, end], radius)
    along = np.array(end) - start
    length = float(np.linalg.norm(along))
    points = triangles.reshape(-1, 3) - start
    reach = points @ along / length
    away = np.linalg.norm(points - reach[:, None] * along / length, axis=1)
    np.testing.assert_allclose(away, radius, atol=EXACT)
    assert reach.min() == pytest.approx(-radius / 2, abs=EXACT)
    assert reach.max() == pytest.approx(length + radius / 2, abs=EXACT)
    axis = triangles.mean(1) - start
    axis -= (axis @ along / length)[:, None] * along / length
    assert np.all(np.einsum("fc,fc->f", crosses(triangles), axis) > 0)  # faces out


def test_tube_passes_every_corner_and_skips_standstill() -> None:
    path = [(0.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 1.0, 0.0), (0.5, 1.0, 0.0)]
    triangles = tube(path, 0.02, segments=6)
    np.testing.assert_array_equal(triangles, tube([path[0], path[1], path[3]], 0.02, segments=6))
    assert triangles.shape == (2 * 2 * 6, 3, 3)
    for corner in path:  # the nearest points lie on the ring half a radius beyond: sqrt(1.25) radii away
        nearest = np.linalg.norm(triangles.reshape(-1, 3) - corner, axis=1).min()
        assert nearest <= math.sqrt(1.25) * 0.02 + EXACT


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_turned_is_a_rotation(axis: int) -> None:
    triangles = box((0.4, 1.2, 0.7), PLACE)
    about = (0.1, 0.2, 0.3)
    found = turned(triangles, axis, 0.7, about)
    before, after = triangles.reshape(-1, 3) - about, found.reshape(-1, 3) - about
    np.testing.assert_allclose(after @ after.T, before @ before.T, atol=EXACT)  # lengths and angles
    np.testing.assert_allclose(after[:, axis], before[:, axis], atol=EXACT)
    assert volume(found) == pytest.approx(volume(triangles), abs=EXACT)  # no mirror
    np.testing.assert_allclose(turned(found, axis, -0.7, about), triangles, atol=EXACT)
    u, v = np.eye(3)[(axis + 1) % 3], np.eye(3)[(axis + 2) % 3]
    quarter = turned(np.tile(u, (1, 3, 1)), axis, math.pi / 2)
    np.testing.assert_allclose(quarter[0, 0], v, atol=EXACT)  # right-handed: u goes to v


def test_shifted_moves_every_point() -> None:
    triangles = box((1.0, 1.0, 1.0), (0, 0, 0))
    np.testing.assert_allclose(shifted(triangles, PLACE), box((1.0, 1.0, 1.0), PLACE), atol=EXACT)


def test_sheet_covers_its_grid_once() -> None:
    x, y = np.meshgrid([0.0, 0.3, 1.0], [0.0, 0.6, 0.8, 2.0])
    triangles = grid_triangles(np.stack([x, y, np.zeros_like(x)], axis=-1))
    assert triangles.shape == (2 * 2 * 3, 3, 3)
    normals = crosses(triangles)
    assert np.all(normals[:, 2] > 0)  # columns run along x, rows along y: x cross y
    assert normals[:, 2].sum() / 2 == pytest.approx(2.0, abs=EXACT)
