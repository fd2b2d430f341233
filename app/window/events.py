"""What glfw reports: every event wakes the loop and goes to ImGui, in the order in which it came.

So a key belongs to what had the focus when it was pressed, however many events share a frame.
"""

from collections.abc import Callable

import glfw
from imgui_bundle import imgui
from imgui_bundle.python_backends.glfw_backend import GlfwRenderer

from .commands import Command, Leave
from .desktop import clipboard, on_drop
from .scene.commands import OpenPaths

MODIFIERS = frozenset(
    (glfw.KEY_LEFT_CONTROL, glfw.KEY_RIGHT_CONTROL, glfw.KEY_LEFT_SUPER, glfw.KEY_RIGHT_SUPER)
)
CHORDS = glfw.MOD_CONTROL | glfw.MOD_SUPER
ENTER = frozenset((glfw.KEY_ENTER, glfw.KEY_KP_ENTER))
FOCUS_FRAMES = 6  # from a command until the field that it opens takes letters


class Events:
    """The callbacks of one window.

    wake: called before each event. dispatch: a command for the next frame. rescale: the window has come to
    a screen of another scale.
    """

    def __init__(
        self,
        window,
        backend: GlfwRenderer,
        wake: Callable[[], None],
        dispatch: Callable[[Command], None],
        rescale: Callable[[], None],
    ) -> None:
        self._backend = backend
        self._wake = wake
        self._dispatch = dispatch
        self._translated: dict[int, int] = {}  # keys that are down by another name
        self._pointer = (0.0, 0.0)  # where it was said to be, last
        glfw.set_key_callback(window, self._waking(self._key))
        glfw.set_char_callback(window, self._waking(backend.char_callback))
        glfw.set_cursor_pos_callback(window, self._waking(self._moved))
        glfw.set_cursor_enter_callback(window, self._waking(self._entered))
        glfw.set_mouse_button_callback(window, self._waking(self._button))
        glfw.set_scroll_callback(window, self._waking(backend.scroll_callback))
        glfw.set_window_size_callback(window, self._waking(backend.resize_callback))
        glfw.set_window_refresh_callback(window, self._waking(lambda _window: None))
        focused = lambda _window, has: backend.io.add_focus_event(bool(has))  # noqa: E731
        glfw.set_window_focus_callback(window, self._waking(focused))
        glfw.set_window_close_callback(window, self._waking(self._asked_to_close))
        dropped = lambda paths: dispatch(OpenPaths(paths, dropped=True))  # noqa: E731
        self._drops = on_drop(window, self._waking(dropped))  # kept as long as glfw calls it
        glfw.set_window_content_scale_callback(window, self._waking(lambda *_: rescale()))
        imgui.get_platform_io().platform_get_clipboard_text_fn = lambda _ctx: clipboard(window)

    def _waking(self, callback: Callable) -> Callable:
        def wake(*event) -> None:
            self._wake()
            callback(*event)

        return wake

    def _key(self, window, key: int, scancode: int, action: int, mods: int) -> None:
        """To ImGui; with Ctrl by the letter that the keyboard's layout puts there."""
        if action == glfw.PRESS and mods & CHORDS:
            self._translated[key] = _by_letter(key, scancode)
        named = self._translated.get(key, key)
        if action == glfw.RELEASE:
            self._translated.pop(key, None)
            if key in MODIFIERS:
                # ImGui would take Ctrl+A and the release of Ctrl, come in one frame, for a bare A.
                self._pause(2)
        self._backend.keyboard_callback(window, named, scancode, action, mods)
        if action == glfw.PRESS and (mods & CHORDS or key in ENTER):
            if key in ENTER or ord("A") <= named <= ord("Z"):
                # Let go at once: held over slow frames it would be pressed again, in the field it opened.
                self._backend.keyboard_callback(window, named, scancode, glfw.RELEASE, mods)
            self._pause(FOCUS_FRAMES)  # a new field has the focus before the next letter comes

    def _pause(self, frames: int) -> None:
        """What comes next is for a later frame, an even number of them: ImGui ends a frame's events before
        a key that changes twice, so one that no keyboard has parts them."""
        for place in range(frames):
            self._backend.io.add_key_event(imgui.Key.f24, place % 2 == 0)

    def _moved(self, _window, x: float, y: float) -> None:
        self._pointer = (x, y)
        self._backend.io.add_mouse_pos_event(x, y)

    def _button(self, window, button: int, action: int, mods: int) -> None:
        """To ImGui, a press in a frame after the one that brings the pointer there: an item that others may
        overlap, as the picture, takes none before it was under the pointer for a frame."""
        seen = self._backend.io.mouse_pos
        if action == glfw.PRESS and (seen.x, seen.y) != self._pointer:
            self._pause(2)
        self._backend.mouse_button_callback(window, button, action, mods)

    def _entered(self, _window, entered: int) -> None:
        if not entered:
            self._backend.io.add_mouse_pos_event(-imgui.FLT_MAX, -imgui.FLT_MAX)

    def _asked_to_close(self, window) -> None:
        """The close button asks before an unsaved scene is lost, as Ctrl+Q does."""
        glfw.set_window_should_close(window, False)
        self._dispatch(Leave())


def _by_letter(key: int, scancode: int) -> int:
    """The key that bears the letter of this one on a keyboard of the United States."""
    letter = (glfw.get_key_name(key, scancode) or "").upper()
    return ord(letter) if len(letter) == 1 and "A" <= letter <= "Z" else key
