"""Walls, floor and ceiling: outline, openings, triangles and finish. World: metres, y up.

The outline is a rectangle, or an L: the rectangle less a notch at one corner. Walls run so that the
room lies to their left seen from above (x right, z up).
"""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

WALL, FLOOR, CEILING = 1, 2, 3
_REVEAL = 0.16


@dataclass(frozen=True)
class Wall:
    """A wall's foot: start point, unit direction, unit inward normal (x, z), length in m."""

    start: Float[np.ndarray, " 2"]
    direction: Float[np.ndarray, " 2"]
    inward: Float[np.ndarray, " 2"]
    length: float

    @property
    def yaw(self) -> float:
        """Turn about y that brings an item's front (+z) to the inward normal."""
        return math.atan2(self.inward[0], self.inward[1])


@dataclass(frozen=True)
class Opening:
    """A hole in a wall: its wall, centre along it, size and foot in m; windows let light in."""

    wall: int
    centre: float
    width: float
    foot: float
    height: float
    window: bool


@dataclass(frozen=True)
class Shell:
    """The empty room.

    Attributes:
        size: extent in x and z, m.
        height: m.
        notch: (x0, z0, x1, z1) that is cut away, or None.
        walls: in order around the room.
        openings: doors and windows.
    """

    size: tuple[float, float]
    height: float
    notch: tuple[float, float, float, float] | None
    walls: tuple[Wall, ...]
    openings: tuple[Opening, ...] = ()

    def holds(self, low: np.ndarray, high: np.ndarray, margin: float = 0.0) -> bool:
        """Whether a box lies inside."""
        if (
            low[0] < margin
            or low[2] < margin
            or high[0] > self.size[0] - margin
            or high[2] > self.size[1] - margin
        ):
            return False
        if low[1] < -1e-6 or high[1] > self.height + 1e-6:
            return False
        if self.notch is None:
            return True
        x0, z0, x1, z1 = self.notch
        beside = low[0] >= x1 + margin or high[0] <= x0 - margin
        return bool(beside or low[2] >= z1 + margin or high[2] <= z0 - margin)


@dataclass(frozen=True)
class Style:
    """Finish and light of a room. Colours are sRGB in [0, 1]; lights are linear.

    `wall_finish`, `floor_finish`: kind, width, length or skirting, turn; see `mesh.frag`.
    """

    wall_colour: tuple[float, ...]
    wall_accent: tuple[float, ...]
    wall_finish: tuple[float, ...]
    floor_colour: tuple[float, ...]
    floor_accent: tuple[float, ...]
    floor_finish: tuple[float, ...]
    ceiling_colour: tuple[float, ...]
    sun_direction: tuple[float, ...]
    sun_colour: tuple[float, ...]
    sky_colour: tuple[float, ...]
    lamp_colour: tuple[float, ...]
    ambient: tuple[float, ...]


def make_shell(rng: np.random.Generator, kind: str) -> Shell:
    """An empty room of a kind, 2.4 to 2.9 m high."""
    small = kind in {"bathroom", "hall"}
    across_all, deep_all = rng.uniform(2.4 if small else 3.2, 4.2 if small else 6.0, 2)
    size = (float(across_all), float(deep_all))
    notch = None
    if not small and rng.random() < 0.3:
        across, deep = (float(s * rng.uniform(0.25, 0.42)) for s in size)
        x0 = 0.0 if rng.random() < 0.5 else size[0] - across
        z0 = 0.0 if rng.random() < 0.5 else size[1] - deep
        notch = (x0, z0, x0 + across, z0 + deep)
    return Shell(size, float(rng.uniform(2.4, 2.9)), notch, _walls(_outline(size, notch)))


