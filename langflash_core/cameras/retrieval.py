"""How alike photos look, without matching all with all. Imports no torch.

A photo is one vector: to each of some words, kinds of descriptors that were learned from the photos
themselves, the sum of what its descriptors differ from it by. Sizes: V photos, n descriptors of C numbers,
W words.
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from langflash_core.rig.pairs import Scores
from langflash_core.rig.settings import RETRIEVAL


def likeness(descriptors: Sequence[Float[np.ndarray, "_ C"]]) -> Scores:
    """How alike photos look, cosines (V, V); -inf of a photo with itself.

    Args:
        descriptors: per photo (n, C), unit rows; n may be 0.
    """
    vectors = _vectors(descriptors)
    alike = vectors @ vectors.T
    np.fill_diagonal(alike, -np.inf)
    return alike


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
    chosen = every[np.linspace(0, len(every) - 1, min(RETRIEVAL.samples, len(every))).astype(int)]
    if len(chosen) == 0:
        return np.zeros((1, every.shape[1]), np.float32)
    words = chosen[np.linspace(0, len(chosen) - 1, min(RETRIEVAL.words, len(chosen))).astype(int)].copy()
    for _ in range(RETRIEVAL.rounds):
        nearest = _nearest(chosen, words)
        for word in range(len(words)):
            own = chosen[nearest == word]
            if len(own):
                words[word] = own.mean(0)
    return words


def _nearest(rows: np.ndarray, words: np.ndarray) -> np.ndarray:
    """The word (n,) of each descriptor."""
    return (rows @ words.T - 0.5 * (words**2).sum(1)).argmax(1)
