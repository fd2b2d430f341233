"""Over the picture: the cameras of the photos as frusta with the photos on them, and the photo of
the view on show to compare with."""

import numpy as np
from imgui_bundle import ImVec2, imgui
from imgui_bundle import icons_fontawesome_6 as fa

from langflash_core.base import pictures
from langflash_core.geometry import poses
from langflash_core.geometry.poses import Pose

from ... import commands as do
from ...asking.things import told
from ...kit import boxes, theme, widgets
from ...kit.boxes import Box
from ...kit.look import Look
from ...state import State
from .. import camera
from ..state import WHOLE, WHOLE_PHOTOS

FRUSTUM = 0.10  # length of a frustum in distances to the pivot of its view
_HANDLE = 13.0  # design pixels


def draw(state: State, look: Look, corner: ImVec2, size: ImVec2) -> list[do.Command]:
    """Frusta and comparison on the picture at `corner` of `size`; call it inside the picture's window,
    before the picture takes the pointer."""
    if state.scene.info is None:
        return []
    if comparing(state):
        return _compare(state, look, corner, size)
    _candidates(state, look, corner, size)
    if state.asking.named and state.scene.mode is pictures.RGB:
        _names(state, look, corner, size)
    if state.keys and state.filming.tour is None:
        _keys(state, look, corner, size)
    if state.preferences.photos_in_space and state.scene.flight is None:
        return _frusta(state, look, corner, size)
    return []


def _candidates(state: State, look: Look, corner: ImVec2, size: ImVec2) -> None:
    """A ring around what comes nearest to each phrase that may be there."""
    for prompt in state.asking.asked:
        if not prompt.maybe or prompt.place is None:
            continue
        found = poses.project(np.array([prompt.place]), state.scene.pose, (size.x, size.y))
        if found is None:
            continue
        x, y = found[1][0]
        if not (0 <= x < size.x and 0 <= y < size.y):
            continue
        at, colour = ImVec2(corner.x + x, corner.y + y), widgets.u32(widgets.rgba(prompt.colour))
        imgui.get_window_draw_list().add_circle(at, look.px(26), colour, 0, look.px(2))
        text, aside = f"{prompt.text.strip()}?", look.px(30)
        wide = _wide(look, text)
        fits = x + aside + wide <= size.x  # else it stands on the ring's other side
        left = at.x + aside if fits else at.x - aside - wide
        widgets.caption(text, ImVec2(left, at.y - look.px(10)), look)


def _keys(state: State, look: Look, corner: ImVec2, size: ImVec2) -> None:
    """The camera's key frames, numbered, joined in their order."""
    canvas, before = imgui.get_window_draw_list(), None
    for number, key in enumerate(state.keys, start=1):
        found = poses.project(np.array([key.centre]), state.scene.pose, (size.x, size.y))
        if found is None:
            before = None
            continue
        x, y = found[1][0]
        at = ImVec2(corner.x + float(x), corner.y + float(y))
        if before is not None:
            canvas.add_line(before, at, widgets.u32(theme.DARK.ACCENT), look.px(1.5))
        canvas.add_circle_filled(at, look.px(5), widgets.u32(theme.DARK.ACCENT))
        widgets.caption(str(number), ImVec2(at.x + look.px(7), at.y - look.px(10)), look)
        before = at


def _names(state: State, look: Look, corner: ImVec2, size: ImVec2) -> None:
    """What the scene knows, at its place; the largest first, none over another or under a panel."""
    insight, taken = state.asking.insight, list[Box]()
    picture = (corner.x, corner.y, corner.x + size.x, corner.y + size.y)
    walls = boxes.windows_over(picture)
    for name, k in told(state).items():
        place = insight.places[k] if insight is not None and k < len(insight.places) else None
        found = (
            None if place is None else poses.project(np.array([place]), state.scene.pose, (size.x, size.y))
        )
        if found is None:
            continue
        (x, y), extent = found[1][0], imgui.calc_text_size(name)
        left, top = corner.x + x - extent.x / 2 - look.px(7), corner.y + y - extent.y / 2 - look.px(3)
        box = (left, top, left + extent.x + look.px(14), top + extent.y + look.px(6))
        box = boxes.clear(box, walls, furthest=extent.x + look.px(14))
        if not boxes.within(box, picture) or any(boxes.overlap(box, other) for other in (*taken, *walls)):
            continue
        taken.append(box)
        widgets.caption(name, ImVec2(box[0], box[1]), look)


def comparing(state: State) -> bool:
    """Whether the photo of the view on show lies over a part of the picture."""
    return state.scene.compare is not None and state.scene.view is not None and state.scene.flight is None


# Frusta


