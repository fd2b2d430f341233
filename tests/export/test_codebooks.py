"""Nearest vectors of a palette, by a tree and by products, against float64."""

import numpy as np
import pytest
import torch

from langflash_core.export.codebooks import palette


@pytest.mark.parametrize("numbers", [9, 24])
def test_each_vector_has_the_nearest_entry(numbers):
    """Nine numbers are harmonics of degree 1, 24 those of degree 2. Distances of float32 products are off by
    1e-6 of |p|^2, here 50 at most, so that much farther another entry may be."""
    vectors = np.random.default_rng(0).normal(size=(3000, numbers)).astype(np.float32)
    entries, labels = palette(vectors, 200)
    squares = ((vectors[:, None].astype(float) - entries) ** 2).sum(-1)
    chosen = squares[np.arange(3000), labels]
    assert len(entries) == 200 and (chosen <= squares.min(1) + 1e-4).all()
    # Lloyd's steps only lessen it: nearer than even picks of the vectors, from which they begin.
    begun = np.unique(vectors, axis=0)[np.linspace(0, 2999, 200).astype(int)]
    assert chosen.mean() < ((vectors[:, None].astype(float) - begun) ** 2).sum(-1).min(1).mean()


def test_the_same_in_every_run():
    vectors = np.random.default_rng(1).normal(size=(2000, 9)).astype(np.float32)
    (one, first), (two, second) = palette(vectors, 64), palette(vectors.copy(), 64)
    assert np.array_equal(one, two) and np.array_equal(first, second)
    assert torch.from_numpy(one).isfinite().all()
