"""Dense matches: cells find each other, their peaks are where the parabola says, blanks match nothing."""

import numpy as np
import pytest

from langflash_core.cameras.dense import match_cells


def _random_map(height: int, width: int, seed: int) -> np.ndarray:
    vectors = np.random.default_rng(seed).normal(size=(16, height, width))
    return (vectors / np.linalg.norm(vectors, axis=0)).astype(np.float32)


def test_a_shifted_picture_is_matched_cell_by_cell():
    wide = _random_map(9, 14, 0)
    left, right = wide[:, :, :11], wide[:, :, 3:]
    own, found = match_cells(left, right)
    inner = (found[:, 0] > 1) & (found[:, 0] < 10) & (found[:, 1] > 1) & (found[:, 1] < 8)
    assert inner.sum() >= 6 * 6
    # Random neighbours pull the peak by a fraction of a cell, never to another one.
    assert np.abs(own - [3, 0] - found).max() <= 0.5
    assert np.abs((own - [3, 0] - found)[inner]).mean() < 0.3


@pytest.mark.parametrize("shift", [-0.4, 0.0, 0.25])
def test_peaks_between_cells_are_found(shift):
    """Descriptors that turn steadily with x: the cosine is a parabola to second order."""

    def turning(offset: float) -> np.ndarray:
        angles = 0.15 * (np.arange(7) + offset)
        rows = np.arange(5)[:, None] * 0.9
        planes = [np.cos(angles) + 0 * rows, np.sin(angles) + 0 * rows, np.cos(rows) + 0 * angles]
        vectors = np.stack([*planes, np.sin(rows) + 0 * angles])
        return vectors / np.linalg.norm(vectors, axis=0)

    own, found = match_cells(turning(shift), turning(0.0))
    inner = (own > 1).all(1) & (own < [6, 4]).all(1)
    # A cosine of 0.15 radians a cell differs from its parabola by less than 0.15^2 / 12 of a cell.
    np.testing.assert_allclose((found - own)[inner, 0], shift, atol=0.01)


def test_different_pictures_share_nothing():
    own, found = match_cells(_random_map(6, 8, 1), _random_map(6, 8, 2))
    assert len(own) == len(found) <= 1
    blank = np.zeros((16, 6, 8), np.float32)
    assert len(match_cells(blank, blank)[0]) == 0
