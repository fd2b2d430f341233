"""Makers of toys (see `makers.common`).

Metres, y up, front +z.
"""

import numpy as np

from langflash_core.lab.rooms.makers.kit import (
    BLACK,
    DARK,
    LINEN,
    QUARTER,
    RUBBER,
    SIDES,
    STEEL,
    WHITE,
    Design,
    Draw,
    across,
    ball,
    box,
    cylinder,
    loft,
    merge,
    open_box,
    pad,
    plain,
    shifted,
    slab,
    spread,
    torus,
    turned,
    vivid,
)
from langflash_core.lab.rooms.makers.small import plain_toy


def toy(draw: Draw) -> Design:
    """Mostly plain; else what children leave on the floor."""
    if draw.chance(0.54):
        return plain_toy(draw)
    rolling = (_toy_car, _toy_train, _rocking_horse, _toy_boat)
    still = (_doll, _dolls_house, _stacking_rings, _toy_robot, _toy_castle, _rubber_duck, _kite)
    return draw.one_of((*rolling, *still))(draw)


def _toy_car(draw: Draw) -> Design:
    style = draw.style(3)
    d = Design(("toy car", "toy truck", "toy bus")[style], "toy", ("toy vehicle",))
    look, glass, long = vivid(draw), plain((0.3, 0.45, 0.55), 0.7), draw.between(0.18, 0.42)
    wide, r = long * 0.45, long * 0.11
    if style == 0:
        pad(d, (wide, long * 0.2, long), (0, r + long * 0.08, 0), look, long * 0.07)
        pad(d, (wide * 0.85, long * 0.2, long * 0.5), (0, r + long * 0.24, -long * 0.05), glass, long * 0.07)
        d.box((wide * 0.75, 0.01, long * 0.36), (0, r + long * 0.345, -long * 0.05), look)
    elif style == 1:
        d.box((wide * 0.7, long * 0.06, long), (0, r + 0.01, 0), DARK)
        pad(d, (wide * 0.9, long * 0.36, long * 0.28), (0, r + long * 0.2, long * 0.34), look, long * 0.04)
        d.box((wide * 0.8, long * 0.12, 0.01), (0, r + long * 0.28, long * 0.482), glass)
        open_box(
            d, (wide, long * 0.25, long * 0.6), (0, r + long * 0.06, -long * 0.18), vivid(draw), long * 0.03
        )
    else:
        pad(d, (wide, long * 0.4, long), (0, r + long * 0.2, 0), look, long * 0.05)
        d.box((wide * 1.01, long * 0.13, long * 0.85), (0, r + long * 0.27, 0), glass)
    for s in SIDES:
        place = (s * wide * 0.33, r + long * 0.08, long * 0.5)
        ball(d, (wide * 0.16, wide * 0.16, 0.02), place, plain((0.95, 0.9, 0.6)), 4)
        for z in (-long * 0.3, long * 0.3):
            d.add(across(r, long * 0.1, (s * wide * 0.5, r, z), 0, 14), RUBBER)
            d.add(across(r * 0.5, long * 0.11, (s * wide * 0.5, r, z), 0, 8), WHITE)
    return d


def _toy_train(draw: Draw) -> Design:
    d = Design("toy train", "toy", ("toy locomotive",))
    s, looks = draw.between(0.12, 0.2), [vivid(draw) for _ in range(4)]
    for k in range(draw.count(2, 3)):
        x = -1.25 * s * k
        d.box((s * 1.05, 0.12 * s, 0.5 * s), (x, 0.3 * s, 0), looks[k])
        if k == 0:
            d.add(across(0.22 * s, 0.65 * s, (x + 0.15 * s, 0.58 * s, 0), 0, 14), looks[1])
            d.box((0.36 * s, 0.65 * s, 0.48 * s), (x - 0.32 * s, 0.65 * s, 0), looks[0])
            d.box((0.46 * s, 0.07 * s, 0.58 * s), (x - 0.32 * s, 1.0 * s, 0), looks[2])
            d.add(cylinder(0.07 * s, 0.3 * s, (x + 0.35 * s, 0.76 * s, 0), 0.11 * s, 10), looks[2])
        else:
            open_box(d, (s, 0.35 * s, 0.48 * s), (x, 0.34 * s, 0), looks[k], 0.06 * s)
            for j in range(3):
                ball(d, (0.3 * s, 0.3 * s, 0.3 * s), (x + (j - 1) * 0.3 * s, 0.62 * s, 0), looks[3 - j], 5)
        for side in SIDES:
            for off in (-0.33 * s, 0.33 * s):
                d.add(across(0.17 * s, 0.08 * s, (x + off, 0.17 * s, side * 0.27 * s), 2, 12), looks[3])
        d.box((0.3 * s, 0.05 * s, 0.05 * s), (x + 0.6 * s, 0.28 * s, 0), DARK)
    return d


