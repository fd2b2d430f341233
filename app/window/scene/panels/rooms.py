"""Rooms: the way back to those that were on show, and the questions before another takes the place."""

from imgui_bundle import icons_fontawesome_6 as fa
from imgui_bundle import imgui

from ... import commands as do
from ...kit import theme, widgets
from ...kit.look import Look
from ...kit.widgets import Answer
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
    text = f"{fa.ICON_FA_ARROW_LEFT}  {widgets.shortened(first.info.name, look.px(150))}"
    width = imgui.calc_text_size(text).x + 2 * imgui.get_style().frame_padding.x
    imgui.same_line(imgui.get_cursor_pos_x() + imgui.get_content_region_avail().x - width)
    issued = _back(first, text, "###back")
    space = imgui.get_content_region_avail().x / max(len(others), 1) - look.px(44)
    for place, room in enumerate(others):
        if place:
            imgui.same_line(0, 0)
        text = f"{fa.ICON_FA_CUBE}  {widgets.shortened(room.info.name, space)}"
        issued += _back(room, text, f"###room {place}")
    imgui.end_disabled()
    imgui.pop_style_var()
    return issued


def _back(room: Room, text: str, label: str) -> list[do.Command]:
    edited = ", with its edits" if room.edited else ""
    pressed = widgets.quiet_button(f"{text}{label}", f"Back to {room.info.name}, as it was left{edited}")
    return [show.GoToRoom(room.info.serial)] if pressed else []


def draw_drop(state: State, look: Look) -> list[do.Command]:
    """The question where dropped photos belong."""
    assert state.scene.info is not None
    names = [path.name for path in state.scene.dropped]
    more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
    imgui.text_wrapped(", ".join(names[:_NAMED]) + more)
    widgets.muted(f"{state.scene.info.name} is open.")
    widgets.gap(look.px(4))
    photos, tray = state.scene.dropped, bool(state.scene.photos)
    added: tuple[do.Command, ...] = (show.dropped(state, photos, new=False),)
    says = "This room came from a file; its photos are not in the tray"
    if tray:
        says = "Reconstruct from the photos in the tray plus these"
    grows = can_grow(state, len(photos))
    if grows:  # they lie in the tray beside those that it was made of
        added = (*((show.AddPhotos(photos),) if tray else ()), AddToScene(photos))
        says = "Each becomes a layer beside those of the room; the room as it is stays one click away"
    alone = "From these photos only; the current room stays one click away"
    chosen = widgets.answers(
        look,
        Answer("Add to this room", 160, added, says, grows or tray),
        Answer("New room", 130, (show.dropped(state, photos, new=True),), alone),
        Answer("Cancel", 110, (do.ShowDialog(None),)),
        default=1,
    )
    return [command for commands in chosen for command in commands]


def draw_scene_drop(state: State, look: Look) -> list[do.Command]:
    """The question what becomes of a dropped scene."""
    assert state.scene.info is not None
    if not state.scene.dropped:
        return [do.ShowDialog(None)]
    path = state.scene.dropped[0]
    imgui.text_wrapped(path.name)
    widgets.muted(f"{state.scene.info.name} is open.")
    widgets.gap(look.px(4))
    opening, merging = show.Instead((show.OpenScene(path, alone=True),)), MergeScene(path)
    return widgets.answers(
        look,
        Answer("Open it", 130, opening, "The current scene stays one click away"),
        Answer(
            "Merge into this scene", 190, merging, "Added beside the scene, ready to be moved; Ctrl+Z undoes"
        ),
        Answer("Cancel", 110, do.ShowDialog(None)),
    )


def draw_unsaved(state: State, look: Look) -> list[do.Command]:
    """The question what becomes of edits before another scene takes the place."""
    name = "" if state.scene.info is None else state.scene.info.name
    imgui.text_wrapped(f"The edits of {name} are not saved.")
    with widgets.colours(text=theme.MUTED):
        imgui.text_wrapped("Discarded edits can be had back for a while, from the list of rooms.")
    widgets.gap(look.px(4))
    return widgets.answers(
        look,
        Answer("Save ...", 120, show.SaveFirst()),
        Answer("Discard", 120, show.GoOn()),
        Answer("Cancel", 120, do.ShowDialog(None)),
    )
