"""Keys belong to what had the focus when they were pressed, however late the window comes to them.

The window is stopped, as a slow frame would hold it, while a person goes on; then it sees all at once.
"""

import itertools
from pathlib import Path

import numpy as np

from app.window.kit import theme
from tests.app.window.test_window import (
    LEFT,
    MIDDLE,
    SIZE,
    Program,
    display,
    program,
    pytestmark,
    scene_file,
)

__all__ = ["display", "program", "pytestmark", "scene_file"]  # fixtures and the mark of the window's tests


def test_ctrl_a_in_a_field_that_was_just_clicked_is_the_fields(program: Program) -> None:
    x, y = map(str, program.field)
    with program.stopped():
        program.xdotool("mousemove", x, y, "click", "1", "key", "ctrl+a", "type", "wall")
    state = program.until(lambda s: s["prompts"][0][0] == "wall", "the phrase")
    assert state["selected"] == 0 and state["edits"] == []
    with program.stopped():
        program.xdotool("key", "ctrl+a", "type", "floor")
    state = program.until(lambda s: s["prompts"][0][0] == "floor", "the phrase over the first")
    assert state["selected"] == 0 and state["tool"] == "MOVE"


def test_ctrl_a_after_a_click_on_the_picture_is_the_pictures(program: Program) -> None:
    x, y = map(str, program.field)
    program.xdotool("mousemove", x, y, "click", "1")
    program.at_rest()
    with program.stopped():
        program.xdotool("mousemove", *map(str, MIDDLE), "click", "1", "key", "ctrl+a")
    state = program.until(lambda s: s["selected"] == 12_300, "everything selected")
    assert state["prompts"][0][0] == "floor"
    program.xdotool("key", "ctrl+z")
    program.until(lambda s: s["selected"] == 0, "undo")


def test_letters_for_a_dialog_that_opens_late_are_the_dialogs(program: Program, tmp_path: Path) -> None:
    with program.stopped():
        program.xdotool("key", "ctrl+s", "key", "ctrl+a", "type", "--delay", "5", str(tmp_path / "bcrvx"))
        program.xdotool("key", "Return")
    state = program.until(lambda s: s["scene"] == "bcrvx.langflash", "the saved scene")
    assert state["tool"] == "MOVE" and state["selected"] == 0 and state["dialog"] is None


def test_ctrl_f_enter_and_letters_that_come_at_once(program: Program) -> None:
    """The letters are those of tools and of flying; none is taken."""
    program.xdotool("mousemove", *map(str, MIDDLE), "click", "1")
    before = program.at_rest()
    with program.stopped():
        program.xdotool("key", "ctrl+f", "type", "--delay", "5", "wascrvbx")
        program.xdotool("key", "Return", "type", "--delay", "5", "wdqehgf")
    state = program.until(lambda s: [p[0] for p in s["prompts"]] == ["wascrvbx", "wdqehgf"], "two phrases")
    assert state["tool"] == "MOVE" and state["selected"] == 0 and state["pose"] == before["pose"]
    assert state["recent"][0] == "wascrvbx"
    program.xdotool("key", "Return")
    program.until(lambda s: len(s["prompts"]) == 3, "a third row")
    program.xdotool("key", "Escape", "mousemove", *map(str, MIDDLE), "click", "1")


def test_a_command_by_its_name(program: Program) -> None:
    with program.stopped():
        program.xdotool("key", "ctrl+p", "type", "--delay", "5", "depth")
    program.until(lambda s: s["dialog"] == "palette", "the palette")
    program.xdotool("key", "Return")
    program.until(lambda s: s["mode"] == "depth" and s["dialog"] is None, "the depth")
    program.xdotool("key", "ctrl+p", "sleep", "0.5", "type", "--delay", "5", "select")
    program.until(lambda s: sum(name.startswith("Select") for name in s["items"]) > 4, "what fits")
    program.xdotool("key", "Down", "key", "Up", "key", "Down", "key", "Return")
    state = program.until(lambda s: s["dialog"] is None, "the second one")
    program.xdotool("key", "ctrl+p", "sleep", "0.5", "key", "Escape")
    state = program.until(lambda s: s["dialog"] is None, "nothing done")
    assert state["gl_errors"] == []


def focused(program: Program) -> np.ndarray:
    """(h, w) bool: pixels of the screen in the colour of the focus."""
    accent = 255 * np.array([theme.DARK.ACCENT.x, theme.DARK.ACCENT.y, theme.DARK.ACCENT.z])
    return abs(program.client.picture(*SIZE).astype(float) - accent).max(-1) < 8


def test_tab_shows_where_the_keys_go_and_f6_goes_to_the_next_area(program: Program) -> None:
    program.xdotool("mousemove", *map(str, MIDDLE), "click", "1")
    program.at_rest()
    seen = [focused(program)]
    for key in ("Tab", "Tab", "F6", "F6"):
        program.xdotool("key", key, "sleep", "1.5")
        seen.append(focused(program))
    for before, after in itertools.pairwise(seen):
        assert (before != after).sum() > 60  # a frame of some hundred pixels moves on
    left, right = seen[2][:, :LEFT], seen[3][:, LEFT:]
    assert (left & ~seen[0][:, :LEFT]).sum() > 60 and (right & ~seen[0][:, LEFT:]).sum() > 60
    program.xdotool("key", "Escape")
