"""The window on the desktop: opened with OpenGL 3.3, in the place where it was, at the monitor's scale."""

import ctypes
import logging
import os
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from typing import Any

import glfw
import moderngl

from langflash_core.errors import GraphicsError

from .recovery.preferences import Preferences

log = logging.getLogger(__name__)

FIRST_SIZE = (1280, 800)
MIN_SIZE = (900, 560)  # design pixels; below this the panels would overlap
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


def _on_a_screen(window: tuple[int, ...]) -> bool:
    x, y, width, height = window
    for monitor in glfw.get_monitors():
        left, top, across, down = glfw.get_monitor_workarea(monitor)
        shown_x = min(x + width, left + across) - max(x, left)
        shown_y = min(y + height, top + down) - max(y, top)
        if min(shown_x, shown_y) >= _VISIBLE:
            return True
    return False


class GlfwLoader:
    """Hands moderngl the functions of the context that glfw made, whatever the platform.

    moderngl's own loader guesses between EGL and GLX and offers no `load` for the rest.
    """

    def load(self, name: str) -> int:
        """The address of an OpenGL function; 0 when there is none."""
        return ctypes.cast(glfw.get_proc_address(name), ctypes.c_void_p).value or 0

    load_opengl_function = load

    def release(self) -> None:
        """Nothing to do: the window owns the context."""


# moderngl's annotations know keyword settings only as dictionaries.
_LOADER: dict[str, Any] = {"context": GlfwLoader()}


def create_context() -> moderngl.Context:
    """Of the window that is current."""
    return moderngl.create_context(require=330, **_LOADER)


def open_window(size: tuple[int, int]):
    """A window with its context, current on this thread.

    Raises:
        GraphicsError: no display, or no OpenGL 3.3.
    """
    problems: list[str] = []
    previous = glfw.ERROR_REPORTING
    glfw.ERROR_REPORTING = "ignore"
    try:
        glfw.set_error_callback(lambda _code, text: problems.append(text_of(text)))
        if not glfw.init():
            raise GraphicsError(
                "there is no display to open a window on; use langflash render or query, or make run"
            )
        window = _create(size)
        if not window:
            why = f" ({problems[-1]})" if problems else ""
            glfw.terminate()
            raise GraphicsError(f"OpenGL 3.3 is not available here{why}; update the graphics driver")
    finally:
        glfw.ERROR_REPORTING = previous
    glfw.set_error_callback(lambda code, text: log.warning("glfw %s: %s", code, text_of(text)))
    glfw.make_context_current(window)
    glfw.swap_interval(1)
    return window


def _create(size: tuple[int, int]):
    hints = {
        glfw.CONTEXT_VERSION_MAJOR: 3,
        glfw.CONTEXT_VERSION_MINOR: 3,
        glfw.OPENGL_PROFILE: glfw.OPENGL_CORE_PROFILE,
        glfw.OPENGL_FORWARD_COMPAT: True,
        glfw.SCALE_TO_MONITOR: True,
        glfw.DEPTH_BITS: 0,
        glfw.STENCIL_BITS: 0,
    }
    for hint, value in hints.items():
        glfw.window_hint(hint, value)
    window = glfw.create_window(*size, "LangFlash", None, None)
    if window:
        scale = interface_scale(window)
        width, height = (round(scale * side) for side in MIN_SIZE)
        glfw.set_window_size_limits(window, width, height, glfw.DONT_CARE, glfw.DONT_CARE)
    return window


def interface_scale(window) -> float:
    """Size of the interface: the monitor's content scale, less what the framebuffer adds itself."""
    content = glfw.get_window_content_scale(window)[0]
    width, framebuffer = glfw.get_window_size(window)[0], glfw.get_framebuffer_size(window)[0]
    return max(content * width / max(framebuffer, 1), 0.5)


def short_name(renderer: str) -> str:
    """The graphics device without its driver's version string."""
    return renderer.split(" (")[0].split("/")[0].strip()


def clipboard(window, errors: str = "replace") -> str:
    """Its text; empty without one. errors: as of `bytes.decode`, for what is no UTF-8."""
    text = glfw.get_clipboard_string(window)
    return text_of(text, errors) if text else ""


def text_of(text: bytes | str, errors: str = "replace") -> str:
    """What glfw says, which is bytes here and there."""
    return text.decode(errors=errors) if isinstance(text, bytes) else text


def on_drop(window, dropped: Callable[[tuple[str, ...]], None]) -> object:
    """Call `dropped` with the paths of a drop; what comes back must live as long as the window.

    As glfw's own, which lets go of a whole drop where a name is not UTF-8.
    """

    def decoded(_window, count: int, paths) -> None:
        dropped(tuple(os.fsdecode(paths[place]) for place in range(count)))

    kept = glfw._GLFWdropfun(decoded)
    glfw._glfw.glfwSetDropCallback(window, kept)
    return kept
