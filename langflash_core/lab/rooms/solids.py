"""Triangles of simple solids, from which the furniture made here is put together. Metres, y up.

Solids and sheets are (F, 3, 3): triangles, corners, xyz. Boxes and tubes face out; what is bent from a
sheet of points (`rounded`, `lathe`, `cylinder`) faces in. Rooms are drawn from both sides alike.
"""

import itertools
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

Triangles = Float[np.ndarray, "_F 3 3"]  # the underscore: every piece of a thing has its own F
Vector = tuple[float, float, float]

SIDES = (-1, 1)
TURN = 2 * np.pi
QUARTER = np.pi / 2


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


def spread(low: float, high: float, many: int) -> list[float]:
    """Evenly spaced numbers, both ends included."""
    return np.linspace(low, high, many).tolist()


def polar(reach: float, angle: float, y: float) -> Vector:
    """A point at a distance from the y axis."""
    return float(reach * np.cos(angle)), y, float(reach * np.sin(angle))


def laid(triangles: Triangles, place: Vector) -> Triangles:
    """What stands at the origin, laid on its back: its top faces the front, its foot is at `place`."""
    return shifted(turned(triangles, 0, QUARTER), place)


def padded(size: Vector, radius: float = 0.05, steps: int = 3) -> Triangles:
    """A box about the origin with flat sides and round edges: a cushion or a hull."""
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
    return grid_triangles(np.concatenate([rings[:1] * pole, rings, rings[-1:] * pole]))


def prism(outline: Sequence[tuple[float, float]], thick: float) -> Triangles:
    """An outline (x, y), visible as a whole from its mean point, made thick along z."""
    ring = np.array([*outline, outline[0]])
    middle = ring * 0 + np.mean(outline, axis=0)
    sheets = ((middle, -0.5), (ring, -0.5), (ring, 0.5), (middle, 0.5))
    return grid_triangles(np.stack([np.insert(xy, 2, s * thick, 1) for xy, s in sheets]))


def round_cornered(width: float, height: float, corner: float) -> list[tuple[float, float]]:
    """A rectangle with round corners."""
    turn = np.arange(16) // 4 * QUARTER + np.arange(16) % 4 * QUARTER / 3
    signs = np.repeat([[1, 1], [-1, 1], [-1, -1], [1, -1]], 4, 0)
    shift = signs * [width / 2 - corner, height / 2 - corner]
    corners = shift + corner * np.stack([np.cos(turn), np.sin(turn)], 1)
    return [(x, y) for x, y in corners.tolist()]


def ribbed(profile: Sequence[tuple[float, float]], ribs: int, depth: float, at: Vector) -> Triangles:
    """A profile turned about the y axis, with ribs."""
    turn = np.linspace(0, TURN, 4 * ribs + 1)
    wave = 1 - depth * (0.5 - 0.5 * np.cos(turn * ribs))
    r, y = np.array(profile).T
    ring = np.stack([np.cos(turn) * wave, 0 * turn, np.sin(turn) * wave], -1)
    return grid_triangles(
        r[:, None, None] * ring[None] + y[:, None, None] * np.array([0.0, 1.0, 0.0]) + np.array(at)
    )


def limb(points: Sequence[Vector], radii: Sequence[float], segments: int = 7) -> Triangles:
    """A round rod along a path, of one radius at each point."""
    path = np.array(points, dtype=float)
    along = np.gradient(path, axis=0)
    side = np.cross(along, (0.8, 0.1, 0.6))
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    other = np.cross(along, side)
    other /= np.linalg.norm(other, axis=1, keepdims=True)
    turn = np.linspace(0, 2 * np.pi, segments + 1)[:, None]
    ring = np.cos(turn) * side[:, None] + np.sin(turn) * other[:, None]
    return grid_triangles(path[:, None] + np.array(radii)[:, None, None] * ring)


def tapered(size: Vector, centre: Vector, x: float, z: float, back: float = 0.0) -> Triangles:
    """A box whose top is narrower by the factors x and z and shifted back."""
    part = box(size, (0, 0, 0))
    return shifted(np.where(part[..., 1:2] > 0, part * np.array([x, 1, z]) - [0, 0, back], part), centre)


def outlined_slab(outline: Sequence[tuple[float, float]], foot: float, thick: float) -> Triangles:
    """A board of any outline (x, z) that its middle sees."""
    low = np.array([(x, foot, z) for x, z in (*outline, outline[0])])
    under, high = np.broadcast_to(low[:-1].mean(0), low.shape), np.array([0, thick, 0])
    return grid_triangles(np.stack([under, low, low + high, under + high]))


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


def brim(
    outline: Sequence[tuple[float, float]], centre: tuple[float, float], y: float, radius: float, many: int
) -> Triangles:
    """The flat edge between a floor outline (x, z) and a round hollow in it."""
    x, z = centre
    outer = [(u, y, v) for u, v in facing(outline, centre, many)]
    inner = [(x + u, y, z + v) for u, _, v in (polar(radius, a, 0) for a in spread(0, TURN, many + 1))]
    return grid_triangles(np.array([outer, inner]))


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


