"""Where was the camera that sees these points at these pixels?

Source: Lepetit et al. 2009 for the problem (PnP), SQPnP (Terzakis and Lourakis 2020) for its solution, as
OpenCV has them.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float

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
        points / unit, pixels, K, None,
        iterationsCount=200, reprojectionError=tolerance, confidence=0.9999, flags=cv2.SOLVEPNP_SQPNP,
    )  # fmt: skip
    if not found or inliers is None or len(inliers) < ADDING.least:
        return None
    agree = np.zeros(len(points), dtype=bool)
    agree[inliers[:, 0].astype(np.int64)] = True
    turn, shift = cv2.solvePnPRefineLM(points[agree] / unit, pixels[agree], K, None, turn, shift)
    viewmat = np.eye(4)
    viewmat[:3, :3], viewmat[:3, 3] = cv2.Rodrigues(turn)[0], shift[:, 0] * unit
    return Placed(viewmat, agree) if np.isfinite(viewmat).all() else None
