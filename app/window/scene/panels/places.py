"""The scene's photos by place: a small map from above, and what was left out and why."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from imgui_bundle import ImVec2, imgui
from imgui_bundle import icons_fontawesome_6 as fa

from langflash_core.images.still_names import shown_name
from langflash_core.scene.report import film_sentences, left_out_shares, unplaced_names

from ... import commands as do
from ...kit import theme, widgets
from ...kit.look import Look
from ...state import State
from .. import camera
from ..state import ABOVE, SceneInfo

if TYPE_CHECKING:
    from langflash_core.scene.above import Above

FEWEST = 3  # photos; two are seen at a glance
_POPUP = "places"
_WIDTH, _HEIGHT = 380.0, 300.0  # of the map at most, design pixels
_SHARE = 0.5  # of the window's height, that the map takes at most
_DOT, _WAY, _NEAR = 4.5, 15.0, 13.0
_SMALL, _BESIDE = 200.0, 22.0  # wide is the photo under the pointer; from the map
_LINES = 6  # of sentences below the map
_NAMED = 6  # photos that could not be placed


def offered(info: SceneInfo) -> bool:
    """Whether there is anything to show."""
    return len(info.views) >= FEWEST or bool(left_out(info))


def draw(state: State, look: Look, size: ImVec2) -> list[do.Command]:
    """The button, and what it opens."""
    info = state.scene.info
    if info is None or not offered(info):
        return []
    if imgui.button(f"{fa.ICON_FA_MAP_LOCATION_DOT}###places", size):
        imgui.open_popup(_POPUP)
    widgets.tooltip("Map of the photos, with any left out")
    corner, extent = imgui.get_item_rect_min(), _extent(info, look)
    right = imgui.get_main_viewport().size.x - extent.x - 2 * imgui.get_style().window_padding.x
    above = ImVec2(max(min(corner.x, right), 0.0), corner.y - look.px(6))
    imgui.set_next_window_pos(above, imgui.Cond_.appearing, ImVec2(0, 1))
    if not imgui.begin_popup(_POPUP, imgui.WindowFlags_.no_move):
        return []
    issued = _map(state, info, info.above, extent, look) if info.above is not None else []
    _sentences(left_out(info), extent.x)
    imgui.end_popup()
    return issued


def left_out(info: SceneInfo) -> list[str]:
    """What of the photos is not in the scene, and why, a sentence each."""
    told = info.scene.record.left_out
    names, said = unplaced_names(told), []
    if names:
        more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
        who = ", ".join(shown_name(name) for name in names[:_NAMED]) + more
        said.append(f"Could not be placed, too little overlap with other photos: {who}.")
    some = sum(share > 0 for share in _shares(info))
    if some:
        whose = "1 photo" if some == 1 else f"{some} photos"
        said.append(f"Parts of {whose} (ringed) were left out: other photos show something else there.")
    return [*said, *film_sentences(told)]


def _shares(info: SceneInfo) -> Sequence[float]:
    """Of each photo what was left out; none where the record speaks of other views."""
    shares = left_out_shares(info.scene.record.left_out)
    return shares if len(shares) == len(info.views) else ()


def _extent(info: SceneInfo, look: Look) -> ImVec2:
    """Of the map, interface pixels."""
    screen, aspect = imgui.get_main_viewport().size, info.above.aspect if info.above is not None else 1.0
    height = min(look.px(_HEIGHT), _SHARE * screen.y)
    width = min(height * aspect, look.px(_WIDTH), 0.8 * screen.x)
    return ImVec2(width, width / aspect)


def _map(state: State, info: SceneInfo, above: "Above", extent: ImVec2, look: Look) -> list[do.Command]:
    """From above: a click on a photo flies to its view."""
    corner = imgui.get_cursor_screen_pos()
    pressed = imgui.invisible_button("map", extent)
    canvas, end = imgui.get_window_draw_list(), ImVec2(corner.x + extent.x, corner.y + extent.y)
    canvas.add_rect_filled(corner, end, widgets.u32(theme.DARK.CANVAS), look.px(6))
    picture = look.thumbnails.get(ABOVE)
    if picture is not None:
        tint = imgui.IM_COL32(255, 255, 255, 170)
        canvas.add_image_rounded(picture[0], corner, end, ImVec2(0, 0), ImVec2(1, 1), tint, look.px(6))
    dots = [(corner.x + x * extent.x, corner.y + y * extent.y) for x, y in above.eyes.tolist()]
    over = _nearest(dots, look.px(_NEAR)) if imgui.is_item_hovered() else None
    order = sorted(range(len(dots)), key=lambda view: (view == over, view == state.scene.view))
    canvas.push_clip_rect(corner, end, True)
    for view in order:
        _photo(
            info, view, dots[view], above.ways[view].tolist(), (view == state.scene.view, view == over), look
        )
    canvas.pop_clip_rect()
    if over is None:
        return []
    _under_pointer(info, over, corner, look)
    return [camera.JumpTo(over)] if pressed else []


def _nearest(dots: Sequence[tuple[float, float]], reach: float) -> int | None:
    """The dot under the pointer."""
    pointer = imgui.get_mouse_pos()
    far = [math.hypot(x - pointer.x, y - pointer.y) for x, y in dots]
    return None if not far or min(far) > reach else far.index(min(far))


def _photo(
    info: SceneInfo,
    view: int,
    dot: tuple[float, float],
    way: tuple[float, float],
    marked: tuple[bool, bool],
    look: Look,
) -> None:
    """A photo: a dot, and a wedge as wide as its picture. marked: stood at, under the pointer."""
    canvas, (x, y), chosen = imgui.get_window_draw_list(), dot, any(marked)
    ink = theme.DARK.ACCENT if chosen else theme.DARK.TEXT
    half, middle = math.radians(info.views[view].fov) / 2, math.atan2(way[1], way[0])
    if way[0] or way[1]:
        left, right = (
            ImVec2(x + look.px(_WAY) * math.cos(middle + turn), y + look.px(_WAY) * math.sin(middle + turn))
            for turn in (-half, half)
        )
        faint = widgets.u32(widgets.rgba((ink.x, ink.y, ink.z), 0.45 if chosen else 0.22))
        canvas.add_triangle_filled(ImVec2(x, y), left, right, faint)
    canvas.add_circle_filled(ImVec2(x, y), look.px(_DOT), widgets.u32(ink))
    shares = _shares(info)
    ring = theme.DARK.BAD if shares and shares[view] > 0 else theme.DARK.CANVAS
    canvas.add_circle(ImVec2(x, y), look.px(_DOT + 1), widgets.u32(ring), 0, look.px(1.5))


def _under_pointer(info: SceneInfo, view: int, corner: ImVec2, look: Look) -> None:
    """The photo itself, its name, and what of it is left out; beside the map, where there is room."""
    imgui.set_mouse_cursor(imgui.MouseCursor_.hand)
    if corner.x > look.px(_SMALL + 3 * _BESIDE):
        beside = ImVec2(corner.x - look.px(_BESIDE), corner.y)
        imgui.set_next_window_pos(beside, imgui.Cond_.always, ImVec2(1, 0))
    if not imgui.begin_tooltip():
        return
    picture = look.thumbnails.get(f"view {view}")
    if picture is not None:
        wide = look.px(_SMALL) * min(1.0, picture[1])
        imgui.image(picture[0], ImVec2(wide, wide / picture[1]))
    names, shares = info.scene.record.photos, _shares(info)
    name = f": {shown_name(names[view])}" if len(names) == len(info.views) else ""
    imgui.text(f"Photo {view + 1}{name}")
    if shares and shares[view] > 0:
        widgets.muted(f"{max(1, round(100 * shares[view]))} % of it is left out")
    imgui.end_tooltip()


def _sentences(said: Sequence[str], width: float) -> None:
    """Below the map, as wide; they scroll where there are many."""
    said, style = said or ("Every photo was used.",), imgui.get_style()
    high = sum(imgui.calc_text_size(each, wrap_width=width).y + style.item_spacing.y for each in said)
    imgui.begin_child("##left out", ImVec2(width, min(high, _LINES * imgui.get_text_line_height())))
    with widgets.colours(text=theme.MUTED):
        for each in said:
            imgui.text_wrapped(each)
    imgui.end_child()
