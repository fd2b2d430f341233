"""Makers of vases, clocks and cups (see `makers.common`).

Metres, y up, front +z.
"""

from collections.abc import Sequence

import numpy as np

from langflash_core.lab.rooms.makers.kit import (
    BARK,
    BLACK,
    BRASS,
    DARK,
    GLASS,
    LINEN,
    QUARTER,
    SIDES,
    STEEL,
    TURN,
    WHITE,
    Design,
    Draw,
    Look,
    Vector,
    ball,
    box,
    grid_triangles,
    lathe,
    leaflet,
    loft,
    pad,
    plain,
    polar,
    put,
    scaled,
    shifted,
    slab,
    spread,
    torus,
    turned,
    vivid,
)
from langflash_core.lab.rooms.makers.small import plain_clock, plain_cup, plain_vase

_SEGMENTS = {
    0: "abcdef",
    1: "bc",
    2: "abdeg",
    3: "abcdg",
    4: "bcfg",
    5: "acdfg",
    6: "acdefg",
    7: "abc",
    8: "abcdefg",
    9: "abcdfg",
}


def vase(draw: Draw) -> Design:
    """Mostly plain; else square, with handles, jugs, and with branches."""
    if draw.chance(0.71):
        return plain_vase(draw)
    return draw.one_of((_square_vase, _amphora, _jug, _branch_vase, _branch_vase))(draw)


def _square_vase(draw: Draw) -> Design:
    d = Design("square vase", "vase", ("vase",))
    w, tall = draw.between(0.07, 0.14), draw.between(0.16, 0.4)
    look, twist = draw.ceramic(), draw.between(0, 1.0) * draw.chance(0.4)
    profile = draw.one_of(((1.0, 1.0, 1.0), (0.7, 0.85, 1.0), (0.7, 1.1, 0.6), (1.0, 0.8, 1.0)))
    rows = []
    for t, y in ((0.0, 0.0), *((t, t * tall) for t in spread(0, 1, 7)), (1.0, tall), (1.0, tall * 0.3)):
        half = (
            w
            / 2
            * float(np.interp(t, (0, 0.5, 1), profile))
            * (0.85 if len(rows) > 7 else 1.0)
            * (len(rows) > 0)
        )
        a = np.arange(5) * QUARTER + QUARTER / 2 + twist * t
        rows.append(np.stack([1.414 * half * np.cos(a), np.full(5, y), 1.414 * half * np.sin(a)], -1))
    d.add(grid_triangles(np.array(rows)), look)
    return d


def _amphora(draw: Draw) -> Design:
    d = Design("amphora", "vase", ("vase with handles", "urn"))
    tall, r = draw.between(0.25, 0.55), draw.between(0.08, 0.15)
    look = plain((0.7, 0.42, 0.27), 0.1) if draw.chance(0.5) else draw.ceramic()
    shape = (
        (0, 0),
        (0.45, 0),
        (0.35, 0.05),
        (0.75, 0.3),
        (1, 0.58),
        (0.8, 0.75),
        (0.35, 0.84),
        (0.32, 0.94),
        (0.48, 1),
        (0.38, 1),
        (0.25, 0.85),
    )
    d.lathe(scaled(shape, r, tall), look, 20)
    for s in SIDES:
        loop = (
            (s * r * 0.33, tall * 0.93, 0),
            (s * r * 0.8, tall * 0.95, 0),
            (s * r * 0.95, tall * 0.82, 0),
            (s * r * 0.82, tall * 0.7, 0),
        )
        d.tube(loop, r * 0.09, look, 6)
    if draw.chance(0.5):
        band = plain(draw.colour(0.7), 0.3)
        path = ((r * 0.985, tall * 0.52), (r * 1.015, tall * 0.57), (r * 0.975, tall * 0.62))
        d.add(lathe(path, (0, 0, 0), 20), band)
    return d


