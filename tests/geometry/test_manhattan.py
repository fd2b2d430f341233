"""The three directions of a room from edges and normals that are made of known ones."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from langflash_core.geometry import manhattan
from langflash_core.geometry.manhattan import Sights, found_directions

NONE = np.zeros((0, 3))


def angle(a, b) -> float:
    return float(np.degrees(np.arccos(np.clip(a @ b, -1, 1))))


def unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def sights(up: np.ndarray, *, noise: float = 0.2, clutter: int = 0, seed: int = 0) -> Sights:
    """Sixty edges along each direction of a room, off by `noise` degrees; edges along nothing."""
    rng = np.random.default_rng(seed)
    first = unit(np.cross(up, [0.3, 0.1, 1.0]))
    axes = np.stack((first, up, np.cross(first, up)))
    edges = []
    for axis in axes:
        eyes = rng.normal(size=(60, 3))
        planes = np.cross(axis, eyes)
        planes += np.radians(noise) * rng.normal(size=planes.shape)
        edges.append(unit(planes))
    edges.append(unit(rng.normal(size=(clutter, 3))))
    every = np.concatenate(edges)
    return Sights(every, np.full(len(every), 0.1), NONE, np.eye(3)[None])


def leaning(pitch: float, roll: float) -> np.ndarray:
    return Rotation.from_euler("zx", [roll, pitch], degrees=True).apply([0.0, -1.0, 0.0])


@pytest.mark.parametrize(("pitch", "roll"), [(0, 0), (25, 3), (-20, -5), (40, 2)])
def test_edges_tell_up_within_a_quarter_of_a_degree_among_as_many_that_tell_nothing(pitch, roll):
    up = leaning(pitch, roll)
    found = found_directions(sights(up, clutter=120, seed=pitch + 60))
    # 60 edges, each off by .2 degrees, tell .2 / sqrt(30) = .04; what is stray pulls a little more.
    assert angle(found.up, up) < 0.25
    assert np.allclose(found.axes.T @ found.axes, np.eye(3), atol=1e-9)
    assert np.linalg.det(found.axes) > 0 and found.error < 2


def test_a_turned_world_has_turned_directions():
    up = leaning(15, 2)
    own = sights(up)
    turn = Rotation.from_rotvec([0.4, -1.0, 0.7]).as_matrix()
    other = Sights(own.edges @ turn.T, own.lengths, NONE, own.cameras @ turn.T)
    assert angle(turn @ found_directions(own).up, found_directions(other).up) < 1e-5  # arccos near 1


def test_surfaces_alone_tell_up():
    up = leaning(20, -3)
    rng = np.random.default_rng(3)
    side = unit(np.cross(up, [0.0, 0.2, 1.0]))
    normals = np.repeat(np.stack((up, side, np.cross(up, side))), 200, 0) + 0.1 * rng.normal(size=(600, 3))
    found = found_directions(Sights(NONE, np.zeros(0), unit(normals), np.eye(3)[None]))
    assert angle(found.up, up) < 1.5 and found.edges == 0  # normals off by 6 degrees, 400 of them: .3


def test_what_is_known_to_be_level_decides_between_two_rooms():
    first, second = leaning(30, 0), leaning(-15, 0)
    both = [sights(up, seed=k) for k, up in enumerate((first, second))]
    edges = np.concatenate([each.edges for each in both])
    mixed = Sights(edges, np.full(len(edges), 0.1), NONE, np.eye(3)[None], floor=first)
    assert angle(found_directions(mixed).up, first) < 0.5
    mixed = Sights(edges, np.full(len(edges), 0.1), NONE, np.eye(3)[None], floor=-second)
    assert angle(found_directions(mixed).up, second) < 0.5


def test_many_edges_outvote_a_floor_whose_depth_leans_and_a_camera_that_looks_down():
    """Most edges are along one wall, as of a kitchen front; few are upright, and the floor's surface leans by
    20 degrees about that wall, towards the camera's own up. Rooms turned about it explain most edges, too."""
    up = leaning(-31, 1)
    wall = unit(np.cross(up, [0.0, 0.0, 1.0]))
    rng = np.random.default_rng(5)
    edges = []
    for axis, count in ((wall, 60), (up, 8), (np.cross(wall, up), 8)):
        edges.append(unit(np.cross(axis, rng.normal(size=(count, 3)))))
    every = np.concatenate((*edges, unit(rng.normal(size=(30, 3)))))
    every = unit(every + np.radians(0.2) * rng.normal(size=every.shape))
    seen = Sights(every, np.full(len(every), 0.1), NONE, np.eye(3)[None], floor=leaning(-11, 1))
    # About the wall, 16 edges off by .2 degrees tell .2 / sqrt(8) = .07; stray ones pull, as above.
    assert angle(found_directions(seen).up, up) < 0.25


def test_nothing_leaves_the_cameras_own_up_and_says_how_little_is_known():
    found = found_directions(Sights(NONE, np.zeros(0), NONE, np.eye(3)[None]))
    assert angle(found.up, np.array([0.0, -1, 0])) < 1e-5 and found.error > 10


def test_up_that_is_told_stays_and_the_walls_are_found_around_it():
    up = leaning(10, 1)
    found = found_directions(sights(up), up)
    assert angle(found.up, up) < 1e-5 and found.error == 0
    wall = unit(np.cross(up, [0.3, 0.1, 1.0]))
    assert max(abs(found.axes[:, :2].T @ wall)) > np.cos(np.radians(0.5))


def test_the_fit_descends_the_error_that_it_says():
    """The step of the normal equations is that of a slow one by finite differences, of fixed weights."""
    own = sights(leaning(8, 1), noise=0.5)
    axes = manhattan._walls_of(own, leaning(8.5, 1.5))
    information, pull = manhattan._normal_equations(own, axes, 3.0)
    fits = own.edges @ axes
    best = np.abs(fits).argmin(1)
    rows = np.arange(len(best))
    second = np.sort(np.abs(fits), 1)[:, 1]
    weights = (
        own.lengths * manhattan._near(np.abs(fits[rows, best]), 3.0) * (1 - manhattan._near(second, 6.0))
    )

    def error(turn: np.ndarray) -> float:
        turned = Rotation.from_rotvec(turn).as_matrix() @ axes
        return float(weights @ (own.edges @ turned)[rows, best] ** 2) / 2

    small = 1e-6
    slow = np.array([error(small * e) - error(-small * e) for e in np.eye(3)]) / (2 * small)
    assert np.allclose(-pull, slow, atol=1e-7)
    assert error(np.linalg.solve(information, pull)) < error(np.zeros(3))
