"""The slow twin of the renderer: one ray at a time against every triangle, float64."""

import numpy as np

from langflash_core.lab.rooms import Pack, Room
from langflash_core.lab.rooms.shell import shell_triangles


def room_triangles(room: Room, pack: Pack) -> tuple[np.ndarray, np.ndarray]:
    """World triangles (F, 3, 3) and the instance id of each."""
    triangles, ids = shell_triangles(room.shell)
    parts, numbers = [triangles], [ids]
    for number, instance in enumerate(room.instances, start=1):
        if instance.item < 0:
            continue
        first, count = pack.face_ranges[instance.item]
        corners = pack.positions[pack.faces[first : first + count]].astype(np.float64)
        parts.append(corners @ instance.model[:3, :3].T + instance.model[:3, 3])
        numbers.append(np.full(count, number))
    return np.concatenate(parts), np.concatenate(numbers)


def cast_ray(triangles: np.ndarray, ids: np.ndarray, eye: np.ndarray, ray: np.ndarray) -> tuple[float, int]:
    """Parameter t of the nearest hit of eye + t ray, and its id (Moller-Trumbore, two-sided)."""
    a = triangles[:, 1] - triangles[:, 0]
    b = triangles[:, 2] - triangles[:, 0]
    p = np.cross(ray, b)
    det = np.einsum("fc,fc->f", a, p)
    safe = np.where(np.abs(det) < 1e-14, 1e-14, det)
    s = eye - triangles[:, 0]
    u = np.einsum("fc,fc->f", s, p) / safe
    q = np.cross(s, a)
    v = q @ ray / safe
    t = np.einsum("fc,fc->f", b, q) / safe
    hit = (np.abs(det) > 1e-14) & (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0.04)
    if not hit.any():
        return 0.0, 0
    nearest = int(np.where(hit, t, np.inf).argmin())
    return float(t[nearest]), int(ids[nearest])
