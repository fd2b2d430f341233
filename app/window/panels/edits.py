"""The list of edits, and the offer to restore those of an earlier session."""

from imgui_bundle import ImVec2, imgui
from imgui_bundle import icons_fontawesome_6 as fa

from app.window import commands as do
from app.window import edit_commands as edit
from app.window import theme
from app.window.panels import widgets
from app.window.panels.look import Look
from app.window.state import State

_ROWS = 7.5  # shown at once; the half tells that there are more
_OFFER = 470.0  # design pixels wide


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
        "As it was opened",
        *(e.label for e in history.done),
        *(e.label for e in reversed(history.undone)),
    ]
    height = min(len(labels), _ROWS) * imgui.get_text_line_height_with_spacing() + look.px(8)
    imgui.begin_child("##edits", ImVec2(0, height))
    now = len(history.done)
    for position, label in enumerate(labels):
        colour = theme.TEXT if position <= now else theme.MUTED
        icon = fa.ICON_FA_CARET_RIGHT if position == now else "   "
        with widgets.colours(text=theme.ACCENT if position == now else colour):
            if imgui.selectable(f"{icon} {label}##{position}", False)[0] and position != now:
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


def draw_offer(state: State, look: Look, place: ImVec2, size: ImVec2) -> list[do.Command]:
    """Edits that nobody saved, offered without standing in the way."""
    offer = state.editing.offer
    if offer is None or state.job is not None:
        return []
    issued: list[do.Command] = []
    corner = ImVec2(place.x + size.x / 2, place.y + size.y - look.px(14))
    imgui.set_next_window_pos(corner, 0, ImVec2(0.5, 1))
    imgui.set_next_window_size(ImVec2(look.px(_OFFER), 0))
    imgui.push_style_var(imgui.StyleVar_.window_rounding, look.px(8))
    with widgets.colours(window_bg=imgui.get_style().color_(imgui.Col_.popup_bg)):
        imgui.begin("##offer", None, widgets.PLAIN | imgui.WindowFlags_.no_focus_on_appearing)
        edits, were = ("1 edit", "was") if offer.count == 1 else (f"{offer.count} edits", "were")
        imgui.text_colored(theme.ACCENT, fa.ICON_FA_CLOCK_ROTATE_LEFT)
        imgui.same_line()
        imgui.text_wrapped(f"{edits} of {offer.name} {were} not saved ({offer.when:%d %B, %H:%M}).")
        if widgets.primary_button("Restore", look.vec(120, 0)):
            issued.append(edit.EndOffer(restore=True))
        imgui.same_line()
        if imgui.button("Later", look.vec(120, 0)):
            issued.append(edit.EndOffer())
        widgets.tooltip("They are offered again next time")
        imgui.same_line()
        if imgui.button("Forget them", look.vec(120, 0)):
            issued.append(edit.EndOffer(forget=True))
        imgui.end()
    imgui.pop_style_var()
    return issued
