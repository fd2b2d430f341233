"""Matches between photos and the relative pose they imply. n matches; x_i, x_j are image
coordinates with the camera removed (K^-1 applied), so a ray is (x, y, 1).

A relative pose minimises reprojection error and, at once, disagreement with the monocular depth
maps, which fix the scale and decide where parallax alone cannot (pure rotation, one plane,
identical photos).
"""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from jaxtyping import Bool, Float, Int, Shaped, UInt8

from langflash_core.rig.settings import MATCHING


@dataclass(frozen=True)
class Matches:
    """x_i, x_j (n, 2) normalised coordinates; sigma: their standard deviation, same unit. rows (n, 2): which
    key points of both views they are, -1 of what is none; None: nobody asks."""

    x_i: Float[np.ndarray, "n 2"]
    x_j: Float[np.ndarray, "n 2"]
    sigma: float
    rows: Int[np.ndarray, "n 2"] | None = None

    @property
    def key_points(self) -> Int[np.ndarray, "n 2"]:
        """`rows`, -1 where nobody asked."""
        return np.full((len(self), 2), -1) if self.rows is None else self.rows

    def __len__(self) -> int:
        return len(self.x_i)

    def subset(self, keep: Shaped[np.ndarray, " n"]) -> "Matches":
        rows = None if self.rows is None else self.rows[keep]
        return Matches(self.x_i[keep], self.x_j[keep], self.sigma, rows)


@dataclass(frozen=True)
class RelativePose:
    """pos_j = R pos_i + t in the length unit of view i's depth map.

    log_scale: view j's depths must be multiplied by exp(log_scale) to be in that unit.
    inliers: (n,) bool, matches that agree to 3 sigma. cost: mean robust cost, for choosing.
    information: (7, 7) inverse covariance of a turn before R (radians), of t and of log_scale.
    """

    rotation: Float[np.ndarray, "3 3"]
    translation: Float[np.ndarray, "3"]
    log_scale: float
    inliers: Bool[np.ndarray, " n"]
    cost: float
    information: Float[np.ndarray, "7 7"]

    @property
    def num_inliers(self) -> int:
        """How many matches agree."""
        return int(self.inliers.sum())

    def matrix(self) -> Float[np.ndarray, "4 4"]:
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = self.rotation, self.translation
        return pose


def at_side(grey: UInt8[np.ndarray, "H W"], side: int) -> UInt8[np.ndarray, "h w"]:
    """A picture whose longer side is `side`. Small ones are enlarged: SIFT needs pixels to find more than a
    handful of points."""
    ratio = side / max(grey.shape)
    method = cv2.INTER_AREA if ratio < 1 else cv2.INTER_CUBIC
    return cv2.resize(grey, None, fx=ratio, fy=ratio, interpolation=method)


def detect(
    grey: UInt8[np.ndarray, "H W"], num_features: int = MATCHING.features
) -> tuple[Float[np.ndarray, "n 2"], Float[np.ndarray, "n 128"]]:
    """RootSIFT: pixel positions (n, 2) with centres at +0.5, and descriptors (n, 128).

    Args:
        grey: (H, W) uint8.

    Source: Lowe 2004; square-root normalisation of Arandjelovic and Zisserman 2012.
    """
    sift = cv2.SIFT.create(nfeatures=num_features, contrastThreshold=MATCHING.contrast)
    keypoints, descriptors = sift.detectAndCompute(grey, None)
    if descriptors is None or len(keypoints) < 2:
        return np.zeros((0, 2)), np.zeros((0, 128), np.float32)
    positions = np.array([k.pt for k in keypoints]) + 0.5
    return positions, np.sqrt(descriptors / np.maximum(descriptors.sum(1, keepdims=True), 1e-7))


def mutual(similarity: Float[np.ndarray, "n m"]) -> tuple[Int[np.ndarray, " k"], Int[np.ndarray, " k"]]:
    """Rows (n,) and columns (n,) of (A, B) that choose each other; of several equal ones the first."""
    best = similarity.argmax(1)
    rows = np.flatnonzero(similarity[np.arange(len(best)), best] >= similarity.max(0)[best])
    firsts = np.sort(np.unique(best[rows], return_index=True)[1])
    return rows[firsts], best[rows[firsts]]


