"""Makers of what bathrooms and cleaning need (see `makers.common`). Metres, y up, front +z."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from langflash_core.lab.rooms.builtin import KIND_FABRIC, KIND_MIRROR, KIND_RUG
from langflash_core.lab.rooms.makers.kit import (
    BLACK,
    DARK,
    SIDES,
    STEEL,
    WHITE,
    Design,
    Draw,
    Look,
    Material,
    Triangles,
    grid_triangles,
    lathe,
    plain,
    rounded,
    scaled,
    shifted,
    turned,
)

_PAPER = plain((0.95, 0.94, 0.92))
_GOLD = plain((0.78, 0.62, 0.33), 0.7)
_RED = plain((0.7, 0.07, 0.12), 0.4)
_STRAW = plain((0.78, 0.63, 0.36))


def _turn(d: Design, axis: int, angle: float, lift: float = 0.0) -> None:
    """Turn all that is made so far, then lift it."""
    d.parts = [(shifted(turned(part, axis, angle), (0, lift, 0)), look) for part, look in d.parts]


def _draped(path: Sequence[tuple[float, float]], width: float, thick: float) -> Triangles:
    """A thick sheet that follows a path of (z, y), `width` wide along x."""
    points = np.array(path, dtype=float)
    along = np.gradient(points, axis=0)
    normal = np.stack([-along[:, 1], along[:, 0]], 1) / np.linalg.norm(along, axis=1, keepdims=True)
    over, under = points + normal * thick / 2, points - normal * thick / 2
    rim = np.concatenate([over, under[::-1], over[:1]])
    sides = [np.column_stack([np.full(len(rim), sx * width / 2), rim[:, ::-1]]) for sx in SIDES]
    caps = [grid_triangles(np.stack([s[: len(points)], s[len(points) : -1][::-1]])) for s in sides]
    return np.concatenate([grid_triangles(np.stack(sides)), *caps])


def _hang(d: Design, draw: Draw, x: float, y: float, z: float, width: float, long: float, angle=0.0) -> None:
    """A cloth over a bar at x, y, z."""
    arc = [(-0.014 * np.cos(t), 0.014 * np.sin(t)) for t in np.linspace(0, np.pi, 5)]
    cloth = _draped(((-0.014, -long * draw.between(0.5, 1)), *arc, (0.022, -long)), width, 0.012)
    d.add(shifted(turned(cloth, 1, angle), (x, y, z)), draw.cloth())


def _folded(width: float, depth: float, foot: float, layers: int, pitch: float) -> Triangles:
    """A cloth folded to and fro, its last fold in front."""
    path: list[tuple[float, float]] = []
    for k in range(layers):
        side, y = (layers - k) % 2 * -2 + 1, foot + (k + 0.5) * pitch
        path += [(-side * depth / 2, y), (side * depth / 2, y), (side * (depth + pitch) / 2, y + pitch / 2)]
    return _draped(path[:-1], width, pitch * 0.9)


def towel(draw: Draw) -> Design:
    """Folded, in a stack, rolled up, or over a little stand."""
    style = draw.style(4)
    d = Design("towels" if style == 1 else "towel", "towel", ("bath towel", "hand towel"))
    width, depth, foot, look = draw.between(0.24, 0.45), draw.between(0.18, 0.32), 0.0, draw.cloth()
    coil = [(a * np.cos(a), 19 + a * np.sin(a)) for a in np.linspace(3, 19, 34)]
    for k in range((1, draw.count(2, 5), draw.one_of((1, 3)), 0)[style]):
        layers, pitch = draw.count(2, 4), draw.between(0.014, 0.026)
        cloth = _folded(width * draw.between(0.92, 1), depth * draw.between(0.92, 1), foot, layers, pitch)
        if style == 2:
            roll = _draped(scaled(coil, depth / 80, depth / 80), width, depth * 0.07)
            cloth = shifted(roll, (0, depth * (k == 2) * 0.44, depth * (0, 0.52, 0.26)[k]))
        d.add(cloth, look)
        foot, look = foot + layers * pitch, draw.cloth() if draw.chance(0.6) else look
    if style == 3:
        tall, metal = draw.between(0.34, 0.5), draw.metal()
        d.cylinder(draw.between(0.07, 0.1), 0.015, (0, 0, 0), metal)
        d.tube(((0, 0, 0), (0, tall, 0), (-width / 2, tall, 0), (width / 2, tall, 0)), 0.007, metal)
        _hang(d, draw, 0, tall, 0, width * 0.85, tall * draw.between(0.6, 0.9))
    _turn(d, 1, np.pi / 2 if style == 2 else draw.between(-0.1, 0.1))
    return d


def towel_rack(draw: Draw) -> Design:
    """One to three bars, a ladder that heats, or a shelf of bars; most with a towel."""
    style, metal = draw.style(3), draw.metal()
    d = Design(("towel rack", "towel warmer", "towel shelf")[style], "towel rack", ("towel bar",))
    width, depth = draw.between(0.4, 0.7), draw.between(0.07, 0.12)
    gap = draw.between(0.05, 0.07) if style else 0.11
    bars = [(0.12, 0.05 + 0.05 * k) for k in range(5)] + [(0.0, depth)]
    if style < 2:
        many, skip = (draw.count(1, 3), 99) if style == 0 else (draw.count(12, 22), draw.count(4, 6))
        bars = [(k * gap, depth + 0.03 * k * (style == 0)) for k in range(many) if (k + 1) % skip]
    top = max(y for y, _ in bars) + 0.04
    for y, z in bars:
        d.tube(((-width / 2, y, z), (width / 2, y, z)), 0.011 if style == 1 else 0.008, metal, 6)
    for x in (-width / 2, width / 2):
        for y, z in bars[:: 5 if style == 1 else 1]:
            d.tube(((x, y, 0), (x, y, z)), 0.008, metal, 6)
        d.box((0.03, top + 0.03, 0.025), (x, top / 2 - 0.02, depth if style == 1 else 0.0), metal)
    d.elevation = (1.1, 0.45, 1.45)[style]
    if style == 2 and draw.chance(0.7):
        d.add(shifted(_folded(width * 0.6, 0.2, 0.13, draw.count(3, 9), 0.022), (0, 0, 0.14)), draw.cloth())
    if draw.chance(0.7):
        y, z = bars[-1] if style == 2 else draw.one_of(bars[len(bars) // 2 :])
        wide, long = width * draw.between(0.5, 0.9), draw.between(0.3, 0.6)
        _hang(d, draw, draw.between(-0.5, 0.5) * (width - wide), y, z, wide, long)
        d.elevation -= max(long - y, 0)
    return d


def toilet_paper_holder(draw: Draw) -> Design:
    """On the wall with one arm, two, or a flap; or standing with spare rolls."""
    d = Design("toilet paper holder", "toilet paper holder", ("toilet roll holder", "toilet paper"))
    metal, radius, style = draw.metal(), draw.between(0.042, 0.06), draw.style(4)
    ring = ((0.02, -0.05), (radius, -0.05), (radius, 0.05), (0.02, 0.05), (0.02, -0.05))
    y, z = (radius + 0.06, radius + 0.02) if style < 3 else (draw.between(0.5, 0.68), 0.0)
    d.add(shifted(turned(_oblong(ring), 2, np.pi / 2), (0, y, z)), _PAPER)
    d.tube(((-0.07, y, z), (0.07, y, z)), 0.008, metal, 6)
    if style == 3:
        d.cylinder(draw.between(0.08, 0.11), 0.018, (-0.08, 0, 0), metal)
        d.tube(((-0.08, 0, 0), (-0.08, y, 0)), 0.008, metal)
        for k in range(draw.count(0, 3)):
            d.add(shifted(_oblong(ring), (-0.08, 0.07 + 0.102 * k, 0)), _PAPER)
        return d
    d.elevation = draw.between(0.62, 0.75)
    for sx in SIDES[style == 1 :]:
        d.box((0.014, 0.03, z), (sx * 0.065, y, z / 2), metal)
    if style == 2:
        d.box((0.14, 0.005, 2 * radius), (0, y + radius + 0.012, z), draw.one_of((metal, draw.wooden())))
    d.box((0.1, y - 0.01, 0.002), (0, y / 2, z + radius - 0.002), _PAPER)
    return d


def _oblong(profile: Sequence[tuple[float, float]], squash: float = 1.0, power: float = 2.0) -> Triangles:
    """A lathed profile whose rings become superellipses, z scaled by `squash`."""
    solid = lathe(profile, segments=24)
    flat = np.abs(solid[..., ::2])
    bend = np.hypot(flat[..., 0], flat[..., 1]) / np.maximum((flat**power).sum(-1) ** (1 / power), 1e-9)
    return solid * np.stack([bend, np.ones_like(bend), bend * squash], -1)


def _slab(d: Design, wide: float, low: float, high: float, look: Look, squash: float, power: float) -> None:
    """A flat plate of any outline."""
    d.add(_oblong(((0, low), (wide / 2, low), (wide / 2, high), (0, high)), squash, power), look)


def toilet_brush(draw: Draw) -> Design:
    """A brush in a pot, straight, tapered, bellied or square."""
    d = Design("toilet brush", "toilet brush", ("brush", "toilet brush holder"))
    radius, pot, tall = draw.between(0.042, 0.06), draw.between(0.1, 0.3), draw.between(0.36, 0.5)
    look = draw.metal() if draw.chance(0.4) else draw.ceramic()
    handle = look if draw.chance(0.4) else draw.one_of((WHITE, STEEL, BLACK))
    sides = draw.one_of((((1, 0), (1, 1)), ((0.75, 0), (1, 1)), ((0.8, 0), (1.15, 0.35), (0.7, 1))))
    profile = scaled(((0, 0), *sides, (0.6, 1), (0.3, 0.97), (0, 0.97)), radius, pot)
    d.add(_oblong(profile, power=draw.one_of((2, 2, 12))), look)
    d.tube(((0, pot * 0.9, 0), (0, tall, 0)), draw.between(0.006, 0.011), handle)
    d.add(rounded((0.03, draw.between(0.03, 0.09), 0.03), (0, tall, 0), 2, 6), handle)
    return d


def bidet(draw: Draw) -> Design:
    """An oval or squarish bowl, on the floor or on the wall, with a tap."""
    d = Design("bidet", "bidet", ("bathroom bidet",))
    width, length, top = draw.between(0.34, 0.4), draw.between(0.48, 0.58), draw.between(0.38, 0.42)
    low, waist = draw.one_of(((0, 0.28), (0, 0.45), (0.35, 0.45)))
    outside = ((0, low), (0.3, low), (waist, low + 0.2), (0.5, 0.9), (0.5, 1))
    look, low, z = WHITE if draw.chance(0.9) else draw.ceramic(), low * top, -length / 2
    bowl = scaled((*outside, (0.41, 1), (0.34, 0.75), (0.1, 0.66), (0, 0.66)), width, top)
    d.add(_oblong(bowl, length / width, draw.one_of((2.0, 2.6, 5.0))), look)
    d.box((width * 0.9, top - low, 0.1), (0, (top + low) / 2, z + 0.03), look)
    d.elevation, rise, metal = low, draw.between(0.07, 0.14), draw.one_of((STEEL, STEEL, BLACK, _GOLD))
    d.tube(((0, top, z + 0.04), (0, top + rise, z + 0.04), (0, top + rise * 0.8, z + 0.17)), 0.013, metal)
    d.box((draw.between(0.05, 0.22), 0.05, 0.03), (0, top + 0.02, z + 0.04), metal)
    return d


def urinal(draw: Draw) -> Design:
    """A bowl whose sides run up a back, with a pipe or a valve above."""
    d = Design("urinal", "urinal", ("wall urinal",), elevation=draw.between(0.45, 0.6))
    width, depth, tall = draw.between(0.3, 0.4), draw.between(0.26, 0.36), draw.between(0.5, 0.85)
    lip, swing, t = tall * draw.between(0.3, 0.5), draw.between(0.8, 3.0), np.linspace(0, np.pi, 17)
    high, shells = lip + (tall * 0.97 - lip) * np.abs(np.cos(t)) ** swing, []
    for size, low, step in ((1, 0, 1), (0.84, lip * 0.35, -1)):
        rise = np.linspace(0, 1, 8)[::step, None] * (high - low)
        reach = size * (0.4 + 0.6 * np.minimum(1, rise / (lip - low)) ** 0.6) * (rise > 0)
        shells.append(np.stack([reach * width / 2 * np.cos(t), low + rise, reach * depth * np.sin(t)], -1))
    d.add(grid_triangles(np.concatenate(shells)), WHITE)
    d.soft((width, tall, 0.06), (0, tall / 2, -0.015), WHITE, draw.one_of((4, 12)))
    d.tube(((0, tall - 0.05, 0.02), (0, tall + draw.between(0, 0.25), 0.02)), 0.014, STEEL)
    d.roll(0.03, 0.06, (0, tall * 0.9, -0.01), STEEL)
    return d


def potty(draw: Draw) -> Design:
    """A child's pot with a splash guard and a handle or a back."""
    d = Design("potty", "potty", ("child's potty",))
    look = plain(draw.colour(0.85, 0.7, 0.97), 0.3)
    inside = look if draw.chance(0.4) else plain(draw.colour(0.5, 0.85, 0.97), 0.3)
    r, tall, squash = draw.between(0.12, 0.15), draw.between(0.14, 0.2), draw.between(1.0, 1.25)
    sides = draw.one_of((((1, 0), (0.85, 0.4), (0.85, 0.8)), ((0.7, 0), (0.9, 0.8)), ((1.1, 0), (1, 0.85))))
    bowl, z = ((0.78, 0.98), (0.62, 0.88), (0.55, 0.25), (0, 0.2)), -r * squash
    for part, skin in (((*sides, (1.05, 0.9), (1.0, 1), (0.75, 0.97)), look), (bowl, inside)):
        d.add(_oblong(scaled(part, r, tall), squash), skin)
    d.add(rounded((r * 0.7, 0.07, 0.05), (0, tall + 0.01, -z * 0.82), 2, 6), look)
    if draw.chance(0.4):
        d.tube([(x, tall, z * (1.5 - 10 * abs(x))) for x in (-0.05, -0.02, 0.02, 0.05)], 0.011, look)
    else:
        d.add(rounded((r * 1.7, draw.between(0.24, 0.4), 0.05), (0, tall, z * 0.92), 3, 8), look)
    return d


