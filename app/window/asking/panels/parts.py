"""The parts of the answer to the active phrase: a row each with how sure it is, out of the answer with a
click, and back; their numbers in the picture."""

import numpy as np
from imgui_bundle import ImVec2, imgui
from imgui_bundle import icons_fontawesome_6 as fa

from langflash_core.geometry import poses

from ... import commands as do
from ...kit import boxes, theme, widgets
from ...kit.look import Look
from ...state import State
from .. import parting
from ..state import Part

MOST = 8
"""Parts that are listed; smaller ones can be clicked in the picture."""
_BAR = 46.0  # design pixels, of how sure


def draw(state: State, look: Look) -> list[do.Command]:
    """The rows; nothing before an answer is taken apart."""
    prompt = parting.divided(state)
    if prompt is None or state.scene.info is None:
        return []
    text = prompt.text.strip()
    listed = _listed(state, text)
    out = parting.taken_out(state, text)
    if not listed and not out:
        return []
    issued: list[do.Command] = []
    widgets.gap(look.px(2))
    parts = f"{len(listed)} part{'s' * (len(listed) != 1)}" if listed else "Parts"
    count = parts + (f", {len(out)} removed" if out else "")
    opened = widgets.section(f"{count}###parts")
    widgets.tooltip("The parts of this answer. Ctrl+click one in the picture to remove it or bring it back")
    if not opened:
        return []
    busy = state.scene.job is not None
    for number, part in enumerate(listed[:MOST], start=1):
        imgui.push_id(f"part {number}")
        issued += _row(text, number, part, busy, look)
        imgui.pop_id()
    if len(listed) > MOST:
        widgets.muted(f"and {len(listed) - MOST} smaller ones; Ctrl+click them in the picture")
    for k in out:
        imgui.push_id(f"out {k}")
        issued += _out(state, text, k)
        imgui.pop_id()
    return issued


def _listed(state: State, text: str) -> tuple[Part, ...]:
    parts = state.asking.parts
    return parts.parts if parts is not None and parts.text == text else ()


def _row(text: str, number: int, part: Part, busy: bool, look: Look) -> list[do.Command]:
    """Number and kind | how sure | out."""
    start, room = imgui.get_cursor_pos_x(), imgui.get_content_region_avail().x
    side = imgui.get_frame_height()
    imgui.align_text_to_frame_padding()
    figures = side + look.px(_BAR + 16) + imgui.calc_text_size("100%").x
    imgui.text_colored(theme.TEXT, widgets.shortened(f"{number}  {part.kind or 'something'}", room - figures))
    widgets.tooltip(
        f"Looks like: {part.kind or 'nothing it knows'}; {part.share:.1%} of the photo that shows it best"
    )
    widgets.column(start + room - figures)
    corner, canvas, high = imgui.get_cursor_screen_pos(), imgui.get_window_draw_list(), look.px(5)
    low = ImVec2(corner.x, corner.y + (side - high) / 2)
    full = ImVec2(low.x + look.px(_BAR), low.y + high)
    canvas.add_rect_filled(low, full, widgets.u32(theme.LINE), high / 2)
    canvas.add_rect_filled(
        low, ImVec2(low.x + part.sure * look.px(_BAR), full.y), widgets.u32(theme.ACCENT), high / 2
    )
    imgui.dummy(ImVec2(look.px(_BAR), side))
    widgets.tooltip(f"How likely this is {text}")
    figure = f"{part.sure:.0%}"
    widgets.column(start + room - side - look.px(4) - imgui.calc_text_size(figure).x)
    imgui.text_colored(theme.MUTED, figure)
    widgets.column(start + room - side)
    imgui.begin_disabled(busy)
    pressed = widgets.quiet_button(f"{fa.ICON_FA_XMARK}##out", "Remove it from the answer  (Ctrl+Z undoes)")
    imgui.end_disabled()
    return [parting.TakePartOut(text, part)] if pressed else []


def _out(state: State, text: str, k: int) -> list[do.Command]:
    """A part that was taken out, and the way back."""
    start, room = imgui.get_cursor_pos_x(), imgui.get_content_region_avail().x
    side = imgui.get_frame_height()
    imgui.align_text_to_frame_padding()
    imgui.text_colored(theme.MUTED, widgets.shortened(f"removed: {state.editing.atom_name(k)}", room - side))
    widgets.column(start + room - side)
    pressed = widgets.quiet_button(f"{fa.ICON_FA_ROTATE_LEFT}##back", "Put it back into the answer")
    return [parting.TakePartBack(text, k)] if pressed else []


def draw_marks(state: State, look: Look, corner: ImVec2, size: ImVec2) -> None:
    """The parts' numbers at their places in the picture, where there are several."""
    prompt = parting.divided(state)
    if prompt is None or not state.scene.mode.answers or state.scene.flight is not None:
        return
    listed = _listed(state, prompt.text.strip())[:MOST]
    if len(listed) < 2:
        return
    canvas, radius, taken = imgui.get_window_draw_list(), look.px(10), list[boxes.Box]()
    for number, part in enumerate(listed, start=1):
        found = poses.project(np.array([part.place]), state.scene.pose, (size.x, size.y))
        if found is None:
            continue
        x, y = corner.x + float(found[1][0, 0]), corner.y + float(found[1][0, 1])
        box = (x - radius, y - radius, x + radius, y + radius)
        inside = corner.x <= x < corner.x + size.x and corner.y <= y < corner.y + size.y
        if not inside or any(boxes.overlap(box, other) for other in taken):
            continue
        taken.append(box)
        canvas.add_circle_filled(ImVec2(x, y), radius, imgui.IM_COL32(14, 16, 20, 205))
        extent = imgui.calc_text_size(str(number))
        at = ImVec2(x - extent.x / 2, y - extent.y / 2)
        canvas.add_text(at, widgets.u32(theme.DARK.TEXT), str(number))
