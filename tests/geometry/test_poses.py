"""Camera control: pure functions against hand-made cases and the core's own geometry."""

import math
from dataclasses import replace

import numpy as np
import pytest
import torch

from langflash_core.geometry import poses, reach, rotations
from langflash_core.geometry.cameras import transform
from langflash_core.geometry.poses import FOV_RANGE, Pose, Rotation, Vector
from langflash_core.geometry.quaternions import quats_to_matrices
from langflash_core.geometry.reach import median_reach
from tests.geometry.twins import seen_at

# Poses are float64 and a few operations long; float32 enters only where a Camera is made.
EXACT, SINGLE = 1e-9, 1e-5


def some_pose() -> Pose:
    turned = poses.look(Pose(reach=2.0, aspect=4 / 3), 0.4, -0.3)
    return poses.fly(turned, 0.3, -0.2, 0.5)


@pytest.mark.parametrize(("yaw", "pitch"), [(0.3, 0.0), (0.0, 0.25), (-1.2, -0.4), (3.0, 0.1)])
def test_orbit_keeps_the_pivot_and_its_distance(yaw: float, pitch: float) -> None:
    before = some_pose()
    after = poses.orbit(before, yaw, pitch)
    np.testing.assert_allclose(after.pivot, before.pivot, atol=EXACT)
    assert after.reach == before.reach
    assert np.linalg.norm(np.array(after.centre) - before.pivot) == pytest.approx(before.reach, abs=EXACT)


def test_orbit_never_rolls_or_passes_a_pole() -> None:
    pose = Pose()
    for _ in range(200):
        pose = poses.orbit(pose, 0.05, 0.2)
        assert abs(pose.axes[1, 0]) < EXACT  # the picture's x axis stays level
    up = math.degrees(math.acos(float(np.clip(pose.axes[:, 2] @ poses.UP, -1, 1))))
    assert up == pytest.approx(poses.MIN_POLE_DEGREES, abs=1e-6)


def test_signs_are_those_of_the_hand() -> None:
    assert poses.look(Pose(), -0.1, 0.0).axes[0, 2] > 0  # a drag to the right looks right
    assert poses.look(Pose(), 0.0, 0.1).axes[1, 2] < 0  # up is -y
    assert poses.pan(Pose(), 0.5, 0.0).centre == Vector(0.5, 0.0, 0.0)
    assert poses.fly(Pose(), 0.0, 0.0, 0.5).centre == Vector(0.0, 0.0, 0.5)


def test_zoom_moves_along_the_view_to_the_same_pivot() -> None:
    before = some_pose()
    after = poses.zoom(before, 0.5)
    assert after.reach == before.reach / 2
    np.testing.assert_allclose(after.pivot, before.pivot, atol=EXACT)
    for _ in range(100):
        after = poses.zoom(after, 0.5)
    assert after.reach == poses.MIN_REACH


def test_a_view_comes_back_as_its_own_camera() -> None:
    quat = torch.nn.functional.normalize(torch.tensor([0.9, 0.2, -0.3, 0.1]), dim=0)
    viewmat = torch.eye(4)
    viewmat[:3, :3] = quats_to_matrices(quat)
    viewmat[:3, 3] = torch.tensor([0.1, -0.4, 0.7])
    K = torch.tensor([[200.0, 0, 118.0], [0, 200.0, 80.0], [0, 0, 1]])
    pose = poses.from_view(viewmat.double().numpy(), K.double().numpy(), (224, 168), 1.5)
    camera = poses.to_camera(pose, 224, 168)
    torch.testing.assert_close(camera.viewmat, viewmat, atol=SINGLE, rtol=0)
    torch.testing.assert_close(camera.K, K, atol=1e-3, rtol=0)  # a thousandth of a pixel


