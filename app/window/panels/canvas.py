"""The picture and the hands on it: orbit, pan, zoom, fly. Also the keys that work everywhere."""

import math
from dataclasses import replace

from imgui_bundle import ImVec2, imgui
from imgui_bundle import icons_fontawesome_6 as fa

from app.window import commands as do
from app.window import desk_commands as desk
from app.window import edit_commands as edit
from app.window import poses, theme
from app.window.editing import PICK_RADIUS, Point, Region, Tool
from app.window.panels import in_space, widgets
from app.window.panels.look import Look
from app.window.panels.modes import KEYED
from app.window.poses import Pose
from app.window.state import State

TURN = math.radians(0.3)  # per pixel at scale 1
ZOOM = 0.9  # of the distance, per notch of the wheel
SPEED = 0.9  # of the distance to the pivot, per second
FAST = 3.0  # with shift
SCROLL = 30.0  # design pixels that a step of a touch pad's scrolling counts for
LONGEST_STEP = 0.25  # seconds of flight a slow frame may count for

_FLY_KEYS = (
    (imgui.Key.w, (0, 0, 1)), (imgui.Key.s, (0, 0, -1)), (imgui.Key.a, (-1, 0, 0)),
    (imgui.Key.d, (1, 0, 0)), (imgui.Key.q, (0, 1, 0)), (imgui.Key.e, (0, -1, 0)),
)  # fmt: skip
_DIGITS = (
    imgui.Key._1, imgui.Key._2, imgui.Key._3, imgui.Key._4, imgui.Key._5,
    imgui.Key._6, imgui.Key._7, imgui.Key._8, imgui.Key._9, imgui.Key._0,
)  # fmt: skip
_MODE_KEYS = tuple(zip(_DIGITS, KEYED, strict=True))

# Taken from the event itself: on a slow machine S and the release of Ctrl share a frame.
EDIT_SHORTCUTS: dict[tuple[str, bool], do.Command] = {  # with Ctrl; the second tells whether with Shift
    ("z", False): edit.Undo(), ("z", True): edit.Redo(), ("y", False): edit.Redo(),
    ("a", False): edit.SelectAll(), ("d", False): edit.Deselect(), ("i", False): edit.Invert(),
}  # fmt: skip
_TOOL_KEYS = (
    (imgui.Key.v, Tool.MOVE), (imgui.Key.x, Tool.POINT), (imgui.Key.r, Tool.BOX),
    (imgui.Key.b, Tool.BRUSH), (imgui.Key.c, Tool.PICK),
)  # fmt: skip
_DOING_KEYS: tuple[tuple[imgui.Key, do.Command], ...] = (
    (imgui.Key.delete, edit.Delete()), (imgui.Key.backspace, edit.Delete()), (imgui.Key.g, edit.Grow()),
    (imgui.Key.f, edit.FrameSelection()),
)  # fmt: skip
BRUSH_STEP = 1.15  # of its radius, per press of [ or ]
CLICK = 4.0  # design pixels that a click may slip

SHORTCUTS = {
    "s": do.ShowDialog("save"), "o": do.ShowDialog("open"), "q": do.Leave(),
    "e": desk.ShowExport(), "p": do.ShowDialog("settings"),
}  # fmt: skip


def draw(state: State, look: Look) -> list[do.Command]:
    """The picture filling the present window, and what the pointer does on it."""
    size = imgui.get_content_region_avail()
    corner = imgui.get_cursor_screen_pos()
    end = ImVec2(corner.x + size.x, corner.y + size.y)
    if look.picture is not None:
        imgui.get_window_draw_list().add_image(imgui.ImTextureRef(look.picture.glo), corner, end)
    else:
        _welcome(state, corner, size)
    over = in_space.draw(state, look, corner, size)
    if any(isinstance(command, do.JumpTo) for command in over):
        return over  # the click was on a camera
    buttons = imgui.ButtonFlags_
    imgui.set_next_item_allow_overlap()
    flags = buttons.mouse_button_left | buttons.mouse_button_right | buttons.mouse_button_middle
    imgui.invisible_button("picture", ImVec2(max(size.x, 1), max(size.y, 1)), flags)
    if state.info is None:
        return []
    issued = over + _hover(state, corner)
    if state.editing.tool.selects and not imgui.get_io().key_alt:
        issued += _region(state, look, corner)
    elif state.editing.tool is Tool.POINT:
        issued += _ask(look, corner)
    pose = _pointed(state, look, size)
    pose = _flown(pose, state.desk.preferences.speed)
    return issued + ([do.MoveTo(pose)] if pose != state.pose else [])


