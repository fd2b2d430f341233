"""Hands on the picture with a tool: pointing, asking, drawing a region."""

from imgui_bundle import ImVec2, imgui

from ... import commands as do
from ...kit.look import Look
from ...state import State
from .. import commands as edit
from .. import pointing as point
from ..state import PICK_RADIUS, Point, Region, Tool

CLICK = 4.0  # design pixels that a click may slip


def _pointer(corner: ImVec2) -> Point:
    """Where the pointer is in the picture's place, framebuffer pixels."""
    pointer, pixels = imgui.get_mouse_pos(), imgui.get_io().display_framebuffer_scale
    return (pointer.x - corner.x) * pixels.x, (pointer.y - corner.y) * pixels.y


def hover(state: State, corner: ImVec2) -> list[do.Command]:
    """Tell where the pointer is, when that has changed."""
    at = _pointer(corner) if imgui.is_item_hovered() and not imgui.is_item_active() else None
    before = state.editing.hover.at if state.editing.hover is not None else None
    return [] if at == before else [point.Hover(at)]


def ask(look: Look, corner: ImVec2) -> list[do.Command]:
    """A click without a drag asks what is there."""
    if not (imgui.is_item_deactivated() and imgui.is_mouse_released(0)):
        return []
    slipped = imgui.get_mouse_drag_delta(0, look.px(CLICK))
    return [] if slipped.x or slipped.y else [point.Ask(_pointer(corner))]


def region(state: State, look: Look, corner: ImVec2) -> list[do.Command]:
    """The box or stroke being drawn, and at its end the request to select what it shows."""
    editing, io = state.editing, imgui.get_io()
    held = imgui.is_item_active() and imgui.is_mouse_down(0)
    let_go = imgui.is_item_deactivated() and imgui.is_mouse_released(0)
    if not (held or let_go):
        return [point.Drag(())] if editing.drag else []
    way, here = imgui.get_mouse_drag_delta(0, 0.0), _pointer(corner)
    pixels = io.display_framebuffer_scale
    start = (here[0] - way.x * pixels.x, here[1] - way.y * pixels.y)
    path = editing.drag or (start,)
    if editing.tool is Tool.BRUSH:
        path = path if path[-1] == here else (*path, here)
    else:
        path = (start,) if editing.tool is Tool.PICK or start == here else (start, here)
    if held:
        return [] if path == editing.drag else [point.Drag(path)]
    radius = {Tool.BOX: None, Tool.PICK: PICK_RADIUS, Tool.BRUSH: editing.radius}[editing.tool]
    scaled = None if radius is None else radius * look.scale * pixels.x
    if radius is None and len(path) < 2:
        return [point.Drag(())]  # a click with the box marks nothing
    combine = "add" if io.key_shift else "remove" if io.key_ctrl else editing.combine
    return [edit.SelectRegion(Region(path, scaled), combine)]
