"""One adjustment over all photos: poses, points and lenses, so that every point is where all photos see it.

Sizes: V views, M observations of P points, G lenses, C unknowns of poses and lenses. A camera sees
pos_c = R pos_w + t, q = pos_c / z, at p = f exp(g) (1 + k |q|^2) q, pixels from the principal point: f is the
focal length that it was said to have, g what it differs by, k by how much it bends straight lines (Brown's
first radial term).

The unit of length, and depth where parallax says nothing, rest on the monocular depth maps.
"""

from dataclasses import dataclass, replace

import cv2
import numpy as np
import scipy.sparse
from jaxtyping import Float, Int

from langflash_core.cameras.tracks import Tracks
from langflash_core.rig.settings import BUNDLE, MATCHING

_POSE = 7  # turn, shift, log scale of the depth map


@dataclass(frozen=True)
class Optics:
    """focals (V,): f, pixels. lenses (V,): which lens each camera has. doubts (G,): standard deviations
    expected of g; 0: the lens stays as it is said to be. bend_doubts (G,): of k; 0, or None: lines are
    straight."""

    focals: Float[np.ndarray, " V"]
    lenses: Int[np.ndarray, " V"]
    doubts: Float[np.ndarray, " G"]
    bend_doubts: Float[np.ndarray, " G"] | None = None

    @property
    def lens_doubts(self) -> Float[np.ndarray, " G"]:
        """Of all g, then of all k, (2 G,)."""
        bends = np.zeros_like(self.doubts) if self.bend_doubts is None else self.bend_doubts
        return np.concatenate((self.doubts, bends))


@dataclass(frozen=True)
class Bundle:
    """viewmats (V, 4, 4); points (P, 3), world. growths (G,): g; errors (G,): its standard errors, from the
    inverse Hessian, scaled by the residuals, 0 of what was not sought; bends, bend_errors (G,): k likewise.
    tracks: observations that agree. depths (M,): of those, z; depth_errors (M,): of its logarithm, by the
    other views and by what is known of where they stand."""

    viewmats: Float[np.ndarray, "V 4 4"]
    points: Float[np.ndarray, "P 3"]
    growths: Float[np.ndarray, " G"]
    errors: Float[np.ndarray, " G"]
    bends: Float[np.ndarray, " G"]
    bend_errors: Float[np.ndarray, " G"]
    tracks: Tracks
    depths: Float[np.ndarray, " M"]
    depth_errors: Float[np.ndarray, " M"]


@dataclass(frozen=True)
class _State:
    viewmats: np.ndarray
    logs: np.ndarray
    points: np.ndarray
    growths: np.ndarray
    bends: np.ndarray

    @property
    def lenses(self) -> np.ndarray:
        """All g, then all k, (2 G,)."""
        return np.concatenate((self.growths, self.bends))


@dataclass(frozen=True)
class _Problem:
    """log_depths (M,): of the maps where the points were seen; shares (M,) weigh them."""

    optics: Optics
    tracks: Tracks
    log_depths: np.ndarray
    shares: np.ndarray

    @staticmethod
    def of(optics: Optics, tracks: Tracks, log_depths: np.ndarray) -> "_Problem":
        counts = np.bincount(tracks.views, minlength=len(optics.focals))
        shares = np.minimum(1.0, BUNDLE.independent / np.maximum(counts, 1))[tracks.views]
        return _Problem(optics, tracks, log_depths, shares)

    @property
    def free_unknowns(self) -> np.ndarray:
        """Which of the C unknowns are: all poses but the first, and the lenses in doubt."""
        poses = np.arange(_POSE * len(self.optics.focals)) >= _POSE
        return np.concatenate((poses, self.optics.lens_doubts > 0))

    @property
    def columns(self) -> np.ndarray:
        """The unknowns of each observation, (M, 9)."""
        growths = _POSE * len(self.optics.focals) + self.optics.lenses[self.tracks.views]
        poses = _POSE * self.tracks.views[:, None] + np.arange(_POSE)
        return np.column_stack((poses, growths, growths + len(self.optics.doubts)))

    def focals(self, state: _State) -> np.ndarray:
        """Of the camera of each observation, in sigmas of the observation."""
        views = self.tracks.views
        return (
            self.optics.focals[views] * np.exp(state.growths[self.optics.lenses[views]]) / self.tracks.sigmas
        )

    def bends(self, state: _State) -> np.ndarray:
        """Of the lens of each observation."""
        return state.bends[self.optics.lenses[self.tracks.views]]


