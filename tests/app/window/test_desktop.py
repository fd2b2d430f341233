"""Where the window opens: wholly on a screen, as large as it was."""

import json
import logging
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import glfw
import pytest

from app.window.desktop import Rect, fitted, open_window
from app.window.recovery import preferences
from tests.app.window.test_window import ROOT, pytestmark, x_server
from tests.app.window.x11 import Client

__all__ = ["pytestmark"]

BARE, FRAME = (0, 0, 0, 0), (2, 30, 2, 4)
ONE, BESIDE, ABOVE = (0, 27, 1920, 1053), (1920, 0, 2560, 1440), (0, -1080, 1920, 1040)
OPENED = """
import glfw, json
from app.window.session import Session
session = Session()
print(json.dumps([*glfw.get_window_pos(session._window), *glfw.get_window_size(session._window)]))
session.close()
"""


@pytest.mark.parametrize(
    ("wanted", "areas", "frame", "expected"),
    [
        ((100, 100, 1280, 800), [ONE], BARE, (100, 100, 1280, 800)),
        ((0, 0, 1920, 1200), [ONE], BARE, (0, 27, 1920, 1053)),  # 1280 x 800 at 150 %
        ((0, 0, 1920, 1200), [ONE], FRAME, (2, 57, 1916, 1019)),
        ((5000, 3000, 1280, 800), [ONE, BESIDE], BARE, (640, 280, 1280, 800)),  # of a screen that is gone
        ((-30, 40, 1000, 700), [ONE], FRAME, (2, 57, 1000, 700)),
        ((2000, 100, 2400, 1300), [ONE, BESIDE], BARE, (2000, 100, 2400, 1300)),
        ((2000, 100, 2400, 1300), [ONE], BARE, (0, 27, 1920, 1053)),
        ((300, -1000, 1000, 700), [ONE, ABOVE], FRAME, (300, -1000, 1000, 700)),
        ((1500, 100, 1000, 700), [ONE, BESIDE], BARE, (1920, 100, 1000, 700)),  # more of it is there
        ((10, 10, 1280, 800), [], BARE, (10, 10, 1280, 800)),
    ],
)
def test_a_window_is_wholly_on_the_screen_that_shows_most_of_it(
    wanted: Rect, areas: list[Rect], frame: tuple[int, int, int, int], expected: Rect
) -> None:
    assert fitted(wanted, areas, frame) == expected
    assert fitted(expected, areas, frame) == expected, "the next start changes nothing"


def test_what_glfw_complains_of_is_not_written_to_the_terminal(monkeypatch, capfd) -> None:
    """A raw line stood there at the start, of which nobody could make anything."""
    told: list[Any] = []
    doing = ("init", "window_hint", "make_context_current", "swap_interval")
    for name in doing:
        monkeypatch.setattr(glfw, name, lambda *_: True)
    monkeypatch.setattr(glfw, "create_window", lambda *_: object())
    monkeypatch.setattr(glfw, "set_error_callback", told.append)
    monkeypatch.setattr(logging.getLogger(), "handlers", [])  # as without pytest: the last resort writes
    open_window((900, 560))
    told[-1](65544, b"X11: something of no consequence")
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize(("there", "asked"), [((4, 3), [4]), ((3,), [4, 3])])
def test_opengl_4_3_is_asked_for_first(monkeypatch, there: tuple[int, ...], asked: list[int]) -> None:
    """Some drivers give no more than is asked for; macOS has 4.1."""
    hints: dict[int, int] = {}
    majors: list[int] = []

    def create(*_: Any) -> object | None:
        assert hints[glfw.CONTEXT_VERSION_MINOR] == 3
        majors.append(hints[glfw.CONTEXT_VERSION_MAJOR])
        return object() if majors[-1] in there else None

    monkeypatch.setattr(glfw, "window_hint", hints.__setitem__)
    monkeypatch.setattr(glfw, "create_window", create)
    for name in ("init", "make_context_current", "swap_interval", "set_error_callback"):
        monkeypatch.setattr(glfw, name, lambda *_: True)
    assert open_window((900, 560)) and majors == asked


@pytest.mark.parametrize(
    ("dots", "remembered", "expected"),
    [
        (144, (), (0, 0, 1920, 1080)),  # 1280 x 800 at 150 % is as wide, and higher
        (144, (100, 50, 1500, 900), (100, 50, 1500, 900)),  # it was made 150 % larger at every start
        (96, (2500, 1300, 2400, 1300), (0, 0, 1920, 1080)),  # of a larger screen
        (192, (40, 30, 1280, 800), (40, 0, 1800, 1080)),  # of a screen at 100 %: the least that shows all
    ],
)
def test_the_first_window_is_on_the_screen_at_every_scale(
    folders: Path, dots: int, remembered: tuple[int, ...], expected: Rect
) -> None:
    """The desktop says its scale as dots per inch."""
    if remembered:
        preferences.save(replace(preferences.DEFAULTS, window=remembered))
    with x_server(1920, 1080) as display:
        client = Client(display)
        client.set_resources(f"Xft.dpi:\t{dots}\n")
        environment = {**os.environ, "DISPLAY": display, "PYTHONPATH": str(ROOT)}
        environment.pop("WAYLAND_DISPLAY", None)
        command = [sys.executable, "-c", OPENED]
        told = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=120)
        client.close()
    assert told.returncode == 0, told.stderr
    assert tuple(json.loads(told.stdout)) == expected
    assert preferences.load()[0].window == expected
