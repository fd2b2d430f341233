"""Makers of what people make music with (see `makers.common`).

Metres, y up, front +z.
"""

import numpy as np

from langflash_core.lab.rooms.makers.kit import (
    BLACK,
    BRASS,
    DARK,
    LINEN,
    QUARTER,
    SIDES,
    STEEL,
    TURN,
    WHITE,
    Design,
    Draw,
    Look,
    across,
    ball,
    box,
    cylinder,
    lathe,
    loft,
    merge,
    pad,
    plain,
    polar,
    scaled,
    shifted,
    slab,
    spread,
    torus,
    turned,
    vivid,
)

_FIDDLE = (
    *((0.3, 0), (0.8, 0.04), (1, 0.16), (0.97, 0.28), (0.84, 0.36), (0.62, 0.4), (0.52, 0.5)),
    *((0.58, 0.6), (0.76, 0.64), (0.82, 0.76), (0.74, 0.9), (0.45, 0.98), (0.15, 1)),
)


_GUITAR = (
    *((0.35, 0), (0.75, 0.03), (0.97, 0.14), (1, 0.24), (0.93, 0.37), (0.72, 0.52), (0.64, 0.6)),
    *((0.68, 0.7), (0.77, 0.81), (0.72, 0.92), (0.45, 0.99), (0.2, 1)),
)


def musical_instrument(draw: Draw) -> Design:
    """Strings, drums, brass and bellows."""
    strings = (_guitar, _guitar, _electric_guitar, _electric_guitar, _violin, _cello)
    return draw.one_of((*strings, _drum_kit, _drum, _trumpet, _saxophone, _accordion))(draw)


def _neck(part: Design, foot: float, length: float, wide: float, z: float, wood: Look) -> None:
    part.box((wide, length, 0.02), (0, foot + length / 2, z), wood)
    part.box((wide * 0.95, length * 1.2, 0.008), (0, foot + length * 0.4, z + 0.013), DARK)
    head = ((0.6, 0), (1, 0.3), (1, 0.85), (0.7, 1))
    part.add(slab(head, (wide * 1.5, 0.17, 0.018), (0, foot + length, z - 0.01)), wood)
    for s in SIDES:
        for k in range(3):
            part.box((0.03, 0.012, 0.012), (s * wide, foot + length + 0.05 + 0.04 * k, z - 0.01), STEEL)


def _leant(d: Design, draw: Draw, part: Design, lift: float, wide: float) -> None:
    """A long part that leans backwards, most on a stand."""
    lean = draw.between(0.12, 0.3)
    stand = draw.chance(0.7)
    merge(d, part, lambda t: shifted(turned(t, 0, -lean), (0, lift * stand, 0)))
    if stand:
        for s in SIDES:
            d.tube(((s * wide, 0.01, 0.16), (s * wide * 0.6, lift, 0.09), (0, 0.5, -0.13)), 0.012, DARK, 6)
            d.tube(((s * wide * 0.6, lift, 0.09), (s * wide * 0.6, lift, -0.06)), 0.012, DARK, 6)
        d.tube(((0, 0.5, -0.13), (0, 0.01, -0.3)), 0.012, DARK, 6)


def _guitar(draw: Draw) -> Design:
    small = draw.chance(0.2)
    d = Design("ukulele" if small else "acoustic guitar", "musical instrument", ("guitar", "instrument"))
    part, s, wood = Design("", ""), 0.58 if small else draw.between(0.9, 1.05), draw.wooden()
    rim = draw.wooden() if draw.chance(0.5) else plain((0.25, 0.12, 0.06), 0.5)
    wide, tall, deep = draw.between(0.35, 0.42) * s, 0.49 * s, 0.1 * s
    part.add(slab(_GUITAR, (wide, tall, deep)), rim)
    part.add(slab(_GUITAR, (wide * 0.97, tall * 0.97, 0.006), (0, tall * 0.015, deep / 2)), wood)
    part.roll(0.055 * s, 0.006, (0, tall * 0.66, deep / 2), plain((0.85, 0.75, 0.55)))
    part.roll(0.047 * s, 0.009, (0, tall * 0.66, deep / 2), BLACK)
    part.box((0.16 * s, 0.025 * s, 0.012), (0, tall * 0.3, deep / 2), DARK)
    part.box((0.04 * s, tall * 0.7, 0.002), (0, tall * 0.65, deep / 2 + 0.014), LINEN)
    _neck(part, tall * 0.97, 0.36 * s, 0.055 * s, deep / 2 - 0.01, rim)
    _leant(d, draw, part, 0.14 * s, 0.15 * s)
    return d


