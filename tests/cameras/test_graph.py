"""Relative poses of many pairs brought together: against scipy, against wrong edges, against drift."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from langflash_core.cameras import graph
from langflash_core.cameras.graph import (
    Placed,
    adjust_poses,
    chain_poses,
    count_confirmations,
    gap,
    place_views,
)
from langflash_core.cameras.matching import RelativePose
from langflash_core.rig.settings import GRAPH

INFORMATION = np.diag([4e6] * 3 + [4e4] * 3 + [400.0])


def _edge(relative: np.ndarray, log_scale: float = 0.0, count: int = 100) -> RelativePose:
    agree = np.ones(count, bool)
    return RelativePose(relative[:3, :3], relative[:3, 3], log_scale, agree, 0.0, INFORMATION)


def _matrix(turn, shift) -> np.ndarray:
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = Rotation.from_rotvec(turn).as_matrix(), shift
    return pose


def _walk(seed: int, num_views: int = 6, noise: float = 0.01, reach: int = 2):
    """True poses and log scales of a walk, and noisy edges between views up to `reach` apart."""
    rng = np.random.default_rng(seed)
    viewmats, logs = [np.eye(4)], [0.0]
    for _ in range(num_views - 1):
        viewmats.append(_matrix(rng.normal(0, 0.15, 3), rng.normal(0, 0.3, 3)) @ viewmats[-1])
        logs.append(logs[-1] + rng.normal(0, 0.1))
    pairs = {}
    for i in range(num_views):
        for j in range(i + 1, min(i + reach + 1, num_views)):
            relative = viewmats[j] @ np.linalg.inv(viewmats[i])
            relative[:3, 3] *= np.exp(-logs[i])
            relative = _matrix(rng.normal(0, noise, 3), rng.normal(0, noise, 3)) @ relative
            pairs[i, j] = _edge(relative, logs[j] - logs[i] + rng.normal(0, noise))
    return np.array(viewmats), np.array(logs), pairs


def _turned(found: np.ndarray, true: np.ndarray) -> np.ndarray:
    """Degrees by which poses differ, (V,)."""
    relative = found[:, :3, :3] @ true[:, :3, :3].transpose(0, 2, 1)
    return np.degrees(Rotation.from_matrix(relative).magnitude())


def test_exact_edges_give_the_exact_places():
    viewmats, logs, pairs = _walk(0, noise=0.0)
    found = place_views(6, pairs)
    np.testing.assert_allclose(found.viewmats, viewmats, atol=1e-9)
    np.testing.assert_allclose(np.log(found.scales), logs, atol=1e-9)
    assert found.kept == tuple(pairs) and found.missing == ()


def test_an_edge_knows_what_its_matches_know_and_never_more_than_they_share():
    rng = np.random.default_rng(3)
    pose = _edge(_matrix([0.1, 0.2, 0.3], [0.4, 0.0, 0.1]))
    shift = GRAPH.shift_sigma * (0.1 + np.linalg.norm(pose.translation))
    shared = np.diag(np.array([np.radians(GRAPH.turn_sigma)] * 3 + [shift] * 3 + [GRAPH.scale_sigma]) ** 2)
    root = rng.normal(size=(7, 7)) * [1e3, 1e3, 1e3, 1e2, 1e2, 1e2, 10]
    known = replace(pose, information=root.T @ root + np.eye(7))
    twin = np.linalg.inv(np.linalg.inv(known.information) + shared)
    # Two inversions of matrices of condition 1e6.
    np.testing.assert_allclose(graph._precision(known), twin, rtol=1e-6, atol=1e-6 * np.abs(twin).max())
    blind = replace(pose, information=np.diag([0.0, 1e6, 1e6, 1e4, 1e4, 1e4, 100.0]))
    precision = graph._precision(blind)
    assert np.isfinite(precision).all() and precision[0, 0] == 0
    assert (np.linalg.eigvalsh(precision) >= 0).all()


def test_errors_do_not_grow_along_the_tree_as_they_did():
    """Eight walks of eight: the last view's turn and place, after the tree and after the adjustment."""
    errors = []
    for seed in range(8):
        viewmats, _, pairs = _walk(seed, num_views=8, reach=4)
        tree = chain_poses(8, pairs, count_confirmations(pairs))
        errors.append([_turned(p.viewmats, viewmats)[-1] for p in (tree, adjust_poses(tree, pairs))])
    before, after = np.mean(errors, 0)
    assert after < 0.8 * before  # some 22 edges instead of 7 know of 7 places: sqrt(7 / 22) is .56


