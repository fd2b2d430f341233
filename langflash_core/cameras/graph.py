"""One adjustment over all poses: the relative poses of many pairs brought together.

Photos are nodes, pairs that match are edges. A tree of the edges that others confirm gives every photo
a place; Gauss-Newton steps on all edges at once, weighted by what each pair knows and robustly, spread
what is left of the errors, so that they do not grow along the tree.

Sizes: V views, E edges.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float

from langflash_core.cameras.matching import RelativePose
from langflash_core.rig.settings import GRAPH, Graph

Pairs = Mapping[tuple[int, int], RelativePose]
"""Relative poses by views i < j."""


@dataclass(frozen=True)
class Placed:
    """viewmats (V, 4, 4), world = view 0; scales (V,) of the views' own units; missing: views that no
    edge reaches, which stand where view 0 does. kept: edges that agree with them."""

    viewmats: Float[np.ndarray, "V 4 4"]
    scales: Float[np.ndarray, " V"]
    missing: tuple[int, ...]
    kept: tuple[tuple[int, int], ...]


def place_views(num_views: int, pairs: Pairs, settings: Graph = GRAPH) -> Placed:
    """Places of all views: along the best-confirmed tree, then adjusted by all edges."""
    return adjust_poses(
        chain_poses(num_views, pairs, count_confirmations(pairs, settings=settings)), pairs, settings=settings
    )


def count_confirmations(pairs: Pairs, settings: Graph = GRAPH) -> dict[tuple[int, int], int]:
    """How many matches speak for each edge: its own, and in every triangle whose turns close, the fewest
    of the three."""
    counts = {edge: pose.num_inliers for edge, pose in pairs.items()}
    later: dict[int, set[int]] = {}
    for i, j in pairs:
        later.setdefault(i, set()).add(j)
    loops = [(i, j, third) for i, j in pairs for third in later[i] & later.get(j, set())]
    for i, j, k in sorted(loops):
        loop = ((i, j), (j, k), (i, k))
        first, second, direct = (pairs[edge].rotation for edge in loop)
        if _degrees(second @ first @ direct.T) < settings.loop:
            least = min(pairs[edge].num_inliers for edge in loop)
            for edge in loop:
                counts[edge] += least
    return counts


def chain_poses(num_views: int, pairs: Pairs, strengths: Mapping[tuple[int, int], int]) -> Placed:
    """Prim's maximum spanning tree; scales and poses multiply along it."""
    viewmats = np.repeat(np.eye(4)[None], num_views, 0)
    scales = np.ones(num_views)
    reached = {0}
    while True:
        reachable = [(strengths[i, j], -i, -j) for i, j in pairs if (i in reached) != (j in reached)]
        if not reachable:
            break
        _, i, j = max(reachable)
        i, j = -i, -j
        relative = pairs[i, j].matrix()
        growth = np.exp(pairs[i, j].log_scale)  # view j's depths times this are in view i's unit
        if i in reached:
            relative[:3, 3] *= scales[i]
            viewmats[j], scales[j] = relative @ viewmats[i], scales[i] * growth
            reached.add(j)
        else:
            scales[i] = scales[j] / growth
            relative[:3, 3] *= scales[i]
            viewmats[i] = np.linalg.inv(relative) @ viewmats[j]
            reached.add(i)
    missing = tuple(v for v in range(num_views) if v not in reached)
    return Placed(viewmats, scales, missing, tuple(edge for edge in pairs if edge[0] in reached))


def adjust_poses(start: Placed, pairs: Pairs, settings: Graph = GRAPH) -> Placed:
    """The poses and scales under which the edges differ least from what their pairs say.

    Unknown per view but the first: a turn and a shift before its pose, and its log scale. An edge's
    residual is (turn, shift in view i's unit, log scale), its weight `_precision`, robust by Geman and
    McClure; a step is taken only if it lowers the cost.

    Source: pose-graph optimisation (Grisetti et al. 2010), scale as in Strasdat et al. 2010; twin:
    scipy.optimize in tests/cameras/test_graph.py.
    """
    if len(start.kept) < 2:
        return start
    precisions = {edge: _precision(pairs[edge]) for edge in start.kept}
    viewmats, logs = start.viewmats.copy(), np.log(start.scales)
    cost = _cost(viewmats, logs, pairs, precisions, settings=settings)
    for _ in range(settings.steps):
        step = _step(viewmats, logs, pairs, precisions, settings=settings)
        trial, trial_logs = _apply_step(viewmats, logs, step)
        lower = _cost(trial, trial_logs, pairs, precisions, settings=settings)
        if not lower < cost:
            break
        done = cost - lower < 1e-6 * cost
        viewmats, logs, cost = trial, trial_logs, lower
        if done:
            break
    kept = tuple(
        e for e in precisions if _distance(viewmats, logs, pairs[e], e, precisions[e]) < settings.agrees
    )
    return Placed(viewmats, np.exp(logs), start.missing, kept)