@pytest.mark.parametrize("size", [(900, 300), (300, 900), (640, 480)])
@pytest.mark.parametrize("photo", [(224, 168), (168, 224)])
def test_a_photo_fits_a_narrow_panel_and_a_wide_one_halfway(
    size: tuple[int, int], photo: tuple[int, int]
) -> None:
    """In a narrower panel it touches both sides; in a wider one it is out of sight above and below by as much
    as it leaves bars aside, both in shares, or magnified by 1.6."""
    K = np.array([[190.0, 0, photo[0] / 2], [0, 190.0, photo[1] / 2], [0, 0, 1]])
    pose = poses.from_view(np.eye(4), K, photo, 1.0)
    camera = poses.to_camera(pose, *size)
    half = torch.tensor([photo[0] / 380.0, photo[1] / 380.0])  # tangents of the half angles
    corners = torch.tensor([[-half[0], -half[1], 1.0], [half[0], half[1], 1.0]])
    pixels = seen_at(transform(camera.viewmat, corners), camera.K)
    (left, top), (right, bottom) = pixels.tolist()
    across, along = (right - left) / size[0], (bottom - top) / size[1]
    slack = 1e-4  # float32
    ratio = size[0] / size[1] * photo[1] / photo[0]
    if ratio <= 1:
        assert across == pytest.approx(1, abs=slack) and along < 1 + slack
    else:
        assert along == pytest.approx(min(1 / across, 1.6), abs=slack)
        assert along / across == pytest.approx(ratio)
    assert left + right == pytest.approx(size[0], abs=0.1) and top + bottom == pytest.approx(size[1], abs=0.1)
    box = poses.box_in(pose, *size)
    assert box == pytest.approx((right - left, bottom - top), rel=slack)


@pytest.mark.parametrize("aspect", [4 / 3, 3 / 4, 9 / 16])
def test_what_is_framed_shows_whole_in_a_window(aspect: float) -> None:
    pose = poses.framing(poses.orbit(Pose(reach=0.5, aspect=aspect), 0.7, 0.3), LOW, HIGH)
    corners = np.array([[x, y, z] for x in (LOW.x, HIGH.x) for y in (LOW.y, HIGH.y) for z in (LOW.z, HIGH.z)])
    for size in ((1280, 800), (round(800 * aspect), 800)):
        found = poses.project(corners, pose, size)
        assert found is not None
        assert (found[1] > 0).all() and (found[1] < size).all()


def test_blend_is_exact_at_the_ends_and_steady_between() -> None:
    start, end = Pose(), poses.with_fov(some_pose(), 90)
    assert poses.blend(start, end, 0.0) is start
    assert poses.blend(start, end, 1.0) is end
    middle = poses.blend(start, end, 0.5)
    np.testing.assert_allclose(np.array(middle.centre), np.array(end.centre) / 2, atol=EXACT)
    assert middle.fov == pytest.approx((start.fov + end.fov) / 2)
    total = _angle(start.rotation, end.rotation)
    assert _angle(start.rotation, middle.rotation) == pytest.approx(total / 2, abs=1e-7)


def test_slerp_takes_the_shorter_arc() -> None:
    turned = Rotation(math.cos(0.2), 0.0, math.sin(0.2), 0.0)
    negated = Rotation(*(-v for v in turned))
    half = Rotation(math.cos(0.1), 0.0, math.sin(0.1), 0.0)
    for end in (turned, negated):
        np.testing.assert_allclose(rotations.slerp(Rotation(1, 0, 0, 0), end, 0.5), half, atol=EXACT)
    same = rotations.slerp(turned, turned, 0.3)
    np.testing.assert_allclose(same, turned, atol=EXACT)


def test_fov_is_clamped() -> None:
    assert poses.with_fov(Pose(), 500).fov == FOV_RANGE[1]
    assert poses.with_fov(Pose(), 0).fov == FOV_RANGE[0]


def test_median_reach_looks_only_at_the_middle_and_the_front() -> None:
    K = np.array([[100.0, 0, 50], [0, 100.0, 50], [0, 0, 1]])
    means = np.array([[0, 0, 2.0], [0, 0.1, 3.0], [0.1, 0, 4.0], [9, 0, 10.0], [0, 0, -5.0]])
    assert median_reach(means, np.eye(4), K, (100, 100)) == 3.0
    assert median_reach(np.zeros((0, 3)), np.eye(4), K, (100, 100)) == 1.0


