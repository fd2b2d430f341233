"""Parallel rays as a person meets them: a key, the keys of the sides, a ruler in the plan, the way back."""

from pathlib import Path

import numpy as np
import pytest

from tests.app.window.scenes import CHAIR
from tests.app.window.test_window import MIDDLE, Program, display, pytestmark, scene_file

__all__ = ["display", "pytestmark", "scene_file"]  # fixtures and the mark of the window's tests


def test_a_plan_of_the_room_is_a_key_away(display: str, scene_file: Path) -> None:
    program = Program(display, scene_file)
    program.until(lambda s: s["scene"] == "room.langflash", "the scene")
    program.xdotool("mousemove", *map(str, MIDDLE))
    perspective, before = program.at_rest(), program.picture()
    program.xdotool("key", "comma")
    program.until(lambda s: s["span"] is not None, "parallel rays")
    program.until_changed(before, 1.0)
    flat = program.at_rest()
    program.xdotool("key", "KP_7")
    program.until(lambda s: s["pose"] != flat["pose"] and not s["flying"], "the look from above")
    program.xdotool("key", "z")
    framed = program.until(lambda s: s["span"] != flat["span"] and not s["flying"], "all of it")
    program.at_rest()
    assert framed["span"] > 2.4  # the floor is as wide
    assert np.ptp(program.picture()) > 50
    program.xdotool("key", "x", "sleep", "0.5", "mousemove", *map(str, (MIDDLE[0] + 1, MIDDLE[1])))
    hover = program.until(lambda s: s["hover"] is not None, "a place under the pointer")["hover"]
    assert abs(hover[0]) < 0.1, "in the middle of the room, whatever its depth"
    assert hover[1] == pytest.approx(0.4, abs=0.05) or hover[1] < CHAIR[1]  # the floor, or what stands on it
    program.xdotool("key", "v", "sleep", "0.3", "key", "comma")
    program.until(lambda s: s["span"] is None, "perspective again")
    program.xdotool("key", "h")
    home = program.until(lambda s: s["view"] == 0 and not s["flying"], "the first photo")
    assert home["pose"] == perspective["pose"] and home["gl_errors"] == []
    program.leave()
