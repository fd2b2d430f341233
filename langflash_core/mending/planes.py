"""Planes in a cloud of points, the largest first: random triples, the best one refitted, its points taken
out.

A plane is n . x = d, n of unit length. Source: Fischler and Bolles 1981.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from langflash_core.mending.settings import PLANE_FIT


@dataclass(frozen=True)
class Plane:
    """normal (3,), unit; offset: n . x of its points. noise: robust deviation of those, in tolerances."""

    normal: Float[np.ndarray, " 3"]
    offset: float
    noise: float = 1.0

    def apart(self, points: Float[np.ndarray, "*n 3"]) -> Float[np.ndarray, "*n"]:
        """Distances of points, below 0 behind the normal."""
        return points @ self.normal - self.offset

    def basis(self) -> Float[np.ndarray, "2 3"]:
        """Two unit vectors along the plane, at right angles."""
        other = np.eye(3)[np.abs(self.normal).argmin()]
        first = np.cross(self.normal, other)
        first /= np.linalg.norm(first)
        return np.stack((first, np.cross(self.normal, first)))


def planes(
    points: Float[np.ndarray, "n 3"], tolerances: Float[np.ndarray, " n"], *, share: float, most: int
) -> list[Plane]:
    """Planes that each hold at least a share of the points. The same points give the same planes.

    Args:
        tolerances: distance to which each point belongs to a plane. share: of all points. most: planes.
    """
    left = np.ones(len(points), bool)
    found: list[Plane] = []
    draws = np.random.default_rng(len(points))
    while len(found) < most and left.sum() >= max(3, share * len(points)):
        plane = _best(points[left], tolerances[left], draws)
        if plane is None:
            break
        on_it = left & (abs(plane.apart(points)) <= tolerances)
        if on_it.sum() < max(3, share * len(points)):
            break
        noise = 1.4826 * float(np.median(abs(plane.apart(points[on_it])) / tolerances[on_it]))
        found.append(replace(plane, noise=noise))
        left &= ~on_it
    return found


def _best(
    points: Float[np.ndarray, "n 3"], tolerances: Float[np.ndarray, " n"], draws: np.random.Generator
) -> Plane | None:
    """None where all triples lie in a line."""
    triples = points[draws.integers(len(points), size=(PLANE_FIT.triples, 3))]  # (t, 3, 3)
    normals = np.cross(triples[:, 1] - triples[:, 0], triples[:, 2] - triples[:, 0])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    normals /= np.maximum(lengths, 1e-30)
    offsets = (normals * triples[:, 0]).sum(1)
    on_it = (abs(normals @ points.T - offsets[:, None]) <= tolerances) & (lengths > 1e-12)  # (t, n)
    inliers: Bool[np.ndarray, " n"] = on_it[on_it.sum(1).argmax()]
    if not inliers.any():
        return None
    plane = _through(points[inliers])
    for _ in range(PLANE_FIT.refits):
        inliers = abs(plane.apart(points)) <= tolerances
        if inliers.sum() < 3:
            break
        plane = _through(points[inliers])
    return plane


def _through(points: Float[np.ndarray, "n 3"]) -> Plane:
    """The plane nearest to all of the points, in squares."""
    centre = points.mean(0)
    normal = np.linalg.svd(points - centre, full_matrices=False)[2][-1]
    return Plane(normal, float(normal @ centre))