def test_some_of_millions_tell_the_reach(monkeypatch) -> None:
    K = np.array([[100.0, 0, 50], [0, 100.0, 50], [0, 0, 1]])
    means = np.random.default_rng(0).normal((0, 0, 5), 0.5, (5000, 3))
    asked, real = [], reach.see
    monkeypatch.setattr(reach, "_ENOUGH", 1000)
    monkeypatch.setattr(reach, "see", lambda some, *how: asked.append(len(some)) or real(some, *how))
    assert median_reach(means, np.eye(4), K, (100, 100)) == pytest.approx(5.0, abs=0.05)
    assert asked[0] <= 1000


def _angle(a: Rotation, b: Rotation) -> float:
    return math.acos(min(abs(float(np.dot(a, b))), 1.0))


@pytest.mark.parametrize("side", [(0, 1, 0), (0, -1, 0), (0, 0, -1), (1, 0, 0)])
def test_a_look_along_an_axis_stays_where_photos_saw_it(side: tuple[float, float, float]) -> None:
    start, places = Pose(reach=2.0), (Vector(0.0, 0.0, 0.0), Vector(0.2, 0.0, 0.0))
    near, free = (poses.facing_near(start, Vector(*side), given) for given in (places, ()))
    assert free == poses.facing(start, Vector(*side))
    assert poses.degrees_aside(near, places) == pytest.approx(poses.NEAR, abs=1e-6)
    assert poses.degrees_aside(free, places) > 70  # what was black
    np.testing.assert_allclose(near.pivot, start.pivot, atol=EXACT)
    if side[2] == 0:  # on the way there
        assert near.axes[:, 2] @ free.axes[:, 2] > start.axes[:, 2] @ free.axes[:, 2] + 0.5
    assert poses.facing_near(start, Vector(0.0, 0.0, 1.0), places) == poses.facing(
        start, Vector(0.0, 0.0, 1.0)
    )


@pytest.mark.parametrize(("yaw", "pitch"), [(0.3, 0.0), (0.0, 0.25), (-0.7, -0.4)])
def test_an_orbit_around_a_point_keeps_it_where_it_is_in_the_picture(yaw: float, pitch: float) -> None:
    before, size = some_pose(), (640, 480)
    point = before.pivot + before.axes @ np.array([0.4, -0.3, 0.5])
    after = poses.orbit(before, yaw, pitch, pivot=point)
    seen = [poses.project(point[None], pose, size) for pose in (before, after)]
    assert seen[0] is not None and seen[1] is not None
    np.testing.assert_allclose(seen[0][0], seen[1][0], atol=EXACT)  # as deep, too
    assert after.reach == pytest.approx(before.reach + 0.5)
    assert after.rotation == poses.look(before, yaw, pitch).rotation
    own = poses.orbit(before, yaw, pitch, pivot=before.pivot)
    np.testing.assert_allclose(own.centre, poses.orbit(before, yaw, pitch).centre, atol=EXACT)


def test_a_flat_pose_orbits_around_what_keeps_the_scene_ahead() -> None:
    flat = poses.orthographic(some_pose(), Vector(-1.0, -1.0, 0.0), Vector(1.0, 1.0, 2.0))
    assert poses.orbit(flat, 0.3, 0.1, pivot=np.zeros(3)) == poses.orbit(flat, 0.3, 0.1)


def test_between_level_poses_the_way_is_level() -> None:
    """By slerp a turn around between two pictures that look up passes the pole, and leans."""
    up = np.array([0.6, -0.8, 0.0])
    start = poses.facing(Pose(), Vector(-0.3, 0.2, 1.0), up)
    end = poses.look(start, 2.8, 0.3, up)
    halves = [poses.blend(start, end, 0.5, *given) for given in ((), (up,))]
    leaning = [abs(poses.roll(pose, up)) for pose in halves]
    assert leaning[1] < EXACT < 0.1 < leaning[0]
    for fraction, there in ((1e-9, start), (1 - 1e-9, end)):
        np.testing.assert_allclose(poses.blend(start, end, fraction, up).axes, there.axes, atol=1e-6)
    rolled = replace(start, rotation=poses._rotation(rotations.about(start.axes[:, 2], 0.4) @ start.axes))
    assert poses.roll(poses.blend(rolled, end, 0.5, up), up) == pytest.approx(0.5 * poses.roll(rolled, up))
    assert poses.blend(start, end, 0.0, up) == start and poses.blend(start, end, 1.0, up) == end


