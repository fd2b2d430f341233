"""Few values that stand for many: scalar codebooks and palettes of vectors, by k-means.

The result is the same in every run: starts are spread over the sorted data, and the steps are Lloyd's, for
palettes on an even sample: on all vectors each would cost as much as the last search for all their nearest.
Source: Lloyd, "Least squares quantization in PCM", 1982.
"""

import numpy as np
import torch

from langflash_core.export.settings import CODEBOOKS


def scalar_codebook(values: np.ndarray, size: int) -> tuple[np.ndarray, np.ndarray]:
    """At most `size` sorted values, float32, and for each of `values` (any shape) the nearest's index.

    Half of them start at even ranks, half at even values, so that neither dense nor rare ones suffer.
    """
    ordered = np.sort(values.astype(np.float64), axis=None)
    distinct = np.unique(ordered)
    if len(distinct) <= size:
        book = distinct
    else:
        sums = np.concatenate(([0.0], np.cumsum(ordered)))
        ranks = ordered[np.linspace(0, len(ordered) - 1, size - size // 2).astype(int)]
        book = np.unique(np.concatenate((ranks, np.linspace(ordered[0], ordered[-1], size // 2))))
        for _ in range(CODEBOOKS.scalar_steps):
            ends = np.searchsorted(ordered, (book[1:] + book[:-1]) / 2)
            starts, ends = np.concatenate(([0], ends)), np.concatenate((ends, [len(ordered)]))
            filled = ends > starts
            book = book[filled]
            book = (sums[ends[filled]] - sums[starts[filled]]) / (ends - starts)[filled]
    places = np.searchsorted((book[1:] + book[:-1]) / 2, values.astype(np.float64))
    return book.astype(np.float32), places


def palette(vectors: np.ndarray, size: int) -> tuple[np.ndarray, np.ndarray]:
    """At most `size` vectors (k, d) float32, and for each of `vectors` (n, d) the nearest's index (n,)."""
    distinct, places = np.unique(vectors.astype(np.float32), axis=0, return_inverse=True)
    if len(distinct) <= size:
        return distinct, places.reshape(-1)
    points = torch.from_numpy(np.ascontiguousarray(vectors, np.float32))
    centres = torch.from_numpy(distinct[np.linspace(0, len(distinct) - 1, size).astype(int)])
    sample = points[:: max(1, len(points) // (CODEBOOKS.sample * size))]
    for _ in range(CODEBOOKS.vector_steps):
        nearest = _nearest(sample, centres)
        sums = torch.zeros_like(centres).index_add_(0, nearest, sample)
        counts = torch.bincount(nearest, minlength=len(centres))
        centres = torch.where(counts[:, None] > 0, sums / counts.clamp_min(1)[:, None], centres)
    return centres.numpy(), _nearest(points, centres).numpy()


def _nearest(points: torch.Tensor, centres: torch.Tensor) -> torch.Tensor:
    """The nearest centre (n,) of points (n, d): |c|^2 - 2 p c is smallest where |p - c|^2 is. Of few numbers
    each (harmonics of degree 1) a tree finds it: a palette of 8,192 in 4 seconds instead of 11.

    Distances share one buffer: made anew for each part, they left gigabytes of holes between small results.
    """
    if points.shape[1] <= CODEBOOKS.few and bool(points.isfinite().all()):  # a tree refuses what is no number
        from scipy.spatial import KDTree  # a quarter of a second, which a question has not to wait for

        return torch.from_numpy(KDTree(centres.numpy()).query(points.numpy())[1])
    norms = (centres**2).sum(1)
    step = max(1, CODEBOOKS.pairs_at_once // len(centres))
    distances, nearest = torch.empty(step, len(centres)), torch.empty(len(points), dtype=torch.long)
    for part, found in zip(points.split(step), nearest.split(step), strict=True):
        torch.addmm(norms, part, centres.T, alpha=-2, out=distances[: len(part)])
        np.argmin(distances[: len(part)].numpy(), 1, out=found.numpy())  # torch's takes 10 times as long
    return nearest