def _doll(draw: Draw) -> Design:
    d = Design("doll", "toy", ("toy doll",))
    s = draw.between(0.28, 0.5)
    skin = plain(draw.one_of(((0.93, 0.76, 0.64), (0.55, 0.36, 0.25), (0.8, 0.6, 0.45))))
    dress, hair = draw.cloth(), plain(draw.one_of(((0.85, 0.68, 0.3), (0.2, 0.12, 0.07), (0.55, 0.22, 0.1))))
    seated = draw.chance(0.5)
    low = 0.05 * s if seated else 0.3 * s
    path = [(0.2 * s, low), (0.13 * s, low + 0.2 * s), (0.09 * s, low + 0.36 * s), (0.04 * s, low + 0.4 * s)]
    d.lathe(path, dress, 14)
    y = low + 0.53 * s
    ball(d, (0.23 * s, 0.25 * s, 0.22 * s), (0, y, 0), skin)
    ball(d, (0.26 * s, 0.26 * s, 0.22 * s), (0, y + 0.03 * s, -0.035 * s), hair)
    for side in SIDES:
        hip = (side * 0.07 * s, low + 0.03 * s, 0.05 * s)
        foot = (side * 0.1 * s, 0.05 * s, 0.42 * s) if seated else (side * 0.07 * s, 0.03 * s, 0.02 * s)
        d.add(loft((hip, foot), (0.045 * s, 0.04 * s), 8), skin)
        place = (foot[0], max(foot[1], 0.04 * s), foot[2] + 0.02 * s)
        ball(d, (0.08 * s, 0.08 * s, 0.12 * s), place, vivid(draw), 4)
        arm = (side * 0.2 * s, low + 0.18 * s, 0.05 * s)
        d.add(loft(((side * 0.08 * s, low + 0.35 * s, 0), arm), (0.04 * s, 0.032 * s), 8), skin)
        ball(d, (0.025 * s, 0.035 * s, 0.02 * s), (side * 0.05 * s, y + 0.01 * s, 0.105 * s), BLACK, 3)
        path = ((side * 0.11 * s, y + 0.03 * s, -0.02 * s), (side * 0.15 * s, y - 0.18 * s, 0))
        d.add(loft(path, (0.035 * s, 0.025 * s), 6), hair)
    d.box((0.05 * s, 0.012 * s, 0.01 * s), (0, y - 0.065 * s, 0.1 * s), plain((0.75, 0.2, 0.2)))
    return d


def _dolls_house(draw: Draw) -> Design:
    d = Design("doll's house", "toy", ("dollhouse", "toy house"))
    wide, floors, deep = draw.between(0.45, 0.8), draw.count(2, 3), draw.between(0.22, 0.32)
    wall, roof = draw.painted() if draw.chance(0.7) else draw.wooden(), vivid(draw)
    tall = 0.25 * floors
    d.box((wide, tall, 0.012), (0, tall / 2, -deep / 2), wall)
    for x in (-wide / 2, draw.between(-0.1, 0.1) * wide, wide / 2):
        d.box((0.014, tall, deep), (x, tall / 2, 0), wall)
    for k in range(floors + 1):
        d.box((wide, 0.014, deep), (0, 0.007 + 0.25 * k * 0.97, 0), draw.body())
    rise = draw.between(0.18, 0.3)
    d.add(slab(((1, 0), (0.02, 1)), (wide, rise, 0.01), (0, tall, -deep / 2)), wall)
    slope, angle = np.hypot(wide / 2, rise) + 0.05, np.arctan2(rise, wide / 2)
    for s in SIDES:
        board = box((slope, 0.015, deep + 0.05), (0, 0, 0))
        d.add(shifted(turned(board, 2, -s * angle), (s * wide / 4, tall + rise / 2, 0)), roof)
    for k in range(floors):
        for x in (-wide * 0.3, wide * 0.25):
            d.box((0.1, 0.1, 0.01), (x, 0.25 * k + 0.14, -deep / 2 + 0.008), plain((0.6, 0.8, 0.95), 0.5))
            place = (x + draw.between(-0.05, 0.05), 0.25 * k + 0.06, -0.02)
            d.box((0.12, draw.between(0.04, 0.1), 0.08), place, vivid(draw))
    return d