def keys(state: State) -> list[do.Command]:
    """Keys that work wherever the pointer is; those with Ctrl are in `SHORTCUTS`."""
    io = imgui.get_io()
    issued: list[do.Command] = []
    if imgui.is_key_pressed(imgui.Key.f1, False):
        issued.append(do.ShowDialog("help"))
    if imgui.is_key_pressed(imgui.Key.f2, False):
        issued.append(do.ShowDialog("log"))
    if imgui.is_key_pressed(imgui.Key.escape, False) and not io.want_text_input:
        issued += _escape(state)
    if io.want_text_input or io.key_ctrl or state.dialog or state.info is None:
        return issued
    if imgui.is_key_pressed(imgui.Key.h, False) or imgui.is_key_pressed(imgui.Key.home, False):
        issued.append(do.Home())
    if imgui.is_key_pressed(imgui.Key.z, False):
        issued.append(desk.FrameAll())
    if imgui.is_key_pressed(imgui.Key.p, False) and state.view is not None:
        issued.append(desk.Compare(None if in_space.comparing(state) else 0.5))
    if imgui.is_key_pressed(imgui.Key.k, False):
        wanted = state.desk.preferences
        issued.append(desk.Prefer(replace(wanted, photos_in_space=not wanted.photos_in_space)))
    issued += [do.SetMode(mode) for key, mode in _MODE_KEYS if imgui.is_key_pressed(key, False)]
    issued += [edit.SetTool(tool) for key, tool in _TOOL_KEYS if imgui.is_key_pressed(key, False)]
    issued += [command for key, command in _DOING_KEYS if imgui.is_key_pressed(key, False)]
    if imgui.is_key_pressed(imgui.Key.left_bracket):
        issued.append(edit.SetRadius(state.editing.radius / BRUSH_STEP))
    if imgui.is_key_pressed(imgui.Key.right_bracket):
        issued.append(edit.SetRadius(state.editing.radius * BRUSH_STEP))
    return issued


def _escape(state: State) -> list[do.Command]:
    """One step back: a menu, a dialog, an answer, a preview, a tool. Never out: one press too many would
    end the program."""
    editing = state.editing
    if state.dialog:
        return [do.ShowDialog(None)]
    if imgui.is_popup_open("", imgui.PopupFlags_.any_popup):
        imgui.internal.close_popups_except_modals()
        return []
    if editing.card is not None or editing.asked is not None:
        return [edit.CloseCard()]
    if editing.floaters is not None:
        return [edit.EndFloaters()]
    return [] if editing.tool is Tool.MOVE else [edit.SetTool(Tool.MOVE)]


def _pointer(corner: ImVec2) -> Point:
    """Where the pointer is in the picture's place, framebuffer pixels."""
    pointer, pixels = imgui.get_mouse_pos(), imgui.get_io().display_framebuffer_scale
    return (pointer.x - corner.x) * pixels.x, (pointer.y - corner.y) * pixels.y


def _hover(state: State, corner: ImVec2) -> list[do.Command]:
    """Tell where the pointer is, when that has changed."""
    at = _pointer(corner) if imgui.is_item_hovered() and not imgui.is_item_active() else None
    before = state.editing.hover.at if state.editing.hover is not None else None
    return [] if at == before else [edit.Hover(at)]


def _ask(look: Look, corner: ImVec2) -> list[do.Command]:
    """A click without a drag asks what is there."""
    if not (imgui.is_item_deactivated() and imgui.is_mouse_released(0)):
        return []
    slipped = imgui.get_mouse_drag_delta(0, look.px(CLICK))
    return [] if slipped.x or slipped.y else [edit.Ask(_pointer(corner))]


