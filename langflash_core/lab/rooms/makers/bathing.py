"""Makers of bathtubs and showers (see `makers.common`).

Metres, y up, front +z.
"""

import itertools

import numpy as np

from langflash_core.lab.rooms.makers.fittings import plain_bathtub, plain_shower
from langflash_core.lab.rooms.makers.kit import (
    BLACK,
    BRASS,
    DARK,
    GLASS,
    LINEN,
    QUARTER,
    SIDES,
    STEEL,
    TURN,
    WATER,
    WHITE,
    Design,
    Draw,
    Look,
    Vector,
    across,
    ball,
    brim,
    corner_floor,
    cylinder,
    grid_triangles,
    hull,
    lathe,
    loft,
    open_box,
    plain,
    polar,
    scaled,
    spread,
)
from langflash_core.lab.rooms.makers.water import water_tap


def bathtub(draw: Draw) -> Design:
    """Mostly plain; else oval, on claws, in a corner, with an apron or a glass screen."""
    if draw.chance(0.64):
        return plain_bathtub(draw)
    return draw.one_of((_oval_tub, _oval_tub, _claw_tub, _claw_tub, _corner_tub, _apron_tub, _apron_tub))(
        draw
    )


def _shell(
    d: Design, outside: Look, inside: Look, size: Vector, foot: float, flare: float, rise: float
) -> None:
    """An oval tub whose rim rises towards both ends: (length, height, width)."""
    length, h, wide = size
    hulls = (
        (((0, 0), (0.5 * flare, 0.02), (0.5 * (flare + 1) / 2, 0.45), (0.5, 1), (0.47, 1.01)), outside),
        (((0.47, 1.01), (0.47 * (flare + 1) / 2, 0.5), (0.46 * flare, 0.16), (0, 0.13)), inside),
    )
    for profile, look in hulls:
        hull = lathe(scaled(profile, length, h), (0, foot, 0), 26, wide / length)
        along = hull[..., 0] / (length / 2)
        hull[..., 1] += rise * np.clip((hull[..., 1] - foot) / h, 0, 1) * along**2
        d.add(hull, look)


def _oval_tub(draw: Draw) -> Design:
    d = Design("freestanding bathtub", "bathtub", ("oval bathtub", "bath"))
    size = (draw.between(1.5, 1.85), draw.between(0.52, 0.6), draw.between(0.72, 0.85))
    outside = WHITE if draw.chance(0.6) else draw.painted()
    rise = draw.between(0.0, 0.14)
    _shell(d, outside, WHITE, size, 0, draw.between(0.7, 0.95), rise)
    if draw.chance(0.4):
        d.add(
            lathe(
                ((0.44 * size[0], 0.2), (0.4 * size[0], 0.2), (0, 0.2)), (0, 0.06, 0), 24, size[2] / size[0]
            )
            * np.array([0.9, 1, 0.9]),
            WATER,
        )
    metal, x = draw.one_of((STEEL, DARK, BRASS)), draw.between(-0.3, 0.3)
    if draw.chance(0.6):
        z = -size[2] / 2 - 0.08
        d.tube(((x, 0, z), (x, 0.85, z), (x, 0.92, z + 0.06), (x, 0.88, z + 0.2)), 0.018, metal)
        d.box((0.18, 0.02, 0.02), (x, 0.75, z), metal)
        d.tube(((x + 0.09, 0.75, z), (x + 0.09, 0.5, z + 0.03)), 0.008, metal, 5)
    return d


