"""Rotations in numpy, one at a time and without torch: what poses and gizmos are made of.

R (3, 3) turns column vectors, q = (w, x, y, z) is a unit quaternion. `quaternions.py` has the same for
batches of tensors. The formulas are pyrr's, whose quaternions are xyzw and whose axis rotations turn row
vectors.
"""

import numpy as np
import pyrr
from jaxtyping import Float, Num

from langflash_core.base.records import World

Quaternion = tuple[float, float, float, float]  # wxyz


def about(axis: Num[np.ndarray, "3"], angle: float) -> Float[np.ndarray, "3 3"]:
    """By `angle` radians about an axis (3,) of any length but 0."""
    return pyrr.matrix33.create_from_axis_rotation(axis / np.linalg.norm(axis), angle).T


def matrix(quat: Quaternion) -> Float[np.ndarray, "3 3"]:
    """Of a unit quaternion."""
    return pyrr.matrix33.create_from_quaternion(_xyzw(quat))


def turn_of(world: World) -> Float[np.ndarray, "3 3"]:
    """Rows east, down and north of a world, in the scene's axes."""
    return matrix(world.turn)


def quaternion(R: Float[np.ndarray, "3 3"]) -> Quaternion:
    """Unit, w >= 0, of a rotation that may carry the rounding of float32."""
    return _unit(pyrr.quaternion.create_from_matrix(R))


def slerp(start: Quaternion, end: Quaternion, t: float) -> Quaternion:
    """Along the shorter arc, from `start` (0) to `end` (1). Source: Shoemake, SIGGRAPH 1985.

    The sign is settled here, because pyrr's short cut for small angles forgets it.
    """
    a, b = _xyzw(start), _xyzw(end)
    return _unit(pyrr.quaternion.slerp(a, b if a @ b >= 0 else -b, t))


def _xyzw(quat: Quaternion) -> np.ndarray:
    w, x, y, z = quat
    return np.array([x, y, z, w])


def _unit(quat_xyzw: np.ndarray) -> Quaternion:
    sign = -1.0 if quat_xyzw[3] < 0 else 1.0
    x, y, z, w = (sign * quat_xyzw / np.linalg.norm(quat_xyzw)).tolist()
    return w, x, y, z
