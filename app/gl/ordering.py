"""Which Gaussians may touch an image, back to front: plain numbers, no OpenGL.

N Gaussians, those of a scene that can be drawn at all. Everything here is numpy, which lets other threads run
meanwhile: while the camera moves an order is found beside the frames that draw the one before.
"""

import math
import os
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from torch import Tensor

from langflash_core.splat.frustum import AT_ONCE, near_frustum, steepness
from langflash_core.splat.projection import ALPHA_MIN, DILATION, NEAR
from langflash_core.types import Camera

MOST_BEHIND = 2
"""Frames that an order may be late."""
MARGIN = 0.1
"""Share of the image's sides around it, of which a late order has the Gaussians too. Of a lens of 60 degrees
5 degrees: two frames of a turn by 75 degrees a second at 30 frames a second."""
FEW = 50_000
"""Gaussians that are ordered within 4 ms, which is not worth a late order."""
_MOST_THREADS = 4  # as many as layers are blended


@dataclass(frozen=True)
class Places:
    """Where N Gaussians are. means: (3, N) float32, a row an axis; widest: (N,) float32, their largest
    scales, scene units. shown: (N,) bool, which may be chosen."""

    means: np.ndarray
    widest: np.ndarray
    shown: np.ndarray


@dataclass(frozen=True)
class Order:
    """rows: (n,) uint32, those chosen, the first drawn first. depth_range: of the middle 96 % of them, scene
    units; None of none."""

    rows: np.ndarray
    depth_range: tuple[float, float] | None


@dataclass(frozen=True)
class _Job:
    """An order that is found, or being found. frame: counted, in which it was asked for."""

    camera: Camera
    exact: bool
    frame: int
    found: "Future[Order]"


class Ordering:
    """`order` (n,) uint32: rows that were chosen last, the first drawn first. `depth_range`: of the middle
    96 % of them, scene units."""

    def __init__(self, means: Tensor, scales: Tensor):
        self.order = np.zeros(0, np.uint32)
        self.depth_range = (NEAR, 1.0)
        self._places = Places(*_places(means, scales), np.ones(len(means), bool))
        self._frame = 0
        self._job: _Job | None = None  # under way
        self._held: _Job | None = None  # whose order is drawn

    def place(self, means: Tensor, scales: Tensor) -> None:
        """The same Gaussians elsewhere: means and scales (N, 3), scene units."""
        self._places = Places(*_places(means, scales), self._places.shown)
        self._job = self._held = None

    def show(self, shown: np.ndarray) -> bool:
        """Which may be chosen (N,) bool; whether these are others than before."""
        if np.array_equal(shown, self._places.shown):
            return False
        self._places = replace(self._places, shown=shown)
        self._job = self._held = None
        return True

    def sort(self, camera: Camera) -> None:
        """Choose the Gaussians that may touch the image and order them back to front, exactly."""
        job = self._job if self._seeks(camera) else None
        if job is None:
            found: Future[Order] = Future()
            found.set_result(exact_order(self._places, camera))
            job = _Job(camera, True, self._frame, found)
        self._take(job)

    def found(self, camera: Camera) -> bool:
        """Let `sort` find its order beside the frames; whether that is there, so that it does not wait."""
        if len(self._places.widest) <= FEW:
            return True
        if not self._seeks(camera):
            self._begin(camera, exact=True)
        assert self._job is not None
        return self._job.found.done()

    def follow(self, camera: Camera) -> bool:
        """Order for one frame of a moving camera, late by `MOST_BEHIND` of them at the most, and only while
        it has what the camera sees; equal depths are those whose difference `depth_keys` does not tell.
        Whether it is exact, as of `FEW`."""
        if len(self._places.widest) <= FEW:
            self.sort(camera)
            return True
        self._frame += 1
        if self._job is not None and self._job.exact:
            self._job = None
        if self._job is not None and self._job.found.done():
            self._take(self._job)
        if self._job is None:
            self._begin(camera, exact=False)
        while not self._serves(camera):
            if self._job is None:
                self._begin(camera, exact=False)
            assert self._job is not None
            self._take(self._job)
        return False

    def _seeks(self, camera: Camera) -> bool:
        job = self._job
        return job is not None and job.exact and camera_key(job.camera) == camera_key(camera)

    def _serves(self, camera: Camera) -> bool:
        held = self._held
        if held is None or self._frame - held.frame > MOST_BEHIND:
            return False
        margin = 0.0 if held.exact else MARGIN
        return held.camera is camera or sees(held.camera, camera, self.depth_range, margin)

    def _begin(self, camera: Camera, exact: bool) -> None:
        find = exact_order if exact else quick_order
        self._job = _Job(camera, exact, self._frame, _threads().submit(find, self._places, camera))

    def _take(self, job: _Job) -> None:
        """Draw this order, once it is found."""
        order = job.found.result()
        self.order, self.depth_range = order.rows, order.depth_range or self.depth_range
        self._held, self._job = job, None


