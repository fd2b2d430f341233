"""Measures of views from aside: what is whole scores as whole, and what is made to break is counted."""

import math

import numpy as np
import pytest

from langflash_core.geometry.fusion import DepthView
from langflash_core.lab.evaluation.side_measures import (
    Similarity,
    angle_between,
    boundary_f1,
    fitted_similarity,
    layer_gaps,
    levelled,
    points_of,
    seen_by,
    shared_surface,
    sheets,
    turned_about,
)
from langflash_core.lab.evaluation.side_subjects import pivot_of

SIZE = 64
K = np.array([[60.0, 0, 32], [0, 60.0, 32], [0, 0, 1]])
NEAR, FAR = 2.0, 4.0
THING = (slice(20, 44), slice(24, 40))


def photo(depths: np.ndarray | None = None, viewmat: np.ndarray | None = None) -> DepthView:
    """A board two metres away before a wall at four."""
    return DepthView(board() if depths is None else depths, np.eye(4) if viewmat is None else viewmat, K)


def board() -> np.ndarray:
    depths = np.full((SIZE, SIZE), FAR)
    depths[THING] = NEAR
    return depths


def aside(degrees: float) -> np.ndarray:
    return turned_about(np.eye(4), np.array([0, 0, NEAR]), np.array([0, -1.0, 0]), degrees)


def seen_from(viewmat: np.ndarray, depths: np.ndarray) -> np.ndarray:
    """The points of a photo's depth map from elsewhere, each on a few pixels, the nearest wins."""
    points = points_of(photo(depths)).reshape(-1, 3)
    camera = points @ viewmat[:3, :3].T + viewmat[:3, 3]
    pixels = np.floor(camera[:, :2] / camera[:, 2:] * 60 + 32).astype(int)
    drawn = np.full((SIZE + 2, SIZE + 2), np.inf)
    for step in ((0, 0), (0, 1), (1, 0), (1, 1)):
        u, v = (pixels + step).T
        inside = (u >= 0) & (v >= 0) & (u < SIZE) & (v < SIZE)
        np.minimum.at(drawn, (v[inside], u[inside]), camera[inside, 2])
    drawn = drawn[:SIZE, :SIZE]
    return np.where(np.isfinite(drawn), drawn, 0.0)


def rubber(width: int = 3) -> np.ndarray:
    """The board's depth map with its right edge drawn out to the wall over some pixels."""
    depths = board()
    for step in range(width):
        depths[THING[0], 40 + step] = NEAR + (FAR - NEAR) * (step + 1) / (width + 1)
    return depths


def test_a_camera_is_carried_around_what_it_looks_at():
    moved = aside(30)
    assert np.allclose(moved @ [0, 0, NEAR, 1], [0, 0, NEAR, 1])  # the pivot stays in the picture
    eye = -moved[:3, :3].T @ moved[:3, 3]
    assert eye[0] > 0.9 and abs(eye[1]) < 1e-12  # right-handed about up: to the right
    assert angle_between([np.eye(4)], moved, np.array([0, 0, NEAR])) == pytest.approx(30)
    assert np.allclose(pivot_of(photo(np.full((SIZE, SIZE), NEAR))), [0, 0, NEAR])


def test_a_similarity_is_found_among_points_of_which_a_third_are_wrong():
    rng = np.random.default_rng(3)
    truth = rng.normal(size=(300, 3)) + np.array([0, 0, 5])
    known = Similarity(2.5, aside(20)[:3, :3], np.array([0.3, -0.2, 0.1]))
    points = (truth - known.shift) @ known.rotation / known.scale
    exact = fitted_similarity(points, truth, truth[:, 2])
    assert exact.scale == pytest.approx(2.5) and np.allclose(exact.rotation, known.rotation)
    points[::3] += 0.2 * rng.normal(size=points[::3].shape) + 0.1
    found = fitted_similarity(points, truth, truth[:, 2])
    # Least squares would be off by 3 %; absolute errors with a floor of .001 let a thousandth through.
    assert found.scale == pytest.approx(2.5, rel=2e-3)
    assert np.allclose(found.shift, known.shift, atol=0.02)
    true_pose = aside(15)
    moved = known.viewmat(true_pose)
    assert np.allclose(moved[:3, :3] @ moved[:3, :3].T, np.eye(3))
    x = np.array([0.1, 0.2, 1.5])
    there = true_pose[:3, :3] @ (known.scale * known.rotation @ x + known.shift) + true_pose[:3, 3]
    assert np.allclose(known.scale * (moved[:3, :3] @ x + moved[:3, 3]), there)
    with pytest.raises(ValueError, match="at least 3"):
        fitted_similarity(points[:2], truth[:2], truth[:2, 2])