def scale(draw: Draw) -> Design:
    """A slab with a display, a small one for kitchens, or one with a dial and a pan."""
    style, width, deep = draw.one_of((0, 0, 1, 2)), draw.between(0.26, 0.34), draw.between(0.85, 1.1)
    d = Design("bathroom scale" if style == 0 else "kitchen scale", "scale", ("scales", "weighing scale"))
    look = draw.one_of((WHITE, BLACK, STEEL, draw.painted()))
    dark, power = BLACK if look is not BLACK else STEEL, draw.one_of((2.0, 8.0, 20.0))
    if style < 2:
        width *= (1, 0.6)[style]
        _slab(d, width * 0.85, 0, 0.012, DARK, deep, power)
        _slab(d, width, 0.01, 0.025, look, deep, power)
        d.box((width * 0.36, 0.003, width * 0.14), (0, 0.026, width * deep * (0.36 if style else -0.3)), dark)
        if style == 1:
            d.cylinder(width * 0.4, 0.006, (0, 0.025, -width * 0.08), STEEL)
    else:
        tall, r = draw.between(0.16, 0.22), width * 0.28
        d.cylinder(r * 0.95, tall, (0, 0, 0), look, r * 0.6)
        d.roll(r * 0.8, r * 1.1, (0, tall * 0.5, 0), look)
        d.roll(r * 0.7, r * 1.15, (0, tall * 0.5, 0), WHITE if look is not WHITE else _PAPER)
        d.box((0.006, r * 0.6, 0.003), (0, tall * 0.5 + r * 0.25, r * 1.16), _RED)
        pan = scaled(((0.1, 0), (0.5, 0), (1, 1), (0.95, 1), (0.5, 0.15), (0, 0.1)), r * 1.5, 0.06)
        d.add(shifted(_oblong(pan), (0, tall, 0)), STEEL if draw.chance(0.7) else look)
    return d


