"""At the pointer: the region being drawn, what lies under it, and the answer to "what is this?".

`draw_marks` draws into the picture's own window, so that bars, cards and dialogs are over it."""

import math

import numpy as np
from imgui_bundle import ImVec2, ImVec4, imgui
from imgui_bundle import icons_fontawesome_6 as fa

from langflash_core.geometry import poses
from langflash_core.geometry.poses import Vector

from ... import commands as do
from ...kit import boxes, theme, widgets
from ...kit.look import Look
from ...state import State
from ...touring import commands as tour
from .. import commands as edit
from .. import pointing as point
from ..state import PICK_RADIUS, Card, Point, Reading, Tool

_CARD = 312.0  # design pixels wide
_HIGH = 360.0  # before it was drawn
_SHOWN_WORDS = 5


def draw_marks(state: State, look: Look, place: ImVec2, size: ImVec2) -> None:
    """On the picture, in the present window: the selection's outline, the region under way, and the place
    that was asked about."""
    _outline(state, look, place)
    _region(state, look, place, size)
    editing, pinned = state.editing, list[Reading]()
    if editing.tool is Tool.CLONE and editing.source is not None:
        pinned.append(Reading((0.0, 0.0), editing.source))
    if editing.card is not None:
        pinned.append(editing.card.reading)
    elif editing.asked is not None:
        pinned.append(Reading(editing.asked))
    for reading in pinned:
        at = _pinned_at(state, reading, place, size)
        if at is not None:
            _pin(at, look)


def draw(state: State, look: Look, place: ImVec2, size: ImVec2) -> list[do.Command]:
    """What tells of the pointer's place, and of the one that was asked about."""
    editing = state.editing
    quiet = editing.card is not None or editing.asked is not None
    if editing.tool is Tool.POINT and not quiet and editing.hover is not None and editing.hover.point:
        _tooltip(state, editing.hover, look)
    if editing.card is not None:
        return _card(state, editing.card, look, place, size)
    return []


def _on_screen(at: Point, place: ImVec2) -> ImVec2:
    pixels = imgui.get_io().display_framebuffer_scale
    return ImVec2(place.x + at[0] / pixels.x, place.y + at[1] / pixels.y)


def _outline(state: State, look: Look, place: ImVec2) -> None:
    """The line around the selection, where the picture shows it as it was found."""
    editing, marks = state.editing, state.editing.marks
    outline = editing.outline
    if outline is None or marks is None or editing.gesture is not None:
        return
    if outline.pose != state.scene.pose or outline.of != marks.selected:
        return
    canvas, line = imgui.get_window_draw_list(), widgets.u32(theme.SELECTED)
    dark = widgets.u32(ImVec4(0, 0, 0, 0.6))
    for points in outline.lines:
        path = [_on_screen(at, place) for at in points]
        for colour, wide in ((dark, 3.5), (line, 1.5)):
            canvas.add_polyline([*path], col=colour, thickness=look.px(wide), flags=imgui.ImDrawFlags_.closed)


def _region(state: State, look: Look, place: ImVec2, size: ImVec2) -> None:
    """The box or stroke under way, or the brush that waits at the pointer."""
    editing = state.editing
    if not editing.draws:
        return
    canvas = imgui.get_window_draw_list()
    canvas.push_clip_rect(place, ImVec2(place.x + size.x, place.y + size.y), True)
    combine = widgets.combined(editing.combine) if editing.tool.selects else "replace"
    colour = theme.BAD if combine == "remove" else theme.SELECTED
    line, fill = widgets.u32(colour), widgets.u32(ImVec4(colour.x, colour.y, colour.z, 0.22))
    path = [_on_screen(at, place) for at in editing.drag]
    brush = editing.tool in (Tool.BRUSH, Tool.CLONE)
    radius = look.px(editing.radius if brush else PICK_RADIUS)
    if editing.tool is Tool.BOX and len(path) > 1:
        low = ImVec2(min(path[0].x, path[-1].x), min(path[0].y, path[-1].y))
        high = ImVec2(max(path[0].x, path[-1].x), max(path[0].y, path[-1].y))
        canvas.add_rect_filled(low, high, fill)
        canvas.add_rect(low, high, line, 0.0, look.px(1.5))
    elif editing.tool is Tool.LASSO and path:
        canvas.add_polyline([*path, imgui.get_mouse_pos()], col=line, thickness=look.px(1.5), flags=0)
        canvas.add_circle_filled(path[0], look.px(4), line)
    elif editing.tool is Tool.SPHERE and len(path) > 1:
        way = math.hypot(path[-1].x - path[0].x, path[-1].y - path[0].y)
        canvas.add_circle_filled(path[0], way, fill)
        canvas.add_circle(path[0], way, line, 0, look.px(1.5))
    elif brush and path:
        if len(path) > 1:
            canvas.add_polyline([*path], col=fill, thickness=2 * radius, flags=0)
        canvas.add_circle_filled(path[0], radius, fill)
        canvas.add_circle_filled(path[-1], radius, fill)
        canvas.add_circle(path[-1], radius, line, 0, look.px(1.5))
    elif editing.hover is not None and (brush or editing.tool is Tool.PICK):
        canvas.add_circle(imgui.get_mouse_pos(), radius, line, 0, look.px(1.5))
    if editing.hover is not None and combine != "replace":
        sign = fa.ICON_FA_PLUS if combine == "add" else fa.ICON_FA_MINUS
        pointer = imgui.get_mouse_pos()
        canvas.add_text(ImVec2(pointer.x + look.px(10), pointer.y - look.px(22)), line, sign)
    canvas.pop_clip_rect()


