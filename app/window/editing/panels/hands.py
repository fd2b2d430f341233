"""Hands on the picture with a tool: pointing, asking, drawing a region."""

import math

from imgui_bundle import ImVec2, imgui

from ... import commands as do
from ...kit import widgets
from ...kit.look import Look
from ...state import State
from .. import commands as edit
from .. import mending
from .. import pointing as point
from ..state import Point, Region, Tool

CLICK = 4.0  # design pixels that a click may slip
CLOSE = 10.0  # around a polygon's first corner, in which a click closes it


def hover(state: State, corner: ImVec2) -> list[do.Command]:
    """Tell where the pointer is, when that has changed."""
    at = widgets.pointer(corner) if imgui.is_item_hovered() and not imgui.is_item_active() else None
    before = state.editing.hover.at if state.editing.hover is not None else None
    return [] if at == before else [point.Hover(at)]


def ask(look: Look, corner: ImVec2) -> list[point.Ask]:
    """A click without a drag asks what is there."""
    if not (imgui.is_item_deactivated() and imgui.is_mouse_released(0)):
        return []
    slipped = imgui.get_mouse_drag_delta(0, look.px(CLICK))
    return [] if slipped.x or slipped.y else [point.Ask(widgets.pointer(corner))]


def pick(state: State, look: Look, corner: ImVec2) -> list[do.Command]:
    """A click without a drag selects the thing that is there."""
    combine = widgets.combined(state.editing.combine)
    return [edit.SelectThing(each.at, combine) for each in ask(look, corner)]


def region(state: State, look: Look, corner: ImVec2) -> list[do.Command]:
    """What is being drawn with a selecting tool, and at its end the request to select what it shows."""
    editing, io = state.editing, imgui.get_io()
    held = imgui.is_item_active() and imgui.is_mouse_down(0)
    let_go = imgui.is_item_deactivated() and imgui.is_mouse_released(0)
    if not (held or let_go):
        lasting = editing.tool is Tool.LASSO  # a polygon waits for its next corner
        return [point.Drag(())] if editing.drag and not lasting else []
    way, here = imgui.get_mouse_drag_delta(0, 0.0), widgets.pointer(corner)
    pixels = io.display_framebuffer_scale
    start = (here[0] - way.x * pixels.x, here[1] - way.y * pixels.y)
    path = _path(editing.tool, editing.drag, start, here)
    if held:
        return [] if path == editing.drag else [point.Drag(path)]
    combine = widgets.combined(state.editing.combine)
    clicked = math.hypot(way.x, way.y) < look.px(CLICK)
    unit = look.scale * pixels.x
    match editing.tool:
        case Tool.PICK:
            return [edit.SelectThing(here, combine)]
        case Tool.SPHERE if not clicked:
            return [edit.SelectSphere(start, math.dist(start, here), combine)]
        case Tool.BRUSH:
            return [edit.SelectRegion(Region(path, editing.radius * unit), combine)]
        case Tool.CLONE:
            return [mending.CloneStroke(Region(path, editing.radius * unit))]
        case Tool.BOX if len(path) > 1:
            return [edit.SelectRegion(Region(path), combine)]
        case Tool.LASSO if not clicked or _closed(path, CLOSE * unit):
            return [edit.SelectRegion(Region(path, around=True), combine)] if len(path) > 2 else []
        case Tool.LASSO:
            return [point.Drag(path)]  # a corner; a click on the first one, or a double click, ends it
    return [point.Drag(())]


def _path(tool: Tool, before: tuple[Point, ...], start: Point, here: Point) -> tuple[Point, ...]:
    """What is drawn so far, with the pointer at `here`, pressed at `start`."""
    if tool in (Tool.BRUSH, Tool.CLONE, Tool.LASSO):
        path = before or (start,)
        return path if path[-1] == here else (*path, here)
    return (start,) if tool is Tool.PICK or start == here else (start, here)


def _closed(path: tuple[Point, ...], near: float) -> bool:
    """Whether the corners of a polygon are all there: the last is at the first, or was clicked twice."""
    twice = imgui.get_io().mouse_clicked_last_count[0] > 1
    return twice or (len(path) > 3 and math.dist(path[0], path[-1]) < near)