def soap(draw: Draw) -> Design:
    """A bar, most in a dish, or a dispenser with a pump."""
    look, top = plain(draw.colour(0.6, 0.75, 0.97), 0.3), draw.metal()
    if draw.chance(0.5):
        d = Design("soap dispenser", "soap", ("hand soap", "soap bottle"))
        r, tall = draw.between(0.03, 0.042), draw.between(0.09, 0.15)
        body = scaled(((0, 0), (1, 0), (1, 0.85), (draw.between(0.4, 0.9), 1), (0, 1)), r, tall)
        d.add(_oblong(body, draw.between(0.65, 1), draw.one_of((2, 2, 8))), draw.ceramic())
        d.cylinder(r * 0.4, 0.018, (0, tall, 0), top)
        d.tube(((0, tall, 0), (0, tall + 0.045, 0), (0, tall + 0.04, 0.05)), 0.006, top, 6)
        return d
    d = Design("soap", "soap", ("bar of soap", "soap dish"))
    size = (draw.between(0.065, 0.09), 0.03, draw.between(0.045, 0.06))
    d.add(rounded(size, (0, 0.023, 0), draw.one_of((2.5, 4.0, 8.0)), 8), look)
    if draw.chance(0.75):
        dish = scaled(((0, 0), (0.75, 0), (1, 1), (0.93, 1), (0.75, 0.3), (0, 0.3)), size[0] * 0.75, 0.024)
        d.add(_oblong(dish, 0.72, draw.one_of((2, 3, 8))), draw.ceramic())
    return d


