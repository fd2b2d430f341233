"""Makers of sinks, toilets, bathtubs and showers (see `makers.common`).

Metres, y up, front +z.
"""

import itertools

import numpy as np

from langflash_core.lab.rooms.makers.fittings import plain_bathtub, plain_shower, plain_sink, plain_toilet
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
    Face,
    Look,
    Vector,
    across,
    ball,
    cylinder,
    facing,
    four_legs,
    grid_triangles,
    hull,
    lathe,
    loft,
    merge,
    open_box,
    pad,
    panels,
    plain,
    polar,
    scaled,
    shifted,
    slab,
    spread,
    turned,
)


def _tap(d: Design, draw: Draw, at: Vector, reach: float = 0.13) -> None:
    """An arch, a block with a lever, or a spout between two handles; it points forwards."""
    (x, y, z), style, metal = at, draw.style(3), draw.one_of((STEEL, STEEL, DARK, BRASS))
    tall = draw.between(0.1, 0.26)
    if style == 0:
        arc = [
            (x, y + tall + reach / 2 * np.sin(a), z + reach / 2 * (1 - np.cos(a)))
            for a in spread(0, np.pi, 6)
        ]
        d.tube(((x, y, z), *arc, (x, y + tall - 0.04, z + reach)), 0.011, metal, 7)
    elif style == 1:
        d.cylinder(0.022, tall * 0.6, (x, y, z), metal)
        d.box((0.03, 0.022, reach), (x, y + tall * 0.45, z + reach / 2), metal)
        d.box((0.02, 0.012, 0.08), (x, y + tall * 0.65, z + 0.02), metal)
    else:
        d.tube(
            ((x, y, z), (x, y + 0.09, z), (x, y + 0.1, z + reach), (x, y + 0.07, z + reach)), 0.013, metal, 7
        )
    if style != 1:
        for s in SIDES:
            d.cylinder(0.016, 0.05, (x + s * 0.09, y, z), metal)
            d.add(across(0.008, 0.05, (x + s * 0.09, y + 0.05, z), 0, 6), metal)


def _bowl(d: Design, look: Look, size: Vector, foot: Vector, square: bool) -> None:
    """An open basin: round, oval or square."""
    (w, h, z), wall = size, 0.015
    if square:
        open_box(d, size, foot, look, wall)
        return
    profile = ((0, 0), (0.32, 0.02), (0.46, 0.5), (0.5, 1), (0.475, 1), (0.43, 0.5), (0.28, 0.15), (0, 0.12))
    d.add(lathe(scaled(profile, w, h), foot, 22, z / w), look)
    d.add(cylinder(0.02, 0.006, (foot[0], foot[1] + h * 0.12, foot[2]), segments=10), STEEL)


def sink(draw: Draw) -> Design:
    """Mostly plain; else on a board, on a pedestal, on the wall, double, in a corner, and old ones."""
    if draw.chance(0.64):
        return plain_sink(draw)
    many = (_bowl_sink, _bowl_sink, _pedestal_sink, _wall_sink, _double_sink, _corner_sink, _old_sink)
    return draw.one_of(many)(draw)


def _bowl_sink(draw: Draw) -> Design:
    d = Design("vessel sink", "sink", ("washbasin", "countertop basin"))
    wide, deep, top = draw.between(0.6, 1.2), draw.between(0.42, 0.5), draw.between(0.74, 0.82)
    look, bowl = draw.body(), WHITE if draw.chance(0.6) else draw.ceramic()
    d.box((wide, draw.between(0.03, 0.08), deep), (0, top, 0), look)
    style = draw.style(3)
    if style == 0:
        four_legs(d, draw, wide, deep, top, draw.legs())
        d.box((wide * 0.95, 0.025, deep * 0.9), (0, 0.25, 0), look)
        for x in (-wide * 0.2, wide * 0.15):
            pad(d, (0.26, 0.1, 0.3), (x, 0.31, 0), draw.cloth(), 0.03)
    elif style == 1:
        low = draw.between(0.25, 0.45)
        d.box((wide * 0.98, top - low, deep * 0.96), (0, (top + low) / 2, 0), look)
        panels(
            d, draw, Face(-wide * 0.49, low, wide * 0.98, top - low, deep * 0.48), draw.count(1, 2), 1, look
        )
        for s in SIDES:
            d.box((0.03, low, 0.03), (s * wide * 0.45, low / 2, -deep * 0.45), DARK)
    else:
        d.box((wide * 0.96, top - 0.06, deep * 0.92), (0, top / 2, 0), look)
        panels(d, draw, Face(-wide * 0.48, 0.06, wide * 0.96, top - 0.1, deep * 0.46), 1, 2, look, True)
    x, square, rim = draw.between(-0.15, 0.15) * wide, draw.chance(0.35), draw.between(0.36, 0.45)
    tall = draw.between(0.1, 0.16)
    _bowl(d, bowl, (rim, tall, rim * draw.between(0.7, 0.95)), (x, top + 0.02, 0.03), square)
    _tap(d, draw, (x, top + 0.02, -deep * 0.42), 0.15)
    return d


