"""The edge between the side panel and the picture: dragged, it makes the panel wider or narrower."""

from dataclasses import replace

from imgui_bundle import ImVec2, imgui

from .. import commands as do
from ..kit import theme, widgets
from ..kit.look import Look
from ..recovery import commands as keep
from ..recovery.preferences import PANEL_WIDTHS
from ..state import State

_GRIP = 8.0  # design pixels that take the pointer
_PICTURE = 420.0  # design pixels that the picture keeps


def width(state: State, look: Look, window_width: float) -> float:
    """Interface pixels of the side panel in a window this wide."""
    most = max(window_width - look.px(_PICTURE), look.px(PANEL_WIDTHS[0]))
    return float(round(min(look.px(state.preferences.panel_width), most)))


def draw(state: State, look: Look, edge: float, height: float) -> list[do.Command]:
    """The grip over the edge; a double click goes back to the usual width."""
    grip = look.px(_GRIP)
    imgui.push_style_var(imgui.StyleVar_.window_padding, ImVec2(0, 0))
    imgui.push_style_var(imgui.StyleVar_.window_min_size, ImVec2(1, 1))
    imgui.set_next_window_pos(ImVec2(edge - grip / 2, 0))
    imgui.set_next_window_size(ImVec2(grip, height))
    flags = (
        widgets.PLAIN
        | widgets.NO_KEYS
        | imgui.WindowFlags_.no_background
        | imgui.WindowFlags_.no_focus_on_appearing
    )
    imgui.begin("##splitter", None, flags | imgui.WindowFlags_.no_bring_to_front_on_focus)
    imgui.invisible_button("grip", ImVec2(grip, max(height, 1)))
    issued: list[do.Command] = []
    if imgui.is_item_hovered() or imgui.is_item_active():
        imgui.set_mouse_cursor(imgui.MouseCursor_.resize_ew)
        line = widgets.u32(theme.ACCENT)
        imgui.get_window_draw_list().add_line(ImVec2(edge, 0), ImVec2(edge, height), line, look.px(2))
    if imgui.is_item_active() and imgui.get_io().mouse_delta.x:
        issued.append(_wider(state, imgui.get_mouse_pos().x / look.scale))
    if imgui.is_item_hovered() and imgui.is_mouse_double_clicked(0):
        issued.append(_wider(state, theme.PANEL_WIDTH))
    imgui.end()
    imgui.pop_style_var(2)
    return issued


def _wider(state: State, design: float) -> do.Command:
    return keep.Prefer(replace(state.preferences, panel_width=design))
