"""What is remembered of the scene on show: as computed anew, once, and no longer than it is shown."""

import gc
import weakref
from dataclasses import replace
from pathlib import Path

import torch

from app.window.scene.commands import SceneArrived
from langflash_core.scene.changed import changed_scene
from langflash_core.scene.changes import Moved
from langflash_core.scene.edits import Marks
from langflash_core.scene.mask import Mask
from tests.app.window.scenes import after, room, shown_scene

COUNT = len(room(torch.eye(3)).gaussians)
ONE, ALL = Mask.first(COUNT, 9), Mask.full(COUNT)
MOVES = (Moved(ONE, offset=(0.5, 0.0, 0.1)), Moved(ALL, scale=1.5), Moved(ONE, offset=(0.0, -0.3, 0.0)))


def marks_of(*moves: Moved) -> Marks:
    return replace(Marks.without_edits(COUNT, 3), changes=moves)


def test_going_on_from_what_is_there_is_the_same_as_from_the_beginning() -> None:
    info = shown_scene().scene.info
    assert info is not None
    memory = info.memory
    for count in (0, 1, 2, 3, 2, 1, 3):
        found = memory.changed(marks_of(*MOVES[:count]), MOVES[0]).gaussians
        wanted = changed_scene(info.scene, marks_of(*MOVES[:count]), MOVES[0]).gaussians
        for name, values in vars(wanted).items():
            assert torch.equal(values, getattr(found, name)), (count, name)
    once = memory.changed(marks_of(*MOVES))
    assert memory.changed(marks_of(*MOVES)).gaussians is once.gaussians
    assert memory.changed(marks_of()) is info.scene


def test_a_question_is_asked_again_only_about_something_else() -> None:
    info = shown_scene().scene.info
    assert info is not None
    asked = list[str]()

    def ask(question: str, about: str) -> int:
        return info.memory.answered(question, (about,), lambda: asked.append(about) or len(asked))

    assert [ask("middle", "a"), ask("middle", "a"), ask("luma", "a"), ask("middle", "b")] == [1, 1, 2, 3]
    assert asked == ["a", "a", "b"]


def test_the_memory_stays_with_its_scene_and_goes_when_another_is_shown() -> None:
    state = shown_scene()
    info = state.scene.info
    assert info is not None and replace(info, name="kitchen").memory is info.memory
    other = replace(info.scene, gaussians=info.scene.gaussians.map(torch.clone))
    assert replace(info, scene=other).memory.scene is other
    kept = weakref.ref(info.memory.changed(marks_of(*MOVES)).gaussians)
    gc.collect()
    assert kept() is not None
    state = after(state, SceneArrived(replace(info, serial=2, scene=other, path=Path("/rooms/b"))))
    assert state.scene.rooms[0].info.scene is info.scene
    del info
    gc.collect()
    assert kept() is None
