"""Labels of two views of one wall: the same names agree, other names do not, hidden surfaces do not count."""

import math

import numpy as np

from langflash_core.lab.evaluation.consistency import label_consistency

SIDE = 40
K = np.array([[40.0, 0, SIDE / 2], [0, 40.0, SIDE / 2], [0, 0, 1]])


def two_views(shift: int):
    """A wall 2 m away seen by cameras `shift` pixels of it apart."""
    depths = np.full((2, SIDE, SIDE), 2.0)
    viewmats = np.stack([np.eye(4), np.eye(4)])
    viewmats[1, 0, 3] = -shift * 2.0 / 40
    wide = np.arange(SIDE + shift)[None, :].repeat(SIDE, 0) // 5
    labels = np.stack([wide[:, :SIDE], wide[:, shift:]])
    return labels, depths, viewmats, np.stack([K, K])


def test_a_wall_painted_alike_is_consistent():
    assert label_consistency(*two_views(10)) == 1


def test_half_of_it_renamed_is_half_consistent():
    labels, depths, viewmats, Ks = two_views(0)
    labels[1, : SIDE // 2] = 99
    assert label_consistency(labels, depths, viewmats, Ks) == 0.5


def test_hidden_unlabelled_and_unseen_pixels_do_not_count():
    labels, depths, viewmats, Ks = two_views(10)
    depths[1, :10] = 1.0  # something in front
    labels[1, :10] = 99
    labels[0, 10:20] = -1
    assert label_consistency(labels, depths, viewmats, Ks) == 1
    assert math.isnan(label_consistency(labels[:1], depths[:1], viewmats[:1], Ks[:1]))
    assert math.isnan(label_consistency(labels, depths * 0, viewmats, Ks))
