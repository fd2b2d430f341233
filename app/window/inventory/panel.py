"""The inventory beside the picture: a thing a row, with its picture, name, size, place, photos and how sure
it is; and the box of the chosen one in the picture."""

from imgui_bundle import ImVec2, imgui
from imgui_bundle import icons_fontawesome_6 as fa

from langflash_core.base.outputs import ROOM
from langflash_core.geometry import poses
from langflash_core.scene.edits import Combine

from .. import commands as do
from ..asking.things import things
from ..exporting import commands as export
from ..kit import boxes, theme, widgets
from ..kit.look import Look
from ..scene.standing import LevelScene
from ..state import State
from . import commands as take
from .state import Row

SURE = 0.95
"""From here on a thing is what it is called: `langflash_core.writing.inventory.words`, which loads torch."""
_SIZE = (372.0, 560.0)  # design pixels, the height at most
_LEAST = (300.0, 220.0)
_BELOW = 150.0  # of axes and key frames, which are above
_BAR = 46.0  # of how sure
_ASIDE = 120.0  # how far a caption goes to be seen
_NAME = "##name"
_STRUCTURE = ("wall", "floor", "ceiling")  # of langflash_core/inventory/pieces.py, which loads torch
_EDGES = ((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7))


def button(state: State) -> list[do.Command]:
    """Opens the inventory, or closes it."""
    label, on, there = f"{fa.ICON_FA_LIST_CHECK}##inventory", state.listing.open, state.scene.info is not None
    tip = "Inventory: what is in the room, how many, how large, where and how sure  (Ctrl+L)"
    issued: list[do.Command] = [*widgets.press(label, take.ShowInventory(not on), tip, able=there, on=on)]
    imgui.same_line()
    return issued


def draw(state: State, look: Look, place: ImVec2, size: ImVec2, above: ImVec2) -> list[do.Command]:
    """The window over the picture's right side, or over the panel where that is narrow. above: the size of
    the picture's place without the strip of photos at its foot, whose buttons it does not cover."""
    if not state.listing.open:
        return []
    corner, extent = boxes.opens_at(place, size, above.y, look, _BELOW, _SIZE, _LEAST[1])
    imgui.set_next_window_pos(corner, imgui.Cond_.appearing)
    imgui.set_next_window_size(extent, imgui.Cond_.appearing)
    imgui.set_next_window_size_constraints(look.vec(*_LEAST), imgui.get_io().display_size)
    imgui.push_style_var(imgui.StyleVar_.window_rounding, look.px(8))
    flags = imgui.WindowFlags_.no_collapse | imgui.WindowFlags_.no_saved_settings
    flags |= imgui.WindowFlags_.no_scrollbar | imgui.WindowFlags_.no_scroll_with_mouse
    issued: list[do.Command] = []
    shown, kept = imgui.begin("Inventory", True, flags)
    if shown:
        covered = place.x + size.x - imgui.get_window_pos().x
        issued += _body(state, look, (size.x, size.y, covered if covered < size.x else 0.0))
    imgui.end()
    imgui.pop_style_var()
    return issued if kept else [*issued, take.ShowInventory(False)]


def _body(state: State, look: Look, picture: tuple[float, float, float]) -> list[do.Command]:
    listing = state.listing
    if listing.rows is None:
        widgets.muted("Looking for things ...")
        return []
    if listing.problem:
        widgets.muted(widgets.sentence(listing.problem))
        return []
    counts = ", ".join(f"{number} × {kind}" for kind, number in listing.counts.items())
    total = f"{len(listing.rows)} thing{'s' * (len(listing.rows) != 1)}"
    imgui.text(total + ("  ..." if listing.looking else ""))
    imgui.same_line()
    line = widgets.shortened(counts, imgui.get_content_region_avail().x)
    imgui.text_colored(theme.MUTED, line)
    widgets.tooltip(counts if line != counts else "")
    issued: list[do.Command] = []
    footer = imgui.get_frame_height() + imgui.get_text_line_height() + 3 * imgui.get_style().item_spacing.y
    imgui.begin_child("##things", ImVec2(0, -footer), imgui.ChildFlags_.nav_flattened)  # keys walk in and out
    for row in listing.rows:
        imgui.push_id(row.id)
        issued += _row(state, row, look, picture)
        imgui.pop_id()
    if not listing.rows:
        widgets.muted("Nothing here is certain enough to list; search for it with a phrase.")
    others = [name for name in things(state) if name not in (*listing.counts, *_STRUCTURE)]
    if others:
        widgets.muted(f"Here too, but not listed, since no one thing of it is certain: {', '.join(others)}.")
    imgui.end_child()
    return issued + _foot(state, look)