@cache
def _threads() -> ThreadPoolExecutor:
    """For all orderings: a job takes milliseconds."""
    return ThreadPoolExecutor(min(_MOST_THREADS, os.cpu_count() or 1), "order")


# --- orders -----------------------------------------------------------------------------------


def exact_order(places: Places, camera: Camera) -> Order:
    """Those that may touch the image.

    z is computed in float64, term by term as in the reference (`view_depths`), so that both agree on near
    ties; of equal depths the first Gaussian is in front.
    """
    rows, depths = _chosen(places, camera)
    return _ordered(rows, depths, stable_order(depths))


def quick_order(places: Places, camera: Camera) -> Order:
    """Those that may touch the image or what is `MARGIN` around it, by depths of sixteen bits, in a fifth of
    the time."""
    rows, depths = _around(places, camera, MARGIN)
    return _ordered(rows, depths, np.argsort(depth_keys(depths), kind="stable"))


def _ordered(rows: np.ndarray, depths: np.ndarray, nearest_first: np.ndarray) -> Order:
    if not len(rows):
        return Order(rows, None)
    margin = len(rows) // 50
    near, far = depths[nearest_first[margin]], depths[nearest_first[len(rows) - 1 - margin]]
    return Order(np.ascontiguousarray(rows[nearest_first[::-1]]), (float(near), float(far)))


def stable_order(depths: np.ndarray) -> np.ndarray:
    """np.argsort(depths, kind="stable") of float64 from 0 on, several times faster: digit by digit of sixteen
    bits, by each of which numpy counts."""
    digits = np.ascontiguousarray(depths, "<f8").view("<u2").reshape(-1, 4)  # the lowest first
    order = np.argsort(digits[:, 0], kind="stable")
    for place in range(1, 4):
        order = order[np.argsort(digits[order, place], kind="stable")]
    return order


def depth_keys(depths: np.ndarray) -> np.ndarray:
    """Depths (n,) above 0 as uint16 that order them: bits of float32 grow as logarithms do. Of depths in a
    ratio of 1 to 16, those are told apart that differ by 1/8000 of themselves."""
    if not len(depths):
        return np.zeros(0, np.uint16)
    bits = depths.astype(np.float32).view(np.uint32)
    bits -= bits.min()
    return (bits >> max(0, int(bits.max()).bit_length() - 16)).astype(np.uint16)


# --- what a camera sees -----------------------------------------------------------------------


def sees(before: Camera, now: Camera, depths: tuple[float, float], margin: float) -> bool:
    """Whether what one camera sees between two depths was in the image of another, or in so many of its sides
    around that. Frusta are convex: their corners tell."""
    if before.orthographic != now.orthographic:
        return False
    (old, old_lens), (new, lens) = matrices(before), matrices(now)
    x, y = np.meshgrid((0.0, float(now.width)), (0.0, float(now.height)))
    pixels = np.stack((x.ravel(), y.ravel(), np.ones(4)), 1)  # (4, 3)
    rays = (pixels @ np.linalg.inv(lens).T)[None].repeat(2, 0)  # (2, 4, 3), of z = 1
    far = np.array(depths)[:, None]
    if now.orthographic:
        rays[..., 2] = far
    else:
        rays *= far[..., None]
    pos_c = np.concatenate((rays.reshape(-1, 3), np.ones((8, 1))), 1) @ (old @ np.linalg.inv(new)).T
    z = pos_c[:, 2]
    if (z < NEAR).any():
        return False
    seen = pos_c[:, :2] / (1 if now.orthographic else z[:, None]) @ old_lens[:2, :2].T + old_lens[:2, 2]
    sides = np.array((before.width, before.height))
    slack = margin + 1e-6  # of a camera that stands
    return bool((seen >= -slack * sides).all() and (seen <= (1 + slack) * sides).all())