def _jug(draw: Draw) -> Design:
    d = Design("jug", "vase", ("pitcher", "ewer"))
    tall, r = draw.between(0.18, 0.32), draw.between(0.06, 0.1)
    look = draw.ceramic() if draw.chance(0.8) else draw.metal()
    belly = draw.between(0.25, 0.5)
    path = ((0, 0), (0.75, 0), (1, belly), (0.6, 0.78), (0.72, 1), (0.62, 1), (0.5, 0.8), (0.5, 0.3))
    pitcher = lathe(scaled(path, r, tall), (0, 0, 0), 20)
    lip = np.clip((pitcher[..., 1] / tall - 0.8) / 0.2, 0, 1) * (pitcher[..., 0] > 0.3 * r)
    pitcher[..., 0] += 0.35 * r * lip * np.clip(1 - np.abs(pitcher[..., 2]) / (0.5 * r), 0, 1)
    pitcher[..., 1] += 0.05 * tall * lip
    d.add(pitcher, look)
    handle = (
        (-0.62 * r, tall * 0.9, 0),
        (-1.3 * r, tall * 0.85, 0),
        (-1.45 * r, tall * 0.6, 0),
        (-0.95 * r, tall * 0.38, 0),
    )
    d.tube(handle, 0.1 * r, look, 6)
    return d


def _branch_vase(draw: Draw) -> Design:
    floor = draw.chance(0.35)
    d = Design("vase with branches", "vase", ("vase", "dried flowers"))
    tall, r = (
        (draw.between(0.4, 0.65), draw.between(0.1, 0.16))
        if floor
        else (draw.between(0.16, 0.3), draw.between(0.05, 0.09))
    )
    path = (
        ((0.8, 0), (1, 0.3), (0.4, 0.8), (0.5, 1)),
        ((0.6, 0), (0.95, 0.6), (0.5, 0.9), (0.6, 1)),
        ((0.9, 0), (1, 0.1), (0.35, 0.35), (0.3, 1)),
    )
    shape = draw.one_of(path)
    path = [(0, 0), *scaled(shape, r, tall), (r * 0.2, tall * 0.9)]
    d.lathe(path, draw.ceramic() if draw.chance(0.8) else GLASS, 18)
    kind = draw.style(3)
    tone = plain(draw.one_of(((0.78, 0.65, 0.45), (0.85, 0.78, 0.68), (0.6, 0.35, 0.25), (0.9, 0.9, 0.88))))
    for k in range(draw.count(5, 10)):
        a, out, high = 2.4 * k, tall * draw.between(0.15, 0.6), tall * draw.between(1.6, 2.5)
        tip, middle = polar(out, a, high), polar(out * 0.4, a + 0.3, tall * 1.3)
        d.tube(((0, tall * 0.8, 0), middle, tip), 0.004 if not floor else 0.006, BARK, 4)
        if kind == 0:
            spot = (
                tuple(np.array(tip) * 0.75 + np.array(middle) * 0.25),
                tip,
                polar(out * 1.25, a, high + tall * 0.25),
            )
            plume = loft(spot, (tall * 0.04, tall * 0.06, tall * 0.015), 8)
            d.add(plume, tone)
        elif kind == 1:
            for t in spread(0.1, 1.0, 5):
                place = tuple(
                    (np.array(middle) * (1 - t) + np.array(tip) * t + draw.rng.normal(0, 0.012, 3)).tolist()
                )
                ball(d, (0.025, 0.028, 0.025), place, tone, 3)
        else:
            twig = polar(out * 1.5, a + 0.5, high * 0.92)
            d.tube((tuple((np.array(middle) + np.array(tip)) / 2), twig), 0.003, BARK, 4)
            path = (
                tuple(np.array(middle) * 0.3 + np.array(tip) * 0.7),
                polar(out * 0.6, a - 0.4, high * 1.02),
            )
            d.tube(path, 0.003, BARK, 4)
    return d


def clock(draw: Draw) -> Design:
    """Mostly plain; else alarm, grandfather, mantel, square, cuckoo, digital."""
    if draw.chance(0.6):
        return plain_clock(draw)
    many = (_alarm_clock, _alarm_clock, _grandfather_clock, _mantel_clock, _square_clock, _square_clock)
    return draw.one_of((*many, _cuckoo_clock, _digital_clock))(draw)


