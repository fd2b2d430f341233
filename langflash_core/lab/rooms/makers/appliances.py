"""Makers of stoves, refrigerators and TV sets (see `makers.common`).

Metres, y up, front +z.
"""

import numpy as np

from langflash_core.lab.rooms.makers.fittings import plain_refrigerator, plain_stove, plain_tv
from langflash_core.lab.rooms.makers.kit import (
    BLACK,
    BRASS,
    DARK,
    GLASS,
    PICTURE,
    QUARTER,
    SIDES,
    STEEL,
    WHITE,
    Design,
    Draw,
    Face,
    Look,
    across,
    box,
    cylinder,
    laid,
    pad,
    panels,
    plain,
    rounded,
    shifted,
    slab,
    spread,
    torus,
    turned,
    vivid,
)


def stove(draw: Draw) -> Design:
    """Mostly plain; else ranges, ovens in tall units, wood stoves, and plates to build in."""
    if draw.chance(0.62):
        return plain_stove(draw)
    return draw.one_of((_range, _range, _gas_stove, _built_in_oven, _built_in_oven, _wood_stove, _hob, _hob))(
        draw
    )


def _oven_door(d: Design, draw: Draw, face: Face, look: Look) -> None:
    """A dark pane in a frame, a bar to open it."""
    x, y = face.left + face.width / 2, face.foot + face.height / 2
    d.box((face.width - 0.01, face.height - 0.01, 0.03), (x, y, face.z + 0.015), look)
    size = (face.width * draw.between(0.6, 0.85), face.height * 0.55, 0.006)
    d.box(size, (x, y - face.height * 0.06, face.z + 0.031), BLACK)
    d.add(across(0.011, face.width * 0.85, (x, face.foot + face.height * 0.88, face.z + 0.065), 0, 8), STEEL)