def _claw_tub(draw: Draw) -> Design:
    d = Design("claw-foot bathtub", "bathtub", ("vintage bathtub", "bath"))
    size = (draw.between(1.4, 1.75), draw.between(0.42, 0.48), draw.between(0.68, 0.78))
    outside, metal = WHITE if draw.chance(0.4) else draw.painted(), draw.one_of((BRASS, STEEL, BLACK))
    foot = draw.between(0.12, 0.18)
    rise = draw.between(0.0, 0.2)
    _shell(d, outside, WHITE, size, foot, 0.8, rise)
    for sx in SIDES:
        for sz in SIDES:
            x, z = sx * size[0] * 0.32, sz * size[2] * 0.32
            path = (
                (x * 0.9, foot + 0.1, z * 0.9),
                (x * 1.1, foot * 0.6, z * 1.15),
                (x * 1.12, 0.03, z * 1.2),
            )
            d.add(loft(path, (0.05, 0.03, 0.02), 8), metal)
            ball(d, (0.07, 0.06, 0.07), (x * 1.12, 0.03, z * 1.22), metal, 5)
    rim = [
        (
            size[0] * 0.485 * np.cos(a),
            foot + size[1] * 1.01 + rise * np.cos(a) ** 2,
            size[2] * 0.485 * np.sin(a),
        )
        for a in spread(0, TURN, 25)
    ]
    d.tube(rim, 0.022, outside, 5)
    x, top = -size[0] * 0.44, foot + size[1] + rise
    for s in SIDES:
        d.tube(((x - 0.1, 0, s * 0.06), (x - 0.1, top + 0.12, s * 0.06)), 0.012, metal, 6)
        d.box((0.06, 0.015, 0.015), (x - 0.1, top + 0.15, s * 0.06), metal)
    d.tube(((x - 0.1, top + 0.1, 0.06), (x - 0.1, top + 0.1, -0.06)), 0.012, metal, 6)
    d.tube(((x - 0.1, top + 0.1, 0), (x + 0.06, top + 0.1, 0), (x + 0.07, top + 0.04, 0)), 0.013, metal, 6)
    return d


def _corner_tub(draw: Draw) -> Design:
    d = Design("corner bathtub", "bathtub", ("corner bath", "whirlpool"))
    side, tall, hand = draw.between(1.2, 1.5), draw.between(0.5, 0.62), draw.one_of(SIDES)
    apron = WHITE if draw.chance(0.7) else draw.body()
    half, x, z = side / 2, -hand * 0.06 * side, -0.06 * side
    outline = corner_floor(side, hand, 0.05)
    d.add(grid_triangles(np.array([[(u, y, v) for u, v in outline] for y in (0.0, tall)])), apron)
    d.add(brim(outline, (x, z), tall, 0.37 * side, 24), WHITE)
    hollow = ((0.37 * side, tall), (0.33 * side, tall * 0.45), (0.29 * side, 0.14), (0, 0.12))
    d.add(lathe(hollow, (x, 0, z), 24), WHITE)
    for k in range(5):
        u, y, v = polar(0.33 * side, 0.6 + k * 1.1, tall * 0.5)
        ball(d, (0.05, 0.05, 0.05), (x + u, y, z + v), STEEL, 4)
    water_tap(d, draw, (-hand * (half - 0.1), tall, -half + 0.25), 0.2)
    if draw.chance(0.5):
        d.add(lathe(((0, tall * 0.7), (0.35 * side, tall * 0.7)), (x, 0, z), 20), WATER)
    return d


def _apron_tub(draw: Draw) -> Design:
    d = Design("built-in bathtub", "bathtub", ("bath", "alcove bathtub"))
    length, w, tall = draw.between(1.5, 1.8), draw.between(0.7, 0.85), draw.between(0.5, 0.6)
    apron, rim = draw.body() if draw.chance(0.5) else WHITE, draw.between(0.06, 0.1)
    d.box((length, tall - 0.04, 0.03), (0, tall / 2 - 0.02, w / 2 - 0.03), apron)
    for k in range(draw.count(0, 4)):
        each = length / 4
        place = (-length / 2 + (k + 0.5) * each, tall / 2 - 0.02, w / 2 - 0.015)
        d.box((each * 0.8, tall * 0.65, 0.02), place, apron)
    for s in SIDES:
        d.box((0.03, tall - 0.04, w), (s * (length / 2 - 0.015), tall / 2 - 0.02, 0), apron)
    path = [(length, w, tall - 0.05), (length, w, tall), (length - 2 * rim, w - 2 * rim, tall)]
    d.add(hull(path, 0.15), WHITE)
    inner = (length - 2 * rim, w - 2 * rim)
    hollow = [(1.0, tall), (0.97, tall - 0.05), (0.84, 0.16), (0.0, 0.14)]
    d.add(hull([(inner[0] * s, inner[1] * s, y) for s, y in hollow], 0.3), WHITE)
    water_tap(d, draw, (-length / 2 + rim + 0.1, tall, -w / 2 + 0.04), 0.14)
    if draw.chance(0.5):
        high = draw.between(1.3, 1.5)
        d.box(
            (draw.between(0.75, 1.0), high, 0.01), (-length / 2 + 0.45, tall + high / 2, w / 2 - 0.05), GLASS
        )
        d.box((0.025, high, 0.025), (-length / 2 + 0.02, tall + high / 2, w / 2 - 0.05), STEEL)
        x, z = -length / 2 + 0.25, -w / 2 + 0.02
        d.tube(((x, tall + 0.35, z), (x, tall + 1.4, z), (x, tall + 1.45, z + 0.22)), 0.011, STEEL, 6)
        d.add(cylinder(0.08, 0.015, (x, tall + 1.42, z + 0.22)), STEEL)
    return d