def _bristles(d: Design, foot: float, long: float, wide: float, look: Look) -> None:
    """Tufts over a rectangle about the middle, from `foot` upwards."""
    for x in np.linspace(-long / 2, long / 2, 10):
        for z in np.linspace(-wide / 2, wide / 2, 5):
            d.box((long / 20, 0.026, wide / 10), (x, foot + 0.013, z), look)


def brush(draw: Draw) -> Design:
    """A hair brush, a scrubbing brush, or one with a long handle."""
    style = draw.one_of((0, 0, 1, 2))
    d = Design(("hair brush", "scrubbing brush", "dish brush")[style], "brush", ("hairbrush",))
    look, tufts = draw.body(), draw.one_of((BLACK, WHITE, _STRAW))
    long, wide = draw.between(0.09, 0.12), draw.between(0.05, 0.08)
    if style == 0:
        d.add(rounded((long, 0.018, wide), (0, 0.009, 0), draw.one_of((2.2, 4.0)), 8), look)
        _bristles(d, 0.016, long * 0.65, wide * 0.55, tufts)
        d.tube(((long * 0.4, 0.009, 0), (long * 1.5, 0.01, 0)), 0.009, look)
    else:
        d.tags, long = ("cleaning brush",), long * (1.4 if style == 1 else 0.8)
        _slab(d, long, 0.025, 0.042, look, wide / long, 3)
        _bristles(d, 0, long * 0.8, wide * 0.7, tufts)
        if style == 2:
            d.tube(((long * 0.3, 0.035, 0), (draw.between(0.16, 0.35), 0.05, 0)), 0.008, look)
    return d


