"""Makers of beds (see `makers.common`).

Metres, y up, front +z.
"""

import numpy as np

from langflash_core.lab.rooms.makers.furniture import plain_bed
from langflash_core.lab.rooms.makers.kit import (
    BRASS,
    DARK,
    LINEN,
    QUARTER,
    RUBBER,
    SIDES,
    WHITE,
    Design,
    Draw,
    Face,
    Look,
    across,
    ball,
    grid_triangles,
    lathe,
    merge,
    pad,
    panels,
    plain,
    polar,
    rounded,
    shifted,
    slab,
    spread,
    turned,
    vivid,
)


def _bedding(
    d: Design, draw: Draw, size: tuple[float, float], foot: float, tall: float, pillows: int
) -> None:
    """Mattress, pillows, a blanket turned down, and what lies on it; the head at the back."""
    wide, long = size
    top, sheet, cover = foot + tall, LINEN if draw.chance(0.6) else draw.cloth(), draw.cloth()
    pad(d, (wide * 0.98, tall, long * 0.98), (0, foot + tall / 2, 0), sheet, 0.06)
    for k in range(pillows):
        x, tilt = (k - (pillows - 1) / 2) * wide * 0.48, draw.between(0.1, 0.9)
        pillow = rounded((min(0.7, wide * 0.46), 0.15, 0.44), (0, 0, 0), 3.0, 8)
        shape = shifted(turned(pillow, 0, -tilt), (x, top + 0.08 + 0.1 * tilt, -long / 2 + 0.27))
        d.add(shape, LINEN if draw.chance(0.6) else cover)
    if draw.chance(0.85):
        edge = draw.between(-0.22, 0.15) * long
        reach = long / 2 + 0.02 - edge
        hang = draw.between(0.5, 1.0) * tall
        pad(d, (wide * 1.05, hang + 0.05, reach), (0, top + 0.04 - hang / 2, edge + reach / 2), cover, 0.06)
        finish = LINEN if draw.chance(0.6) else draw.cloth()
        pad(d, (wide * 1.06, 0.06, 0.3), (0, top + 0.07, edge + 0.12), finish, 0.03)
    if draw.chance(0.4):
        extent = (wide * 1.08, tall * 0.7, draw.between(0.35, 0.6))
        pad(d, extent, (0, top + 0.06 - tall * 0.28, long * 0.3), draw.cloth(), 0.05)
    for _ in range(draw.count(0, 3) if pillows > 1 else 0):
        side = draw.between(0.32, 0.45)
        cushion = turned(rounded((side, side, 0.14), (0, 0, 0), 3.0, 8), 0, -draw.between(0.3, 0.7))
        place = (draw.between(-0.3, 0.3) * wide, top + side * 0.45, -long / 2 + draw.between(0.45, 0.6))
        d.add(shifted(cushion, place), draw.cloth())


def bed(draw: Draw) -> Design:
    """Mostly plain; else four-poster, iron, upholstered, with drawers, for children, for the day, round."""
    if draw.chance(0.69):
        return plain_bed(draw)
    double = (_four_poster, _iron_bed, _iron_bed, _padded_bed, _padded_bed, _storage_bed, _storage_bed)
    return draw.one_of((*double, _childs_bed, _day_bed, _round_bed))(draw)


def _bed_size(draw: Draw) -> tuple[float, float, int]:
    """Width, length and pillows."""
    if draw.chance(0.7):
        return draw.between(1.4, 1.9), draw.between(1.95, 2.1), 2
    return draw.between(0.85, 1.1), draw.between(1.9, 2.05), 1


