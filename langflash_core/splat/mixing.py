"""What every Gaussian contributes to every pixel of one view, as a sparse matrix: made once, used many
times.

A picture is linear in its colours: with c_ip = T_i(p) alpha_i(p), F(p) = sum_i c_ip f_i. `mixing` lists
the c_ip of a view as a matrix (pixels, Gaussians), so that drawing with other colours, and carrying what
is wrong in a picture back to the Gaussians, are products with it and its transpose.

Pairs of a Gaussian and a pixel are made front to back for all Gaussians at once and turned into rows by
pixel by counting, which keeps their order. float32. Twin: `reference.rasterize`,
tests/splat/test_mixing.py.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import scipy.sparse

from langflash_core.splat.projection import ALPHA_MAX, Footprints
from langflash_core.types import Camera

FAINT, SMALL = 1 / 64, 0.01
"""Alpha, and contribution, below which a pair is left out here: footprints end at 2.9 deviations instead of
3.3, and two thirds of all pairs go, 2 % of the light. Solved with and without them, pictures differ by 0.1 dB
where they are 32 dB from a photo."""
_WIDE = 128  # pixels, a side from which footprints are cut to the picture
_AT_ONCE = 1 << 18  # pairs in work at once: within a core's cache


def mixing(
    footprints: Footprints, camera: Camera, count: int, faint: float = FAINT, small: float = SMALL
) -> scipy.sparse.csr_matrix:
    """Contributions (H*W, N) float32 of N Gaussians to the pixels of a view, row by row.

    Args:
        footprints: of the Gaussians as the camera sees them. count: N.
        faint, small: alpha and contribution below which a pair is left out; 1/255 and 0 as in pictures.
    """
    alphas, pixels, starts = _pairs(footprints, camera, faint)
    num_pixels = camera.width * camera.height
    by_depth = scipy.sparse.csc_array((alphas, pixels, starts), shape=(num_pixels, len(starts) - 1))
    rows = by_depth.tocsr()  # columns of a row ascend: front to back
    shares, columns, ends = _composited(rows, small)
    ids = footprints.ids.cpu().numpy().astype(np.int32)
    return scipy.sparse.csr_matrix((shares, ids[columns], ends), shape=(num_pixels, count))


def _pairs(footprints: Footprints, camera: Camera, faint: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Alphas and pixels of all pairs (M,), footprint by footprint, and where each begins (n + 1,)."""
    table = _Table.of(footprints, camera, faint)
    counts, found = np.zeros(len(table.sides), np.int64), []
    for rows in table.alike():
        step = max(1, _AT_ONCE // int(table.sides[rows[0]]) ** 2)
        for some in np.split(rows, range(step, len(rows), step)):
            kept, alphas, pixels = table.pairs(some, camera, faint)
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
        wide = sides > _WIDE
        low = np.clip(np.where(wide[:, None], np.maximum(low, 0), low), -_WIDE, 2 * size.max())
        within = (np.minimum(low + sides[:, None], size) - low).max(1).astype(np.int64)
        sides = np.where(wide, np.maximum(within, 1), sides)
        classes = np.array([*range(4, 17), 20, 24, 32, 48, 64, 96, _WIDE, 192, 256, 384, 512, 768])
        classes = np.append(classes, max(1024, size.max()))
        inverse = np.stack((1 / roots[:, 0], roots[:, 1] / roots[:, 2], 1 / roots[:, 2]), -1)
        return _Table(
            low.astype(np.int32), classes[np.searchsorted(classes, sides)],
            (centres - low - 0.5).astype(np.float32), inverse.astype(np.float32), opacities,
        )  # fmt: skip

    def alike(self) -> list[np.ndarray]:
        """Rows of the same side."""
        order = np.argsort(self.sides, kind="stable")
        return np.split(order, np.flatnonzero(np.diff(self.sides[order])) + 1) if len(order) else []

    def pairs(
        self, rows: np.ndarray, camera: Camera, faint: float
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
        alphas = np.minimum(across.ravel()[found], np.float32(ALPHA_MAX))
        return np.bincount(which, minlength=len(rows)), alphas, pixels.astype(np.int32)


def _inside(first: np.ndarray, side: int, size: int) -> bool:
    return bool(len(first)) and int(first.min()) >= 0 and int(first.max()) + side <= size


def _between(places: np.ndarray, size: int) -> np.ndarray:
    return (places >= 0) & (places < size)


def _composited(rows: scipy.sparse.csr_array, small: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """T alpha of alphas sorted by pixel and depth, their columns, and where each pixel's begin; those below
    `small` left out. Some pixels at a time, so that what is made on the way stays within a core's cache."""
    starts = rows.indptr
    cuts = np.searchsorted(starts, np.arange(0, starts[-1], _AT_ONCE // 4))
    bounds = np.unique(np.concatenate((cuts, [0, len(starts) - 1])))
    shares, columns, counts = [], [], []
    for first, last in pairwise(bounds):
        some = slice(starts[first], starts[last])
        alphas, own = rows.data[some], np.diff(starts[first : last + 1])
        logs = np.log(1 - alphas)
        before = np.cumsum(logs, dtype=np.float64) - logs
        places = np.minimum(starts[first:last] - starts[first], max(len(before) - 1, 0))
        at_start = before[places] if len(before) else np.zeros(len(own))
        found = alphas * np.exp((before - np.repeat(at_start, own)).astype(np.float32))
        kept = np.flatnonzero(found >= small)
        shares.append(found[kept])
        columns.append(rows.indices[some][kept])
        counts.append(np.bincount(np.repeat(np.arange(len(own)), own)[kept], minlength=len(own)))
    ends = np.concatenate(([0], np.cumsum(np.concatenate(counts))))
    return np.concatenate(shares), np.concatenate(columns), ends
