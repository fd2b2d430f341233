"""Boxes on the screen, left, top, right, bottom: captions that keep clear of what stands over the picture."""

from collections.abc import Iterable

from imgui_bundle import ImVec2, imgui

from .look import Look

Box = tuple[float, float, float, float]

_NARROW, _PANEL = 640.0, 300.0  # design pixels: of pictures, of panels
_MARGIN = 12.0  # design pixels between a window and the picture's border
_PASSING = imgui.WindowFlags_.child_window | imgui.WindowFlags_.tooltip | imgui.WindowFlags_.popup


def overlap(one: Box, other: Box) -> bool:
    """Whether they share more than an edge."""
    return one[0] < other[2] and other[0] < one[2] and one[1] < other[3] and other[1] < one[3]


def within(one: Box, other: Box) -> bool:
    """Whether the first lies in the second."""
    return one[0] >= other[0] and one[1] >= other[1] and one[2] <= other[2] and one[3] <= other[3]


def clear(box: Box, walls: Iterable[Box], furthest: float) -> Box:
    """The box pushed out of each wall it is in, along the shortest way; walls further away stay covered."""
    for wall in walls:
        if overlap(box, wall):
            aside = min(wall[2] - box[0], wall[0] - box[2], key=abs)
            along = min(wall[3] - box[1], wall[1] - box[3], key=abs)
            x, y = (aside, 0.0) if abs(aside) <= abs(along) else (0.0, along)
            if abs(x + y) <= furthest:
                box = (box[0] + x, box[1] + y, box[2] + x, box[3] + y)
    return box


def lowered(box: Box, walls: Iterable[Box], gap: float) -> float:
    """The top of the box once it has gone down, `gap` below each wall that it would cover."""
    left, top, right, bottom = box
    for wall in sorted(walls, key=lambda wall: wall[1]):
        if overlap((left, top, right, top + bottom - box[1]), wall):
            top = wall[3] + gap
    return top


def window_box(name: str) -> Box | None:
    """Where a window of ImGui stood in the last frame; None: it did not."""
    window = imgui.internal.find_window_by_name(name)
    if window is None or not window.was_active:
        return None
    return (window.pos.x, window.pos.y, window.pos.x + window.size.x, window.pos.y + window.size.y)


def bars() -> list[Box]:
    """Where the bars of the tools stood in the last frame."""
    names = [window.name for window in imgui.get_current_context().windows if window.name.startswith("##bar")]
    return [box for name in names if (box := window_box(name)) is not None]


def over_panel(place: ImVec2, size: ImVec2, look: Look) -> tuple[ImVec2, ImVec2] | None:
    """Corner and size of a window about a picture of `size` at `place`: over the panel at its left where the
    picture is narrow, so that what one flies to is seen; over all of the panel, for halves of its lines would
    look out around the window. None: it opens over the picture."""
    if size.x >= look.px(_NARROW) or place.x < look.px(_PANEL):
        return None
    return ImVec2(0, 0), ImVec2(place.x, place.y + size.y)


def opens_at(
    place: ImVec2,
    size: ImVec2,
    room: float,
    look: Look,
    below: float,
    wanted: tuple[float, float],
    least: float,
) -> tuple[ImVec2, ImVec2]:
    """Corner and size of a window about a picture where it opens: over the panel, or at the picture's right,
    `below` its top.

    Args:
        room: height of the picture that it may cover, pixels. wanted: width and height at the most.
        least: height at the least, design pixels.
    """
    aside = over_panel(place, size, look)
    if aside is not None:
        return aside
    top, margin = place.y + look.px(below), look.px(_MARGIN)
    width = min(look.px(wanted[0]), size.x - 2 * margin)
    height = min(look.px(wanted[1]), max(place.y + room - top - margin, look.px(least)))
    return ImVec2(place.x + size.x - margin - width, top), ImVec2(width, height)


def windows_over(picture: Box) -> tuple[Box, ...]:
    """ImGui's windows that stood over the picture in the last frame, but for what comes and goes; not the one
    that is being drawn."""
    own, found = imgui.internal.get_current_window_read().id_, []
    for window in imgui.get_current_context().windows:
        if window.was_active and window.id_ != own and not window.flags & _PASSING:
            box = (window.pos.x, window.pos.y, window.pos.x + window.size.x, window.pos.y + window.size.y)
            if overlap(box, picture):
                found.append(box)
    return tuple(found)