def _four_poster(draw: Draw) -> Design:
    d = Design("four-poster bed", "bed", ("canopy bed",))
    wide, long, pillows = _bed_size(draw)
    look, cloth, tall = draw.legs(), draw.cloth(), draw.between(1.85, 2.15)
    round_posts, thick = draw.chance(0.5), draw.between(0.03, 0.05)
    for sx in SIDES:
        for sz in SIDES:
            x, z = sx * (wide / 2 + 0.02), sz * (long / 2 + 0.02)
            if round_posts:
                post = (
                    (thick, 0),
                    (thick * 1.3, 0.2),
                    (thick, 0.5),
                    (thick * 1.5, 0.75),
                    (thick * 0.7, 0.85),
                    (thick * 0.6, tall),
                )
                d.add(lathe(post, (x, 0, z), 10), look)
            else:
                d.box((1.5 * thick, tall, 1.5 * thick), (x, tall / 2, z), look)
        d.box((0.04, 0.05, long), (sx * (wide / 2 + 0.02), tall, 0), look)
        d.box((0.05, 0.22, long), (sx * (wide / 2 + 0.02), 0.33, 0), look)
        d.box((wide, 0.05, 0.04), (0, tall, sx * (long / 2 + 0.02)), look)
    d.box((wide, 0.3, 0.04), (0, 0.35, long / 2 + 0.02), look)
    d.box((wide, draw.between(0.6, 0.9), 0.04), (0, 0.65, -long / 2 - 0.02), look)
    if draw.chance(0.6):
        for sx in SIDES:
            for sz in (-1, 1)[: draw.count(1, 2)]:
                place = (sx * (wide / 2 + 0.03), tall / 2 + 0.03, sz * (long / 2 - 0.1))
                pad(d, (0.14, tall - 0.1, 0.2), place, cloth, 0.05)
        d.box((wide + 0.1, draw.between(0.08, 0.25), long + 0.1), (0, tall - 0.02, 0), cloth)
    _bedding(d, draw, (wide, long), 0.32, draw.between(0.2, 0.3), pillows)
    return d


def _iron_board(d: Design, draw: Draw, wide: float, tall: float, z: float, arched: bool, look: Look) -> None:
    low = 0.35
    if arched:
        top = [(wide / 2 * np.cos(a), tall - 0.25 + 0.25 * np.sin(a), z) for a in spread(0, np.pi, 9)]
    else:
        top = [(wide / 2, tall, z), (-wide / 2, tall, z)]
    d.tube(top, 0.018, look, 6)
    d.tube(((-wide / 2, low, z), (wide / 2, low, z)), 0.014, look, 6)
    for s in SIDES:
        d.tube(((s * wide / 2, 0, z), (s * wide / 2, tall - 0.25 * arched, z)), 0.02, look, 6)
        place = (s * wide / 2, tall - 0.25 * arched + 0.02, z)
        ball(d, (0.06, 0.06, 0.06), place, BRASS if draw.chance(0.5) else look, 5)
    for x in spread(-wide / 2, wide / 2, draw.count(6, 11))[1:-1]:
        high = tall - 0.25 + 0.25 * np.sqrt(max(0.0, 1 - (2 * x / wide) ** 2)) if arched else tall
        d.tube(((x, low, z), (x, high, z)), 0.008, look, 5)


def _iron_bed(draw: Draw) -> Design:
    d = Design("iron bed", "bed", ("metal bed",))
    wide, long, pillows = _bed_size(draw)
    look, arched = draw.metal() if draw.chance(0.6) else WHITE, draw.chance(0.6)
    _iron_board(d, draw, wide, draw.between(0.95, 1.25), -long / 2 - 0.03, arched, look)
    if draw.chance(0.75):
        _iron_board(d, draw, wide, draw.between(0.65, 0.85), long / 2 + 0.03, arched, look)
    else:
        for s in SIDES:
            d.tube(((s * wide * 0.48, 0, long * 0.48), (s * wide * 0.48, 0.34, long * 0.48)), 0.02, look, 6)
    for s in SIDES:
        d.box((0.03, 0.05, long), (s * wide / 2, 0.34, 0), look)
    _bedding(d, draw, (wide, long), 0.34, draw.between(0.18, 0.28), pillows)
    return d