def test_what_a_board_hides_is_not_seen():
    view = photo(seen_from(aside(20), board()), aside(20))
    assert seen_by(photo(), [photo()]).all()
    hidden = np.full((SIZE, SIZE), FAR)  # the wall alone: behind the board nobody saw it
    seen = seen_by(photo(hidden), [photo()])
    assert not seen[THING].any() and seen[:, :20].all()
    assert seen_by(view, []).sum() == 0


@pytest.mark.parametrize("degrees", [0, 20, 45])
def test_a_scene_that_is_right_has_no_sheet(degrees: int):
    pose = aside(degrees)
    drawn = photo(seen_from(pose, board()), pose)
    assert not sheets(drawn, drawn.depths, [photo()]).any()


def test_a_sheet_between_board_and_wall_is_counted_from_where_it_shows():
    level = photo(levelled(board(), rubber()))
    assert np.array_equal(level.depths, board())  # the level is that of the surfaces, not of the sheet
    counts = {}
    for degrees in (-20, 10, 20):
        pose = aside(degrees)
        truth = seen_from(pose, board())
        found = sheets(photo(seen_from(pose, rubber()), pose), truth, [level])
        counts[degrees] = int(found.sum())
        assert not found.any() or np.nonzero(found)[1].min() >= 36  # beside the right edge alone
    assert counts[-20] == 0  # from the left the board hides it
    assert min(counts[10], counts[20]) > 48  # two pixels and more in each of the board's 24 rows


def test_things_at_a_wrong_depth_are_no_sheet():
    wrong = board()
    wrong[THING] = 2.6  # between the board and the wall, but whole
    pose = aside(20)
    drawn, truth = seen_from(pose, wrong), seen_from(pose, board())
    assert sheets(photo(drawn, pose), truth, [photo()]).any()
    assert not sheets(photo(drawn, pose), truth, [photo(levelled(board(), wrong))]).any()


def test_the_side_of_a_thing_that_a_photo_sees_edge_on_is_no_sheet():
    pose = aside(30)
    drawn = photo(seen_from(pose, rubber()), pose)
    assert not sheets(drawn, drawn.depths, [photo()]).any()  # it is truly there


def test_layers_are_told_relative_to_depth_and_one_surface_has_none():
    own, both = board(), np.ones((SIZE, SIZE), dtype=bool)
    assert layer_gaps(own, own, both).max() == 0
    assert np.median(layer_gaps(own, own * 1.02, both)) == pytest.approx(0.02 / 1.01)
    assert layer_gaps(own, np.zeros_like(own), both).max() == 0  # the other photo's was merged into this
    assert len(layer_gaps(own * 0, own * 0, both)) == 0 == len(layer_gaps(own, own, ~both))
    inner = shared_surface(photo(), photo())
    assert not inner[THING][:, :3].any() and inner[32, 32] and not inner[18, 30]


def test_edges_in_place_score_one_and_smeared_or_missing_ones_do_not():
    truth = board()
    assert boundary_f1(truth, truth) == 1 == boundary_f1(7 * truth, truth)
    assert boundary_f1(np.roll(truth, 1, 1), truth) == 1  # within a pixel
    assert boundary_f1(np.roll(truth, 4, 1), truth) < 0.6
    assert 0 < boundary_f1(rubber(8), truth) < 1
    assert boundary_f1(np.full_like(truth, FAR), truth) == 0
    assert math.isnan(boundary_f1(truth, np.full_like(truth, FAR)))
    unknown = truth.copy()
    unknown[:, 36:] = 0
    assert boundary_f1(truth, unknown) == 1  # where the truth is not known nothing is judged


def test_nothing_drawn_is_nothing_counted():
    empty = photo(np.zeros((SIZE, SIZE)), aside(20))
    assert not sheets(empty, board(), [photo()]).any()
    assert not sheets(photo(), np.zeros((SIZE, SIZE)), [photo()]).any()
    assert np.array_equal(levelled(board(), np.zeros((SIZE, SIZE))), board())
    assert not seen_by(empty, [photo()]).any()
