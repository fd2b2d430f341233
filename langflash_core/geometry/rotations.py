"""Rotations in numpy, one at a time and without torch: what poses and gizmos are made of.

R (3, 3) turns column vectors, q = (w, x, y, z) is a unit quaternion. `quaternions.py` has the same for
batches of tensors.
"""

import numpy as np
from jaxtyping import Float

Quaternion = tuple[float, float, float, float]  # wxyz

_NEARLY_ONE = 0.95  # cosine between quaternions from which an arc is as good as its chord


def about(axis: np.ndarray, angle: float) -> Float[np.ndarray, "3 3"]:
    """By `angle` radians about an axis (3,) of any length but 0. Source: Rodrigues' formula."""
    x, y, z = axis / np.sqrt(np.sum(axis**2))
    s, c = np.sin(angle), np.cos(angle)
    t = 1 - c
    return np.array(
        [
            [x * x * t + c, x * y * t - z * s, x * z * t + y * s],
            [y * x * t + z * s, y * y * t + c, y * z * t - x * s],
            [z * x * t - y * s, z * y * t + x * s, z * z * t + c],
        ]
    )


def matrix(quat: Quaternion) -> Float[np.ndarray, "3 3"]:
    """Of a unit quaternion."""
    w, x, y, z = quat
    ww, xx, yy, zz = w**2, x**2, y**2, z**2
    share = 1 / (xx + yy + zz + ww)
    return np.array(
        [
            [(xx - yy - zz + ww) * share, 2 * (x * y - z * w) * share, 2 * (x * z + y * w) * share],
            [2 * (x * y + z * w) * share, (-xx + yy - zz + ww) * share, 2 * (y * z - x * w) * share],
            [2 * (x * z - y * w) * share, 2 * (y * z + x * w) * share, (-xx - yy + zz + ww) * share],
        ]
    )


def quaternion(R: Float[np.ndarray, "3 3"]) -> Quaternion:
    """Unit, w >= 0, of a rotation that may carry the rounding of float32.

    The largest of the four is found first, so nothing small is divided by. Source: Shepperd, 1978.
    """
    trace = R[0, 0] + R[1, 1] + R[2, 2]
    if trace > 0:
        s = 0.5 / np.sqrt(trace + 1.0)
        return _unit(0.25 / s, (R[2, 1] - R[1, 2]) * s, (R[0, 2] - R[2, 0]) * s, (R[1, 0] - R[0, 1]) * s)
    i = int(np.argmax(np.diagonal(R)))
    j, k = (i + 1) % 3, (i + 2) % 3
    s = 2.0 * np.sqrt(1.0 + R[i, i] - R[j, j] - R[k, k])
    xyz = [0.0, 0.0, 0.0]
    xyz[i], xyz[j], xyz[k] = 0.25 * s, (R[i, j] + R[j, i]) / s, (R[i, k] + R[k, i]) / s
    return _unit((R[k, j] - R[j, k]) / s, *xyz)


def slerp(start: Quaternion, end: Quaternion, t: float) -> Quaternion:
    """Along the shorter arc, from `start` (0) to `end` (1). Source: Shoemake, SIGGRAPH 1985."""
    a, b = np.array(start), np.array(end)
    cosine = a @ b
    if cosine < 0:
        cosine, b = -cosine, -b
    if cosine >= _NEARLY_ONE:
        return _unit(*(a * (1 - t) + b * t))
    angle = np.arccos(cosine)
    return _unit(*((a * np.sin(angle * (1 - t)) + b * np.sin(angle * t)) / np.sin(angle)))


def _unit(w: float, x: float, y: float, z: float) -> Quaternion:
    quat = np.array([w, x, y, z])
    w, x, y, z = ((-1.0 if w < 0 else 1.0) * quat / np.linalg.norm(quat)).tolist()
    return w, x, y, z