def _pedestal_sink(draw: Draw) -> Design:
    d = Design("pedestal sink", "sink", ("washbasin",))
    wide, deep, top = draw.between(0.5, 0.7), draw.between(0.42, 0.52), draw.between(0.8, 0.88)
    square, look = draw.chance(0.5), WHITE if draw.chance(0.8) else draw.ceramic()
    if square:
        d.box((0.26, 0.06, 0.24), (0, 0.03, -0.04), look)
        path = ((0.5, 0), (0.4, 0.3), (0.4, 0.8), (0.6, 1))
        d.add(slab(path, (0.34, top - 0.16, 0.18), (0, 0.03, -0.04)), look)
    else:
        path = ((0.15, 0), (0.15, 0.04), (0.09, 0.1), (0.07, 0.4), (0.1, top - 0.2), (0.18, top - 0.12))
        d.add(lathe(path, (0, 0, -0.03), 18), look)
    _bowl(d, look, (wide, 0.17, deep), (0, top - 0.17, 0.02), square)
    pad(d, (wide * 0.9, 0.05, 0.13), (0, top, -deep / 2 + 0.05), look, 0.02)
    if draw.chance(0.4):
        pad(d, (wide * 0.9, 0.12, 0.03), (0, top + 0.06, -deep / 2), look, 0.015)
    _tap(d, draw, (0, top + 0.02, -deep / 2 + 0.05))
    return d


def _wall_sink(draw: Draw) -> Design:
    foot = draw.between(0.48, 0.56)
    d = Design("wall-hung sink", "sink", ("washbasin", "wall sink"), elevation=foot)
    wide, deep = draw.between(0.4, 0.9), draw.between(0.35, 0.48)
    tall, look = draw.between(0.13, 0.2), WHITE if draw.chance(0.75) else draw.ceramic()
    square = draw.chance(0.6)
    _bowl(d, look, (wide, tall, deep), (0, 0.0, 0.02), square)
    pad(d, (wide, tall * 0.9, 0.11), (0, tall * 0.52, -deep / 2 + 0.05), look, 0.02)
    d.tube(((0, 0.02, 0), (0, -0.16, 0), (0, -0.16, -deep / 2 - 0.02)), 0.02, STEEL)
    _tap(d, draw, (0, tall * 0.95, -deep / 2 + 0.06))
    if draw.chance(0.3):
        path = ((-wide / 2, tall - 0.04, deep / 2 + 0.04), (wide / 2, tall - 0.04, deep / 2 + 0.04))
        d.tube(path, 0.01, STEEL, 6)
    return d


def _double_sink(draw: Draw) -> Design:
    d = Design("double sink", "sink", ("double vanity", "washbasin"))
    wide, deep = draw.between(1.15, 1.6), draw.between(0.45, 0.55)
    top, low = draw.between(0.78, 0.86), draw.between(0.08, 0.35)
    look, board = draw.body(), WHITE if draw.chance(0.5) else draw.body()
    d.box((wide, top - low, deep), (0, (top + low) / 2, 0), look)
    panels(d, draw, Face(-wide / 2, low, wide, top - low, deep / 2), draw.count(1, 2), draw.count(2, 4), look)
    four_legs(d, draw, wide, deep, low + 0.02, draw.legs())
    d.box((wide + 0.03, 0.035, deep + 0.03), (0, top, 0.01), board)
    square, bowl = draw.chance(0.5), WHITE if draw.chance(0.7) else draw.ceramic()
    for s in SIDES:
        _bowl(d, bowl, (0.42, 0.11, 0.34), (s * wide * 0.25, top + 0.015, 0.04), square)
    tap = Design("", "")
    _tap(tap, draw, (0, top + 0.015, -deep * 0.4))
    for s in SIDES:
        merge(d, tap, lambda t, s=s: shifted(t, (s * wide * 0.25, 0, 0)))
    return d