def match_descriptors(
    left: Float[np.ndarray, "n C"], right: Float[np.ndarray, "m C"]
) -> Int[np.ndarray, "k 2"]:
    """Index pairs (n, 2) that pass the ratio test and choose each other."""
    if len(left) < 2 or len(right) < 2:
        return np.zeros((0, 2), int)
    similarity = left @ right.T  # both rows have unit norm
    rows, best = mutual(similarity)
    first = similarity[rows, best]
    similarity[rows, best] = -1
    second = similarity[rows].max(1)
    # Twins in one photo are as near as each other: rounding, 1e-7 of a product, must not choose between them.
    distances = np.sqrt(np.maximum(2 - 2 * np.stack((first, second)), 1e-6))
    keep = distances[0] < MATCHING.ratio * distances[1]
    return np.stack((rows[keep], best[keep]), 1)


def relative_pose(
    matches: Matches, depth_i: Float[np.ndarray, " n"], depth_j: Float[np.ndarray, " n"]
) -> RelativePose | None:
    """The relative pose that the matches support best, or None where too few agree.

    Candidates from the five-point method (good with parallax), from PnP on the depth map (good
    without) and the identity (the same photo twice) are refined alike; the cheapest wins.

    Args:
        depth_i, depth_j: (n,) z of the monocular maps at the matches, > 0.
    """
    if len(matches) < MATCHING.fewest:
        return None
    candidates = [(np.eye(3), np.zeros(3), np.ones(len(matches), bool))]
    candidates += _five_point(matches, depth_i) + _pnp(matches, depth_i)
    best = None
    for rotation, translation, keep in candidates:
        if keep.sum() < MATCHING.fewest:
            continue
        pose = refine_pose(matches.subset(keep), depth_i[keep], depth_j[keep], rotation, translation)
        pose = _score(matches, depth_i, depth_j, pose)
        if best is None or pose.cost < best.cost:
            best = pose
    for _ in range(MATCHING.rounds):
        if best is None or best.num_inliers < MATCHING.fewest:
            return None
        best = _score(matches, depth_i, depth_j, _refine_pose(matches, depth_i, depth_j, best))
    return best if best is not None and best.num_inliers >= MATCHING.fewest else None


def _refine_pose(
    matches: Matches, depth_i: np.ndarray, depth_j: np.ndarray, pose: RelativePose
) -> RelativePose:
    """The pose that all matches which agree with it say, not only those it was found with."""
    keep = pose.inliers
    return refine_pose(matches.subset(keep), depth_i[keep], depth_j[keep], pose.rotation, pose.translation)


def _five_point(matches: Matches, depth_i: np.ndarray) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Essential matrix by MAGSAC++; the length of t from the depth map."""
    threshold = 1.5 * matches.sigma
    essential, inliers = cv2.findEssentialMat(
        matches.x_i, matches.x_j, np.eye(3), method=cv2.USAC_MAGSAC, prob=0.9999, threshold=threshold
    )
    if essential is None or essential.shape != (3, 3) or inliers.sum() < MATCHING.fewest:
        return []
    keep = inliers[:, 0].astype(bool)
    _, rotation, direction, _ = cv2.recoverPose(essential, matches.x_i[keep], matches.x_j[keep], np.eye(3))
    direction = direction[:, 0]
    depths = triangulate(matches.x_i[keep], matches.x_j[keep], rotation, direction)
    usable = np.isfinite(depths) & (depths > 0)
    if usable.sum() < MATCHING.fewest // 2:
        return [(rotation, np.zeros(3), keep)]
    length = np.median(depth_i[keep][usable] / depths[usable])
    return [(rotation, direction * length, keep), (rotation, np.zeros(3), keep)]


def triangulate(
    x_i: Float[np.ndarray, "n 2"],
    x_j: Float[np.ndarray, "n 2"],
    rotation: Float[np.ndarray, "3 3"],
    translation: Float[np.ndarray, "3"],
) -> Float[np.ndarray, " n"]:
    """z in view i (n,) from x_j ~ R z (x_i, 1) + t; least squares over both equations."""
    turned = _homogeneous(x_i) @ rotation.T
    slope = turned[:, :2] - x_j * turned[:, 2:]
    offset = x_j * translation[2] - translation[:2]
    return (slope * offset).sum(1) / np.maximum((slope**2).sum(1), 1e-12)


def _pnp(matches: Matches, depth_i: np.ndarray) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Pose of view j from view i's depth map; the tolerance is that of the depths."""
    points = _homogeneous(matches.x_i) * depth_i[:, None]
    tolerance = max(0.02, 2 * matches.sigma)
    cv2.setRNGSeed(0)
    found, turn, translation, inliers = cv2.solvePnPRansac(
        points, matches.x_j, np.eye(3), None,
        iterationsCount=300, reprojectionError=tolerance, flags=cv2.SOLVEPNP_SQPNP,
    )  # fmt: skip
    if not found or inliers is None:
        return []
    keep = np.zeros(len(points), bool)
    keep[inliers[:, 0].astype(int)] = True
    return [(cv2.Rodrigues(turn)[0], translation[:, 0], keep)]