def _region(state: State, look: Look, corner: ImVec2) -> list[do.Command]:
    """The box or stroke being drawn, and at its end the request to select what it shows."""
    editing, io = state.editing, imgui.get_io()
    held = imgui.is_item_active() and imgui.is_mouse_down(0)
    let_go = imgui.is_item_deactivated() and imgui.is_mouse_released(0)
    if not (held or let_go):
        return [edit.Drag(())] if editing.drag else []
    way, here = imgui.get_mouse_drag_delta(0, 0.0), _pointer(corner)
    pixels = io.display_framebuffer_scale
    start = (here[0] - way.x * pixels.x, here[1] - way.y * pixels.y)
    path = editing.drag or (start,)
    if editing.tool is Tool.BRUSH:
        path = path if path[-1] == here else (*path, here)
    else:
        path = (start,) if editing.tool is Tool.PICK or start == here else (start, here)
    if held:
        return [] if path == editing.drag else [edit.Drag(path)]
    radius = {Tool.BOX: None, Tool.PICK: PICK_RADIUS, Tool.BRUSH: editing.radius}[editing.tool]
    scaled = None if radius is None else radius * look.scale * pixels.x
    if radius is None and len(path) < 2:
        return [edit.Drag(())]  # a click with the box marks nothing
    combine = "add" if io.key_shift else "remove" if io.key_ctrl else editing.combine
    return [edit.SelectRegion(Region(path, scaled), combine)]


def _pointed(state: State, look: Look, size: ImVec2) -> Pose:
    """The pose after this frame's dragging and wheel; with a selecting tool Alt orbits."""
    io, pose, selecting = imgui.get_io(), state.pose, state.editing.tool.selects
    dx, dy = io.mouse_delta.x, io.mouse_delta.y
    held = imgui.is_item_active() or imgui.is_item_deactivated()
    # On a slow machine the way to the place and the press share a frame: that way is no drag.
    if held and not imgui.is_item_activated() and (dx or dy):
        turn = TURN / look.scale
        if _held(1):
            pose = poses.look(pose, -dx * turn, -dy * turn)
        elif selecting and not io.key_alt and not _held(2):
            pass  # the left button draws a region
        elif _held(2) or io.key_shift:
            unit = poses.units_per_pixel(pose, round(size.x), round(size.y))
            pose = poses.pan(pose, -dx * unit, -dy * unit)
        else:
            pose = poses.orbit(pose, -dx * turn, -dy * turn)
    if imgui.is_item_hovered() and (io.mouse_wheel or io.mouse_wheel_h):
        pose = _scrolled(pose, state.desk.preferences.touch_pad, look, size)
    return pose


def _scrolled(pose: Pose, touch_pad: bool, look: Look, size: ImVec2) -> Pose:
    """The wheel zooms; two fingers on a touch pad turn, zoom with Ctrl (which a pinch sends), slide
    with Shift."""
    io = imgui.get_io()
    if not touch_pad or io.key_ctrl:
        return poses.zoom(pose, ZOOM**io.mouse_wheel)
    across, along = SCROLL * io.mouse_wheel_h, SCROLL * io.mouse_wheel
    if io.key_shift:
        unit = poses.units_per_pixel(pose, round(size.x), round(size.y)) * look.scale
        return poses.pan(pose, -across * unit, -along * unit)
    return poses.orbit(pose, across * TURN, along * TURN)


def _held(button: int) -> bool:
    """Down, or let go in this very frame: a quick drag on a slow machine is over within one."""
    return imgui.is_mouse_down(button) or imgui.is_mouse_released(button)


def _flown(pose: Pose, speed: float) -> Pose:
    """The pose after this frame's WASD, Q down and E up."""
    io = imgui.get_io()
    if io.want_text_input or io.key_ctrl or imgui.is_popup_open("", imgui.PopupFlags_.any_popup):
        return pose
    step = speed * SPEED * pose.reach * min(io.delta_time, LONGEST_STEP) * (FAST if io.key_shift else 1.0)
    held = [axis for key, axis in _FLY_KEYS if imgui.is_key_down(key)]
    right, down, forward = (step * sum(axis[i] for axis in held) for i in range(3))
    return poses.fly(pose, right, down, forward) if held else pose


def _welcome(state: State, corner: ImVec2, size: ImVec2) -> None:
    """What to do first, in the middle of the empty canvas."""
    text = f"{state.job.title}: {state.job.stage}" if state.job else "Drop photos of a room here"
    lines = ((fa.ICON_FA_CUBES, theme.LINE, 3.0), (text, theme.MUTED, 1.25))
    top = corner.y + size.y / 2
    canvas = imgui.get_window_draw_list()
    for line, colour, factor in lines:
        imgui.push_font(None, theme.FONT_SIZE * factor)
        extent = imgui.calc_text_size(line)
        canvas.add_text(ImVec2(corner.x + (size.x - extent.x) / 2, top - extent.y), widgets.u32(colour), line)
        top += extent.y * 1.4
        imgui.pop_font()