def adjusted_bundle(
    viewmats: Float[np.ndarray, "V 4 4"],
    logs: Float[np.ndarray, " V"],
    growths: Float[np.ndarray, " G"],
    optics: Optics,
    tracks: Tracks,
    log_depths: Float[np.ndarray, " M"],
) -> Bundle:
    """The poses, points and lenses that all observations say; view 0 stays where it is.

    Levenberg-Marquardt with Cauchy weights; points are eliminated (Schur complement), so that a step solves a
    system of 7 V + 2 G numbers. What does not agree is left out once, and the rest adjusted again.

    Args:
        viewmats (V, 4, 4), logs (V,), growths (G,): to start from; logs are of the depth maps' scales.
        log_depths (M,): of each view's depth map, where it saw the point.

    Source: Triggs et al. 2000; twin: scipy.optimize.least_squares in tests/cameras/test_bundle.py.
    """
    problem = _Problem.of(optics, tracks, log_depths)
    state = _State(viewmats, logs, np.zeros((0, 3)), growths, np.zeros_like(growths))
    state = replace(state, points=_first_points(state, problem))
    for left in reversed(range(BUNDLE.rounds)):
        state = _solve(state, problem, BUNDLE.nearly if left else BUNDLE.converged)
        if left:
            state, problem = _without_outliers(state, problem)
    spread, errors, unsure = _errors(state, problem)
    depths, depth_errors = _depths(state, problem)
    depth_errors = np.hypot(depth_errors * spread, unsure)
    found = (state.viewmats, state.points, state.growths, errors[0], state.bends, errors[1])
    return Bundle(*found, problem.tracks, depths, depth_errors)


def _solve(state: _State, problem: _Problem, converged: float) -> _State:
    damping, cost = 1e-3, _cost(state, problem)
    for _ in range(BUNDLE.iterations):
        system, gain = _System.of(state, problem), 0.0
        while gain <= 0 and damping < 1e8:
            trial = _apply_step(state, problem, *_step(problem, system, damping))
            gain = cost - _cost(trial, problem)
            damping = max(damping / 5, 1e-9) if gain > 0 else damping * 8
        if not gain > 0:
            break
        state, cost = trial, cost - gain
        if gain < converged * cost and damping < BUNDLE.damped:
            break
    return state


def _first_points(state: _State, problem: _Problem) -> np.ndarray:
    """Nearest to all rays, and weakly where the depth maps have them, (P, 3)."""
    tracks = problem.tracks
    rotations, shifts = state.viewmats[tracks.views, :3, :3], state.viewmats[tracks.views, :3, 3]
    focals = (problem.focals(state) * tracks.sigmas)[:, None]
    rays = np.column_stack((tracks.pixels / focals, np.ones(len(tracks))))
    depths = np.exp(problem.log_depths + state.logs[tracks.views])
    directions = rays / np.linalg.norm(rays, axis=1, keepdims=True)
    across = (depths * tracks.sigmas / focals[:, 0])[:, None, None] ** -2.0
    along = (depths * 2 * MATCHING.depth_sigma)[:, None, None] ** -2.0
    known = across * (np.eye(3) - directions[:, :, None] * directions[:, None]) + along * np.eye(3)
    precision = rotations.transpose(0, 2, 1) @ known @ rotations
    seen = np.einsum("mji,mj->mi", rotations, rays * depths[:, None] - shifts)
    firsts = _firsts(tracks)
    right = np.add.reduceat(np.einsum("mij,mj->mi", precision, seen), firsts)
    return np.linalg.solve(np.add.reduceat(precision, firsts), right[..., None])[..., 0]


def _firsts(tracks: Tracks) -> np.ndarray:
    """The first observation of each point, (P,)."""
    return np.flatnonzero(np.diff(tracks.points, prepend=-1))


def _rotate_points(state: _State, problem: _Problem) -> np.ndarray:
    """Points turned to the cameras that see them, before the shift, (M, 3)."""
    tracks = problem.tracks
    return np.einsum("mij,mj->mi", state.viewmats[tracks.views, :3, :3], state.points[tracks.points])