LOW, HIGH = Vector(-1.0, -1.0, 0.0), Vector(1.0, 1.0, 2.0)


def at_pixel(pose: Pose, point: tuple[float, float, float], size: tuple[int, int] = (640, 480)) -> np.ndarray:
    found = poses.project(np.array([point]), pose, size)
    assert found is not None
    return found[1][0]


def test_parallel_rays_keep_the_pivot_as_large_and_everything_ahead() -> None:
    before = some_pose()
    flat = poses.orthographic(before, LOW, HIGH)
    np.testing.assert_allclose(flat.pivot, before.pivot, atol=EXACT)
    side = tuple(before.pivot + 0.1 * before.axes[:, 0])
    np.testing.assert_allclose(at_pixel(flat, side), at_pixel(before, side), atol=1e-6)
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (0, 2)], float)
    for turned in (flat, poses.orbit(flat, 2.0, 0.5), poses.facing(flat, Vector(0.0, 1.0, 0.0))):
        assert poses.project(corners, turned, (640, 480)) is not None
    back = poses.perspective(flat)
    np.testing.assert_allclose(back.centre, before.centre, atol=EXACT)
    assert back.span is None and back.reach == pytest.approx(before.reach)


def test_parallel_rays_show_a_point_at_one_place_at_any_depth() -> None:
    flat = poses.orthographic(Pose(reach=2.0), LOW, HIGH)
    np.testing.assert_allclose(at_pixel(flat, (0.3, 0.2, 0.5)), at_pixel(flat, (0.3, 0.2, 1.9)), atol=EXACT)
    unit = poses.units_per_pixel(flat, 640, 480)
    across = at_pixel(flat, (0.5, 0.0, 1.0)) - at_pixel(flat, (0.0, 0.0, 1.0))
    assert across[0] * unit == pytest.approx(0.5)


def test_the_cameras_own_projection_is_the_poses() -> None:
    flat = poses.orbit(poses.orthographic(some_pose(), LOW, HIGH), 0.4, 0.2)
    camera = poses.to_camera(flat, 640, 480)
    assert camera.orthographic
    point = torch.tensor([[0.2, -0.3, 1.1]])
    pos_c = transform(camera.viewmat, point)[0]
    expected = pos_c[:2] * torch.stack((camera.K[0, 0], camera.K[1, 1])) + camera.K[:2, 2]
    np.testing.assert_allclose(
        at_pixel(flat, (0.2, -0.3, 1.1)), expected.numpy(), atol=1e-2
    )  # float32 pixels
    again = poses.from_view(
        camera.viewmat.double().numpy(), camera.K.double().numpy(), (640, 480), flat.reach, orthographic=True
    )
    assert again.span == pytest.approx(flat.span, rel=SINGLE)


def test_with_parallel_rays_nearer_means_larger() -> None:
    flat = poses.orthographic(Pose(reach=2.0), LOW, HIGH)
    assert flat.span is not None
    zoomed, flown = poses.zoom(flat, 0.5), poses.fly(flat, 0.0, 0.0, 0.1)
    assert zoomed.span == flat.span / 2 and zoomed.centre == flat.centre
    assert flown.span is not None and flown.span < flat.span and flown.centre == flat.centre