def _burners(d: Design, draw: Draw, size: tuple[float, float], y: float, many: int, gas: bool) -> None:
    w, z0 = size
    for k in range(many):
        x, z = ((k // 2) / max(1, (many - 1) // 2) - 0.5) * w * 0.55, (k % 2 - 0.5) * z0 * 0.48
        r = draw.between(0.07, 0.1)
        if gas:
            d.add(cylinder(r * 0.5, 0.02, (x, y, z), segments=12), DARK)
            for turn in (0.0, QUARTER):
                shape = turned(box((2.4 * r, 0.012, 0.012), (0, 0, 0)), 1, turn)
                d.add(shifted(shape, (x, y + 0.032, z)), BLACK)
        else:
            d.add(torus(r, 0.003, (x, y, z), 1, 18), plain((0.5, 0.5, 0.52), 0.4))


def _range(draw: Draw) -> Design:
    d = Design("range cooker", "stove", ("range", "oven", "cooker"), category="Kitchen")
    w, deep, tall = draw.between(0.85, 1.2), draw.between(0.58, 0.65), draw.between(0.88, 0.92)
    look = draw.one_of((STEEL, vivid(draw), plain((0.93, 0.9, 0.82), 0.5), DARK))
    d.box((w, tall - 0.1, deep), (0, tall / 2 + 0.05, 0), look)
    for s in SIDES:
        for z in SIDES:
            d.cylinder(0.025, 0.11, (s * w * 0.45, 0, z * deep * 0.42), STEEL)
    d.box((w + 0.01, 0.03, deep + 0.02), (0, tall, 0.01), STEEL if draw.chance(0.5) else BLACK)
    split = draw.between(0.45, 0.65)
    _oven_door(d, draw, Face(-w / 2, 0.16, w * split, tall - 0.32, deep / 2), look)
    face = Face(-w / 2 + w * split, 0.16, w * (1 - split), (tall - 0.32) * draw.one_of((1.0, 0.5)), deep / 2)
    _oven_door(d, draw, face, look)
    for x in spread(-w * 0.43, w * 0.43, draw.count(6, 8)):
        shape = across(0.022, 0.035, (x, tall - 0.09, deep / 2 + 0.02), 2, 10)
        d.add(shape, BRASS if draw.chance(0.3) else STEEL)
    _burners(d, draw, (w, deep), tall + 0.015, draw.one_of((4, 6)), True)
    d.add(across(0.011, w * 0.95, (0, tall - 0.03, deep / 2 + 0.06), 0, 8), STEEL)
    return d


def _gas_stove(draw: Draw) -> Design:
    d = Design("gas stove", "stove", ("cooker", "stove with lid"), category="Kitchen")
    w, deep = draw.between(0.48, 0.62), draw.between(0.52, 0.6)
    tall, look = 0.86, draw.one_of((WHITE, WHITE, vivid(draw)))
    pad(d, (w, tall - 0.05, deep), (0, tall / 2 + 0.03, 0), look, 0.03)
    _oven_door(d, draw, Face(-w / 2 + 0.01, 0.3, w - 0.02, 0.4, deep / 2), look)
    d.box((w * 0.94, 0.18, 0.02), (0, 0.17, deep / 2 + 0.005), look)
    _burners(d, draw, (w, deep), tall + 0.005, 4, True)
    lid = box((w, deep, 0.02), (0, tall + deep / 2, -deep / 2 + 0.01))
    if draw.chance(0.7):
        d.add(turned(lid, 0, -0.08, (0, tall, -deep / 2)), GLASS if draw.chance(0.4) else look)
    for x in spread(-w * 0.38, w * 0.38, 5):
        d.add(across(0.02, 0.03, (x, tall - 0.08, deep / 2 + 0.015), 2, 10), BLACK)
    return d


def _built_in_oven(draw: Draw) -> Design:
    d = Design("built-in oven", "stove", ("oven", "wall oven"), category="Kitchen")
    tall_unit = draw.chance(0.6)
    w, deep, look = 0.6, 0.6, draw.body()
    tall = draw.between(1.9, 2.2) if tall_unit else 0.88
    d.box((w, tall - 0.1, deep), (0, tall / 2 + 0.05, 0), look)
    d.box((w, 0.1, deep - 0.06), (0, 0.05, -0.03), DARK)
    front, low = STEEL if draw.chance(0.5) else BLACK, draw.between(0.6, 0.85) if tall_unit else 0.16
    _oven_door(d, draw, Face(-w / 2, low, w, 0.46, deep / 2), front)
    d.box((w - 0.01, 0.12, 0.03), (0, low + 0.53, deep / 2 + 0.015), front)
    d.box((0.12, 0.05, 0.004), (0, low + 0.53, deep / 2 + 0.031), plain((0.1, 0.3, 0.4), 0.6))
    for s in SIDES:
        shape = across(0.022, 0.03, (s * 0.18, low + 0.53, deep / 2 + 0.04), 2, 12)
        d.add(shape, STEEL if front is BLACK else BLACK)
    if tall_unit:
        panels(d, draw, Face(-w / 2, 0.1, w, low - 0.11, deep / 2), draw.count(1, 2), 1, look)
        top = low + 0.6
        if draw.chance(0.4):
            d.box((w - 0.01, 0.36, 0.03), (0, top + 0.19, deep / 2 + 0.015), front)
            d.box((w * 0.6, 0.25, 0.006), (-0.06, top + 0.19, deep / 2 + 0.031), BLACK)
            top += 0.38
        panels(d, draw, Face(-w / 2, top, w, tall - top, deep / 2), 1, 1, look, True)
    else:
        d.box((w, 0.035, deep + 0.02), (0, tall + 0.015, 0.01), draw.body())
        d.box((w * 0.92, 0.008, deep * 0.82), (0, tall + 0.035, 0), BLACK)
        _burners(d, draw, (w, deep), tall + 0.04, 4, draw.chance(0.3))
    return d


def _wood_stove(draw: Draw) -> Design:
    d = Design("wood stove", "stove", ("wood burner", "iron stove"))
    iron = draw.one_of((BLACK, DARK, plain((0.35, 0.1, 0.08), 0.5)))
    w, deep = draw.between(0.45, 0.75), draw.between(0.38, 0.5)
    tall, fire = draw.between(0.72, 1.1), plain((0.95, 0.45, 0.1))
    if draw.chance(0.35):
        r = w * 0.42
        d.cylinder(r, tall, (0, 0.03, 0), iron)
        d.cylinder(r * 1.05, 0.04, (0, tall, 0), iron)
        z, wide = r, r * 1.1
    else:
        pad(d, (w, tall - 0.14, deep), (0, tall / 2 + 0.07, 0), iron, 0.03)
        pad(d, (w * 1.08, 0.04, deep * 1.1), (0, tall, 0), iron, 0.015)
        for s in SIDES:
            for q in SIDES:
                path = ((s * w * 0.48, 0, q * deep * 0.46), (s * w * 0.38, 0.16, q * deep * 0.36))
                d.tube(path, 0.025, iron, 6)
        z, wide = deep / 2, w * 0.75
    d.box((wide, tall * 0.45, 0.03), (0, tall * 0.55, z + 0.005), DARK if iron is BLACK else BLACK)
    finish = fire if draw.chance(0.4) else plain((0.12, 0.08, 0.06), 0.8)
    d.box((wide * 0.78, tall * 0.32, 0.006), (0, tall * 0.56, z + 0.021), finish)
    d.box((0.02, 0.1, 0.03), (wide * 0.44, tall * 0.55, z + 0.035), STEEL)
    pipe = draw.between(0.5, 1.1)
    d.cylinder(0.07, pipe, (0, tall, -0.05), iron)
    d.cylinder(0.085, 0.03, (0, tall + pipe * 0.6, -0.05), iron)
    if draw.chance(0.5):
        d.box((w * 1.5, 0.012, deep * 1.6), (0, 0.006, 0.1), plain((0.3, 0.3, 0.31), 0.4))
    return d


def _hob(draw: Draw) -> Design:
    d = Design("hob", "stove", ("cooktop", "stove top"), elevation=0.9, category="Kitchen")
    w, deep, gas = draw.between(0.56, 0.9), draw.between(0.48, 0.53), draw.chance(0.5)
    look = draw.one_of((BLACK, STEEL, WHITE)) if gas else BLACK
    d.box((w, 0.04, deep), (0, 0.02, 0), look)
    if not gas and draw.chance(0.5):
        d.box((w + 0.01, 0.03, deep + 0.01), (0, 0.018, 0), STEEL)
    many = 4 if w < 0.75 else draw.one_of((4, 6))
    _burners(d, draw, (w, deep * 0.92), 0.04, many, gas)
    if gas:
        for x in spread(-w * 0.25, w * 0.25, many):
            shape = cylinder(0.018, 0.025, (x, 0.04, deep * 0.43), segments=10)
            d.add(shape, DARK if look is not BLACK else STEEL)
    else:
        d.box((w * 0.3, 0.002, 0.03), (0, 0.041, deep * 0.44), plain((0.6, 0.6, 0.62), 0.4))
    return d


def refrigerator(draw: Draw) -> Design:
    """Mostly plain; else side by side, round and retro, small, with a screen or a dispenser."""
    if draw.chance(0.67):
        return plain_refrigerator(draw)
    return draw.one_of(
        (_side_by_side, _side_by_side, _retro_fridge, _retro_fridge, _mini_bar, _glass_fridge)
    )(draw)


def _side_by_side(draw: Draw) -> Design:
    d = Design("american refrigerator", "refrigerator", ("side-by-side refrigerator", "fridge"))
    w, tall, deep = draw.between(0.85, 1.0), draw.between(1.72, 1.9), draw.between(0.65, 0.78)
    look = draw.one_of((STEEL, STEEL, BLACK, WHITE, plain((0.25, 0.26, 0.28), 0.6)))
    d.box((w, tall - 0.03, deep), (0, tall / 2, 0), DARK)
    low = draw.between(0.5, 0.75) if draw.chance(0.5) else 0.05
    split, metal = draw.between(-0.1, 0.0) * (low < 0.1), STEEL if look is not STEEL else DARK
    for s in SIDES:
        wide = w / 2 - s * split * w
        x = s * (w / 2 - wide / 2)
        pad(d, (wide - 0.006, tall - low - 0.01, 0.07), (x, (tall + low) / 2, deep / 2 + 0.03), look, 0.02)
        path = (
            (split * w + s * 0.05, low + 0.25, deep / 2 + 0.1),
            (split * w + s * 0.05, tall - 0.35, deep / 2 + 0.1),
        )
        d.tube(path, 0.012, metal, 6)
    if low > 0.1:
        for y, h in ((0.05, low / 2 - 0.03), (0.03 + low / 2, low / 2 - 0.04)):
            pad(d, (w, h, 0.07), (0, y + h / 2, deep / 2 + 0.03), look, 0.02)
            d.add(across(0.012, w * 0.8, (0, y + h - 0.06, deep / 2 + 0.1), 0, 6), metal)
    x = -w * 0.25 if split else draw.one_of((-0.25, 0.25)) * w
    if draw.chance(0.6):
        d.box((0.2, 0.36, 0.01), (x, 1.2, deep / 2 + 0.067), BLACK)
        d.box((0.14, 0.2, 0.012), (x, 1.14, deep / 2 + 0.068), DARK)
    else:
        d.box((w * 0.3, 0.5, 0.01), (w * 0.25, 1.3, deep / 2 + 0.067), BLACK)
        d.box((w * 0.27, 0.42, 0.012), (w * 0.25, 1.3, deep / 2 + 0.068), PICTURE)
    return d


def _retro_fridge(draw: Draw) -> Design:
    d = Design("retro refrigerator", "refrigerator", ("vintage refrigerator", "fridge"))
    w, tall = draw.between(0.55, 0.65), draw.between(1.2, 1.75)
    deep, two = draw.between(0.58, 0.66), draw.chance(0.5)
    path = ((0.9, 0.86, 0.74), (0.6, 0.8, 0.78), (0.75, 0.12, 0.12), (0.1, 0.1, 0.1), draw.colour(0.8, 0.5))
    look = plain(draw.one_of(path), 0.6)
    pad(d, (w, tall - 0.1, deep), (0, tall / 2 + 0.05, -0.03), look, 0.1, 4)
    split = tall * draw.between(0.65, 0.75)
    for low, high in ((0.1, split), (split, tall)) if two else ((0.1, tall),):
        pad(d, (w * 0.98, high - low - 0.015, 0.14), (0, (low + high) / 2, deep / 2), look, 0.065, 4)
        y = low + (high - low) * (0.72 if low < 0.2 else 0.4)
        d.add(across(0.016, 0.2, (w * 0.27, y, deep / 2 + 0.1), 0, 8), STEEL)
        d.box((0.03, 0.05, 0.05), (w * 0.38, y, deep / 2 + 0.08), STEEL)
    d.box(
        (w * 0.3, 0.035, 0.012), (-w * 0.2, tall * 0.92 if not two else split + 0.2, deep / 2 + 0.07), STEEL
    )
    for s in SIDES:
        for z in SIDES:
            d.add(cylinder(0.02, 0.12, (s * w * 0.38, 0, z * deep * 0.35), segments=8), STEEL)
    return d


def _mini_bar(draw: Draw) -> Design:
    d = Design("mini fridge", "refrigerator", ("mini bar", "small refrigerator"))
    w, tall = draw.between(0.4, 0.55), draw.between(0.5, 0.86)
    deep, look = draw.between(0.42, 0.55), draw.one_of((BLACK, WHITE, STEEL, vivid(draw)))
    d.box((w, tall - 0.02, deep), (0, tall / 2 + 0.01, 0), look)
    d.box((w, 0.04, deep * 0.9), (0, 0.02, -0.02), DARK)
    pad(d, (w * 0.99, tall - 0.06, 0.06), (0, tall / 2 + 0.03, deep / 2 + 0.03), look, 0.015)
    if draw.chance(0.4):
        place = (0, tall / 2 + 0.03, deep / 2 + 0.06)
        d.box((w * 0.8, tall * 0.75, 0.006), place, plain((0.06, 0.07, 0.09), 0.9))
    place = (w * 0.42, tall * 0.6, deep / 2 + 0.07)
    d.box((0.02, tall * 0.3, 0.025), place, STEEL if look is not STEEL else DARK)
    if draw.chance(0.5):
        d.box((w * 1.04, 0.025, deep + 0.04), (0, tall + 0.01, 0.01), draw.body())
    return d


def _glass_fridge(draw: Draw) -> Design:
    d = Design("wine refrigerator", "refrigerator", ("drinks refrigerator", "glass door refrigerator"))
    w, tall = draw.between(0.5, 0.62), draw.between(0.85, 1.9)
    deep, look = draw.between(0.5, 0.6), draw.one_of((BLACK, DARK, STEEL, WHITE))
    d.box((w, tall, 0.03), (0, tall / 2, -deep / 2), look)
    for s in SIDES:
        d.box((0.03, tall, deep), (s * w / 2, tall / 2, 0), look)
    for y in (0.06, tall - 0.03):
        d.box((w, 0.1, deep), (0, y, 0), look)
    for y in spread(0.15, tall - 0.1, max(3, round(tall / 0.24)))[:-1]:
        d.box((w, 0.012, deep * 0.85), (0, y, 0), draw.wooden() if draw.chance(0.2) else STEEL)
        glass = plain(
            draw.one_of(((0.1, 0.25, 0.12), (0.35, 0.08, 0.08), (0.75, 0.7, 0.4), draw.colour(0.8))), 0.8
        )
        for x in spread(-w * 0.38, w * 0.38, 5):
            d.add(across(0.035, 0.28, (x, y + 0.045, deep * 0.1), 2, 8), glass)
    d.box(
        (w * 0.98, tall * 0.96, 0.012), (0, tall / 2, deep / 2), plain((0.75, 0.82, 0.85), 0.9, opacity=0.25)
    )
    for s in SIDES:
        d.box((0.045, tall, 0.03), (s * (w / 2 - 0.02), tall / 2, deep / 2), look)
        d.box((w, 0.05, 0.03), (0, 0.03 if s < 0 else tall - 0.025, deep / 2), look)
    place = (w / 2 - 0.03, tall * 0.55, deep / 2 + 0.03)
    d.box((0.015, tall * 0.35, 0.03), place, STEEL if look is not STEEL else DARK)
    return d


def tv(draw: Draw) -> Design:
    """Mostly plain; else flat on feet, flat on the wall, and old tubes."""
    if draw.chance(0.67):
        return plain_tv(draw)
    return draw.one_of((_flat_tv, _flat_tv, _flat_tv, _wall_tv, _wall_tv, _tube_tv, _tube_tv))(draw)


def _screen(draw: Draw) -> Look:
    if draw.chance(0.3):
        return PICTURE
    return plain((0.03, 0.03, 0.035) if draw.chance(0.7) else draw.colour(0.7, 0.15, 0.8), 0.8)


def _flat_tv(draw: Draw) -> Design:
    d = Design("flat-screen tv", "tv", ("television", "tv"))
    w, bezel, style = draw.between(0.55, 1.45), draw.between(0.008, 0.035), draw.style(4)
    h, look = w * draw.between(0.56, 0.59), draw.one_of((BLACK, BLACK, DARK, STEEL, WHITE))
    foot = draw.between(0.05, 0.12)
    d.box((w, h, 0.03), (0, foot + h / 2, 0), look)
    d.box((w * 0.7, h * 0.6, 0.05), (0, foot + h * 0.4, -0.03), look)
    d.box((w - 2 * bezel, h - 2.4 * bezel, 0.006), (0, foot + h / 2 + bezel * 0.2, 0.014), _screen(draw))
    metal = look if draw.chance(0.6) else STEEL
    if style == 0:
        for s in SIDES:
            for z in (-0.1, 0.12):
                d.tube(((s * w * 0.38, foot + 0.01, 0), (s * w * 0.42, 0.008, z)), 0.01, metal, 5)
    elif style == 1:
        d.lathe(((0, 0), (w * 0.22, 0), (w * 0.2, 0.015), (0, 0.02)), metal, 20, 0.55)
        d.cylinder(0.03, foot + 0.02, (0, 0, -0.02), metal)
    elif style == 2:
        path = (
            (-w * 0.25, foot, -0.02),
            (-w * 0.25, 0.008, -0.1),
            (-w * 0.25, 0.008, 0.12),
            (w * 0.25, 0.008, 0.12),
            (w * 0.25, 0.008, -0.1),
            (w * 0.25, foot, -0.02),
        )
        d.tube(path, 0.01, metal, 5)
    else:
        d.box((w * 0.45, 0.014, 0.22), (0, 0.007, 0), metal)
        d.box((w * 0.25, foot, 0.03), (0, foot / 2, -0.03), metal)
    if draw.chance(0.3):
        pad(d, (w * 0.7, 0.05, 0.08), (0, 0.03, 0.16), DARK, 0.02)
    return d


def _wall_tv(draw: Draw) -> Design:
    d = Design("wall tv", "tv", ("television", "flat screen"), elevation=1.0)
    w, bezel = draw.between(0.7, 1.6), draw.between(0.006, 0.03)
    h, look = w * draw.between(0.55, 0.58), draw.one_of((BLACK, BLACK, DARK, draw.wooden(), WHITE))
    d.box((w, h, draw.between(0.025, 0.06)), (0, h / 2, 0), look)
    d.box((w - 2 * bezel, h - 2 * bezel, 0.006), (0, h / 2, 0.031), _screen(draw))
    d.box((w * 0.3, h * 0.4, 0.05), (0, h / 2, -0.04), DARK)
    if draw.chance(0.3):
        pad(d, (w * 0.8, 0.07, 0.08), (0, -0.07, 0.0), DARK, 0.02)
    return d


def _tube_tv(draw: Draw) -> Design:
    d = Design("old tv", "tv", ("tube television", "vintage tv"))
    w = draw.between(0.4, 0.75)
    h, deep = w * draw.between(0.75, 0.85), w * draw.between(0.6, 0.8)
    look = draw.one_of((DARK, BLACK, draw.wooden(), STEEL, vivid(draw)))
    foot = 0.0
    if draw.chance(0.3):
        foot = draw.between(0.1, 0.35)
        for s in SIDES:
            for z in SIDES:
                path = ((s * w * 0.42, 0.01, z * deep * 0.35), (s * w * 0.32, foot, z * deep * 0.25))
                d.tube(path, 0.012, DARK, 6)
    pad(d, (w, h, deep * 0.45), (0, foot + h / 2, deep * 0.25), look, 0.025)
    place = (0, foot + h * 0.48, deep * 0.1)
    shape = shifted(
        laid(slab(((1, 0), (0.6, 0.75), (0.5, 1)), (w * 0.95, deep * 0.6, h * 0.8)), (0, 0, 0))
        * np.array([1, 1, -1]),
        place,
    )
    d.add(shape, DARK)
    side, wide = draw.chance(0.55), w * 0.88
    x = 0.0
    if side:
        wide, x = w * 0.68, -w * 0.12
        for k in range(2):
            d.roll(0.03, 0.02, (w * 0.37, foot + h * (0.78 - 0.17 * k), deep * 0.47), STEEL, 12)
        for k in range(4):
            d.box((w * 0.16, 0.008, 0.004), (w * 0.37, foot + h * (0.18 + 0.07 * k), deep * 0.477), BLACK)
    else:
        d.box((w * 0.5, 0.03, 0.006), (0, foot + h * 0.07, deep * 0.475), BLACK)
    high = h * (0.82 if side else 0.74)
    y = foot + h * (0.5 if side else 0.55)
    d.box((wide, high, 0.012), (x, y, deep * 0.47), BLACK)
    screen = rounded((wide * 0.92, high * 0.9, 0.06), (x, y, deep * 0.475), 5.0, 10)
    d.add(screen, plain((0.22, 0.26, 0.25), 0.8) if draw.chance(0.6) else _screen(draw))
    if draw.chance(0.45):
        for s in SIDES:
            d.tube(((0, foot + h, 0), (s * w * 0.45, foot + h + w * 0.5, -0.05)), 0.005, STEEL, 5)
        d.soft((0.1, 0.06, 0.1), (0, foot + h, 0), DARK, 2.0)
    return d
