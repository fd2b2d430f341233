"""Relative poses on synthetic rooms whose truth is known; no turn, no overlap, noise."""

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from langflash_core.cameras import matching, poses
from langflash_core.cameras.keypoints import KeyPoints
from langflash_core.cameras.matching import (
    Matches,
    RelativePose,
    match_descriptors,
    mutual,
    refine_pose,
    relative_pose,
)
from langflash_core.cameras.poses import PoseInput, estimate_poses
from langflash_core.rig.settings import Pairing

SIGMA = 1 / 600  # one pixel at a focal length of 600


def _pair(
    seed, *, turn=(0.1, -0.2, 0.05), move=(0.4, -0.05, 0.1), n=200, noise=0.5, outliers=0.0, depth_noise=0.1
):
    """Matches of random points, true pose, and noisy monocular depths (view j's 20 % too small)."""
    rng = np.random.default_rng(seed)
    x_i = rng.uniform(-0.5, 0.5, (n, 2))
    depth_i = rng.uniform(1.5, 5, n)
    rotation, translation = Rotation.from_rotvec(turn).as_matrix(), np.array(move)
    pos_j = np.column_stack((x_i, np.ones(n))) * depth_i[:, None] @ rotation.T + translation
    x_j = pos_j[:, :2] / pos_j[:, 2:] + rng.normal(0, noise * SIGMA, (n, 2))
    wrong = rng.random(n) < outliers
    x_j[wrong] = rng.uniform(-0.5, 0.5, (wrong.sum(), 2))
    mono_i = depth_i * np.exp(rng.normal(0, depth_noise, n))
    mono_j = 0.8 * pos_j[:, 2] * np.exp(rng.normal(0, depth_noise, n))
    return Matches(x_i, x_j, SIGMA), mono_i, mono_j, rotation, translation


def _pose(matches, depth_i, depth_j) -> RelativePose:
    pose = relative_pose(matches, depth_i, depth_j)
    assert pose is not None
    return pose


def _degrees(rotation, truth):
    return np.degrees(np.linalg.norm(Rotation.from_matrix(rotation.T @ truth).as_rotvec()))


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("outliers", [0.0, 0.3])
def test_pose_and_scale_are_found(seed, outliers):
    matches, depth_i, depth_j, rotation, translation = _pair(seed, outliers=outliers)
    pose = _pose(matches, depth_i, depth_j)
    # Half a pixel of noise over 140 matches or more: well under a tenth of a degree.
    assert _degrees(pose.rotation, rotation) < 0.15
    # The length rests on 10 % depth noise averaged over the matches: 1 %, times 3 sigma.
    assert np.linalg.norm(pose.translation - translation) < 0.03 * np.linalg.norm(translation) + 0.005
    assert pose.log_scale == pytest.approx(np.log(1 / 0.8), abs=0.05)
    assert pose.num_inliers > (1 - outliers) * 0.9 * 200


def test_pure_rotation_gives_no_translation():
    matches, depth_i, depth_j, rotation, _ = _pair(1, turn=(0, 0.3, 0), move=(0, 0, 0))
    pose = _pose(matches, depth_i, depth_j)
    assert _degrees(pose.rotation, rotation) < 0.15
    assert np.linalg.norm(pose.translation) < 0.02  # a pixel of noise at 3 m is 0.005


def test_the_same_photo_twice_is_the_identity():
    matches, depth_i, _, _, _ = _pair(2, turn=(0, 0, 0), move=(0, 0, 0), noise=0)
    pose = _pose(matches, depth_i, depth_i)
    assert _degrees(pose.rotation, np.eye(3)) < 1e-3
    assert np.linalg.norm(pose.translation) < 1e-4
    assert abs(pose.log_scale) < 1e-4


