"""Makers of what burns, and of what it burns in (see `makers.common`). Metres, y up, front +z."""

import numpy as np

from langflash_core.lab.rooms.makers import common
from langflash_core.lab.rooms.makers.kit import (
    BLACK,
    QUARTER,
    SIDES,
    STEEL,
    WHITE,
    Design,
    Draw,
    Look,
    Vector,
    boxes,
    cylinder,
    plain,
    turned,
)
from langflash_core.lab.rooms.makers.kitchen import (
    CRUST,
    GLASS,
    GOLD,
    IRON,
    any_made,
    arc_line,
    rod_along,
    round_body,
)

_FIRES = (plain((0.98, 0.4, 0.06)), plain((1.0, 0.65, 0.15)), plain((1.0, 0.85, 0.4)))


def _taper(d: Design, r: float, h: float, foot: Vector, wax: Look, lit: bool) -> None:
    """A candle on `foot`, with a wick and perhaps a flame."""
    d.add(cylinder(r, h, foot, r * 0.95, 10), wax)
    d.add(cylinder(0.002, h + 0.012, foot, segments=4), BLACK)
    if lit:
        round_body(
            d, 0.008, 0.04, _FIRES[1], "0 0 100 30 60 60 0 100", (foot[0], foot[1] + h + 0.005, foot[2]), 6
        )


def candle(draw: Draw) -> Design:
    """Pillars alone or three together, in a glass, on a stick, or on a candelabrum of three or five arms."""
    style, d = any_made(draw, "candle", "candle", "candle in a glass", "candlestick", "candelabrum")
    wax = plain((0.94, 0.91, 0.82) if draw.chance(0.6) else draw.colour(0.9), 0.2)
    metal, lit = draw.one_of((GOLD, STEEL, IRON, draw.wooden(), draw.ceramic())), draw.chance(0.6)
    r, h, long = draw.between(0.03, 0.05), draw.between(0.14, 0.32), draw.between(0.12, 0.26)
    many, glass = draw.one_of((1, 3)), draw.one_of((GLASS, plain(draw.colour(0.7), 0.7, 0.7)))
    if style == 0:
        d.cylinder(r * (1.3 if many == 1 else 3.5), 0.008, (0, 0, 0), metal)
        for k in range(many):
            place = common.polar(2.1 * r * (many > 1), 2.1 * k, 0.006)
            _taper(d, r, r * draw.between(1.5, 5), place, wax, lit)
    elif style == 1:
        round_body(d, r, r * 2.2, glass, f"0 0 {draw.count(75, 100)} 0 100 100 93 100")
        _taper(d, r * 0.7, r * 1.7, (0, 0.008, 0), wax, lit)
    else:
        round_body(d, 0.05, h, metal, "0 0 100 0 100 4 30 10 20 35 45 50 20 60 25 93 50 96 50 100 0 100")
        _taper(d, 0.011, long, (0, h, 0), wax, lit)
    for reach in (0.1, -0.1, 0.19, -0.19)[: many + 1] if style == 3 else ():
        d.tube(arc_line(0, h * 0.85, reach, h * 0.35, np.pi, QUARTER), 0.007, metal, 6)
        d.add(cylinder(0.012, 0.02, (reach, h * 0.85, 0), 0.024, 10), metal)
        _taper(d, 0.011, long, (reach, h * 0.85 + 0.02, 0), wax, lit)
    return d


def ashtray(draw: Draw) -> Design:
    """A round or square dish, some with ash and cigarettes."""
    d, r, h = Design("ashtray", "ashtray", ("ash tray",)), draw.between(0.05, 0.09), draw.between(0.022, 0.04)
    look = draw.one_of((plain((0.75, 0.82, 0.82), 0.9), draw.ceramic(), STEEL, BLACK))
    round_body(d, r, h, look, "0 0 90 0 100 100 75 100 65 35 0 30", n=draw.one_of((4, 8, 18)))
    d.cylinder(r * 0.45, 0.004, (0, h * 0.32, 0), plain((0.35, 0.34, 0.33)))
    for k in range(draw.count(0, 4)):
        turn, out = k * 1.57 + draw.between(-0.3, 0.3), draw.between(0.6, 1.1) * r
        ends = [common.polar(x, turn, y) for x, y in ((0.01, h / 2), (out, h), (out + 0.02, h + 0.004))]
        d.tube(ends[:2], 0.004, WHITE, 6)
        d.tube(ends[1:], 0.0042, CRUST, 6)
    return d