def comb(draw: Draw) -> Design:
    """Teeth under a spine, coarse and fine, with or without a tail."""
    d = Design("comb", "comb", ("hair comb",))
    long, wide, thick = draw.between(0.12, 0.19), draw.between(0.018, 0.04), draw.between(0.003, 0.005)
    look = draw.one_of((BLACK, draw.wooden(), plain(draw.colour(0.9), 0.5), plain((0.4, 0.22, 0.08), 0.6)))
    spine, fine = draw.between(0.008, 0.014), draw.between(0.0022, 0.0035)
    if draw.chance(0.35):
        d.box((long * 0.7, thick, spine * 0.7), (long * 0.82, thick / 2, 0), look)
    d.box((long, thick * 1.4, spine), (0, thick / 2, 0), look)
    for x in np.arange(-long / 2, long / 2, fine * 2.6):
        tooth = fine * (1.7 if x < 0 else 1.2)
        d.box((tooth, thick, wide), (x, thick / 2, spine / 2 + wide / 2), look)
    return d


_POTS = (
    (((0, 0), (1.5, 0), (1.5, 0.3), (0, 0.3)), (1.6, 0.3, 0.45)),  # jar
    (((0, 0), (0.6, 0), (0.6, 0.4), (0.5, 0.4), (0.5, 0.6), (0, 0.6)), (0.4, 0.6, 0.8)),  # lipstick
    (((0, 0), (1.2, 0), (1.2, 0.6), (0.4, 0.65), (0.4, 0.7)), (0.6, 0.7, 0.95)),  # flacon
    (((0, 0), (1, 0), (1, 0.7), (0.45, 0.8), (0, 0.8)), (0.6, 0.8, 1.05)),  # flask
)


