"""Tracks and the adjustment of all photos: against scipy, against truth, and where photos tell too little."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from langflash_core.cameras import bundle as bundles
from langflash_core.cameras.adjustment import Sought
from langflash_core.cameras.bundle import Bundle, Optics, adjusted_bundle
from langflash_core.cameras.inputs import PoseInput
from langflash_core.cameras.keypoints import KeyPoints
from langflash_core.cameras.poses import Poses, estimate_poses, on_other_maps
from langflash_core.cameras.tracks import Tracks, join_matches, with_pairs
from langflash_core.rig.settings import BUNDLE, MATCHING

SIZE, FOCAL = (224, 168), 200.0  # 58.5 degrees


def _walk(num_views: int, *, step=(0.25, 0.02, 0.05), turn=(0.01, -0.07, 0.0)) -> np.ndarray:
    """Cameras that walk and turn, (V, 4, 4), world = the first."""
    viewmats = np.repeat(np.eye(4)[None], num_views, 0)
    for v in range(num_views):
        viewmats[v, :3, :3] = Rotation.from_rotvec(v * np.array(turn)).as_matrix()
        viewmats[v, :3, 3] = -viewmats[v, :3, :3] @ (v * np.array(step))
    return viewmats


def _seen(viewmats: np.ndarray, points: np.ndarray, bend: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Pixels (V, P, 2) from the principal point, and z (V, P)."""
    pos = np.einsum("vij,pj->vpi", viewmats[:, :3, :3], points) + viewmats[:, None, :3, 3]
    q = pos[..., :2] / pos[..., 2:]
    return FOCAL * q * (1 + bend * (q**2).sum(-1, keepdims=True)), pos[..., 2]