def _padded_bed(draw: Draw) -> Design:
    d = Design("upholstered bed", "bed", ("box spring bed",))
    wide, long, pillows = _bed_size(draw)
    look, tall, base = draw.upholstery(), draw.between(1.0, 1.5), draw.between(0.3, 0.42)
    pad(d, (wide + 0.06, base - 0.06, long), (0, base / 2 + 0.03, 0), look, 0.04)
    for sx in SIDES:
        for sz in SIDES:
            d.cylinder(0.03, 0.08, (sx * wide * 0.45, 0, sz * long * 0.46), DARK)
    z, style, broad = -long / 2 - 0.06, draw.style(4), wide + draw.between(0.06, 0.4)
    if style == 0:
        many = draw.count(3, 6)
        for k in range(many):
            place = (-broad / 2 + (k + 0.5) * broad / many, tall / 2 + 0.05, z)
            pad(d, (broad / many * 0.99, tall - 0.1, 0.12), place, look, 0.05)
    elif style == 1:
        rows, columns = draw.count(2, 3), draw.count(3, 5)
        high = (tall - base) / rows
        for k in range(rows * columns):
            x = -broad / 2 + (k % columns + 0.5) * broad / columns
            pad(d, (broad / columns, high, 0.14), (x, base + (k // columns + 0.5) * high, z), look, 0.06)
        d.box((broad, base, 0.1), (0, base / 2, z), look)
    elif style == 2:
        half = ((1, 0), (1, 0.7), (0.8, 0.75), (0.6, 0.9), (0.3, 0.98), (0.02, 1))
        d.add(slab(half, (broad, tall, 0.12), (0, 0, z)), look)
    else:
        pad(d, (broad, tall - 0.05, 0.12), (0, tall / 2 + 0.02, z), look, 0.05)
        for s in SIDES:
            pad(d, (0.08, tall - 0.05, 0.3), (s * (broad / 2 + 0.03), tall / 2 + 0.02, z + 0.1), look, 0.035)
    _bedding(d, draw, (wide, long), base, draw.between(0.2, 0.32), pillows)
    return d


def _storage_bed(draw: Draw) -> Design:
    d = Design("platform bed", "bed", ("storage bed", "bed with drawers"))
    wide, long, pillows = _bed_size(draw)
    look, base = draw.body(), draw.between(0.24, 0.4)
    drawers = draw.chance(0.6)
    d.box((wide * (1 if drawers else 0.8), base, long), (0, base / 2, 0), look if drawers else DARK)
    if drawers:
        side, metal = Design("", ""), look if draw.chance(0.5) else draw.body()
        panels(side, draw, Face(-long / 2, 0.04, long, base - 0.06, wide / 2), 1, draw.count(2, 3), metal)
        for s in SIDES:
            merge(d, side, lambda t, s=s: turned(t, 1, s * QUARTER))
        panels(d, draw, Face(-wide / 2, 0.04, wide, base - 0.06, long / 2), 1, 2, metal)
    else:
        d.box((wide + 0.24, 0.06, long + 0.14), (0, base + 0.03, 0), look)
        base += 0.06
    style, z = draw.style(3), -long / 2 - 0.03
    if style == 0:
        d.box((wide + 0.9 * (not drawers), draw.between(0.6, 0.95), 0.05), (0, 0.48, z), look)
    elif style == 1:
        tall = draw.between(0.8, 1.1)
        for y in (0.0, tall - 0.3, tall):
            d.box((wide + 0.04, 0.03, 0.25), (0, y + 0.015, z - 0.1), look)
        for x in spread(-wide / 2, wide / 2, 4):
            d.box((0.03, tall, 0.25), (x, tall / 2, z - 0.1), look)
        d.box((wide, tall, 0.02), (0, tall / 2, z + 0.01), look)
    _bedding(d, draw, (wide, long), base, draw.between(0.16, 0.26), pillows)
    return d


def _childs_bed(draw: Draw) -> Design:
    style = draw.style(3)
    d = Design(("children's bed", "house bed", "car bed")[style], "bed", ("kids bed", "toddler bed"))
    wide, long = draw.between(0.75, 0.95), draw.between(1.45, 1.95)
    look = draw.painted() if style < 2 else vivid(draw)
    base = 0.25
    if style == 2:
        for s in SIDES:
            d.box((0.06, 0.38, long), (s * wide / 2, 0.3, 0), look)
            pad(d, (0.07, 0.2, long * 0.35), (s * wide / 2, 0.54, -long * 0.3), look, 0.03)
            for z in (-long * 0.32, long * 0.32):
                d.add(across(0.18, 0.09, (s * (wide / 2 + 0.02), 0.18, z), 0, 16), RUBBER)
                d.add(across(0.1, 0.1, (s * (wide / 2 + 0.02), 0.18, z), 0, 12), WHITE)
            place = (s * wide * 0.33, 0.36, long / 2 + 0.04)
            ball(d, (0.14, 0.14, 0.05), place, plain((0.95, 0.92, 0.7), 0.6), 5)
        d.box((wide, 0.38, 0.06), (0, 0.3, long / 2), look)
        d.box((wide, 0.6, 0.06), (0, 0.4, -long / 2), look)
    else:
        rise = draw.between(1.3, 1.6) if style == 1 else draw.between(0.6, 0.8)
        for s in SIDES:
            for z in SIDES:
                d.box((0.05, rise, 0.05), (s * wide / 2, rise / 2, z * long / 2), look)
                if style == 1:
                    d.tube(((s * wide / 2, rise, z * long / 2), (0, rise + 0.4, z * long / 2)), 0.03, look, 4)
            d.box((0.03, 0.16, long), (s * wide / 2, base, 0), look)
            part = long * (1 if s < 0 else 0.55)
            d.box((0.025, 0.06, part), (s * wide / 2, 0.52, (part - long) / 2), look)
            for z in spread(-long / 2, part - long / 2, draw.count(5, 9))[1:]:
                d.box((0.02, 0.26, 0.03), (s * wide / 2, 0.4, z), look)
            d.box((wide, 0.3, 0.03), (0, 0.4, s * long / 2), draw.painted())
            if style == 1:
                d.box((0.05, 0.05, long), (s * wide / 2, rise, 0), look)
        if style == 1:
            d.box((0.05, 0.05, long), (0, rise + 0.4, 0), look)
    _bedding(d, draw, (wide * 0.92, long * 0.94), base, 0.15, 1)
    return d


def _day_bed(draw: Draw) -> Design:
    """Its long side stands at the wall."""
    d = Design("day bed", "bed", ("daybed", "single bed"))
    long, deep, tall = draw.between(1.95, 2.1), draw.between(0.85, 1.0), draw.between(0.7, 0.95)
    look, iron = draw.legs(), draw.chance(0.4)
    seat = 0.3
    for s in SIDES:
        if iron:
            side = Design("", "")
            _iron_board(side, draw, deep, tall, 0.0, True, look)
            merge(d, side, lambda t, s=s: shifted(turned(t, 1, QUARTER), (s * long / 2, 0, 0)))
        else:
            d.box((0.05, tall, deep), (s * long / 2, tall / 2, 0), look)
    if iron:
        _iron_board(d, draw, long, tall + 0.1, -deep / 2, True, look)
    else:
        d.box((long, tall - 0.15, 0.04), (0, (tall + 0.15) / 2, -deep / 2), look)
    d.box((long, 0.15 if not iron else 0.05, deep), (0, seat - 0.08, 0), look)
    pad(d, (long * 0.97, 0.2, deep * 0.95), (0, seat + 0.1, 0), draw.cloth(), 0.06)
    for x in spread(-long * 0.36, long * 0.36, draw.count(3, 4)):
        cushion = turned(rounded((0.5, 0.42, 0.16), (0, 0, 0), 3.0, 8), 0, -0.25)
        d.add(shifted(cushion, (x, seat + 0.4, -deep / 2 + 0.16)), draw.cloth())
    if draw.chance(0.5):
        place = (draw.between(-0.4, 0.4), seat + 0.19, 0.01)
        pad(d, (draw.between(0.4, 0.8), 0.06, deep), place, draw.cloth(), 0.03)
    return d


def _round_bed(draw: Draw) -> Design:
    d = Design("round bed", "bed", ("circular bed",))
    radius, look, base = draw.between(0.95, 1.12), draw.upholstery(), draw.between(0.22, 0.34)
    d.lathe(((0, 0), (radius, 0.02), (radius + 0.05, 0.1), (radius + 0.05, base), (0, base)), look, 28)
    path = ((radius * 0.96, base), (radius * 0.98, base + 0.12), (radius * 0.92, base + 0.2), (0, base + 0.2))
    d.lathe(path, LINEN, 28)
    tall, cover = draw.between(0.7, 1.0), draw.cloth()
    for a in spread(np.pi * 1.12, np.pi * 1.88, 7):
        cushion = Design("", "")
        place = (0, (tall + base * 0.5) / 2, -radius - 0.05)
        pad(cushion, (radius * 0.45, tall - base * 0.5, 0.14), place, look, 0.06)
        merge(d, cushion, lambda t, a=a: turned(t, 1, -(a - 1.5 * np.pi)))
    arc = np.array([polar(radius * 1.02, a, base + 0.23) for a in spread(-0.25, np.pi + 0.25, 15)])
    head = np.stack([np.linspace(arc[0], arc[-1], 15), arc], 0) + np.array([0, 0, 0.0])
    rim = arc - np.array([0, draw.between(0.12, 0.24), 0])
    d.add(grid_triangles(np.concatenate([head, rim[None]])), cover)
    for s in SIDES:
        pillow = turned(rounded((0.65, 0.15, 0.42), (0, 0, 0), 3.0, 8), 0, -0.4)
        d.add(shifted(pillow, (s * 0.36, base + 0.32, -radius * 0.6)), LINEN if draw.chance(0.6) else cover)
    return d
