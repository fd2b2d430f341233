"""Depth maps brought to the unit of poses that are given."""

import numpy as np
import pytest

from langflash_core.errors import InputError
from langflash_core.network.stereo.known import agreeing, depth_scales, log_scales
from langflash_core.network.stereo.matching import Matches

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
