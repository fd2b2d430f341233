"""Hands on the picture that move the camera: look around, orbit, pan, zoom, fly.

A drag of the left button looks around where a photo was taken, the picture following the hand; elsewhere, or
with Alt, it orbits around what was under the hand when it began.
"""

import math
from dataclasses import replace

import numpy as np
from imgui_bundle import ImVec2, imgui

from langflash_core.geometry import poses
from langflash_core.geometry.poses import Pose

from ...commands import Command
from ...editing import things
from ...editing.state import Tool
from ...kit import widgets
from ...kit.look import Look
from ...state import State
from .. import camera, near
from ..near import UNHURRIED, flown, looked, orbited
from ..state import Hold

TURN = math.radians(0.3)  # per pixel at scale 1, where there are no photos
ZOOM = 0.9  # of the distance, per notch of the wheel
SPEED = 0.9  # of the distance to the pivot, per second
NEARBY = 2.0  # of the distance to the nearest surface: no farther counts for the speed
FAST = 3.0  # with shift
SCROLL = 30.0  # design pixels that a step of a touch pad's scrolling counts for
LONGEST_STEP = 0.25  # seconds of flight a slow frame may count for
_FLY_KEYS = (
    (imgui.Key.w, (0, 0, 1)), (imgui.Key.s, (0, 0, -1)), (imgui.Key.a, (-1, 0, 0)),
    (imgui.Key.d, (1, 0, 0)), (imgui.Key.q, (0, 1, 0)), (imgui.Key.e, (0, -1, 0)),
)  # fmt: skip


def draw(state: State, look: Look, corner: ImVec2, size: ImVec2) -> list[Command]:
    """What dragging, wheel and keys of this frame do on the picture, the present item; with a selecting tool
    Alt orbits."""
    io, issued = imgui.get_io(), list[Command]()
    if imgui.is_item_activated():
        issued.append(camera.TakeHold(widgets.pointer(corner), orbits=io.key_alt))
    start = state.scene.pose
    state = state.with_scene(pose=poses.of_picture(start, size.x, size.y))  # it is judged as one sees it
    pose, refused = _dragged(state, look, size)
    if imgui.is_item_hovered() and (io.mouse_wheel or io.mouse_wheel_h):
        if io.key_ctrl and state.editing.tool is Tool.PICK and state.editing.reached is not None:
            issued.append(things.StepLevel(round(math.copysign(1, io.mouse_wheel))))
        else:
            pose = _scrolled(pose, state, look, size)
    pose = poses.with_lens(walked(state, pose), start)
    if refused:
        issued.append(camera.Pull(pose, refused / look.scale))
    elif pose != start:
        issued.append(camera.MoveTo(pose))
    if state.scene.hold is not None and not imgui.is_item_active() and not imgui.is_item_activated():
        issued.append(camera.LetGo())
    return issued


def _dragged(state: State, look: Look, size: ImVec2) -> tuple[Pose, float]:
    """The pose after this frame's dragging, and the pixels of it that went in vain."""
    io, pose = imgui.get_io(), state.scene.pose
    dx, dy = io.mouse_delta.x, io.mouse_delta.y
    held = imgui.is_item_active() or imgui.is_item_deactivated()
    # On a slow machine the way to the place and the press share a frame: that way is no drag.
    if not held or imgui.is_item_activated() or not (dx or dy):
        return pose, 0.0
    hold, turn = state.scene.hold or Hold(), _turn(state, look, size)
    least = 1.0 if hold.insists else 0.0
    if _held(1) and pose.span is None:
        pose, done = looked(state, pose, -dx * turn, -dy * turn, least)
    elif state.editing.draws and not io.key_alt and not _held(2):
        return pose, 0.0  # the left button draws a region
    elif _held(2) or io.key_shift:
        unit = poses.units_per_pixel(_at_pivot(pose, hold), round(size.x), round(size.y))
        pose, done = flown(state, pose, -dx * unit, -dy * unit, 0.0, least)
    elif hold.looks:
        pose, done = looked(state, pose, dx * turn, dy * turn, least)
    else:
        pose, done = orbited(state, pose, -dx * turn, -dy * turn, hold.pivot, least)
    return pose, (1 - done) * math.hypot(dx, dy)


def _at_pivot(pose: Pose, hold: Hold) -> Pose:
    """The pose with what is held as deep as it looks: it slides along with the hand."""
    if hold.pivot is None or pose.span is not None:
        return pose
    depth = float(pose.axes[:, 2] @ np.subtract(hold.pivot, pose.centre))
    return replace(pose, reach=depth) if depth > poses.NEAREST else pose


def _turn(state: State, look: Look, size: ImVec2) -> float:
    """Radians a pixel: the picture's middle follows the hand, around a pivot what is far behind it; faster
    around what no photos were taken of, where every side is worth as much."""
    pose, info = state.scene.pose, state.scene.info
    if pose.span is not None or info is None or not info.views:
        return TURN / look.scale
    return 1 / float(poses.intrinsics(pose, max(round(size.x), 1), max(round(size.y), 1))[0, 0])


def _scrolled(pose: Pose, state: State, look: Look, size: ImVec2) -> Pose:
    """The wheel zooms; two fingers on a touch pad turn, zoom with Ctrl (which a pinch sends), slide
    with Shift."""
    io = imgui.get_io()
    if not state.preferences.touch_pad or io.key_ctrl:
        return near.zoomed(state, pose, ZOOM**io.mouse_wheel)
    across, along = SCROLL * io.mouse_wheel_h, SCROLL * io.mouse_wheel
    if io.key_shift:
        unit = poses.units_per_pixel(pose, round(size.x), round(size.y)) * look.scale
        return flown(state, pose, -across * unit, -along * unit, 0.0, UNHURRIED)[0]
    turn = _turn(state, look, size) * look.scale
    if near.at_photo(state):
        return looked(state, pose, -across * turn, -along * turn, UNHURRIED)[0]
    return orbited(state, pose, across * turn, along * turn, least=UNHURRIED)[0]


def _held(button: int) -> bool:
    """Down, or let go in this very frame: a quick drag on a slow machine is over within one."""
    return imgui.is_mouse_down(button) or imgui.is_mouse_released(button)


def walked(state: State, pose: Pose) -> Pose:
    """The pose after this frame's WASD, Q down and E up."""
    io = imgui.get_io()
    if io.want_text_input or io.key_ctrl or imgui.is_popup_open("", imgui.PopupFlags_.any_popup):
        return pose
    held = [axis for key, axis in _FLY_KEYS if imgui.is_key_down(key)]
    if not held:
        return pose
    step = speed(state, pose) * min(io.delta_time, LONGEST_STEP) * (FAST if io.key_shift else 1.0)
    right, down, forward = (step * sum(axis[i] for axis in held) for i in range(3))
    return flown(state, pose, right, down, forward, UNHURRIED)[0]


def speed(state: State, pose: Pose) -> float:
    """Scene units a second of a walk: slower where something is near."""
    around, far = near.surroundings(state), pose.distance
    if around is not None:
        nearest, _ = around.nearest(np.array(pose.centre))
        far = min(far, max(NEARBY * nearest, around.clear))
    return state.preferences.speed * SPEED * far
