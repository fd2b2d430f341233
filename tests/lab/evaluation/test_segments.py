"""Segments: what is perfect is 1, names of segments do not matter, and hand-made cases have their numbers."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from langflash_core.lab.evaluation import segments
from langflash_core.lab.evaluation.segments import Panoptic

ROWS = np.array([[0, 0, 1, 1], [0, 0, 1, 1], [2, 2, 2, 3]])


def quality(found, truth, found_classes=None, true_classes=None) -> Panoptic:
    one = dict.fromkeys(range(-1, 50), 0)
    return segments.panoptic(found, truth, found_classes or one, true_classes or one)


@given(st.integers(0, 2**32 - 1), st.integers(1, 6))
@settings(max_examples=30, deadline=None)
def test_the_truth_is_perfect_however_its_segments_are_numbered(seed: int, count: int):
    generator = np.random.default_rng(seed)
    truth = generator.integers(-1, count, (9, 7))
    numbers = generator.permutation(count) + 7
    classes = {i: int(i) % 2 for i in range(count)}
    found = np.where(truth >= 0, numbers[truth.clip(0)], -1)
    told = segments.panoptic(found, truth, {int(numbers[i]): classes[i] for i in range(count)}, classes)
    expected = 1.0 if (truth >= 0).any() else math.nan
    assert told.mean() == pytest.approx(expected, nan_ok=True)
    assert segments.instance_iou(found, truth) == pytest.approx(expected, nan_ok=True)


def test_a_thing_cut_in_half_is_a_miss_and_two_false_alarms():
    truth = np.zeros((4, 8), dtype=np.int64)
    found = truth.copy()
    found[:, 4:] = 1  # each half has an IoU of exactly .5, which is no pair
    told = quality(found, truth)
    assert told.mean() == 0 and told.classes[0].misses == 1 and told.classes[0].false_alarms == 2
    assert segments.instance_iou(found, truth) == 0.5


def test_a_wrong_class_is_no_pair():
    told = segments.panoptic(ROWS, ROWS, {0: 5, 1: 1, 2: 2, 3: 3}, {0: 0, 1: 1, 2: 2, 3: 3})
    # Classes 1, 2, 3 are perfect, class 0 was missed and class 5 said where it is not.
    assert told.mean() == pytest.approx(3 / 5) and told.mean("recognition") == pytest.approx(3 / 5)
    assert told.classes[0].misses == 1 and told.classes[5].false_alarms == 1


def test_a_thing_of_one_pixel_counts_like_any_other():
    found = ROWS.copy()
    found[2, 3] = 2
    told = quality(found, ROWS)
    # Three pairs (1, 1, 3 / 4) and one miss: PQ = 2.75 / 3.5.
    assert told.mean() == pytest.approx(2.75 / 3.5)
    assert segments.instance_iou(found, ROWS) == pytest.approx((1 + 1 + 0.75 + 0.25) / 4)
    assert segments.instance_iou(found, ROWS, smallest=2) == pytest.approx(2.75 / 3)


def test_what_nobody_labelled_counts_for_nothing():
    truth = ROWS.copy()
    truth[2] = -1
    found = ROWS.copy()
    found[2] = [0, 7, 7, 7]  # runs over the edge, and invents something there
    assert quality(found, truth).mean() == 1
    assert segments.instance_iou(found, truth) == 1


def test_nothing_is_nan():
    nothing = np.full((3, 3), -1)
    assert math.isnan(quality(nothing, nothing).mean())
    assert math.isnan(segments.instance_iou(ROWS, np.full(ROWS.shape, -1)))
    assert segments.instance_iou(np.full(ROWS.shape, -1), ROWS) == 0
    assert math.isnan(segments.label_border_f(ROWS, np.full(ROWS.shape, -1)))
    assert math.isnan(segments.border_f(np.ones((5, 5), dtype=bool), np.ones((5, 5), dtype=bool)))


def test_an_edge_of_knowledge_is_no_border():
    """Half and half, wrong by 24 columns; with every twentieth pixel unknown it is as wrong as before."""
    truth = np.zeros((96, 128), np.int64)
    truth[:, 64:] = 1
    found = np.zeros_like(truth)
    found[:, 88:] = 1
    assert segments.label_border_f(found, truth) == 0
    truth[np.random.default_rng(0).random(truth.shape) < 0.05] = -1
    assert segments.label_border_f(found, truth) == 0
    full = np.zeros_like(truth)
    full[:, 64:] = 1
    assert segments.label_border_f(full, truth) == 1


def test_pictures_add_up():
    one, other = quality(ROWS, ROWS), quality(np.zeros_like(ROWS), ROWS)
    both = one + other
    assert both.classes[0].pairs == 4 and both.classes[0].misses == 4
    assert both.classes[0].quality == pytest.approx(4 / (4 + 5 / 2))


def test_borders_within_the_tolerance_are_right():
    truth = np.zeros((100, 100), dtype=bool)
    truth[:, :50] = True
    assert segments.border_f(truth, truth) == 1
    near = np.roll(truth, 2, axis=1)  # the tolerance is 2 pixels of a diagonal of 141
    near[:, :5] = True
    assert segments.border_f(near, truth) == 1
    far = truth.copy()
    far[:, 50:60] = True
    assert segments.border_f(far, truth) == 0
    assert segments.border_f(np.zeros_like(truth), truth) == 0


def test_borders_of_labels_are_the_mean_of_their_masks():
    labels = np.zeros((60, 60), dtype=np.int64)
    labels[:, 30:] = 1
    assert segments.label_border_f(labels, labels) == 1
    assert segments.label_border_f(1 - labels, labels) == pytest.approx(1)  # the border is the same
    assert segments.label_border_f(np.zeros_like(labels), labels) == 0
