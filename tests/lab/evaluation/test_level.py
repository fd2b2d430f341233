"""The measure of level, inventory and plan: a scene that is true is right, one that is wrong is not."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from langflash_core.inventory import inventory
from langflash_core.lab.evaluation import level
from langflash_core.lab.evaluation.clicks import POINTS, clicks, judge_clicks, overlap, own_pixels
from langflash_core.lab.evaluation.level import (
    judge,
    judge_things,
    judge_world,
    matched_things,
    seen_through,
    summary,
    tables,
    true_instances,
    true_things,
    true_unit,
)
from langflash_core.lab.evaluation.tables import markdown
from langflash_core.level import found_world
from tests.lab.evaluation.true_scenes import UNIT, staged, true_scene


@pytest.fixture(scope="module", name="staged")
def two_photos():
    with staged(900_000_002, photos=2, side=112) as (room, _):
        return room


@pytest.fixture(scope="module")
def scene(staged):
    return true_scene(staged)


@pytest.fixture(scope="module")
def judged(scene, staged):
    return judge(1, scene, staged)


def test_a_true_scene_is_right(scene, staged, judged):
    assert true_unit(scene, staged) == pytest.approx(UNIT, rel=0.01)
    numbers = judged.numbers
    assert numbers["up_error"] < 1.5 and abs(numbers["floor_error"]) < 0.05
    assert numbers["precision_any_name"] >= numbers["precision"] > 0.7
    assert numbers["recall_any_name"] >= numbers["recall"] > 0.7
    assert judged.walls and max(judged.walls) < level.WALLS and numbers["wall_recall"] == 1


def test_wrong_names_wrong_up_and_wrong_lengths_are_told(scene, staged, judged):
    none = scene.semantics.dictionary.roll(3, 0)
    misnamed = replace(scene, semantics=replace(scene.semantics, dictionary=none))
    assert judge(1, misnamed, staged).numbers["precision"] < judged.numbers["precision"]
    world = found_world(scene, up=(0.3, -1.0, 0.0))
    numbers = judge_world(scene, world, UNIT, staged)
    assert numbers["up_error"] > 5 and numbers["up_right"] == 0
    said = judge_world(scene, found_world(scene), 3 * UNIT, staged)
    assert math.isnan(said["length_error"]) or said["length_right"] == 0


def test_of_two_halves_of_a_thing_one_is_right(scene, staged):
    found = inventory(scene.with_record(metric_scale=UNIT))
    pairs = matched_things(found, staged)
    thing, instance = pairs[0]
    rows = np.flatnonzero(thing.rows)
    larger, smaller = np.zeros_like(thing.rows), np.zeros_like(thing.rows)
    larger[rows[: int(0.6 * len(rows))]] = smaller[rows[int(0.6 * len(rows)) :]] = True
    halves = replace(thing, id="a", rows=smaller), replace(thing, id="b", rows=larger)
    split = replace(found, things=(*halves, *(other for other in found.things if other is not thing)))
    assert [(t.id, i) for t, i in matched_things(split, staged) if i == instance] == [("b", instance)]
    before, after = judge_things(found, staged)[0], judge_things(split, staged)[0]
    assert after["precision_any_name"] == pytest.approx(
        before["precision_any_name"] * len(found.things) / len(split.things)
    )


def test_what_is_seen_through_a_window_is_of_it_and_elsewhere_nothing_changes(staged):
    views = staged.views
    ids = np.zeros((2, 3, 5), np.uint8)
    ids[0] = [[1, 2, 0, 2, 1], [1, 2, 0, 3, 0], [1, 1, 1, 1, 1]]
    ids[1] = 1
    ids[1, 0, 0] = 0
    small = replace(views, images=views.images[:, :3, :5], depths=views.depths[:, :3, :5], instances=ids)
    filled = seen_through(replace(small, groups=("", "wall", "window", "door")))
    assert filled[0].tolist() == [[1, 2, 2, 2, 1], [1, 2, 2, 3, 3], [1, 1, 1, 1, 1]]
    assert (filled[1] == ids[1]).all()  # no opening there: nobody knows what it is


def test_a_summary_and_its_table_hold_every_number(judged):
    found = summary([judged, judged])
    assert found["rooms"] == 2 and found["walls_found"] == 2 * len(judged.walls)
    assert json.dumps(found, allow_nan=False)
    table = markdown(tables({"summary": found}))
    assert "Up within 1 degree" in table and "| Rooms | 2 |" in table


def test_clicks_on_a_true_scene_find_things_and_on_one_of_a_single_thing_none(scene, staged, judged):
    numbers = judged.numbers
    assert numbers["click_best_iou"] >= numbers["click_iou"] > 0.6
    assert numbers["click_best_right"] >= numbers["click_right"] > 0.7
    views = replace(staged.views, instances=seen_through(staged.views))
    known = replace(staged, views=views)
    things, own = true_things(known, level.SEEN), true_instances(scene, known)
    shuffled = np.random.default_rng(0).permutation(own)  # nothing is where it was
    wrong = judge_clicks(scene, views.instances.astype(int), things, shuffled)
    assert wrong["click_right"] == 0 and wrong["click_best_iou"] < 0.4


def test_a_click_looks_at_its_thing_alone_and_overlaps_are_shares_of_pixels(scene, staged):
    instances = staged.views.instances.astype(int)
    thing = true_things(staged, level.SEEN)[0]
    points = list(clicks(instances, thing))
    assert len(points) == POINTS
    for view, pixels in points:
        lines, columns = np.nonzero(pixels)
        middle = round(lines.mean()), round(columns.mean())
        assert instances[view][middle] == thing or min(middle) < 4  # cut off by the photo's border
    masses, rows = own_pixels(scene), np.arange(len(scene.gaussians)) % 2 == 0
    # A Gaussian a pixel, half of one wide, opaque to .9: .9 * .5^2 pixels, those seen aside a little more.
    assert np.median(masses) == pytest.approx(0.9 * 0.25, rel=0.3)
    assert overlap(rows, rows, masses) == 1 and overlap(rows, ~rows, masses) == 0
    assert overlap(rows, np.ones_like(rows), masses) == pytest.approx(masses[rows].sum() / masses.sum())
    assert math.isnan(overlap(rows & ~rows, rows & ~rows, masses))
