"""`langflash inventory`."""

import json

import pytest

from langflash_core.scene.file import load, save
from tests.boxroom import CHAIRS, METRES, box_room
from tests.writing.test_inventory import with_photos


@pytest.fixture(scope="module")
def room_file(tmp_path_factory):
    path = tmp_path_factory.mktemp("room") / "room.langflash"
    save(box_room().with_record(metric_scale=METRES), path)
    return path


def test_it_lists_what_is_there_and_writes_what_is_asked_for(run, done, room_file, tmp_path):
    outcome = done("inventory", room_file, "-o", tmp_path / "a" / "room.csv", tmp_path / "room.svg")
    assert "table 1" in outcome.out and "1.4" in outcome.out and "as they were told" in outcome.out
    assert (tmp_path / "a" / "room.csv").is_file() and (tmp_path / "room.svg").is_file()
    said = run("inventory", room_file, "--json").json()
    assert said["counts"] == {"chair": 2, "door": 1, "table": 1} and len(said["things"]) == 4


def test_names_are_kept_in_the_scene(run, done, room_file, tmp_path):
    named, again = tmp_path / "named.langflash", tmp_path / "again.langflash"
    outcome = done("inventory", room_file, "--name", "chair 1=Oma's chair", "-o", named)
    assert "Oma's chair (chair 1)" in outcome.out
    assert load(named).record.thing_names == {"chair 1": "Oma's chair"} and load(named).record.world
    assert "Oma's chair" in run("inventory", named).out
    done("inventory", named, "--name", "chair 1=", "-o", again)
    assert load(again).record.thing_names == {}


def test_two_scenes_of_one_room_are_compared(run, done, room_file, tmp_path):
    before, after = tmp_path / "before.langflash", tmp_path / "after.langflash"
    textured = with_photos(_speckled(box_room().with_record(metric_scale=METRES)))
    save(textured, before)
    moved = ((CHAIRS[0][0] + 0.7, CHAIRS[0][1]), CHAIRS[1])
    save(with_photos(_speckled(box_room(chairs=moved).with_record(metric_scale=METRES))), after)
    outcome = done("inventory", before, "--beside", after, "--json", "--backend", "torch")
    said = json.loads(outcome.out)["beside"]
    assert [round(pair["by"], 1) for pair in said["moved"]] == [0.7]
    assert not said["came"] and not said["went"] and said["matches"] > 12
    outcome = run("inventory", room_file, "--beside", after)
    assert outcome.code == 2 and "photos" in outcome.err


def _speckled(scene):
    """Every Gaussian with a grey of its own place, so that photos of it can be matched."""
    from dataclasses import replace

    import torch

    generator = torch.Generator().manual_seed(5)
    fixed = 5568 + 6200  # walls, floor and ceiling come first, in both rooms
    grey = torch.rand(fixed, generator=generator) * 3 - 1.5
    sh = scene.gaussians.sh.clone()
    sh[:fixed] = grey[:, None, None]
    large, lens = replace(scene.gaussians, sh=sh), torch.tensor([4.0, 4.0, 1.0])[:, None]
    return replace(scene, gaussians=large, Ks=lens * scene.Ks, view_size=(384, 288))


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--name", "chair 9=x"), "there is no 'chair 9'"),
        (("--name", "chair 1"), "--name takes"),
        (("-o", "room.obj"), ".obj"),
        (("--threshold", "2"), "between 0 and 1"),
        (("--beside", "nowhere.langflash"), "nowhere"),
    ],
)
def test_bad_words_are_one_sentence(refused, room_file, tmp_path, monkeypatch, words, said):
    monkeypatch.chdir(tmp_path)
    assert said in refused("inventory", room_file, *words)
