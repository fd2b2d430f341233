"""The window on the desktop: opened with OpenGL 3.3, in the place where it was, at the monitor's scale."""

import ctypes
import logging
import os
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any

import glfw
import moderngl

from langflash_core.errors import GraphicsError

from .recovery.preferences import Preferences

log = logging.getLogger(__name__)

FIRST_SIZE = (1280, 800)  # design pixels
MIN_SIZE = (900, 560)  # design pixels; below this the panels would overlap
Rect = tuple[int, int, int, int]  # x, y, width, height in screen pixels


def place(window, preferences: Preferences) -> None:
    """Where it was last and as large, or as it was made; wholly on a screen, with what the desktop puts
    around it. To be called before it is shown."""
    areas, frame = work_areas(), glfw.get_window_frame_size(window)
    made, x, y = glfw.get_window_size(window), 0, 0
    with suppress(glfw.GLFWError):  # Wayland tells no place
        x, y = glfw.get_window_pos(window)
    scale = interface_scale(window)
    left, top, width, height = preferences.window or (x, y, *made)
    wide, high = (round(scale * side) for side in MIN_SIZE)
    left, top, width, height = fitted((left, top, max(width, wide), max(height, high)), areas, frame)
    least = min(wide, width), min(high, height)
    glfw.set_window_size_limits(window, least[0], least[1], glfw.DONT_CARE, glfw.DONT_CARE)
    if (width, height) != made:
        glfw.set_window_size(window, width, height)
    if (left, top) != (x, y):
        glfw.set_window_pos(window, left, top)
    if preferences.maximised:
        glfw.maximize_window(window)


def fitted(wanted: Rect, areas: Sequence[Rect], frame: tuple[int, int, int, int]) -> Rect:
    """The window that is `wanted` as it fits into one of the `areas`: that which would show most of it, else
    the first.

    Args:
        frame: pixels left, above, right and below the window that the desktop adds.
    """
    if not areas:
        return wanted
    before, after = frame[:2], frame[2:]
    area = max(areas, key=lambda each: _overlap(wanted, each))
    places, sizes = list[int](), list[int]()
    for axis in (0, 1):
        most = max(area[2 + axis] - before[axis] - after[axis], 1)
        size = min(wanted[2 + axis], most)
        low = area[axis] + before[axis]
        places.append(min(max(wanted[axis], low), low + most - size))
        sizes.append(size)
    return (places[0], places[1], sizes[0], sizes[1])


def _overlap(one: Rect, other: Rect) -> int:
    """Pixels that two have in common."""
    across, down = (
        max(min(one[axis] + one[2 + axis], other[axis] + other[2 + axis]) - max(one[axis], other[axis]), 0)
        for axis in (0, 1)
    )
    return across * down


def work_areas() -> list[Rect]:
    """Of every monitor what panels and docks leave, in the units of windows; the primary one's first."""
    areas: list[Rect] = []
    for monitor in glfw.get_monitors():
        area, share = glfw.get_monitor_workarea(monitor), 1.0
        if glfw.get_platform() == glfw.PLATFORM_WAYLAND:  # told in the monitor's pixels, unlike windows
            share = max(glfw.get_monitor_content_scale(monitor)[0], 1.0)
        if area[2] > 0 < area[3]:
            areas.append((area[0], area[1], round(area[2] / share), round(area[3] / share)))
    return areas


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
    """A window with its context, current on this thread; not shown yet.

    Args:
        size: in design pixels: where windows are measured in a monitor's own pixels, its scale is added.

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
    glfw.set_error_callback(lambda code, text: log.info("glfw %s: %s", code, text_of(text)))
    glfw.make_context_current(window)
    glfw.swap_interval(1)
    return window


def _create(size: tuple[int, int]):
    """Of OpenGL 4.3 where that is: drivers give no more than is asked for."""
    return _created(size, 4) or _created(size, 3)


def _created(size: tuple[int, int], major: int):
    hints = {
        glfw.CONTEXT_VERSION_MAJOR: major,
        glfw.CONTEXT_VERSION_MINOR: 3,
        glfw.OPENGL_PROFILE: glfw.OPENGL_CORE_PROFILE,
        glfw.OPENGL_FORWARD_COMPAT: True,
        glfw.SCALE_TO_MONITOR: True,
        glfw.VISIBLE: False,
        glfw.DEPTH_BITS: 0,
        glfw.STENCIL_BITS: 0,
    }
    for hint, value in hints.items():
        glfw.window_hint(hint, value)
    return glfw.create_window(*size, "LangFlash", None, None)


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

    binding: Any = glfw
    kept = binding._GLFWdropfun(decoded)
    binding._glfw.glfwSetDropCallback(window, kept)
    return kept
