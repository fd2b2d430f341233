"""Shapes and looks that many makers use: pads, balls, lofts, rings, hulls, panels (see `makers.common`).

Metres, y up, front +z.
"""

from collections.abc import Callable, Sequence

import numpy as np

from langflash_core.lab.rooms.builtin import KIND_ART, KIND_FABRIC, KIND_MIRROR
from langflash_core.lab.rooms.makers.common import (
    DARK,
    QUARTER,
    SIDES,
    Design,
    Draw,
    Face,
    Look,
    plain,
    polar,
    spread,
)
from langflash_core.lab.rooms.objfile import Material
from langflash_core.lab.rooms.solids import (
    Triangles,
    Vector,
    cylinder,
    grid_triangles,
    lathe,
    rounded,
    shifted,
    turned,
)

TURN = 2 * np.pi
BRASS = plain((0.78, 0.6, 0.25), 0.8)
RUBBER = plain((0.07, 0.07, 0.075), 0.1)
GLASS = plain((0.82, 0.88, 0.88), 0.9, opacity=0.3)
WATER = plain((0.55, 0.68, 0.75), 0.6)
BARK = plain((0.36, 0.27, 0.18))
MIRROR = Material((0.8, 0.8, 0.8), gloss=0.5), KIND_MIRROR
PICTURE = Material((0.8, 0.8, 0.8), gloss=0.3), KIND_ART
PAGES, BULB, LEAF = plain((0.93, 0.91, 0.84)), plain((1.0, 0.95, 0.8), 0.3), plain((0.2, 0.42, 0.16))


def pad(d: Design, size: Vector, centre: Vector, look: Look, radius: float = 0.05, steps: int = 3) -> None:
    """A box with flat sides and round edges: a cushion or a hull."""
    half = np.array(size) / 2
    r = min(radius, 0.98 * float(half.min()))
    turn = np.concatenate([np.linspace(q, q + 1, steps) for q in range(4)]) * QUARTER
    rise = np.concatenate([np.linspace(-1, 0, steps), np.linspace(0, 1, steps)])[:, None] * QUARTER
    east, north = np.array([1, -1, -1, 1]).repeat(steps), np.array([1, 1, -1, -1]).repeat(steps)
    x = east * (half[0] - r) + r * np.cos(rise) * np.cos(turn)
    y = np.array([-1, 1]).repeat(steps)[:, None] * (half[1] - r) + r * np.sin(rise)
    z = north * (half[2] - r) + r * np.cos(rise) * np.sin(turn)
    rings = np.stack([x, y + 0 * x, z], -1)
    rings = np.concatenate([rings, rings[:, :1]], 1)
    pole = np.array([0.0, 1.0, 0.0])
    d.add(grid_triangles(np.concatenate([rings[:1] * pole, rings, rings[-1:] * pole])) + centre, look)


def ball(d: Design, size: Vector, centre: Vector, look: Look, cells: int = 6) -> None:
    """An ellipsoid."""
    d.add(rounded(size, centre, 2.0, cells), look)


def loft(
    path: Sequence[Vector], radii: Sequence[float], segments: int = 10, squash: float = 1.0
) -> Triangles:
    """A smooth limb with round ends along a path; `squash` widens it where the path is narrowest."""
    points, reach = np.array(path, dtype=float), np.array(radii, dtype=float)
    ends = np.array([points[0] - points[1], points[-1] - points[-2]])
    ends *= 0.6 * reach[[0, -1], None] / np.linalg.norm(ends, axis=1, keepdims=True)
    points = np.concatenate([points[:1] + ends[:1], points, points[-1:] + ends[1:]])
    reach = np.concatenate([[0.0], reach, [0.0]])
    along = np.gradient(points, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    aside = np.eye(3)[np.ptp(points, axis=0).argmin()]
    side = aside - (along @ aside)[:, None] * along
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    turn = np.linspace(0, TURN, segments + 1)[None, :, None]
    ring = squash * np.cos(turn) * side[:, None] + np.sin(turn) * np.cross(along, side)[:, None]
    return grid_triangles(points[:, None] + reach[:, None, None] * ring)


def slab(half: Sequence[tuple[float, float]], size: Vector, foot: Vector = (0, 0, 0)) -> Triangles:
    """A flat thing that faces front, alike left and right: (half width, height) as fractions of its size."""
    rows = np.array([(0, half[0][1]), *half, (0, half[-1][1])], dtype=float)
    loop = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1)]) / 2
    x, z = rows[:, :1] * size[0] * loop[:, 0], size[2] * loop[:, 1] + 0 * rows[:, :1]
    return grid_triangles(np.stack([x, rows[:, 1:] * size[1] + 0 * x, z], -1)) + np.array(foot)