def pillow_at(width: float, height: float, depth: float) -> np.ndarray:
    """Two sheets sewn together at their edges and stuffed, lying."""
    x, z = np.meshgrid(np.linspace(-1, 1, 9), np.linspace(-1, 1, 9))
    puff = height / 2 * ((1 - np.abs(x) ** 2.6) * (1 - np.abs(z) ** 2.6)) ** 0.55
    wide, deep = width / 2 * (1 - 0.07 * (1 - z**2) * x**2), depth / 2 * (1 - 0.07 * (1 - x**2) * z**2)
    halves = [np.stack([x * wide, height / 2 + s * puff, z * deep], -1) for s in SIDES]
    return np.concatenate([grid_triangles(half) for half in halves])


def blade(foot: Vector, angle: float, reach: float, high: float, width: float) -> Triangles:
    """A leaf that rises from `foot` and bends outwards."""
    t = np.linspace(0, 1, 7)
    out, up = reach * t**1.5, high * np.sin(t * np.pi * 0.6) / np.sin(np.pi * 0.6)
    half = width * np.sin(np.pi * np.clip(t + 0.12, 0, 1)) ** 0.7
    direction = np.array([np.cos(angle), 0, np.sin(angle)])
    side = np.array([-np.sin(angle), 0, np.cos(angle)])
    middle = np.array(foot) + out[:, None] * direction + up[:, None] * np.array([0.0, 1.0, 0.0])
    left, right = middle - half[:, None] * side, middle + half[:, None] * side
    rising = np.stack([left[:-1], right[:-1], right[1:]], 1)
    return np.concatenate([rising, np.stack([left[:-1], right[1:], left[1:]], 1)])


def drape(width: float, height: float, folds: int, deep: float, side: int, tie: float) -> np.ndarray:
    """A sheet in folds, hung from `height`; a share `tie` of its width is drawn to one side."""
    along, up = np.meshgrid(np.linspace(-0.5, 0.5, 6 * folds + 1), np.linspace(0, 1, 9 if tie else 3))
    near = np.exp(-(((up - 0.38) / 0.2) ** 2))
    x = (along - side / 2) * (1 - tie * np.where(up < 0.38, 0.7 + 0.3 * near, near)) + side / 2
    z = deep * np.sin(TURN * folds * along) * (1.1 - 0.4 * up)
    return grid_triangles(np.stack([x * width, up * height, z], -1))


def draped(path: Sequence[tuple[float, float]], width: float, thick: float) -> Triangles:
    """A thick sheet that follows a path of (z, y), `width` wide along x."""
    points = np.array(path, dtype=float)
    along = np.gradient(points, axis=0)
    normal = np.stack([-along[:, 1], along[:, 0]], 1) / np.linalg.norm(along, axis=1, keepdims=True)
    over, under = points + normal * thick / 2, points - normal * thick / 2
    rim = np.concatenate([over, under[::-1], over[:1]])
    sides = [np.column_stack([np.full(len(rim), sx * width / 2), rim[:, ::-1]]) for sx in SIDES]
    caps = [grid_triangles(np.stack([s[: len(points)], s[len(points) : -1][::-1]])) for s in sides]
    return np.concatenate([grid_triangles(np.stack(sides)), *caps])


def folded(width: float, depth: float, foot: float, layers: int, pitch: float) -> Triangles:
    """A cloth folded to and fro, its last fold in front."""
    path: list[tuple[float, float]] = []
    for k in range(layers):
        side, y = (layers - k) % 2 * -2 + 1, foot + (k + 0.5) * pitch
        path += [(-side * depth / 2, y), (side * depth / 2, y), (side * (depth + pitch) / 2, y + pitch / 2)]
    return draped(path[:-1], width, pitch * 0.9)


def oblong(profile: Sequence[tuple[float, float]], squash: float = 1.0, power: float = 2.0) -> Triangles:
    """A lathed profile whose rings become superellipses, z scaled by `squash`."""
    solid = lathe(profile, segments=24)
    flat = np.abs(solid[..., ::2])
    bend = np.hypot(flat[..., 0], flat[..., 1]) / np.maximum((flat**power).sum(-1) ** (1 / power), 1e-9)
    return solid * np.stack([bend, np.ones_like(bend), bend * squash], -1)


def outline(shape: int, width: float, height: float, inset: float, z: float) -> Float[np.ndarray, "N 3"]:
    """Rectangle, rounded rectangle, ellipse or arch on y = 0, anticlockwise, moved in by `inset`."""
    w, h, t = width / 2 - inset, height - 2 * inset, np.linspace(0, 2 * np.pi, 41)
    bend = np.linalg.norm([np.cos(t), np.sin(t)], (40, 8, 2, 2)[shape], axis=0) ** -1.0
    x, y = w * bend * np.cos(t), h / 2 * (1 + bend * np.sin(t))
    if shape == 3:
        y = np.where(np.abs(t - 4.7) < 1.5, 0, h - w + w * np.sin(t))
    return np.column_stack([x, y + inset, np.full(len(t), z)])