def _dial(d: Design, draw: Draw, radius: float, at: Vector, face: Look, square: bool = False) -> None:
    """A face that looks forwards, with hours and hands."""
    (x, y, z), hands = at, BLACK if face is not DARK else WHITE
    if square:
        d.box((2 * radius, 2 * radius, 0.004), (x, y, z), face)
    else:
        d.roll(radius, 0.004, (x, y, z - 0.002), face, 20)
    mark = box((0.05 * radius, 0.14 * radius, 0.002), (0, 0.86 * radius, 0))
    for hour in range(12):
        d.add(shifted(turned(mark, 2, hour * np.pi / 6), (x, y, z + 0.003)), hands)
    for long, wide in ((0.5, 0.08), (0.78, 0.05)):
        hand = box((wide * radius, radius * long, 0.002), (0, radius * long / 2, 0))
        d.add(shifted(turned(hand, 2, draw.between(0, TURN)), (x, y, z + 0.006)), hands)


def _clock_face(draw: Draw) -> Look:
    return draw.one_of((WHITE, WHITE, LINEN, DARK, plain(draw.colour(0.5, 0.6))))


def _alarm_clock(draw: Draw) -> Design:
    d = Design("alarm clock", "clock", ("bedside clock",))
    r, look = draw.between(0.045, 0.075), draw.metal() if draw.chance(0.4) else vivid(draw)
    if draw.chance(0.3):
        pad(d, (2.2 * r, 2.2 * r, r), (0, 1.1 * r, 0), look, 0.4 * r)
        _dial(d, draw, 0.85 * r, (0, 1.1 * r, 0.5 * r), _clock_face(draw), draw.chance(0.5))
        d.box((r, 0.2 * r, 0.4 * r), (0, 2.25 * r, 0), DARK)
        return d
    y = 1.3 * r
    d.roll(r, 0.8 * r, (0, y, -0.4 * r), look, 20)
    d.add(torus(0.96 * r, 0.07 * r, (0, y, 0.4 * r), 2), STEEL if draw.chance(0.5) else look)
    _dial(d, draw, 0.88 * r, (0, y, 0.41 * r), _clock_face(draw))
    for s in SIDES:
        bell = lathe(((0.45 * r, 0), (0.4 * r, 0.2 * r), (0, 0.32 * r)), segments=12)
        shape = shifted(turned(bell, 2, -s * 0.6), (s * 0.62 * r, y + 0.92 * r, 0))
        d.add(shape, BRASS if draw.chance(0.4) else STEEL)
        d.tube(((s * 0.5 * r, y - 0.8 * r, 0), (s * 0.8 * r, 0, 0.1 * r)), 0.09 * r, STEEL, 6)
    path = [(0.35 * r * np.cos(a), y + 1.25 * r + 0.3 * r * np.sin(a), 0) for a in spread(0, np.pi, 5)]
    d.tube(path, 0.05 * r, STEEL, 5)
    d.box((0.1 * r, 0.35 * r, 0.1 * r), (0, y + 1.1 * r, 0), STEEL)
    return d