def _corner_sink(draw: Draw) -> Design:
    d = Design("corner sink", "sink", ("corner basin", "washbasin"))
    side, top, hand = draw.between(0.42, 0.55), draw.between(0.8, 0.87), draw.one_of(SIDES)
    half, x, z = side / 2, -hand * 0.08 * side, -0.08 * side
    arc = [polar(0.6 * side, a, 0) for a in spread(0, QUARTER, 7)]
    front = [(hand * (u - 0.1 * side), v - 0.1 * side) for u, _, v in arc]
    outline = [
        (-hand * half, -half),
        (hand * half, -half),
        *front,
        (-hand * half, half),
        (-hand * half, -half),
    ]
    rows = [
        [(scale * u, y, scale * v) for u, v in outline]
        for scale, y in ((0.0, top - 0.17), (0.75, top - 0.16), (1.0, top))
    ]
    d.add(grid_triangles(np.array(rows)), WHITE)
    rim = [(u, top, v) for u, v in facing(outline, (x, z), 20)]
    brim = [(x + u, top, z + v) for u, _, v in (polar(0.31 * side, a, 0) for a in spread(0, TURN, 21))]
    d.add(grid_triangles(np.array([rim, brim])), WHITE)
    d.add(lathe(((0.31 * side, top), (0.25 * side, top - 0.09), (0, top - 0.12)), (x, 0, z), 20), WHITE)
    if draw.chance(0.5):
        d.add(cylinder(0.09, top - 0.14, (2 * x, 0, 2 * z), 0.07), WHITE)
    else:
        wood, wide = draw.body(), side * 0.7
        d.box((wide, top - 0.2, wide), (-hand * (half - wide / 2), top / 2 - 0.05, wide / 2 - half), wood)
        left = -hand * (half - wide / 2) - wide / 2
        panels(d, draw, Face(left, 0.06, wide, top - 0.23, wide - half), 1, 1, wood, True)
    _tap(d, draw, (-hand * side * 0.36, top - 0.01, -side * 0.36), 0.12)
    return d


def _old_sink(draw: Draw) -> Design:
    d = Design("old sink", "sink", ("vintage sink", "stone sink"))
    wide, deep, top = draw.between(0.55, 1.0), draw.between(0.45, 0.55), draw.between(0.8, 0.88)
    look = WHITE if draw.chance(0.6) else plain((0.6, 0.58, 0.54), 0.1)
    tall = draw.between(0.2, 0.28)
    open_box(d, (wide, tall, deep), (0, top - tall, 0), look, 0.045)
    d.box((wide, draw.between(0.12, 0.3), 0.03), (0, top + 0.08, -deep / 2 + 0.015), look)
    for s in SIDES:
        outlet = (s * 0.09, top + 0.1, -deep / 2 + 0.03)
        path = (outlet, (s * 0.09, top + 0.1, -deep / 2 + 0.12), (s * 0.09, top + 0.05, -deep / 2 + 0.14))
        d.tube(path, 0.012, BRASS, 7)
        d.box((0.06, 0.014, 0.014), (s * 0.09, top + 0.14, -deep / 2 + 0.08), BRASS)
        d.box((0.014, 0.05, 0.014), (s * 0.09, top + 0.115, -deep / 2 + 0.08), BRASS)
    if draw.chance(0.5):
        four_legs(d, draw, wide, deep, top - tall, draw.legs())
        d.box((wide * 0.85, 0.03, deep * 0.8), (0, 0.2, 0), draw.wooden())
    else:
        for s in SIDES:
            d.box((0.12, top - tall, deep * 0.8), (s * wide * 0.32, (top - tall) / 2, 0), look)
    return d


def toilet(draw: Draw) -> Design:
    """Mostly plain; else hung on a wall box, with a tank, old with a high tank, square; lid up or down."""
    if draw.chance(0.64):
        return plain_toilet(draw)
    return draw.one_of((_hung_toilet, _hung_toilet, _tank_toilet, _tank_toilet, _old_toilet, _square_toilet))(
        draw
    )