def cosmetics(draw: Draw) -> Design:
    """Three to six jars, lipsticks, flacons and flasks in a little group."""
    d, many = Design("cosmetics", "cosmetics", ("makeup", "perfume")), draw.count(3, 6)
    for k in range(many):
        style, r, tall = draw.style(4), draw.between(0.014, 0.02), draw.between(0.08, 0.13)
        profile, (wide, low, high) = _POTS[style]
        place = ((k - (many - 1) / 2) * draw.between(0.047, 0.055), 0, draw.between(-0.035, 0.035))
        body = _oblong(scaled(profile, r, tall), power=8 if style == 2 else 2)
        d.add(shifted(body, place), _GOLD if style == 1 else draw.painted())
        lid = scaled(((0, low), (wide, low), (wide * (0.6 if style == 1 else 1), high), (0, high)), r, tall)
        d.add(shifted(_oblong(lid), place), _RED if style == 1 else draw.one_of((_GOLD, STEEL, BLACK)))
    return d


def sponge(draw: Draw) -> Design:
    """A block with a scouring side, or a lumpy bath sponge."""
    d, tall = Design("sponge", "sponge", ("cleaning sponge",)), draw.between(0.025, 0.045)
    wide, deep = draw.between(0.09, 0.14), draw.between(0.06, 0.1)
    if draw.chance(0.6):
        d.box((wide, tall, deep), (0, tall / 2, 0), plain(draw.colour(0.85, 0.75, 0.97)))
        d.box((wide, 0.009, deep), (0, tall + 0.0045, 0), draw.one_of((DARK, plain((0.1, 0.35, 0.15)))))
        return d
    look = plain((0.85, 0.7, 0.42)) if draw.chance(0.6) else plain(draw.colour(0.7, 0.7))
    for k in range(9):
        x, z = np.cos(2.4 * k) * wide * k / 32, np.sin(2.4 * k) * deep * k / 32
        lump = (wide * draw.between(0.4, 0.55), tall * draw.between(1.2, 1.8), deep * draw.between(0.4, 0.55))
        d.add(rounded(lump, (x, tall, z), 2.4, 5), look)
    return d


def drying_rack(draw: Draw) -> Design:
    """A deck with wings, a tower of decks, or a wooden trestle; most with clothes."""
    d, style = Design("drying rack", "drying rack", ("clothes horse", "laundry rack")), draw.style(3)
    look, tall = WHITE if draw.chance(0.5) else draw.metal(), draw.between(0.85, 1.05) + 0.3 * (style > 0)
    reach, wing, half = draw.between(0.42, 0.55), draw.between(0.3, 0.4), draw.between(0.26, 0.36)
    rise, foot, thick = draw.between(-0.25, 0.25), 0.26, 0.009 if style == 1 else 0.012
    if style == 0:
        foot, xs = reach * 0.8, np.linspace(-reach - wing, reach + wing, draw.count(14, 20))
        bars = [(x, tall + max(abs(x) - reach, 0) * rise / wing) for x in xs]
        for z in (-half, half):
            d.tube([(x, y, z) for x, y in bars], 0.009, look, 5)
    elif style == 1:
        bars = [(x, tall * y) for y in (0.12, 0.45, 0.78, 0.99) for x in np.linspace(-foot, foot, 6)]
    else:
        look = draw.wooden()
        bars = [(x * (1.05 - y), tall * y) for y in np.linspace(0.2, 0.97, 5) for x in (-foot, foot)]
    for sx in SIDES:
        for z in (-half, half):
            d.tube(((-sx * foot, 0, z), (sx * foot * (1, -1, -0.06)[style], tall, z)), thick, look, 6)
    for x, y in bars:
        d.tube(((x, y, -half), (x, y, half)), thick * 0.6, look, 5)
    for k in range(draw.count(2, 7) if draw.chance(0.75) else 0):
        (x, y), wide = bars[(k * 5 + 2) % len(bars)], half * draw.between(0.5, 1.7)
        long = min(y * 0.85, draw.between(0.2, 0.35 if style == 1 else 0.6))
        _hang(d, draw, x, y, draw.between(-1, 1) * (half - wide / 2), wide, long, np.pi / 2)
    _turn(d, 1, np.pi / 2 if style else 0.0)
    return d