def _grandfather_clock(draw: Draw) -> Design:
    d = Design("grandfather clock", "clock", ("longcase clock", "floor clock"), elevation=0.03)
    wood, w = draw.wooden(), draw.between(0.4, 0.52)
    tall, deep = draw.between(1.75, 2.1), draw.between(0.24, 0.3)
    d.box((w, tall * 0.22, deep), (0, tall * 0.11, 0), wood)
    d.box((w * 1.08, 0.06, deep * 1.08), (0, 0.03, 0), wood)
    d.box((w * 0.74, tall * 0.5, deep * 0.8), (0, tall * 0.45, 0), wood)
    d.box((w, tall * 0.24, deep), (0, tall * 0.79, 0), wood)
    for y in (tall * 0.225, tall * 0.67, tall * 0.91):
        d.box((w * 1.06, 0.035, deep * 1.06), (0, y, 0), wood)
    d.box((w * 0.5, tall * 0.38, 0.01), (0, tall * 0.46, deep * 0.4), plain((0.1, 0.08, 0.07), 0.7))
    d.tube(((0, tall * 0.62, deep * 0.41), (0, tall * 0.35, deep * 0.41)), 0.008, BRASS, 5)
    d.roll(0.07, 0.012, (draw.between(-0.03, 0.03), tall * 0.34, deep * 0.41), BRASS, 16)
    for s in SIDES:
        d.cylinder(0.02, 0.16, (s * 0.07, tall * draw.between(0.42, 0.52), deep * 0.41), BRASS)
    _dial(d, draw, w * 0.38, (0, tall * 0.79, deep * 0.5 + 0.005), LINEN if draw.chance(0.6) else BRASS)
    top = (
        ((1, 0), (0.95, 0.3), (0.6, 0.45), (0.4, 0.9), (0.1, 1)) if draw.chance(0.5) else ((1, 0), (0.02, 1))
    )
    d.add(slab(top, (w, draw.between(0.1, 0.18), deep * 0.8), (0, tall * 0.92, 0)), wood)
    return d


def _mantel_clock(draw: Draw) -> Design:
    d = Design("mantel clock", "clock", ("table clock",))
    wood = draw.wooden() if draw.chance(0.7) else draw.one_of((BRASS, BLACK, draw.ceramic()))
    w = draw.between(0.16, 0.4)
    tall, deep = draw.between(0.15, 0.24), draw.between(0.07, 0.11)
    path = (
        ((1, 0), (1, 0.3), (0.7, 0.45), (0.55, 0.75), (0.4, 0.92), (0.15, 1)),
        ((0.8, 0), (0.8, 0.6), (0.7, 0.83), (0.45, 0.96), (0.1, 1)),
        ((0.8, 0), (0.8, 0.75), (0.05, 1)),
    )
    half = draw.one_of(path)
    d.add(slab(half, (w, tall, deep), (0, 0.02, 0)), wood)
    d.box((w * 1.08, 0.025, deep * 1.2), (0, 0.012, 0), wood)
    r = min(w * 0.33, tall * 0.36)
    d.add(torus(r, 0.006, (0, tall * 0.5, deep / 2), 2), BRASS)
    _dial(d, draw, r, (0, tall * 0.5, deep / 2 + 0.003), LINEN)
    return d


def _square_clock(draw: Draw) -> Design:
    d = Design("square wall clock", "clock", ("wall clock",), elevation=1.6)
    r, look, style = draw.between(0.11, 0.2), draw.body() if draw.chance(0.6) else vivid(draw), draw.style(3)
    if style == 0:
        pad(d, (2 * r, 2 * r, 0.04), (0, r, 0), look, 0.03)
        _dial(d, draw, r * 0.86, (0, r, 0.021), _clock_face(draw), draw.chance(0.6))
    elif style == 1:
        face = ((0.4, 0), (1, 0.3), (1, 0.7), (0.4, 1))
        d.add(slab(face, (2 * r, 2 * r, 0.035)), look)
        _dial(d, draw, r * 0.8, (0, r, 0.019), _clock_face(draw))
    else:
        for k in range(12):
            ray = box((0.02 * (1 + k % 2), r * (0.9 if k % 2 else 0.6), 0.012), (0, r * 1.1, 0))
            d.add(shifted(turned(ray, 2, k * np.pi / 6), (0, r * 1.6, 0)), look)
        d.roll(r * 0.75, 0.03, (0, r * 1.6, -0.015), look, 20)
        _dial(d, draw, r * 0.68, (0, r * 1.6, 0.018), _clock_face(draw))
    return d