@dataclass(frozen=True)
class DepthPriors:
    """What the monocular maps say at n matches: log depths (n,) of both; share weighs them.

    Errors of a map are smooth, so n matches do not know n times as much; taking them as
    independent turned cameras by up to a degree to please a tilted map.
    """

    log_i: Float[np.ndarray, " n"]
    log_j: Float[np.ndarray, " n"]
    share: float

    @staticmethod
    def of(depth_i: Float[np.ndarray, " n"], depth_j: Float[np.ndarray, " n"]) -> "DepthPriors":
        """From depths (n,) > 0."""
        return DepthPriors(np.log(depth_i), np.log(depth_j), min(1.0, MATCHING.independent / len(depth_i)))

    def weigh(self, terms: Float[np.ndarray, "n 4"]) -> Float[np.ndarray, "n 4"]:
        """Terms (n, 4) of the residuals, those of depth times `share`."""
        return terms * np.array([1.0, 1.0, self.share, self.share])


def refine_pose(
    matches: Matches,
    depth_i: Float[np.ndarray, " n"],
    depth_j: Float[np.ndarray, " n"],
    rotation: Float[np.ndarray, "m C"],
    translation: Float[np.ndarray, " k"],
) -> RelativePose:
    """Two-view bundle adjustment with depth priors, Levenberg-Marquardt, Cauchy weights.

    Unknowns are the pose (6), the log scale of view j's depths, and one log depth per match,
    which is eliminated in closed form (Schur complement): each step solves a 7 x 7 system.

    Source: own derivation on Triggs et al. 2000; twin: scipy.optimize.least_squares in the tests.
    """
    state = _State(rotation, translation, 0.0, np.log(depth_i))
    priors = DepthPriors.of(depth_i, depth_j)
    damping, cost = 1e-3, np.inf
    for _ in range(MATCHING.iterations):
        residuals, jac_pose, jac_depth = _linearise(state, matches, priors)
        weights = priors.weigh(1 / (1 + (residuals / MATCHING.cauchy) ** 2))
        cost = _robust_cost(residuals, priors)
        step = _solve(residuals, weights, jac_pose, jac_depth, state.log_scale, damping)
        trial = state.moved(*step)
        gain = cost - _robust_cost(_residuals(trial, matches, priors), priors)
        if gain > 0:
            state, damping = trial, max(damping / 5, 1e-9)
        else:
            damping *= 8
        if np.abs(step[0]).max() < 1e-8 or damping > 1e8 or 0 < gain < MATCHING.converged * cost:
            break
    residuals, jac_pose, jac_depth = _linearise(state, matches, priors)
    agrees = np.linalg.norm(residuals[:, :2], axis=1) < MATCHING.inlier
    weights = priors.weigh(1 / (1 + (residuals / MATCHING.cauchy) ** 2))
    information, _, _ = _schur_complement(weights, jac_pose, jac_depth, 0.0)
    return RelativePose(state.rotation, state.translation, state.log_scale, agrees, cost, information)


def _score(matches: Matches, depth_i: np.ndarray, depth_j: np.ndarray, pose: RelativePose) -> RelativePose:
    """Inliers and cost of a pose over *all* matches, each at its own best depth."""
    depths = np.clip(triangulate(matches.x_i, matches.x_j, pose.rotation, pose.translation), 1e-3, 1e4)
    parallax = np.linalg.norm(pose.translation) / np.maximum(depth_i, 1e-6)
    depths = np.where(parallax > 4 * matches.sigma, depths, depth_i)
    priors = DepthPriors.of(depth_i, depth_j)
    log_prior = priors.log_i
    state = _State(
        pose.rotation, pose.translation, pose.log_scale, np.clip(np.log(depths), log_prior - 1, log_prior + 1)
    )
    residuals = _residuals(state, matches, priors)
    agrees = np.linalg.norm(residuals[:, :2], axis=1) < MATCHING.inlier
    agrees &= (np.abs(residuals[:, 2:]) < 4).all(1)
    costs = np.minimum(np.log1p((residuals / MATCHING.cauchy) ** 2).sum(1), 6.0)
    return replace(pose, inliers=agrees, cost=float(costs.mean()))