def _tooltip(state: State, reading: Reading, look: Look) -> None:
    """Coordinates, depth, and the groups that the pixel shows."""
    imgui.push_style_var(imgui.StyleVar_.window_rounding, look.px(8))
    imgui.begin_tooltip()
    imgui.text_colored(theme.MUTED, _coordinates(reading))
    if reading.atoms is None:
        imgui.text_colored(theme.MUTED, "...")
    for k, share in reading.atoms or ():
        _bar(share, theme.ACCENT, look)
        imgui.same_line()
        imgui.text(f"{100 * share:.0f} %")
        imgui.same_line(look.px(134))
        imgui.text(state.editing.atom_name(k))
        others = state.editing.names[k][1:] if k < len(state.editing.names) else ()
        if others:
            imgui.same_line()
            imgui.text_colored(theme.MUTED, ", ".join(others))
    imgui.end_tooltip()
    imgui.pop_style_var()


def _coordinates(reading: Reading) -> str:
    assert reading.point is not None
    x, y, z = reading.point
    return f"x {x:.2f}   y {y:.2f}   z {z:.2f}   depth {reading.depth:.2f}"


def _bar(share: float, colour: ImVec4, look: Look, line: float | None = None) -> None:
    """A horizontal bar, full at 1, in the middle of a line so high; None: of a line of text."""
    text, width = imgui.get_text_line_height(), look.px(64)
    height = line or text
    corner, canvas = imgui.get_cursor_screen_pos(), imgui.get_window_draw_list()
    top = corner.y + height / 2 - 0.2 * text
    bottom = corner.y + height / 2 + 0.25 * text
    canvas.add_rect_filled(
        ImVec2(corner.x, top), ImVec2(corner.x + width, bottom), widgets.u32(theme.LINE), 3
    )
    filled = corner.x + width * min(max(share, 0.0), 1.0)
    canvas.add_rect_filled(ImVec2(corner.x, top), ImVec2(filled, bottom), widgets.u32(colour), 3)
    imgui.dummy(ImVec2(width, height))


def _pin(at: ImVec2, look: Look) -> None:
    canvas = imgui.get_window_draw_list()
    canvas.add_circle_filled(at, look.px(5), widgets.u32(theme.ACCENT))
    canvas.add_circle(at, look.px(7), widgets.u32(ImVec4(0, 0, 0, 0.7)), 0, look.px(1.5))


def _pinned_at(state: State, reading: Reading, place: ImVec2, size: ImVec2) -> ImVec2 | None:
    """Where the place asked about is on the screen now; None behind the camera or beside the picture."""
    if reading.point is None:
        return _on_screen(reading.at, place)
    found = poses.project(np.array([reading.point]), state.scene.pose, (size.x, size.y))
    if found is None:
        return None
    x, y = found[1][0]
    at = ImVec2(place.x + float(x), place.y + float(y))
    inside = place.x <= at.x <= place.x + size.x and place.y <= at.y <= place.y + size.y
    return at if inside else None


def _card(state: State, card: Card, look: Look, place: ImVec2, size: ImVec2) -> list[do.Command]:
    """The answer, beside its place."""
    at = _pinned_at(state, card.reading, place, size)
    right = place.x + size.x - look.px(_CARD + 16)
    corner = ImVec2(right, place.y + look.px(12))
    if at is not None:
        x = (
            at.x + look.px(18)
            if at.x + look.px(_CARD + 30) < place.x + size.x
            else at.x - look.px(_CARD + 18)
        )
        before = boxes.window_box("##card")
        high = look.px(_HIGH) if before is None else before[3] - before[1]
        y = min(at.y - look.px(40), place.y + size.y - high - look.px(8))
        corner = ImVec2(x, max(y, place.y + look.px(12)))
    imgui.set_next_window_pos(corner)
    imgui.set_next_window_size(ImVec2(look.px(_CARD), 0))
    with widgets.floating("##card", look):
        if imgui.is_window_appearing():  # over the dictionary, and without its keys
            imgui.internal.bring_window_to_display_front(imgui.internal.get_current_window())
        return _answer(state, card, look)