def test_a_single_plane_is_not_misread():
    """Points of one wall leave two homography solutions; the depth prior picks the right one."""
    rng = np.random.default_rng(0)
    matches, _, _, rotation, translation = _pair(0)
    depth = 3 / (1 - 0.3 * matches.x_i[:, 0])
    pos_j = np.column_stack((matches.x_i, np.ones(200))) * depth[:, None] @ rotation.T + translation
    flat = Matches(matches.x_i, pos_j[:, :2] / pos_j[:, 2:] + rng.normal(0, 0.3 * SIGMA, (200, 2)), SIGMA)
    pose = _pose(flat, depth, pos_j[:, 2])
    assert _degrees(pose.rotation, rotation) < 0.5
    assert np.linalg.norm(pose.translation - translation) < 0.05 * np.linalg.norm(translation)


def test_noise_and_too_few_matches_give_none():
    rng = np.random.default_rng(0)
    random = Matches(rng.uniform(-0.5, 0.5, (80, 2)), rng.uniform(-0.5, 0.5, (80, 2)), SIGMA)
    pose = relative_pose(random, np.full(80, 2.0), np.full(80, 2.0))
    assert pose is None or pose.num_inliers < 0.25 * 80  # below the share that a pair must reach
    matches, depth_i, depth_j, _, _ = _pair(0, n=10)
    assert relative_pose(matches, depth_i, depth_j) is None


def test_a_tilted_map_does_not_turn_the_camera():
    """A narrow baseline, and a map whose error grows from left to right."""
    matches, depth_i, depth_j, rotation, _ = _pair(5, turn=(0, 0, 0), move=(-0.08, 0, 0), n=600)
    pose = _pose(matches, depth_i * np.exp(0.4 * matches.x_i[:, 0] ** 2), depth_j)
    assert _degrees(pose.rotation, rotation) < 0.25  # the parallax itself is 2 degrees


def test_jacobians_equal_finite_differences():
    matches, depth_i, depth_j, rotation, translation = _pair(3, n=6)
    priors = matching.DepthPriors.of(depth_i, depth_j)
    state = matching._State(rotation, translation, 0.1, np.log(depth_i))
    _, jac_pose, jac_depth = matching._linearise(state, matches, priors)
    for column in range(7):
        step = np.zeros(7)
        step[column] = 1e-6
        ahead = matching._residuals(state.moved(step, np.zeros(6)), matches, priors)
        back = matching._residuals(state.moved(-step, np.zeros(6)), matches, priors)
        assert (ahead - back) / 2e-6 == pytest.approx(jac_pose[..., column], rel=1e-4, abs=1e-4)
    ahead = matching._residuals(state.moved(np.zeros(7), np.full(6, 1e-6)), matches, priors)
    back = matching._residuals(state.moved(np.zeros(7), np.full(6, -1e-6)), matches, priors)
    assert (ahead - back) / 2e-6 == pytest.approx(jac_depth, rel=1e-4, abs=1e-4)


def test_refinement_reaches_the_optimum_of_scipy():
    matches, depth_i, depth_j, rotation, translation = _pair(4, n=40)
    priors = matching.DepthPriors.of(depth_i, depth_j)
    own = refine_pose(matches, depth_i, depth_j, rotation, translation * 1.2)

    def residuals(x):
        state = matching._State(Rotation.from_rotvec(x[:3]).as_matrix(), x[3:6], x[6], x[7:])
        # Cauchy through scipy's soft residuals: sqrt(log(1 + (r / c)^2)).
        soft = np.sqrt(priors.weigh(np.log1p((matching._residuals(state, matches, priors) / 2) ** 2))).ravel()
        return np.append(soft, x[6] / 0.3 / 2)

    start = np.concatenate((Rotation.from_matrix(rotation).as_rotvec(), translation, [0.2], priors.log_i))
    twin = least_squares(residuals, start, xtol=1e-12, ftol=1e-12)
    assert _degrees(own.rotation, Rotation.from_rotvec(twin.x[:3]).as_matrix()) < 0.02
    assert own.translation == pytest.approx(twin.x[3:6], abs=2e-3)