def _electric_guitar(draw: Draw) -> Design:
    d = Design("electric guitar", "musical instrument", ("guitar", "instrument"))
    part, look = Design("", ""), vivid(draw) if draw.chance(0.6) else draw.body()
    style, tall = draw.style(3), 0.36
    if style == 2:
        part.add(slab(((0.7, -0.1), (1, 0.1), (0.55, 0.6), (0.4, 0.95)), (0.42, tall, 0.045)), look)
    else:
        part.add(slab(_GUITAR[:9], (0.34, 0.4, 0.045)), look)
        for s, reach in ((-1, 0.12), (1, 0.12 if style else 0.07)):
            path = ((s * 0.08, 0.28, 0), (s * 0.12, 0.33, 0), (s * 0.1, 0.33 + reach * 0.6, 0))
            part.add(loft(path, (0.05, 0.045, 0.022), 8, 0.5), look)
    if draw.chance(0.7):
        plate = WHITE if draw.chance(0.5) else BLACK
        part.add(slab(_GUITAR[:9], (0.22, 0.3, 0.006), (0.02, 0.05, 0.025)), plate)
    for y in spread(0.14, 0.27, draw.count(2, 3)):
        part.box((0.08, 0.03, 0.012), (0, y, 0.029), DARK if draw.chance(0.6) else LINEN)
    part.box((0.08, 0.025, 0.015), (0, 0.08, 0.03), STEEL)
    for k in range(3):
        part.roll(0.014, 0.02, (0.09 + 0.01 * k, 0.16 - 0.045 * k, 0.02), STEEL, 8)
    _neck(part, 0.3, 0.45, 0.052, 0.02, draw.wooden())
    _leant(d, draw, part, 0.14, 0.14)
    return d


def _bowed(part: Design, s: float, look: Look) -> None:
    """A violin's body and neck; s is 1 for its 36 cm."""
    part.add(slab(_FIDDLE, (0.21 * s, 0.36 * s, 0.045 * s)), look)
    part.add(slab(_FIDDLE[2:], (0.17 * s, 0.33 * s, 0.062 * s), (0, 0.0, 0)), look)
    for x in (-0.042 * s, 0.042 * s):
        hole = box((0.008 * s, 0.075 * s, 0.004), (x, 0.17 * s, 0.032 * s))
        part.add(turned(hole, 2, x * 4 / s, (x, 0.17 * s, 0)), BLACK)
    part.box((0.04 * s, 0.11 * s, 0.012 * s), (0, 0.075 * s, 0.04 * s), BLACK)
    part.box((0.045 * s, 0.008 * s, 0.03 * s), (0, 0.17 * s, 0.045 * s), plain((0.8, 0.65, 0.4)))
    part.box((0.03 * s, 0.27 * s, 0.012 * s), (0, 0.36 * s, 0.046 * s), BLACK)
    part.box((0.025 * s, 0.2 * s, 0.025 * s), (0, 0.44 * s, 0.025 * s), look)
    ball(part, (0.035 * s, 0.06 * s, 0.045 * s), (0, 0.56 * s, 0.01 * s), look, 5)
    part.box((0.1 * s, 0.012 * s, 0.012 * s), (0, 0.525 * s, 0.02 * s), BLACK)


def _violin(draw: Draw) -> Design:
    d = Design("violin", "musical instrument", ("fiddle", "instrument"))
    part, look = Design("", ""), plain((0.5, draw.between(0.17, 0.28), 0.08), 0.6)
    _bowed(part, draw.between(0.9, 1.05), look)
    part.tube(((0.14, 0, 0), (0.16, 0.62, 0)), 0.006, draw.wooden(), 5)
    part.tube(((0.152, 0.02, 0), (0.172, 0.6, 0)), 0.003, LINEN, 4)
    if draw.chance(0.5):
        merge(d, part, lambda t: turned(t, 0, -QUARTER))
    else:
        _leant(d, draw, part, 0.06, 0.07)
    return d


def _cello(draw: Draw) -> Design:
    d = Design("cello", "musical instrument", ("string instrument", "instrument"))
    part, s = Design("", ""), draw.between(1.95, 2.15)
    _bowed(part, s, plain((0.48, draw.between(0.15, 0.26), 0.07), 0.6))
    part.tube(((0, 0, 0), (0, -0.15, 0)), 0.008, STEEL, 6)
    _leant(d, draw, part, 0.16, 0.2)
    return d