def _answer(state: State, card: Card, look: Look) -> list[do.Command]:
    issued: list[do.Command] = []
    title = "..." if card.words is None else card.words[0][0] if card.words else "Nothing is known here"
    imgui.push_font(None, theme.FONT_SIZE * 1.3)
    imgui.text_unformatted(title)
    imgui.pop_font()
    imgui.same_line(look.px(_CARD - 44))
    if widgets.quiet_button(f"{fa.ICON_FA_XMARK}##card", "Close  (Esc)"):
        issued.append(point.CloseCard())
    group = card.reading.atoms[0][0] if card.reading.atoms else None
    for word, score in (card.words or ())[:_SHOWN_WORDS]:
        _bar(score, theme.ACCENT, look, imgui.get_frame_height())
        imgui.same_line()
        imgui.align_text_to_frame_padding()
        imgui.text(f"{score:.2f}")
        imgui.same_line(look.px(134))
        imgui.text_unformatted(widgets.shortened(word, look.px(_CARD - 134 - 84)))
        if group is not None:
            issued += _lessons(card, group, word, look)
    if card.reading.point is not None:
        imgui.text_colored(theme.MUTED, _coordinates(card.reading))
    if group is not None:
        issued += _group(state, card, group, look)
    return issued + _going_on(card, look)


def _going_on(card: Card, look: Look) -> list[do.Command]:
    """In one row: ask for what is alike, and pin a note where there is a place for it."""
    issued: list[do.Command] = []
    pin = look.px(44) if card.reading.point is not None else 0.0
    if card.vector:
        width = look.px(_CARD - 32) - pin
        if widgets.primary_button(f"{fa.ICON_FA_MAGNIFYING_GLASS}  Find similar", ImVec2(width, 0)):
            issued.append(point.FindSimilar())
        widgets.tooltip("Find everything that looks like this place")
        if pin:
            imgui.same_line(0, look.px(8))
    if card.reading.point is not None:
        word = card.words[0][0] if card.words else ""
        label = (
            f"{fa.ICON_FA_THUMBTACK}##pin" if card.vector else f"{fa.ICON_FA_THUMBTACK}  Pin a note here##pin"
        )
        if imgui.button(label, ImVec2(pin - look.px(8) if card.vector else look.px(_CARD - 32), 0)):
            issued.append(tour.AddNote(word or "note", Vector(*card.reading.point), phrase=word))
        widgets.tooltip("Pin a note here; it is saved in the file and shown in web pages")
    return issued


def _lessons(card: Card, k: int, word: str, look: Look) -> list[do.Command]:
    """At the end of a word's line: the place is that, or is not; asks again what it is then."""
    issued: list[do.Command] = []
    imgui.same_line(look.px(_CARD - 78))
    if widgets.quiet_button(f"{fa.ICON_FA_CHECK}##is {word}", f"This is: {word}"):
        issued.append(edit.RenameAtom(k, word))
    imgui.same_line(0, 0)
    if widgets.quiet_button(f"{fa.ICON_FA_BAN}##not {word}", f"This is not: {word}"):
        issued.append(edit.DenyAtom(k, word))
    return [*issued, point.Ask(card.reading.at)] if issued else []


def _group(state: State, card: Card, k: int, look: Look) -> list[do.Command]:
    """The strongest group of the place: its name, which is asked for again once it is another, its voice, its
    Gaussians."""
    issued: list[do.Command] = []
    marks = state.editing.marks
    if marks is None or k >= len(marks.atoms):
        return []
    atom = marks.atoms[k]
    imgui.separator()
    imgui.push_id(k)
    imgui.set_next_item_width(imgui.get_content_region_avail().x - 2 * look.px(42))
    hint = "your own name"
    entered, name = imgui.input_text_with_hint(
        "##name", hint, atom.name, imgui.InputTextFlags_.enter_returns_true
    )
    widgets.tooltip(f"Rename group {k}, {state.editing.atom_name(k)}; phrases then find it by that name")
    if entered or (imgui.is_item_deactivated_after_edit() and name != atom.name):
        issued += [edit.RenameAtom(k, name), point.Ask(card.reading.at)]
    imgui.same_line(0, look.px(4))
    voice = fa.ICON_FA_VOLUME_HIGH if atom.on else fa.ICON_FA_VOLUME_XMARK
    if imgui.button(f"{voice}##voice", ImVec2(look.px(38), 0)):
        issued.append(edit.ToggleAtom(k))
    widgets.tooltip(
        "This group answers phrases; click to mute it" if atom.on else "Muted; click to let it answer phrases"
    )
    imgui.same_line(0, look.px(4))
    if imgui.button(f"{fa.ICON_FA_DRAW_POLYGON}##group", ImVec2(look.px(38), 0)):
        issued.append(edit.SelectAtom(k))
    widgets.tooltip("Select the Gaussians of this group")
    imgui.pop_id()
    return issued