@pytest.mark.parametrize("aspect", [4 / 3, 3 / 4])
def test_framing_by_parallel_rays_shows_the_whole_box(aspect: float) -> None:
    flat = poses.orthographic(Pose(reach=0.5, aspect=aspect), LOW, HIGH)
    framed = poses.framing(poses.orbit(flat, 0.7, 0.3), LOW, HIGH)
    size = (round(480 * aspect), 480)
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (0, 2)], float)
    found = poses.project(corners, framed, size)
    assert found is not None
    assert (found[1] >= 0).all() and (found[1] <= np.array(size)).all()
    assert (found[1].max(0) - found[1].min(0) > 0.9 * np.array(size)).any()  # and no smaller than needed


def test_the_way_between_perspective_and_parallel_rays_is_in_perspective() -> None:
    start, flat = some_pose(), poses.orthographic(some_pose(), LOW, HIGH)
    assert poses.blend(start, flat, 0.0) is start and poses.blend(start, flat, 1.0) is flat
    assert poses.blend(start, flat, 0.5).span is None
    wider = poses.zoom(flat, 2.0)
    middle = poses.blend(flat, wider, 0.5)
    assert flat.span is not None and middle.span == pytest.approx(1.5 * flat.span)
    assert poses.alike((start, flat))[1].span is None and poses.alike((flat, wider)) == (flat, wider)


@pytest.mark.parametrize(("yaw", "pitch"), [(0.3, 0.0), (0.0, 0.25), (-0.9, -0.4), (3.0, 0.1)])
@pytest.mark.parametrize("degrees", [0.0, 20.0, 75.0])
def test_whatever_up_is_turning_keeps_it_up(degrees: float, yaw: float, pitch: float) -> None:
    """Twin: the same turn in a world that is turned so that up is -y."""
    turn = rotations.about(np.array([1.0, 0.3, 0.2]), math.radians(degrees))
    up, start = -turn[1], poses.facing(Pose(reach=2.0), Vector(*turn[2].tolist()), -turn[1])
    moved = poses.orbit(start, yaw, pitch, up)
    level = Pose(reach=2.0, rotation=Rotation(*rotations.quaternion(turn @ start.axes)))
    np.testing.assert_allclose(turn @ moved.axes, poses.orbit(level, yaw, pitch).axes, atol=1e-7)
    assert abs(poses.roll(moved, up)) < 1e-7
    tilt = rotations.about(moved.axes[:, 2], 0.3)
    aslant = Pose(reach=2.0, rotation=Rotation(*rotations.quaternion(tilt @ moved.axes)))
    assert poses.roll(aslant, up) == pytest.approx(0.3, abs=1e-7)
    np.testing.assert_allclose(poses.make_upright(aslant, up).axes, moved.axes, atol=1e-7)
    assert poses.roll(poses.make_upright(aslant, up, 0.5), up) == pytest.approx(0.15, abs=1e-7)


def test_what_is_seen_of_a_line_is_what_lies_in_front():
    line = np.array([[0.0, 0.0, -1.0], [0.0, 0.0, 1.0], [0.5, 0.0, 1.0], [0.5, 0.5, 2.0]])
    pose = Pose(fov=90.0, aspect=1.0)
    pieces = poses.visible(line, pose, (100, 100))
    expected = poses.project(line[1:], pose, (100, 100))
    assert expected is not None and pieces.shape == (2, 2, 2)
    np.testing.assert_allclose(pieces, np.stack((expected[1][:-1], expected[1][1:]), 1))
    assert len(poses.visible(line[:1], pose, (100, 100))) == 0


@pytest.mark.parametrize("size", [(640, 400), (300, 500), (417, 311)])
def test_the_pose_of_a_picture_sees_all_of_it_as_before(size: tuple[int, int]) -> None:
    for aspect in (0.6, 1.5):
        pose = replace(poses.orbit(Pose(reach=2.0), 0.4, 0.2), aspect=aspect, shift=(0.05, -0.02))
        whole = poses.of_picture(pose, *size)
        assert whole.aspect == size[0] / size[1] and whole.axes.tolist() == pose.axes.tolist()
        np.testing.assert_allclose(poses.intrinsics(whole, *size), poses.intrinsics(pose, *size), rtol=1e-9)
        assert poses.with_lens(whole, pose) == pose
        flat = replace(pose, span=3.0)
        assert poses.of_picture(flat, *size) == flat
