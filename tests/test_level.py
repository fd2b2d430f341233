"""How a scene stands and how large it is, on a room whose walls and heights are known."""

import math
from dataclasses import replace

import numpy as np
import pytest
import torch

from langflash_core import level
from langflash_core.base.records import SURE, Guess, World
from langflash_core.errors import InputError
from langflash_core.geometry.rotations import turn_of
from langflash_core.level import (
    NOT_SURE,
    Evidence,
    apply_measurement,
    found_world,
    guess_scale,
    level_scene,
    measured_by,
    seen_at,
    upright,
)
from langflash_core.types import Gaussians
from tests.boxroom import EYE, HIGH, METRES, box_room, true_up, without_language


@pytest.fixture(scope="module")
def room():
    return box_room()


@pytest.fixture(scope="module")
def world(room):
    return found_world(room)


def degrees(a, b) -> float:
    return math.degrees(math.acos(min(1.0, abs(float(a @ b)))))


def test_surfaces_and_the_word_floor_tell_how_it_stands(room, world):
    assert degrees(-turn_of(world)[1], true_up(room)) < 0.5
    assert (world.up_by, world.floor_by, world.north_by) == ("surfaces", "floor", "walls")
    eye = turn_of(world) @ (np.zeros(3) - np.array(world.origin))
    assert abs(-eye[1] * METRES - EYE[1]) < 0.05  # the first camera, over the floor
    assert abs(eye[0]) < 1e-6 and abs(eye[2]) < 1e-6  # and over the origin
    ahead = turn_of(world)[2]
    assert 5 < degrees(ahead, np.array([0.0, 0, 1])) < 25  # north is the wall that it faces, aside and above


def test_a_scene_without_words_stands_as_well(room):
    world = found_world(without_language(room))
    assert degrees(-turn_of(world)[1], true_up(room)) < 0.5
    eye = turn_of(world) @ (np.zeros(3) - np.array(world.origin))
    assert world.floor_by == "lowest" and abs(-eye[1] * METRES - EYE[1]) < 0.1
    assert world.guess is None


def test_what_is_told_is_taken(room):
    up = true_up(room)
    north = np.array([1.0, 0.2, 0.1])
    world = found_world(room, up=(5 * up).tolist(), north=north.tolist(), origin=(0.1, 0.2, 0.3))
    turn = turn_of(world)
    assert np.allclose(-turn[1], up, atol=1e-9) and world.up_error == 0
    level_north = north - up * (north @ up)
    assert np.allclose(turn[2], level_north / np.linalg.norm(level_north), atol=1e-9)
    assert world.origin == (0.1, 0.2, 0.3)
    assert (world.up_by, world.floor_by, world.north_by) == ("told", "told", "told")


@pytest.mark.parametrize(
    "told",
    [
        {"up": (0, 0, 0)},
        {"north": (math.nan, 0, 1)},
        {"up": (0, -1, 0), "north": (0, 2, 0)},
        {"origin": (1, 2)},
    ],
)
def test_directions_that_are_none_are_refused(room, told):
    with pytest.raises(InputError):
        found_world(room, **told)


def test_a_scene_of_nothing_is_refused(room):
    empty = replace(room.rows(torch.zeros(len(room.gaussians), dtype=torch.bool)))
    with pytest.raises(InputError, match="no surface"):
        found_world(empty)
    lost = replace(room.gaussians, means=torch.full_like(room.gaussians.means, math.nan))
    assert isinstance(lost, Gaussians)
    with pytest.raises(InputError, match="no surface"):
        found_world(replace(room, gaussians=lost))


def test_ceiling_and_door_tell_how_large_it_is(world):
    guess = world.guess
    assert guess is not None and guess.by == ("door", "ceiling")
    assert abs(guess.metres / METRES - 1) < 0.1  # usual heights are not this room's
    assert guess.low < METRES < guess.high


def test_a_floor_above_the_ceiling_hangs(room):
    up = true_up(room)
    assert not level.on_its_head(room, up)
    assert level.on_its_head(room, -up)
    assert not level.on_its_head(without_language(room), -up)  # nobody calls anything a floor
    empty = room.rows(torch.zeros(len(room.gaussians), dtype=torch.bool))
    assert not level.on_its_head(empty, -up)


def test_a_told_height_makes_metres(room, world):
    told = measured_by(room.with_record(world=world), "ceiling", HIGH)
    assert told.record.metric_scale == pytest.approx(METRES, rel=0.02)
    with pytest.raises(InputError, match="level"):
        measured_by(room, "door", 2.0)


def test_a_known_length_makes_metres(room):
    a, b = seen_at(room, 0, 30, 40), seen_at(room, 0, 70, 40)
    told = apply_measurement(room, a, b, 3.0)
    assert told.record.metric_scale is not None
    assert told.record.metric_scale * math.dist(a, b) == pytest.approx(3.0)
    with pytest.raises(InputError, match="one point"):
        apply_measurement(room, a, a, 3.0)
    for pixel in ((2, 5, 5), (0, 500, 5)):
        with pytest.raises(InputError, match="no pixel"):
            seen_at(room, *pixel)


