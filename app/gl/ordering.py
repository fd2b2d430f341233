"""Which Gaussians may touch an image, back to front: plain numbers, no OpenGL.

N Gaussians, those of a scene that can be drawn at all.
"""

import math

import numpy as np
from torch import Tensor

from langflash_core.splat.projection import ALPHA_MIN, DILATION, NEAR, TAN_MARGIN
from langflash_core.types import Camera


class Ordering:
    """`order` (n,) uint32: rows that were chosen last, the first drawn first. `depth_range`: of the middle
    96 % of them, scene units. `shown` (N,) bool: which may be chosen."""

    def __init__(self, means: Tensor, scales: Tensor):
        self.order = np.zeros(0, np.uint32)
        self.depth_range = (NEAR, 1.0)
        self.shown = np.ones(len(means), bool)
        self._means, self._coordinates, self._widest = _places(means, scales)

    def place(self, means: Tensor, scales: Tensor) -> None:
        """The same Gaussians elsewhere: means and scales (N, 3), scene units."""
        self._means, self._coordinates, self._widest = _places(means, scales)

    def sort(self, camera: Camera) -> None:
        """Choose the Gaussians that may touch the image and order them back to front.

        z is computed in float64, term by term as in the reference (`view_depths`), so that both
        agree on near ties; of equal depths the first Gaussian is in front.
        """
        viewmat = camera.viewmat.detach().cpu().double().numpy()
        across, down, along = self._coordinates
        row = viewmat[2]
        z = across * row[0] + down * row[1] + along * row[2] + row[3]
        with np.errstate(over="ignore", invalid="ignore"):  # places beyond float32 are beside any image
            rows = np.flatnonzero(self._may_touch(camera, viewmat, z) & self.shown)
        depths = z[rows]
        nearest_first = rows[stable_order(depths)]
        if len(rows):
            margin = len(rows) // 50
            near, far = z[nearest_first[margin]], z[nearest_first[len(rows) - 1 - margin]]
            self.depth_range = (float(near), float(far))
        self.order = nearest_first[::-1].astype(np.uint32)

    def _may_touch(self, camera: Camera, viewmat: np.ndarray, z: np.ndarray) -> np.ndarray:
        """(N,) bool, conservative: the Frobenius norm of the Jacobian bounds the footprint.

        Of an orthographic camera |J|_F^2 = fx^2 + fy^2, wherever the Gaussian is.
        """
        K = camera.K.detach().cpu().double().numpy()
        seen = z >= NEAR
        flat = camera.orthographic
        inverse = np.ones(len(z), np.float32) if flat else 1 / np.where(seen, z, 1.0).astype(np.float32)
        sizes = (camera.width, camera.height)
        bound = 0.0  # |J|_F^2 z^2 <= sum over axes of focal^2 (1 + steepest slope^2)
        for axis, extent in enumerate(sizes):
            focal, principal = K[axis, axis], K[axis, 2]
            steepest = (max(principal, extent - principal) + TAN_MARGIN * 0.5 * extent) / focal
            bound += focal * focal * (1 if flat else 1 + steepest * steepest)
        rounding = np.float32(1e-6 * np.abs(viewmat[:3, 3]).max())  # of places far from the origin
        deviations = np.sqrt(
            np.square((self._widest + rounding) * inverse) * np.float32(bound) + np.float32(DILATION)
        )
        radius = np.float32(math.sqrt(2 * math.log(1 / ALPHA_MIN))) * deviations + np.float32(1)
        for axis, extent in enumerate(sizes):
            pos_c = self._means @ viewmat[axis, :3].astype(np.float32) + np.float32(viewmat[axis, 3])
            place = pos_c * inverse * np.float32(K[axis, axis]) + np.float32(K[axis, 2])
            seen &= (place + radius > 0) & (place - radius < extent)
        return seen


def _places(means: Tensor, scales: Tensor) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Means (N, 3), the same in float64 with a row an axis, and the largest scales (N,)."""
    places = means.numpy()
    return places, np.ascontiguousarray(places.T, np.float64), scales.abs().amax(-1).numpy()


def stable_order(keys: np.ndarray) -> np.ndarray:
    """np.argsort(keys, kind="stable") by the several times faster unstable sort, ties put right."""
    order = np.argsort(keys)
    ordered = keys[order]
    same = ordered[1:] == ordered[:-1]
    if same.any():
        tied = np.append(same, False) | np.insert(same, 0, False)
        runs = np.cumsum(np.insert(~same, 0, True))[tied]
        rows = order[tied]
        order[tied] = rows[np.lexsort((rows, runs))]
    return order