def broom(draw: Draw) -> Design:
    """A broom with a block or of straw, a mop of strings or a flat one."""
    style = draw.style(4)
    d = Design(("broom", "straw broom", "mop", "flat mop")[style], "broom", ("sweeper", "cleaning tool"))
    tall, look = draw.between(1.15, 1.45), draw.one_of((draw.wooden(), draw.metal(), draw.painted()))
    head, wide = plain(draw.colour(0.9), 0.2), draw.between(0.25, 0.45)
    yarn = plain(draw.one_of(((0.88, 0.86, 0.8), (0.6, 0.62, 0.65), draw.colour(0.8, 0.5))))
    if style == 0:
        d.box((wide, 0.04, 0.06), (0, 0.11, 0), head if draw.chance(0.6) else draw.wooden())
        for x in np.linspace(-0.47, 0.47, 22) * wide:
            d.tube(((x, 0.1, 0), (x * 1.15, 0.01, draw.between(-0.03, 0.03))), 0.009, yarn, 5)
    elif style == 1:
        sheaf = scaled(((0, 0), (1, 0), (0.85, 0.35), (0.45, 0.75), (0.14, 1)), wide * 0.45, 0.38)
        d.lathe(sheaf, _STRAW, 20, draw.between(0.3, 0.7))
    elif style == 2:
        d.cylinder(0.035, 0.07, (0, 0.18, 0), head, 0.02)
        for k in range(40):
            x, z, reach = np.cos(2.4 * k), np.sin(2.4 * k), draw.between(0.06, 0.15)
            knee = (x * reach * 0.6, draw.between(0.09, 0.13), z * reach * 0.6)
            d.tube(((0, 0.19, 0), knee, (x * reach, 0.008, z * reach)), 0.009, yarn, 5)
    else:
        d.soft((wide, 0.04, 0.13), (0, 0.02, 0), draw.cloth(), 6)
    d.tube(((0, (0.12, 0.34, 0.22, 0.04)[style], 0), (0, tall, 0)), draw.between(0.011, 0.015), look)
    return d


def mat(draw: Draw) -> Design:
    """A bath mat with a border, a door mat, or a yoga mat."""
    style, width, depth = draw.style(3), draw.between(0.5, 0.9), draw.between(0.4, 0.58)
    d = Design(("bath mat", "door mat", "yoga mat")[style], "mat", ("floor mat",))
    high, power = draw.between(0.008, 0.02), 30 if style else draw.one_of((2.0, 6.0, 30.0))
    if style == 2:
        width, depth, high = draw.between(1.6, 1.85), draw.between(0.55, 0.68), 0.003
    brown = draw.one_of(((0.45, 0.33, 0.2), (0.25, 0.24, 0.23), (0.6, 0.48, 0.3)))
    look = Material(brown if style == 1 else draw.colour(0.8, 0.3)), draw.one_of((0, KIND_RUG, KIND_FABRIC))
    _slab(d, width, 0, high, plain(draw.colour(0.5, 0.3)), depth / width, power)
    _slab(d, width * draw.between(0.8, 0.95), high, high + 0.004, look, depth / width, power)
    return d