def _around(places: Places, camera: Camera, margin: float) -> tuple[np.ndarray, np.ndarray]:
    """Rows (n,) uint32, ascending, that may touch the image or so many of its sides around it, and their
    depths (n,) float32."""
    rows, depths = [np.zeros(0, np.uint32)], [np.zeros(0, np.float32)]
    for some, inside, z in near_frustum(places.means, places.widest, camera, margin=margin):
        found = np.flatnonzero(inside & places.shown[some])
        rows.append((found + some.start).astype(np.uint32))
        depths.append(z[found])
    return np.concatenate(rows), np.concatenate(depths)


def _chosen(places: Places, camera: Camera) -> tuple[np.ndarray, np.ndarray]:
    """Rows (n,) uint32, ascending, that may touch the image, and their depths (n,) float64."""
    viewmat, _ = matrices(camera)
    row = viewmat[2]
    rows, depths = [np.zeros(0, np.uint32)], [np.zeros(0)]
    for first in range(0, len(places.widest), AT_ONCE):
        some = slice(first, first + AT_ONCE)
        across, down, along = places.means[:, some].astype(np.float64)
        z = across * row[0] + down * row[1] + along * row[2] + row[3]
        with np.errstate(over="ignore", invalid="ignore"):  # places beyond float32 are beside any image
            near = _may_touch(places.means[:, some], places.widest[some], z, camera)
        found = np.flatnonzero(near & places.shown[some])
        rows.append((found + first).astype(np.uint32))
        depths.append(z[found])
    return np.concatenate(rows), np.concatenate(depths)


def _may_touch(means: np.ndarray, widest: np.ndarray, z: np.ndarray, camera: Camera) -> np.ndarray:
    """(n,) bool, conservative: the Frobenius norm of the Jacobian bounds the footprint."""
    viewmat, K = matrices(camera)
    seen = z >= NEAR
    flat = camera.orthographic
    inverse = np.ones(len(z), np.float32) if flat else 1 / np.where(seen, z, 1.0).astype(np.float32)
    rounding = np.float32(1e-6 * np.abs(viewmat[:3, 3]).max())  # of places far from the origin
    deviations = np.sqrt(
        np.square((widest + rounding) * inverse) * np.float32(steepness(camera)) + np.float32(DILATION)
    )
    radius = np.float32(math.sqrt(2 * math.log(1 / ALPHA_MIN))) * deviations + np.float32(1)
    for axis, extent in enumerate((camera.width, camera.height)):
        pos_c = viewmat[axis, :3].astype(np.float32) @ means + np.float32(viewmat[axis, 3])
        place = pos_c * inverse * np.float32(K[axis, axis]) + np.float32(K[axis, 2])
        seen &= (place + radius > 0) & (place - radius < extent)
    return seen


def matrices(camera: Camera) -> tuple[np.ndarray, np.ndarray]:
    """World to camera (4, 4) and lens (3, 3), float64."""
    return camera.viewmat.detach().cpu().double().numpy(), camera.K.detach().cpu().double().numpy()


def lens(camera: Camera) -> dict[str, np.ndarray | int]:
    """The uniforms that shaders project by: `pinhole` (4,) fx fy cx cy, pixels, and `orthographic`."""
    _, K = matrices(camera)
    return {"pinhole": K[[0, 1, 0, 1], [0, 1, 2, 2]], "orthographic": int(camera.orthographic)}


def camera_key(camera: Camera) -> tuple:
    """Names all that pictures depend on."""
    pose, lens = (matrix.tobytes() for matrix in matrices(camera))
    light = None if camera.light is None else camera.light.cpu().numpy().tobytes()
    return pose, lens, camera.width, camera.height, camera.orthographic, light


def _places(means: Tensor, scales: Tensor) -> tuple[np.ndarray, np.ndarray]:
    """Means (3, N) and the largest scales (N,)."""
    return np.ascontiguousarray(means.numpy().T), scales.abs().amax(-1).numpy()
