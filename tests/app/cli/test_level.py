"""`langflash level` and `export --upright`."""

import numpy as np
import pytest

from langflash_core.export import read
from langflash_core.scene.file import load, save
from tests.boxroom import METRES, box_room


@pytest.fixture(scope="module")
def room_file(tmp_path_factory):
    path = tmp_path_factory.mktemp("room") / "room.langflash"
    save(box_room(), path)
    return path


def test_it_says_how_a_scene_stands_and_keeps_it(run, done, room_file, tmp_path):
    out = tmp_path / "new" / "level.langflash"
    outcome = done("level", room_file, "-o", out)
    assert "floor found" in outcome.out and "scale guessed from door and ceiling" in outcome.out
    world = load(out).record.world
    assert world is not None and world.guess is not None and load(out).record.metric_scale is None
    told = run("info", out)
    assert "world: levelled by surfaces" in told.out
    assert run("info", "--json", out).json()["world"]["floor_by"] == "floor"
    again = run("level", room_file, "--json").json()
    assert again["world"]["turn"] == list(world.turn) and again["metric_scale"] is None


def test_a_known_length_puts_metres_into_the_scene(run, done, room_file, tmp_path):
    out = tmp_path / "level.langflash"
    outcome = done("level", room_file, "--ceiling", "2.6", "-o", out)
    assert "as you said" in outcome.out
    assert "guessed" not in outcome.out + run("info", out).out, "two lengths of a unit, and one is wrong"
    assert load(out).record.metric_scale == pytest.approx(METRES, rel=0.02)
    outcome = run("level", room_file, "--length", "0,0,0", "0,0,1.5", "3", "--json")
    assert outcome.json()["metric_scale"] == pytest.approx(2.0)
    outcome = run("level", room_file, "--length", "1:20,30", "1:70,30", "3", "--json")
    assert outcome.json()["metric_scale"] > 0


def test_an_upright_export_stands_level_in_metres_in_every_kind_of_file(run, done, room_file, tmp_path):
    level = tmp_path / "level.langflash"
    done("level", room_file, "--ceiling", "2.6", "-o", level)
    for name in ("room.ply", "room.langflash", "room.splat", "room.glb", "room.spz", "room.sog"):
        done("export", level, "--upright", "-o", tmp_path / name)
        heights = -read(tmp_path / name).gaussians.means[:, 1].numpy()
        assert abs(np.quantile(heights, 0.005)) < 0.08 and abs(np.quantile(heights, 0.995) - 2.6) < 0.08
    plain, stood = tmp_path / "plain.ply", tmp_path / "after.ply"
    assert run("export", room_file, "-o", plain).code == run("export", level, "-o", stood).code == 0
    assert plain.read_bytes() == stood.read_bytes()  # the world is beside the Gaussians, not in them
    assert read(stood).record.world == load(level).record.world  # and in the language beside them


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--length", "0,0,0", "0,0,0", "2"), "one point"),
        (("--length", "0,0", "0,0,1", "2"), "points"),
        (("--length", "0,0,0", "0,0,1", "long"), "metres"),
        (("--length", "9:1,1", "0,0,1", "2"), "photos 1 to"),
        (("--length", "0:1,1", "0,0,1", "2"), "photos count from 1"),
        (("--up", "0,0,0"), "no length"),
        (("--up", "0,1"), "three numbers"),
        (("--ceiling", "-1"), "above 0"),
    ],
)
def test_bad_words_are_one_sentence_and_nothing_is_written(refused, room_file, tmp_path, words, said):
    assert said in refused("level", room_file, *words, "-o", tmp_path / "level.langflash")


def test_upright_needs_a_world_and_a_file_of_gaussians(refused, room_file, tmp_path):
    assert "langflash level" in refused("export", room_file, "--upright", "-o", tmp_path / "room.ply")
    assert "--upright is for" in refused("export", room_file, "--upright", "-o", tmp_path / "room.png")


def test_it_may_be_kept_in_the_scene_itself(run, done, room_file, tmp_path):
    own = tmp_path / "own.langflash"
    own.write_bytes(room_file.read_bytes())
    assert run("level", own, "-o", own).code == 0 and load(own).record.world is not None
    splats = tmp_path / "own.ply"
    done("export", own, "-o", splats)
    before = splats.read_bytes()
    assert run("level", splats, "-o", splats).code == 2 and splats.read_bytes() == before