def _rocking_horse(draw: Draw) -> Design:
    d = Design("rocking horse", "toy", ("toy horse",))
    s, wood = draw.between(0.6, 0.9), draw.wooden() if draw.chance(0.6) else draw.painted()
    mane, paint = draw.one_of((DARK, LINEN, plain((0.5, 0.3, 0.15)))), vivid(draw)
    for side in SIDES:
        rocker = [
            (side * 0.15 * s, 0.03 * s + 0.18 * s * (z / 0.6) ** 2, z * s) for z in spread(-0.6, 0.6, 9)
        ]
        d.tube(rocker, 0.025 * s, paint, 6)
        for z in (-0.28, 0.26):
            path = ((side * 0.08 * s, 0.5 * s, z * s * 0.8), (side * 0.14 * s, 0.09 * s, z * s * 1.15))
            d.add(loft(path, (0.06 * s, 0.035 * s), 8), wood)
        ball(d, (0.03 * s, 0.04 * s, 0.04 * s), (side * 0.068 * s, 0.88 * s, 0.48 * s), BLACK, 4)
        path = ((side * 0.04 * s, 0.93 * s, 0.38 * s), (side * 0.05 * s, 1.02 * s, 0.38 * s))
        ear = loft(path, (0.03 * s, 0.01 * s), 6)
        d.add(ear, wood)
    for z in (-0.38, 0.36):
        d.add(across(0.02 * s, 0.34 * s, (0, 0.1 * s, z * s), 0, 8), paint)
    path = ((0, 0.54 * s, -0.28 * s), (0, 0.5 * s, 0), (0, 0.54 * s, 0.24 * s))
    d.add(loft(path, (0.14 * s, 0.13 * s, 0.14 * s)), wood)
    path = ((0, 0.58 * s, 0.24 * s), (0, 0.76 * s, 0.34 * s), (0, 0.9 * s, 0.38 * s))
    d.add(loft(path, (0.12 * s, 0.09 * s, 0.08 * s)), wood)
    d.add(loft(((0, 0.89 * s, 0.38 * s), (0, 0.8 * s, 0.6 * s)), (0.09 * s, 0.055 * s)), wood)
    path = ((0, 0.98 * s, 0.34 * s), (0, 0.82 * s, 0.24 * s), (0, 0.66 * s, 0.14 * s))
    d.add(loft(path, (0.05 * s, 0.06 * s, 0.04 * s), 8, 0.6), mane)
    path = ((0, 0.6 * s, -0.38 * s), (0, 0.58 * s, -0.5 * s), (0, 0.36 * s, -0.55 * s))
    d.add(loft(path, (0.04 * s, 0.06 * s, 0.03 * s), 8), mane)
    pad(d, (0.26 * s, 0.05 * s, 0.26 * s), (0, 0.65 * s, -0.03 * s), paint, 0.03)
    d.add(across(0.015 * s, 0.3 * s, (0, 0.82 * s, 0.33 * s), 0, 6), paint)
    return d


def _stacking_rings(draw: Draw) -> Design:
    d = Design("stacking rings", "toy", ("ring stacker", "baby toy"))
    s, y = draw.between(0.8, 1.4), 0.02
    d.cylinder(0.075 * s, 0.02, (0, 0, 0), draw.wooden())
    many = draw.count(4, 7)
    for k in range(many):
        r = s * (0.045 - 0.022 * k / many)
        thick = 0.018 * s
        d.add(torus(r, thick, (0, y + thick, 0), 1, 14), plain(draw.colour(0.95, 0.7), 0.4))
        y += 1.9 * thick
    d.tube(((0, 0, 0), (0, y, 0)), 0.012, LINEN)
    ball(d, (0.05 * s, 0.05 * s, 0.05 * s), (0, y + 0.02 * s, 0), vivid(draw))
    return d


