"""Straight edges of drawn pictures."""

import cv2
import numpy as np

from langflash_core.geometry.lines import line_segments


def test_the_sides_of_a_rectangle_are_found_where_they_are():
    grey = np.full((120, 160), 60, np.uint8)
    cv2.rectangle(grey, (40, 30), (110, 90), 200, -1)
    ends = line_segments(grey)
    upright = ends[np.abs(ends[:, 0] - ends[:, 2]) < 2]
    level = ends[np.abs(ends[:, 1] - ends[:, 3]) < 2]
    assert len(upright) >= 2 and len(level) >= 2
    for edge in (40.0, 111.0):  # between pixels 39 and 40, 110 and 111
        assert np.abs(upright[:, [0, 2]].mean(1) - edge).min() < 0.7
    for edge in (30.0, 91.0):
        assert np.abs(level[:, [1, 3]].mean(1) - edge).min() < 0.7


def test_nothing_and_specks_have_no_edges():
    assert line_segments(np.zeros((40, 50), np.uint8)).shape == (0, 4)
    dotted = np.zeros((200, 200), np.uint8)
    dotted[::20, ::20] = 255
    assert len(line_segments(dotted)) == 0