def _residuals(state: _State, problem: _Problem) -> np.ndarray:
    """(M, 3) in sigmas: reprojection x, y; log depth against the map."""
    tracks = problem.tracks
    pos = _rotate_points(state, problem) + state.viewmats[tracks.views, :3, 3]
    z = np.maximum(pos[:, 2], 1e-6)
    bent = 1 + problem.bends(state) * (pos[:, :2] ** 2).sum(1) / z**2
    scale = problem.focals(state) / z * bent
    reprojection = scale[:, None] * pos[:, :2] - tracks.pixels / tracks.sigmas[:, None]
    depth = (np.log(z) - problem.log_depths - state.logs[tracks.views]) / MATCHING.depth_sigma
    return np.column_stack((reprojection, depth))


def _weights(residuals: np.ndarray, problem: _Problem) -> np.ndarray:
    """Cauchy's, (M, 3)."""
    seen = 1 / (1 + (residuals[:, :2] ** 2).sum(1) / BUNDLE.cauchy**2)
    return np.column_stack((seen, seen, problem.shares / (1 + (residuals[:, 2] / BUNDLE.cauchy) ** 2)))


def _cost(state: _State, problem: _Problem) -> float:
    """Twice minus the log posterior over c^2, but for a constant."""
    residuals = _residuals(state, problem)
    seen = np.log1p((residuals[:, :2] ** 2).sum(1) / BUNDLE.cauchy**2).sum()
    depth = (problem.shares * np.log1p((residuals[:, 2] / BUNDLE.cauchy) ** 2)).sum()
    doubts = problem.optics.lens_doubts
    known = doubts > 0
    lens = ((state.lenses[known] / doubts[known]) ** 2).sum()
    return float(seen + depth + ((state.logs**2).sum() / MATCHING.scale_sigma**2 + lens) / BUNDLE.cauchy**2)


def _jacobians(state: _State, problem: _Problem) -> tuple[np.ndarray, np.ndarray]:
    """Of `_residuals` to the unknowns of a camera (M, 3, 9) and to the point (M, 3, 3).

    dp / dq = f exp(g) ((1 + k |q|^2) I + 2 k q q^T), and along the ray -q times that.
    """
    tracks, bends, focals = problem.tracks, problem.bends(state), problem.focals(state)
    turned = _rotate_points(state, problem)
    pos = turned + state.viewmats[tracks.views, :3, 3]
    z = np.maximum(pos[:, 2], 1e-6)
    q = pos[:, :2] / z[:, None]
    squares = (q**2).sum(1)
    scale, more = focals / z * (1 + bends * squares), 2 * focals / z * bends
    to_pos = np.zeros((len(z), 3, 3))
    to_pos[:, :2, :2] = more[:, None, None] * q[:, :, None] * q[:, None]
    to_pos[:, 0, 0] += scale
    to_pos[:, 1, 1] += scale
    to_pos[:, :2, 2] = -pos[:, :2] * (scale / z)[:, None] - q * (more * squares)[:, None]
    to_pos[:, 2, 2] = 1 / (z * MATCHING.depth_sigma)
    to_camera = np.zeros((len(z), 3, _POSE + 2))
    to_camera[:, :, :3] = np.cross(turned[:, None], to_pos)
    to_camera[:, :, 3:6] = to_pos
    to_camera[:, 2, 6] = -1 / MATCHING.depth_sigma
    to_camera[:, :2, 7] = pos[:, :2] * scale[:, None]
    to_camera[:, :2, 8] = q * (focals * squares)[:, None]
    return to_camera, to_pos @ state.viewmats[tracks.views, :3, :3]