def _row(state: State, row: Row, look: Look, picture: tuple[float, float, float]) -> list[do.Command]:
    """Picture | name and how sure | size, place, photos; the picture and the words lead there.

    Up and Down walk from picture to picture: of the names that of the row with the keys alone is a stop, and
    no words are, since ImGui goes to what is nearest, which they would be.
    """
    issued: list[do.Command] = []
    chosen = state.listing.chosen == row.id
    pressed = _picture(row, chosen, look)
    has_keys = imgui.is_item_focused() or imgui.get_current_context().nav_id == imgui.get_id(_NAME)
    imgui.same_line(0, look.px(10))
    imgui.begin_group()
    start, room = imgui.get_cursor_pos_x(), imgui.get_content_region_avail().x - look.px(6)
    imgui.push_item_flag(imgui.ItemFlags_.no_nav, not has_keys)
    issued += _name(state, row, room - look.px(_BAR + 52))
    imgui.pop_item_flag()
    _sure(row, start + room, look)
    lines = words(row, state.listing.unit)
    with widgets.colours(text=theme.ACCENT if chosen else theme.MUTED):
        text = "\n".join(widgets.shortened(line, room) for line in lines)
        imgui.push_item_flag(imgui.ItemFlags_.no_nav, True)
        lit = has_keys and imgui.get_io().nav_visible
        pressed |= imgui.selectable(f"{text}##go", lit, 0, ImVec2(room, 0))[0]
        imgui.pop_item_flag()
    told = (*lines, "Photos show one side of it, so its depth is not known.") if row.thin else lines
    widgets.tooltip("\n".join((*told, "Select it and fly there; Shift adds to the selection, Ctrl removes")))
    imgui.end_group()
    if pressed:
        io = imgui.get_io()
        combine: Combine = "add" if io.key_shift else "remove" if io.key_ctrl else "replace"
        issued.append(take.ChooseThing(row.id, combine, picture))
    return issued


def _picture(row: Row, chosen: bool, look: Look) -> bool:
    """What a photo shows of it, in the middle of a square."""
    picture = look.thumbnails.get(f"thing {row.id}")
    side = imgui.get_frame_height_with_spacing() + 2 * imgui.get_text_line_height()
    ring = theme.ACCENT if chosen else theme.LINE
    with widgets.colours(button=ring, button_hovered=theme.ACCENT, button_active=theme.ACCENT):
        if picture is None:
            pressed = imgui.button("##picture", ImVec2(side, side))
        else:
            imgui.push_style_var(imgui.StyleVar_.frame_padding, look.vec(2, 2))
            inner = side - look.px(4)
            texture, aspect = picture
            pressed = imgui.image_button(
                "picture", texture, ImVec2(inner, inner), *widgets.middle(aspect, 1.0)
            )
            imgui.pop_style_var()
    widgets.tooltip("Select it and fly there  (Enter; Tab: its name)")
    return pressed


def _name(state: State, row: Row, width: float) -> list[do.Command]:
    """A field for its name."""
    marks = state.editing.marks
    own = marks.thing_names.get(row.id, "") if marks is not None else ""
    imgui.set_next_item_width(width)
    maybe = "?" if row.sure < SURE or row.thin else ""
    entered, name = imgui.input_text_with_hint(
        _NAME, row.id + maybe, own, imgui.InputTextFlags_.enter_returns_true
    )
    widgets.tooltip(f"{row.id}; type a name")
    changed = entered or imgui.is_item_deactivated_after_edit()
    return [take.NameThing(row.id, name)] if changed and name != own else []


def _sure(row: Row, right: float, look: Look) -> None:
    """A bar and a figure, up to `right` of the window."""
    figure = f"{row.sure:.0%}"
    imgui.same_line()
    imgui.set_cursor_pos_x(right - look.px(_BAR) - look.px(8) - imgui.calc_text_size("100%").x)
    imgui.align_text_to_frame_padding()
    corner, line = imgui.get_cursor_screen_pos(), imgui.get_frame_height()
    canvas, high = imgui.get_window_draw_list(), look.px(5)
    low = ImVec2(corner.x, corner.y + (line - high) / 2)
    full = ImVec2(corner.x + look.px(_BAR), low.y + high)
    canvas.add_rect_filled(low, full, widgets.u32(theme.LINE), high / 2)
    end = ImVec2(low.x + row.sure * look.px(_BAR), full.y)
    canvas.add_rect_filled(low, end, widgets.u32(theme.GOOD if row.sure >= SURE else theme.ACCENT), high / 2)
    imgui.dummy(ImVec2(look.px(_BAR), line))
    widgets.tooltip("How certain its name is" if row.sure >= SURE else "It may be something else")
    imgui.same_line(0, look.px(8))
    imgui.set_cursor_pos_x(right - imgui.calc_text_size(figure).x)
    imgui.text_colored(theme.MUTED, figure)