def test_a_pixel_shows_the_point_that_lies_behind_it(room):
    x, y, z = seen_at(room, 0, 48, 36)  # the middle
    assert abs(x) < 0.01 * z and abs(y) < 0.01 * z and z > 1


def test_evidence_is_weighed_and_what_stands_alone_left_out():
    assert guess_scale([]) is None
    alone = guess_scale([Evidence("depth", 2.2, 0.05)])
    assert alone is not None and alone.metres == pytest.approx(2.2, rel=1e-6)
    assert math.log(alone.high / alone.low) / 2 == pytest.approx(0.05, rel=0.01)
    both = guess_scale([Evidence("door", 2.0, 0.05, 2.0), Evidence("depth", 2.2, 0.05)])
    assert both is not None and both.metres == pytest.approx(math.sqrt(2.0 * 2.2), rel=0.02)
    heights = Evidence("door", 9.0, 0.05, 2.0), Evidence("ceiling", 2.0, 0.05, 2.6)
    found = guess_scale([*heights, Evidence("depth", 2.1, 0.2)])
    assert found is not None and found.by == ("ceiling", "depth") and 1.9 < found.metres < 2.1


def test_heights_over_a_table_top_do_not_tell_how_large_it_is():
    """Of a scene of 1 m a unit, seen from 1.5 m, whose "floor" is a table of .75 m: its camera is
    .75 high, its ceiling 1.85."""
    told = [Evidence("ceiling", 2.6 / 1.85, 0.09, 2.6), Evidence("camera height", 1.5 / 0.75, 0.2, 1.5)]
    found = guess_scale([*told, Evidence("depth", 1.0, 0.22)])
    assert found is not None and found.by == ("depth",)
    assert found.low < 1 < found.metres < 1.2  # the mean by errors is 1.40
    weights = [1 / each.error**2 for each in (*told, Evidence("depth", 1.0, 0.22))]
    assert np.average([math.log(2.6 / 1.85), math.log(2), 0.0], weights=weights) > math.log(1.35)


def test_an_upright_scene_stands_and_stays_where_it_is(room, world):
    known = room.with_record(world=world, metric_scale=METRES)
    stood = upright(known)
    again = found_world(stood)
    assert degrees(turn_of(again)[1], np.array([0.0, 1, 0])) < 0.1
    heights = -stood.gaussians.means[:, 1].numpy()
    assert abs(np.quantile(heights, 0.999) - HIGH) < 0.06 and abs(np.quantile(heights, 0.001)) < 0.06
    assert stood.record.metric_scale == 1.0 and stood.record.world is not None
    assert stood.record.world.origin == (0.0, 0.0, 0.0)
    twice = upright(stood)
    assert torch.allclose(twice.gaussians.means, stood.gaussians.means, atol=1e-6)
    guess = stood.record.world.guess
    assert isinstance(guess, Guess) and guess.metres == pytest.approx(world.guess.metres / METRES)
    with pytest.raises(InputError, match="level"):
        upright(room)


def test_a_photo_that_is_damaged_tells_nothing_and_stops_nothing(room, world):
    found = found_world(replace(room, photos=(b"no picture", b"")))
    assert degrees(turn_of(found)[1], turn_of(world)[1]) < 1e-3


def test_the_densest_window_is_found():
    values = np.concatenate((np.linspace(0, 10, 20), np.full(15, 4.0)))
    assert level.densest(values, 0.1) == pytest.approx(4.0)
    assert level.densest(np.array([3.0]), 0.1) == 3.0


def test_where_the_lowest_is_not_level_the_floor_is_the_lowest_that_is():
    """Rubble at 0 to 0.4, a floor at 1 and a table at 2, of more points."""
    heights = np.concatenate((np.linspace(0.0, 0.4, 30), np.full(20, 1.0), np.full(50, 2.0)))
    flat = np.arange(100) >= 30
    normals = np.where(flat[:, None], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0])
    places = np.stack((np.zeros(100), heights, np.zeros(100)), 1)
    surface = level.Surface(places, normals, np.zeros((100, 4), bool))
    assert level._floor(surface, np.array([0.0, 1.0, 0.0]), math.inf) == (1.0, "lowest")


def test_a_scene_is_levelled_unasked_only_where_that_is_sure(room, monkeypatch):
    """Surfaces lean, so their word is not taken unasked; what edges say is, beside the same tensors."""
    unsure = level_scene(room)
    assert unsure.record.world is None and unsure.record.warnings[-1] == NOT_SURE
    stands = World((1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0), "edges", SURE)
    monkeypatch.setattr(level, "found_world", lambda scene: stands)
    sure = level_scene(room)
    assert sure.record.world == stands and sure.record.warnings == room.record.warnings
    assert sure.gaussians is room.gaussians and sure.semantics is room.semantics
    assert not replace(stands, up_error=SURE + 0.1).sure and replace(stands, up_by="told", up_error=9.0).sure


def test_a_scene_of_nothing_is_levelled_to_nothing(room):
    nothing = room.rows(torch.zeros(len(room.gaussians), dtype=torch.bool))
    assert level_scene(nothing) is nothing
