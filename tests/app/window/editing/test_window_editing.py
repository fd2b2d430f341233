"""Editing as a person does it: real clicks, drags and keys on a real window."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from imgui_bundle import icons_fontawesome_6 as fa

from langflash_core.scene.file import load
from tests.app.window.test_window import (
    CANVAS,
    LEFT,
    MIDDLE,
    PATIENCE,
    SIZE,
    TOP,
    Program,
    display,
    pytestmark,
    scene_file,
)

__all__ = ["display", "pytestmark", "scene_file"]  # fixtures and the mark of the window's tests

ACROSS, DOWN = SIZE[0] - LEFT, CANVAS[0].stop - TOP
CHAIR = (LEFT + ACROSS * 3 // 10, TOP + DOWN * 6 // 10)  # as in test_the_scene_is_drawn
HIDE = fa.ICON_FA_USER_SECRET
WALL = (LEFT + ACROSS * 13 // 20, TOP + DOWN * 3 // 10)  # below the bars, beside the axes


@pytest.fixture
def state_folder(tmp_path: Path, monkeypatch) -> Path:
    monkeypatch.setenv("LANGFLASH_STATE", str(tmp_path / "state"))
    return tmp_path / "state"


@pytest.fixture
def program(display: str, scene_file: Path, state_folder: Path) -> Iterator[Program]:
    running = Program(display, scene_file)
    running.until(lambda s: s["scene"] == "room.langflash", "the scene")
    running.at_rest()
    yield running
    running.leave()


def press(program: Program, key: str, tool: str) -> None:
    """Take a tool; on a busy machine the key may come before the window has the keyboard."""
    for _ in range(5):
        program.xdotool("mousemove", *map(str, MIDDLE), "key", key)
        with program._changed:
            if program._changed.wait_for(lambda: program._lines[-1]["tool"] == tool, PATIENCE / 5):
                return
    raise AssertionError(f"the tool stays {program.state['tool']}")


def reddened(picture: np.ndarray, before: np.ndarray) -> int:
    """Pixels of the canvas that are redder than before."""
    canvas = (slice(TOP + 140, CANVAS[0].stop), slice(LEFT + 60, SIZE[0] - 20))
    more = (picture[canvas].astype(int) - before[canvas])[..., :3]
    return int((more[..., 0] - more[..., 1:].mean(-1) > 20).sum())


def move(program: Program, at: tuple[int, int]) -> None:
    program.xdotool("mousemove", *map(str, at))


def drag_with(program: Program, key: str) -> None:
    """Drag by 30 x 30 pixels with a modifier held; the pauses let a busy machine see it held."""
    drag = ("mousedown", "1", "mousemove_relative", "30", "30", "sleep", "0.3", "mouseup", "1")
    program.xdotool("keydown", key, *drag, "sleep", "0.3", "keyup", key)


def test_brush_delete_undo_save(program: Program, tmp_path: Path) -> None:
    plain = program.picture()
    press(program, "b", "BRUSH")
    move(program, CHAIR)
    program.xdotool("mousedown", "1", "mousemove_relative", "12", "8", "mouseup", "1")
    state = program.until(lambda s: s["selected"] > 0 and not s["waiting"], "a selection")
    count = state["selected"]
    assert state["edits"] == [f"Select {count:,} with the brush"] and 50 < count < 2500
    move(program, WALL)
    program.at_rest()
    blue = program.picture()
    x, y = CHAIR[0] - LEFT, CHAIR[1] - TOP
    assert blue[y, x, 2] > blue[y, x, 0] and plain[y, x, 0] > 2 * plain[y, x, 2]
    program.xdotool("key", "Delete")
    program.until(lambda s: s["deleted"] == count and s["selected"] == 0, "the deletion")
    program.at_rest()
    # Where the red block was, the grey wall or the brown floor behind it shows.
    hole = program.picture()[y, x]
    assert hole[0] < 2 * max(hole[1], 1)
    program.xdotool("key", "ctrl+z")
    program.until(lambda s: s["deleted"] == 0 and s["selected"] == count and s["undone"] == 1, "undo")
    program.xdotool("key", "ctrl+z")
    program.until(lambda s: s["selected"] == 0 and s["edits"] == [], "undo of the selection")
    program.at_rest()
    around = (slice(y - 30, y + 30), slice(x - 60, x + 200))  # without the tools on the left
    assert np.array_equal(program.picture()[around], plain[around])
    program.xdotool("key", "ctrl+y", "key", "ctrl+shift+z")
    state = program.until(lambda s: s["deleted"] == count, "redo")
    assert state["unsaved"]
    program.xdotool("key", "ctrl+s")
    program.until(lambda s: s["dialog"] == "save", "the dialog")
    program.at_rest()
    program.xdotool("key", "ctrl+a")
    program.xdotool("type", "--delay", "20", str(tmp_path / "edited"))
    program.xdotool("key", "Return")
    state = program.until(lambda s: s["scene"] == "edited.langflash" and not s["unsaved"], "the saved scene")
    assert any("edited.langflash" in toast for toast in state["toasts"])
    assert len(load(tmp_path / "edited.langflash").gaussians) == 12_300 - count
    assert state["gl_errors"] == []


def test_what_is_deleted_is_not_found_until_it_is_back(program: Program) -> None:
    """In the colours, where nothing but the score needs the answer again."""
    program.type_prompt("armchair")
    program.until(lambda s: s["prompts"][0][2] is True, "the armchair")
    program.click("##select")
    state = program.until(lambda s: s["selected"] > 0 and not s["waiting"], "its Gaussians")
    assert state["mode"] == "rgb" and state["prompts"][0][2] is True
    program.xdotool("mousemove", *map(str, MIDDLE), "click", "1", "sleep", "0.3", "key", "Delete")
    program.until(lambda s: s["deleted"] == 2500 and s["prompts"][0][2] is False, "not found")
    program.xdotool("key", "ctrl+z")
    program.until(lambda s: s["deleted"] == 0 and s["prompts"][0][2] is True, "found again")
    assert program.state["gl_errors"] == []


def test_a_click_takes_a_thing_with_a_line_around_it_and_the_wheel_less_of_it(program: Program) -> None:
    press(program, "c", "PICK")
    before = program.picture()
    program.xdotool("mousemove", *map(str, CHAIR), "sleep", "0.25", "click", "1")
    state = program.until(lambda s: s["selected"] == 2500 and s["lines"] == 1, "the chair and its line")
    level, count = state["level"]
    assert level > 0 and count > level, "its checks are parts of it"
    program.until_changed(before, 0.5)
    wheel = ("keydown", "ctrl", "click", "5", "keyup", "ctrl")
    pose = state["pose"]
    program.xdotool(*wheel)
    less = program.until(lambda s: 0 < s["selected"] < 2500 and s["lines"] is not None, "less of it")
    assert less["level"] == [level - 1, count] and less["pose"] == pose, "it is not zoomed"
    assert len(less["edits"]) == len(state["edits"])
    program.xdotool("key", "bracketright")
    program.until(lambda s: s["selected"] == 2500, "all of it")
    left, top, _, bottom = program.box("##level")
    program.xdotool("mousemove", str(left + 3), str((top + bottom) // 2), "sleep", "0.25", "click", "1")
    program.until(lambda s: s["level"] == [0, count], "the least of it")
    floor = WALL[0], TOP + DOWN * 8 // 10  # right of the photos
    program.xdotool("mousemove", *map(str, floor), "keydown", "shift", "sleep", "0.3", "click", "1")
    program.xdotool("sleep", "0.3", "keyup", "shift")
    more = program.until(lambda s: len(s["edits"]) == len(state["edits"]) + 1, "the floor beside it")
    assert more["edits"][-1].startswith("Add ") and more["selected"] > 2000


def test_what_is_this_and_find_similar(program: Program) -> None:
    press(program, "x", "POINT")
    move(program, CHAIR)
    state = program.until(lambda s: s["shares"] is not None, "the groups under the pointer")
    # The front of the block stands at z = 0.65; a few percent of what is behind, at up to 1.3, shine through.
    assert abs(state["hover"][2] - 0.65) < 0.05 and state["shares"]["0"] > 0.9
    program.xdotool("click", "1")
    state = program.until(lambda s: s["words"], "the words")
    assert state["words"][0] == "armchair"
    move(program, WALL)
    program.xdotool("click", "1")
    program.until(lambda s: s["words"] and s["words"][0] == "wall", "the wall")
    program.xdotool("key", "Escape")
    program.until(lambda s: s["words"] is None and not s["closed"], "the closed card")
    program.xdotool("key", "Escape")
    state = program.until(lambda s: s["tool"] == "MOVE", "the tool put away")
    assert not state["closed"] and state["gl_errors"] == []


def test_a_box_with_shift_adds_and_with_ctrl_removes(program: Program) -> None:
    press(program, "r", "BOX")
    move(program, CHAIR)
    program.xdotool("mousedown", "1", "mousemove_relative", "30", "30", "mouseup", "1")
    first = program.until(lambda s: s["selected"] > 0 and not s["waiting"], "a selection")["selected"]
    move(program, WALL)
    drag_with(program, "shift")
    more = program.until(lambda s: s["selected"] > first and not s["waiting"], "more")["selected"]
    move(program, CHAIR)
    drag_with(program, "ctrl")
    state = program.until(lambda s: s["selected"] == more - first, "less")
    assert [label.split()[0] for label in state["edits"]] == ["Select", "Add", "Unselect"]
    assert state["pose"] == [0, 0, 0, 1, 0, 0, 0]  # the camera stood still all the while


def test_a_polygon_is_clicked_corner_by_corner_and_a_lasso_is_drawn(program: Program) -> None:
    press(program, "l", "LASSO")
    x, y = CHAIR
    for across, down in ((-30, -30), (30, -30), (30, 30), (-30, 30)):
        move(program, (x + across, y + down))
        program.xdotool("sleep", "0.5", "click", "1", "sleep", "0.5")
    assert program.state["selected"] == 0, "a polygon waits for its last corner"
    move(program, (x - 29, y - 30))
    program.xdotool("sleep", "0.5", "click", "1")
    clicked = program.until(lambda s: s["selected"] > 0 and not s["waiting"], "the polygon")["selected"]
    program.xdotool("key", "ctrl+z")
    program.until(lambda s: s["selected"] == 0, "undo")
    move(program, (x - 30, y - 30))
    sides = ((30, 0), (30, 0), (0, 30), (0, 30), (-30, 0), (-30, 0))
    steps = [("mousemove_relative", "--", *map(str, side), "sleep", "0.7") for side in sides]
    program.xdotool("sleep", "0.7", "mousedown", "1", "sleep", "0.7", *sum(steps, ()), "mouseup", "1")
    drawn = program.until(lambda s: s["selected"] > 0 and not s["waiting"], "the lasso")["selected"]
    assert drawn == pytest.approx(clicked, rel=0.1)


def test_a_thing_is_hidden_for_good_and_brought_back_until_it_is_saved(program: Program) -> None:
    plain = program.picture()
    press(program, "c", "PICK")
    move(program, CHAIR)
    program.xdotool("click", "1")
    program.until(lambda s: s["selected"] > 2000 and not s["waiting"], "the block")
    program.click(HIDE)
    program.until(lambda s: s["hiding"] == "blur", "the ways to hide it")
    program.click("##pixels")
    state = program.until(lambda s: s["hiding"] == "pixels" and s["hides"], "the other way, and its margin")
    few = state["hides"]
    program.at_rest()
    narrow = program.picture()
    _, top, right, bottom = program.state["items"]["##margin"][0]
    program.xdotool("mousemove", str(right - 30), str((top + bottom) // 2), "click", "1")
    program.until(lambda s: s["margin"] > 0.15 and s["hides"] > 1.2 * few, "a wider margin")
    program.at_rest()
    # The ring of a wider margin, 1,600 pixels and more; none where nothing turns red.
    assert reddened(program.picture(), narrow) > 1000, "what goes with it is red, and at once"
    program.click("##for good")
    state = program.until(lambda s: s["unhidden"] and s["job"] is None, "the hidden scene")
    assert state["unsaved"] and any("Ctrl+Z brings it back" in toast for toast in state["toasts"])
    move(program, WALL)
    program.at_rest()
    assert not np.array_equal(program.picture(), plain)
    program.xdotool("key", "ctrl+z")
    state = program.until(lambda s: not s["unhidden"] and s["selected"] > 2000, "what was on show before")
    assert state["gl_errors"] == []