def words(row: Row, unit: str) -> tuple[str, str]:
    """Its size, "0.74 × 0.43 × 0.41 m", and its place and photos, "0.6 m E, 1.2 m N · photos 1, 2"."""
    size = " × ".join(f"{side:.2f}" for side in row.size) + f" {unit}" + (" and more" if row.cut else "")
    east, _, north = row.place
    sides = "E" if east >= 0 else "W", "N" if north >= 0 else "S"
    short = unit if unit == "m" else "u"
    where = f"{abs(east):.1f} {short} {sides[0]}, {abs(north):.1f} {short} {sides[1]}"
    seen = f"photo{'s' * (len(row.photos) > 1)} {', '.join(str(view + 1) for view in sorted(row.photos))}"
    return size, f"{where} · {seen}" if row.photos else where


def _foot(state: State, look: Look) -> list[do.Command]:
    """Where lengths come from, and the files."""
    issued: list[do.Command] = []
    listing = state.listing
    text, tip = "Lengths are in scene units.", "Measure one (T) and type its true length."
    if listing.guess is not None:
        text = f"Lengths are estimates, ± {listing.guess.spread:.0%}."
        tip = f"By {', '.join(listing.guess.by)}. {tip}"
    elif listing.unit == "m":
        text, tip = "Lengths use the scale that you set.", ""
    imgui.text_colored(theme.MUTED, text)
    widgets.tooltip(tip)
    if state.world is None:
        imgui.same_line()
        if imgui.small_button("Level the scene"):
            issued.append(LevelScene())
    right = imgui.get_cursor_screen_pos().x + imgui.get_content_region_avail().x
    for place, what in enumerate(ROOM):
        label = what.label.partition(", ")[2].upper().lstrip(".") or what.label
        if place:
            widgets.go_on(widgets.button_width(label), right, look.px(6))
        issued += widgets.press(f"{label}##export", export.ShowExport(what), what.tip)
    return issued


def draw_box(state: State, look: Look, corner: ImVec2, size: ImVec2) -> None:
    """On the picture, in the present window: the box of the chosen thing and what it is called."""
    row = state.listing.row(state.listing.chosen) if state.listing.open else None
    if row is None or state.scene.info is None:
        return
    canvas, colour = imgui.get_window_draw_list(), widgets.u32(theme.DARK.ACCENT)
    canvas.push_clip_rect(corner, ImVec2(corner.x + size.x, corner.y + size.y), True)
    for ends in _EDGES:
        for (ax, ay), (bx, by) in poses.visible(row.corners[list(ends)], state.scene.pose, (size.x, size.y)):
            start, end = ImVec2(corner.x + ax, corner.y + ay), ImVec2(corner.x + bx, corner.y + by)
            canvas.add_line(start, end, colour, look.px(1.5))
    canvas.pop_clip_rect()
    marks = state.editing.marks
    name = (marks.thing_names.get(row.id) if marks is not None else None) or row.id
    found = poses.project(row.corners[4:].mean(0)[None], state.scene.pose, (size.x, size.y))
    if found is None:
        return
    x, y = found[1][0]
    walls = boxes.windows_over((corner.x, corner.y, corner.x + size.x, corner.y + size.y))
    left, top, *_ = caption_box(look, (corner.x + float(x), corner.y + float(y)), name, walls)
    widgets.caption(name, ImVec2(left, top), look, shade=205)


def caption_box(look: Look, at: tuple[float, float], text: str, walls: tuple[boxes.Box, ...]) -> boxes.Box:
    """Of words centred above a point, but beside the bars and panels that are there."""
    extent = imgui.calc_text_size(text)
    left, top = at[0] - extent.x / 2 - look.px(7), at[1] - extent.y - look.px(14)
    box = (left, top, left + extent.x + look.px(14), top + extent.y + look.px(6))
    return boxes.clear(box, walls, furthest=look.px(_ASIDE))