@dataclass(frozen=True)
class _System:
    """Normal equations of what is sought: of cameras (C', C') and (C',), of points (P, 3, 3) and (3 P,), of
    both (C', 3 P)."""

    hessian: np.ndarray
    gradient: np.ndarray
    own: np.ndarray
    own_gradient: np.ndarray
    cross: scipy.sparse.csr_matrix

    @staticmethod
    def of(state: _State, problem: _Problem) -> "_System":
        residuals = _residuals(state, problem)
        weights = _weights(residuals, problem)[..., None]
        to_camera, to_point = _jacobians(state, problem)
        weighted = (to_camera * weights).transpose(0, 2, 1)  # (M, 9, 3)
        columns, sought = problem.columns, problem.free_unknowns
        count = len(sought)
        places = (columns[:, :, None] * count + columns[:, None]).ravel()
        hessian = np.bincount(places, (weighted @ to_camera).ravel(), count * count).reshape(count, count)
        right = (weighted @ residuals[..., None])[..., 0]
        gradient = np.bincount(columns.ravel(), right.ravel(), count)
        precisions, pulled = _priors(state, problem)
        hessian[np.diag_indices(count)] += precisions
        firsts, own = _firsts(problem.tracks), (to_point * weights).transpose(0, 2, 1)
        rows = np.repeat(columns, 3, 1).ravel()
        others = np.tile(3 * problem.tracks.points[:, None] + np.arange(3), (1, columns.shape[1])).ravel()
        shape = (count, 3 * problem.tracks.num_points)
        cross = scipy.sparse.csr_matrix(((weighted @ to_point).ravel(), (rows, others)), shape)
        return _System(
            hessian[np.ix_(sought, sought)],
            (gradient + pulled)[sought],
            np.add.reduceat(own @ to_point, firsts),
            np.add.reduceat((own @ residuals[..., None])[..., 0], firsts).ravel(),
            cross[sought],
        )


def _priors(state: _State, problem: _Problem) -> tuple[np.ndarray, np.ndarray]:
    """What is expected of scales and lenses: precisions (C,) and their part of the gradient."""
    optics = problem.optics
    poses = np.zeros((len(optics.focals), _POSE))
    poses[:, 6] = 1 / MATCHING.scale_sigma**2
    doubts = optics.lens_doubts
    lens = np.where(doubts > 0, np.maximum(doubts, 1e-9) ** -2.0, 0.0)
    precisions = np.concatenate((poses.ravel(), lens))
    poses[:, 6] *= state.logs
    return precisions, np.concatenate((poses.ravel(), lens * state.lenses))


def _schur_complement(
    system: _System, damping: float
) -> tuple[np.ndarray, np.ndarray, scipy.sparse.csr_matrix]:
    """Hessian (C', C') without the points, inverses (P, 3, 3) of theirs, and cross times those."""
    diagonal = np.einsum("pii->pi", system.own)
    count = len(diagonal)
    own = system.own + np.eye(3) * (damping * diagonal + 1e-12 * (1 + diagonal))[..., None]
    inverses = np.linalg.inv(own)
    blocks = scipy.sparse.bsr_matrix(
        (inverses, np.arange(count), np.arange(count + 1)), shape=(3 * count, 3 * count)
    )
    spread = scipy.sparse.csr_matrix(system.cross @ blocks.tocsr())
    hessian = system.hessian + np.diag(damping * np.diag(system.hessian) + 1e-9)
    return hessian - (spread @ system.cross.T).toarray(), inverses, spread


def _step(problem: _Problem, system: _System, damping: float) -> tuple[np.ndarray, np.ndarray]:
    """Of all C unknowns, 0 where they are not sought, and of the points (P, 3)."""
    reduced, inverses, spread = _schur_complement(system, damping)
    step = -np.linalg.solve(reduced, system.gradient - spread @ system.own_gradient)
    rest = (system.own_gradient + system.cross.T @ step).reshape(-1, 3)
    found = np.zeros(len(problem.free_unknowns))
    found[problem.free_unknowns] = step
    return found, -np.einsum("pij,pj->pi", inverses, rest)


def _apply_step(state: _State, problem: _Problem, step: np.ndarray, shifts: np.ndarray) -> _State:
    num_views = len(state.viewmats)
    poses = step[: _POSE * num_views].reshape(num_views, _POSE)
    growths, bends = step[_POSE * num_views :].reshape(2, -1)
    viewmats = state.viewmats.copy()
    for view, own in zip(viewmats, poses, strict=True):
        view[:3, :3] = cv2.Rodrigues(own[:3])[0] @ view[:3, :3]
        view[:3, 3] += own[3:6]
    return _State(
        viewmats,
        state.logs + poses[:, 6],
        state.points + shifts * _limit_steps(state, problem, shifts)[:, None],
        state.growths + np.clip(growths, -0.2, 0.2),
        state.bends + np.clip(bends, -0.1, 0.1),
    )


