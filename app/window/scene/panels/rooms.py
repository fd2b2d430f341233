"""Rooms: the way back to those that were on show, and the questions before another takes the place."""

from imgui_bundle import icons_fontawesome_6 as fa
from imgui_bundle import imgui

from ... import commands as do
from ...kit import theme, widgets
from ...kit.look import Look
from ...state import State
from .. import commands as show

_NAMED = 4  # dropped photos that the question names


def draw(state: State, look: Look) -> list[do.Command]:
    """In the heading's line at its right: back to the room before, and a list where there are more."""
    if not state.rooms:
        return []
    imgui.push_style_var(imgui.StyleVar_.frame_padding, look.vec(6, 0))  # no higher than the heading
    imgui.begin_disabled(state.job is not None)
    issued = _back(state, look)
    imgui.end_disabled()
    imgui.pop_style_var()
    return issued + _list(state, look)


def _back(state: State, look: Look) -> list[do.Command]:
    """The button of the room before, and the one that opens the list."""
    issued: list[do.Command] = []
    before, several = state.rooms[0].info, len(state.rooms) > 1
    text = f"{fa.ICON_FA_ARROW_LEFT}  {widgets.shortened(before.name, look.px(150))}"
    padding = 2 * imgui.get_style().frame_padding.x
    width = imgui.calc_text_size(text).x + padding
    if several:
        width += imgui.calc_text_size(fa.ICON_FA_CARET_DOWN).x + padding
    imgui.same_line(imgui.get_cursor_pos_x() + imgui.get_content_region_avail().x - width)
    if widgets.quiet_button(f"{text}###back", f"Back to {before.name}, as it was left"):
        issued.append(show.GoToRoom(before.serial))
    if several:
        imgui.same_line(0, 0)
        if widgets.quiet_button(f"{fa.ICON_FA_CARET_DOWN}##rooms", "The rooms before it"):
            imgui.open_popup("rooms")
    return issued


def _list(state: State, look: Look) -> list[do.Command]:
    issued: list[do.Command] = []
    imgui.push_style_var(imgui.StyleVar_.window_padding, look.vec(12, 10))
    if imgui.begin_popup("rooms"):
        for room in state.rooms:
            mark = "  (edited)" if room.edited else ""
            name = widgets.shortened(room.info.name, look.px(260))
            if imgui.selectable(f"{name}{mark}##{room.info.serial}", False)[0]:
                issued.append(show.GoToRoom(room.info.serial))
        imgui.end_popup()
    imgui.pop_style_var()
    return issued


def draw_drop(state: State, look: Look) -> list[do.Command]:
    """The question where dropped photos belong."""
    assert state.info is not None
    names = [path.name for path in state.dropped]
    more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
    imgui.text_wrapped(", ".join(names[:_NAMED]) + more)
    widgets.muted(f"{state.info.name} is open.")
    widgets.gap(look.px(4))
    issued: list[do.Command] = []
    imgui.begin_disabled(not state.photos)
    if imgui.button("Add to this room", look.vec(160, 0)):
        issued.append(show.dropped(state, state.dropped, new=False))
    imgui.end_disabled()
    known = "Reconstruct it from the photos in the tray and these"
    widgets.tooltip(known if state.photos else "This room came from a file; its photos are not in the tray")
    imgui.same_line()
    if widgets.primary_button("New room", look.vec(130, 0)):
        issued.append(show.dropped(state, state.dropped, new=True))
    widgets.tooltip("Of these photos alone; the present room stays one click away")
    imgui.same_line()
    if imgui.button("Cancel", look.vec(110, 0)):
        issued.append(do.ShowDialog(None))
    return issued


def draw_unsaved(state: State, look: Look) -> list[do.Command]:
    """The question what becomes of edits before another scene takes the place."""
    name = "" if state.info is None else state.info.name
    imgui.text_wrapped(f"The edits of {name} are not saved.")
    with widgets.colours(text=theme.MUTED):
        imgui.text_wrapped("Discarded ones can be had back for a while: the room stays in the list of rooms.")
    widgets.gap(look.px(4))
    issued: list[do.Command] = []
    if widgets.primary_button("Save ...", look.vec(120, 0)):
        issued.append(show.SaveFirst())
    imgui.same_line()
    if imgui.button("Discard", look.vec(120, 0)):
        issued.append(show.GoOn())
    imgui.same_line()
    if imgui.button("Cancel", look.vec(120, 0)):
        issued.append(do.ShowDialog(None))
    return issued
