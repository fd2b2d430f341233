"""What can be found here: the things this scene knows, as chips to click, and how well the model knows."""

from imgui_bundle import imgui

from ... import commands as do
from ...kit import theme, widgets
from ...kit.look import Look
from ...state import State
from .. import commands as ask
from ..things import things

KNOWS = "On real rooms, 75 % of the picture is named correctly (37 kinds of things). English only."
"""assets/weights/mini_card.md, "Real photos": atoms drawn, by area."""


def draw(state: State, look: Look) -> list[do.Command]:
    """A row or two of chips; nothing without a scene that has names."""
    found = things(state)
    if not found or state.scene.info is None:
        return []
    issued: list[do.Command] = []
    asked = {prompt.text.strip().lower() for prompt in state.asking.prompts}
    imgui.push_style_var(imgui.StyleVar_.frame_padding, look.vec(8, 3))
    imgui.align_text_to_frame_padding()
    imgui.text_colored(theme.MUTED, "In this scene:")
    right = imgui.get_cursor_screen_pos().x + imgui.get_content_region_avail().x
    for name in found:
        widgets.go_on(widgets.button_width(name), right, look.px(6))
        imgui.begin_disabled(name in asked)
        if imgui.button(f"{name}##known"):
            issued.append(ask.AskAgain(name))
        imgui.end_disabled()
    imgui.pop_style_var()
    if state.scene.info.scene.record.preset == "mini":
        widgets.muted(KNOWS)
    return issued