def test_a_wrong_edge_is_outvoted_and_not_kept():
    viewmats, _, pairs = _walk(1, reach=3, noise=0.002)
    pairs[0, 2] = _edge(_matrix([0.6, -0.4, 0.2], [1.0, -1.0, 0.3]), 0.5, count=150)  # the strongest of all
    found = place_views(6, pairs)
    assert _turned(found.viewmats, viewmats).max() < 0.5  # noise of .1 degree an edge
    assert (0, 2) not in found.kept and len(found.kept) == len(pairs) - 1


def test_triangles_that_close_confirm_their_edges():
    step = _matrix([0, 0.2, 0], [0.1, 0, 0])
    pairs = {
        (0, 1): _edge(step, count=40),
        (1, 2): _edge(step, count=30),
        (0, 2): _edge(step @ step, count=20),
    }
    assert count_confirmations(pairs) == {(0, 1): 60, (1, 2): 50, (0, 2): 40}
    pairs[0, 2] = _edge(step, count=20)  # turns by 11 degrees too little
    assert count_confirmations(pairs) == {(0, 1): 40, (1, 2): 30, (0, 2): 20}


def test_jacobians_equal_finite_differences():
    viewmats, logs, pairs = _walk(2, noise=0.0)
    edge = (2, 4)
    relative = viewmats[4] @ np.linalg.inv(viewmats[2])
    for view, jacobian in zip(edge, graph._jacobians(relative, logs[2]), strict=True):
        for column in range(7):
            step = np.zeros((6, 7))
            step[view, column] = 1e-3  # OpenCV takes turns below 1e-5 for none
            ahead = gap(*graph._apply_step(viewmats, logs, step), edge, pairs[edge])
            back = gap(*graph._apply_step(viewmats, logs, -step), edge, pairs[edge])
            assert (ahead - back) / 2e-3 == pytest.approx(jacobian[:, column], abs=1e-5)  # third order: 1e-6


def test_the_adjustment_reaches_the_optimum_of_scipy():
    _, _, pairs = _walk(3, num_views=4, noise=0.005, reach=3)
    start = chain_poses(4, pairs, count_confirmations(pairs))
    precisions = {edge: graph._precision(pose) for edge, pose in pairs.items()}
    logs = np.log(start.scales)

    def cost(x: np.ndarray) -> float:
        step = np.vstack((np.zeros(7), x.reshape(3, 7)))
        return graph._cost(*graph._apply_step(start.viewmats, logs, step), pairs, precisions)

    own = adjust_poses(start, pairs)
    twin = minimize(cost, np.zeros(21), method="BFGS", options={"gtol": 1e-6})
    reached = graph._cost(own.viewmats, np.log(own.scales), pairs, precisions)
    # The last step was worth less than a millionth, and a step more a share of that.
    assert reached == pytest.approx(twin.fun, rel=1e-4)
    best, _ = graph._apply_step(start.viewmats, logs, np.vstack((np.zeros(7), twin.x.reshape(3, 7))))
    assert _turned(own.viewmats, best).max() < 0.01


def test_views_chain_through_the_best_connected_tree():
    """Poses 0-2 and 1-2 exist, 0-1 is weak and wrong: the tree goes round it; scales multiply."""
    step = _edge(_matrix([0, 0, 0], [0.0, 0, 1]), np.log(2.0), 100)
    back = _edge(_matrix([0, 0, 0], [1.0, 0, 0]), np.log(0.5), 80)
    wrong = _edge(_matrix([0, 0, 0], [9.0, 9, 9]), 0.0, 20)
    pairs = {(0, 2): step, (1, 2): back, (0, 1): wrong}
    found = chain_poses(4, pairs, {edge: pose.num_inliers for edge, pose in pairs.items()})
    assert found.scales == pytest.approx([1, 4, 2, 1])
    assert found.viewmats[2, :3, 3] == pytest.approx([0, 0, 1])
    assert found.viewmats[1, :3, 3] == pytest.approx([-4, 0, 1])  # -1 in view 1's unit, which is 4
    assert found.missing == (3,)


def test_nothing_and_one_edge_come_back_as_they_are():
    alone = place_views(3, {})
    assert alone.missing == (1, 2) and alone.kept == ()
    assert np.array_equal(alone.viewmats, np.repeat(np.eye(4)[None], 3, 0))
    step = _matrix([0.1, 0, 0], [0.2, 0, 0])
    two = place_views(2, {(0, 1): _edge(step)})
    assert two.kept == ((0, 1),)
    np.testing.assert_allclose(
        two.viewmats[1], step, rtol=0, atol=1e-15
    )  # float64 products with the identity
    same = place_views(3, {(0, 1): _edge(np.eye(4)), (1, 2): _edge(np.eye(4)), (0, 2): _edge(np.eye(4))})
    assert isinstance(same, Placed) and np.isfinite(same.viewmats).all()  # one photo three times