def _toy_boat(draw: Draw) -> Design:
    d = Design("toy boat", "toy", ("model ship", "sailing boat"))
    long, hull, sail = draw.between(0.25, 0.6), draw.body(), LINEN if draw.chance(0.6) else draw.cloth()
    half = ((0.6, 0), (0.9, 0.2), (1, 0.5), (0.75, 0.75), (0.05, 1))
    body = turned(slab(half, (long * 0.3, long, long * 0.16), (0, -long / 2, 0)), 0, QUARTER)
    body = shifted(turned(body, 1, QUARTER), (0, long * 0.08, 0))
    body[..., 2] *= 0.6 + 2.4 * body[..., 1:2][..., 0] / long
    d.add(body + np.array([0, long * 0.05, 0]), hull)
    d.box((long * 0.5, long * 0.05, long * 0.1), (0, 0.03 * long, 0), DARK)
    top = long * draw.between(0.9, 1.2)
    d.tube(((0, long * 0.1, 0), (0, top, 0)), long * 0.012, draw.wooden(), 6)
    for s, wide in ((1, 0.4), (-1, 0.38)):
        tri = np.array(
            [
                [
                    (s * 0.02 * long, long * 0.27, 0),
                    (s * wide * long, long * 0.27, 0.05 * long),
                    (s * 0.02 * long, top * 0.95, 0),
                ]
            ]
        )
        d.add(tri, sail)
    d.box((long * 0.1, long * 0.05, 0.004), (long * 0.05, top, 0), vivid(draw))
    d.box((long * 0.42, 0.008, 0.008), (-long * 0.2, long * 0.26, 0.01), draw.wooden())
    return d


def _toy_robot(draw: Draw) -> Design:
    d = Design("toy robot", "toy", ("robot",))
    s, look, trim = draw.between(0.18, 0.4), STEEL if draw.chance(0.4) else vivid(draw), vivid(draw)
    d.box((0.42 * s, 0.4 * s, 0.26 * s), (0, 0.46 * s, 0), look)
    d.box((0.28 * s, 0.18 * s, 0.02 * s), (0, 0.5 * s, 0.135 * s), trim)
    d.box((0.3 * s, 0.24 * s, 0.24 * s), (0, 0.82 * s, 0), look)
    d.tube(((0, 0.6 * s, 0), (0, 0.72 * s, 0)), 0.06 * s, DARK)
    d.tube(((0, 0.92 * s, 0), (0, 1.05 * s, 0)), 0.012 * s, DARK, 5)
    ball(d, (0.06 * s, 0.06 * s, 0.06 * s), (0, 1.07 * s, 0), trim, 4)
    d.box((0.16 * s, 0.03 * s, 0.02 * s), (0, 0.75 * s, 0.12 * s), DARK)
    for side in SIDES:
        d.roll(0.045 * s, 0.02 * s, (side * 0.07 * s, 0.85 * s, 0.115 * s), plain((0.95, 0.85, 0.2), 0.5), 10)
        d.add(across(0.06 * s, 0.06 * s, (side * 0.23 * s, 0.58 * s, 0), 0, 10), DARK)
        path = (
            (side * 0.28 * s, 0.58 * s, 0),
            (side * 0.3 * s, 0.4 * s, 0),
            (side * 0.3 * s, 0.36 * s, 0.16 * s),
        )
        d.tube(path, 0.045 * s, look)
        d.box((0.1 * s, 0.1 * s, 0.08 * s), (side * 0.3 * s, 0.36 * s, 0.2 * s), trim)
        d.box((0.14 * s, 0.26 * s, 0.16 * s), (side * 0.11 * s, 0.17 * s, 0), look)
        d.box((0.18 * s, 0.07 * s, 0.28 * s), (side * 0.11 * s, 0.035 * s, 0.04 * s), trim)
    return d


