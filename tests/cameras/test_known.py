"""Depth maps brought to the unit of poses that are given."""

import cv2
import numpy as np
import pytest

from langflash_core.cameras.keypoints import KeyPoints
from langflash_core.cameras.known import agreeing, count_explained, depth_scales, doubt, log_scales
from langflash_core.cameras.matching import Matches
from langflash_core.cameras.poses import PoseInput, estimate_poses
from langflash_core.errors import InputError
from langflash_core.rig.settings import MATCHING

SIGMA = 1e-3


def pair(seed: int = 0, count: int = 60) -> tuple[Matches, np.ndarray, np.ndarray, np.ndarray]:
    """Exact matches of points seen from two places, the pose between them, and both depths."""
    rng = np.random.default_rng(seed)
    points = np.c_[rng.uniform(-1, 1, (count, 2)), rng.uniform(2, 5, count)]
    angle = 0.2
    relative = np.eye(4)
    relative[:3, :3] = [[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]]
    relative[:3, 3] = [-0.4, 0.05, 0.1]
    seen = points @ relative[:3, :3].T + relative[:3, 3]
    matches = Matches(points[:, :2] / points[:, 2:], seen[:, :2] / seen[:, 2:], SIGMA)
    return matches, relative, points[:, 2], seen[:, 2]


def test_right_matches_stay_and_wrong_ones_go():
    matches, relative, _, _ = pair()
    assert len(agreeing(matches, relative)) == 60
    moved = matches.x_j.copy()
    moved[:20, 1] += 10 * SIGMA  # off their lines, which run nearly level
    moved[20:25] = -matches.x_j[20:25]
    kept = agreeing(Matches(matches.x_i, moved, SIGMA), relative)
    assert len(kept) <= 40 and len(kept) >= 35
    assert not len(agreeing(matches, np.linalg.inv(relative)))  # behind the cameras, if anywhere


def test_scales_are_those_of_the_poses():
    """Maps three times too deep and half as deep as the poses say."""
    matches, relative, depth_i, depth_j = pair()
    logs_i, logs_j = log_scales(matches, relative, 3 * depth_i, 0.5 * depth_j)
    assert np.allclose(logs_i, -np.log(3), atol=1e-6) and np.allclose(logs_j, np.log(2), atol=1e-6)
    assert np.allclose(depth_scales([logs_i, logs_j]), [1 / 3, 2])
    # A view with too few matches takes what most say.
    assert np.allclose(depth_scales([logs_i, logs_i[:3] + 1])[1], 1 / 3)


def test_poses_that_do_not_move_say_nothing_of_depth():
    matches, _, depth_i, depth_j = pair()
    logs = log_scales(matches, np.eye(4), depth_i, depth_j)
    assert not len(logs[0]) and not len(logs[1])
    with pytest.raises(InputError, match="do not fit the poses") as caught:
        depth_scales(list(logs))
    assert "\n" not in str(caught.value)


def test_right_poses_explain_their_matches_and_others_do_not():
    """Also where a camera only turned, and where poses are off by what a headset's are."""
    matches, relative, _, _ = pair()
    assert count_explained(matches, relative) == 60
    turned = np.eye(4)
    turned[:3, :3] = cv2.Rodrigues(np.array([0, 4 * SIGMA, 0]))[0]  # radians: within 6 standard deviations
    assert count_explained(matches, turned @ relative) == 60
    still = relative.copy()
    still[:3, 3] = 0
    far = np.c_[matches.x_i, np.ones(60)] @ relative[:3, :3].T
    only_turned = Matches(matches.x_i, far[:, :2] / far[:, 2:], SIGMA)
    assert count_explained(only_turned, still) == 60
    for wrong in (np.eye(4), still, np.linalg.inv(relative), np.diag([-1.0, -1, 1, 1]) @ relative):
        assert count_explained(matches, wrong) < 10
    assert count_explained(only_turned, np.eye(4)) < 10


def test_poses_are_doubted_where_half_of_the_matches_do_not_fit():
    assert not doubt([]) and not doubt([(60, 55), (30, 40)])
    assert not doubt([(50, 60), (0, 40)])  # one pair that looks alike by chance
    said = doubt([(8, 377), (0, 60)])
    assert "8 of 437 matches" in said and "; " in said and "\n" not in said


def seen_from_two_places() -> tuple[list[PoseInput], KeyPoints, np.ndarray]:
    """What pose estimation reads of points seen from two places, with flat depth maps, and the pose."""
    matches, relative, _, _ = pair(count=200)
    K = np.array([[200.0, 0, 112], [0, 200, 112], [0, 0, 1]])
    view = PoseInput(K, (224, 224), np.full((224, 224), 3.0), np.zeros((4, 2, 2)))
    pixels = [(x * 200 + 112) * (MATCHING.working_side / 224) for x in (matches.x_i, matches.x_j)]
    rows = np.repeat(np.arange(200)[:, None], 2, 1)
    return [view, view], KeyPoints(tuple(pixels), {(0, 1): rows}), relative


def test_poses_that_were_given_are_compared_with_the_photos():
    views, points, relative = seen_from_two_places()
    assert not estimate_poses(views, points, known=np.stack((np.eye(4), relative))).doubt
    turned = np.eye(4)
    turned[:3, :3] = cv2.Rodrigues(np.radians([0, 0, 3.0]))[0]  # a third of the photo still fits
    found = estimate_poses(views, points, known=np.stack((np.eye(4), turned @ relative)))
    assert "do not look as the poses say" in found.doubt
    assert not estimate_poses(views, points).doubt  # nothing was given