def random_style(rng: np.random.Generator, kind: str) -> Style:
    """Sober finishes and a light that belongs to a time of day."""
    day = float(rng.random())
    warm = np.array([1.0, 0.82, 0.60]) ** float(rng.uniform(0.3, 1.3))
    sun = np.array([1.0, 0.93, 0.82]) * rng.uniform(1.0, 4.0) * (day > 0.35)
    sky = np.array([0.75, 0.87, 1.0]) * (rng.uniform(0.7, 1.4) if day > 0.15 else 0.03)
    lamp = warm * rng.uniform(1.2, 3.2) * (1.0 if day < 0.35 or rng.random() < 0.5 else 0.15)
    azimuth, height = rng.uniform(0, 2 * np.pi), rng.uniform(0.35, 1.0)
    direction = np.array(
        [math.cos(azimuth) * math.cos(height), math.sin(height), math.sin(azimuth) * math.cos(height)]
    )
    level = rng.uniform(0.16, 0.42)
    ambient = level * (0.6 * np.array([1.0, 0.97, 0.93]) + 0.4 * (sky / sky.max() if day > 0.15 else warm))
    walls, floor = _wall_finish(rng, kind), _floor_finish(rng, kind)
    ceiling = tuple(np.full(3, rng.uniform(0.86, 0.96)))
    return Style(
        *walls, *floor, ceiling, tuple(direction), tuple(sun), tuple(sky), tuple(lamp), tuple(ambient)
    )


def shell_triangles(shell: Shell) -> tuple[Float[np.ndarray, "F 3 3"], Int[np.ndarray, " F"]]:
    """Triangles of walls (with their openings and reveals), floor and ceiling, and what each is."""
    quads, kinds = [], []
    for number, wall in enumerate(shell.walls):
        holes = sorted((o for o in shell.openings if o.wall == number), key=lambda o: o.centre)
        for quad in _wall_quads(wall, shell.height, holes):
            quads.append(quad)
            kinds.append(WALL)
    for x0, z0, x1, z1 in _floor_rectangles(shell):
        for y, kind in ((0.0, FLOOR), (shell.height, CEILING)):
            quads.append(np.array([[x0, y, z0], [x1, y, z0], [x1, y, z1], [x0, y, z1]]))
            kinds.append(kind)
    corners = np.stack(quads)
    triangles = np.concatenate([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]])
    return triangles, np.array(kinds * 2)


def _outline(
    size: tuple[float, float], notch: tuple[float, float, float, float] | None
) -> list[tuple[float, float]]:
    w, d = size
    if notch is None:
        return [(0, 0), (w, 0), (w, d), (0, d)]
    x0, z0, x1, z1 = notch
    if x0 == 0 and z0 == 0:
        return [(x1, 0), (w, 0), (w, d), (0, d), (0, z1), (x1, z1)]
    if z0 == 0:
        return [(0, 0), (x0, 0), (x0, z1), (w, z1), (w, d), (0, d)]
    if x0 == 0:
        return [(0, 0), (w, 0), (w, d), (x1, d), (x1, z0), (0, z0)]
    return [(0, 0), (w, 0), (w, z0), (x0, z0), (x0, d), (0, d)]


def _walls(outline: list[tuple[float, float]]) -> tuple[Wall, ...]:
    walls = []
    for a, b in zip(outline, outline[1:] + outline[:1], strict=True):
        start, step = np.array(a, float), np.array(b, float) - np.array(a, float)
        length = float(np.linalg.norm(step))
        direction = step / length
        walls.append(Wall(start, direction, np.array([-direction[1], direction[0]]), length))
    return tuple(walls)


def _floor_rectangles(shell: Shell) -> list[tuple[float, float, float, float]]:
    w, d = shell.size
    if shell.notch is None:
        return [(0.0, 0.0, w, d)]
    x0, z0, x1, z1 = shell.notch
    beside = (x1, 0.0, w, d) if x0 == 0 else (0.0, 0.0, x0, d)
    below = (x0, z1, x1, d) if z0 == 0 else (x0, 0.0, x1, z0)
    return [beside, below]