def firewood(draw: Draw) -> Design:
    """Logs in a heap, or piled in a frame of metal or wood, some under a board."""
    d, heap, many, metal = (
        Design("firewood", "firewood", ("logs",)),
        draw.chance(0.4),
        draw.count(4, 8),
        draw.legs(),
    )
    long, r, rows = draw.between(0.25, 0.4), draw.between(0.035, 0.06), many if heap else draw.count(4, 6)
    bark, cut = plain((0.33, 0.23, 0.15)), plain((0.83, 0.66, 0.44))
    for row in range(rows):
        for k in range(many - row if heap else many - row % 2):
            x, n = (2 * k + (row if heap else row % 2) + 1 - many) * r, draw.one_of((3, 4, 8, 8))
            size, end, spin = (
                r * draw.between(0.85, 1.05),
                draw.between(-0.02, 0.02) - long / 2,
                draw.between(0, 6),
            )
            for wide, deep, look in ((size, long, bark), (size * 0.86, long + 0.006, cut)):
                log = turned(cylinder(wide, deep, (0, (long - deep) / 2, 0), segments=n), 1, spin)
                d.add(common.laid(log, (x, 0.04 + r + row * 1.75 * r, end)), look)
    wide, high = many * r + 0.03, 0.06 + rows * 1.75 * r + 0.05
    for z in () if heap else (-long * 0.35, long * 0.35):
        d.tube(((-wide, high, z), (-wide, 0.02, z), (wide, 0.02, z), (wide, high, z)), 0.011, metal, 6)
    if not heap and draw.chance(0.5):
        boxes(d, metal, (2 * wide + 0.04, 0.025, long * 0.9, 0, high + 0.01, 0))
    return d


def _fire(d: Design, draw: Draw, w: float, y: float, z: float, deep: float) -> None:
    """Logs with flames over a width and a depth."""
    for k in (-1, 0, 1):
        rod_along(d, 0.035, w * 0.7, (0, y + 0.035 + 0.05 * (k == 0), z + deep * k), plain((0.16, 0.1, 0.07)))
    for x in common.spread(-w * 0.35, w * 0.35, max(4, int(w / 0.07))) if draw.chance(0.8) else ():
        high, place = draw.between(0.12, 0.3), (x, y + 0.05, z + deep * draw.between(-0.5, 1))
        round_body(d, high * 0.2, high, draw.one_of(_FIRES), "0 0 100 25 55 60 0 100", place, 6)


def fireplace(draw: Draw) -> Design:
    """A mantel of stone, brick or wood about a fire; an iron stove with its pipe; modern and flat."""
    style, d = any_made(draw, "fireplace", "fireplace", "wood stove", "modern fireplace")
    w, h, z, flat = draw.between(1.1, 1.6), draw.between(1.0, 1.3), draw.between(0.15, 0.22), style == 2
    if style == 1:
        w, look = w * 0.37, IRON if draw.chance(0.7) else plain(draw.colour(0.3, 0.3), 0.3)
        boxes(d, look, (w, h * 0.6, 0.4, 0, h * 0.3 + 0.15, 0), (w * 1.1, 0.04, 0.46, 0, h * 0.6 + 0.16, 0))
        boxes(d, look, *((0.05, 0.16, 0.36, sx * w * 0.4, 0.08, 0) for sx in SIDES))
        boxes(d, plain((0.15, 0.06, 0.03), 0.8), (w * 0.8, h * 0.4, 0.02, 0, h * 0.35 + 0.15, 0.2))
        d.cylinder(0.075, draw.between(1.0, 1.5), (0, h * 0.6 + 0.15, -0.05), look)
        _fire(d, draw, w * 0.7, h * 0.2 + 0.15, 0.2, 0.01)
        return d
    low, top = (0.45, draw.between(0.75, 0.9)) if flat else (0.08, h - 0.3)
    wide, head, brick = (
        w * (0.8 if flat else 0.56),
        draw.between(1.2, 2.3) if flat else h,
        draw.chance(0.4) and not flat,
    )
    look = draw.body() if draw.chance(0.3) and not flat else plain(draw.colour(0.2, 0.5, 0.95), 0.2)
    rows, side, out = 10 if brick else 1, (w - wide) / 2, 0.0 if flat else 0.15
    boxes(d, plain((0.07, 0.06, 0.06)), (wide, top - low, 0.02, 0, (top + low) / 2, -z + 0.01))
    boxes(
        d,
        look,
        (w, head - top, 2 * z, 0, (head + top) / 2, 0),
        (w + out, low, 2 * (z + out), 0, low / 2, out),
    )
    for k in range(2 * rows):
        tone, each, x = (
            plain((draw.between(0.45, 0.65), 0.26, 0.19)),
            (top - low) / rows,
            (w - side) / 2 * (k % 2 * 2 - 1),
        )
        boxes(
            d, tone if brick else look, (side, each - 0.01 * brick, 2 * z, x, low + each * (k // 2 + 0.5), 0)
        )
    if not flat:
        boxes(d, draw.wooden() if brick else look, (w + 0.16, 0.06, 2 * z + 0.12, 0, h, 0.05))
        boxes(d, look, (w * 0.8, tall := draw.one_of((0.02, 0.9)), z * 1.6, 0, h + tall / 2, -z * 0.2))
    _fire(d, draw, wide * 0.8, low, 0, 0.06)
    return d