def shower(draw: Draw) -> Design:
    """Mostly plain; else corner cabins, one pane with a rain head, trays with curtains."""
    if draw.chance(0.6):
        return plain_shower(draw)
    return draw.one_of((_corner_shower, _corner_shower, _walk_in_shower, _walk_in_shower, _curtain_shower))(
        draw
    )


def _pipes(d: Design, draw: Draw, x: float, z: float, top: float, metal: Look) -> None:
    """A rail with a rain head, a hand shower and a mixer, before a wall at z."""
    d.tube(((x, 1.0, z + 0.04), (x, top, z + 0.04), (x, top, z + 0.38)), 0.012, metal, 6)
    if draw.chance(0.6):
        d.cylinder(draw.between(0.1, 0.16), 0.015, (x, top - 0.03, z + 0.38), metal)
    else:
        d.box((0.25, 0.015, 0.25), (x, top - 0.03, z + 0.38), metal)
    d.add(across(0.022, 0.26, (x, 1.05, z + 0.05), 0, 10), metal)
    d.tube(((x + 0.02, 1.4, z + 0.05), (x + 0.03, 1.55, z + 0.12)), 0.016, metal, 6)
    hose = [(x + 0.05 + 0.06 * np.sin(t), 1.45 - 0.25 * t, z + 0.05) for t in spread(0, 3.0, 6)]
    d.tube((*hose, (x + 0.03, 1.0, z + 0.05)), 0.008, metal, 5)


