"""Keys on a machine whose frames are slower than a key repeats, on a real ImGui context without a window."""

from types import SimpleNamespace

import glfw
import pytest
from imgui_bundle import imgui

from app.window.events import FOCUS_FRAMES, Events
from tests.app.window.headless import context

SLOW = 0.4  # seconds a frame; ImGui repeats a key after 0.275
_KEYS = {
    glfw.KEY_ENTER: imgui.Key.enter,
    glfw.KEY_KP_ENTER: imgui.Key.keypad_enter,
    glfw.KEY_LEFT_SHIFT: imgui.Key.left_shift,
    glfw.KEY_RIGHT: imgui.Key.right_arrow,
    glfw.KEY_V: imgui.Key.v,
}


def keyboard(io) -> Events:
    """What glfw calls, without a window behind it."""
    events = Events.__new__(Events)
    events._translated = {}

    def callback(window, key: int, scancode: int, action: int, mods: int) -> None:
        io.add_key_event(imgui.Key.mod_ctrl, bool(mods & glfw.MOD_CONTROL))
        io.add_key_event(_KEYS[key], action == glfw.PRESS)

    events._backend = SimpleNamespace(io=io, keyboard_callback=callback)  # pyright: ignore[reportAttributeAccessIssue]
    return events


def tap(events: Events, key: int, mods: int = 0) -> None:
    """A quick press, of which a slow frame gets both ends."""
    events._key(None, key, 0, glfw.PRESS, mods)
    events._key(None, key, 0, glfw.RELEASE, mods)


@pytest.mark.parametrize("key", [glfw.KEY_ENTER, glfw.KEY_KP_ENTER])
def test_enter_leads_to_the_next_field_and_does_not_leave_it_again(key: int) -> None:
    with context((800, 600)):
        io = imgui.get_io()
        io.config_flags |= imgui.ConfigFlags_.nav_enable_keyboard
        events, texts, rows, focus = keyboard(io), ["plant", ""], 1, 0

        def frame() -> None:
            nonlocal rows, focus
            io.delta_time = SLOW
            imgui.new_frame()
            imgui.begin("panel")
            for row in range(rows):
                imgui.push_id(row)
                if focus == row:
                    imgui.set_keyboard_focus_here()
                    focus = -1
                _, texts[row] = imgui.input_text("##text", texts[row])
                if row == 0 and imgui.is_item_deactivated() and imgui.is_key_pressed(_KEYS[key]):
                    rows, focus = 2, 1
                imgui.pop_id()
            imgui.end()
            imgui.end_frame()

        for _ in range(4):
            frame()
        tap(events, key)
        for _ in range(FOCUS_FRAMES + 6):
            frame()
        for letter in "book":
            io.add_input_character(ord(letter))
            frame()
        assert texts == ["plant", "book"] and io.want_text_input


def test_a_quick_ctrl_v_pastes_once(monkeypatch) -> None:
    with context((800, 600)):
        io, text = imgui.get_io(), ""
        imgui.get_platform_io().platform_get_clipboard_text_fn = lambda _ctx: "lamp"
        events = keyboard(io)
        monkeypatch.setattr("app.window.events._by_letter", lambda key, scancode: key)
        for number in range(FOCUS_FRAMES + 12):
            io.delta_time = SLOW
            if number == 4:
                tap(events, glfw.KEY_V, glfw.MOD_CONTROL)
            imgui.new_frame()
            imgui.begin("panel")
            if number == 0:
                imgui.set_keyboard_focus_here()
            _, text = imgui.input_text("##text", text)
            imgui.end()
            imgui.end_frame()
        assert text == "lamp"


@pytest.mark.parametrize("key", [glfw.KEY_LEFT_SHIFT, glfw.KEY_RIGHT])
def test_what_is_held_with_ctrl_stays_down(key: int, monkeypatch) -> None:
    """Shift, for Ctrl+Shift+Z; arrows, which repeat."""
    with context((800, 600)):
        io = imgui.get_io()
        monkeypatch.setattr("app.window.events._by_letter", lambda key, scancode: key)
        keyboard(io)._key(None, key, 0, glfw.PRESS, glfw.MOD_CONTROL)
        for _ in range(FOCUS_FRAMES + 6):
            io.delta_time = SLOW
            imgui.new_frame()
            imgui.end_frame()
        assert imgui.is_key_down(_KEYS[key])
