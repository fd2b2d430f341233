"""Hands on the picture that move the camera: orbit, pan, zoom, fly."""

import math

from imgui_bundle import ImVec2, imgui

from langflash_core.geometry import poses
from langflash_core.geometry.poses import Pose

from ...kit.look import Look
from ...state import State
from ..near import looked, orbited

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


def pointed(state: State, look: Look, size: ImVec2) -> Pose:
    """The pose after this frame's dragging and wheel; with a selecting tool Alt orbits."""
    io, pose, selecting = imgui.get_io(), state.scene.pose, state.editing.draws
    dx, dy = io.mouse_delta.x, io.mouse_delta.y
    held = imgui.is_item_active() or imgui.is_item_deactivated()
    # On a slow machine the way to the place and the press share a frame: that way is no drag.
    if held and not imgui.is_item_activated() and (dx or dy):
        turn = TURN / look.scale
        if _held(1) and pose.span is None:
            pose = looked(state, pose, -dx * turn, -dy * turn)
        elif selecting and not io.key_alt and not _held(2):
            pass  # the left button draws a region
        elif _held(2) or io.key_shift:
            unit = poses.units_per_pixel(pose, round(size.x), round(size.y))
            pose = poses.pan(pose, -dx * unit, -dy * unit)
        else:
            pose = orbited(state, pose, -dx * turn, -dy * turn)
    if imgui.is_item_hovered() and (io.mouse_wheel or io.mouse_wheel_h):
        pose = _scrolled(pose, state, look, size)
    return pose


def _scrolled(pose: Pose, state: State, look: Look, size: ImVec2) -> Pose:
    """The wheel zooms; two fingers on a touch pad turn, zoom with Ctrl (which a pinch sends), slide
    with Shift."""
    io = imgui.get_io()
    if not state.preferences.touch_pad or io.key_ctrl:
        return poses.zoom(pose, ZOOM**io.mouse_wheel)
    across, along = SCROLL * io.mouse_wheel_h, SCROLL * io.mouse_wheel
    if io.key_shift:
        unit = poses.units_per_pixel(pose, round(size.x), round(size.y)) * look.scale
        return poses.pan(pose, -across * unit, -along * unit)
    return orbited(state, pose, across * TURN, along * TURN)


def _held(button: int) -> bool:
    """Down, or let go in this very frame: a quick drag on a slow machine is over within one."""
    return imgui.is_mouse_down(button) or imgui.is_mouse_released(button)


def flown(pose: Pose, speed: float) -> Pose:
    """The pose after this frame's WASD, Q down and E up."""
    io = imgui.get_io()
    if io.want_text_input or io.key_ctrl or imgui.is_popup_open("", imgui.PopupFlags_.any_popup):
        return pose
    step = speed * SPEED * pose.distance * min(io.delta_time, LONGEST_STEP) * (FAST if io.key_shift else 1.0)
    held = [axis for key, axis in _FLY_KEYS if imgui.is_key_down(key)]
    right, down, forward = (step * sum(axis[i] for axis in held) for i in range(3))
    return poses.fly(pose, right, down, forward) if held else pose
