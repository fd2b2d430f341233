"""Over the picture's upper right corner: the world's axes, the way to look along one, the kind of rays."""

import numpy as np
from imgui_bundle import ImVec2, ImVec4, imgui
from imgui_bundle import icons_fontawesome_6 as fa

from ... import commands as do
from ...kit import boxes, theme, widgets
from ...kit.look import Look
from ...state import State
from .. import camera

SIZE = 84.0  # design pixels
_ARM, _BALL = 30.0, 8.0
_MARGIN = 8.0
_RAYS = 28.0  # design pixels, of the button beside them
_VIEWS = 88.0  # design pixels, of the strip of photos
_LETTERS = "XYZ"


def draw(state: State, look: Look, place: ImVec2, size: ImVec2) -> list[do.Command]:
    """A ball at each end of an axis, near ones last, on top; in the corner, or below bars that reach it."""
    if state.scene.info is None or size.x < look.px(3 * SIZE):
        return []
    half, rays, margin = look.px(SIZE / 2), look.px(_RAYS), look.px(_MARGIN)
    left, right = place.x + size.x - margin - 2 * half - rays, place.x + size.x - margin
    top = boxes.lowered((left, place.y + margin, right, place.y + margin + 2 * half), boxes.bars(), margin)
    if top + 2 * half > place.y + size.y - look.px(_VIEWS):
        return []
    issued: list[do.Command] = []
    middle = ImVec2(right - half, top + half)
    imgui.set_next_window_pos(ImVec2(left, top))
    imgui.set_next_window_size(ImVec2(2 * half + rays, 2 * half))
    imgui.push_style_var(imgui.StyleVar_.window_padding, ImVec2(0, 0))
    flags = widgets.PLAIN | imgui.WindowFlags_.no_background | imgui.WindowFlags_.no_focus_on_appearing
    imgui.begin("##axes", None, flags)
    canvas, pointer = imgui.get_window_draw_list(), imgui.get_mouse_pos()
    canvas.add_circle_filled(middle, half, imgui.IM_COL32(14, 16, 20, 110))
    nearest = None
    for name, forward, at, depth in ends(state):
        ball = ImVec2(middle.x + look.px(_ARM) * at[0], middle.y + look.px(_ARM) * at[1])
        axis = int(np.argmax(np.abs(forward)))
        positive = -sum(forward) > 0  # this end of the axis, seen from which one looks backwards along it
        colour = theme.AXES[axis]
        faint = ImVec4(colour.x, colour.y, colour.z, 1.0 if depth <= 0 else 0.55)
        radius = look.px(_BALL)
        if positive:
            canvas.add_line(middle, ball, widgets.u32(faint), look.px(2))
            canvas.add_circle_filled(ball, radius, widgets.u32(faint))
            widgets.centred(_LETTERS[axis], ball, theme.DARK.CANVAS)
        else:
            canvas.add_circle_filled(ball, radius, imgui.IM_COL32(14, 16, 20, 200))
            canvas.add_circle(ball, radius, widgets.u32(faint), 0, look.px(1.5))
        if (pointer.x - ball.x) ** 2 + (pointer.y - ball.y) ** 2 <= (1.3 * radius) ** 2:
            nearest = (name, forward, ball, radius)
    imgui.set_cursor_pos(ImVec2(rays, 0))
    pressed = imgui.invisible_button("axes", ImVec2(2 * half, 2 * half))
    if nearest is not None and imgui.is_item_hovered():
        name, forward, ball, radius = nearest
        canvas.add_circle(ball, radius, widgets.u32(theme.DARK.TEXT), 0, look.px(2))
        imgui.set_tooltip(f"Look from {name}")
        if pressed:
            issued.append(camera.Face(forward))
    imgui.set_cursor_pos(ImVec2(0, 2 * half - rays))
    issued += _rays(state, rays)
    imgui.end()
    imgui.pop_style_var()
    return issued


def _rays(state: State, side: float) -> list[do.Command]:
    """A button that shows the kind of rays and changes it."""
    flat = state.scene.pose.span is not None
    icon = fa.ICON_FA_BORDER_ALL if flat else fa.ICON_FA_CUBE
    imgui.push_style_var(imgui.StyleVar_.frame_padding, ImVec2(0, 0))
    with widgets.colours(text=theme.ACCENT if flat else theme.TEXT):
        pressed = imgui.button(f"{icon}##rays", ImVec2(side, side))
    imgui.pop_style_var()
    now, other = ("Parallel rays", "perspective") if flat else ("Perspective", "parallel rays")
    widgets.tooltip(f"{now}; click for {other}  (,)")
    return [camera.SwitchRays()] if pressed else []


def ends(state: State) -> list[tuple[str, camera.Vector, tuple[float, float], float]]:
    """Name, direction of looking in the world that the scene stands in, place in the picture plane (right,
    down) and depth of each end, far first.

    The end that one looks from is opposite to the direction.
    """
    axes = state.turn @ state.scene.pose.axes
    found = []
    for name, forward in camera.SIDES:
        x, y, z = (-np.array(forward)) @ axes
        found.append((name, forward, (float(x), float(y)), float(z)))
    return sorted(found, key=lambda end: -end[3])
