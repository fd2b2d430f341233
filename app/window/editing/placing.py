"""What can happen while the selection is moved, turned, scaled or recoloured.

A gesture is a change that is shown and not yet made: `Adjust` shows it as often as the hand moves, and
`EndGesture` makes one edit of it.
"""

import math
from dataclasses import dataclass

import numpy as np

from langflash_core.base import pictures
from langflash_core.geometry.rotations import quaternion
from langflash_core.scene import edits
from langflash_core.scene.changes import (
    UNTURNED,
    Change,
    Moved,
    Recoloured,
    Spot,
    Turn,
    turn_about,
    turn_matrix,
)
from langflash_core.scene.edits import Marks
from langflash_core.scene.settings import CHANGES

from ..scene.state import SceneInfo
from ..state import State
from .commands import with_edit
from .state import Handle, Tint, Tool

STEP = 0.02  # of the way to the pivot, by which a key moves
TURN_STEP = 5.0  # degrees
SCALE_STEP = 1.05
FARTHEST = 1e4  # scene units that one gesture moves
_OUTLIERS = (0.02, 0.98)
_ENOUGH = 100_000  # Gaussians, of which a selection's middle and brightness are taken within a frame


@dataclass(frozen=True)
class SetHandle:
    """Take the gizmo, to move, to turn or to scale."""

    handle: Handle

    def apply(self, state: State) -> State:
        taken = state.with_editing(tool=Tool.PLACE, drag=(), hover=None, asked=None, card=None, ruler=())
        return taken.with_editing(handle=self.handle, gesture=None, tint=None)


@dataclass(frozen=True)
class Adjust:
    """Show the selection moved so far."""

    gesture: Moved

    def apply(self, state: State) -> State:
        marks = state.editing.marks
        if marks is None or not marks.selected or self.gesture.rows != marks.selected:
            return state
        return state.with_editing(gesture=self.gesture, tint=None)


@dataclass(frozen=True)
class ShowTint:
    """Show the selection recoloured; luma: its mean brightness now. A heat-map would cover it."""

    tint: Tint
    luma: float

    def apply(self, state: State) -> State:
        marks = state.editing.marks
        if marks is None or not marks.selected:
            return state
        gesture = Recoloured.tint(marks.selected, self.tint.colour, self.tint.strength, self.luma)
        return state.with_scene(mode=pictures.RGB).with_editing(
            tint=self.tint, gesture=gesture, last_tint=self.tint
        )


@dataclass(frozen=True)
class BeginTint:
    """Offer to recolour the selection, with the last colour."""

    def apply(self, state: State) -> State:
        marks, info = state.editing.marks, state.scene.info
        if marks is None or info is None or not marks.selected:
            return state
        return ShowTint(state.editing.last_tint, luma_of(info, marks)).apply(state)


@dataclass(frozen=True)
class EndGesture:
    """Make one edit of what is shown, or take it away."""

    keep: bool = True

    def apply(self, state: State) -> State:
        gesture, marks = state.editing.gesture, state.editing.marks
        state = state.with_editing(gesture=None, tint=None)
        if not self.keep or gesture is None or marks is None:
            return state
        if isinstance(gesture, Moved) and gesture.still:
            return state
        label = f"{verb(gesture)} {len(gesture.rows):,}"
        return with_edit(state, label, edits.change(marks, gesture))


@dataclass(frozen=True)
class Nudge:
    """A step by a key: along the picture's right, down and ahead, -1 to 1 each. The gizmo says whether it
    moves, turns or scales; up and down scale."""

    right: float = 0.0
    down: float = 0.0
    ahead: float = 0.0

    def apply(self, state: State) -> State:
        marks, info = state.editing.marks, state.scene.info
        centre = None if marks is None or info is None else pivot_of(info, marks)
        if marks is None or centre is None:
            return state
        axes = state.scene.pose.axes
        match state.editing.handle:
            case Handle.MOVE:
                way = axes @ np.array([self.right, self.down, self.ahead]) * STEP * state.scene.pose.distance
                gesture = Moved(marks.selected, offset=_spot(way))
            case Handle.TURN:
                axis = (
                    self.right * np.array([0.0, -1.0, 0.0]) - self.down * axes[:, 0] + self.ahead * axes[:, 2]
                )
                gesture = Moved.about(marks.selected, centre, turn_about(_spot(axis), TURN_STEP))
            case Handle.SCALE:
                larger = self.right - self.down + self.ahead
                gesture = Moved.about(marks.selected, centre, scale=SCALE_STEP**larger)
        return EndGesture().apply(state.with_editing(gesture=gesture))