def torus(radius: float, thick: float, centre: Vector, axis: int = 1, segments: int = 18) -> Triangles:
    """A tyre or a hoop about the axis x, y or z."""
    profile = (
        (radius - thick, 0),
        (radius, -thick),
        (radius + thick, 0),
        (radius, thick),
        (radius - thick, 0),
    )
    flat = lathe(profile, segments=segments)
    return shifted(flat if axis == 1 else turned(flat, 2 - axis, QUARTER), centre)


def across(radius: float, length: float, centre: Vector, axis: int, segments: int = 12) -> Triangles:
    """A cylinder along x or z about its centre."""
    upright = cylinder(radius, length, (0, -length / 2, 0), segments=segments)
    return shifted(turned(upright, 2 - axis, QUARTER), centre)


def open_box(d: Design, size: Vector, foot: Vector, look: Look, wall: float = 0.02) -> None:
    """A box that is open above."""
    (w, h, z), (x, y, f) = size, foot
    d.box((w, wall, z), (x, y + wall / 2, f), look)
    for s in SIDES:
        d.box((wall, h, z), (x + s * (w - wall) / 2, y + h / 2, f), look)
        d.box((w - 2 * wall, h, wall), (x, y + h / 2, f + s * (z - wall) / 2), look)


def hull(rows: Sequence[Vector], roundness: float = 0.4, segments: int = 24) -> Triangles:
    """Outlines of (width, depth, height) from foot to top, joined; roundness 1 is an ellipse, 0 a box."""
    turn = np.linspace(0, TURN, segments + 1)
    east, north = (np.sign(v) * np.abs(v) ** roundness / 2 for v in (np.cos(turn), np.sin(turn)))
    return grid_triangles(np.array([np.stack([w * east, 0 * turn + y, z * north], -1) for w, z, y in rows]))


def facing(
    outline: Sequence[tuple[float, float]], centre: tuple[float, float], many: int
) -> list[tuple[float, float]]:
    """Of a floor outline (x, z), the corner that lies in each of so many directions."""
    off = np.array(outline) - np.array(centre)
    off /= np.linalg.norm(off, axis=1, keepdims=True)
    turn = np.linspace(0, TURN, many + 1)
    return [outline[k] for k in (off @ np.stack([np.cos(turn), np.sin(turn)])).argmax(0)]


def corner_floor(side: float, hand: int, inset: float) -> list[tuple[float, float]]:
    """The floor outline (x, z) of what stands in a corner: a square of that side with the front corner round,
    which begins `inset`, of the side, behind the middle; closed."""
    half = side / 2
    arc = [polar((0.5 + inset) * side, a, 0) for a in spread(0, QUARTER, 7)]
    front = [(hand * (u - inset * side), v - inset * side) for u, _, v in arc]
    back = [(-hand * half, -half), (hand * half, -half)]
    return [*back, *front, (-hand * half, half), back[0]]


def brim(
    outline: Sequence[tuple[float, float]], centre: tuple[float, float], y: float, radius: float, many: int
) -> Triangles:
    """The flat edge between a floor outline (x, z) and a round hollow in it."""
    x, z = centre
    outer = [(u, y, v) for u, v in facing(outline, centre, many)]
    inner = [(x + u, y, z + v) for u, _, v in (polar(radius, a, 0) for a in spread(0, TURN, many + 1))]
    return grid_triangles(np.array([outer, inner]))


def mixed(look: Look, other: Vector, share: float) -> Look:
    """A look's colour, mixed with so much of another."""
    red, green, blue = (
        float((1 - share) * c + share * p) for c, p in zip(look[0].colour, other, strict=True)
    )
    return plain((red, green, blue), look[0].gloss)


def merge(d: Design, part: Design, move: Callable[[Triangles], Triangles]) -> None:
    """All of a part, moved."""
    for triangles, look in part.parts:
        d.add(move(triangles), look)


def dappled(d: Design, triangles: Triangles, marked: np.ndarray, look: Look, marks: Look) -> None:
    """One surface in two looks."""
    for chosen, each in ((~marked, look), (marked, marks)):
        if chosen.any():
            d.add(triangles[chosen], each)


