"""Far aside of the photos as a person meets it: the orbit slows down, the picture fades, both can be off."""

import math
from dataclasses import replace
from pathlib import Path

import torch

from langflash_core.language.spaces import language_space
from langflash_core.scene.file import save
from tests.app.window.scenes import PHRASES, room
from tests.app.window.test_window import MIDDLE, Program, display, pytestmark

__all__ = ["display", "pytestmark"]  # the fixture and the mark of the window's tests


def turned(state: dict) -> float:
    """Degrees from the first photo's view."""
    return math.degrees(2 * math.acos(min(1.0, abs(state["pose"][3]))))


def drag(program: Program, right: int) -> dict:
    program.xdotool("mousemove", *map(str, MIDDLE))
    program.xdotool("keydown", "alt", "mousedown", "1", "mousemove_relative", "--", str(right), "0")
    program.xdotool("mouseup", "1", "keyup", "alt")
    return program.at_rest()


def keep_or_not(program: Program) -> None:
    """Switch over whether it keeps to what the photos saw."""
    program.xdotool("key", "ctrl+p", "sleep", "0.5", "type", "--delay", "5", "stay near the")
    program.until(lambda s: s["dialog"] == "palette", "the palette")
    program.xdotool("sleep", "0.5", "key", "Return")
    program.until(lambda s: s["dialog"] is None, "the command")
    program.at_rest()


def test_orbits_keep_to_the_photos_until_told_otherwise(display: str, tmp_path: Path) -> None:
    made = room(language_space("minilm").encode(list(PHRASES)))
    path = tmp_path / "room.langflash"
    save(replace(made, view_ids=torch.zeros(len(made.gaussians), dtype=torch.int64)), path)
    program = Program(display, path)
    program.until(lambda s: s["scene"] == "room.langflash", "the scene")
    program.at_rest()
    drag(program, -200)
    held = turned(drag(program, -200))
    assert 15 < held < 60  # where nearly a third of the picture would be black
    keep_or_not(program)
    drag(program, -200)
    assert turned(program.state) > held + 40
    whole = program.picture()
    keep_or_not(program)
    program.until_changed(whole, 1.0)
    program.at_rest()
    assert program.picture().mean() < whole.mean() - 1  # far aside it fades
    assert program.state["gl_errors"] == []
    program.leave()