def _drum(draw: Draw) -> Design:
    look, skin, style = vivid(draw) if draw.chance(0.4) else draw.wooden(), LINEN, draw.style(3)
    names = ("djembe", "conga drums", "snare drum")
    d = Design(names[style], "musical instrument", ("drum", "instrument"))
    radius = draw.between(0.13, 0.17)
    if style == 0:
        profile = ((0.55, 0), (0.4, 0.35), (0.45, 0.5), (0.95, 0.75), (1, 1))
        d.lathe(scaled(profile, radius, 0.6), look, 16)
        d.cylinder(radius * 0.98, 0.012, (0, 0.595, 0), skin)
        d.add(torus(radius * 0.98, 0.012, (0, 0.53, 0)), DARK)
        for k in range(8):
            d.tube(
                (polar(radius, k * 0.785, 0.54), polar(radius * 0.5, k * 0.785 + 0.2, 0.33)), 0.005, LINEN, 4
            )
        return d
    for x in (-radius * 1.1, radius * 1.1) if style == 1 else (0.0,):
        tall, foot = (0.7, 0.05) if style == 1 else (0.15, 0.55)
        belly = ((0.7, 0), (1.15, 0.45), (1, 1)) if style == 1 else ((1.1, 0), (1.1, 1))
        d.add(lathe(scaled(belly, radius, tall), (x, foot, 0), 16), look)
        d.cylinder(radius * 0.98 if style == 1 else radius * 1.08, 0.012, (x, foot + tall - 0.008, 0), skin)
        d.add(torus(radius * (1 if style == 1 else 1.1), 0.012, (x, foot + tall - 0.02, 0)), STEEL)
        for k in range(3):
            tip = polar(0.25, k * TURN / 3, 0.01)
            d.tube(((x, foot + 0.05, 0), (x + tip[0], 0.01, tip[2])), 0.01, STEEL, 6)
    return d


def _drum_kit(draw: Draw) -> Design:
    d = Design("drum kit", "musical instrument", ("drums", "instrument"))
    look = vivid(draw) if draw.chance(0.6) else draw.body()
    radius = draw.between(0.24, 0.3)
    d.roll(radius, 0.4, (0, radius + 0.02, -0.2), look, 20)
    d.roll(radius * 0.95, 0.01, (0, radius + 0.02, 0.2), WHITE if draw.chance(0.6) else BLACK, 20)
    d.add(torus(radius, 0.018, (0, radius + 0.02, 0.2), 2), DARK)
    drums = [
        (-0.5, 0.5, 0.17, 0.15),
        (0.5, 0.35, 0.2, 0.36),
        (-0.18, 0.68, 0.15, 0.2),
        (0.18, 0.68, 0.15, 0.2),
    ]
    for x, foot, r, tall in drums[: draw.count(3, 4)]:
        z = -0.05 if abs(x) < 0.3 else -0.35
        d.add(cylinder(r, tall, (x, foot, z), segments=14), look)
        d.add(cylinder(r * 0.97, 0.012, (x, foot + tall, z), segments=14), LINEN)
        d.add(torus(r, 0.012, (x, foot + tall - 0.01, z), 1, 14), STEEL)
        for s in SIDES:
            path = ((x, foot, z), (x + s * 0.1 * (abs(x) > 0.3), 0.0 if abs(x) > 0.3 else 0.55, z))
            d.tube(path, 0.012, STEEL, 5)
    for x, y in ((-0.6, draw.between(0.85, 1.0)), (0.6, draw.between(1.0, 1.2)), (-0.25, 1.15))[
        : draw.count(2, 3)
    ]:
        disc = lathe(((0.02, 0.02), (0.05, 0.012), (draw.between(0.18, 0.25), 0)), segments=16)
        d.add(shifted(turned(disc, 2, 0.25 * np.sign(x)), (x, y, 0.05)), BRASS)
        d.tube(((x, 0.0, 0.05), (x, y + 0.03, 0.05)), 0.01, STEEL, 5)
        for s in SIDES:
            d.tube(((x, 0.35, 0.05), (x + s * 0.2, 0.01, -0.05)), 0.01, STEEL, 5)
    if draw.chance(0.6):
        d.cylinder(0.16, 0.07, (0, 0.45, -0.65), BLACK)
        d.tube(((0, 0, -0.65), (0, 0.45, -0.65)), 0.02, STEEL)
    return d


