"""Makers of sinks and toilets (see `makers.common`).

Metres, y up, front +z.
"""

import numpy as np

from langflash_core.lab.rooms.makers.fittings import plain_sink, plain_toilet
from langflash_core.lab.rooms.makers.kit import (
    BRASS,
    DARK,
    QUARTER,
    SIDES,
    STEEL,
    WATER,
    WHITE,
    Design,
    Draw,
    Face,
    Look,
    Vector,
    across,
    ball,
    brim,
    corner_floor,
    cylinder,
    four_legs,
    grid_triangles,
    hull,
    lathe,
    merge,
    open_box,
    pad,
    panels,
    plain,
    scaled,
    shifted,
    slab,
    spread,
    turned,
)


def water_tap(d: Design, draw: Draw, at: Vector, reach: float = 0.13) -> None:
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
    water_tap(d, draw, (x, top + 0.02, -deep * 0.42), 0.15)
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
    water_tap(d, draw, (0, top + 0.02, -deep / 2 + 0.05))
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
    water_tap(d, draw, (0, tall * 0.95, -deep / 2 + 0.06))
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
    water_tap(tap, draw, (0, top + 0.015, -deep * 0.4))
    for s in SIDES:
        merge(d, tap, lambda t, s=s: shifted(t, (s * wide * 0.25, 0, 0)))
    return d


def _corner_sink(draw: Draw) -> Design:
    d = Design("corner sink", "sink", ("corner basin", "washbasin"))
    side, top, hand = draw.between(0.42, 0.55), draw.between(0.8, 0.87), draw.one_of(SIDES)
    half, x, z = side / 2, -hand * 0.08 * side, -0.08 * side
    outline = corner_floor(side, hand, 0.1)
    rows = [
        [(scale * u, y, scale * v) for u, v in outline]
        for scale, y in ((0.0, top - 0.17), (0.75, top - 0.16), (1.0, top))
    ]
    d.add(grid_triangles(np.array(rows)), WHITE)
    d.add(brim(outline, (x, z), top, 0.31 * side, 20), WHITE)
    d.add(lathe(((0.31 * side, top), (0.25 * side, top - 0.09), (0, top - 0.12)), (x, 0, z), 20), WHITE)
    if draw.chance(0.5):
        d.add(cylinder(0.09, top - 0.14, (2 * x, 0, 2 * z), 0.07), WHITE)
    else:
        wood, wide = draw.body(), side * 0.7
        d.box((wide, top - 0.2, wide), (-hand * (half - wide / 2), top / 2 - 0.05, wide / 2 - half), wood)
        left = -hand * (half - wide / 2) - wide / 2
        panels(d, draw, Face(left, 0.06, wide, top - 0.23, wide - half), 1, 1, wood, True)
    water_tap(d, draw, (-hand * side * 0.36, top - 0.01, -side * 0.36), 0.12)
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
