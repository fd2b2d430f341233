"""What one scene is taught, another takes: the window's commands and their work, on two rooms."""

from dataclasses import replace

import pytest

from app.window.commands import apply
from app.window.editing import teaching, work
from app.window.editing.commands import RenameAtom, Undo
from app.window.scene.commands import SceneArrived
from app.window.scene.work import describe_scene
from app.window.state import State
from langflash_core.errors import PromptError
from langflash_core.language.lessons import read_lessons
from tests.app.cli.conftest import striped_photo, stripes
from tests.app.window.scenes import told


def opened(*seeds: int) -> State:
    """A window that shows a scene of striped photos."""
    scene = replace(stripes(), photos=tuple(map(striped_photo, seeds)) if seeds else ())
    return apply(State(), SceneArrived(describe_scene(scene, serial=1, name="stripes")))


def task(state: State):
    info, marks = state.scene.info, state.editing.marks
    assert info is not None and marks is not None
    return info.serial, info.memory, marks


def run(state: State, request) -> State:
    for command in request.run(lambda: False):
        state = apply(state, command)
    return state


def test_names_that_are_kept_in_one_room_are_taken_in_another_and_undone(tmp_path):
    path, first, second = tmp_path / "deep" / teaching.WORDS, opened(0, 1), opened(2, 3)
    first = apply(first, RenameAtom(1, "heirloom"))
    first = run(first, work.KeepLessons(*task(first), path))
    assert "Kept 1" in told(first) and [one.name for one in read_lessons(path).lessons] == ["heirloom"]
    second = apply(second, teaching.TakeWords())
    assert second.editing.waiting
    second = run(second, work.FindLessons(*task(second), path))
    assert not second.editing.waiting and "heirloom" in told(second)
    assert second.editing.marks is not None
    assert [atom.name for atom in second.editing.marks.atoms] == ["", "heirloom", ""]
    undone = apply(second, Undo())
    assert undone.editing.marks is not None and not any(atom.name for atom in undone.editing.marks.atoms)


def test_nothing_to_keep_or_to_take_is_said(tmp_path):
    path, state = tmp_path / teaching.WORDS, opened(0, 1)
    assert "Name a group first" in told(run(state, work.KeepLessons(*task(state), path)))
    assert "Nothing is saved yet" in told(run(state, work.FindLessons(*task(state), path)))
    assert "No group here" in told(apply(state, teaching.WordsFound(())))
    path.write_text("{")
    with pytest.raises(PromptError, match="no usable vocabulary"):
        run(state, work.FindLessons(*task(state), path))
