"""Evaluation measures on hand-made cases with known answers."""

import math

import pytest
import torch

from langflash_core.geometry.cameras import unproject
from langflash_core.lab.evaluation import metrics
from langflash_core.lab.evaluation.words import OTHER, PAPER_LABELS, absent_phrases, paper_label


def pose(degrees: float, translation: tuple[float, float, float]) -> torch.Tensor:
    angle = math.radians(degrees)
    matrix = torch.eye(4)
    matrix[0, 0] = matrix[2, 2] = math.cos(angle)
    matrix[0, 2], matrix[2, 0] = math.sin(angle), -math.sin(angle)
    matrix[:3, 3] = torch.tensor(translation)
    return matrix


def test_pose_error_is_the_angle_between():
    error = metrics.pose_error(pose(13, (1, 0, 0)), pose(10, (1, 0, 0)))
    assert error.rotation == pytest.approx(3, abs=1e-4)  # float32 matrices
    # The centres -R^T t turn with the rotation: 3 degrees apart, too.
    assert error.direction == pytest.approx(3, abs=1e-4)
    assert error.right()
    opposite = metrics.pose_error(pose(0, (1, 0, 0)), pose(0, (-2, 0, 0)))
    assert opposite.direction == pytest.approx(180)
    assert not opposite.right()


def test_a_still_camera_has_no_direction():
    error = metrics.pose_error(pose(0, (0, 0, 0)), pose(2, (0, 0, 1)))
    assert math.isnan(error.direction)
    assert error.right()
    assert not metrics.PoseError(6, math.nan).right()


def test_points_of_the_truth_have_no_error():
    depths = torch.rand(6, 8, generator=torch.Generator().manual_seed(0)) + 1
    K = torch.tensor([[8.0, 0, 4], [0, 8, 3], [0, 0, 1]])
    viewmat = torch.eye(4)
    viewmat[0, 3] = -0.5
    points = unproject(depths, K) + torch.tensor([0.5, 0, 0])
    assert metrics.point_error(points / 2, depths, K, viewmat, 2.0) == pytest.approx(0, abs=1e-6)
    assert metrics.point_error(points * 1.1, depths, K, viewmat, 1.0) == pytest.approx(0.1, abs=1e-6)
    assert math.isnan(metrics.point_error(points, torch.zeros_like(depths), K, viewmat, 1.0))


def test_presence_counts():
    scores = torch.tensor([0.9, 0.8, 0.4, 0.7])
    present = torch.tensor([True, True, True, False])
    counts = metrics.presence(scores, present, 0.6)
    assert counts == metrics.Presence(hits=2, false_alarms=1, misses=1, rejections=0)
    assert counts.precision == pytest.approx(2 / 3)
    assert counts.recall == pytest.approx(2 / 3)
    assert (counts + counts).hits == 4
    assert math.isnan(metrics.Presence().precision)


def test_paper_labels():
    assert PAPER_LABELS[paper_label("armchair")] == "chair"
    assert PAPER_LABELS[paper_label("coffee table")] == "table"
    assert paper_label("aquarium") == OTHER


def test_absent_phrases_are_absent_and_unlike():
    groups = ("chair", "armchair", "sofa", "lamp", "bed")
    vectors = torch.eye(5)
    vectors[1] = torch.tensor([0.8, 0.6, 0, 0, 0])
    phrases = absent_phrases(["chair"], groups, vectors, 3, torch.Generator().manual_seed(0))
    assert sorted(phrases) == ["bed", "lamp", "sofa"]
    assert absent_phrases(list(groups), groups, vectors, 3, torch.Generator()) == []


def test_the_area_under_the_curve_of_poses():
    assert metrics.pose_auc([0.0, 0.0]) == [1, 1, 1]
    assert metrics.pose_auc([30.0, math.nan, math.inf]) == [0, 0, 0]
    # One error of 5: the curve rises from 0 to 1 between 0 and 5 degrees, and stays there.
    assert metrics.pose_auc([5.0]) == pytest.approx([0, 0.75, 0.875])
    assert metrics.pose_auc([5.0, 40.0]) == pytest.approx([0, 0.375, 0.4375])
    assert all(math.isnan(area) for area in metrics.pose_auc([]))


def test_the_calibration_error_is_the_gap_between_scores_and_shares():
    scores, truths = torch.tensor([0.9, 0.9, 0.1, 0.1]), torch.tensor([True, False, False, False])
    assert metrics.calibration_error(scores, truths) == pytest.approx((0.4 + 0.1) / 2, abs=1e-6)
    assert metrics.calibration_error(torch.tensor([1.0, 0.0]), torch.tensor([True, False])) == 0
    assert math.isnan(metrics.calibration_error(torch.empty(0), torch.empty(0, dtype=torch.bool)))
