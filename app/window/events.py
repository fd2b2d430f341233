"""What glfw reports: every event wakes the loop, shortcuts become commands, the rest is ImGui's."""

from collections.abc import Callable, Sequence

import glfw
from imgui_bundle import imgui
from imgui_bundle.python_backends.glfw_backend import GlfwRenderer

from .commands import Command, Leave
from .desktop import clipboard
from .frame.keys import EDIT_SHORTCUTS, SHORTCUTS
from .scene.commands import OpenPaths
from .state import State

MODIFIERS = frozenset(
    (glfw.KEY_LEFT_CONTROL, glfw.KEY_RIGHT_CONTROL, glfw.KEY_LEFT_SUPER, glfw.KEY_RIGHT_SUPER)
)


class Events:
    """The callbacks of one window.

    wake: called before each event. dispatch: a command for the next frame. state: the present one.
    rescale: the window has come to a screen of another scale.
    """

    def __init__(
        self,
        window,
        backend: GlfwRenderer,
        wake: Callable[[], None],
        dispatch: Callable[[Command], None],
        state: Callable[[], State],
        rescale: Callable[[], None],
    ) -> None:
        self._backend = backend
        self._wake = wake
        self._dispatch = dispatch
        self._state = state
        glfw.set_key_callback(window, self._waking(self._key))
        glfw.set_char_callback(window, self._waking(backend.char_callback))
        glfw.set_cursor_pos_callback(window, self._waking(self._moved))
        glfw.set_cursor_enter_callback(window, self._waking(self._entered))
        glfw.set_mouse_button_callback(window, self._waking(backend.mouse_button_callback))
        glfw.set_scroll_callback(window, self._waking(backend.scroll_callback))
        glfw.set_window_size_callback(window, self._waking(backend.resize_callback))
        glfw.set_window_refresh_callback(window, self._waking(lambda _window: None))
        glfw.set_window_focus_callback(window, self._waking(self._focused))
        glfw.set_window_close_callback(window, self._waking(self._asked_to_close))
        glfw.set_drop_callback(window, self._waking(self._dropped))
        glfw.set_window_content_scale_callback(window, self._waking(lambda *_: rescale()))
        imgui.get_platform_io().platform_get_clipboard_text_fn = lambda _ctx: clipboard(window)

    def _waking(self, callback: Callable) -> Callable:
        def wake(*event) -> None:
            self._wake()
            callback(*event)

        return wake

    def _key(self, window, key: int, scancode: int, action: int, mods: int) -> None:
        """Shortcuts by the letter that the keyboard's layout puts there; the rest is ImGui's."""
        if action == glfw.PRESS and mods & (glfw.MOD_CONTROL | glfw.MOD_SUPER):
            letter = glfw.get_key_name(key, scancode)
            edits = EDIT_SHORTCUTS.get((letter or "", bool(mods & glfw.MOD_SHIFT)))
            if edits is not None and not imgui.get_io().want_text_input and not self._state().dialog:
                self._dispatch(edits)
                return
            if letter in SHORTCUTS:
                self._dispatch(SHORTCUTS[letter])
                return
        if action == glfw.RELEASE and key in MODIFIERS:
            # ImGui would take Ctrl+A and the release of Ctrl, come in one frame, for a bare A. It ends a
            # frame's events before a key that changes twice, so one that no keyboard has parts the two.
            for down in (True, False):
                self._backend.io.add_key_event(imgui.Key.f24, down)
        self._backend.keyboard_callback(window, key, scancode, action, mods)

    def _moved(self, _window, x: float, y: float) -> None:
        self._backend.io.add_mouse_pos_event(x, y)

    def _entered(self, _window, entered: int) -> None:
        if not entered:
            self._backend.io.add_mouse_pos_event(-imgui.FLT_MAX, -imgui.FLT_MAX)

    def _focused(self, _window, has: int) -> None:
        self._backend.io.add_focus_event(bool(has))

    def _asked_to_close(self, window) -> None:
        """The close button asks before an unsaved scene is lost, as Ctrl+Q does."""
        glfw.set_window_should_close(window, False)
        self._dispatch(Leave())

    def _dropped(self, _window, paths: Sequence[str]) -> None:
        self._dispatch(OpenPaths(tuple(paths)))
