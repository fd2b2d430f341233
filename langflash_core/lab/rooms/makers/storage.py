"""Makers of wardrobes, dressers and TV stands (see `makers.common`).

Metres, y up, front +z.
"""

import numpy as np

from langflash_core.lab.rooms.makers.furniture import (
    plain_dresser,
    plain_tv_stand,
    plain_wardrobe,
)
from langflash_core.lab.rooms.makers.kit import (
    BLACK,
    BRASS,
    DARK,
    GLASS,
    MIRROR,
    QUARTER,
    SIDES,
    STEEL,
    WHITE,
    Design,
    Draw,
    Face,
    Look,
    Vector,
    across,
    ball,
    box,
    cylinder,
    four_legs,
    grid_triangles,
    loft,
    pad,
    panels,
    plain,
    shifted,
    slab,
    spread,
    torus,
    turned,
    vivid,
)

_SHIRT = ((0.85, 0), (0.85, 0.6), (1, 0.86), (0.9, 0.94), (0.25, 1))


def shelf_rows(
    d: Design, draw: Draw, size: Vector, foot: Vector, rows: int, columns: int, look: Look, fill: float = 0.5
) -> None:
    """An open rack with books and boxes here and there."""
    (wide, tall, deep), (x0, y0, z0) = size, foot
    for x in spread(-wide / 2, wide / 2, columns + 1):
        d.box((0.02, tall, deep), (x0 + x, y0 + tall / 2, z0), look)
    for y in spread(0, tall, rows + 1):
        d.box((wide, 0.02, deep), (x0, y0 + y, z0), look)
    w, h = wide / columns, tall / rows
    for k in range(rows * columns):
        if not draw.chance(fill):
            continue
        x, y = x0 - wide / 2 + (k % columns) * w + 0.03, y0 + (k // columns) * h + 0.01
        for _ in range(draw.count(1, 5)):
            thick, high = draw.between(0.025, 0.06), h * draw.between(0.5, 0.85)
            d.box((thick * 0.95, high, deep * 0.7), (x + thick / 2, y + high / 2, z0), draw.cloth())
            x += thick
            if x > x0 - wide / 2 + (k % columns + 1) * w - 0.08:
                break


def wardrobe(draw: Draw) -> Design:
    """Mostly plain; else sliding mirrors, open rails, country cupboards, corners, smooth fronts."""
    if draw.chance(0.7):
        return plain_wardrobe(draw)
    many = (
        _sliding_wardrobe,
        _sliding_wardrobe,
        _open_wardrobe,
        _open_wardrobe,
        _rustic_wardrobe,
        _rustic_wardrobe,
    )
    return draw.one_of((*many, _corner_wardrobe, _modern_wardrobe))(draw)


def _sliding_wardrobe(draw: Draw) -> Design:
    d = Design("sliding wardrobe", "wardrobe", ("mirror wardrobe", "closet"))
    doors = draw.count(2, 3)
    wide, tall, deep = doors * draw.between(0.7, 0.95), draw.between(2.0, 2.3), draw.between(0.58, 0.66)
    look, metal, front = draw.body(), draw.metal(), draw.body()
    for s in SIDES:
        d.box((0.03, tall, deep), (s * wide / 2, tall / 2, 0), look)
        d.box((wide, 0.05, deep), (0, 0.03 if s < 0 else tall - 0.025, 0), look)
    d.box((wide, tall, 0.02), (0, tall / 2, -deep / 2 + 0.01), look)
    w, mirrors = wide / doors, draw.count(1, doors)
    for k in range(doors):
        x, z = -wide / 2 + (k + 0.5) * w, deep / 2 - 0.05 * (k % 2) - 0.02
        d.box((w, tall - 0.1, 0.03), (x, tall / 2, z), metal if draw.chance(0.3) else look)
        face = MIRROR if k < mirrors else front
        bands = draw.one_of((1, 1, 3))
        for j in range(bands):
            h = (tall - 0.18) / bands
            size = (w - 0.06, h - 0.02 * (bands > 1), 0.004)
            d.box(size, (x, 0.09 + (j + 0.5) * h, z + 0.016), face if bands == 1 or j == 1 else front)
        d.box((0.02, tall - 0.1, 0.02), (x + w / 2 - 0.02, tall / 2, z + 0.02), metal)
    return d


def _clothes(d: Design, draw: Draw, left: float, right: float, rail: float) -> None:
    """Shirts, coats and dresses on a rail along x."""
    x = left + 0.04
    while x < right - 0.04:
        long, thick = draw.between(0.55, 1.05), draw.between(0.03, 0.06)
        cloth = turned(slab(_SHIRT, (draw.between(0.38, 0.46), long, thick), (0, -long, 0)), 1, QUARTER)
        d.add(shifted(cloth, (x, rail - 0.06, 0)), draw.cloth())
        d.box((0.006, 0.07, 0.006), (x, rail - 0.03, 0), STEEL)
        x += thick + draw.between(0.005, 0.04)


def _open_wardrobe(draw: Draw) -> Design:
    d = Design("open wardrobe", "wardrobe", ("clothes rack", "closet"))
    look, columns = draw.body(), draw.count(1, 2)
    each, tall, deep = draw.between(0.65, 0.9), draw.between(1.75, 2.15), draw.between(0.45, 0.55)
    shelves = 0.45 * draw.chance(0.6)
    wide = each * columns + shelves
    for x in (-wide / 2, *[-wide / 2 + (k + 1) * each for k in range(columns)], wide / 2):
        d.box((0.022, tall, deep), (x, tall / 2, 0), look)
    for y in (0.08, tall):
        d.box((wide, 0.025, deep), (0, y - 0.012, 0), look)
    if draw.chance(0.7):
        d.box((wide, tall, 0.012), (0, tall / 2, -deep / 2 + 0.01), look)
    for k in range(columns):
        left, rail = -wide / 2 + k * each, tall - draw.between(0.1, 0.35)
        d.add(across(0.014, each, (left + each / 2, rail, 0), 0, 8), STEEL)
        d.box((each, 0.02, deep), (left + each / 2, rail + 0.06, 0), look)
        _clothes(d, draw, left, left + each * draw.between(0.6, 1.0), rail)
        if draw.chance(0.6):
            panels(d, draw, Face(left, 0.1, each, 0.36, deep / 2 - 0.02), 2, 1, look)
            d.box((each, 0.02, deep), (left + each / 2, 0.47, 0), look)
        else:
            for _ in range(draw.count(1, 3)):
                d.box((0.1, 0.1, 0.26), (left + draw.between(0.1, each - 0.1), 0.13, 0), draw.upholstery())
    if shelves:
        left = wide / 2 - shelves
        for y in spread(0.4, tall - 0.3, 5):
            d.box((shelves, 0.02, deep), (left + shelves / 2, y, 0), look)
            for j in range(draw.count(0, 3)):
                place = (left + shelves / 2, y + 0.035 + 0.052 * j, 0)
                d.box((shelves * 0.7, 0.05, deep * 0.7), place, draw.cloth())
    return d


def _rustic_wardrobe(draw: Draw) -> Design:
    d = Design("antique wardrobe", "wardrobe", ("armoire", "country wardrobe"))
    wide, tall, deep = draw.between(1.0, 1.5), draw.between(1.75, 2.05), draw.between(0.5, 0.6)
    look = draw.wooden() if draw.chance(0.75) else draw.painted()
    panel = look if draw.chance(0.6) else draw.painted()
    for s in SIDES:
        for z in SIDES:
            ball(d, (0.11, 0.12, 0.11), (s * wide * 0.45, 0.06, z * deep * 0.4), look, 5)
    d.box((wide + 0.06, 0.3, deep + 0.04), (0, 0.25, 0), look)
    d.box((wide, tall - 0.4, deep), (0, (tall + 0.4) / 2, 0), look)
    for s in SIDES:
        x = s * wide * 0.235
        d.box((wide * 0.43, tall - 0.52, 0.03), (x, (tall + 0.36) / 2, deep / 2 + 0.01), look)
        for low, high in ((0.48, 0.9), (0.98, tall - 0.14)):
            place = (x, (low + high) / 2, deep / 2 + 0.012)
            d.box((wide * 0.32, high - low, 0.05), place, panel if draw.chance(0.8) else look)
            d.box((wide * 0.25, high - low - 0.12, 0.06), (x, (low + high) / 2, deep / 2 + 0.013), panel)
        ball(d, (0.04, 0.04, 0.04), (s * 0.05, tall * 0.5, deep / 2 + 0.05), BRASS, 4)
        d.box((wide * 0.44, 0.2, 0.025), (x, 0.25, deep / 2 + 0.025), panel)
        ball(d, (0.035, 0.035, 0.035), (x, 0.25, deep / 2 + 0.05), BRASS, 4)
        d.add(cylinder(0.035, tall - 0.5, (s * wide * 0.485, 0.42, deep / 2), segments=8), look)
    d.box((wide + 0.1, 0.07, deep + 0.08), (0, tall + 0.03, 0), look)
    d.box((wide + 0.16, 0.04, deep + 0.12), (0, tall + 0.08, 0), look)
    crown = ((1, 0), (0.9, 0.25), (0.6, 0.55), (0.25, 0.95), (0.03, 1))
    if draw.chance(0.65):
        d.add(slab(crown, (wide, draw.between(0.12, 0.25), 0.05), (0, tall + 0.1, deep / 2)), look)
    return d


def _corner_wardrobe(draw: Draw) -> Design:
    d = Design("corner wardrobe", "wardrobe", ("corner closet",))
    side, arm = draw.between(0.95, 1.15), draw.between(0.5, 0.58)
    tall, hand = draw.between(1.95, 2.25), draw.one_of(SIDES)
    look, front, metal = draw.body(), draw.body(), draw.metal()
    half, cut = side / 2, side - arm
    d.box((side, tall, arm), (0, tall / 2, -half + arm / 2), look)
    d.box((arm, tall, cut), (-hand * (half - arm / 2), tall / 2, half - cut / 2), look)
    slant = box((cut * 1.4, tall - 0.1, 0.03), (0, tall / 2, 0))
    middle = (hand * (half - cut / 2) * 1.0, 0.0, half - cut / 2)
    d.add(shifted(turned(slant, 1, hand * QUARTER / 2), middle), MIRROR if draw.chance(0.35) else front)
    place = (middle[0] - 0.1, tall * 0.45, middle[2] + 0.05)
    d.add(slab(((0.5, 0), (0.5, 1)), (0.02, 0.3, 0.05), place), metal)
    for y in (0.0, tall):
        fill = np.array(
            [
                [
                    (hand * half, y, half - cut),
                    (-hand * (half - arm), y, half),
                    (-hand * (half - arm), y, half - cut),
                ]
            ]
        )
        d.add(fill, look)
    if draw.chance(0.6):
        for y in spread(0.1, tall - 0.1, 5):
            d.box((0.3, 0.02, arm), (hand * (half + 0.15), y, -half + arm / 2), look)
        d.box((0.3, tall, 0.02), (hand * (half + 0.15), tall / 2, -half + 0.01), look)
    return d


def _modern_wardrobe(draw: Draw) -> Design:
    d = Design("modern wardrobe", "wardrobe", ("fitted wardrobe", "closet"))
    doors = draw.count(3, 6)
    wide, tall, deep = doors * draw.between(0.42, 0.5), draw.between(2.1, 2.4), 0.6
    look = plain((0.93, 0.93, 0.92), draw.between(0.2, 0.8)) if draw.chance(0.7) else draw.painted()
    d.box((wide, 0.06, deep * 0.9), (0, 0.03, -0.02), DARK)
    d.box((wide, tall - 0.06, deep), (0, tall / 2 + 0.03, 0), look)
    split = tall - 0.4 if draw.chance(0.4) else tall
    niche = draw.count(0, doors - 1) if draw.chance(0.4) else -1
    for k in range(doors):
        x = -wide / 2 + (k + 0.5) * wide / doors
        if k == niche:
            wood = draw.wooden()
            d.box((wide / doors - 0.01, tall - 0.1, 0.01), (x, tall / 2 + 0.03, deep / 2), wood)
            for y in spread(0.3, tall - 0.3, 5):
                d.box((wide / doors - 0.02, 0.02, 0.08), (x, y, deep / 2 + 0.03), wood)
            continue
        for low, high in ((0.07, split), (split, tall)):
            if high - low > 0.1:
                size = (wide / doors - 0.006, high - low - 0.008, 0.022)
                d.box(size, (x, (low + high) / 2, deep / 2 + 0.011), look)
        grip = x + (wide / doors / 2 - 0.03) * (1 if k % 2 == 0 else -1)
        d.box((0.014, draw.one_of((0.3, 1.2)), 0.02), (grip, 1.1, deep / 2 + 0.035), STEEL)
    return d


def dresser(draw: Draw) -> Design:
    """Mostly plain; else bombé, tall, with a changing top, on legs, in colours, with a mirror."""
    if draw.chance(0.67):
        return plain_dresser(draw)
    many = (
        _bombe,
        _tallboy,
        _changing_table,
        _legged_dresser,
        _legged_dresser,
        _coloured_dresser,
        _mirror_dresser,
    )
    return draw.one_of(many)(draw)


def _bombe(draw: Draw) -> Design:
    d = Design("antique chest of drawers", "dresser", ("commode", "chest of drawers"))
    wide, tall = draw.between(0.8, 1.2), draw.between(0.78, 0.92)
    deep, wood = draw.between(0.4, 0.5), draw.wooden()
    rows, n = draw.count(2, 3), 12
    t = np.linspace(0, 1, n)
    bulge = 1 + draw.between(0.08, 0.16) * np.sin(np.pi * np.clip(t * 1.1 - 0.05, 0, 1)) - 0.06 * (1 - t)
    half = [(float(b), float(y)) for b, y in zip(bulge * 0.9, t, strict=True)]
    foot = 0.16
    d.add(slab(half, (wide, tall - foot, deep * 0.9), (0, foot, 0)), wood)
    front = np.array(
        [
            [
                (x * wide * 0.43 * b, foot + y * (tall - foot), deep * 0.42 * b + 0.04 * (1 - x * x))
                for x in spread(-1, 1, 7)
            ]
            for b, y in zip(bulge, t, strict=True)
        ]
    )
    d.add(grid_triangles(front), wood)
    for k in range(rows):
        row = (k + 0.5) / rows
        b = float(np.interp(row, t, bulge))
        y, z = foot + row * (tall - foot), deep * 0.42 * b + 0.05
        d.box((wide * 0.8, 0.008, 0.01), (0, foot + k / rows * (tall - foot), z - 0.012), DARK)
        for x in (-wide * 0.25, wide * 0.25):
            d.add(torus(0.03, 0.006, (x, y, z), 2, 10), BRASS)
        ball(d, (0.03, 0.05, 0.02), (0, y, z + 0.005), BRASS, 4)
    for sx in SIDES:
        for sz in SIDES:
            leg = (
                (sx * wide * 0.42, foot + 0.04, sz * deep * 0.38),
                (sx * wide * 0.4, foot * 0.5, sz * deep * 0.36),
                (sx * wide * 0.45, 0.01, sz * deep * 0.44),
            )
            d.add(loft(leg, (0.05, 0.03, 0.02), 8), wood)
    marble = (
        plain(draw.one_of(((0.9, 0.88, 0.85), (0.55, 0.35, 0.3), (0.3, 0.3, 0.3))), 0.6)
        if draw.chance(0.5)
        else wood
    )
    pad(d, (wide * 1.02, 0.03, deep + 0.04), (0, tall + 0.01, 0.01), marble, 0.012)
    return d


def _tallboy(draw: Draw) -> Design:
    d = Design("tall chest of drawers", "dresser", ("tallboy", "narrow dresser"))
    wide, rows = draw.between(0.38, 0.6), draw.count(5, 7)
    tall, deep, look = rows * draw.between(0.16, 0.21) + 0.08, draw.between(0.36, 0.45), draw.body()
    d.box((wide, tall - 0.06, deep), (0, tall / 2 + 0.03, 0), look)
    d.box((wide * 0.94, 0.06, deep * 0.9), (0, 0.03, 0), DARK if draw.chance(0.4) else look)
    face = Face(-wide / 2, 0.08, wide, tall - 0.1, deep / 2)
    panels(d, draw, face, rows, 1, look if draw.chance(0.5) else draw.body())
    d.box((wide + 0.03, 0.03, deep + 0.03), (0, tall + 0.015, 0.005), look)
    return d


def _changing_table(draw: Draw) -> Design:
    d = Design("changing table", "dresser", ("changing unit", "nursery dresser"))
    wide, tall = draw.between(0.8, 1.1), draw.between(0.84, 0.95)
    deep, look = draw.between(0.48, 0.55), draw.body()
    low = 0.06
    d.box((wide, tall - low, deep), (0, (tall + low) / 2, 0), look)
    four_legs(d, draw, wide, deep, low + 0.02, look)
    panels(
        d, draw, Face(-wide / 2, low, wide, tall - low - 0.02, deep / 2), 3, draw.count(1, 2), draw.painted()
    )
    top, cloth = deep + 0.18, draw.cloth()
    for s in SIDES:
        d.box((0.025, 0.13, top), (s * wide * 0.47, tall + 0.06, 0.05), look)
    d.box((wide * 0.94, 0.13, 0.025), (0, tall + 0.06, -deep / 2 + 0.02), look)
    d.box((wide * 0.94, 0.02, top), (0, tall + 0.01, 0.05), look)
    pad(d, (wide * 0.6, 0.07, top * 0.92), (-wide * 0.12, tall + 0.055, 0.05), cloth, 0.03)
    for s in SIDES:
        pad(d, (0.09, 0.06, top * 0.9), (-wide * 0.12 + s * wide * 0.26, tall + 0.11, 0.05), cloth, 0.03)
    return d


def _legged_dresser(draw: Draw) -> Design:
    d = Design("chest of drawers", "dresser", ("dresser", "mid-century dresser"))
    columns, rows = draw.count(1, 3), draw.count(2, 4)
    wide, deep, foot = columns * draw.between(0.5, 0.65), draw.between(0.4, 0.48), draw.between(0.18, 0.35)
    tall, look = foot + rows * draw.between(0.16, 0.22), draw.body()
    front, leg, splay = look if draw.chance(0.5) else draw.body(), draw.legs(), draw.between(0.0, 0.1)
    for sx in SIDES:
        for sz in SIDES:
            x, z = sx * wide * 0.42, sz * deep * 0.38
            path = ((x + sx * splay, 0.01, z + sz * splay * 0.4), (x, foot + 0.01, z))
            d.add(loft(path, (0.013, 0.026), 8), leg)
    for s in SIDES:
        d.box((0.025, tall - foot, deep), (s * (wide - 0.025) / 2, (tall + foot) / 2, 0), look)
        d.box((wide, 0.025, deep), (0, foot + 0.012 if s < 0 else tall - 0.012, 0), look)
    d.box((wide - 0.05, tall - foot - 0.05, deep - 0.03), (0, (tall + foot) / 2, -0.015), front)
    face = Face(-wide / 2 + 0.03, foot + 0.03, wide - 0.06, tall - foot - 0.06, deep / 2 - 0.025)
    panels(d, draw, face, rows, columns, front)
    return d


def _coloured_dresser(draw: Draw) -> Design:
    d = Design("colourful chest of drawers", "dresser", ("children's dresser", "drawer unit"))
    columns, rows = draw.count(1, 4), draw.count(3, 5)
    wide = columns * draw.between(0.3, 0.45)
    tall, deep = rows * draw.between(0.15, 0.22) + 0.06, draw.between(0.35, 0.45)
    look, looks = draw.body(), [vivid(draw) for _ in range(draw.count(2, 5))]
    d.box((wide, tall, deep), (0, tall / 2, 0), look)
    w, h, grip = wide / columns, (tall - 0.08) / rows, draw.style(3)
    for k in range(rows * columns):
        x, y = -wide / 2 + (k % columns + 0.5) * w, 0.05 + (k // columns + 0.5) * h
        d.box((w - 0.025, h - 0.025, 0.02), (x, y, deep / 2 + 0.01), draw.one_of(looks))
        if grip == 0:
            ball(d, (0.035, 0.035, 0.035), (x, y, deep / 2 + 0.035), WHITE, 4)
        elif grip == 1:
            d.box((0.07, 0.035, 0.008), (x, y + 0.02, deep / 2 + 0.02), DARK)
        else:
            d.box((w * 0.4, 0.014, 0.02), (x, y, deep / 2 + 0.03), draw.metal())
    return d


def _mirror_dresser(draw: Draw) -> Design:
    d = Design("dresser with mirror", "dresser", ("sideboard", "vanity dresser"))
    wide, tall = draw.between(1.0, 1.6), draw.between(0.72, 0.88)
    deep, look = draw.between(0.4, 0.5), draw.body()
    foot = draw.between(0.06, 0.16)
    four_legs(d, draw, wide, deep, foot + 0.01, look)
    d.box((wide, tall - foot, deep), (0, (tall + foot) / 2, 0), look)
    front = look if draw.chance(0.6) else draw.body()
    panels(d, draw, Face(-wide / 2, foot, wide * 0.34, tall - foot - 0.02, deep / 2), 3, 1, front)
    panels(d, draw, Face(-wide * 0.16, foot, wide * 0.66, tall - foot - 0.02, deep / 2), 1, 2, front, True)
    d.box((wide + 0.04, 0.03, deep + 0.03), (0, tall + 0.01, 0), look)
    high, broad, z = draw.between(0.6, 0.95), wide * draw.between(0.5, 0.85), -deep / 2 + 0.05
    if draw.chance(0.4):
        middle = (0.0, tall + 0.05 + high / 2, z)
        for r, part, thick in ((1.0, look, 0.03), (0.9, MIRROR, 0.036)):
            oval = across(0.5, thick, (0, 0, 0), 2, 24) * np.array([broad * 0.8 * r, high * r, 1])
            d.add(shifted(oval, middle), part)
        for s in SIDES:
            d.box((0.04, high * 0.6, 0.04), (s * broad * 0.42, tall + high * 0.3, z), look)
    else:
        d.box((broad, high, 0.035), (0, tall + 0.03 + high / 2, z), look)
        d.box((broad - 0.12, high - 0.12, 0.042), (0, tall + 0.03 + high / 2, z), MIRROR)
    return d


def tv_stand(draw: Draw) -> Design:
    """Mostly plain; else low boards, racks, wall units, glass shelves."""
    if draw.chance(0.64):
        return plain_tv_stand(draw)
    return draw.one_of((_low_board, _low_board, _tv_rack, _wall_unit, _glass_stand, _corner_stand))(draw)


def _low_board(draw: Draw) -> Design:
    d = Design("low board", "tv stand", ("tv bench", "media console"))
    wide, tall = draw.between(1.2, 2.2), draw.between(0.32, 0.5)
    deep, look = draw.between(0.36, 0.46), draw.body()
    foot, front = draw.between(0.03, 0.17), draw.body()
    sled = draw.chance(0.4)
    for s in SIDES:
        if sled:
            x, metal = s * wide * 0.35, DARK
            path = (
                (x, foot, -deep * 0.4),
                (x, 0.015, -deep * 0.4),
                (x, 0.015, deep * 0.4),
                (x, foot, deep * 0.4),
            )
            d.tube(path, 0.014, metal, 4)
        else:
            for z in SIDES:
                path = ((s * wide * 0.44, 0.01, z * deep * 0.42), (s * wide * 0.42, foot, z * deep * 0.38))
                d.add(loft(path, (0.012, 0.022), 8), look)
    pad(d, (wide, tall - foot, deep), (0, (tall + foot) / 2, 0), look, 0.015 if draw.chance(0.7) else 0.08)
    inner, parts = wide - 0.06, draw.count(2, 4)
    doors = draw.chance(0.3)
    for k in range(parts):
        w = inner / parts
        left = -inner / 2 + k * w
        if k == parts // 2 and draw.chance(0.6):
            d.box((w - 0.02, tall - foot - 0.07, 0.006), (left + w / 2, (tall + foot) / 2, deep / 2), DARK)
            d.box((w * 0.6, 0.06, 0.02), (left + w / 2, foot + 0.07, deep / 2), BLACK)
        else:
            face = Face(left, foot + 0.025, w, tall - foot - 0.05, deep / 2 - 0.005)
            panels(d, draw, face, 1 if doors else draw.count(1, 2), 1, front, doors)
    return d


def _tv_rack(draw: Draw) -> Design:
    d = Design("tv rack", "tv stand", ("media rack", "tv shelf"))
    wide, tall = draw.between(0.8, 1.5), draw.between(0.42, 0.65)
    deep, look, post = draw.between(0.36, 0.45), draw.body(), draw.legs()
    levels = draw.count(2, 3)
    for y in spread(0.08, tall, levels + 1):
        d.box((wide, 0.025, deep), (0, y, 0), look)
    for sx in SIDES:
        for sz in SIDES:
            d.box(
                (0.035, tall + 0.02, 0.035), (sx * (wide / 2 - 0.02), tall / 2, sz * (deep / 2 - 0.02)), post
            )
        if draw.chance(0.4):
            d.tube(((sx * wide * 0.49, 0.08, -deep / 2), (sx * wide * 0.49, tall, deep / 2)), 0.008, post, 5)
    for y in spread(0.08, tall, levels + 1)[:-1]:
        for x in (-wide * 0.22, wide * 0.22):
            if draw.chance(0.6):
                size = (draw.between(0.2, 0.36), draw.between(0.05, 0.1), deep * 0.7)
                d.box(size, (x, y + 0.06, 0), draw.one_of((BLACK, DARK, STEEL, draw.cloth())))
    return d


def _wall_unit(draw: Draw) -> Design:
    d = Design("wall unit", "tv stand", ("entertainment center", "tv wall"))
    wide, tall = draw.between(1.8, 2.6), draw.between(1.5, 2.0)
    deep, look = draw.between(0.38, 0.45), draw.body()
    low, side, front = draw.between(0.4, 0.5), draw.between(0.35, 0.5), draw.body()
    d.box((wide, low, deep), (0, low / 2, 0), look)
    panels(d, draw, Face(-wide / 2, 0.05, wide, low - 0.06, deep / 2), 1, draw.count(3, 5), front)
    for s in SIDES:
        x = s * (wide - side) / 2
        if draw.chance(0.5):
            d.box((side, tall - low, 0.3), (x, (tall + low) / 2, -deep / 2 + 0.15), look)
            face = Face(x - side / 2, low + 0.02, side, tall - low - 0.03, -deep / 2 + 0.3)
            panels(d, draw, face, 1, 1, front, True)
        else:
            d.box((side, tall - low, 0.015), (x, (tall + low) / 2, -deep / 2 + 0.01), look)
            shelf_rows(d, draw, (side, tall - low, 0.3), (x, low, -deep / 2 + 0.15), 4, 1, look, 0.7)
    if draw.chance(0.8):
        d.box((wide, 0.03, 0.3), (0, tall, -deep / 2 + 0.15), look)
    if draw.chance(0.5):
        d.box((wide - 2 * side, tall - low, 0.02), (0, (tall + low) / 2, -deep / 2 + 0.01), front)
    return d


def _glass_stand(draw: Draw) -> Design:
    d = Design("glass tv stand", "tv stand", ("glass media stand",))
    wide, tall, deep = draw.between(0.8, 1.3), draw.between(0.42, 0.58), draw.between(0.4, 0.48)
    glass = plain(draw.one_of(((0.1, 0.11, 0.12), (0.7, 0.82, 0.8))), 0.9, opacity=draw.between(0.35, 0.7))
    metal = draw.metal()
    for k, y in enumerate((0.08, tall * 0.5, tall)):
        pad(d, (wide * (0.85 if k == 1 else 1), 0.014, deep), (0, y, 0), glass, 0.006)
    for sx in SIDES:
        for sz in SIDES:
            d.cylinder(0.022, tall, (sx * wide * 0.42, 0, sz * deep * 0.36), metal)
    d.box((0.35, 0.07, 0.28), (draw.between(-0.15, 0.15), tall * 0.5 + 0.045, 0), BLACK)
    if draw.chance(0.5):
        d.box((0.12, tall + 0.35, 0.03), (0, (tall + 0.35) / 2, -deep * 0.45), metal)
    return d


def _corner_stand(draw: Draw) -> Design:
    d = Design("corner tv stand", "tv stand", ("tv cabinet",))
    wide, tall = draw.between(0.9, 1.25), draw.between(0.45, 0.65)
    deep, look = draw.between(0.42, 0.5), draw.body()
    half = ((0.55, 0), (1, 0.6), (1, 1))
    for y, high in ((0.0, 0.05), (tall - 0.03, 0.03), (tall * 0.5, 0.02)):
        plate = turned(slab(half, (wide, deep, high)), 0, QUARTER)
        d.add(shifted(plate, (0, y + high / 2, -deep / 2)), look)
    d.box((wide * 0.55, tall, 0.015), (0, tall / 2, -deep / 2 + 0.01), look)
    for s in SIDES:
        d.box((0.02, tall, deep * 0.4), (s * (wide / 2 - 0.01), tall / 2, deep * 0.3), look)
        slant = box((wide * 0.33, tall, 0.015), (0, tall / 2, 0))
        angle = np.arctan2(deep * 0.6, wide * 0.225)
        d.add(shifted(turned(slant, 1, s * -angle), (s * wide * 0.39, 0, -deep * 0.2)), look)
    for s in SIDES:
        face = Face(
            -wide / 2 + (s + 1) * wide / 4 + 0.01, 0.05, wide / 2 - 0.02, tall - 0.09, deep / 2 - 0.02
        )
        panels(d, draw, face, 1, 1, GLASS if draw.chance(0.3) else look, True)
    return d
