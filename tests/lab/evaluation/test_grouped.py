"""How well found regions follow true ones, on maps whose answer is known."""

import numpy as np
import pytest

from langflash_core.lab.evaluation.borders import UNKNOWN
from langflash_core.lab.evaluation.grouped import score


@pytest.fixture
def halves() -> np.ndarray:
    truth = np.zeros((60, 80), np.int64)
    truth[:, 40:] = 1
    return truth


def test_the_truth_itself_is_perfect_whatever_its_numbers_are(halves):
    found = score(7 - 3 * halves, halves)
    assert (found.best_iou, found.recall, found.achievable, found.border_f1, found.count) == (1, 1, 1, 1, 2)


def test_one_region_for_all_is_half_right(halves):
    found = score(np.zeros_like(halves), halves)
    assert (found.best_iou, found.recall, found.achievable, found.border_f1) == (0.5, 0, 0.5, 0)


def test_parts_of_things_cost_iou_and_borders_but_could_be_named_right(halves):
    found = score(np.arange(80)[None] // 20 + np.zeros_like(halves), halves)
    assert (found.best_iou, found.achievable, found.count) == (0.5, 1, 4)
    assert found.border_f1 == pytest.approx(0.5)  # one border of three is true: precision 1/3, recall 1


def test_what_nobody_outlined_is_not_judged(halves):
    truth = halves.copy()
    truth[:, 60:] = UNKNOWN
    found = halves.copy()
    found[:, 70:] = 5
    assert (score(found, truth).best_iou, score(found, truth).achievable) == (1, 1)


def test_regions_too_small_are_not_judged(halves):
    truth = halves.copy()
    truth[0, 0] = 2
    assert score(halves, truth).recall == 1
