"""Where was the camera that sees these points at these pixels, and the same in cameras that are known?

Source: Lepetit et al. 2009 for the problem (PnP), SQPnP (Terzakis and Lourakis 2020) for its solution, as
OpenCV has them; Triggs et al. 2000 for the adjustment.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.sparse import lil_matrix
from scipy.spatial.transform import Rotation

from langflash_core.geometry.pinhole import from_pixels, see_each
from langflash_core.rig.settings import ADDING


@dataclass(frozen=True)
class Placed:
    """viewmat (4, 4), world to camera; agree (n,): points that fall on their pixels."""

    viewmat: Float[np.ndarray, "4 4"]
    agree: Bool[np.ndarray, " n"]


def place_camera(
    points: Float[np.ndarray, "n 3"],
    pixels: Float[np.ndarray, "n 2"],
    K: Float[np.ndarray, "3 3"],
    tolerance: float,
) -> Placed | None:
    """The pose from which points of the world, in any unit, are seen at their pixels; deterministic. None
    where too few of them agree.

    Args:
        tolerance: pixels by which one that agrees may miss.
    """
    if len(points) < ADDING.least:
        return None
    middle = np.median(points, 0)
    spread = float(np.median(np.linalg.norm(points - middle, axis=1)))
    unit = spread if spread > 0 else 1.0
    cv2.setRNGSeed(0)
    found, turn, shift, inliers = cv2.solvePnPRansac(
        (points - middle) / unit, pixels, K, None,
        iterationsCount=200, reprojectionError=tolerance, confidence=0.9999, flags=cv2.SOLVEPNP_SQPNP,
    )  # fmt: skip
    if not found or inliers is None or len(inliers) < ADDING.least:
        return None
    agree = np.zeros(len(points), dtype=bool)
    agree[inliers[:, 0].astype(np.int64)] = True
    turn, shift = cv2.solvePnPRefineLM((points[agree] - middle) / unit, pixels[agree], K, None, turn, shift)
    viewmat = np.eye(4)
    viewmat[:3, :3] = cv2.Rodrigues(turn)[0]
    viewmat[:3, 3] = shift[:, 0] * unit - viewmat[:3, :3] @ middle
    return Placed(viewmat, agree) if np.isfinite(viewmat).all() else None


@dataclass(frozen=True)
class Sightings:
    """Key points of a new camera that cameras with known poses see, too.

    pixels (n, 2) in the new camera; depths (n,) along its z axis, as far as they are known. Of m sightings:
    of (m,) which key point, seen (m, 2) its pixels in a camera of viewmats (m, 4, 4) and Ks (m, 3, 3).
    """

    pixels: Float[np.ndarray, "n 2"]
    depths: Float[np.ndarray, " n"]
    of: Int[np.ndarray, " m"]
    seen: Float[np.ndarray, "m 2"]
    viewmats: Float[np.ndarray, "m 4 4"]
    Ks: Float[np.ndarray, "m 3 3"]


def adjust_camera(
    viewmat: Float[np.ndarray, "4 4"], K: Float[np.ndarray, "3 3"], sightings: Sightings
) -> Float[np.ndarray, "4 4"]:
    """The pose (4, 4) with which the key points, each at its own best depth, fall on their pixels in the
    cameras that are known: bundle adjustment of one camera, with Cauchy's loss.

    Depths that a layer says are right to some hundredths and wrong alike over a whole thing, which turns a
    camera that is placed by them alone.

    Args:
        viewmat: nearly right, world to camera.
    """
    from scipy.optimize import least_squares  # .05 s, which a scene has not to wait for

    rays = np.column_stack((from_pixels(sightings.pixels, K), np.ones(len(sightings.pixels))))
    known = np.log(sightings.depths)
    of, count, many = sightings.of, len(sightings.seen), len(known)

    def pose(state: np.ndarray) -> np.ndarray:
        moved = viewmat.copy()
        moved[:3, :3] = Rotation.from_rotvec(state[:3]).as_matrix() @ viewmat[:3, :3]
        moved[:3, 3] += state[3:6]
        return moved

    def residuals(state: np.ndarray) -> np.ndarray:
        moved = pose(state)
        points = (rays * np.exp(state[6:])[:, None] - moved[:3, 3]) @ moved[:3, :3]
        places = see_each(points[of], sightings.viewmats, sightings.Ks)
        apart = (places - sightings.seen).ravel() / ADDING.sigma
        return np.concatenate((apart, (state[6:] - known) / ADDING.depth_sigma))

    sparsity = lil_matrix((2 * count + many, 6 + many), dtype=int)
    rows = np.arange(count)
    sparsity[: 2 * count, :6] = 1
    sparsity[2 * rows, 6 + of] = sparsity[2 * rows + 1, 6 + of] = 1
    sparsity[2 * count + np.arange(many), 6 + np.arange(many)] = 1
    start = np.concatenate((np.zeros(6), known))
    found = least_squares(
        residuals, start, jac_sparsity=sparsity, x_scale="jac", loss="cauchy", f_scale=ADDING.cauchy
    )
    return pose(found.x) if np.isfinite(found.x).all() else viewmat