def water_heater(draw: Draw) -> Design:
    """A round tank, upright or lying, a flat tank, or a gas boiler with a flue."""
    style, r, tall = draw.style(4), draw.between(0.17, 0.25), draw.between(0.55, 1.0)
    d = Design("boiler" if style == 3 else "water heater", "water heater", ("boiler", "geyser"))
    top, look = draw.between(2.0, 2.15), WHITE if draw.chance(0.75) else STEEL
    wide, deep = (2 * r, 2 * r) if style < 2 else (draw.between(0.4, 0.52), draw.between(0.26, 0.34))
    if style < 2:
        tank = scaled(((0, 0), (0.7, 0.01), (1, 0.09), (1, 0.91), (0.7, 0.99), (0, 1)), r, tall)
        d.lathe(tank, look, 28)
    else:
        d.soft((wide, tall, deep), (0, tall / 2, 0), look, draw.one_of((12, 60)))
    if style == 3:
        d.cylinder(0.06, draw.between(0.05, 0.25), (0, tall, 0), STEEL)
    if style == 1:
        d.parts = [(shifted(turned(p, 2, np.pi / 2), (tall / 2, r, 0)), s) for p, s in d.parts]
        wide, tall = tall, wide
    d.elevation = top - tall - 0.18
    d.roll(0.03, 0.06, (0, tall * 0.25, deep / 2 - 0.035), STEEL)
    d.box((0.12, 0.03, 0.02), (0, tall * 0.5, deep / 2 - 0.008), draw.one_of((DARK, plain((0.1, 0.3, 0.6)))))
    for x in (-wide * 0.2, -wide * 0.08, wide * 0.2)[:: draw.count(1, 2)]:
        d.tube(((x, 0.03, 0), (x, -0.15, 0), (x, -0.18, -deep * 0.4)), 0.011, STEEL, 6)
    return d


def _outline(shape: int, width: float, height: float, inset: float, z: float) -> Float[np.ndarray, "N 3"]:
    """Rectangle, rounded rectangle, ellipse or arch on y = 0, anticlockwise, moved in by `inset`."""
    w, h, t = width / 2 - inset, height - 2 * inset, np.linspace(0, 2 * np.pi, 41)
    bend = np.linalg.norm([np.cos(t), np.sin(t)], (40, 8, 2, 2)[shape], axis=0) ** -1.0
    x, y = w * bend * np.cos(t), h / 2 * (1 + bend * np.sin(t))
    if shape == 3:
        y = np.where(np.abs(t - 4.7) < 1.5, 0, h - w + w * np.sin(t))
    return np.column_stack([x, y + inset, np.full(len(t), z)])


def mirror(draw: Draw) -> Design:
    """On the wall in a frame of any shape, leaning, or between two posts."""
    style, shape, width = draw.one_of((0, 0, 0, 0, 0, 1, 2)), draw.style(4), draw.between(0.4, 0.7)
    d = Design(("mirror", "floor mirror", "standing mirror")[style], "mirror", ("looking glass",))
    height = draw.between(1.3, 1.65) if style else width * draw.between(1.1, 1.7)
    if style == 0 and shape < 3 and draw.chance(0.5):
        width, height = (width, width) if shape == 2 else (height, width)
    bar, thick = draw.between(0.015, 0.1) * width, draw.between(0.015, 0.035)
    frame = draw.one_of((draw.body(), draw.metal(), draw.wooden(), _GOLD))
    rings = [_outline(shape, width, height, i, -z * thick) for i, z in ((0, 1), (0, 0), (bar, 0), (bar, 0.6))]
    d.add(grid_triangles(np.stack(rings)), frame)
    glass = grid_triangles(np.stack([rings[-1], np.full_like(rings[-1], (0, height / 2, -thick * 0.6))]))
    d.add(glass, (Material((0.85, 0.87, 0.88), gloss=0.6), KIND_MIRROR))
    _turn(d, 0, -0.12 if style else 0.0, (0, 0, 0.15)[style])
    d.elevation = 0.0 if style else max(1.55 - height / 2, 0.5)
    if style == 2:
        for sx in SIDES:
            x, y = sx * (width / 2 + 0.035), 0.15 + height / 2
            d.tube(((x, 0.04, 0), (x, y + 0.15, 0)), 0.016, frame)
            d.tube(((x, 0.015, -0.22), (x, 0.05, 0), (x, 0.015, 0.22)), 0.014, frame, 6)
    return d
