"""The list of edits."""

from imgui_bundle import ImVec2, imgui
from imgui_bundle import icons_fontawesome_6 as fa

from ... import commands as do
from ...kit import theme, widgets
from ...kit.look import Look
from ...state import State
from .. import commands as edit

_ROWS, _LEAST = 7.5, 3.5  # shown at once, at the most and at the least; the half tells that there are more


def draw(state: State, look: Look) -> list[do.Command]:
    """Every edit by name; a click goes back or forth to it. Nothing before the first edit."""
    history = state.editing.history
    if history is None or not (history.done or history.undone):
        return []
    issued: list[do.Command] = []
    widgets.gap(look.px(4))
    imgui.separator()
    widgets.gap(look.px(4))
    widgets.heading("Edits")
    if state.editing.unsaved:
        imgui.same_line()
        imgui.text_colored(theme.MUTED, "not saved yet")
        widgets.tooltip("Kept across a crash; Ctrl+S writes the edited scene")
    labels = [
        f"{history.forgotten:,} older edits" if history.forgotten else "As it was opened",
        *(e.label for e in history.done),
        *(e.label for e in reversed(history.undone)),
    ]
    line, room = imgui.get_text_line_height_with_spacing(), imgui.get_content_region_avail().y - look.px(8)
    # No more than the panel has room for, or the present one is below its end.
    rows = min(len(labels), max(_LEAST, min(_ROWS, room / line)))
    height = rows * line + look.px(8)
    imgui.begin_child("##edits", ImVec2(0, height))
    now = len(history.done)
    for position, label in enumerate(labels):
        colour = theme.TEXT if position <= now else theme.MUTED
        icon = fa.ICON_FA_CARET_RIGHT if position == now else "   "
        with widgets.colours(text=theme.ACCENT if position == now else colour):
            chosen = imgui.selectable(f"{icon} {label}##{position}", False)[0]
            if position == 0 and history.forgotten:
                widgets.tooltip("No longer undone: the list keeps the last 1,000 edits, or 32 MB of them")
            if chosen and position != now:
                issued.append(edit.GoTo(position))
        if position == now and _moved(state, now):
            imgui.set_scroll_here_y(0.6)
    imgui.end_child()
    return issued


def _moved(state: State, now: int) -> bool:
    """Whether another entry is the present one since the last frame drawn."""
    storage, key = imgui.get_state_storage(), imgui.get_id("now")
    before = storage.get_int(key, -1)
    storage.set_int(key, now)
    return before != now