def _limit_steps(state: _State, problem: _Problem, shifts: np.ndarray) -> np.ndarray:
    """Share (P,) of each point's step that leaves it before every camera that sees it."""
    tracks = problem.tracks
    backs = state.viewmats[tracks.views, 2]
    depths = np.einsum("mj,mj->m", backs[:, :3], state.points[tracks.points]) + backs[:, 3]
    nearer = -np.einsum("mj,mj->m", backs[:, :3], shifts[tracks.points])
    room = (1 - BUNDLE.nearer) * np.maximum(depths, 0)
    return np.minimum.reduceat(
        np.where(nearer > room, room / np.maximum(nearer, 1e-12), 1.0), _firsts(tracks)
    )


def _without_outliers(state: _State, problem: _Problem) -> tuple[_State, _Problem]:
    residuals = _residuals(state, problem)
    tracks, rows, points = problem.tracks.subset((residuals[:, :2] ** 2).sum(1) < BUNDLE.outlier**2)
    if not len(tracks):
        return state, problem
    return replace(state, points=state.points[points]), _Problem.of(
        problem.optics, tracks, problem.log_depths[rows]
    )


def _errors(state: _State, problem: _Problem) -> tuple[float, np.ndarray, float]:
    """By what the residuals exceed their sigmas; the standard errors (2, G) of g and k, scaled by it; and
    that of where the cameras stand, as a share of how far they stand apart, whatever the unit of length."""
    residuals = _residuals(state, problem)
    weights = _weights(residuals, problem)
    sought, num_views = problem.free_unknowns, len(state.viewmats)
    free = 2 * len(residuals) - int(sought.sum()) - 3 * problem.tracks.num_points
    spread = float(np.sqrt((weights[:, :2] * residuals[:, :2] ** 2).sum() / max(free, 1)))
    reduced, _, _ = _schur_complement(_System.of(state, problem), 0.0)
    larger = np.zeros((num_views, _POSE))  # the direction in which everything grows
    larger[:, 3:6], larger[:, 6] = state.viewmats[:, :3, 3], 1
    larger = np.concatenate((larger.ravel(), np.zeros(len(problem.optics.lens_doubts))))[sought]
    reduced += 1e6 * np.outer(larger, larger)
    variances = np.zeros(len(sought))
    variances[sought] = np.diag(np.linalg.inv(reduced)).clip(0) * spread**2
    moves = variances[: _POSE * num_views].reshape(num_views, _POSE)[:, 3:6].sum(1)
    centres = -np.einsum("vji,vj->vi", state.viewmats[:, :3, :3], state.viewmats[:, :3, 3])
    apart = np.median(np.linalg.norm(centres - centres.mean(0), axis=1))
    unsure = float(np.sqrt(np.median(moves[1:])) / max(apart, 1e-9)) if num_views > 1 else 0.0
    return spread, np.sqrt(variances[_POSE * num_views :]).reshape(2, -1), unsure


def _depths(state: _State, problem: _Problem) -> tuple[np.ndarray, np.ndarray]:
    """z of each observation, and the standard deviation of its logarithm by reprojection alone, (M,) each."""
    tracks = problem.tracks
    backs = state.viewmats[tracks.views, 2]
    depths = np.einsum("mj,mj->m", backs[:, :3], state.points[tracks.points]) + backs[:, 3]
    _, to_point = _jacobians(state, problem)
    weights = _weights(_residuals(state, problem), problem)
    seen = to_point[:, :2]
    own = np.add.reduceat((seen * weights[:, :2, None]).transpose(0, 2, 1) @ seen, _firsts(tracks))
    own += np.eye(3) * (1e-9 * np.einsum("pii->p", own) + 1e-12)[:, None, None]
    inverses = np.linalg.inv(own)[tracks.points]
    variances = np.einsum("mi,mij,mj->m", backs[:, :3], inverses, backs[:, :3]).clip(0)
    return depths, np.sqrt(variances) / np.maximum(depths, 1e-6)
