"""The gizmo as a person uses it: real drags and keys on a real window, and a crash in between."""

import os
import signal
from pathlib import Path

import numpy as np
import torch

from app.window.scene.work import describe_scene
from langflash_core.geometry.poses import project
from tests.app.window.editing.test_window_editing import (
    ACROSS,
    CHAIR,
    DOWN,
    move,
    press,
    program,
    state_folder,
)
from tests.app.window.scenes import CHAIR as BLOCK
from tests.app.window.scenes import room
from tests.app.window.test_window import (
    LEFT,
    MIDDLE,
    PATIENCE,
    TOP,
    Program,
    display,
    pytestmark,
    scene_file,
)

__all__ = ["display", "program", "pytestmark", "scene_file", "state_folder"]  # fixtures and the mark

ARROW = 60  # pixels from the gizmo's middle that lie on its x arrow


def middle(right: float = 0.0) -> tuple[int, int]:
    """Where the window shows the middle of the block's front, so far to the right in the scene."""
    pose = describe_scene(room(torch.eye(3)), 1, "room").views[0]
    x, y, z = BLOCK
    found = project(np.array([[x + right, y, z - 0.2]]), pose, (ACROSS, DOWN))
    assert found is not None
    return LEFT + round(float(found[1][0, 0])), TOP + round(float(found[1][0, 1]))


def drag_right(program: Program, by: int) -> None:
    """The gizmo's x arrow, in steps that a busy machine sees."""
    x, y = middle()
    move(program, (x + ARROW, y))
    steps = [word for _ in range(4) for word in ("mousemove_relative", str(by // 4), "0", "sleep", "0.2")]
    program.xdotool("sleep", "0.5", "mousedown", "1", "sleep", "0.3", *steps, "mouseup", "1")


def test_a_thing_is_moved_by_the_gizmo_recoloured_and_outlives_a_crash(
    program: Program, scene_file: Path, state_folder: Path, display: str
) -> None:
    press(program, "y", "PLACE")
    move(program, CHAIR)
    program.xdotool("click", "1")
    program.until(lambda s: s["selected"] == 2500 and not s["waiting"], "the block")
    program.at_rest()
    before = program.picture()
    drag_right(program, 80)
    state = program.until(lambda s: s["changes"] == ["Moved"] and s["gesture"] is None, "the move")
    assert state["edits"] == ["Select 2,500 of a thing", "Move 2,500"] and state["unsaved"]
    assert state["pose"] == [0, 0, 0, 1, 0, 0, 0]  # the camera stood still all the while
    move(program, MIDDLE)
    program.until_changed(before, 1.0)
    program.xdotool("key", "ctrl+z")
    state = program.until(lambda s: s["changes"] == [] and s["undone"] == 1, "one undo for one drag")
    assert state["selected"] == 2500
    program.xdotool("key", "ctrl+y")
    program.until(lambda s: s["changes"] == ["Moved"], "redo")
    program.xdotool("key", "ctrl+Right", "sleep", "0.3", "key", "ctrl+t")
    program.until(lambda s: len(s["edits"]) == 3 and s["gesture"] == "Recoloured", "a step and a tint")
    program.click("Recolour")
    state = program.until(lambda s: s["changes"] == ["Moved", "Recoloured"], "the new colour")
    assert state["edits"][2:] == ["Move 2,500", "Recolour 2,500"] and state["gl_errors"] == []
    left = PATIENCE
    while not any(b"Recolour" in file.read_bytes() for file in state_folder.glob("*.edits")) and left > 0:
        program.at_rest()
        left -= 1
    os.kill(program.pid, signal.SIGKILL)
    again = Program(display, scene_file)
    again.until(lambda s: s["offer"] == 4, "the offer")
    again.at_rest()
    again.click("Restore")
    state = again.until(lambda s: s["changes"] == ["Moved", "Recoloured"] and s["job"] is None, "all of it")
    assert state["edits"][-1] == "Recolour 2,500" and state["gl_errors"] == []
    again.leave()


def test_escape_puts_a_thing_back_while_it_is_dragged_and_the_camera_still_orbits(program: Program) -> None:
    press(program, "y", "PLACE")
    move(program, CHAIR)
    program.xdotool("click", "1")
    program.until(lambda s: s["selected"] == 2500 and not s["waiting"], "the block")
    program.at_rest()
    x, y = middle()
    move(program, (x + ARROW, y))
    program.xdotool("sleep", "0.5", "mousedown", "1", "sleep", "0.3", "mousemove_relative", "40", "0")
    program.until(lambda s: s["gesture"] == "Moved", "the gesture")
    program.xdotool("key", "Escape")
    program.until(lambda s: s["gesture"] is None, "the way back")
    program.xdotool("mouseup", "1")
    state = program.at_rest()
    assert state["changes"] == [] and state["edits"] == ["Select 2,500 of a thing"]
    move(program, (LEFT + ACROSS * 3 // 4, TOP + DOWN // 2))  # far from the gizmo
    program.xdotool("mousedown", "1", "mousemove_relative", "60", "0", "sleep", "0.3", "mouseup", "1")
    state = program.until(lambda s: s["pose"] != [0, 0, 0, 1, 0, 0, 0], "an orbit")
    assert state["changes"] == [] and state["gl_errors"] == []