def _room(seed: int, count: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return np.column_stack(
        (rng.uniform(-2, 3, count), rng.uniform(-1.2, 1.2, count), rng.uniform(2, 5, count))
    )


def _inside(pixels: np.ndarray, z: np.ndarray) -> np.ndarray:
    return (z > 0.3) & (np.abs(pixels) < np.array(SIZE) / 2 - 2).all(-1)


def _problem(num_views: int, *, count=60, noise=0.1, seed=0, bend=0.0, **way):
    """Tracks with noise, true poses and log depths of maps that are smaller by a half."""
    rng = np.random.default_rng(seed)
    viewmats, points = _walk(num_views, **way), _room(seed, count)
    pixels, z = _seen(viewmats, points, bend)
    inside = _inside(pixels, z)
    of, views = np.nonzero(inside.T)
    shown = pixels[views, of] + rng.normal(0, noise, (len(of), 2))
    tracks, rows, _ = Tracks(of, views, shown, np.full(len(of), 0.1)).subset(np.ones(len(of), bool))
    logs = np.log(z[views, of])[rows] + rng.normal(0, 0.1, len(rows))
    return tracks, viewmats, logs


def _rig(num_views: int, wrong: float = 1.0, doubt: float = 0.0, bend_doubt: float = 0.0) -> Optics:
    lenses = np.zeros(num_views, int)
    return Optics(np.full(num_views, FOCAL * wrong), lenses, np.array([doubt]), np.array([bend_doubt]))


def _adjusted(tracks, viewmats, logs, optics) -> Bundle:
    return adjusted_bundle(
        viewmats, np.zeros(len(viewmats)), np.zeros(len(optics.doubts)), optics, tracks, logs
    )


def _shaken(viewmats: np.ndarray, seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    moved = viewmats.copy()
    for view in moved[1:]:
        view[:3, :3] = Rotation.from_rotvec(rng.normal(0, 0.02, 3)).as_matrix() @ view[:3, :3]
        view[:3, 3] += rng.normal(0, 0.04, 3)
    return moved


def _turned(found: np.ndarray, true: np.ndarray) -> float:
    """Degrees, the worst view's."""
    between = found[:, :3, :3] @ true[:, :3, :3].transpose(0, 2, 1)
    return float(np.degrees(Rotation.from_matrix(between).magnitude()).max())


def test_matches_become_tracks_and_those_that_contradict_themselves_go():
    positions = [
        np.array([[1.0, 1], [2, 2], [3, 3]]),
        np.array([[4.0, 4], [5, 5]]),
        np.array([[6.0, 6], [7, 7]]),
    ]
    pairs = {
        (0, 1): np.array([[0, 0], [1, 1]]),
        (1, 2): np.array([[0, 0], [1, 1]]),
        (0, 2): np.array([[2, 1]]),  # the second point twice in view 0
    }
    tracks = join_matches(positions, pairs, [0.5, 0.5, 0.7])
    assert tracks.points.tolist() == [0, 0, 0] and tracks.views.tolist() == [0, 1, 2]
    assert tracks.pixels.tolist() == [[1, 1], [4, 4], [6, 6]] and tracks.sigmas.tolist() == [0.5, 0.5, 0.7]
    more = with_pairs(tracks, [(0, 2, np.ones((2, 2)), np.zeros((2, 2)), 3.0)])
    assert more.points.tolist() == [0, 0, 0, 1, 1, 2, 2] and more.views.tolist() == [0, 1, 2, 0, 2, 0, 2]
    fewer, rows, points = more.subset(np.array([1, 0, 0, 1, 1, 1, 1], bool))
    assert (
        fewer.points.tolist() == [0, 0, 1, 1] and rows.tolist() == [3, 4, 5, 6] and points.tolist() == [1, 2]
    )
    assert len(join_matches([np.zeros((0, 2))] * 2, {(0, 1): np.zeros((0, 2), int)}, [1.0, 1.0])) == 0


def test_key_points_of_one_place_are_one():
    positions = [np.array([[1.0, 1], [1, 1]]), np.array([[4.0, 4]]), np.array([[6.0, 6]])]
    tracks = join_matches(positions, {(0, 1): np.array([[0, 0]]), (0, 2): np.array([[1, 0]])}, [1.0] * 3)
    assert tracks.views.tolist() == [0, 1, 2] and tracks.num_points == 1


def _soft(residuals: np.ndarray) -> np.ndarray:
    """Vectors (M, d) whose squares are Cauchy's cost; short ones are half of `residuals`."""
    lengths = np.maximum(np.linalg.norm(residuals, axis=1, keepdims=True), 1e-9)
    return residuals * np.sqrt(np.log1p((lengths / 2) ** 2)) / lengths


@pytest.mark.parametrize("bend", [0.0, -0.15])
def test_the_adjustment_reaches_the_optimum_of_scipy(monkeypatch, bend):
    """Poses, points, scales and the lens of four photos at once, wrong matches among them; a lens that bends
    lines, and one that must not.

    Both minimise one robust cost. The fast one reweights, so it nears the minimum by a share a step; so it is
    let run on here, and both end where a step changes the cost by rounding alone.
    """
    tracks, true, log_depths = _problem(4, count=30, bend=bend)
    wrong = tracks.pixels.copy()
    wrong[::17] += 3.0
    tracks = replace(tracks, pixels=wrong)
    exactly = replace(bundles.BUNDLE, rounds=1, converged=1e-12, iterations=300)
    monkeypatch.setattr(bundles, "BUNDLE", exactly)
    optics = _rig(4, 1.1, 0.35, 0.15 if bend else 0.0)
    found = _adjusted(tracks, _shaken(true), log_depths, optics)

    def unpacked(x):
        poses = np.concatenate((np.zeros((1, 6)), x[:18].reshape(3, 6)))
        viewmats = np.repeat(np.eye(4)[None], 4, 0)
        viewmats[:, :3, :3] = Rotation.from_rotvec(poses[:, :3]).as_matrix()
        viewmats[:, :3, 3] = poses[:, 3:]
        return viewmats, np.append(0.0, x[18:21]), x[23:].reshape(-1, 3), x[21:22], x[22:23]

    def residuals(x):
        viewmats, logs, points, growth, k = unpacked(x)
        k = k if bend else np.zeros(1)
        pos = np.einsum("mij,mj->mi", viewmats[tracks.views, :3, :3], points[tracks.points])
        pos = pos + viewmats[tracks.views, :3, 3]
        z = np.maximum(pos[:, 2], 1e-6)
        q = pos[:, :2] / z[:, None]
        shown = FOCAL * 1.1 * np.exp(growth) * q * (1 + k * (q**2).sum(1, keepdims=True))
        seen = (shown - tracks.pixels) / tracks.sigmas[:, None]
        depth = (np.log(z) - log_depths - logs[tracks.views]) / 0.25
        shares = np.minimum(1, 1 / np.bincount(tracks.views))[tracks.views]
        soft = (_soft(seen), np.sqrt(shares) * _soft(depth[:, None])[:, 0])
        return np.concatenate((soft[0].ravel(), soft[1], logs / 0.3 / 2, growth / 0.35 / 2, k / 0.15 / 2))

    turns = Rotation.from_matrix(found.viewmats[1:, :3, :3]).as_rotvec()
    poses = np.column_stack((turns, found.viewmats[1:, :3, 3])).ravel()
    start = np.concatenate((poses, np.zeros(3), found.growths, found.bends, found.points.ravel()))
    rng = np.random.default_rng(0)
    start = start + rng.normal(0, 1e-3, len(start))
    twin = least_squares(residuals, start, jac="3-point", x_scale="jac", xtol=1e-15, ftol=1e-15, gtol=1e-15)
    rng = np.random.default_rng(0)
    viewmats, _, points, growth, k = unpacked(twin.x)
    assert _turned(found.viewmats, viewmats) < 5e-3
    np.testing.assert_allclose(found.viewmats[:, :3, 3], viewmats[:, :3, 3], atol=2e-4)
    np.testing.assert_allclose(found.growths, growth, atol=3e-4)
    np.testing.assert_allclose(found.bends, k if bend else 0.0, atol=1e-3)
    np.testing.assert_allclose(found.points, points, atol=2e-3)


def test_the_lens_is_found_within_its_error():
    errors = []
    for seed in range(12):
        tracks, true, logs = _problem(6, seed=seed)
        found = _adjusted(tracks, _shaken(true, seed), logs, _rig(6, 0.85, 0.35))
        errors.append(((found.growths[0] + np.log(0.85)) / found.errors[0], found.errors[0]))
        assert _turned(found.viewmats, true) < 0.4
    ratios, sizes = np.array(errors).T
    assert 0.5 < np.sqrt((ratios**2).mean()) < 1.7  # a chi of 12 degrees of freedom lies there in 99.9 %
    assert sizes.max() < 0.02


@pytest.mark.parametrize("bend", [-0.06, 0.05])
def test_a_bend_is_found_within_its_error(bend):
    """From where straight lines lead, whose focal length is off by a tenth and more. Thrice the error is what
    `adjustment` tells of it."""
    for seed in range(3):
        tracks, true, logs = _problem(6, seed=seed, bend=bend, count=120)
        straight = _adjusted(tracks, _shaken(true, seed), logs, _rig(6, 0.95, 0.35))
        optics = _rig(6, 0.95, 0.35, 0.15)
        found = adjusted_bundle(straight.viewmats, np.zeros(6), straight.growths, optics, tracks, logs)
        assert straight.bends[0] == straight.bend_errors[0] == 0
        assert abs(found.bends[0] - bend) < 3 * found.bend_errors[0] < 0.05
        assert _turned(found.viewmats, true) < 0.5 * _turned(straight.viewmats, true)


def test_a_known_lens_stays_and_wrong_matches_are_left_out():
    tracks, true, logs = _problem(5)
    wrong = np.zeros(len(tracks), bool)
    wrong[::9] = True
    spoiled = replace(tracks, pixels=np.where(wrong[:, None], -tracks.pixels[:, ::-1], tracks.pixels))
    found = _adjusted(spoiled, _shaken(true), logs, _rig(5))
    assert found.growths[0] == found.errors[0] == 0
    assert _turned(found.viewmats, true) < 0.6 and len(found.tracks) < len(tracks) - 0.8 * wrong.sum()
    assert found.depths.min() > 0 and np.isfinite(found.depth_errors).all()


def test_a_camera_on_a_tripod_tells_its_lens_but_no_depth():
    tracks, true, logs = _problem(5, step=(0, 0, 0), turn=(0.05, -0.2, 0.02), count=200)
    found = _adjusted(tracks, _shaken(true), logs, _rig(5, 1.2, 0.35))
    assert abs(found.growths[0] + np.log(1.2)) < 0.02 and found.errors[0] < 0.01
    assert _turned(found.viewmats, true) < 1.0
    assert np.isfinite(found.points).all() and found.depth_errors.min() > 0.2  # nothing but the maps knows


@pytest.mark.parametrize("flat", [False, True])
def test_walking_ahead_tells_no_lens(flat):
    """Nor before one wall; the error says so and nothing is infinite."""
    rng = np.random.default_rng(0)
    viewmats, points = _walk(4, step=(0, 0, 0.1), turn=(0, 0, 0)), _room(0, 80)
    if flat:
        points[:, 2] = 4.0
    pixels, z = _seen(viewmats, points)
    of, views = np.nonzero(_inside(pixels, z).T)
    shown = pixels[views, of] + rng.normal(0, 0.1, (len(of), 2))
    tracks, rows, _ = Tracks(of, views, shown, np.full(len(of), 0.1)).subset(np.ones(len(of), bool))
    found = _adjusted(tracks, viewmats, np.log(z[views, of])[rows], _rig(4, 1.0, 0.35))
    assert np.isfinite(found.viewmats).all() and np.isfinite(found.points).all()
    assert found.errors[0] > 0.05


def _photos(viewmats: np.ndarray, *, said: float = 1.0, count: int = 300, seed: int = 0, bend: float = 0.0):
    """What pose estimation reads of photos of a room: lenses that are said to be `said` times as long."""
    rng = np.random.default_rng(seed)
    points = _room(seed, count)
    pixels, z = _seen(viewmats, points, bend)
    K = np.array([[FOCAL * said, 0, SIZE[0] / 2], [0, FOCAL * said, SIZE[1] / 2], [0, 0, 1]])
    ratio, middle = MATCHING.working_side / max(SIZE), np.array(SIZE) / 2
    views, positions, numbers = [], [], []
    for own, depths in zip(pixels, z, strict=True):
        depth = np.full(SIZE[::-1], 3.0)
        keep = np.flatnonzero(_inside(own, depths))
        places = own[keep] + middle
        depth[places[:, 1].astype(int), places[:, 0].astype(int)] = depths[keep]
        views.append(PoseInput(K, SIZE, depth, np.zeros((4, 12, 16))))
        positions.append((places + rng.normal(0, 0.1, places.shape)) * ratio)
        numbers.append(keep)
    pairs = {}
    for i in range(len(viewmats)):
        for j in range(i + 1, len(viewmats)):
            pairs[i, j] = np.column_stack(np.intersect1d(numbers[i], numbers[j], return_indices=True)[1:])
    return views, KeyPoints(tuple(positions), pairs)


def _sought(num_views: int) -> Sought:
    return Sought((0,) * num_views, (0.35,))


def test_photos_tell_poses_and_lens():
    true = _walk(6)
    views, points = _photos(true, said=0.85)
    found = estimate_poses(views, points, sought=_sought(6))
    [lens] = found.lenses
    assert lens is not None and lens.photos == 6
    assert abs(lens.growth * 0.85 - 1) < min(0.02, 3 * lens.error) and lens.error < 0.03
    assert (found.growths == lens.growth).all() and _turned(found.viewmats, true) < 0.3
    told = estimate_poses(views, points)
    assert told.lenses == (None,) and (told.growths == 1).all()
    assert _turned(told.viewmats, true) > 2 * _turned(found.viewmats, true)


@pytest.mark.parametrize("bend", [-0.1, 0.06])
def test_photos_tell_a_lens_that_bends_lines(bend):
    """Before anything is made of poses that rest on straight lines."""
    views, points = _photos(_walk(8, step=(0.15, 0.01, 0.02), turn=(0.01, -0.05, 0)), said=0.95, bend=bend)
    sought = Sought((0,) * 8, (0.35,), bends=True)
    found = estimate_poses(views, points, sought=sought)
    assert (found.viewmats == np.eye(4)).all() and found.adjusted is None
    [lens] = found.bent
    assert lens is not None and lens.photos == 8
    assert abs(lens.bend - bend) < max(0.015, 3 * lens.bend_error) and lens.bend_error < 0.03
    assert abs(lens.growth * 0.95 - 1) < 0.02
    assert not estimate_poses(views, points, sought=replace(sought, bends=False)).bent


def test_a_lens_that_bends_nothing_is_taken_for_straight():
    views, points = _photos(_walk(8, step=(0.15, 0.01, 0.02), turn=(0.01, -0.05, 0)), said=0.95)
    free = estimate_poses(views, points, sought=Sought((0,) * 8, (0.35,), bends=True))
    held = estimate_poses(views, points, sought=Sought((0,) * 8, (0.35,)))
    [lens] = free.lenses
    assert lens is not None and lens.bend == 0 and (free.viewmats == held.viewmats).all()


def test_two_photos_are_as_they_were_and_tell_no_lens():
    views, points = _photos(_walk(2), said=0.85)
    plain, sought = estimate_poses(views, points), estimate_poses(views, points, sought=_sought(2))
    assert (plain.viewmats == sought.viewmats).all() and sought.adjusted is None and sought.lenses == ()


def test_each_lens_has_its_own_focal_length():
    """Four photos of one lens, four of a longer one; two more of a third are too few to tell."""
    views, points = _photos(_walk(8, step=(0.15, 0.01, 0.02), turn=(0.01, -0.05, 0)), said=0.9)
    views = [view.through(1.2) if v >= 4 else view for v, view in enumerate(views)]
    found = estimate_poses(views, points, sought=Sought((0,) * 4 + (1,) * 4, (0.35, 0.35)))
    first, second = found.lenses
    assert first and second and abs(first.growth * 0.9 - 1) < 0.02 and abs(second.growth * 1.08 - 1) < 0.02
    few = estimate_poses(views, points, sought=Sought((0,) * 6 + (1,) * 2, (0.0, 0.35)))
    assert few.lenses == (None, None) and (few.growths == 1).all()


def test_photos_that_do_not_tell_the_lens_leave_it():
    views, points = _photos(_walk(4, step=(0, 0, 0.1), turn=(0, 0, 0)), said=0.85)
    found = estimate_poses(views, points, sought=_sought(4))
    assert found.lenses == (None,) and (found.growths == 1).all() and np.isfinite(found.viewmats).all()


def test_a_recorded_lens_is_corrected_little():
    """By three photos that alone would tell it to a few percent."""
    true = _walk(3, step=(0.1, 0.0, 0.02), turn=(0, -0.02, 0))
    views, points = _photos(true, said=0.98, count=80)
    free = estimate_poses(views, points, sought=_sought(3)).growths[0]
    held = estimate_poses(views, points, sought=Sought((0, 0, 0), (0.02,))).growths[0]
    assert abs(np.log(held)) < 0.06 and abs(np.log(held)) <= abs(np.log(free)) + 0.03


def test_other_depth_maps_bring_their_own_unit():
    views, points = _photos(_walk(5))
    found = estimate_poses(views, points)
    larger = [replace(view, depth=(2.0 if v == 0 else 3.0) * view.depth) for v, view in enumerate(views)]
    other: Poses = on_other_maps(found, larger)
    np.testing.assert_allclose(other.viewmats[:, :3, 3], 2 * found.viewmats[:, :3, 3], rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(other.depth_scales[1:] * 3 / 2, found.depth_scales[1:], rtol=1e-6)
    assert found.depth_scales == pytest.approx(1.0, abs=0.05)
    assert len(found.corrections) == 5 and max(abs(c.coefficients[0]) for c in found.corrections) < 0.05


def test_points_that_very_many_photos_saw_are_known_from_some_of_them():
    from langflash_core.cameras import tracks as module

    lengths = (2, BUNDLE.longest, BUNDLE.longest + 1, 100)
    points = np.repeat(np.arange(4), lengths)
    views = np.concatenate([np.arange(length) for length in lengths])
    given = module.Tracks(
        points, views, np.random.default_rng(0).random((len(views), 2)), np.ones(len(views))
    )
    kept = module._spread_observations(given)
    for point, length in enumerate(lengths):
        own = views[(points == point) & kept]
        assert len(own) == min(length, BUNDLE.longest) and own[0] == 0 and own[-1] == length - 1
        assert max(np.diff(own)) - min(np.diff(own)) <= 1
    few = given.subset(points < 2)[0]
    assert module._spread_observations(few).all()
