"""Where a pinhole camera shows points, and back: the one place that says it. Pixel centres at +0.5.

Arithmetic alone, of arrays of numpy and of torch alike, of any dtype and on any device. Imports no torch:
frames are drawn before torch is there. `rig.projected` has whole photos on it.
"""

from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Bool, Float


def to_pixels(x: Any, y: Any, depths: Any, K: Any) -> tuple[Any, Any]:
    """Pixels x and y (..., n) of points (..., n) in the frame of a camera, K (..., 3, 3).

    Args:
        depths: by what x and y are divided: z, kept from 0, or 1 of parallel rays.
    """
    across = x / depths * K[..., 0, 0, None] + K[..., 0, 2, None]
    return across, y / depths * K[..., 1, 1, None] + K[..., 1, 2, None]


def from_pixels(pixels: Any, K: Any) -> Any:
    """x / z and y / z (n, 2) of what is seen at pixels (n, 2); K (3, 3)."""
    return (pixels - K[:2, 2]) / K.diagonal()[:2]


class Seen(NamedTuple):
    """Points in a picture. x, y: pixels; those of its principal point of what is not before the camera. z:
    depth, in the unit of the points. inside: before the camera and in its picture; never of what is no
    number."""

    x: Float[np.ndarray, " n"]
    y: Float[np.ndarray, " n"]
    z: Float[np.ndarray, " n"]
    inside: Bool[np.ndarray, " n"]


def see(
    points: Float[np.ndarray, "n 3"],
    viewmat: Float[np.ndarray, "4 4"],
    K: Float[np.ndarray, "3 3"],
    size: tuple[float, float],
    nearest: float = 0.0,
    orthographic: bool = False,
) -> Seen:
    """Points of the world in one picture; `rig.projected.project_points` of numpy alone.

    Args:
        viewmat: world to camera. size: (width, height), pixels. nearest: depth from which a point is before
            the camera, in its unit.
    """
    x, y, z = (points @ viewmat[:3, :3].T + viewmat[:3, 3]).T
    ahead = z > nearest
    depths = np.ones(1) if orthographic else np.where(ahead, z, np.inf)
    x, y = to_pixels(x, y, depths, K)
    return Seen(x, y, z, ahead & (x >= 0) & (y >= 0) & (x < size[0]) & (y < size[1]))


def see_each(
    points: Float[np.ndarray, "n 3"], viewmats: Float[np.ndarray, "n 4 4"], Ks: Float[np.ndarray, "n 3 3"]
) -> Float[np.ndarray, "n 2"]:
    """Pixels (n, 2) of points of the world, each in a camera of its own; far outside of what is behind."""
    there = np.einsum("nij,nj->ni", viewmats[:, :3, :3], points) + viewmats[:, :3, 3]
    x, y, z = (there[:, axis, None] for axis in range(3))
    return np.concatenate(to_pixels(x, y, np.maximum(z, 1e-9), Ks), 1)