def _toilet_top(
    d: Design, draw: Draw, size: tuple[float, float], y: float, z: float, square: bool, look: Look
) -> None:
    """Seat and lid over a rim of this width and length, hinged at the back."""
    w, length = size
    half = ((0.6, 0), (0.95, 0.06), (1, 0.4), (0.9, 0.75), (0.6, 0.95), (0.1, 1))
    if square:
        half = ((1, 0), (1, 0.9), (0.9, 0.98), (0.8, 1))
    lid = slab(half, (w, length, 0.03))
    rear = (0.0, y, z - length / 2)
    if draw.chance(0.5):
        d.add(shifted(turned(lid, 0, QUARTER), (0, y + 0.015, z - length / 2)), look)
        return
    d.add(shifted(turned(lid, 0, -0.12), rear), look)
    ring = lathe(((0.5, 0), (0.5, 0.03), (0.36, 0.03), (0.34, 0)), segments=22) * np.array([w, 1, length])
    d.add(shifted(ring, (0, y, z)), look)
    d.add(cylinder(0.33 * w, 0.004, (0, y - 0.1, z), segments=16), WATER)


def _pan(d: Design, size: Vector, foot: float, look: Look, hung: bool) -> None:
    """The bowl of a toilet: (width, height, length), open above."""
    w, h, length = size
    low = (
        ((0.2, 0), (0.3, 0.15), (0.46, 0.7), (0.5, 1))
        if hung
        else ((0.36, 0), (0.3, 0.12), (0.3, 0.45), (0.47, 0.85), (0.5, 1))
    )
    d.add(lathe(scaled((*low, (0.4, 1), (0.3, 0.6), (0, 0.45)), w, h), (0, foot, 0), 20, length / w), look)


def _hung_toilet(draw: Draw) -> Design:
    d = Design("wall-hung toilet", "toilet", ("wc", "toilet"))
    w, length, seat, look = draw.between(0.35, 0.39), draw.between(0.46, 0.52), draw.between(0.4, 0.45), WHITE
    box_look = plain((0.85, 0.85, 0.84), 0.3) if draw.chance(0.5) else draw.painted()
    wide, tall, z = draw.between(0.45, 1.0), draw.between(0.95, 1.2), -length / 2 - 0.07
    d.box((wide, tall, 0.16), (0, tall / 2, z - 0.06), box_look)
    if draw.chance(0.6):
        d.box((wide + 0.02, 0.025, 0.18), (0, tall, z - 0.06), draw.body())
    plate = STEEL if draw.chance(0.5) else WHITE
    d.box((0.24, 0.16, 0.012), (0, min(tall - 0.14, 1.0), z + 0.024), plate)
    for s in SIDES:
        d.roll(
            0.035, 0.006, (s * 0.05, min(tall - 0.14, 1.0), z + 0.03), DARK if plate is WHITE else WHITE, 12
        )
    _pan(d, (w, seat - 0.12, length), 0.12, look, True)
    pad(d, (w * 0.85, seat - 0.18, 0.2), (0, seat / 2 + 0.06, -length * 0.4), look, 0.05)
    _toilet_top(d, draw, (w, length), seat, 0, draw.chance(0.25), look)
    return d


def _tank_toilet(draw: Draw) -> Design:
    d = Design("toilet", "toilet", ("wc", "close-coupled toilet"))
    w, length, seat = draw.between(0.36, 0.4), draw.between(0.45, 0.52), draw.between(0.38, 0.44)
    look = (
        WHITE
        if draw.chance(0.75)
        else plain(draw.one_of(((0.85, 0.8, 0.68), (0.6, 0.75, 0.72), (0.85, 0.68, 0.68))), 0.6)
    )
    _pan(d, (w, seat, length), 0, look, False)
    d.box((w * 0.62, seat * 0.9, 0.22), (0, seat * 0.45, -length / 2), look)
    tall, deep = draw.between(0.32, 0.42), draw.between(0.16, 0.21)
    half = ((0.85, 0), (0.98, 0.3), (1, 1)) if draw.chance(0.5) else ((1, 0), (1, 1))
    z = -length / 2 - deep / 2 + 0.02
    d.add(slab(half, (w * 1.15, tall, deep), (0, seat, z)), look)
    pad(d, (w * 1.22, 0.035, deep + 0.03), (0, seat + tall + 0.015, z), look, 0.015)
    if draw.chance(0.5):
        d.cylinder(0.025, 0.015, (0, seat + tall + 0.03, z), STEEL)
    else:
        d.box((0.07, 0.02, 0.02), (-w * 0.4, seat + tall * 0.85, z + deep / 2 + 0.01), STEEL)
    wood = draw.wooden() if draw.chance(0.2) else look
    _toilet_top(d, draw, (w, length), seat, 0.01, False, wood)
    return d


