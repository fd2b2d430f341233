"""Triangles of simple solids, from which the furniture made here is put together. Metres, y up.

Every function returns (F, 3, 3): triangles, corners, xyz. Boxes and tubes face out; what is bent from a
sheet of points (`rounded`, `lathe`, `cylinder`) faces in. Rooms are drawn from both sides alike.
"""

import itertools
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

Triangles = Float[np.ndarray, "_F 3 3"]  # the underscore: every piece of a thing has its own F
Vector = tuple[float, float, float]


def box(size: Vector, centre: Vector) -> Triangles:
    """An axis-aligned box, facing out."""
    half = np.array(size) / 2
    sides = []
    for axis in range(3):
        for sign in (-1.0, 1.0):
            u, v = (axis + 1) % 3, (axis + 2) % 3
            quad = np.zeros((4, 3))
            quad[:, axis] = sign
            quad[:, u], quad[:, v] = np.array([-1, 1, 1, -1]) * sign, [-1, -1, 1, 1]
            sides += [quad[[0, 1, 2]], quad[[0, 2, 3]]]
    return np.array(sides) * half + np.array(centre)


def grid_triangles(grid: Float[np.ndarray, "R C 3"]) -> Triangles:
    """A sheet of points as triangles, which face along (column direction) x (row direction)."""
    a, b, c, d = grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]
    return np.concatenate(
        [np.stack([a, b, c], 2).reshape(-1, 3, 3), np.stack([a, c, d], 2).reshape(-1, 3, 3)]
    )


def rounded(size: Vector, centre: Vector, squareness: float = 5.0, cells: int = 12) -> Triangles:
    """A box with soft edges: a superellipsoid |x|^p + |y|^p + |z|^p = 1; p 2 is an ellipsoid."""
    turn = np.linspace(0, 2 * np.pi, 2 * cells + 1)
    rise = np.linspace(-np.pi / 2, np.pi / 2, cells + 1)
    around, up = np.meshgrid(turn, rise)
    unit = np.stack([np.cos(up) * np.cos(around), np.sin(up), np.cos(up) * np.sin(around)], -1)
    unit /= np.maximum((np.abs(unit) ** squareness).sum(-1, keepdims=True) ** (1 / squareness), 1e-9)
    return grid_triangles(unit * np.array(size) / 2 + np.array(centre))


def lathe(
    profile: Sequence[tuple[float, float]],
    centre: Vector = (0, 0, 0),
    segments: int = 20,
    squash: float = 1.0,
) -> Triangles:
    """A profile of (radius, height) turned about the y axis; `squash` scales z."""
    turn = np.linspace(0, 2 * np.pi, segments + 1)
    radii, heights = np.array(profile).T
    ring = np.stack([np.cos(turn), np.zeros_like(turn), squash * np.sin(turn)], -1)
    grid = radii[:, None, None] * ring[None] + heights[:, None, None] * np.array([0.0, 1.0, 0.0])
    return grid_triangles(grid + np.array(centre))


def cylinder(
    radius: float, height: float, foot: Vector, top: float | None = None, segments: int = 16
) -> Triangles:
    """An upright cylinder or cone frustum with both caps; `top` is the upper radius."""
    upper = radius if top is None else top
    return lathe(((0, 0), (radius, 0), (upper, height), (0, height)), foot, segments)


def tube(points: Sequence[Vector], radius: float, segments: int = 8) -> Triangles:
    """A round rod along a path, with open ends; corners are sharp."""
    pieces = []
    turn = np.linspace(0, 2 * np.pi, segments + 1)
    for start, end in itertools.pairwise(np.array(points, dtype=float)):
        along = end - start
        length = np.linalg.norm(along)
        if length < 1e-9:
            continue
        along = along / length
        side = np.cross(along, [0.0, 0.0, 1.0] if abs(along[2]) < 0.9 else [1.0, 0.0, 0.0])
        side /= np.linalg.norm(side)
        other = np.cross(along, side)
        ring = radius * (np.cos(turn)[:, None] * side + np.sin(turn)[:, None] * other)
        pieces.append(
            grid_triangles(np.stack([start - radius * 0.5 * along + ring, end + radius * 0.5 * along + ring]))
        )
    return np.concatenate(pieces)


def turned(triangles: Triangles, axis: int, angle: float, about: Vector = (0, 0, 0)) -> Triangles:
    """Rotated by `angle` (radians, right-handed) about an axis (0 x, 1 y, 2 z) through a point."""
    u, v = (axis + 1) % 3, (axis + 2) % 3
    rotation = np.eye(3)
    rotation[u, u] = rotation[v, v] = np.cos(angle)
    rotation[u, v], rotation[v, u] = -np.sin(angle), np.sin(angle)
    return (triangles - np.array(about)) @ rotation.T + np.array(about)


def shifted(triangles: Triangles, offset: Vector) -> Triangles:
    """Moved by an offset."""
    return triangles + np.array(offset)


def scaled(profile: Sequence[tuple[float, float]], radius: float, height: float) -> list[tuple[float, float]]:
    """A profile for `lathe` from fractions of a radius and a height."""
    return [(r * radius, y * height) for r, y in profile]
