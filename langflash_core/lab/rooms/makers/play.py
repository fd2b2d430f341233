"""Makers of what people play on and train with (see `makers.common`).

Metres, y up, front +z.
"""

import numpy as np

from langflash_core.lab.rooms.makers.kit import (
    BLACK,
    DARK,
    LINEN,
    PICTURE,
    QUARTER,
    RUBBER,
    SIDES,
    STEEL,
    TURN,
    WATER,
    WHITE,
    Design,
    Draw,
    Look,
    across,
    ball,
    box,
    cylinder,
    dappled,
    four_legs,
    lathe,
    loft,
    merge,
    open_box,
    pad,
    plain,
    polar,
    rounded,
    scaled,
    shifted,
    slab,
    spread,
    torus,
    tube,
    turned,
    vivid,
)

_FELT = plain((0.08, 0.38, 0.22))


_BOARD = ((0.15, 0), (0.6, 0.04), (0.9, 0.2), (1, 0.45), (0.85, 0.72), (0.5, 0.92), (0.1, 1))


def game_table(draw: Draw) -> Design:
    """Tables for balls, pucks and chessmen, and a pinball machine."""
    tables = (_pool_table, _pool_table, _table_football, _table_football, _ping_pong_table)
    return draw.one_of((*tables, _air_hockey, _chess_table, _pinball))(draw)


def _pool_table(draw: Draw) -> Design:
    d = Design("pool table", "game table", ("billiard table", "snooker table"))
    length, wide, top = draw.between(1.9, 2.6), draw.between(1.05, 1.4), draw.between(0.78, 0.84)
    wood, felt = draw.wooden(), draw.one_of((_FELT, plain((0.1, 0.25, 0.5)), plain((0.5, 0.1, 0.12))))
    d.box((length - 0.1, 0.12, wide - 0.1), (0, top - 0.1, 0), felt)
    rail, deep = 0.12, draw.between(0.12, 0.25)
    for s in SIDES:
        d.box((length, deep, rail), (0, top + 0.03 - deep / 2, s * (wide - rail) / 2), wood)
        d.box((rail, deep, wide - 2 * rail), (s * (length - rail) / 2, top + 0.03 - deep / 2, 0), wood)
        for x in (-1, 0, 1):
            d.cylinder(0.065, 0.03, (x * (length / 2 - 0.09), top + 0.008, s * (wide / 2 - 0.09)), BLACK)
        for x in (-0.42, 0.42):
            leg = ((0.06, 0), (0.05, 0.05), (0.09, 0.35), (0.06, 0.5), (0.09, top - 0.1))
            if felt is _FELT:
                d.add(lathe(leg, (x * length, 0, s * wide * 0.36), 10), wood)
            else:
                d.box((0.13, top - 0.1, 0.13), (x * length, top / 2 - 0.05, s * wide * 0.36), wood)
    for k in range(draw.count(4, 9)):
        tone = WHITE if k == 0 else vivid(draw)
        place = (draw.between(-0.38, 0.38) * length, top - 0.012, draw.between(-0.3, 0.3) * wide)
        ball(d, (0.06, 0.06, 0.06), place, tone, 4)
    cue = tube(
        ((-0.7, top + 0.045, 0.3 * wide), (0.7, top + 0.045, draw.between(-0.4, 0.5) * wide)), 0.012, 5
    )
    d.add(cue, draw.wooden())
    return d


