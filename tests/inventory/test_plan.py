"""The plan of a room whose walls are known."""

import math
from dataclasses import replace

import numpy as np
import pytest
import torch

from langflash_core.geometry.rotations import turn_of
from langflash_core.inventory import inventory
from langflash_core.inventory.plan import _doubt, floor_plan, goes_through, weighted_quantile
from tests.boxroom import DEEP, EYE, METRES, TABLE, WIDE, box_room
from tests.inventory.test_things import with_more


@pytest.fixture(scope="module")
def plan():
    return floor_plan(inventory(box_room().with_record(metric_scale=METRES)))


def test_the_three_walls_are_where_they_are(plan):
    assert len(plan.walls) == 3
    ends = np.array([[wall.start, wall.end] for wall in plan.walls]) + np.array([EYE[0], EYE[2]])
    level = [pair for pair in ends if abs(pair[0, 1] - pair[1, 1]) < abs(pair[0, 0] - pair[1, 0])]
    upright = [pair for pair in ends if abs(pair[0, 1] - pair[1, 1]) > abs(pair[0, 0] - pair[1, 0])]
    assert len(level) == 1 and len(upright) == 2
    assert level[0][:, 1] == pytest.approx([DEEP, DEEP], abs=0.06)
    offsets = sorted(float(pair[:, 0].mean()) for pair in upright)
    assert offsets == pytest.approx([0.0, WIDE], abs=0.06)
    lengths = sorted(wall.length for wall in plan.walls)
    assert lengths == pytest.approx([WIDE, DEEP, DEEP], abs=0.2)
    assert abs(plan.turn) < 1


def test_the_door_is_in_its_wall_and_no_thing(plan):
    (door,) = plan.openings
    assert door.thing.kind == "door"
    middle = (np.array(door.start) + door.end) / 2 + [EYE[0], EYE[2]]
    assert middle == pytest.approx([WIDE, 3.95], abs=0.12)
    assert math.dist(door.start, door.end) == pytest.approx(0.9, abs=0.12)
    assert sorted(thing.kind for thing in plan.things) == ["chair", "chair", "table"]


def test_bounds_hold_all_that_is_drawn(plan):
    (west, south), (east, north) = plan.bounds
    assert east - west == pytest.approx(WIDE, abs=0.2) and north - south == pytest.approx(DEEP, abs=0.4)


def test_a_scene_in_its_own_unit_has_the_same_plan():
    room = box_room()
    scaled = floor_plan(inventory(room))
    assert len(scaled.walls) == 3 and len(scaled.openings) == 1


def test_a_wall_is_where_its_near_half_is():
    """Depth errs with distance: the farther 56 % of the west wall are seen 12 cm behind it."""
    found = inventory(box_room().with_record(metric_scale=METRES))
    east, north = (found.stands[:, [0, 2]] + [EYE[0], EYE[2]]).T
    means = found.scene.gaussians.means.clone()
    behind = torch.from_numpy(turn_of(found.world)[0]).float() * 0.12 / METRES
    means[(np.abs(east) < 0.02) & (north > 2.2)] -= behind
    gaussians = replace(found.scene.gaussians, means=means)
    bent = replace(found.scene, gaussians=gaussians, photos=(b"", b""))  # taken where its cameras are
    walls = floor_plan(inventory(bent)).walls
    west = min((wall.start[0] + wall.end[0]) / 2 for wall in walls) + EYE[0]
    assert west == pytest.approx(0, abs=0.02)


def screen(north: float, width: float) -> np.ndarray:
    """Places (n, 3) of a wall of that width in the room's middle, along east and up."""
    east, height = np.meshgrid(np.arange(0, width, 0.05), np.arange(0, 2.6, 0.05))
    return np.stack((2 - width / 2 + east.ravel(), height.ravel(), np.full(east.size, north)), 1)


def test_a_short_wall_is_doubted_and_none_where_a_thing_stands_across_it(plan):
    assert not any(wall.doubt for wall in plan.walls) and not plan.astray
    room = box_room().with_record(metric_scale=METRES)
    beside = floor_plan(inventory(with_more(room, screen(2.2, 0.9), "wall")))
    assert [wall.doubt for wall in beside.walls if wall.length < 1.2] == ["it is short"]
    across = floor_plan(inventory(with_more(room, screen(TABLE[1], 0.9), "wall")))
    assert len(across.walls) == 3 and not across.astray


def test_a_small_wall_high_up_is_doubted():
    assert _doubt(3.0, 0.5, 0.05) == "no photo shows it down to the floor"
    assert not _doubt(3.0, 0.5, 0.5) and not _doubt(3.0, 0.1, 0.05) and _doubt(1.0, 0.1, 0.5)


def test_what_stands_across_a_wall_goes_through_it(plan):
    (table,) = (thing for thing in plan.things if thing.kind == "table")
    east, _, north = table.place
    wall = replace(plan.walls[0], start=(east - 1, north), end=(east + 1, north))
    assert goes_through(table, wall, 1.0)
    assert not goes_through(
        table, replace(wall, start=(east - 1, north + 0.2), end=(east + 1, north + 0.2)), 1.0
    )
    assert not goes_through(table, replace(wall, start=(east + 0.1, north), end=(east + 2, north)), 1.0)


def test_quantiles_by_weight_are_those_of_repeated_values():
    values, weights = np.array([3.0, 1.0, 2.0]), np.array([2.0, 5.0, 3.0])
    repeated = np.repeat(values, weights.astype(int))
    for share in (0.1, 0.5, 0.7, 0.9, 1.0):
        exact = np.sort(repeated)[max(0, math.ceil(share * len(repeated)) - 1)]
        assert weighted_quantile(values, weights, share) == exact