def _corner_shower(draw: Draw) -> Design:
    d = Design("corner shower", "shower", ("shower cabin", "shower cubicle"))
    side, tall, foot = draw.between(0.8, 1.0), draw.between(1.9, 2.15), draw.between(0.04, 0.18)
    metal, round_front = STEEL if draw.chance(0.6) else draw.one_of((BLACK, WHITE)), draw.chance(0.6)
    half, glass = side / 2, plain((0.8, 0.87, 0.87), 0.9, opacity=draw.between(0.22, 0.4))
    if round_front:
        arc = [
            (-half + 0.35 * side + 0.65 * side * np.cos(a), -half + 0.35 * side + 0.65 * side * np.sin(a))
            for a in spread(0, QUARTER, 9)
        ]
    else:
        arc = [(half, -half + 0.4 * side), (-half + 0.4 * side, half)]
    edge = [(half, -half), (half, -half + 0.35 * side), *arc, (-half, half)]
    for low, high, look in ((0.0, foot, WHITE), (foot, tall, glass)):
        d.add(
            grid_triangles(np.array([[(x, low, z) for x, z in edge], [(x, high, z) for x, z in edge]])), look
        )
    outline = [*edge, (-half, -half), edge[0]]
    path = [
        [(-0.1, foot, -0.1), (a[0], foot, a[1]), (b[0], foot, b[1])] for a, b in itertools.pairwise(outline)
    ]
    d.add(np.array(path), WHITE)
    for y in (foot + 0.015, tall):
        d.tube([(x, y, z) for x, z in edge], 0.016, metal, 5)
    for x, z in (edge[0], arc[0], arc[-1], edge[-1]):
        d.box((0.03, tall - foot, 0.03), (x, (tall + foot) / 2, z), metal)
    middle = arc[len(arc) // 2] if round_front else (0.2 * side, 0.2 * side)
    d.box((0.02, 0.3, 0.02), (middle[0], 1.1, middle[1]), metal)
    if draw.chance(0.5):
        wall = WHITE if draw.chance(0.6) else draw.painted()
        d.box((side, tall - foot, 0.012), (0, (tall + foot) / 2, -half), wall)
        d.box((0.012, tall - foot, side), (-half, (tall + foot) / 2, 0), wall)
    _pipes(d, draw, draw.between(-0.1, 0.1), -half, tall - 0.1, STEEL)
    return d


def _walk_in_shower(draw: Draw) -> Design:
    d = Design("walk-in shower", "shower", ("shower", "glass shower"))
    wide, deep, tall = draw.between(0.9, 1.4), draw.between(0.8, 1.0), draw.between(1.95, 2.15)
    metal, tray = draw.one_of((STEEL, BLACK, BRASS)), draw.one_of((WHITE, DARK, plain((0.6, 0.58, 0.55))))
    d.box((wide, 0.03, deep), (0, 0.015, 0), tray)
    d.cylinder(0.05, 0.006, (0, 0.03, 0), STEEL)
    glass = plain((0.8, 0.87, 0.87), 0.9, opacity=draw.between(0.2, 0.4))
    hand, panes = draw.one_of(SIDES), draw.chance(0.35)
    d.box((0.012, tall, deep * 0.98), (hand * wide / 2, tall / 2, 0), glass)
    d.box((0.02, 0.02, deep), (hand * wide / 2, tall, 0), metal)
    for z in (-deep / 2, deep / 2):
        d.box((0.02, tall, 0.02), (hand * wide / 2, tall / 2, z), metal)
    if panes:
        for y in spread(0, tall, 5)[1:-1]:
            d.box((0.02, 0.02, deep), (hand * wide / 2, y, 0), metal)
        d.box((0.02, tall, 0.02), (hand * wide / 2, tall / 2, 0), metal)
    if draw.chance(0.5):
        d.box((wide * 0.5, tall, 0.012), (hand * wide * 0.25, tall / 2, deep / 2), glass)
        d.box((0.02, tall, 0.02), (0, tall / 2, deep / 2), metal)
    d.tube(((hand * wide / 2, tall, 0.1), (-hand * wide / 2, tall, 0.1)), 0.01, metal, 5)
    if draw.chance(0.6):
        wall = draw.painted() if draw.chance(0.5) else plain((0.5, 0.52, 0.53), 0.4)
        d.box((wide, tall + 0.05, 0.012), (0, tall / 2 + 0.025, -deep / 2 - 0.006), wall)
        for y in spread(0.2, tall, 8):
            d.box((wide, 0.005, 0.002), (0, y, -deep / 2 + 0.001), LINEN)
    _pipes(d, draw, draw.between(-0.2, 0.2), -deep / 2, tall - 0.05, metal)
    return d


def _curtain_shower(draw: Draw) -> Design:
    d = Design("shower", "shower", ("shower with curtain",))
    wide, deep, tall = draw.between(0.8, 1.0), draw.between(0.75, 0.9), draw.between(1.95, 2.1)
    open_box(d, (wide, 0.14, deep), (0, 0, 0), WHITE, 0.05)
    path = (
        (-wide / 2, tall, -deep / 2),
        (-wide / 2, tall, deep / 2),
        (wide / 2, tall, deep / 2),
        (wide / 2, tall, -deep / 2),
    )
    d.tube(path, 0.012, STEEL, 6)
    cloth = draw.cloth() if draw.chance(0.7) else plain((0.92, 0.93, 0.94), 0.2, opacity=0.75)
    broad = draw.between(0.5, 0.95) * wide
    x = np.linspace(-wide / 2, -wide / 2 + broad, 40)
    wave = 0.03 * np.sin(x * 2 * np.pi / 0.11)
    rows = [
        np.stack([x, np.full_like(x, y), deep / 2 + wave * s], -1)
        for y, s in ((0.12, 1.2), (1.0, 1.0), (tall, 0.6))
    ]
    d.add(grid_triangles(np.array(rows)), cloth)
    if draw.chance(0.5):
        z = np.linspace(-deep / 2, deep / 2, 34)
        rows = [
            np.stack([np.full_like(z, -wide / 2) + 0.025 * np.sin(z * 57), np.full_like(z, y), z], -1)
            for y in (0.12, tall)
        ]
        d.add(grid_triangles(np.array(rows)), cloth)
    if draw.chance(0.6):
        d.box((wide, tall, 0.01), (0, tall / 2, -deep / 2 - 0.005), draw.painted())
    _pipes(d, draw, 0.0, -deep / 2, tall, STEEL)
    return d
