"""Which Gaussians may touch a picture, or a part of it: conservative, and quick of ten million.

Everything here is numpy, some of N Gaussians at a time, which lets other threads run meanwhile.
"""

import math
from collections.abc import Iterator

import numpy as np
from jaxtyping import Bool, Float

from langflash_core.types import Camera, Gaussians

from .projection import ALPHA_MIN, DILATION, NEAR, TAN_MARGIN

AT_ONCE = 1 << 16  # Gaussians: their 2 MB of numbers stay in a core's cache
Box = tuple[float, float, float, float]
"""x0, y0, x1, y1, pixels, half open."""


def may_touch(gaussians: Gaussians, camera: Camera, box: Box | None = None) -> Bool[np.ndarray, " N"]:
    """(N,) bool: all whose footprints reach the camera's picture, or a box in it, and few others. What is not
    finite touches nothing."""
    means = gaussians.means.detach().cpu().numpy().T
    widest = gaussians.scales.detach().cpu().abs().amax(-1).numpy()
    found = np.zeros(len(gaussians), bool)
    for some, inside, _ in near_frustum(means, widest, camera, box):
        found[some] = inside
    return found


def near_frustum(
    means: Float[np.ndarray, "3 N"],
    widest: Float[np.ndarray, " N"],
    camera: Camera,
    box: Box | None = None,
    margin: float = 0.0,
) -> Iterator[tuple[slice, Bool[np.ndarray, " n"], Float[np.ndarray, " n"]]]:
    """`AT_ONCE` after the other: which Gaussians, which of them may touch, and their depths z.

    Beside each side of the frustum, with sqrt(a^2 + b^2) <= a + b for the radius in pixels: f x + (c + r) z
    + b s > 0 of the left one, linear in place and largest scale s, so one product of matrices tells.

    Args:
        widest: largest scales. box: None: the whole picture. margin: of the picture's sides, around it.
    """
    viewmat = camera.viewmat.detach().cpu().double().numpy()
    planes = _planes(camera, box or (0.0, 0.0, camera.width, camera.height), margin)
    eye = -viewmat[:3, :3].T @ viewmat[:3, 3]
    centre = eye.astype(np.float32)[:, None]
    turned = (planes[:, :3] @ viewmat[:3, :3]).astype(np.float32)  # (5, 3)
    rest = planes[:, 3] + planes[:, :3] @ viewmat[:3, :3] @ (centre[:, 0] - eye)
    rest, widths = rest.astype(np.float32)[:, None], planes[:4, 4].astype(np.float32)[:, None]
    for first in range(0, len(widest), AT_ONCE):
        some = slice(first, first + AT_ONCE)
        with np.errstate(over="ignore", invalid="ignore"):  # places beyond float32 are beside any image
            beside = turned @ (means[:, some] - centre)  # (5, n), the last one z
            beside += rest
            z = beside[4]
            beside[:4] += widths * widest[some]
            yield some, (beside[:4].min(0) > 0) & (z >= NEAR), z


def _planes(camera: Camera, box: Box, margin: float) -> Float[np.ndarray, "5 5"]:
    """Numbers that x y z 1 in the camera's axes and the largest scale are multiplied by: distances from the
    left, right, upper and lower side, pixels times z, and z."""
    K = camera.K.detach().cpu().double().numpy()
    flat = camera.orthographic
    faint = math.sqrt(2 * math.log(1 / ALPHA_MIN))
    found = np.zeros((5, 5))
    found[4, 2] = 1
    found[:4, 4] = faint * math.sqrt(steepness(camera))
    for axis, extent in enumerate((camera.width, camera.height)):
        radius = faint * math.sqrt(DILATION) + 1 + margin * extent
        found[2 * axis : 2 * axis + 2, axis] = K[axis, axis], -K[axis, axis]
        found[2 * axis, 3 if flat else 2] = K[axis, 2] - box[axis] + radius
        found[2 * axis + 1, 3 if flat else 2] = box[2 + axis] - K[axis, 2] + radius
    return found


def steepness(camera: Camera) -> float:
    """Bound of |J|_F^2 z^2: the sum over both axes of focal^2 (1 + steepest slope^2). Of an orthographic
    camera |J|_F^2 = fx^2 + fy^2, wherever the Gaussian is."""
    K = camera.K.detach().cpu().double().numpy()
    bound = 0.0
    for axis, extent in enumerate((camera.width, camera.height)):
        focal, principal = K[axis, axis], K[axis, 2]
        steepest = (max(principal, extent - principal) + TAN_MARGIN * 0.5 * extent) / focal
        bound += focal * focal * (1 if camera.orthographic else 1 + steepest * steepest)
    return bound