def _wall_quads(wall: Wall, height: float, holes: list[Opening]) -> list[Float[np.ndarray, "4 3"]]:
    quads, at = [], 0.0
    for hole in holes:
        left, right = hole.centre - hole.width / 2, hole.centre + hole.width / 2
        top = min(hole.foot + hole.height, height)
        quads.append(_panel(wall, at, left, 0.0, height))
        if hole.foot > 0.01:
            quads.append(_panel(wall, left, right, 0.0, hole.foot))
        if top < height - 0.01:
            quads.append(_panel(wall, left, right, top, height))
        quads += _reveals(wall, left, right, hole.foot, top)
        at = right
    quads.append(_panel(wall, at, wall.length, 0.0, height))
    return quads


def _point(wall: Wall, along: float, y: float, out: float = 0.0) -> np.ndarray:
    p = wall.start + wall.direction * along - wall.inward * out
    return np.array([p[0], y, p[1]])


def _panel(wall: Wall, left: float, right: float, foot: float, top: float) -> Float[np.ndarray, "4 3"]:
    return np.stack([_point(wall, a, y) for a, y in ((left, foot), (right, foot), (right, top), (left, top))])


def _reveals(
    wall: Wall, left: float, right: float, foot: float, top: float
) -> list[Float[np.ndarray, "4 3"]]:
    edges = [
        ((left, foot), (right, foot)),
        ((right, foot), (right, top)),
        ((right, top), (left, top)),
        ((left, top), (left, foot)),
    ]
    return [
        np.stack([_point(wall, *a), _point(wall, *b), _point(wall, *b, _REVEAL), _point(wall, *a, _REVEAL)])
        for a, b in edges
    ]


def _wall_finish(
    rng: np.random.Generator, kind: str
) -> tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]:
    hue, vivid = rng.random(), rng.beta(1.2, 6.0) * 0.6
    wheel = 0.5 + 0.5 * np.cos(2 * np.pi * (hue + np.array([0.0, 1 / 3, 2 / 3])))
    value = rng.uniform(0.6, 0.95) if rng.random() < 0.85 else rng.uniform(0.3, 0.6)
    colour = value * (1 - vivid + vivid * wheel)
    accent = np.clip(colour * rng.uniform(0.75, 1.1) + rng.normal(0, 0.02, 3), 0.05, 0.98)
    odds = [0.15, 0.0, 0.0, 0.85] if kind == "bathroom" else [0.76, 0.14, 0.06, 0.04]
    finish = int(rng.choice(4, p=odds))
    width = float(rng.uniform(0.1, 0.22)) if finish == 3 else float(rng.uniform(0.08, 0.35))
    skirting = 0.0 if finish == 3 else float(rng.choice([0.0, 0.07, 0.1]))
    return tuple(colour), tuple(accent), (float(finish), width, skirting, 0.0)


def _floor_finish(
    rng: np.random.Generator, kind: str
) -> tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]:
    odds = {"bathroom": [0.08, 0.92, 0.0], "kitchen": [0.45, 0.55, 0.0]}.get(kind, [0.62, 0.14, 0.24])
    finish = int(rng.choice(3, p=odds))
    if finish == 0:
        base = np.array([0.62, 0.46, 0.31]) * rng.uniform(0.5, 1.35) + rng.normal(0, 0.02, 3)
        accent = base * rng.uniform(0.72, 1.2)
        sizes = (rng.uniform(0.08, 0.22), rng.uniform(0.7, 2.0))
    else:
        base = rng.uniform(0.3, 0.88) * (1 + 0.12 * rng.normal(0, 1, 3) * (0.5 if finish == 1 else 1.0))
        accent = base * (rng.uniform(0.35, 0.8) if rng.random() < 0.3 else rng.uniform(0.95, 1.05))
        sizes = (rng.uniform(0.15, 0.6), 1.0)
    colour, second = (tuple(np.clip(c, 0.03, 0.95)) for c in (base, accent))
    return colour, second, (float(finish), float(sizes[0]), float(sizes[1]), float(rng.integers(2)))
