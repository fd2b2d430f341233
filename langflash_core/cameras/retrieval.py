"""Which of many photos may show the same, without matching all with all. Imports no torch.

A photo is one vector: to each of some words, kinds of descriptors that were learned from the photos
themselves, the sum of what its descriptors differ from it by. Sizes: V photos, n descriptors of C numbers,
W words.
"""

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from jaxtyping import Float

ALL = 12
"""Photos up to which every pair is matched."""
_SIMILAR, _NEAR = 8, 3  # of each photo: the most similar others, the next in the order they were given
_WORDS, _SAMPLES, _ROUNDS = 64, 8000, 8


def likely_pairs(descriptors: Sequence[Float[np.ndarray, "_ C"]]) -> list[tuple[int, int]]:
    """Pairs i < j of photos, in order: all of a few; of many as many for each, those most alike and those
    that were given one after another.

    Args:
        descriptors: per photo (n, C), unit rows; n may be 0.
    """
    count = len(descriptors)
    if count <= ALL:
        return list(combinations(range(count), 2))
    vectors = _vectors(descriptors)
    alike = vectors @ vectors.T  # (V, V)
    np.fill_diagonal(alike, -np.inf)
    nearest = np.argsort(-alike, axis=1, kind="stable")[:, :_SIMILAR]
    pairs = {(min(i, j), max(i, j)) for i, row in enumerate(nearest.tolist()) for j in row}
    pairs |= {(i, j) for i in range(count) for j in range(i + 1, min(i + 1 + _NEAR, count))}
    return sorted(pairs)


def most_alike(descriptors: Sequence[Float[np.ndarray, "_ C"]], count: int) -> list[list[int]]:
    """Of each photo the `count` others most like it, in order; all where there are not so many.

    Args:
        descriptors: per photo (n, C), unit rows.
    """
    vectors = _vectors(descriptors)
    alike = vectors @ vectors.T
    np.fill_diagonal(alike, -np.inf)
    nearest = np.argsort(-alike, axis=1, kind="stable")[:, : min(count, len(vectors) - 1)]
    return [sorted(row) for row in nearest.tolist()]


def _vectors(descriptors: Sequence[np.ndarray]) -> np.ndarray:
    """Unit vectors (V, W C); 0 of a photo without descriptors.

    Source: VLAD (Jegou et al. 2010), words of equal weight as in Delhumeau et al. 2013.
    """
    words = _words(descriptors)
    found = np.zeros((len(descriptors), *words.shape), np.float32)
    for photo, rows in enumerate(descriptors):
        nearest = _nearest(rows, words)
        np.add.at(found[photo], nearest, rows - words[nearest])
    found /= np.maximum(np.linalg.norm(found, axis=2, keepdims=True), 1e-9)
    flat = found.reshape(len(found), -1)
    return flat / np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), 1e-9)


def _words(descriptors: Sequence[np.ndarray]) -> np.ndarray:
    """Means (W, C) of clusters, by Lloyd's rounds over evenly chosen descriptors; the same every time."""
    every = np.concatenate(descriptors)
    chosen = every[np.linspace(0, len(every) - 1, min(_SAMPLES, len(every))).astype(int)]
    if len(chosen) == 0:
        return np.zeros((1, every.shape[1]), np.float32)
    words = chosen[np.linspace(0, len(chosen) - 1, min(_WORDS, len(chosen))).astype(int)].copy()
    for _ in range(_ROUNDS):
        nearest = _nearest(chosen, words)
        for word in range(len(words)):
            own = chosen[nearest == word]
            if len(own):
                words[word] = own.mean(0)
    return words


def _nearest(rows: np.ndarray, words: np.ndarray) -> np.ndarray:
    """The word (n,) of each descriptor."""
    return (rows @ words.T - 0.5 * (words**2).sum(1)).argmax(1)
