"""Edits that survive a crash."""

import os
from pathlib import Path

import numpy as np
import pytest
import torch

from app.window.recovery import edits, work
from app.window.requests import Task
from app.window.scene.work import LoadScene, describe_scene
from langflash_core.language.spaces import language_space
from langflash_core.scene import edits_file
from langflash_core.scene.edits import Mask, delete, rename_atom
from tests.app.window.scenes import PHRASES, room


@pytest.fixture(scope="module")
def info():
    return describe_scene(room(language_space("minilm").encode(list(PHRASES))), serial=3, name="room")


@pytest.fixture(autouse=True)
def state_folder(tmp_path: Path, monkeypatch) -> Path:
    monkeypatch.setenv("LANGFLASH_STATE", str(tmp_path / "state"))
    return tmp_path / "state"


def edited(info):
    history = info.history.edited("Delete 5", delete(info.history.marks, Mask.of(np.arange(12_300) < 5)))
    return history.edited("Name", rename_atom(history.marks, 1, "Wand"))


def done(request: Task) -> list:
    """The commands that a request comes to."""
    return list(request.run(lambda: False))


def restore(offer) -> object:
    job = LoadScene(offer.edits.with_suffix(".langflash"), offer.edits)
    return job.run(9, lambda *_: None, lambda: False).info


def test_edits_are_offered_and_restored_whole(info, state_folder: Path) -> None:
    assert edits.find(info.scene) is None
    history = edited(info)
    place = ("room", Path("/p/room.langflash"), "me")
    assert done(work.KeepEdits(info.serial, info.scene, history, *place))
    offer = edits.find(info.scene)
    assert offer is not None and (offer.name, offer.count) == ("room", 2)
    again = restore(offer)
    assert again.history == history and again.name == "room" and again.path == Path("/p/room.langflash")  # type: ignore[attr-defined]
    assert edits.find(None) == offer
    assert done(work.Forget(lambda: edits.forget_edits(info.scene, "somebody else"))) == []
    assert edits.find(info.scene) == offer
    assert done(work.Forget(lambda: edits.forget_edits(info.scene, "me"))) == []
    assert edits.find(info.scene) is None and list(state_folder.iterdir()) == []


def test_edits_of_a_saved_scene_are_found_by_its_path(info) -> None:
    edits.keep(info.scene, edited(info), "room", Path("/p/room.langflash"), "me")
    other = describe_scene(room(torch.eye(3)), serial=4, name="other").scene
    assert edits.find(other) is None
    assert edits.find(other, Path("/p/room.langflash")) is not None


def test_only_the_newest_are_kept_and_damaged_ones_passed_over(info, state_folder: Path) -> None:
    for number in range(edits.MOST_KEPT + 2):
        file = edits.keep(info.scene, edited(info), f"room {number}", None, f"t{number}")
        os.utime(file, (1000 + number, 1000 + number))
    assert len(list(state_folder.glob("*.edits"))) == edits.MOST_KEPT
    newest = edits.find(info.scene)
    assert newest is not None and newest.name == f"room {edits.MOST_KEPT + 1}"
    newest.edits.write_text("{")
    passed = edits.find(info.scene)
    assert passed is not None and passed.name == f"room {edits.MOST_KEPT}"


@pytest.mark.parametrize("when", ["before", "after"])
def test_edits_that_another_window_removes_meanwhile_are_passed_over(info, monkeypatch, when: str) -> None:
    """Between the list and the look, or between that and the time of the file."""
    for number in range(2):
        file = edits.keep(info.scene, edited(info), f"room {number}", None, f"t{number}")
        os.utime(file, (1000 + number, 1000 + number))
    looked = edits_file.read_about

    def read_about(path: Path) -> tuple[str, dict, int]:
        about = looked(path)
        if path == file:
            path.unlink()  # its scene, as yet, is there
        return looked(path) if when == "before" else about

    monkeypatch.setattr(edits_file, "read_about", read_about)
    offer = edits.find(info.scene)
    assert offer is not None and offer.name == "room 0"
