"""A camera placed by points of a scene, and adjusted by cameras that see the same."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from langflash_core.cameras.placing import Sightings, adjust_camera, place_camera

K = np.array([[700.0, 0, 384], [0, 700, 288], [0, 0, 1]])
COUNT = 200


def pose(degrees: float, x: float) -> np.ndarray:
    """World to a camera that is turned about the vertical and stands aside."""
    viewmat = np.eye(4)
    viewmat[:3, :3] = Rotation.from_euler("yx", [degrees, degrees / 3], degrees=True).as_matrix()
    viewmat[:3, 3] = -viewmat[:3, :3] @ np.array([x, 0.05, 0.1 * x])
    return viewmat


def seen(points: np.ndarray, viewmat: np.ndarray) -> np.ndarray:
    there = points @ viewmat[:3, :3].T + viewmat[:3, 3]
    return there[:, :2] / there[:, 2:] * K.diagonal()[:2] + K[:2, 2]


def degrees_apart(found: np.ndarray, truth: np.ndarray) -> float:
    turn = Rotation.from_matrix(found[:3, :3] @ truth[:3, :3].T)
    return float(np.degrees(np.linalg.norm(turn.as_rotvec())))


@pytest.fixture
def points() -> np.ndarray:
    return np.random.default_rng(4).uniform([-1, -0.7, 1.5], [1, 0.7, 4.0], (COUNT, 3))


def test_a_camera_is_placed_among_points_of_which_a_third_are_wrong(points):
    truth = pose(12, 0.4)
    pixels = seen(points, truth)
    wrong = np.arange(COUNT) % 3 == 0
    pixels[wrong] += np.random.default_rng(5).uniform(20, 80, (wrong.sum(), 2))
    found = place_camera(points, pixels, K, 2.0)
    assert found is not None and np.array_equal(found.agree, ~wrong)
    assert np.allclose(found.viewmat, truth, atol=1e-6)  # the iterations end at 1e-7


def test_too_few_points_place_no_camera(points):
    pixels = seen(points, pose(12, 0.4))
    assert place_camera(points[:5], pixels[:5], K, 2.0) is None
    rng = np.random.default_rng(6)
    assert place_camera(points[:8], rng.uniform(0, 500, (8, 2)), K, 0.1) is None


@pytest.mark.parametrize("mismatched", [0, 20])
def test_what_depths_have_turned_the_cameras_that_see_the_same_turn_back(points, mismatched):
    """Depths of a layer are wrong alike over whole things: here on one side, by a twentieth."""
    truth, known = pose(12, 0.4), [pose(4, 0.1), pose(-5, -0.3)]
    rng = np.random.default_rng(7)
    centre = -known[0][:3, :3].T @ known[0][:3, 3]
    off = np.where(points[:, 0] > 0, 1.05, 1.0)[:, None]
    shown = centre + off * (points - centre)  # along the rays of the first camera, whose layer it is
    pixels = seen(points, truth) + rng.normal(0, 0.3, (COUNT, 2))
    placed = place_camera(shown, pixels, K, 8.0)
    assert placed is not None
    there = [seen(points, viewmat) + rng.normal(0, 0.3, (COUNT, 2)) for viewmat in known]
    there[1][:mismatched] += 60
    sightings = Sightings(
        pixels=pixels,
        depths=shown @ placed.viewmat[2, :3] + placed.viewmat[2, 3],
        of=np.tile(np.arange(COUNT), 2),
        seen=np.concatenate(there),
        viewmats=np.repeat(known, COUNT, 0),
        Ks=np.broadcast_to(K, (2 * COUNT, 3, 3)),
    )
    found = adjust_camera(placed.viewmat, K, sightings)
    before, after = degrees_apart(placed.viewmat, truth), degrees_apart(found, truth)
    # A sighting of .3 pixels at a focal length of 700 is .025 degrees; a turn looks nearly like a shift,
    # so that 400 together tell it hardly better than one, but the place by a tenth of what depths had it.
    assert after < min(0.04, before / 2)
    shift, was = (np.linalg.norm(matrix[:3, 3] - truth[:3, 3]) for matrix in (found, placed.viewmat))
    assert shift < 0.1 * was
