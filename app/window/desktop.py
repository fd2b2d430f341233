"""The window's place on the desktop, remembered; and opening folders in the file manager."""

import os
import subprocess
import sys
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import glfw

from app.window.preferences import Preferences

FIRST_SIZE = (1280, 800)
_VISIBLE = 80  # pixels of a remembered window that must lie on a screen, else it starts elsewhere


def size_of(preferences: Preferences) -> tuple[int, int]:
    """(width, height) to open with."""
    return (preferences.window[2], preferences.window[3]) if preferences.window else FIRST_SIZE


def place(window, preferences: Preferences) -> None:
    """Where it was last, if a screen is still there."""
    if preferences.window and _on_a_screen(preferences.window):
        glfw.set_window_pos(window, *preferences.window[:2])
    if preferences.maximised:
        glfw.maximize_window(window)


def remembering(window, preferences: Preferences) -> Preferences:
    """The preferences with the window's present place."""
    maximised = bool(glfw.get_window_attrib(window, glfw.MAXIMIZED))
    if maximised or glfw.get_window_attrib(window, glfw.ICONIFIED):
        return replace(preferences, maximised=maximised)
    with suppress(glfw.GLFWError):  # Wayland tells no place
        x, y = glfw.get_window_pos(window)
        width, height = glfw.get_window_size(window)
        if width >= 200 and height >= 200:
            return replace(preferences, window=(x, y, width, height), maximised=False)
    return replace(preferences, maximised=False)


def show_folder(folder: Path) -> None:
    """Open a folder in the file manager; where there is none, nothing happens."""
    with suppress(OSError):
        if sys.platform == "win32":
            os.startfile(folder)  # pyright: ignore[reportAttributeAccessIssue]
            return
        opener = "open" if sys.platform == "darwin" else "xdg-open"
        subprocess.Popen(
            [opener, str(folder)],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )


def _on_a_screen(window: tuple[int, ...]) -> bool:
    x, y, width, height = window
    for monitor in glfw.get_monitors():
        left, top, across, down = glfw.get_monitor_workarea(monitor)
        shown_x = min(x + width, left + across) - max(x, left)
        shown_y = min(y + height, top + down) - max(y, top)
        if min(shown_x, shown_y) >= _VISIBLE:
            return True
    return False
