"""In the picture: the gizmo that moves, turns or scales the selection (ImGuizmo)."""

import numpy as np
from imgui_bundle import ImVec2, imgui, imguizmo

from langflash_core.geometry import poses
from langflash_core.geometry.poses import Pose

from ... import commands as do
from ...kit.look import Look
from ...state import State
from .. import placing
from ..state import Handle

gizmo = imguizmo.im_guizmo
_OPERATIONS = {
    Handle.MOVE: gizmo.OPERATION.translate,
    Handle.TURN: gizmo.OPERATION.rotate,
    Handle.SCALE: gizmo.OPERATION.scale,
}
_SIZE = 210.0  # design pixels across
_FAR = 1e3  # of the near plane; the gizmo stands nowhere in particular in depth
_TURN_SNAP, _SCALE_SNAP = 15.0, 0.1  # with Ctrl: degrees, share
_MOVE_SNAP = 0.05  # of the distance to the pivot


def draw(state: State, look: Look, place: ImVec2, size: ImVec2) -> tuple[list[do.Command], bool]:
    """The gizmo on the picture in the present window, and whether the pointer is the gizmo's."""
    editing, info = state.editing, state.scene.info
    marks = editing.marks
    if info is None or marks is None or not editing.placing:
        return [], False
    pivot = placing.pivot_of(info, marks)
    if pivot is None:
        return [], False
    before = editing.gesture if isinstance(editing.gesture, placing.Moved) else placing.Moved(marks.selected)
    standing = placing.to_matrix(before, pivot)
    shown = poses.project(standing[None, :3, 3], state.scene.pose, (size.x, size.y))
    if shown is None:
        return _rest(state), False
    _style(look, size)
    gizmo.begin_frame()
    gizmo.set_drawlist(imgui.get_window_draw_list())
    gizmo.set_orthographic(state.scene.pose.span is not None)
    gizmo.set_rect(place.x, place.y, size.x, size.y)
    context = imgui.get_current_context()
    hovered, context.hovered_id_previous_frame = (
        context.hovered_id_previous_frame,
        0,
    )  # the picture is no obstacle
    along = np.eye(4)
    along[:3, :3] = state.turn.T  # its arms run along floor and walls
    matrix = _matrix(standing @ along)
    view, projection = _matrix(view_of(state.scene.pose)), _matrix(projection_of(state.scene.pose, size))
    operation = _OPERATIONS[editing.handle]
    moved = gizmo.manipulate(view, projection, operation, gizmo.MODE.local, matrix, snap=_snap(state))
    context.hovered_id_previous_frame = hovered
    if moved and gizmo.is_using():
        values = np.array(matrix.values, float).reshape(4, 4).T
        if editing.handle is not Handle.SCALE:  # whose factors are those along its arms
            values = values @ along.T
        gesture = placing.from_matrix(values, pivot, editing.handle, before)
        return ([placing.Adjust(gesture)] if gesture != editing.gesture else []), True
    ending = isinstance(editing.gesture, placing.Moved)  # in the frame in which the hand lets go
    return _rest(state), gizmo.is_over() or gizmo.is_using() or ending


def _rest(state: State) -> list[do.Command]:
    """The gesture is made once neither the gizmo nor a field holds it."""
    held = gizmo.is_using() or imgui.is_any_item_active()
    return [] if held or not isinstance(state.editing.gesture, placing.Moved) else [placing.EndGesture()]


def let_go() -> None:
    """What the gizmo holds it holds no longer, nor does the picture below it, which would orbit."""
    imgui.internal.clear_active_id()
    gizmo.enable(False)
    gizmo.enable(True)


def view_of(pose: Pose) -> np.ndarray:
    """World to camera (4, 4) in OpenGL's axes: +y up, +z backwards."""
    return np.diag((1.0, -1.0, -1.0, 1.0)) @ poses.viewmat(pose)


def projection_of(pose: Pose, size: ImVec2) -> np.ndarray:
    """Camera in OpenGL's axes to clip space (4, 4), of a picture of `size`, its principal point where the
    pose has it, its rays as the pose's."""
    K = poses.intrinsics(pose, max(round(size.x), 1), max(round(size.y), 1))
    near, far = poses.NEAREST, _FAR * poses.NEAREST * max(pose.reach, 1.0)
    matrix = np.zeros((4, 4))
    matrix[0, 0], matrix[1, 1] = 2 * K[0, 0] / size.x, 2 * K[1, 1] / size.y
    middle = np.array([2 * K[0, 2] / size.x - 1, 1 - 2 * K[1, 2] / size.y])
    if pose.span is None:
        matrix[:2, 2], matrix[3, 2] = -middle, -1
        matrix[2, 2:] = -(far + near) / (far - near), -2 * far * near / (far - near)
    else:
        matrix[:2, 3], matrix[3, 3] = middle, 1
        matrix[2, 2:] = -2 / (far - near), -(far + near) / (far - near)
    return matrix


def _matrix(values: np.ndarray) -> "gizmo.Matrix16":
    return gizmo.Matrix16(values.T.ravel().tolist())  # column by column


def _snap(state: State) -> "gizmo.Matrix3 | None":
    if not imgui.get_io().key_ctrl:
        return None
    step = {
        Handle.MOVE: _MOVE_SNAP * state.scene.pose.distance,
        Handle.TURN: _TURN_SNAP,
        Handle.SCALE: _SCALE_SNAP,
    }[state.editing.handle]
    return gizmo.Matrix3([step] * 3)


def _style(look: Look, size: ImVec2) -> None:
    gizmo.set_gizmo_size_clip_space(min(look.px(_SIZE) / max(size.x, 1.0), 0.5))
    gizmo.allow_axis_flip(False)
    style = gizmo.get_style()
    style.translation_line_thickness = style.rotation_line_thickness = look.px(3.5)
    style.rotation_outer_line_thickness = look.px(2.5)
    style.scale_line_thickness = look.px(3.5)
    style.scale_line_circle_size = style.center_circle_size = look.px(6.5)
    style.translation_line_arrow_size = look.px(8)
