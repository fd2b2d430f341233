"""Keys belong to what had the focus when they were pressed, however late the window comes to them.

The window is stopped, as a slow frame would hold it, while a person goes on; then it sees all at once.
"""

import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.app.window.journey import PHOTOS
from tests.app.window.test_window import MIDDLE, SIZE, Program, display, pytestmark, scene_file, x_server

__all__ = ["display", "pytestmark", "scene_file"]  # fixtures and the mark of the window's tests


@pytest.fixture(scope="module")
def program(display: str, scene_file: Path) -> Iterator[Program]:
    running = Program(display, scene_file)
    running.until(lambda s: s["scene"] == "room.langflash", "the scene")
    running.at_rest()
    yield running
    running.leave()


@contextmanager
def held(program: Program) -> Iterator[None]:
    """While the window does nothing."""
    os.kill(program._process.pid, signal.SIGSTOP)
    try:
        yield
    finally:
        os.kill(program._process.pid, signal.SIGCONT)


def test_ctrl_a_in_a_field_that_was_just_clicked_is_the_fields(program: Program) -> None:
    x, y = map(str, program.field)
    with held(program):
        program.xdotool("mousemove", x, y, "click", "1", "key", "ctrl+a", "type", "wall")
    state = program.until(lambda s: s["prompts"][0][0] == "wall", "the phrase")
    assert state["selected"] == 0 and state["edits"] == []
    with held(program):
        program.xdotool("key", "ctrl+a", "type", "floor")
    state = program.until(lambda s: s["prompts"][0][0] == "floor", "the phrase over the first")
    assert state["selected"] == 0 and state["tool"] == "MOVE"


def test_ctrl_a_after_a_click_on_the_picture_is_the_pictures(program: Program) -> None:
    x, y = map(str, program.field)
    program.xdotool("mousemove", x, y, "click", "1")
    program.at_rest()
    with held(program):
        program.xdotool("mousemove", *map(str, MIDDLE), "click", "1", "key", "ctrl+a")
    state = program.until(lambda s: s["selected"] == 12_300, "everything selected")
    assert state["prompts"][0][0] == "floor"
    program.xdotool("key", "ctrl+z")
    program.until(lambda s: s["selected"] == 0, "undo")


def test_letters_for_a_dialog_that_opens_late_are_the_dialogs(program: Program, tmp_path: Path) -> None:
    with held(program):
        program.xdotool("key", "ctrl+s", "key", "ctrl+a", "type", "--delay", "5", str(tmp_path / "bcrvx"))
        program.xdotool("key", "Return")
    state = program.until(lambda s: s["scene"] == "bcrvx.langflash", "the saved scene")
    assert state["tool"] == "MOVE" and state["selected"] == 0 and state["dialog"] is None


def test_escape_cancels_a_job() -> None:
    with x_server(*SIZE) as own:  # the window of the other tests has the keys of theirs
        running = Program(own, *PHOTOS)
        running.until(lambda s: s["job"] not in (None, "starting"), "a stage")
        running.xdotool("key", "Escape")
        state = running.until(lambda s: s["job"] is None, "the end of the job")
        assert state["scene"] is None and state["toasts"] == ["Stopped."]
        running.leave()