def panels(
    d: Design, draw: Draw, face: Face, rows: int, columns: int, look: Look, doors: bool = False
) -> None:
    """Drawers or doors over a face, all with the same knobs, bars, slots or nothing."""
    metal, grip = draw.metal(), draw.style(5)
    w, h, z = face.width / columns, face.height / rows, face.z
    for row in range(rows):
        for column in range(columns):
            x, y = face.left + (column + 0.5) * w, face.foot + (row + 0.5) * h
            d.box((w - 0.012, h - 0.012, 0.02), (x, y, z + 0.01), look)
            side = (w / 2 - 0.045) * (1 if column % 2 == 0 and columns > 1 else -1) * doors
            if grip == 0:
                for dx in (-w / 4, w / 4) if w > 0.6 and not doors else (0.0,):
                    ball(d, (0.035, 0.035, 0.035), (x + side + dx, y, z + 0.035), metal, 4)
            elif grip < 3:
                long = (0.015, min(0.5, h * 0.4), 0.02) if doors else (w * 0.15 * grip, 0.015, 0.02)
                d.box(long, (x + side, y, z + 0.035), metal)
            elif grip == 3 and not doors:
                d.box((w * 0.3, 0.025, 0.004), (x, y + h / 2 - 0.03, z + 0.02), DARK)


def vivid(draw: Draw) -> Look:
    """A strong colour, a little glossy."""
    return plain(draw.colour(0.9, 0.5), draw.between(0.1, 0.6))


def woven(draw: Draw) -> Look:
    """Wicker or cord."""
    return Material(
        draw.one_of(((0.62, 0.47, 0.3), (0.4, 0.28, 0.18), (0.8, 0.76, 0.68), (0.2, 0.18, 0.17)))
    ), KIND_FABRIC


def leaflet(
    length: float, width: float, curl: float = 0.3, cuts: float = 0.0, points: int = 6, broad: float = 0.8
) -> Triangles:
    """A leaf from the origin along +z that bends down, its rims raised, with notches if `cuts` > 0."""
    t = np.linspace(0, 1, points)
    half = (
        width
        / 2
        * np.sin(np.pi * np.clip(t, 0, 1) ** broad)
        * np.where(np.arange(points) % 2 == 0, 1.0, 1 - cuts)
    )
    middle = np.stack([0 * t, -curl * length * t**2, length * (t - 0.25 * curl * t**2)], -1)
    rim = np.array([1.0, 0.35, 0.0]) * half[:, None]
    rows = np.stack([middle + rim * np.array([-1, 1, 1]), middle, middle + rim], 1)
    return grid_triangles(rows)


def put(leaf: Triangles, pitch: float, yaw: float, place: Vector) -> Triangles:
    """A leaf raised by `pitch`, turned by `yaw`, and put at its place."""
    return shifted(turned(turned(leaf, 0, -pitch), 1, yaw), place)


def between_all(draw: Draw, *ends: float) -> list[float]:
    """Any numbers, one between each two ends."""
    return [draw.between(low, high) for low, high in zip(ends[::2], ends[1::2], strict=True)]


def twins(d: Design, size: Vector, centre: Vector, look: Look) -> None:
    """A box, and its mirror image on the left."""
    for sx in SIDES:
        d.box(size, (sx * centre[0], centre[1], centre[2]), look)


def displaced(d: Design, offset: Vector) -> Design:
    """The same design, all of it moved."""
    d.parts = [(shifted(triangles, offset), look) for triangles, look in d.parts]
    return d


def pillow_at(width: float, height: float, depth: float) -> np.ndarray:
    """Two sheets sewn together at their edges and stuffed, lying."""
    x, z = np.meshgrid(np.linspace(-1, 1, 9), np.linspace(-1, 1, 9))
    puff = height / 2 * ((1 - np.abs(x) ** 2.6) * (1 - np.abs(z) ** 2.6)) ** 0.55
    wide, deep = width / 2 * (1 - 0.07 * (1 - z**2) * x**2), depth / 2 * (1 - 0.07 * (1 - x**2) * z**2)
    halves = [np.stack([x * wide, height / 2 + s * puff, z * deep], -1) for s in SIDES]
    return np.concatenate([grid_triangles(half) for half in halves])


def boxes(d: Design, look: Look, *rows: tuple[float, float, float, float, float, float]) -> None:
    """Boxes of one look: size and centre."""
    for w, h, t, x, y, z in rows:
        d.box((w, h, t), (x, y, z), look)