def _old_toilet(draw: Draw) -> Design:
    d = Design("old toilet", "toilet", ("toilet with high tank", "wc"))
    w, length, seat, wood = 0.37, draw.between(0.45, 0.5), 0.41, draw.wooden()
    path = ((0.42, 0), (0.42, 0.06), (0.28, 0.15), (0.27, 0.4), (0.5, 0.85), (0.52, 1), (0.4, 1), (0, 0.5))
    d.add(lathe(scaled(path, w, seat), (0, 0, 0), 18, length / w), WHITE)
    _toilet_top(d, draw, (w, length), seat, 0, False, wood)
    high, z = draw.between(1.5, 1.9), -length / 2 - 0.08
    pad(d, (0.46, 0.3, 0.2), (0, high, z), WHITE if draw.chance(0.6) else wood, 0.03)
    d.box((0.5, 0.03, 0.23), (0, high + 0.16, z), WHITE if draw.chance(0.5) else wood)
    path = ((0, high - 0.15, z), (0, seat - 0.05, z), (0, seat - 0.08, -length * 0.3))
    d.tube(path, 0.022, BRASS if draw.chance(0.5) else WHITE)
    path = ((0.18, high + 0.05, z + 0.11), (0.26, high + 0.05, z + 0.11), (0.26, high - 0.5, z + 0.11))
    d.tube(path, 0.005, BRASS, 5)
    ball(d, (0.035, 0.07, 0.035), (0.26, high - 0.53, z + 0.11), WHITE, 4)
    return d


def _square_toilet(draw: Draw) -> Design:
    d = Design("toilet", "toilet", ("modern toilet", "wc"))
    w, length, seat = draw.between(0.36, 0.4), draw.between(0.48, 0.56), draw.between(0.4, 0.44)
    look = WHITE if draw.chance(0.85) else plain((0.13, 0.13, 0.14), 0.4)
    low, narrow = draw.between(0.55, 0.9), draw.between(0.6, 0.95)
    outside = [
        (w * narrow, length * low, 0.0),
        (w * narrow, length * low, 0.05),
        (w * 0.98, length, seat * 0.7),
    ]
    inside = [(w * 0.72, length * 0.72, seat), (w * 0.5, length * 0.5, seat * 0.6), (0, 0, seat * 0.5)]
    d.add(hull([*outside, (w, length, seat), *inside], 0.35), look)
    d.box((w * narrow * 0.95, seat * 0.98, length * 0.3), (0, seat * 0.49, -length * 0.38), look)
    tall, rear = draw.between(0.34, 0.48), -length / 2 - 0.06
    pad(d, (w * 1.02, tall, 0.17), (0, seat + tall / 2 - 0.01, rear), look, 0.02)
    d.box((w * 0.8, seat, 0.14), (0, seat / 2, rear), look)
    d.cylinder(0.028, 0.012, (0, seat + tall - 0.01, rear), STEEL)
    _toilet_top(d, draw, (w, length), seat, 0, True, look)
    return d


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
    arc = [polar(0.55 * side, a, 0) for a in spread(0, QUARTER, 7)]
    front = [(hand * (u - 0.05 * side), v - 0.05 * side) for u, _, v in arc]
    outline = [
        (-hand * half, -half),
        (hand * half, -half),
        *front,
        (-hand * half, half),
        (-hand * half, -half),
    ]
    d.add(grid_triangles(np.array([[(u, y, v) for u, v in outline] for y in (0.0, tall)])), apron)
    rim = [(u, tall, v) for u, v in facing(outline, (x, z), 24)]
    brim = [(x + u, tall, z + v) for u, _, v in (polar(0.37 * side, a, 0) for a in spread(0, TURN, 25))]
    d.add(grid_triangles(np.array([rim, brim])), WHITE)
    hollow = ((0.37 * side, tall), (0.33 * side, tall * 0.45), (0.29 * side, 0.14), (0, 0.12))
    d.add(lathe(hollow, (x, 0, z), 24), WHITE)
    for k in range(5):
        u, y, v = polar(0.33 * side, 0.6 + k * 1.1, tall * 0.5)
        ball(d, (0.05, 0.05, 0.05), (x + u, y, z + v), STEEL, 4)
    _tap(d, draw, (-hand * (half - 0.1), tall, -half + 0.25), 0.2)
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
    _tap(d, draw, (-length / 2 + rim + 0.1, tall, -w / 2 + 0.04), 0.14)
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