def _trumpet(draw: Draw) -> Design:
    d = Design("trumpet", "musical instrument", ("brass instrument", "instrument"))
    part, look = Design("", ""), BRASS if draw.chance(0.75) else STEEL
    bell = (
        (0.008, 0),
        (0.009, 0.28),
        (0.016, 0.38),
        (0.032, 0.45),
        (0.065, 0.49),
        (0.06, 0.485),
        (0.02, 0.4),
    )
    part.lathe(bell, look, 16)
    rear = [(0.03 - 0.03 * np.cos(a), -0.03 * np.sin(a), 0.0) for a in spread(0, np.pi, 5)]
    part.tube(((0, 0.02, 0), *rear, (0.06, 0.13, 0)), 0.008, look, 6)
    lead = [(0.065 + 0.03 * np.cos(a), 0.3 + 0.03 * np.sin(a), 0.0) for a in spread(0, np.pi, 5)]
    part.tube(((0.095, -0.1, 0), *lead, (0.035, 0.15, 0)), 0.007, look, 6)
    part.cylinder(0.014, 0.03, (0.095, -0.13, 0), look, 0.008)
    for y in (0.12, 0.155, 0.19):
        part.add(across(0.015, 0.12, (0.04, y, 0), 0, 10), look)
        part.add(across(0.008, 0.17, (0.04, y, 0), 0, 6), STEEL)
    merge(d, part, lambda t: turned(turned(t, 0, QUARTER), 1, 0.6))
    return d


def _saxophone(draw: Draw) -> Design:
    d = Design("saxophone", "musical instrument", ("brass instrument", "instrument"))
    path = ((-0.1, 0.87, 0), (-0.03, 0.92, 0), (0.03, 0.87, 0), (0.04, 0.55, 0), (0.05, 0.2, 0))
    bow = ((0.1, 0.13, 0), (0.17, 0.15, 0), (0.2, 0.25, 0), (0.22, 0.36, 0), (0.25, 0.45, 0))
    d.add(loft((*path, *bow), (0.008, 0.011, 0.013, 0.02, 0.03, 0.035, 0.038, 0.04, 0.045, 0.075)), BRASS)
    d.tube(((-0.1, 0.87, 0), (-0.15, 0.84, 0)), 0.012, BLACK, 6)
    d.roll(0.06, 0.01, (0.25, 0.46, -0.005), BLACK, 12)
    for y in spread(0.25, 0.75, draw.count(7, 10)):
        d.roll(0.02, 0.02, (0.045, y, 0.015), BRASS, 8)
    d.tube(((0.065, 0.2, 0.02), (0.06, 0.78, 0.02)), 0.005, STEEL, 5)
    for k in range(3):
        tip = polar(0.22, k * TURN / 3 + 0.4, 0.01)
        d.tube(((0.1, 0.12, 0), (0.1 + tip[0], 0.01, tip[2])), 0.01, DARK, 6)
    return d


def _accordion(draw: Draw) -> Design:
    d = Design("accordion", "musical instrument", ("squeezebox", "instrument"))
    look, folds = vivid(draw), draw.count(6, 10)
    tall, deep, wide = draw.between(0.3, 0.42), draw.between(0.17, 0.22), draw.between(0.12, 0.3)
    for s in SIDES:
        pad(d, (0.09, tall, deep), (s * (wide / 2 + 0.045), tall / 2, 0), look, 0.025)
        d.box((0.004, tall * 0.7, deep * 0.5), (s * (wide / 2 + 0.092), tall / 2, 0), STEEL)
    for k, x in enumerate(spread(-wide / 2, wide / 2, 2 * folds + 1)):
        size = 0.97 if k % 2 else 0.9
        extent = (wide / (2 * folds), tall * size, deep * size)
        d.box(extent, (x, tall / 2, 0), DARK if k % 2 else plain((0.5, 0.1, 0.1)))
    d.box((0.05, tall * 0.94, 0.02), (wide / 2 + 0.06, tall / 2, deep / 2 + 0.015), WHITE)
    for k, y in enumerate(spread(0.06 * tall, 0.94 * tall, 15)):
        extent = (0.03 if k % 7 in (1, 2, 4, 5, 6) else 0.05, 0.004 if k % 2 else 0.009, 0.012)
        d.box(extent, (wide / 2 + 0.065, y, deep / 2 + 0.024), BLACK)
    for k in range(12):
        place = (-wide / 2 - 0.03 - 0.022 * (k % 3), tall * (0.2 + 0.2 * (k // 3)), deep / 2)
        ball(d, (0.012, 0.012, 0.01), place, WHITE, 3)
    return d