def _toy_castle(draw: Draw) -> Design:
    d = Design("toy castle", "toy", ("castle",))
    stone = plain(draw.one_of(((0.62, 0.6, 0.57), (0.8, 0.72, 0.58), draw.colour(0.5, 0.6))))
    wide, tall, roof = draw.between(0.35, 0.6), draw.between(0.16, 0.25), vivid(draw)
    for s in SIDES:
        d.box((wide, tall, 0.03), (0, tall / 2, s * wide * 0.4), stone)
        d.box((0.03, tall, wide * 0.8), (s * wide / 2, tall / 2, 0), stone)
        for k in range(5):
            d.box((wide * 0.09, 0.03, 0.032), ((k - 2) * wide * 0.18, tall + 0.015, s * wide * 0.4), stone)
        for z in SIDES:
            high = tall * draw.between(1.3, 1.7)
            d.add(cylinder(wide * 0.11, high, (s * wide / 2, 0, z * wide * 0.4), segments=12), stone)
            d.add(cylinder(wide * 0.14, wide * 0.25, (s * wide / 2, high, z * wide * 0.4), 0.001, 12), roof)
    d.box((wide * 0.24, tall * 0.7, 0.01), (0, tall * 0.35, wide * 0.42), plain((0.35, 0.2, 0.1)))
    d.box((wide * 0.3, tall * 1.6, wide * 0.3), (0, tall * 0.8, -wide * 0.1), stone)
    d.add(cylinder(wide * 0.24, wide * 0.3, (0, tall * 1.6, -wide * 0.1), 0.001, 4), roof)
    d.box((0.06, 0.03, 0.003), (0.03, tall * 1.6 + wide * 0.32, -wide * 0.1), vivid(draw))
    return d


def _rubber_duck(draw: Draw) -> Design:
    d = Design("rubber duck", "toy", ("bath duck", "toy duck"))
    s, look = draw.between(0.08, 0.2), plain((0.95, 0.8, 0.12), 0.5) if draw.chance(0.75) else vivid(draw)
    path = (
        (0, 0.42 * s, -0.55 * s),
        (0, 0.34 * s, -0.3 * s),
        (0, 0.33 * s, 0.05 * s),
        (0, 0.38 * s, 0.3 * s),
    )
    d.add(loft(path, (0.1 * s, 0.28 * s, 0.36 * s, 0.24 * s), 12, 1.15), look)
    ball(d, (0.52 * s, 0.5 * s, 0.5 * s), (0, 0.82 * s, 0.22 * s), look, 8)
    ball(d, (0.26 * s, 0.09 * s, 0.3 * s), (0, 0.78 * s, 0.5 * s), plain((0.9, 0.35, 0.08), 0.4), 5)
    for side in SIDES:
        ball(d, (0.07 * s, 0.1 * s, 0.06 * s), (side * 0.13 * s, 0.93 * s, 0.42 * s), BLACK, 4)
        ball(d, (0.12 * s, 0.24 * s, 0.42 * s), (side * 0.38 * s, 0.42 * s, -0.08 * s), look, 5)
    return d


def _kite(draw: Draw) -> Design:
    d = Design("kite", "toy", ("paper kite",))
    part, tall, wide = Design("", ""), draw.between(0.6, 0.95), draw.between(0.45, 0.75)
    corners = ((0, 0), (wide / 2, tall * 0.65), (0, tall), (-wide / 2, tall * 0.65))
    centre = (0.0, tall * 0.65, 0.03)
    looks = [vivid(draw) for _ in range(draw.one_of((2, 4)))]
    for k in range(4):
        (ax, ay), (bx, by) = corners[k], corners[(k + 1) % 4]
        part.add(np.array([[(ax, ay, 0.0), (bx, by, 0.0), centre]]), looks[k % len(looks)])
    part.tube(((0, 0, -0.005), (0, tall, -0.005)), 0.006, draw.wooden(), 5)
    part.tube(((-wide / 2, tall * 0.65, -0.005), (wide / 2, tall * 0.65, -0.005)), 0.006, draw.wooden(), 5)
    merge(d, part, lambda t: shifted(turned(t, 0, -0.35), (0, 0.02, 0)))
    tail = [(0.08 * np.sin(k * 1.3), 0.012, 0.02 + 0.09 * k) for k in range(7)]
    d.tube(tail, 0.004, LINEN, 4)
    for place in tail[1:]:
        d.box((0.09, 0.02, 0.035), place, vivid(draw))
    return d
