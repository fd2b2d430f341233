"""Borders at the photo's size: maps made by hand."""

import math

import numpy as np
import pytest

from langflash_core.lab.evaluation.borders import (
    OTHER,
    UNKNOWN,
    border_f1,
    filled,
    right_near_borders,
)


def halves(column: int, *, shape: tuple[int, int] = (40, 60)) -> np.ndarray:
    """0 before a column, 1 from it on."""
    labels = np.zeros(shape, dtype=np.int64)
    labels[:, column:] = 1
    return labels


def test_borders_within_the_tolerance_are_right():
    truth = halves(30)
    assert border_f1(truth, truth) == 1
    assert border_f1(halves(34), truth) == 1  # columns 33, 34 against 29, 30: 4 pixels at most
    assert border_f1(halves(35), truth) == pytest.approx(0.5)  # one side of either is 4 off, one 5
    assert border_f1(halves(40), truth) == 0 and border_f1(halves(0), truth) == 0
    assert border_f1(1 - truth, truth) == 1  # whatever the names
    assert border_f1(halves(40), truth, tolerance=11) == 1


def test_half_of_the_found_borders_cost_precision_alone():
    found = halves(30)
    found[:, 50:] = 2
    assert border_f1(found, halves(30)) == pytest.approx(2 / 3)  # precision 1/2, recall 1


def test_bands_without_a_label_have_their_border_in_the_middle():
    truth = halves(30)
    truth[:, 25:35] = UNKNOWN
    assert (filled(truth) == halves(30)).all()
    assert border_f1(halves(30), truth) == 1
    assert right_near_borders(halves(30), truth) == (1.0, 1.0)


def test_what_nobody_labelled_has_no_border():
    truth = halves(30)
    truth[:, 20:45] = UNKNOWN
    assert math.isnan(border_f1(halves(30), truth))
    inside, outside = right_near_borders(halves(30), truth)
    assert math.isnan(inside) and outside == 1
    nothing = np.full((4, 5), UNKNOWN)
    assert math.isnan(border_f1(nothing, nothing)) and all(
        map(math.isnan, right_near_borders(nothing, nothing))
    )


def test_things_that_are_not_judged_have_borders_all_the_same():
    """A border beside them counts; what is found inside them does not."""
    truth = halves(30)
    truth[truth == 1] = OTHER
    found = halves(30)
    assert border_f1(found, truth) == 1
    found[:, 50:] = 2
    assert border_f1(found, truth) == 1
    assert right_near_borders(found, truth) == (1.0, 1.0)


def test_shares_near_borders_and_elsewhere():
    """Found 4 columns too far: of the 8 judged columns on either side 4 are wrong."""
    inside, outside = right_near_borders(halves(34), halves(30))
    assert inside == pytest.approx(1 - 4 / 18) and outside == 1  # distance 0 to 8 on both sides
