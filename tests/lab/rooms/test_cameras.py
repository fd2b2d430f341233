"""Cameras and the photo pipeline, without OpenGL."""

import numpy as np
import pytest

from langflash_core.lab.rooms import HELD_OUT_LIBRARIES, Pack, make_room
from langflash_core.lab.rooms.cameras import look_at, overlap_fraction, propose_cameras
from langflash_core.lab.rooms.sensor import Sensor, expose, meter, random_sensor


def test_look_at_axes() -> None:
    view = look_at(np.array([1.0, 1.5, 4.0]), np.array([1.0, 1.5, 1.0]))
    np.testing.assert_allclose(view @ [1, 1.5, 1, 1], [0, 0, 3, 1], atol=1e-12)
    assert (view @ [2, 1.5, 1, 1])[0] > 0  # right of someone who looks along -z is +x
    assert (view @ [1, 2.5, 1, 1])[1] < 0  # up in the world is -y in the camera
    np.testing.assert_allclose(view[:3, :3] @ view[:3, :3].T, np.eye(3), atol=1e-12)


def test_overlap_of_a_plane() -> None:
    """A wall at 2 m, seen from a step to the side: the share follows from similar triangles."""
    depth = np.full((2, 40, 40), 2.0)
    K = np.array([[40.0, 0, 20], [0, 40, 20], [0, 0, 1]])
    views = np.stack([np.eye(4), np.eye(4)])
    assert overlap_fraction(depth, views, np.stack([K, K])) == 1.0
    views[1, 0, 3] = -0.5  # half a metre to the right: 10 of 40 columns leave
    assert overlap_fraction(depth, views, np.stack([K, K])) == pytest.approx(0.75)
    assert overlap_fraction(np.zeros((2, 4, 4)), views, np.stack([K, K])) == 0.0


@pytest.mark.parametrize("seed", range(8))
def test_cameras_are_held_by_people(pack: Pack, seed: int) -> None:
    room = make_room(seed, pack, HELD_OUT_LIBRARIES)
    cameras = propose_cameras(np.random.default_rng(seed), room, 3, (112, 168))
    if cameras is None:
        return
    field = 2 * np.degrees(np.arctan(84 / cameras.Ks[0, 0, 0]))
    assert 50 <= field <= 90
    eyes = [-v[:3, :3].T @ v[:3, 3] for v in cameras.viewmats]
    for view, eye in zip(cameras.viewmats, eyes, strict=True):
        assert room.shell.holds(eye, eye)
        assert (
            0.09 <= np.linalg.norm(eye - eyes[0]) <= 1.01
            or np.allclose(eye, eyes[0])
            or np.allclose(eye, eyes[2])  # between the first two
        )
        turn = np.degrees(
            np.arccos(np.clip((np.trace(cameras.viewmats[0, :3, :3] @ view[:3, :3].T) - 1) / 2, -1, 1))
        )
        assert turn <= 45.1
        inside = [
            i
            for i in room.instances
            if i.item >= 0 and i.group != "window" and np.all(eye > i.low) and np.all(eye < i.high)
        ]
        assert not inside


def test_exposure_brings_any_light_to_the_same_level() -> None:
    rng = np.random.default_rng(0)
    scene = rng.uniform(0.2, 0.6, (32, 32, 3)).astype(np.float32)
    lit = [scene * gain for gain in (0.1, 1.0, 10.0)]
    photos = [expose(light, Sensor(), np.random.default_rng(1), meter(light)) for light in lit]
    assert np.abs(photos[0].astype(int) - photos[2].astype(int)).max() <= 2
    assert 80 < photos[1].mean() < 180


def test_one_exposure_for_all_photos_of_a_room() -> None:
    """A wall keeps its brightness although the second photo also shows something dark."""
    wall = np.full((32, 32, 3), 0.4, np.float32)
    darker = wall.copy()
    darker[:16] = 0.02
    photos = [expose(light, Sensor(), np.random.default_rng(1), meter(wall)) for light in (wall, darker)]
    assert np.array_equal(photos[0][16:], photos[1][16:])
    assert photos[1][:16].max() < photos[0].min()


@pytest.mark.parametrize("seed", range(6))
def test_the_third_camera_lies_between(pack: Pack, seed: int) -> None:
    room = make_room(seed, pack, HELD_OUT_LIBRARIES)
    cameras = propose_cameras(np.random.default_rng(seed), room, 3, (112, 168))
    if cameras is None:
        return
    first, second, third = (-v[:3, :3].T @ v[:3, 3] for v in cameras.viewmats)
    span = float(np.linalg.norm(second - first))
    share = float((third - first) @ (second - first)) / span**2
    assert -0.2 < share < 1.2  # 0.2 to 0.8, and four sigmas of a tenth
    assert np.linalg.norm(third - first - share * (second - first)) < 0.6 * span


def test_sensor_effects_stay_finite() -> None:
    for seed in range(6):
        rng = np.random.default_rng(seed)
        photo = expose(np.zeros((28, 42, 3), np.float32), random_sensor(rng), rng, grey=0.001)
        assert photo.shape == (28, 42, 3) and photo.dtype == np.uint8