def gap(
    viewmats: Float[np.ndarray, "V 4 4"],
    logs: Float[np.ndarray, " V"],
    edge: tuple[int, int],
    pose: RelativePose,
) -> Float[np.ndarray, "7"]:
    """What the poses say of an edge less what its pair says: turn (radians), shift, log scale: (7,)."""
    i, j = edge
    relative = viewmats[j] @ np.linalg.inv(viewmats[i])
    turn = cv2.Rodrigues(relative[:3, :3] @ pose.rotation.T)[0][:, 0]
    shift = relative[:3, 3] * np.exp(-logs[i]) - pose.translation
    return np.concatenate((turn, shift, [logs[j] - logs[i] - pose.log_scale]))


def _precision(pose: RelativePose) -> np.ndarray:
    """Inverse covariance (7, 7) of an edge: (L^-1 + S)^-1 with L the information of its matches and S what
    they share. In units of S it is L (L + 1)^-1, also where the matches say nothing of a direction."""
    shift = GRAPH.shift_sigma * (0.1 + np.linalg.norm(pose.translation))
    sigmas = np.array([np.radians(GRAPH.turn_sigma)] * 3 + [shift] * 3 + [GRAPH.scale_sigma])
    units = np.outer(sigmas, sigmas)
    values, axes = np.linalg.eigh(pose.information * units)
    values = values.clip(0)  # rounding
    return (axes * (values / (1 + values))) @ axes.T / units


def _step(viewmats, logs, pairs: Pairs, precisions, settings: Graph = GRAPH) -> np.ndarray:
    """One Gauss-Newton step (V, 7); the first view stays."""
    num_views = len(viewmats)
    normal = np.zeros((num_views, 7, num_views, 7))
    right = np.zeros((num_views, 7))
    for (i, j), precision in precisions.items():
        residual = gap(viewmats, logs, (i, j), pairs[i, j])
        weighted = precision / (1 + residual @ precision @ residual / settings.robust**2) ** 2
        of_i, of_j = _jacobians(viewmats[j] @ np.linalg.inv(viewmats[i]), logs[i])
        for a, left in ((i, of_i), (j, of_j)):
            right[a] -= left.T @ weighted @ residual
            for b, other in ((i, of_i), (j, of_j)):
                normal[a, :, b] += left.T @ weighted @ other
    free = (num_views - 1) * 7
    matrix = normal[1:, :, 1:].reshape(free, free)
    matrix[np.diag_indices(free)] += settings.damping * (1 + np.diag(matrix))
    return np.vstack((np.zeros(7), np.linalg.solve(matrix, right[1:].ravel()).reshape(-1, 7)))


def _jacobians(relative: np.ndarray, log_i: float) -> tuple[np.ndarray, np.ndarray]:
    """Of `gap` to the steps of view i and of view j, (7, 7) each, where the gap is small."""
    turn, shift, unit = relative[:3, :3], relative[:3, 3], np.exp(-log_i)
    of_i, of_j = np.zeros((7, 7)), np.eye(7)
    of_j[3:6, :3], of_j[3:6, 3:6] = -unit * _cross(shift), unit * np.eye(3)
    of_i[:3, :3], of_i[3:6, 3:6] = -turn, -unit * turn
    of_i[3:6, 6], of_i[6, 6] = -unit * shift, -1
    return of_i, of_j


def _apply_step(viewmats: np.ndarray, logs: np.ndarray, step: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    moves = np.repeat(np.eye(4)[None], len(viewmats), 0)
    for move, own in zip(moves, step, strict=True):
        move[:3, :3], move[:3, 3] = cv2.Rodrigues(own[:3])[0], own[3:6]
    return moves @ viewmats, logs + step[:, 6]


def _cost(viewmats, logs, pairs: Pairs, precisions, settings: Graph = GRAPH) -> float:
    total = 0.0
    for edge, precision in precisions.items():
        distance = _distance(viewmats, logs, pairs[edge], edge, precision) / settings.robust**2
        total += distance / (1 + distance)
    return total


def _distance(viewmats, logs, pose: RelativePose, edge: tuple[int, int], precision: np.ndarray) -> float:
    """Square of an edge's gap, in sigmas."""
    residual = gap(viewmats, logs, edge, pose)
    return float(residual @ precision @ residual)


def _cross(v: np.ndarray) -> np.ndarray:
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def _degrees(rotation: np.ndarray) -> float:
    return float(np.degrees(np.linalg.norm(cv2.Rodrigues(rotation)[0])))