def _cuckoo_clock(draw: Draw) -> Design:
    d = Design("cuckoo clock", "clock", ("wall clock",), elevation=1.3)
    wood, dark = draw.wooden(), plain((0.22, 0.12, 0.06), 0.2)
    w, tall = draw.between(0.22, 0.3), draw.between(0.24, 0.32)
    foot = draw.between(0.3, 0.45)
    d.box((w, tall, 0.14), (0, foot + tall / 2, 0), wood)
    rise = w * 0.45
    d.add(slab(((1, 0), (0.02, 1)), (w, rise, 0.12), (0, foot + tall, 0)), wood)
    slope, angle = np.hypot(w / 2, rise) + 0.06, np.arctan2(rise, w / 2)
    for s in SIDES:
        roof = turned(box((slope, 0.022, 0.22), (0, 0, 0)), 2, -s * angle)
        d.add(shifted(roof, (s * (w / 4 + 0.01), foot + tall + rise / 2, 0.01)), dark)
        d.tube(((s * 0.05, foot, 0), (s * 0.05, 0.12 * (1 + s) / 2 + 0.02, 0)), 0.003, BRASS, 4)
        path = ((s * 0.05, 0.12 * (1 + s) / 2 + 0.1, 0), (s * 0.05, 0.12 * (1 + s) / 2 + 0.02, 0))
        d.add(loft(path, (0.012, 0.02), 7), dark)
        for y in (0.2, 0.55, 0.85):
            leaf = put(leaflet(0.09, 0.05, 0.2, 0.3, 7), 1.2, s * 0.8, (s * w * 0.5, foot + tall * y, 0.07))
            d.add(leaf, dark)
    _dial(d, draw, w * 0.3, (0, foot + tall * 0.42, 0.075), dark if draw.chance(0.3) else LINEN)
    d.box((w * 0.26, w * 0.3, 0.006), (0, foot + tall + rise * 0.2, 0.072), dark)
    ball(d, (0.03, 0.03, 0.06), (0, foot + tall + rise * 0.2, 0.09), plain((0.8, 0.6, 0.2)), 4)
    d.tube(((0, foot, 0.03), (0, foot - 0.2, 0.03)), 0.004, wood, 4)
    d.roll(0.035, 0.008, (0, foot - 0.2, 0.028), dark, 12)
    return d


def _digital_clock(draw: Draw) -> Design:
    d = Design("digital clock", "clock", ("digital alarm clock",))
    w, tall = draw.between(0.13, 0.26), draw.between(0.06, 0.1)
    look = draw.one_of((BLACK, WHITE, draw.wooden(), vivid(draw)))
    pad(d, (w, tall, draw.between(0.05, 0.09)), (0, tall / 2, 0), look, 0.01)
    z = max(float(t[..., 2].max()) for t, _ in d.parts)
    d.box((w * 0.88, tall * 0.72, 0.002), (0, tall / 2, z), BLACK)
    glow = plain(draw.one_of(((0.95, 0.15, 0.1), (0.2, 0.9, 0.4), (0.3, 0.7, 0.95), (0.95, 0.95, 0.9))), 0.5)
    h, unit = tall * 0.46, w * 0.12
    for k, digit in enumerate((draw.style(3), draw.style(4), draw.style(6), draw.style(10))):
        x = (k - 1.5) * w * 0.19 + (0.02 if k > 1 else -0.02) * w
        spots = {
            "a": (0, 1),
            "d": (0, -1),
            "g": (0, 0),
            "b": (1, 0.5),
            "c": (1, -0.5),
            "f": (-1, 0.5),
            "e": (-1, -0.5),
        }
        for name in _SEGMENTS[digit]:
            u, v = spots[name]
            size = (unit, h * 0.1, 0.002) if u == 0 else (h * 0.1, h * 0.42, 0.002)
            d.box(size, (x + u * unit / 2, tall / 2 + v * h / 2, z + 0.001), glow)
    for v in SIDES:
        d.box((h * 0.1, h * 0.1, 0.002), (0, tall / 2 + v * h * 0.25, z + 0.001), glow)
    return d


def cup(draw: Draw) -> Design:
    """Mostly plain; else glasses for wine, water and beer, and small cups on saucers."""
    if draw.chance(0.6):
        return plain_cup(draw)
    return draw.one_of(
        (_wine_glass, _wine_glass, _tumbler, _beaker, _espresso_cup, _espresso_cup, _beer_mug, _glass_set)
    )(draw)


