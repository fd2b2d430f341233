"""The strip of a film: its sharp frames, the proposed ones with a check mark; a click takes one in or out."""

from imgui_bundle import ImVec2, imgui
from imgui_bundle import icons_fontawesome_6 as fa

from langflash_core.images.settings import PHOTO_LIMITS
from langflash_core.images.strip import ELSEWHERE, REASONS, REPEAT, Still

from ... import commands as do
from ...kit import theme, widgets
from ...kit.look import Look
from ...state import State
from .. import commands as opening
from ..state import Film, small

WIDTH = 860.0  # design pixels
_HEIGHT, _CELL = 372.0, 116.0
_WHY_NOT = {REPEAT: "shows the same as another frame", ELSEWHERE: "shows another place"}


def draw(state: State, look: Look) -> list[do.Command]:
    """The dialog's body."""
    film = state.opening.film
    if film is None:
        return [do.ShowDialog(None)]
    issued = _number(state, film, look)
    widgets.muted(told(film))
    for note in film.notes:
        with widgets.colours(text=theme.ACCENT):
            imgui.text_wrapped(widgets.sentence(note.partition("; --from")[0]))
    shape = imgui.ChildFlags_.borders | imgui.ChildFlags_.nav_flattened
    imgui.begin_child("##stills", ImVec2(0, look.px(_HEIGHT)), shape)
    gap, room = look.px(8), imgui.get_content_region_avail().x + look.px(8)
    columns = max(int(room / (look.px(_CELL) + gap)), 1)
    for index, still in enumerate(film.strip.stills):
        if index % columns:
            imgui.same_line(0, gap)
        issued += _card(film, index, still, ImVec2(room / columns - gap, look.px(_CELL)), look)
    imgui.end_child()
    return issued + _buttons(film, look)


def told(film: Film) -> str:
    """What became of the film's frames."""
    left = [f"{count} {REASONS[key]}" for key, count in film.left_out.items() if count]
    looked_at = film.strip.num_looked_at
    return f"Of {looked_at} frames, {', '.join(left)}." if left else f"{looked_at} frames."


def _number(state: State, film: Film, look: Look) -> list[do.Command]:
    """How many are chosen; fewer or more of them, chosen anew."""
    issued: list[do.Command] = []
    count, most = len(film.chosen), opening.room_for_frames(state)
    imgui.align_text_to_frame_padding()
    name = widgets.shortened(film.strip.film, look.px(380))
    imgui.text(f"{name}: {count} frame{'s' * (count != 1)} of {film.strip.seconds:.1f} seconds")
    for icon, wanted, tip in (
        (fa.ICON_FA_MINUS, count - 1, "One frame fewer, chosen again"),
        (fa.ICON_FA_PLUS, count + 1, "One frame more, chosen again"),
    ):
        imgui.same_line()
        propose, can = opening.ProposeFrames(wanted, exactly=True), 2 <= wanted <= most
        issued += widgets.press(f"{icon}##{wanted > count}", propose, tip, able=can)
    imgui.same_line()
    tip = "The sharpest frames, spread evenly along the camera's path"
    propose = opening.ProposeFrames(min(most, PHOTO_LIMITS.film_photos))
    return issued + widgets.press("Reset to suggested", propose, tip, quiet=True)


def _card(film: Film, index: int, still: Still, size: ImVec2, look: Look) -> list[do.Command]:
    """A frame with its time; a press switches it."""
    chosen = index in film.chosen
    corner, line = imgui.get_cursor_screen_pos(), imgui.get_text_line_height()
    pressed = imgui.selectable(f"##{index}", chosen, imgui.SelectableFlags_.no_auto_close_popups, size)[0]
    if not imgui.is_item_visible():
        return []
    why_not = _WHY_NOT.get(still.why_not, "")
    widgets.tooltip(f"{still.seconds:.2f} s" + (f", {why_not}" if why_not else ""))
    canvas, picture = imgui.get_window_draw_list(), look.thumbnails.get(small(film.strip.path(index)))
    room = ImVec2(size.x - look.px(10), size.y - line - look.px(12))
    if picture is not None:
        width = min(room.x, room.y * picture[1])
        height = width / picture[1]
        at = ImVec2(corner.x + (size.x - width) / 2, corner.y + look.px(5) + (room.y - height) / 2)
        end = ImVec2(at.x + width, at.y + height)
        tint = 0xFFFFFFFF if chosen or not still.why_not else 0x80FFFFFF
        canvas.add_image(picture[0], at, end, ImVec2(0, 0), ImVec2(1, 1), tint)
    at = ImVec2(corner.x + look.px(6), corner.y + size.y - line - look.px(3))
    canvas.add_text(at, widgets.u32(theme.TEXT if chosen else theme.MUTED), f"{still.seconds:.2f} s")
    if chosen:
        end = ImVec2(corner.x + size.x, corner.y + size.y)
        canvas.add_rect(corner, end, widgets.u32(theme.ACCENT), look.px(4), look.px(2))
        mark = fa.ICON_FA_CIRCLE_CHECK
        extent = imgui.calc_text_size(mark)
        place = ImVec2(end.x - extent.x - look.px(6), end.y - line - look.px(3))
        canvas.add_text(place, widgets.u32(theme.ACCENT), mark)
    return [opening.SwitchFrame(index)] if pressed else []


def _buttons(film: Film, look: Look) -> list[do.Command]:
    issued: list[do.Command] = []
    imgui.begin_disabled(not film.chosen)
    if widgets.default_button(f"{fa.ICON_FA_CUBES}  Reconstruct", look.vec(150, 0)):
        issued.append(opening.TakeFrames())
    imgui.end_disabled()
    imgui.same_line()
    issued += widgets.press("Cancel", do.ShowDialog(None), size=look.vec(110, 0))
    imgui.same_line(0, look.px(14))
    imgui.align_text_to_frame_padding()
    imgui.text_colored(theme.MUTED, "Click a frame to include or exclude it")
    return issued
