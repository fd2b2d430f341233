"""What edits changed of Gaussians, as plain values: where they were moved to, how they were recoloured.

A scene's own numbers stay as they are. `Marks.changes` lists what has become of them, in order;
`langflash_core.scene.changed` computes it. So a step takes a mask and some numbers whatever its size, and
undoing it is exact. Imports no torch.
"""

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float

from langflash_core.scene.mask import Mask
from langflash_core.scene.settings import CHANGES

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

Spot = tuple[float, float, float]
Turn = tuple[float, float, float, float]  # unit quaternion wxyz
UNTURNED: Turn = (1.0, 0.0, 0.0, 0.0)
LUMA = (0.299, 0.587, 0.114)  # as in types.py, which imports torch


@dataclass(frozen=True)
class Moved:
    """A similarity of the world: pos' = scale R pos + offset, scene units; R of a unit quaternion wxyz."""

    rows: Mask = field(repr=False)
    turn: Turn = UNTURNED
    scale: float = 1.0
    offset: Spot = (0.0, 0.0, 0.0)

    @staticmethod
    def about(
        rows: Mask, pivot: Spot, turn: Turn = UNTURNED, scale: float = 1.0, by: Spot = (0.0, 0.0, 0.0)
    ) -> "Moved":
        """Turned and scaled around a point that then goes `by`."""
        centre = np.array(pivot)
        offset = centre - scale * turn_matrix(turn) @ centre + by
        return Moved(rows, turn, scale, _spot(offset))

    @property
    def still(self) -> bool:
        """Whether nothing moves."""
        return (self.turn, self.scale, self.offset) == (UNTURNED, 1.0, (0.0, 0.0, 0.0))

    def after(self, earlier: "Moved") -> "Moved":
        """Both as one; of the same rows."""
        offset = self.scale * turn_matrix(self.turn) @ np.array(earlier.offset) + self.offset
        turn = product(self.turn, earlier.turn)
        return Moved(self.rows, turn, self.scale * earlier.scale, _spot(offset))


@dataclass(frozen=True)
class Recoloured:
    """colour' = M colour, M (3, 3) row by row, for every direction of view."""

    rows: Mask = field(repr=False)
    matrix: tuple[float, ...]

    @staticmethod
    def tint(rows: Mask, colour: Spot, strength: float, luma: float) -> "Recoloured":
        """Mixed with a colour in the Gaussians' own light and shade.

        colour' = (1 - s) colour + s tint luma(colour) / m: at full strength what had the mean brightness
        has just the tint.

        Args:
            colour: of the tint, in [0, 1]. strength: s in [0, 1]. luma: m, the mean of what is tinted.
        """
        shaded = np.outer(colour, LUMA) / max(luma, CHANGES.darkest)
        matrix = (1 - strength) * np.eye(3) + strength * shaded
        return Recoloured(rows, tuple(matrix.ravel().tolist()))

    def after(self, earlier: "Recoloured") -> "Recoloured":
        """Both as one; of the same rows."""
        ours, first = (np.reshape(each.matrix, (3, 3)) for each in (self, earlier))
        return Recoloured(self.rows, tuple((ours @ first).ravel().tolist()))


Change = Moved | Recoloured


def with_change(changes: tuple[Change, ...], change: Change) -> tuple[Change, ...]:
    """One more; it becomes one with the last where both are of a kind and of the same rows."""
    last = changes[-1] if changes else None
    if isinstance(change, Moved) and isinstance(last, Moved) and last.rows == change.rows:
        return (*changes[:-1], change.after(last))
    if isinstance(change, Recoloured) and isinstance(last, Recoloured) and last.rows == change.rows:
        return (*changes[:-1], change.after(last))
    return (*changes, change)


def parse_change(kind: str, rows: Mask, numbers: Any) -> Change:
    """A change out of a file.

    Raises:
        ValueError: another kind, or numbers that are none.
    """
    values = [float(value) for value in numbers]
    if not all(map(math.isfinite, values)):
        raise ValueError("changes: expected finite numbers")
    match kind, values:
        case "moved", [w, x, y, z, scale, right, down, ahead]:
            length = math.hypot(w, x, y, z)
            if length < 0.5 or scale <= 0:
                raise ValueError("changes: expected a rotation and a scale above 0")
            turn = (w, x, y, z) if abs(length - 1) < 1e-9 else _turn(_rotation((w, x, y, z)))
            return Moved(rows, turn, scale, (right, down, ahead))
        case "recoloured", [_, _, _, _, _, _, _, _, _]:
            return Recoloured(rows, tuple(values))
    raise ValueError(f"changes: expected moved or recoloured with its numbers, received {kind}")


def encode_change(change: Change) -> tuple[str, list[float]]:
    """Kind and numbers, as `parse_change` takes them."""
    if isinstance(change, Moved):
        return "moved", [*change.turn, change.scale, *change.offset]
    return "recoloured", list(change.matrix)


# Rotations


def turn_about(axis: Spot, degrees: float) -> Turn:
    """The rotation about an axis, which need not be of length 1."""
    direction = np.array(axis, float)
    vector = math.radians(degrees) * direction / np.linalg.norm(direction)
    return _turn(_rotations().from_rotvec(vector))


def turn_matrix(turn: Turn) -> Float[np.ndarray, "3 3"]:
    """R (3, 3) float64 of a unit quaternion."""
    return _rotation(turn).as_matrix()


def product(left: Turn, right: Turn) -> Turn:
    """The unit quaternion of `right` followed by `left`."""
    return _turn(_rotation(left) * _rotation(right))


def _rotation(quat: Turn) -> "Rotation":
    """Of a quaternion of any length above 0."""
    return _rotations().from_quat(quat, scalar_first=True)


def _rotations() -> "type[Rotation]":
    """Imported by who turns something first: it takes a fifth of a second that no start should wait for."""
    from scipy.spatial.transform import Rotation

    return Rotation


def _turn(rotation: "Rotation") -> Turn:
    w, x, y, z = rotation.as_quat(scalar_first=True).tolist()
    return (w, x, y, z)


def _spot(values: np.ndarray) -> Spot:
    x, y, z = values.tolist()
    return (x, y, z)
