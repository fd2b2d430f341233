"""Measures on hand-made cases with known answers."""

import math

import pytest
import torch

from langflash_core.lab.training import measures


def test_depth_measures_of_a_scaled_truth():
    truth = torch.tensor([[1.0, 2.0, 0.0], [4.0, 8.0, 2.0]])
    depths = truth * 3
    assert measures.abs_rel(depths, truth) == pytest.approx(2.0)
    aligned = measures.align_scale(depths, truth)
    assert measures.abs_rel(aligned, truth) == pytest.approx(0, abs=1e-6)
    assert measures.delta1(aligned, truth) == 1
    assert measures.delta1(truth * 1.3, truth) == 0


def test_nothing_to_measure_is_nan():
    empty = torch.zeros(2, 2)
    assert math.isnan(measures.abs_rel(empty, empty))
    assert math.isnan(measures.delta1(empty, empty))
    assert math.isnan(measures.nan_mean([math.nan]))
    assert math.isnan(measures.accuracy(torch.zeros(2, 2)))
    assert measures.nan_mean([1.0, math.nan, 3.0]) == 2


def test_confusion_accuracy_and_iou():
    truth = torch.tensor([0, 0, 1, 1, -1])
    found = torch.tensor([0, 1, 1, 1, 2])
    counts = measures.confusion(found, truth, 3)
    assert counts.tolist() == [[1, 1, 0], [0, 2, 0], [0, 0, 0]]
    assert measures.accuracy(counts) == 0.75
    ious = measures.class_ious(counts)
    assert ious[:2].tolist() == pytest.approx([1 / 2, 2 / 3])
    assert math.isnan(float(ious[2]))  # never occurs
    assert measures.mean_iou(counts) == pytest.approx(7 / 12)
    assert measures.mean_iou(counts, [1]) == pytest.approx(2 / 3)
    with pytest.raises(ValueError, match="predicted"):
        measures.confusion(torch.tensor([3]), torch.tensor([0]), 3)
