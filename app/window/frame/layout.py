"""The window's panels in their places: each reads the state and returns the commands that hands issued."""

from imgui_bundle import ImVec2, imgui

from .. import commands as do
from ..asking.panels import dictionary, prompts
from ..editing.panels import cleaning, history, pointing, ruler, tools
from ..exporting import panel as export_panel
from ..filming import panel as film_panel
from ..inventory import panel as inventory_panel
from ..kit import theme, widgets
from ..kit.look import Look
from ..opening.panels import welcome
from ..recovery import panels as recovery_panels
from ..scene.panels import axes, legend, tray, views
from ..state import State
from ..touring import panel as tour_panel
from . import canvas, dialogs, keys, splitter, status, toasts, toolbar

CANVAS_TOP = 52.0  # design pixels
_VIEWS = 88.0


def draw_all(state: State, look: Look) -> tuple[list[do.Command], tuple[int, int]]:
    """Every panel of one frame.

    Returns:
        What was issued, and the size of the picture's place in framebuffer pixels.
    """
    io = imgui.get_io()
    keys.step_to_area(state)
    width, height = io.display_size.x, io.display_size.y
    left, bar, top = splitter.width(state, look, width), look.px(theme.STATUS_HEIGHT), look.px(CANVAS_TOP)
    place, size = ImVec2(left, top), ImVec2(max(width - left, 1), max(height - bar - top, 1))
    issued = _picture(state, look, place, size)
    foot = look.px(export_panel.PROGRESS) if state.exporting.running is not None else 0.0
    with widgets.window("##panel", ImVec2(0, 0), ImVec2(left, height - bar - foot), scrolls=True):
        issued += _side(state, look)
    if foot:  # below the panel, where nothing moves out of its way
        corner, extent = ImVec2(0, height - bar - foot), ImVec2(left, foot)
        with widgets.window("##export", corner, extent, imgui.WindowFlags_.no_focus_on_appearing):
            issued += export_panel.draw_progress(state, look)
    with widgets.window("##toolbar", ImVec2(left, 0), ImVec2(size.x, top)):
        imgui.set_cursor_pos_y((top - imgui.get_frame_height()) / 2)
        issued += toolbar.draw(state, look)
    with widgets.window("##status", ImVec2(0, height - bar), ImVec2(width, bar), widgets.NO_KEYS):
        imgui.set_cursor_pos_y((bar - imgui.get_text_line_height()) / 2)
        status.draw(state, look)
    issued += splitter.draw(state, look, left, height - bar)
    legend.draw(state, look, place, size)
    if state.scene.info is not None:
        issued += tools.draw(state, look, place, size)
        issued += pointing.draw(state, look, place, size)
        issued += ruler.draw(state, look, place, size)
        issued += axes.draw(state, look, place, size)
        issued += film_panel.draw(state, look, place, size)
        issued += tour_panel.draw(state, look, place, size)
        issued += inventory_panel.draw(state, look, place, size, _above_views(state, look, size))
        issued += cleaning.draw(state, look, place, size)
        issued += dictionary.draw(state, look, place, size)
    issued += recovery_panels.draw_offer(state, look, place, size)
    issued += recovery_panels.draw_edits_offer(state, look, place, _above_views(state, look, size))
    issued += toasts.draw(state, look, ImVec2(width, height - bar))
    issued += dialogs.draw(state, look)
    issued += keys.draw(state)
    pixels = io.display_framebuffer_scale
    return issued, (round(size.x * pixels.x), round(size.y * pixels.y))


def _side(state: State, look: Look) -> list[do.Command]:
    """The panel on the left: photos, phrases, edits."""
    issued = tray.draw(state, look)
    widgets.gap(look.px(6))
    imgui.separator()
    widgets.gap(look.px(6))
    issued += prompts.draw(state, look)
    return issued + history.draw(state, look)


def _above_views(state: State, look: Look, size: ImVec2) -> ImVec2:
    """The size of the picture's place without the strip of photos at its foot."""
    return ImVec2(size.x, size.y - look.px(_VIEWS)) if _has_views(state) else size


def _has_views(state: State) -> bool:
    return state.scene.info is not None and bool(state.scene.info.views)


def _picture(state: State, look: Look, place: ImVec2, size: ImVec2) -> list[do.Command]:
    imgui.push_style_var(imgui.StyleVar_.window_padding, ImVec2(0, 0))
    keys_go_by = 0 if welcome.waits(state) else widgets.NO_KEYS
    with widgets.window("##picture", place, size, imgui.WindowFlags_.no_background | keys_go_by):
        imgui.pop_style_var()
        issued = canvas.draw(state, look)
    if _has_views(state):
        corner = ImVec2(place.x, place.y + size.y - look.px(_VIEWS))
        flags = imgui.WindowFlags_.no_background | imgui.WindowFlags_.always_auto_resize
        imgui.set_next_window_pos(corner)
        imgui.begin("##views", None, widgets.PLAIN | flags)
        issued += views.draw(state, look)
        imgui.end()
    return issued
