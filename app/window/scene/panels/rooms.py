"""Rooms: the way back to those that were on show, and the questions before another takes the place."""

from imgui_bundle import icons_fontawesome_6 as fa
from imgui_bundle import imgui

from ... import commands as do
from ...kit import theme, widgets
from ...kit.look import Look
from ...state import State
from .. import commands as show
from ..merging import AddToScene, MergeScene, can_grow
from ..state import Room

_NAMED = 4  # dropped photos that the question names


def draw(state: State, look: Look) -> list[do.Command]:
    """Rooms to go back to, a button each: the one before in the heading's line at its right, others below."""
    if not state.scene.rooms:
        return []
    first, *others = state.scene.rooms
    imgui.push_style_var(imgui.StyleVar_.frame_padding, look.vec(6, 0))  # no higher than the heading
    imgui.begin_disabled(state.scene.job is not None)
    text = f"{fa.ICON_FA_ARROW_LEFT}  {_name(first, look.px(150))}"
    width = imgui.calc_text_size(text).x + 2 * imgui.get_style().frame_padding.x
    imgui.same_line(imgui.get_cursor_pos_x() + imgui.get_content_region_avail().x - width)
    issued = _back(first, text, "###back")
    space = imgui.get_content_region_avail().x / max(len(others), 1) - look.px(44)
    for place, room in enumerate(others):
        if place:
            imgui.same_line(0, 0)
        text = f"{fa.ICON_FA_CUBE}  {_name(room, space)}"
        issued += _back(room, text, f"###room {place}")
    imgui.end_disabled()
    imgui.pop_style_var()
    return issued


def _back(room: Room, text: str, label: str) -> list[do.Command]:
    edited = ", with its edits" if room.edited else ""
    pressed = widgets.quiet_button(f"{text}{label}", f"Back to {room.info.name}, as it was left{edited}")
    return [show.GoToRoom(room.info.serial)] if pressed else []


def _name(room: Room, width: float) -> str:
    return widgets.shortened(room.info.name, width)


def draw_drop(state: State, look: Look) -> list[do.Command]:
    """The question where dropped photos belong."""
    assert state.scene.info is not None
    names = [path.name for path in state.scene.dropped]
    more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
    imgui.text_wrapped(", ".join(names[:_NAMED]) + more)
    widgets.muted(f"{state.scene.info.name} is open.")
    widgets.gap(look.px(4))
    issued: list[do.Command] = []
    grows = can_grow(state, len(state.scene.dropped))
    imgui.begin_disabled(not grows and not state.scene.photos)
    if imgui.button("Add to this room", look.vec(160, 0)):
        issued += _additions(state) if grows else [show.dropped(state, state.scene.dropped, new=False)]
    imgui.end_disabled()
    widgets.tooltip(_addition_says(state, grows))
    widgets.beside(look.px(130))
    if widgets.default_button("New room", look.vec(130, 0)):
        issued.append(show.dropped(state, state.scene.dropped, new=True))
    widgets.tooltip("From these photos only; the current room stays one click away")
    widgets.beside(look.px(110))
    if imgui.button("Cancel", look.vec(110, 0)):
        issued.append(do.ShowDialog(None))
    return issued


def _additions(state: State) -> list[do.Command]:
    """Dropped photos as layers of the room; they lie in the tray beside those that it was made of."""
    photos = state.scene.dropped
    tray: list[do.Command] = [show.AddPhotos(photos)] if state.scene.photos else []
    return [*tray, AddToScene(photos)]


def _addition_says(state: State, grows: bool) -> str:
    if grows:
        return "Each becomes a layer beside those of the room; the room as it is stays one click away"
    if state.scene.photos:
        return "Reconstruct from the photos in the tray plus these"
    return "This room came from a file; its photos are not in the tray"


def draw_scene_drop(state: State, look: Look) -> list[do.Command]:
    """The question what becomes of a dropped scene."""
    assert state.scene.info is not None
    if not state.scene.dropped:
        return [do.ShowDialog(None)]
    path = state.scene.dropped[0]
    imgui.text_wrapped(path.name)
    widgets.muted(f"{state.scene.info.name} is open.")
    widgets.gap(look.px(4))
    issued: list[do.Command] = []
    if widgets.default_button("Open it", look.vec(130, 0)):
        issued.append(show.Instead((show.OpenScene(path, alone=True),)))
    widgets.tooltip("The current scene stays one click away")
    widgets.beside(look.px(190))
    if imgui.button("Merge into this scene", look.vec(190, 0)):
        issued.append(MergeScene(path))
    widgets.tooltip("Added beside the scene, ready to be moved; Ctrl+Z undoes")
    widgets.beside(look.px(110))
    if imgui.button("Cancel", look.vec(110, 0)):
        issued.append(do.ShowDialog(None))
    return issued


def draw_unsaved(state: State, look: Look) -> list[do.Command]:
    """The question what becomes of edits before another scene takes the place."""
    name = "" if state.scene.info is None else state.scene.info.name
    imgui.text_wrapped(f"The edits of {name} are not saved.")
    with widgets.colours(text=theme.MUTED):
        imgui.text_wrapped("Discarded edits can be had back for a while, from the list of rooms.")
    widgets.gap(look.px(4))
    issued: list[do.Command] = []
    if widgets.default_button("Save ...", look.vec(120, 0)):
        issued.append(show.SaveFirst())
    widgets.beside(look.px(120))
    if imgui.button("Discard", look.vec(120, 0)):
        issued.append(show.GoOn())
    widgets.beside(look.px(120))
    if imgui.button("Cancel", look.vec(120, 0)):
        issued.append(do.ShowDialog(None))
    return issued
