"""The measure of what was moved: pushed things are where it says, and true scenes are told apart."""

import numpy as np
import pytest

from langflash_core.inventory import beside, inventory
from langflash_core.inventory.alignment import Fit
from langflash_core.lab.evaluation.moved import SEEN, WAY, judge_moved, pushed_room, tables
from langflash_core.lab.evaluation.tables import markdown
from langflash_core.level import found_world
from langflash_core.splat import render
from tests.lab.evaluation.true_scenes import UNIT, staged, true_scene

SEED = 900_000_204


@pytest.fixture(scope="module")
def pushed():
    with staged(SEED, photos=4, side=80) as (room, drawer):
        return pushed_room(room, drawer, SEED)


def test_three_things_are_pushed_over_the_floor_into_free_places_that_photos_see(pushed):
    assert len(pushed.ways) == 3
    for number, way in pushed.ways.items():
        before, after = (each.room.instances[number - 1] for each in (pushed.before, pushed.after))
        assert way[1] == 0 and WAY[0] <= np.linalg.norm(way) <= WAY[1]
        assert np.allclose(after.low - before.low, way) and np.allclose(after.high - before.high, way)
        assert pushed.after.room.shell.holds(after.low, after.high)
        for each in (pushed.before, pushed.after):
            assert (each.views.instances == number).mean((1, 2)).max() >= SEEN
    others = set(range(1, len(pushed.before.room.instances) + 1)) - {*pushed.ways, *pushed.along}
    assert all(
        (pushed.before.room.instances[i - 1].low == pushed.after.room.instances[i - 1].low).all()
        for i in others
    )


def test_of_true_scenes_what_moved_is_found_and_of_one_scene_nothing(pushed, monkeypatch):
    same = Fit(np.eye(3), 1.0, np.zeros(3), 40, 50)
    monkeypatch.setattr(beside, "align_scenes", lambda first, second, render: same)
    scenes = [true_scene(each) for each in (pushed.before, pushed.after)]
    world = found_world(scenes[0])
    found = [inventory(each.with_record(world=world, metric_scale=UNIT)) for each in scenes]
    numbers = judge_moved(found[0], found[1], pushed, render)
    assert numbers["moved"] == 3 and numbers["found"] + numbers["half"] >= 2
    assert numbers["found_by_way"] >= 1 and numbers["false_moved"] == 0
    assert numbers["false_came_or_went"] == 0 and numbers["agree"] == 0.8
    still = judge_moved(found[0], found[0], pushed, render)
    assert still["found"] == still["half"] == still["false_moved"] == still["false_came_or_went"] == 0
    assert still["stayed"] == len(found[0].things)


def test_the_table_tells_what_was_counted():
    table = markdown(tables({"summary": {"rooms": 2.0, "moved": 6.0, "found": 5.0, "agree_mean": None}}))
    assert "| Things moved | 6 |" in table and "| ... said to have moved | 5 |" in table