def _glass_at(
    d: Design, profile: Sequence[tuple[float, float]], at: Vector, fill: float, drink: Look | None
) -> None:
    """A glass of this outline whose bowl begins at its height `fill`, perhaps with a drink."""
    top = profile[-1]
    d.add(lathe([*profile, (top[0] * 0.94, top[1])], at, 14), GLASS)
    if drink is not None:
        high = fill + (top[1] - fill) * 0.55
        outline = [(0.0, fill + 0.002), *[(r * 0.92, y) for r, y in profile if fill + 0.003 < y < high]]
        rim = float(np.interp(high, [y for _, y in profile], [r for r, _ in profile])) * 0.92
        d.add(lathe([*outline, (rim, high), (0, high)], at, 12), drink)


def _drink(draw: Draw) -> Look | None:
    tones = ((0.4, 0.05, 0.1), (0.9, 0.8, 0.4), (0.85, 0.5, 0.1), (0.9, 0.55, 0.5))
    return plain(draw.one_of(tones), 0.6, opacity=0.85) if draw.chance(0.5) else None


def _stemmed(draw: Draw) -> list[tuple[float, float]]:
    """Wine, champagne or cocktail."""
    tall, r = draw.between(0.16, 0.23), draw.between(0.03, 0.045)
    path = (
        ((0.7, 0.55), (1, 0.7), (0.95, 0.85), (0.75, 1)),
        ((0.45, 0.5), (0.55, 0.75), (0.5, 1)),
        ((0.6, 0.65), (1.3, 1)),
    )
    bowl = draw.one_of(path)
    return [
        (0, 0),
        (0.85 * r, 0.002),
        (0.1 * r, 0.012),
        (0.08 * r, 0.46 * tall),
        *((a * r, b * tall) for a, b in bowl),
    ]


def _wine_glass(draw: Draw) -> Design:
    d = Design("wine glass", "cup", ("glass", "stemmed glass"))
    outline = _stemmed(draw)
    _glass_at(d, outline, (0, 0, 0), outline[3][1], _drink(draw))
    return d


def _tumbler(draw: Draw) -> Design:
    d = Design("glass", "cup", ("tumbler", "drinking glass"))
    r, tall = draw.between(0.032, 0.042), draw.between(0.08, 0.15)
    _glass_at(d, [(0, 0), (r * draw.between(0.75, 1), 0), (r, tall)], (0, 0, 0), 0.008, _drink(draw))
    d.cylinder(r * 0.72, 0.008, (0, 0.001, 0), plain((0.85, 0.9, 0.9), 0.9, opacity=0.5))
    if draw.chance(0.25):
        d.tube(((0, 0.01, 0), (r * 0.9, tall * 1.4, 0)), 0.003, vivid(draw), 5)
    return d


def _beaker(draw: Draw) -> Design:
    d = Design("beaker", "cup", ("cup", "mug"))
    r, tall = draw.between(0.035, 0.045), draw.between(0.08, 0.17)
    look, band = vivid(draw) if draw.chance(0.6) else draw.ceramic(), vivid(draw)
    d.lathe(scaled(((0, 0), (0.72, 0), (1, 1), (0.92, 1), (0.66, 0.1), (0, 0.08)), r, tall), look, 18)
    for y in spread(0.25, 0.75, draw.count(1, 3)):
        w = r * (0.72 + 0.28 * y) + 0.0008
        d.lathe(((w, y * tall), (w + 0.02 * r, (y + 0.08) * tall)), band, 18)
    if draw.chance(0.35):
        d.lathe(
            scaled(((1.05, 0.97), (1.05, 1.06), (0, 1.1)), r, tall), DARK if draw.chance(0.5) else band, 18
        )
        if draw.chance(0.5):
            d.tube(((0, tall, 0), (0.01, tall * 1.5, 0)), 0.003, WHITE, 5)
    return d


