"""Parts of flat things, which are built upright, facing the front, then leant back or laid down. Metres."""

from collections.abc import Sequence

import numpy as np

from langflash_core.lab.rooms.builtin import KIND_ART
from langflash_core.lab.rooms.makers.kit import (
    BLACK,
    DARK,
    QUARTER,
    STEEL,
    WHITE,
    Design,
    Draw,
    Look,
    Material,
    Triangles,
    Vector,
    box,
    cylinder,
    grid_triangles,
    plain,
    shifted,
    turned,
)

RED, GREEN, BLUE = (plain(c, 0.4) for c in ((0.75, 0.08, 0.08), (0.08, 0.42, 0.18), (0.1, 0.22, 0.55)))
PAPER, INK, LIT = (plain(c) for c in ((0.92, 0.92, 0.88), (0.1, 0.1, 0.14), (0.55, 0.68, 0.62)))
GLASS, YELLOW = plain((0.02, 0.02, 0.03), 0.9), plain((0.9, 0.72, 0.1), 0.4)
PICTURE = Material((0.85, 0.85, 0.85), gloss=0.2), KIND_ART


def casing(draw: Draw) -> Look:
    """What a device is made of outside."""
    return draw.one_of((BLACK, DARK, WHITE, STEEL, vivid_paint(draw)))


def vivid_paint(draw: Draw) -> Look:
    """A strong colour, a little glossy."""
    return plain(draw.colour(0.9), 0.35)


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


def rounded_slab(d: Design, look: Look, size: Vector, corner: float, at: Vector = (0, 0, 0)) -> None:
    """A slab (w, h, thick) with round corners."""
    put_flat(d, look, prism(round_cornered(size[0], size[1], corner), size[2]), at)


def rounded_ring(d: Design, look: Look, size: Vector, thick: float, at: Vector) -> None:
    """A closed loop of wire that faces the front: width, height, radius of the corners."""
    points = round_cornered(*size)
    d.tube([(x + at[0], y + at[1], at[2]) for x, y in (*points, points[0])], thick, look, 5)


def put_flat(d: Design, look: Look, triangles: Triangles, place: Vector, *turns: tuple[int, float]) -> None:
    """Adds triangles after turns (axis, angle) about their origin."""
    for axis, angle in turns:
        triangles = turned(triangles, axis, angle)
    d.add(shifted(triangles, place), look)


def rod_across(d: Design, look: Look, radius: float, length: float, at: Vector, top: float = 0.0) -> None:
    """A cylinder along x; `top` is its radius on the left."""
    put_flat(d, look, cylinder(radius, length, (0, -length / 2, 0), top or radius, 12), at, (2, QUARTER))


def leaf_at(d: Design, look: Look, size: Vector, hinge: Vector, angle: float) -> None:
    """A board upon its lower edge, leant back; at minus a quarter it lies forwards."""
    put_flat(d, look, box(size, (0, size[1] / 2, 0)), hinge, (0, -angle))


def button_rows(d: Design, look: Look, at: Vector, nx: int, ny: int, pitch: float, high: float = 0.7) -> None:
    """Buttons in nx columns and ny rows from the middle `at` on."""
    for k in range(nx * ny):
        x, y = k % nx - (nx - 1) / 2, k // nx - (ny - 1) / 2
        d.box((pitch * 0.7, pitch * high, 0.004), (at[0] + x * pitch, at[1] + y * pitch, at[2]), look)


def turned_over(d: Design, axis: int = 0, angle: float = -QUARTER, foot: float = 0.0) -> Design:
    """Turns all that there is, unless told else on its back; its lowest point goes to the height `foot`."""
    parts = [(turned(triangles, axis, angle), look) for triangles, look in d.parts]
    low = min(float(triangles[..., 1].min()) for triangles, _ in parts)
    d.parts[:] = [(shifted(triangles, (0, foot - low, 0)), look) for triangles, look in parts]
    return d
