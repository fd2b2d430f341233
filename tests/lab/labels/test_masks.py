"""Which masks are the same, which are parts, and how they become one map."""

import numpy as np

from langflash_core.lab.labels.masks import (
    cleaned,
    painted,
    shared,
    split_ids,
    without_gaps,
    without_parts,
    without_repeats,
)
from langflash_core.lab.labels.protocols import Proposals


def box(top: int, left: int, bottom: int, right: int, size=(64, 64)) -> np.ndarray:
    mask = np.zeros(size, bool)
    mask[top:bottom, left:right] = True
    return mask


def test_shares_are_those_of_a_plain_count():
    rng = np.random.default_rng(0)
    a, b = rng.random((3, 50, 70)) > 0.5, rng.random((2, 50, 70)) > 0.3
    iou, within = shared(a, b)
    for n in range(3):
        for m in range(2):
            both, either = (a[n] & b[m]).sum(), (a[n] | b[m]).sum()
            assert abs(iou[n, m] - both / either) < 1e-6
            assert abs(within[n, m] - both / a[n].sum()) < 1e-6


def test_of_repetitions_the_best_stays():
    masks = np.stack([box(0, 0, 30, 30), box(0, 0, 30, 31), box(40, 40, 60, 60)])
    kept = without_repeats(Proposals(masks, np.array([0.8, 0.9, 0.5])))
    assert kept.scores.tolist() == [0.9, 0.5]


def test_parts_go_but_not_what_stands_before_a_wall():
    whole, part, wall = box(0, 0, 20, 20), box(0, 0, 20, 8), box(0, 0, 64, 64)
    kept = without_parts(Proposals(np.stack([whole, part, wall]), np.array([0.9, 0.99, 0.9])))
    assert len(kept) == 2 and not any(np.array_equal(mask, part) for mask in kept.masks)


def test_crumbs_and_small_holes_are_cleaned_and_clean_masks_stay():
    mask = box(10, 10, 50, 50)
    dirty = mask.copy()
    dirty[0:2, 0:2], dirty[30:33, 30:33] = True, False
    assert np.array_equal(cleaned(dirty), mask) and np.array_equal(cleaned(mask), mask)
    assert not cleaned(np.zeros((8, 8), bool)).any()


def test_what_lies_on_a_thing_shows_in_the_map():
    ids = painted(np.stack([box(5, 5, 10, 10), box(0, 0, 40, 40)]), np.array([7, 9]), (64, 64))
    assert ids[7, 7] == 7 and ids[0, 0] == 9 and ids[50, 50] == 0
    numbers, masks = split_ids(ids)
    assert numbers.tolist() == [7, 9] and masks[0].sum() == 25
    assert painted(np.zeros((0, 4, 4), bool), np.zeros(0), (4, 4)).max() == 0


def test_seams_are_given_to_their_neighbours_and_wide_gaps_are_not():
    ids = np.zeros((40, 40), np.uint16)
    ids[:, :18], ids[:, 21:30] = 1, 2
    filled = without_gaps(ids)
    assert (filled[:, 18] == 1).all() and (filled[:, 20] == 2).all()
    assert (filled[:, 30:] == 0).all()
    empty = np.zeros((5, 5), np.uint16)
    assert without_gaps(empty).max() == 0