def _espresso_cup(draw: Draw) -> Design:
    d = Design("cup and saucer", "cup", ("espresso cup", "tea cup"))
    s, look = draw.between(0.8, 1.35), draw.ceramic()
    d.lathe(
        scaled(((0, 0), (0.045, 0), (0.07, 0.014), (0.066, 0.014), (0.04, 0.005), (0, 0.005)), s, s), look, 20
    )
    path = (
        ((0.02, 0), (0.032, 0.045)),
        ((0.018, 0), (0.034, 0.015), (0.036, 0.05)),
        ((0.016, 0), (0.028, 0.02), (0.045, 0.042)),
    )
    shape = draw.one_of(path)
    cup = [(0.0, 0.0), *shape, (shape[-1][0] * 0.92, shape[-1][1]), (shape[-1][0] * 0.85, shape[-1][1] * 0.8)]
    d.add(lathe(scaled(cup, s, s), (0, 0.006 * s, 0), 18), look)
    top, r = shape[-1][1] * s, shape[-1][0] * s
    d.cylinder(r * 0.88, 0.002, (0, 0.006 * s + top * 0.82, 0), plain((0.25, 0.14, 0.07), 0.5))
    path = [
        (r * 0.88 + 0.02 * s * np.sin(a), 0.006 * s + top * (0.55 + 0.28 * np.cos(a)), 0)
        for a in spread(0, np.pi, 6)
    ]
    d.tube(path, 0.004 * s, look, 6)
    if draw.chance(0.5):
        d.tube(((-0.05 * s, 0.016 * s, 0.045 * s), (0.055 * s, 0.018 * s, 0.045 * s)), 0.003, STEEL, 5)
        ball(d, (0.022 * s, 0.005, 0.014 * s), (-0.05 * s, 0.016 * s, 0.045 * s), STEEL, 4)
    return d


def _beer_mug(draw: Draw) -> Design:
    d = Design("beer mug", "cup", ("beer glass", "stein"))
    r, tall = draw.between(0.04, 0.055), draw.between(0.12, 0.17)
    stone = draw.chance(0.3)
    look = draw.ceramic() if stone else plain((0.85, 0.89, 0.88), 0.9, opacity=0.3)
    path = ((0, 0), (1, 0), (1.0, 0.1), (0.94, 0.5), (1, 1), (0.9, 1), (0.85, 0.12), (0, 0.1))
    d.lathe(scaled(path, r, tall), look, 16)
    if not stone:
        high = draw.between(0.6, 0.85)
        path = scaled(((0, 0.11), (0.83, 0.11), (0.85, high), (0, high)), r, tall)
        d.lathe(path, plain((0.85, 0.55, 0.1), 0.6, opacity=0.9), 14)
        d.lathe(
            scaled(((0.85, high), (0.86, 1.04), (0.4, 1.1), (0, 1.1)), r, tall), plain((0.96, 0.94, 0.88)), 14
        )
    path = (
        (r * 0.95, tall * 0.85, 0),
        (r * 1.6, tall * 0.85, 0),
        (r * 1.7, tall * 0.3, 0),
        (r * 0.95, tall * 0.18, 0),
    )
    d.tube(path, 0.007, look, 7)
    return d


def _glass_set(draw: Draw) -> Design:
    d = Design("set of glasses", "cup", ("glasses", "drinking glasses"))
    outline = (
        _stemmed(draw) if draw.chance(0.5) else [(0.0, 0.0), (0.032, 0.0), (0.036, draw.between(0.09, 0.14))]
    )
    fill, drink = (outline[3][1] if len(outline) > 4 else 0.008), _drink(draw)
    pitch, many = 2.4 * max(r for r, _ in outline), draw.count(3, 6)
    if draw.chance(0.5):
        d.box((pitch * 3.1, 0.012, pitch * 2.1), (0, 0.006, 0), draw.body())
    for k in range(many):
        jitter = draw.between(-0.006, 0.006)
        at = ((k % 3 - 1) * pitch + jitter, 0.012, (k // 3 - 0.5) * pitch + jitter)
        _glass_at(d, outline, at, fill, drink)
    return d