def test_descriptors_match_mutually_and_uniquely():
    rng = np.random.default_rng(0)
    left = np.abs(rng.normal(size=(30, 128)))
    left /= np.linalg.norm(left, axis=1, keepdims=True)
    order = rng.permutation(30)
    pairs = match_descriptors(left, left[order])
    assert sorted(pairs[:, 0]) == list(range(30)) and (order[pairs[:, 1]] == pairs[:, 0]).all()
    assert len(match_descriptors(left[:1], left)) == 0
    twice = np.repeat(left, 2, 0)
    assert len(match_descriptors(left, twice)) == 0  # repeated texture is ambiguous
    rounded = twice * (
        1 + 1e-7 * rng.choice((-1, 1), (60, 1))
    )  # as another processor would have its products
    assert len(match_descriptors(left, rounded)) == 0


def test_mutual_pairs_are_first_in_their_row_and_in_their_column():
    rng = np.random.default_rng(0)
    similarity = rng.normal(size=(60, 80)).round(1)  # many ties
    rows, columns = mutual(similarity)
    best, first = similarity.argmax(1), similarity.max(0)
    expected: dict[int, int] = {}
    for row in range(60):
        if similarity[row, best[row]] == first[best[row]]:
            expected.setdefault(int(best[row]), row)
    assert dict(zip(columns.tolist(), rows.tolist(), strict=True)) == expected
    assert len(rows) > 10 and np.all(np.diff(rows) > 0)


@pytest.mark.parametrize(("seen", "guessed"), [(15, ()), (14, (1,))])
def test_a_photo_with_nothing_to_tell_places_by_is_not_placed(seen, guessed):
    """Borders of a blank photo agree with those of any other; here even all its cells do."""
    local = np.random.default_rng(0).normal(size=(64, 20, 30)).astype(np.float32)
    local /= np.linalg.norm(local, axis=0)
    K = np.array([[270.0, 0, 150], [0, 270, 100], [0, 0, 1]])
    view = PoseInput(K, (300, 200), np.full((200, 300), 2.0), local)
    positions = np.full((100, 2), 50.0), np.full((seen, 2), 50.0)
    found = estimate_poses([view, view], KeyPoints(positions, {(0, 1): np.zeros((0, 2), int)}))
    assert found.guessed == guessed


@pytest.mark.parametrize("tried", [1, 2, 4])
def test_where_the_best_pair_does_not_connect_photos_the_next_best_is_asked(tried, monkeypatch):
    """0-1 and 2-3 belong together; between them 1-2 match best and have no pose, then 0-2, which have one."""
    counts = {(0, 1): 90, (2, 3): 80, (1, 2): 30, (0, 2): 20, (0, 3): 10}
    edges = {
        edge: Matches(np.zeros((count, 2)), np.zeros((count, 2)), 0.01) for edge, count in counts.items()
    }
    flat = np.ones((4, 6), np.float32)
    views = [PoseInput(np.eye(3), (6, 4), flat, flat[None]) for _ in range(4)]
    asked = []

    def posed(view_i, view_j, matches, settings):
        edge = (
            next(i for i in range(4) if views[i] is view_i),
            next(j for j in range(4) if views[j] is view_j),
        )
        asked.append(edge)
        dense = asked.count(edge) == 2
        if edge not in ((0, 1), (2, 3)) and (not dense or edge == (1, 2)):
            return None
        return RelativePose(np.eye(3), np.zeros(3), 0.0, np.ones(len(matches), bool), 1.0, np.eye(7))

    monkeypatch.setattr(poses, "_pair_pose", posed)
    monkeypatch.setattr(poses, "dense_matches", lambda *of: Matches(np.zeros((0, 2)), np.zeros((0, 2)), 0.01))
    found, agreed = poses._pair_poses(views, edges, lambda: None, Pairing(bridges=tried))
    assert asked[5:] == [(1, 2), (0, 2)][:tried] and set(agreed) == set(found)
    assert set(found) == {(0, 1), (2, 3), *([(0, 2)] if tried > 1 else [])}