def verb(gesture: Change) -> str:
    """What it does, for the list of edits."""
    if isinstance(gesture, Recoloured):
        return "Recolour"
    if gesture.turn != UNTURNED:
        return "Turn"
    return "Scale" if gesture.scale != 1.0 else "Move"


# What is selected


def pivot_of(info: SceneInfo, marks: Marks) -> Spot | None:
    """The middle of the box around nearly all that is selected; None where nothing is."""

    def middle() -> Spot | None:
        points = info.memory.changed(marks).gaussians.means.numpy()[_some(marks)].astype(np.float64)
        points = points[np.isfinite(points).all(1)]
        return _spot(np.quantile(points, _OUTLIERS, axis=0).mean(0)) if len(points) else None

    return info.memory.answered("pivot", (marks.selected, marks.changes), middle)


def luma_of(info: SceneInfo, marks: Marks) -> float:
    """Mean brightness of what is selected."""

    def mean() -> float:
        import torch

        from langflash_core.scene.changed import mean_luma

        return mean_luma(info.memory.changed(marks).gaussians, torch.from_numpy(_some(marks)))

    return info.memory.answered("luma", (marks.selected, marks.changes), mean)


def _some(marks: Marks) -> np.ndarray:
    """Rows of what is selected, evenly, about `_ENOUGH` of more: a frame waits for what is asked of them."""
    rows = np.flatnonzero(marks.selected.rows())
    return rows[:: max(1, len(rows) // _ENOUGH)]


# A gesture as the matrix that a gizmo turns, and as the numbers of a field


def to_matrix(gesture: Moved | None, pivot: Spot) -> np.ndarray:
    """(4, 4) of a gizmo that stood upright at the pivot before the gesture."""
    matrix = np.eye(4)
    matrix[:3, 3] = pivot
    if gesture is not None:
        linear = gesture.scale * turn_matrix(gesture.turn)
        matrix[:3, :3] = linear
        matrix[:3, 3] = linear @ np.array(pivot) + gesture.offset
    return matrix


def from_matrix(matrix: np.ndarray, pivot: Spot, handle: Handle, before: Moved) -> Moved:
    """The gesture whose gizmo has become `matrix` (4, 4). Scaling is the same along all axes: by the
    factor of the axis that was pulled most."""
    factors = np.linalg.norm(matrix[:3, :3], axis=0)
    if not np.isfinite(matrix).all() or factors.min() < 1e-9:
        return before
    match handle:
        case Handle.MOVE:
            offset = matrix[:3, 3] - pivot
            return Moved(before.rows, offset=_spot(offset)) if abs(offset).max() < FARTHEST else before
        case Handle.TURN:
            return Moved.about(before.rows, pivot, quaternion(matrix[:3, :3] / factors))
        case Handle.SCALE:
            factor = float(factors[np.argmax(abs(np.log(factors)))])
            return Moved.about(
                before.rows, pivot, scale=min(max(factor, CHANGES.scales[0]), CHANGES.scales[1])
            )


def numbers_of(gesture: Change | None, pivot: Spot, handle: Handle) -> tuple[float, ...]:
    """What the fields show: how far along x, y, z; the rotation's axis times its degrees; or the factor."""
    if not isinstance(gesture, Moved):
        return (1.0,) if handle is Handle.SCALE else (0.0, 0.0, 0.0)
    match handle:
        case Handle.MOVE:
            return _spot(to_matrix(gesture, pivot)[:3, 3] - pivot)
        case Handle.TURN:
            w, *axis = gesture.turn if gesture.turn[0] >= 0 else [-part for part in gesture.turn]
            half = math.atan2(math.hypot(*axis), w)
            length = max(math.hypot(*axis), 1e-12)
            return _spot(np.array(axis) * math.degrees(2 * half) / length)
        case Handle.SCALE:
            return (gesture.scale,)


def of_numbers(numbers: tuple[float, ...], marks: Marks, pivot: Spot, handle: Handle) -> Moved:
    """The gesture that the fields say; none moves where one of them is no number."""
    rows = marks.selected
    if not all(map(math.isfinite, numbers)):
        return Moved(rows)
    match handle:
        case Handle.MOVE:
            x, y, z = (min(max(value, -FARTHEST), FARTHEST) for value in numbers)
            return Moved(rows, offset=(x, y, z))
        case Handle.TURN:
            degrees = math.hypot(*numbers)
            turn: Turn = turn_about(_spot(np.array(numbers)), degrees) if degrees else UNTURNED
            return Moved.about(rows, pivot, turn)
        case Handle.SCALE:
            return Moved.about(rows, pivot, scale=min(max(numbers[0], CHANGES.scales[0]), CHANGES.scales[1]))


def _spot(values: np.ndarray) -> Spot:
    x, y, z = np.asarray(values, float).tolist()
    return (x, y, z)
