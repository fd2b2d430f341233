"""What every Gaussian contributes to every pixel of one view, as a sparse matrix: made once, used many
times.

A picture is linear in its colours: with c_ip = T_i(p) alpha_i(p), F(p) = sum_i c_ip f_i. `mixing` lists
the c_ip of a view as a matrix (pixels, Gaussians), so that drawing with other colours, and carrying what
is wrong in a picture back to the Gaussians, are products with it and its transpose.

Pairs of a Gaussian and a pixel are made front to back for a slab of Gaussians at once and turned into rows
by pixel by counting, which keeps their order. What lies wholly behind pixels that let nothing pass any more
is not looked at. float32. Twin: `reference.rasterize`, tests/splat/test_mixing.py.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import scipy.sparse
from jaxtyping import Bool

from langflash_core.splat.projection import ALPHA_MAX, Footprints
from langflash_core.splat.settings import MIXING
from langflash_core.types import Camera


def mixing(
    footprints: Footprints,
    camera: Camera,
    count: int,
    faint: float = MIXING.faint,
    small: float = MIXING.small,
    wanted: Bool[np.ndarray, "H W"] | None = None,
) -> scipy.sparse.csr_matrix:
    """Contributions (H*W, N) float32 of N Gaussians to the pixels of a view, row by row, front to back.

    Args:
        footprints: of the Gaussians as the camera sees them. count: N.
        faint, small: alpha and contribution below which a pair is left out; 1/255 and 0 as in pictures.
        wanted: (H, W) bool, pixels whose rows are asked for, the others' are empty; None: all.
    """
    table = _Table.of(footprints, camera, faint)
    light = np.zeros(camera.width * camera.height)  # logarithm of what passes all slabs so far
    if wanted is not None:
        light[~wanted.ravel()] = -np.inf
    layers = []
    for rows in np.array_split(np.arange(len(table.sides)), _slabs(len(table.sides))):
        clear = light >= math.log(max(small, 1e-30)) if wanted is not None or (small > 0 and layers) else None
        if clear is not None:
            rows = rows[table.seen(rows, clear.reshape(camera.height, camera.width))]
        alphas, pixels, starts = _pairs(table, rows, camera, faint, clear)
        by_depth = scipy.sparse.csc_array((alphas, pixels, starts), shape=(len(light), len(rows)))
        by_pixel = by_depth.tocsr()  # columns of a row ascend: front to back
        shares, columns, counts = _composite(by_pixel, small, light)
        layers.append((shares, rows[columns], counts))
    shares, columns, ends = _join_slabs(layers)
    ids = footprints.ids.cpu().numpy().astype(np.int32)
    return scipy.sparse.csr_matrix((shares, ids[columns], ends), shape=(len(light), count))


def _slabs(count: int) -> int:
    """How many slabs are gone through: of few Gaussians one."""
    return min(max(count // MIXING.least_slab, 1), MIXING.slabs)


def _join_slabs(
    layers: Sequence[tuple[np.ndarray, np.ndarray, np.ndarray]],
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rows of slabs one behind the other: shares, columns, and where each pixel's begin.

    layers: shares, columns and how many of each pixel, slab by slab."""
    if len(layers) == 1:
        shares, columns, counts = layers[0]
        return shares, columns, np.concatenate(([0], np.cumsum(counts)))
    ends = np.concatenate(([0], np.cumsum(np.sum([counts for *_, counts in layers], axis=0))))
    shares, columns = np.empty(ends[-1], np.float32), np.empty(ends[-1], np.int64)
    begins = ends[:-1].copy()
    for own_shares, own_columns, counts in layers:
        places = np.arange(len(own_shares)) + np.repeat(begins - (np.cumsum(counts) - counts), counts)
        shares[places], columns[places] = own_shares, own_columns
        begins += counts
    return shares, columns, ends