def _table_football(draw: Draw) -> Design:
    d = Design("table football", "game table", ("foosball table", "kicker"))
    length, wide, top = draw.between(1.15, 1.45), draw.between(0.62, 0.75), draw.between(0.83, 0.92)
    look, leg = draw.body(), draw.legs()
    deep = 0.22
    open_box(d, (length, deep, wide), (0, top - deep, 0), look, 0.03)
    d.box((length - 0.06, 0.01, wide - 0.06), (0, top - deep + 0.06, 0), plain((0.15, 0.5, 0.2)))
    d.box((0.012, 0.012, wide - 0.06), (0, top - deep + 0.062, 0), WHITE)
    four_legs(d, draw, length * 0.95, wide * 0.95, top - deep, leg)
    teams = (vivid(draw), vivid(draw))
    for k, x in enumerate(spread(-length * 0.42, length * 0.42, 8)):
        side = 1 if k in (0, 1, 3, 5) else -1
        d.tube(((x, top - 0.06, -wide / 2 - 0.13), (x, top - 0.06, wide / 2 + 0.13)), 0.008, STEEL, 5)
        d.add(across(0.018, 0.1, (x, top - 0.06, side * (wide / 2 + 0.17)), 2, 8), BLACK)
        for z in spread(-wide * 0.3, wide * 0.3, (1, 2, 3, 5, 5, 3, 2, 1)[k]):
            d.box((0.022, 0.11, 0.03), (x, top - 0.08, z), teams[k % 2])
            d.box((0.022, 0.025, 0.022), (x, top - 0.02, z), teams[k % 2])
    return d


def _ping_pong_table(draw: Draw) -> Design:
    d = Design("ping-pong table", "game table", ("table tennis table",))
    s = draw.one_of((1.0, 0.85, 0.7))
    length, wide, top = 2.74 * s, 1.52 * s, 0.76
    look = draw.one_of(
        (plain((0.08, 0.2, 0.45), 0.2), plain((0.08, 0.3, 0.2), 0.2), plain((0.2, 0.22, 0.25), 0.2))
    )
    for side in SIDES:
        x = side * length / 4
        d.box((length / 2 - 0.01, 0.03, wide), (x, top - 0.015, 0), look)
        d.box((0.02, 0.004, wide), (side * (length / 2 - 0.015), top, 0), WHITE)
        d.box((length, 0.004, 0.02), (0, top, side * (wide / 2 - 0.012)), WHITE)
        for z in (-wide * 0.4, wide * 0.4):
            d.tube(((x * 1.4, 0, z), (x * 1.4, top, z)), 0.02, DARK, 6)
            d.tube(((x * 0.5, 0, z), (x * 0.5, top, z)), 0.02, DARK, 6)
        d.tube(((x * 1.4, 0.3, -wide * 0.4), (x * 1.4, 0.3, wide * 0.4)), 0.015, DARK, 6)
        bat = turned(cylinder(0.08, 0.012, (0, 0, 0), segments=12), 1, draw.between(0, 6))
        d.add(shifted(bat, (side * length * 0.3, top, draw.between(-0.3, 0.3))), vivid(draw))
    d.box((length, 0.004, 0.01), (0, top, 0), WHITE)
    d.box((0.006, 0.14, wide + 0.2), (0, top + 0.08, 0), plain((0.2, 0.22, 0.25), opacity=0.6))
    d.box((0.012, 0.02, wide + 0.2), (0, top + 0.15, 0), WHITE)
    return d


def _air_hockey(draw: Draw) -> Design:
    d = Design("air hockey table", "game table", ("air hockey",))
    length, wide, top = draw.between(1.5, 2.1), draw.between(0.75, 1.05), draw.between(0.76, 0.82)
    look, line = vivid(draw) if draw.chance(0.6) else BLACK, vivid(draw)
    d.box((length * 0.97, 0.18, wide * 0.97), (0, top - 0.1, 0), WHITE)
    for s in SIDES:
        pad(d, (length, 0.16, 0.08), (0, top - 0.03, s * wide / 2), look, 0.03)
        pad(d, (0.08, 0.16, wide + 0.08), (s * length / 2, top - 0.03, 0), look, 0.03)
        d.box((0.005, 0.05, wide * 0.35), (s * (length / 2 - 0.042), top + 0.01, 0), BLACK)
        d.box((0.14, top - 0.15, wide * 0.8), (s * length * 0.36, top / 2 - 0.07, 0), look)
        d.lathe(((0.06, 0), (0.06, 0.02), (0.02, 0.03), (0.015, 0.07), (0, 0.075)), line, 12)
        triangles, mallet = d.parts.pop()
        d.add(shifted(triangles, (s * length * 0.35, top, draw.between(-0.2, 0.2))), mallet)
        d.add(torus(0.16, 0.008, (s * length * 0.47, top - 0.012, 0)), line)
    d.add(torus(0.16, 0.01, (0, top - 0.01, 0)), line)
    d.box((0.02, 0.004, wide * 0.95), (0, top - 0.008, 0), line)
    d.cylinder(0.04, 0.012, (draw.between(-0.3, 0.3), top - 0.005, 0.1), vivid(draw))
    return d


