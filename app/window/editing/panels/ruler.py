"""Over the picture: what is measured, how long it is, and the field that tells how long it is in truth."""

from contextlib import suppress

import numpy as np
from imgui_bundle import ImVec2, imgui
from imgui_bundle import icons_fontawesome_6 as fa

from langflash_core.geometry import poses
from langflash_core.geometry.poses import Vector
from langflash_core.scene.report import guess_line

from ... import commands as do
from ...kit import theme, widgets
from ...kit.lengths import said
from ...kit.look import Look
from ...state import State
from ...touring import commands as tour
from .. import pointing as point
from ..state import Tool

_ENTER = imgui.InputTextFlags_.enter_returns_true | imgui.InputTextFlags_.auto_select_all


def draw(state: State, look: Look, place: ImVec2, size: ImVec2) -> list[do.Command]:
    """A field beside the line that tells its length and takes it."""
    ends = _ends(state, place, size)
    return _field(state, look, ends) if len(ends) == 2 else []


def draw_line(state: State, look: Look, place: ImVec2, size: ImVec2) -> None:
    """The ends and what joins them, on the picture itself: panels and the field stand over it."""
    ends, canvas = _ends(state, place, size), imgui.get_window_draw_list()
    colour = widgets.u32(theme.DARK.ACCENT)
    for end in ends:
        canvas.add_circle_filled(end, look.px(4), colour)
    if len(ends) == 2:
        canvas.add_line(ends[0], ends[1], colour, look.px(2))


def _ends(state: State, place: ImVec2, size: ImVec2) -> list[ImVec2]:
    """On the screen; none without the ruler in hand, or behind the camera."""
    if state.editing.tool is not Tool.RULER or not state.editing.ruler:
        return []
    found = poses.project(np.array(state.editing.ruler), state.scene.pose, (size.x, size.y))
    return [] if found is None else [ImVec2(place.x + float(x), place.y + float(y)) for x, y in found[1]]


def _field(state: State, look: Look, ends: list[ImVec2]) -> list[do.Command]:
    issued: list[do.Command] = []
    length = point.measured(state.editing.ruler) or 0.0
    middle = ImVec2((ends[0].x + ends[1].x) / 2, (ends[0].y + ends[1].y) / 2 + look.px(12))
    imgui.set_next_window_pos(middle, 0, ImVec2(0.5, 0))
    with widgets.floating("##ruler", look, (10, 7), imgui.WindowFlags_.always_auto_resize):
        imgui.align_text_to_frame_padding()
        imgui.text(said(length, state.metric, state.guess))
        if state.guess is not None:
            widgets.tooltip(f"{guess_line(state.guess).capitalize()}; type the true length to set the scale.")
        imgui.same_line()
        imgui.text_colored(theme.MUTED, "this is")
        imgui.same_line()
        imgui.set_next_item_width(look.px(76))
        if state.metric is None and imgui.is_window_appearing():
            imgui.set_keyboard_focus_here()  # the digits that follow are meant for it, not for the modes
        known = f"{100 * length * state.metric:.1f}" if state.metric else ""
        entered, text = imgui.input_text_with_hint("cm", "?", known, _ENTER)
        with suppress(ValueError):
            if (entered or imgui.is_item_deactivated_after_edit()) and text != known:
                issued.append(point.SetLength(float(text.replace(",", ".")) / 100))
        widgets.tooltip("The true length; the scene and its exports are then in metres")
        imgui.same_line()
        if widgets.quiet_button(
            f"{fa.ICON_FA_THUMBTACK}##measure", "Keep this measure as a note of the tour"
        ):
            start, end = (Vector(*spot) for spot in state.editing.ruler)
            issued += [tour.AddNote("Measure", start, end), point.ClearRuler()]
    return issued