@dataclass(frozen=True)
class _State:
    rotation: np.ndarray
    translation: np.ndarray
    log_scale: float
    log_depths: np.ndarray

    def moved(self, pose_step: np.ndarray, depth_step: np.ndarray) -> "_State":
        turn = cv2.Rodrigues(pose_step[:3])[0]
        log_depths = self.log_depths + np.clip(depth_step, -1, 1)
        return _State(
            turn @ self.rotation, self.translation + pose_step[3:6], self.log_scale + pose_step[6], log_depths
        )


def _residuals(state: _State, matches: Matches, priors: DepthPriors) -> np.ndarray:
    """(n, 4) in sigmas: reprojection x, y; log depth against view i's map; against view j's."""
    pos_j = (
        _homogeneous(matches.x_i) * np.exp(state.log_depths)[:, None] @ state.rotation.T + state.translation
    )
    z = np.maximum(pos_j[:, 2], 1e-6)
    reprojection = (pos_j[:, :2] / z[:, None] - matches.x_j) / matches.sigma
    from_i = (state.log_depths - priors.log_i) / MATCHING.depth_sigma
    from_j = (np.log(z) - priors.log_j - state.log_scale) / MATCHING.depth_sigma
    return np.column_stack((reprojection, from_i, from_j))


def _linearise(
    state: _State, matches: Matches, priors: DepthPriors
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Residuals (n, 4), their Jacobians to the pose and scale (n, 4, 7) and to the depth (n, 4)."""
    turned = _homogeneous(matches.x_i) * np.exp(state.log_depths)[:, None] @ state.rotation.T
    pos_j = turned + state.translation
    z = np.maximum(pos_j[:, 2], 1e-6)
    n = len(z)
    to_point = np.zeros((n, 4, 3))
    to_point[:, 0, 0] = to_point[:, 1, 1] = 1 / (z * matches.sigma)
    to_point[:, :2, 2] = -pos_j[:, :2] / (z * z * matches.sigma)[:, None]
    to_point[:, 3, 2] = 1 / (z * MATCHING.depth_sigma)
    jac_pose = np.zeros((n, 4, 7))
    jac_pose[:, :, :3] = np.cross(turned[:, None], to_point)
    jac_pose[:, :, 3:6] = to_point
    jac_pose[:, 3, 6] = -1 / MATCHING.depth_sigma
    jac_depth = (to_point * turned[:, None]).sum(2)
    jac_depth[:, 2] += 1 / MATCHING.depth_sigma
    return _residuals(state, matches, priors), jac_pose, jac_depth


def _solve(residuals, weights, jac_pose, jac_depth, log_scale, damping) -> tuple[np.ndarray, np.ndarray]:
    """One damped Gauss-Newton step: pose and scale (7,), depths (n,)."""
    reduced, cross, own = _schur_complement(weights, jac_pose, jac_depth, damping)
    gradient = residuals.ravel() @ (jac_pose * weights[..., None]).reshape(-1, 7)
    own_gradient = (weights * jac_depth * residuals).sum(1)
    gradient[6] += log_scale / MATCHING.scale_sigma**2
    pose_step = -np.linalg.solve(reduced, gradient - cross.T @ (own_gradient / own))
    return pose_step, -(own_gradient + cross @ pose_step) / own


def _schur_complement(
    weights, jac_pose, jac_depth, damping: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Hessian (7, 7) of pose and scale without the depths; of both together (n, 7), and of depths (n,)."""
    weighted = jac_pose * weights[..., None]
    hessian = weighted.reshape(-1, 7).T @ jac_pose.reshape(-1, 7)
    cross = (weighted * jac_depth[..., None]).sum(1)
    own = (weights * jac_depth**2).sum(1) * (1 + damping)
    hessian[6, 6] += 1 / MATCHING.scale_sigma**2
    hessian[np.diag_indices(7)] += damping * np.diag(hessian) + 1e-9
    return hessian - (cross / own[:, None]).T @ cross, cross, own


def _robust_cost(residuals: np.ndarray, priors: DepthPriors) -> float:
    return float(priors.weigh(np.log1p((residuals / MATCHING.cauchy) ** 2)).sum(1).mean())


def _homogeneous(x: np.ndarray) -> np.ndarray:
    return np.column_stack((x, np.ones(len(x))))