def _chess_table(draw: Draw) -> Design:
    d = Design("chess table", "game table", ("chess board", "chess"))
    side, top, wood = draw.between(0.5, 0.65), draw.between(0.55, 0.72), draw.wooden()
    d.box((side, 0.04, side), (0, top - 0.02, 0), wood)
    if draw.chance(0.5):
        four_legs(d, draw, side * 0.9, side * 0.9, top - 0.04, wood)
    else:
        path = (
            (side * 0.35, 0),
            (side * 0.3, 0.04),
            (0.05, 0.1),
            (0.07, top * 0.5),
            (0.04, top * 0.7),
            (0.1, top - 0.03),
        )
        d.lathe(path, wood, 14)
    cell, dark = side * 0.9 / 8, plain((0.18, 0.1, 0.06), 0.3)
    d.box((cell * 8, 0.004, cell * 8), (0, top, 0), plain((0.9, 0.84, 0.7), 0.3))
    for k in range(64):
        x, z = (k % 8 - 3.5) * cell, (k // 8 - 3.5) * cell
        if (k + k // 8) % 2:
            d.add(box((cell, 0.004, cell), (x, top + 0.002, z))[2 * 3 : 2 * 4], dark)
        row = k // 8
        if row in (0, 1, 6, 7) and draw.chance(0.8):
            tall = cell * (1.5 if row in (0, 7) else 0.95) * draw.between(0.9, 1.2)
            man = ((0.33, 0), (0.3, 0.1), (0.12, 0.3), (0.12, 0.65), (0.25, 0.8), (0, 1))
            d.add(lathe([(r * cell, y * tall) for r, y in man], (x, top, z), 6), BLACK if row < 2 else LINEN)
    return d


def _pinball(draw: Draw) -> Design:
    d = Design("pinball machine", "game table", ("pinball", "arcade game"))
    wide, long, look = draw.between(0.6, 0.72), draw.between(1.1, 1.3), vivid(draw)
    part = Design("", "")
    part.box((wide, 0.3, long), (0, 0, 0), look)
    part.box((wide * 0.9, 0.02, long * 0.95), (0, 0.15, 0), PICTURE)
    for s in SIDES:
        part.box((0.03, 0.05, long), (s * wide / 2, 0.16, 0), STEEL)
    for _ in range(8):
        place = (draw.between(-0.38, 0.38) * wide, 0.18, draw.between(-0.45, 0.3) * long)
        part.add(cylinder(0.03, 0.05, place, segments=10), vivid(draw))
    part.box((wide, 0.05, 0.03), (0, 0.14, long / 2), STEEL)
    merge(d, part, lambda t: shifted(turned(t, 0, 0.1), (0, 0.82, 0)))
    d.box((wide * 1.02, 0.65, 0.22), (0, 1.38, -long / 2 + 0.12), look)
    d.box((wide * 0.92, 0.52, 0.01), (0, 1.42, -long / 2 + 0.235), PICTURE)
    d.box((wide * 0.92, 0.09, 0.012), (0, 1.12, -long / 2 + 0.235), BLACK)
    for s in SIDES:
        for z, top in ((-0.46, 0.85), (0.46, 0.7)):
            d.box((0.05, top, 0.05), (s * wide * 0.5, top / 2, z * long), STEEL)
    return d


def fitness_machine(draw: Draw) -> Design:
    """What gyms and cellars hold to run, ride, lift and row on."""
    return draw.one_of((_treadmill, _exercise_bike, _weight_bench, _rowing_machine, _cross_trainer))(draw)


def _console(d: Design, y: float, z: float, wide: float, look: Look) -> None:
    """A slanted panel with a screen that faces the back, where the rider is."""
    for size, off, part in (
        ((wide, 0.2, 0.05), 0.0, look),
        ((wide * 0.6, 0.12, 0.01), -0.03, plain((0.15, 0.3, 0.4), 0.6)),
    ):
        d.add(turned(box(size, (0, y, z + off)), 0, 0.5, (0, y, z)), part)


def _treadmill(draw: Draw) -> Design:
    d = Design("treadmill", "fitness machine", ("running machine", "gym equipment"))
    wide, long, tall = draw.between(0.68, 0.85), draw.between(1.45, 1.85), draw.between(1.15, 1.4)
    look = draw.one_of((DARK, BLACK, STEEL, WHITE))
    d.box((wide * 0.7, 0.06, long * 0.92), (0, 0.16, -0.02), RUBBER)
    for s in SIDES:
        d.box((wide * 0.13, 0.1, long * 0.95), (s * wide * 0.42, 0.14, -0.02), look)
        top = (s * wide * 0.44, tall, long * 0.3)
        d.tube(((s * wide * 0.44, 0.1, long * 0.42), top), 0.03, STEEL if draw.chance(0.5) else look, 6)
        d.tube((top, (s * wide * 0.44, tall - 0.15, -0.05 * long)), 0.022, DARK, 6)
        d.box((0.06, 0.1, 0.1), (s * wide * 0.4, 0.05, -long * 0.45), BLACK)
    pad(d, (wide * 0.85, 0.2, 0.32), (0, 0.2, long * 0.4), look, 0.06)
    d.tube(((-wide * 0.44, tall, long * 0.3), (wide * 0.44, tall, long * 0.3)), 0.025, DARK, 6)
    _console(d, tall + 0.05, long * 0.31, wide * 0.8, look)
    return d


def _exercise_bike(draw: Draw) -> Design:
    d = Design("exercise bike", "fitness machine", ("stationary bicycle", "gym equipment"))
    look, grey, seat = vivid(draw), draw.metal(), draw.between(0.78, 0.9)
    for z in (-0.42, 0.45):
        d.add(across(0.035, 0.5, (0, 0.04, z), 0), BLACK)
    d.tube(((0, 0.05, -0.42), (0, 0.3, 0.0), (0, 0.05, 0.45)), 0.035, look)
    d.add(across(draw.between(0.2, 0.25), 0.06, (0, 0.32, 0.3), 0, 18), grey if draw.chance(0.5) else DARK)
    d.add(torus(0.24, 0.03, (0, 0.32, 0.3), 0), DARK)
    d.tube(((0, 0.3, 0.0), (0, seat - 0.06, -0.2)), 0.03, look)
    path = ((0, seat, -0.32), (0, seat, -0.2), (0, seat - 0.01, -0.03))
    d.add(loft(path, (0.07, 0.06, 0.02), 10, 1.6), BLACK)
    d.tube(((0, 0.3, 0.15), (0, seat + 0.22, 0.32)), 0.03, look)
    for s in SIDES:
        path = ((0, seat + 0.2, 0.32), (s * 0.22, seat + 0.2, 0.3), (s * 0.2, seat + 0.26, 0.08))
        d.tube(path, 0.016, BLACK, 6)
        path = ((s * 0.06, 0.32, 0.1), (s * 0.08, 0.32 + s * 0.14, 0.13), (s * 0.16, 0.32 + s * 0.14, 0.13))
        d.tube(path, 0.015, STEEL, 5)
        d.box((0.1, 0.025, 0.09), (s * 0.15, 0.32 + s * 0.14, 0.13), BLACK)
    _console(d, seat + 0.3, 0.34, 0.24, DARK)
    return d


def _weights(d: Design, y: float, z: float, radius: float, look: Look) -> None:
    d.add(across(0.015, 1.5, (0, y, z), 0, 8), STEEL)
    for s in SIDES:
        for x, r in ((0.58, radius), (0.63, radius * 0.8), (0.67, radius * 0.6)):
            d.add(across(r, 0.04, (s * x, y, z), 0, 14), look)


def _weight_bench(draw: Draw) -> Design:
    d = Design("weight bench", "fitness machine", ("bench press", "gym equipment"))
    look = draw.one_of((BLACK, plain((0.5, 0.08, 0.08)), DARK))
    frame, seat = draw.metal(), draw.between(0.42, 0.5)
    lean = draw.between(0.0, 0.7)
    pad(d, (0.3, 0.07, 0.4), (0, seat, 0.4), look, 0.03)
    back = Design("", "")
    pad(back, (0.3, 0.07, 0.8), (0, seat, -0.22), look, 0.03)
    merge(d, back, lambda t: turned(t, 0, lean, (0, seat, 0.18)))
    d.box((0.06, 0.06, 1.2), (0, seat - 0.08, 0), frame)
    for z in (-0.5, 0.55):
        d.box((0.06, seat - 0.08, 0.06), (0, seat / 2 - 0.04, z), frame)
        d.box((0.55, 0.05, 0.06), (0, 0.025, z), frame)
    tall = draw.between(0.95, 1.2)
    for s in SIDES:
        d.box((0.06, tall, 0.06), (s * 0.45, tall / 2, -0.65), frame)
        d.box((0.06, 0.06, 0.5), (s * 0.45, 0.03, -0.6), frame)
        d.box((0.05, 0.08, 0.1), (s * 0.45, tall - 0.03, -0.6), frame)
    d.box((0.9, 0.06, 0.06), (0, 0.3, -0.65), frame)
    _weights(d, tall, -0.6, draw.between(0.14, 0.22), BLACK if draw.chance(0.7) else vivid(draw))
    return d


def _rowing_machine(draw: Draw) -> Design:
    d = Design("rowing machine", "fitness machine", ("rower", "gym equipment"))
    long, rail = draw.between(1.8, 2.3), draw.between(0.25, 0.4)
    look = STEEL if draw.chance(0.5) else draw.wooden()
    d.box((0.09, 0.08, long), (0, rail, 0), look)
    d.add(across(0.25, 0.14, (0, rail + 0.14, long / 2 - 0.2), 0, 18), DARK if draw.chance(0.7) else WATER)
    d.add(torus(0.25, 0.02, (0, rail + 0.14, long / 2 - 0.2), 0), BLACK)
    for z in (-long / 2 + 0.05, long / 2 - 0.2):
        d.box((0.06, rail, 0.06), (0, rail / 2, z), look)
        d.box((0.5, 0.05, 0.07), (0, 0.025, z), DARK)
    pad(d, (0.34, 0.07, 0.28), (0, rail + 0.1, draw.between(-0.5, 0.1)), BLACK, 0.03)
    for s in SIDES:
        foot = box((0.12, 0.3, 0.03), (s * 0.15, rail + 0.1, long / 2 - 0.55))
        d.add(turned(foot, 0, 0.6, (0, rail + 0.05, long / 2 - 0.55)), BLACK)
    d.add(across(0.016, 0.48, (0, rail + 0.25, long / 2 - 0.55), 0, 8), BLACK)
    d.tube(((0, rail + 0.3, long / 2 - 0.2), (0, rail + 0.65, long / 2 - 0.35)), 0.02, DARK, 6)
    _console(d, rail + 0.65, long / 2 - 0.36, 0.24, BLACK)
    return d


def _cross_trainer(draw: Draw) -> Design:
    d = Design("cross trainer", "fitness machine", ("elliptical trainer", "gym equipment"))
    look, grey, tall = draw.one_of((DARK, WHITE, BLACK)), draw.metal(), draw.between(1.45, 1.65)
    for z in (-0.6, 0.6):
        d.add(across(0.035, 0.6, (0, 0.04, z), 0), BLACK)
    d.box((0.08, 0.07, 1.2), (0, 0.08, 0), grey)
    d.add(across(0.3, 0.14, (0, 0.36, -0.42), 0, 18), look)
    d.tube(((0, 0.08, 0.45), (0, tall - 0.2, 0.38)), 0.035, grey)
    for s in SIDES:
        up = s * 0.1
        d.tube(((s * 0.2, 0.36 + up, -0.5), (s * 0.2, 0.22 + up * 0.3, 0.5)), 0.025, grey, 6)
        pad(d, (0.15, 0.05, 0.36), (s * 0.2, 0.36 + up * 0.7, -0.02), BLACK, 0.02)
        path = ((s * 0.2, 0.22 + up * 0.3, 0.5), (s * 0.24, 0.85, 0.4), (s * 0.26, 1.15, 0.36 - up))
        d.tube(path, 0.02, grey, 6)
        d.tube(((s * 0.26, 1.15, 0.36 - up), (s * 0.22, tall, 0.2 - up)), 0.028, BLACK, 6)
    _console(d, tall - 0.15, 0.38, 0.3, look)
    return d


def sports_gear(draw: Draw) -> Design:
    """Balls, weights, boards, bags and a helmet."""
    balls = (_dumbbells, _football, _basketball, _tennis_racket)
    return draw.one_of((*balls, _skis, _surfboard, _punching_bag, _golf_bag, _helmet))(draw)


def _dumbbells(draw: Draw) -> Design:
    d = Design("dumbbells", "sports gear", ("weights", "dumbbell"))
    look = draw.one_of((BLACK, STEEL, vivid(draw)))
    radius, long, sides = draw.between(0.035, 0.09), draw.between(0.16, 0.3), draw.one_of((6, 14))
    for z in (-radius * 1.4, radius * 1.4)[: draw.count(1, 2)]:
        one = [across(radius * 0.3, long * 0.7, (0, radius, z), 0, 8)]
        for s in SIDES:
            one.append(across(radius, long * 0.28, (s * long * 0.36, radius, z), 0, sides))
        for k, part in enumerate(one):
            d.add(turned(part, 1, draw.between(0.0, 0.3) if k == 0 else 0.0), STEEL if k == 0 else look)
    return d


def _football(draw: Draw) -> Design:
    d = Design("football", "sports gear", ("soccer ball", "ball"))
    radius, gold = draw.between(0.1, 0.115), 1.618
    ball = rounded((2 * radius, 2 * radius, 2 * radius), (0, 0, 0), 2.0, 14)
    corners = [(a, s * gold, 0.0) for a in SIDES for s in SIDES]
    axes = np.array([np.roll(c, k) for c in corners for k in range(3)]) / np.hypot(1, gold)
    outward = ball.mean(1) / np.linalg.norm(ball.mean(1), axis=1, keepdims=True)
    marked = (outward @ axes.T).max(1) > 0.93
    dappled(d, ball, marked, WHITE, BLACK if draw.chance(0.7) else vivid(draw))
    return d


def _basketball(draw: Draw) -> Design:
    d = Design("basketball", "sports gear", ("ball",))
    radius, tilt = draw.between(0.11, 0.125), draw.between(0, 1.5)
    finish = plain((0.8, draw.between(0.32, 0.45), 0.12), 0.1)
    ball(d, (2 * radius, 2 * radius, 2 * radius), (0, 0, 0), finish, 9)
    for axis in range(3):
        d.add(turned(torus(radius, 0.003, (0, 0, 0), axis, 20), 0, tilt), BLACK)
    for s in SIDES:
        d.add(turned(torus(radius * 0.8, 0.003, (0, s * radius * 0.6, 0), 1, 20), 0, tilt), BLACK)
    return d


def _tennis_racket(draw: Draw) -> Design:
    d = Design("tennis racket", "sports gear", ("racket",))
    look, part = vivid(draw), Design("", "")
    hoop = [(0.13 * np.sin(a), 0.5 - 0.17 * np.cos(a), 0.0) for a in spread(0, TURN, 17)]
    part.tube(hoop, 0.013, look, 6)
    for k in range(-4, 5):
        x, y = 0.026 * k, 0.034 * k
        tall, wide = 0.17 * np.sqrt(1 - (x / 0.13) ** 2), 0.13 * np.sqrt(1 - (y / 0.17) ** 2)
        part.box((0.003, 2 * tall, 0.003), (x, 0.5, 0), LINEN)
        part.box((2 * wide, 0.003, 0.003), (0, 0.5 + y, 0), LINEN)
    for s in SIDES:
        part.tube(((0, 0.2, 0), (s * 0.07, 0.355, 0)), 0.01, look, 6)
    part.tube(((0, 0, 0), (0, 0.21, 0)), 0.018, BLACK)
    if draw.chance(0.6):
        merge(d, part, lambda t: shifted(turned(t, 0, -QUARTER), (0, 0.02, 0.3)))
        ball(d, (0.066, 0.066, 0.066), (0.2, 0.033, draw.between(-0.2, 0.2)), plain((0.8, 0.9, 0.2)))
    else:
        merge(d, part, lambda t: turned(t, 0, -0.3))
    return d


def _skis(draw: Draw) -> Design:
    d = Design("skis", "sports gear", ("pair of skis", "ski equipment"))
    look, tall, pair = vivid(draw), draw.between(1.4, 1.85), Design("", "")
    for s in SIDES:
        ski = ((0.8, 0), (1, 0.05), (0.75, 0.5), (1, 0.93), (0.5, 0.99))
        pair.add(slab(ski, (0.11, tall, 0.018), (s * 0.07, 0, 0)), look)
        pair.box((0.06, tall * 0.3, 0.002), (s * 0.07, tall * 0.7, 0.01), WHITE)
        for y in (0.4, 0.52):
            pair.box((0.08, 0.09, 0.06), (s * 0.07, tall * y, 0.03), DARK)
        pair.tube(((s * 0.22, 0, 0.02), (s * 0.17, 1.15, 0.02)), 0.009, STEEL, 6)
        pair.tube(((s * 0.175, 1.02, 0.02), (s * 0.17, 1.16, 0.02)), 0.018, BLACK, 6)
        pair.roll(0.045, 0.006, (s * 0.217, 0.08, 0.02), BLACK, 10)
    lean = draw.between(0.08, 0.2)
    merge(d, pair, lambda t: turned(t, 0, -lean))
    return d


def _surfboard(draw: Draw) -> Design:
    snow = draw.chance(0.35)
    d = Design("snowboard" if snow else "surfboard", "sports gear", ("board",))
    tall, wide = (
        (draw.between(1.35, 1.6), 0.28) if snow else (draw.between(1.7, 2.3), draw.between(0.46, 0.56))
    )
    shape = (
        ((0.5, 0), (0.95, 0.06), (1, 0.14), (0.82, 0.5), (1, 0.86), (0.95, 0.94), (0.5, 1))
        if snow
        else _BOARD
    )
    board, look, lean = Design("", ""), vivid(draw), draw.between(0.1, 0.22)
    board.add(
        slab(shape, (wide, tall, 0.02 if snow else 0.06)), WHITE if draw.chance(0.4) and not snow else look
    )
    z = 0.012 if snow else 0.032
    if draw.chance(0.6):
        board.add(slab(shape, (wide * 0.5, tall * 0.9, 0.004), (0, tall * 0.05, z)), vivid(draw))
    size = (0.02 if not snow else wide * 0.5, tall * 0.98 if not snow else 0.2, 0.005)
    board.box(size, (0, tall / 2, z), vivid(draw))
    if snow:
        for y in (0.32, 0.62):
            pad(board, (0.2, 0.11, 0.12), (0, tall * y, 0.07), DARK, 0.03)
    merge(d, board, lambda t: turned(t, 0, -lean))
    return d


def _punching_bag(draw: Draw) -> Design:
    d = Design("punching bag", "sports gear", ("boxing bag", "heavy bag"))
    look = draw.one_of((BLACK, plain((0.6, 0.08, 0.08), 0.3), vivid(draw)))
    tall, radius = draw.between(0.9, 1.2), 0.17
    foot = draw.between(0.35, 0.55)
    bag = ((0, 0), (0.85, 0.01), (1, 0.06), (1, 0.94), (0.85, 0.99), (0, 1))
    d.add(lathe(scaled(bag, radius, tall), (0, foot, 0), 16), look)
    for y in (0.15, 0.85):
        d.add(cylinder(radius * 1.01, 0.05, (0, foot + tall * y, 0)), WHITE if draw.chance(0.5) else DARK)
    if draw.chance(0.5):
        d.cylinder(0.3, 0.14, (0, 0, 0), BLACK, 0.22)
        d.cylinder(0.08, foot, (0, 0.1, 0), DARK)
    else:
        top, z = foot + tall + 0.25, -0.5
        d.tube(((0, 0.02, z), (0, top + 0.05, z), (0, top, 0)), 0.03, DARK)
        for s in SIDES:
            d.tube(((0, 0.03, z), (s * 0.45, 0.03, 0.35)), 0.03, DARK)
            d.tube(((0, top, 0), (s * 0.12, foot + tall * 0.98, 0)), 0.008, STEEL, 5)
    return d


def _golf_bag(draw: Draw) -> Design:
    d = Design("golf bag", "sports gear", ("golf clubs",))
    look, trim, part = vivid(draw), draw.one_of((BLACK, WHITE)), Design("", "")
    part.lathe(((0, 0), (0.13, 0), (0.12, 0.3), (0.14, 0.85), (0.11, 0.85), (0.1, 0.8), (0, 0.8)), look, 14)
    for y in (0.0, 0.78):
        part.cylinder(0.145, 0.08, (0, y, 0), trim)
    pad(part, (0.17, 0.4, 0.08), (0, 0.35, 0.13), trim if draw.chance(0.5) else look, 0.03)
    for k in range(draw.count(5, 9)):
        tip = polar(0.1, 2.4 * k, draw.between(1.02, 1.2))
        part.tube((polar(0.06, 2.4 * k, 0.75), tip), 0.008, STEEL, 5)
        if k % 3:
            part.box((0.09, 0.05, 0.025), (tip[0] + 0.03, tip[1], tip[2]), STEEL)
        else:
            ball(part, (0.11, 0.08, 0.08), (tip[0] + 0.03, tip[1], tip[2]), draw.one_of((BLACK, look)), 5)
    lean = draw.between(0.15, 0.35)
    merge(d, part, lambda t: turned(t, 0, -lean))
    for s in SIDES:
        d.tube(((s * 0.05, 0.6, -0.28), (s * 0.2, 0, -0.55)), 0.01, DARK, 5)
    return d


def _helmet(draw: Draw) -> Design:
    full = draw.chance(0.5)
    d = Design("motorcycle helmet" if full else "bicycle helmet", "sports gear", ("helmet",))
    look = vivid(draw) if draw.chance(0.7) else BLACK
    if full:
        ball(d, (0.25, 0.26, 0.31), (0, 0.15, 0), look, 8)
        pad(d, (0.2, 0.08, 0.16), (0, 0.06, 0.1), look, 0.04)
        d.add(cylinder(0.1, 0.03, (0, 0, 0.01), segments=12), DARK)
        pane = rounded((0.24, 0.2, 0.32), (0, 0.16, 0.01), 2.0, 10)
        centre = pane.mean(1)
        keep = (centre[:, 2] > 0.05) & (np.abs(centre[:, 1] - 0.16) < 0.05)
        d.add(pane[keep] * np.array([1.01, 1, 1.02]), BLACK)
        return d
    shell = rounded((0.22, 0.28, 0.3), (0, 0.0, 0), 2.0, 10)
    centre = shell.mean(1)
    keep = centre[:, 1] > 0
    vents = (np.sin(centre[:, 0] * 110) > 0.35) & (centre[:, 1] > 0.05)
    dappled(d, shell[keep], vents[keep], look, BLACK)
    for s in SIDES:
        d.tube(((s * 0.09, 0.02, 0.05), (s * 0.05, -0.06, 0.0), (s * 0.09, 0.02, -0.06)), 0.005, DARK, 4)
    return d