def _frusta(state: State, look: Look, corner: ImVec2, size: ImVec2) -> list[do.Command]:
    assert state.scene.info is not None
    issued: list[do.Command] = []
    canvas = imgui.get_window_draw_list()
    shown = [
        (float(depths.mean()), view, points)
        for view, pose in enumerate(state.scene.info.views)
        if (projected := poses.project(frustum(pose), state.scene.pose, (size.x, size.y))) is not None
        and state.scene.view != view
        for depths, points in [projected]
    ]
    for _, view, points in sorted(shown, key=lambda each: -each[0]):  # far ones first
        tip, *base = [ImVec2(corner.x + float(x), corner.y + float(y)) for x, y in points]
        centre = ImVec2(sum(p.x for p in base) / 4, sum(p.y for p in base) / 4)
        half = [max(abs(p.x - centre.x) for p in base), max(abs(p.y - centre.y) for p in base)]
        over = _over(state, view, centre, half, size)
        colour = widgets.u32(theme.DARK.ACCENT if over else theme.DARK.TEXT)
        for point in base:
            canvas.add_line(tip, point, colour, look.px(1.2))
        a, b, c, d = base
        picture = look.thumbnails.get(f"view {view}")
        if picture is not None:
            tint = imgui.IM_COL32(255, 255, 255, 225)
            corners = (ImVec2(0, 0), ImVec2(1, 0), ImVec2(1, 1), ImVec2(0, 1))
            canvas.add_image_quad(picture[0], a, b, c, d, *corners, col=tint)
        canvas.add_quad(a, b, c, d, colour, look.px(2.2 if over else 1.2))
        if over:
            imgui.set_tooltip(f"Go to where photo {view + 1} was taken")
            if imgui.is_mouse_clicked(0):
                issued.append(camera.JumpTo(view))
    return issued


def _over(state: State, view: int, centre: ImVec2, half: list[float], size: ImVec2) -> bool:
    """Whether the pointer is on a frustum's photo, with nothing else in front."""
    if max(half) > size.x or not imgui.is_window_hovered() or imgui.is_any_item_active():
        return False
    pointer = imgui.get_mouse_pos()
    return abs(pointer.x - centre.x) <= half[0] and abs(pointer.y - centre.y) <= half[1]


def frustum(pose: Pose) -> np.ndarray:
    """(5, 3) world: the camera's centre and the corners of its picture, clockwise from the upper left."""
    width, height = (1.0, 1.0 / pose.aspect)
    K = poses.intrinsics(pose, 1000, round(1000 * height))
    K = K / 1000
    K[2, 2] = 1.0
    pixels = np.array([[0, 0, 1], [width, 0, 1], [width, height, 1], [0, height, 1]])
    rays = pixels @ np.linalg.inv(K).T
    corners = rays * FRUSTUM * pose.reach
    return np.concatenate((np.zeros((1, 3)), corners)) @ pose.axes.T + np.array(pose.centre)


# Comparison


def photo_box(pose: Pose, size: tuple[float, float]) -> tuple[float, float, float, float]:
    """(left, top, right, bottom) of the photo in a picture of `size`, from its upper left corner; above and
    below it may reach beyond."""
    width, height = poses.box_in(pose, *size)
    left, top = (size[0] - width) / 2, (size[1] - height) / 2
    return left, top, left + width, top + height


def _compare(state: State, look: Look, corner: ImVec2, size: ImVec2) -> list[do.Command]:
    """The photo to the right of a line that can be dragged."""
    many = state.scene.info is not None and len(state.scene.info.scene.photos) > WHOLE_PHOTOS
    place, picture = state.scene.compare, look.thumbnails.get(WHOLE if many else f"view {state.scene.view}")
    if place is None or picture is None:
        return []
    left, top, right, bottom = photo_box(state.scene.pose, (size.x, size.y))
    x = left + place * (right - left)
    above = max(-top, 0.0) / max(bottom - top, 1)  # of the photo, out of sight, and as much below
    canvas = imgui.get_window_draw_list()
    low = ImVec2(corner.x + x, corner.y + max(top, 0.0))
    high = ImVec2(corner.x + right, corner.y + min(bottom, size.y))
    canvas.add_image(picture[0], low, high, ImVec2(place, above), ImVec2(1, 1 - above))
    canvas.add_line(low, ImVec2(low.x, high.y), widgets.u32(theme.DARK.ACCENT), look.px(2))
    middle, radius = ImVec2(low.x, (low.y + high.y) / 2), look.px(_HANDLE)
    canvas.add_circle_filled(middle, radius, widgets.u32(theme.DARK.ACCENT))
    widgets.centred(fa.ICON_FA_LEFT_RIGHT, middle, theme.DARK.ON_ACCENT)
    top = low.y + look.px(10)
    widgets.caption("scene", ImVec2(low.x - look.px(10) - _wide(look, "scene"), top), look)
    widgets.caption("photo", ImVec2(low.x + look.px(10), top), look)
    before = imgui.get_cursor_screen_pos()
    imgui.set_cursor_screen_pos(ImVec2(low.x - radius, low.y))
    imgui.set_next_item_allow_overlap()
    imgui.invisible_button("compare", ImVec2(2 * radius, max(high.y - low.y, 1)))
    if imgui.is_item_hovered() or imgui.is_item_active():
        imgui.set_mouse_cursor(imgui.MouseCursor_.resize_ew)
    dragged = imgui.is_item_active()
    imgui.set_cursor_screen_pos(before)
    if not dragged:
        return []
    wanted = (imgui.get_mouse_pos().x - corner.x - left) / max(right - left, 1)
    return [camera.Compare(min(max(wanted, 0.0), 1.0))]


def _wide(look: Look, text: str) -> float:
    """How wide its caption is."""
    return imgui.calc_text_size(text).x + look.px(14)