def _pairs(
    table: "_Table", rows: np.ndarray, camera: Camera, faint: float, clear: np.ndarray | None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Alphas and pixels of all pairs (M,) of some footprints (n,), one by one, and where each begins
    (n + 1,); of pixels (H W,) that are `clear`."""
    counts, found = np.zeros(len(rows), np.int64), []
    for places in table.alike(rows):
        step = max(1, MIXING.at_once // int(table.sides[rows[places[0]]]) ** 2)
        for some in np.split(places, range(step, len(places), step)):
            kept, alphas, pixels = table.pairs(rows[some], camera, faint, clear)
            counts[some] = kept
            found.append((some, alphas, pixels))
    starts = np.concatenate(([0], np.cumsum(counts)))
    alphas, pixels = np.empty(starts[-1], np.float32), np.empty(starts[-1], np.int32)
    for some, own_alphas, own_pixels in found:
        own = counts[some]
        places = np.arange(len(own_alphas)) + np.repeat(starts[some] - (np.cumsum(own) - own), own)
        alphas[places], pixels[places] = own_alphas, own_pixels
    return alphas, pixels, starts


@dataclass(frozen=True)
class _Table:
    """Of n footprints: corner (n, 2) int32 pixels and side (n,) of a square that holds each, its centre seen
    from that corner's pixel (n, 2), inverse roots (n, 3) 1 / l11, l21 / l22, 1 / l22, opacity, float32."""

    corners: np.ndarray
    sides: np.ndarray
    centres: np.ndarray
    inverse: np.ndarray
    opacities: np.ndarray

    @staticmethod
    def of(footprints: Footprints, camera: Camera, faint: float) -> "_Table":
        opacities = footprints.opacities.cpu().numpy().astype(np.float32)
        centres, roots = (v.cpu().numpy() for v in (footprints.centres, footprints.roots))
        radii = np.sqrt(2 * np.log(np.maximum(opacities / faint, 1)))
        half = np.maximum(roots[:, 0], np.hypot(roots[:, 1], roots[:, 2])) * radii
        low = np.floor(centres - half[:, None] - 0.5)
        sides = np.ceil(2 * half).astype(np.int64) + 2
        size = np.array([camera.width, camera.height])
        # Of large ones, what lies in the picture: a surface that another photo has close before its lens.
        wide = sides > MIXING.wide
        low = np.clip(np.where(wide[:, None], np.maximum(low, 0), low), -MIXING.wide, 2 * size.max())
        within = (np.minimum(low + sides[:, None], size) - low).max(1).astype(np.int64)
        sides = np.where(wide, np.maximum(within, 1), sides)
        classes = np.array([*range(4, 17), 20, 24, 32, 48, 64, 96, MIXING.wide, 192, 256, 384, 512, 768])
        classes = np.append(classes, max(1024, size.max()))
        inverse = np.stack((1 / roots[:, 0], roots[:, 1] / roots[:, 2], 1 / roots[:, 2]), -1)
        return _Table(
            low.astype(np.int32), classes[np.searchsorted(classes, sides)],
            (centres - low - 0.5).astype(np.float32), inverse.astype(np.float32), opacities,
        )  # fmt: skip

    def alike(self, rows: np.ndarray) -> list[np.ndarray]:
        """Places among some rows of those that have the same side."""
        sides = self.sides[rows]
        order = np.argsort(sides, kind="stable")
        return np.split(order, np.flatnonzero(np.diff(sides[order])) + 1) if len(order) else []

    def seen(self, rows: np.ndarray, clear: np.ndarray) -> np.ndarray:
        """(n,) bool: the square of each row may hold a pixel that is `clear`, (H, W) bool."""
        found, sides = np.ones(len(rows), bool), self.sides[rows]
        for cell in MIXING.cells:
            some = np.flatnonzero((sides <= cell) & (sides > cell // 2))
            if len(some) == 0:
                continue
            # Of cells as large as a square, it touches two by two at most; one more on all sides.
            high, wide = (-(-size // cell) for size in clear.shape)
            cells = np.zeros((high * cell, wide * cell), bool)
            cells[: clear.shape[0], : clear.shape[1]] = clear
            grid = np.zeros((high + 3, wide + 3), bool)
            grid[1:-2, 1:-2] = cells.reshape(high, cell, wide, cell).any((1, 3))
            touched = grid[:-1, :-1] | grid[1:, :-1] | grid[:-1, 1:] | grid[1:, 1:]
            x, y = (np.clip(self.corners[rows[some]] // cell, -1, (wide, high)) + 1).T
            found[some] = touched[y, x]
        return found

    def pairs(
        self, rows: np.ndarray, camera: Camera, faint: float, clear: np.ndarray | None
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """How many pixels of each row (n,) are kept, and the alphas and pixels of these."""
        side, corners = int(self.sides[rows[0]]), self.corners[rows]
        along = np.arange(side, dtype=np.float32)
        u = (along - self.centres[rows, :1]) * self.inverse[rows, :1]  # (n, side)
        v = (along - self.centres[rows, 1:]) * self.inverse[rows, 2:]
        across = v[:, :, None] - (u * self.inverse[rows, 1:2])[:, None]  # (n, rows, columns)
        np.square(across, out=across)
        across += np.square(u)[:, None]
        across *= -0.5
        np.exp(across, out=across)
        across *= self.opacities[rows, None, None]
        kept = across >= faint
        columns, lines = corners[:, 0], corners[:, 1]
        if not _inside(columns, side, camera.width) or not _inside(lines, side, camera.height):
            span = np.arange(side, dtype=np.int32)
            kept &= _between(lines[:, None] + span, camera.height)[:, :, None]
            kept &= _between(columns[:, None] + span, camera.width)[:, None]
        found = np.flatnonzero(kept)
        which = found // (side * side)
        offsets = (np.arange(side)[:, None] * camera.width + np.arange(side)).ravel()
        pixels = (lines * np.int64(camera.width) + columns)[which] + offsets[found - which * (side * side)]
        if clear is not None:
            open_ones = np.flatnonzero(clear[pixels])
            found, which, pixels = found[open_ones], which[open_ones], pixels[open_ones]
        alphas = np.minimum(across.ravel()[found], np.float32(ALPHA_MAX))
        return np.bincount(which, minlength=len(rows)), alphas, pixels.astype(np.int32)


def _inside(first: np.ndarray, side: int, size: int) -> bool:
    return bool(len(first)) and int(first.min()) >= 0 and int(first.max()) + side <= size


def _between(places: np.ndarray, size: int) -> np.ndarray:
    return (places >= 0) & (places < size)


def _composite(
    rows: scipy.sparse.csr_array, small: float, light: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """T alpha of alphas sorted by pixel and depth, their columns, and how many each pixel has; those below
    `small` left out. `light`: (H W,) log T before them, and behind them afterwards. Some pixels at a time, so
    that what is made on the way stays within a core's cache."""
    starts = rows.indptr
    cuts = np.searchsorted(starts, np.arange(0, starts[-1], MIXING.at_once // 4))
    bounds = np.unique(np.concatenate((cuts, [0, len(starts) - 1])))
    shares, columns, counts = [], [], []
    for first, last in pairwise(bounds):
        some = slice(starts[first], starts[last])
        alphas, own = rows.data[some], np.diff(starts[first : last + 1])
        sums = np.concatenate(([0.0], np.cumsum(np.log(1 - alphas), dtype=np.float64)))
        places = starts[first : last + 1] - starts[first]
        at_start = sums[places[:-1]] - light[first:last]
        found = alphas * np.exp((sums[:-1] - np.repeat(at_start, own)).astype(np.float32))
        light[first:last] = sums[places[1:]] - at_start
        kept = np.flatnonzero(found >= small)
        shares.append(found[kept])
        columns.append(rows.indices[some][kept])
        counts.append(np.bincount(np.repeat(np.arange(len(own)), own)[kept], minlength=len(own)))
    return np.concatenate(shares), np.concatenate(columns), np.concatenate(counts)
