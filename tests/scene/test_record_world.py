"""Where a scene stands, as its file keeps it."""

import json
from dataclasses import replace

import pytest

from langflash_core.base.records import Guess, Record, World, world_from_json, world_to_json
from langflash_core.errors import SceneFileError
from langflash_core.scene.file import load, save
from langflash_core.scene.record import from_json, to_json
from tests.app.cli.conftest import stripes

GUESS = Guess(2.0, 1.9, 2.1, ("door", "depth"))
WORLD = World((0.5, 0.5, -0.5, 0.5), (1.0, 2.0, 3.0), "edges", 0.4, "floor", "walls", GUESS)


@pytest.mark.parametrize("world", [WORLD, replace(WORLD, guess=None)])
def test_a_world_and_names_survive_a_file(tmp_path, world):
    scene = stripes().with_record(world=world, thing_names={"chair 1": "Oma's"})
    save(scene, tmp_path / "s.langflash")
    record = load(tmp_path / "s.langflash").record
    assert record.world == world and record.thing_names == {"chair 1": "Oma's"}
    assert world_from_json(json.loads(json.dumps(world_to_json(world)))) == world


def test_a_record_without_one_is_written_as_before():
    assert "world" not in to_json(Record()) and "thing_names" not in to_json(Record())
    assert from_json({}).world is None


def test_keys_of_a_newer_version_are_left_out():
    assert world_from_json({**world_to_json(WORLD), "magnetic": 3}) == WORLD


@pytest.mark.parametrize(
    "broken",
    [
        {"turn": [0, 0, 0, 0]}, {"turn": [1, 0, 0]}, {"origin": ["a", 0, 0]}, {"origin": None},
        {"turn": [float("nan"), 0, 0, 1]}, {"guess": {"metres": -1, "low": 1, "high": 2}},
        {"guess": {"metres": 5, "low": 1, "high": 2}}, {"guess": 3}, {"up_error": "x"}, {"up_error": None},
        {"up_by": "stars"}, {"north_by": 3},
    ],
)  # fmt: skip
def test_a_damaged_world_is_refused(broken):
    with pytest.raises(ValueError, match=r"expected|could not"):
        world_from_json({**world_to_json(WORLD), **broken})


def test_a_file_with_a_damaged_world_is_refused_in_a_sentence(tmp_path):
    scene = stripes().with_record(others={"world": {"turn": [1, 0, 0, 0]}})
    save(scene, tmp_path / "s.langflash")
    with pytest.raises(SceneFileError, match="damaged"):
        load(tmp_path / "s.langflash")
