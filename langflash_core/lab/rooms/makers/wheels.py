"""Makers of what rolls: bicycles, tricycles, boards, prams, wheelchairs (see `makers.common`).

Metres, y up, front +z.
"""

import numpy as np

from langflash_core.lab.rooms.builtin import KIND_FABRIC
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
    Look,
    Material,
    across,
    loft,
    merge,
    open_box,
    pad,
    plain,
    rounded,
    slab,
    spread,
    torus,
    turned,
    vivid,
)


def bicycle(draw: Draw) -> Design:
    """Along x, its chain towards the front: racing, city, mountain and children's bicycles."""
    style = draw.style(4)
    name = ("racing bicycle", "city bicycle", "mountain bike", "children's bicycle")[style]
    d = Design(name, "bicycle", ("bicycle", "bike"))
    s = draw.between(0.6, 0.72) if style == 3 else draw.between(0.95, 1.03)
    wheel, thick = 0.33 * s, (0.014, 0.02, 0.03, 0.024)[style]
    look, metal = vivid(draw), STEEL if draw.chance(0.6) else BLACK
    rear, front, crank = (-0.52 * s, wheel, 0.0), (0.52 * s, wheel, 0.0), (-0.08 * s, wheel * 0.9, 0.0)
    saddle, head = (-0.2 * s, wheel + 0.55 * s, 0.0), (0.4 * s, wheel + 0.55 * s, 0.0)
    low = (0.42 * s, wheel + 0.42 * s, 0.0)
    for hub in (rear, front):
        d.add(torus(wheel, thick, hub, 2, 24), RUBBER)
        d.add(torus(wheel * 0.93, 0.008, hub, 2, 24), metal)
        d.add(across(0.02, 0.08, hub, 2, 8), metal)
        for k in range(8):
            x, y = wheel * 0.93 * np.cos(k * 0.393), wheel * 0.93 * np.sin(k * 0.393)
            d.tube(((hub[0] - x, hub[1] - y, 0), (hub[0] + x, hub[1] + y, 0)), 0.0025, STEEL, 3)
    step = draw.between(0.1, 0.2) * s if style == 1 else 0.48 * s
    joint = tuple(np.array(crank) + (np.array(saddle) - crank) * step / (0.62 * s))
    for path in (
        (crank, saddle),
        (crank, low),
        (joint, head if style != 1 else low),
        (rear, crank),
        (rear, joint),
    ):
        d.tube(path, 0.018, look, 7)
    d.tube((front, low, head, (0.37 * s, wheel + 0.62 * s, 0)), 0.017, look, 7)
    seat = (-0.22 * s, wheel + 0.63 * s, 0.0)
    d.tube((saddle, seat), 0.013, STEEL, 6)
    curve = ((seat[0] - 0.08, seat[1], 0), (seat[0], seat[1] + 0.01, 0), (seat[0] + 0.15, seat[1], 0))
    d.add(loft(curve, (0.035, 0.03, 0.015), 10, 2.2), BLACK)
    _handlebar(d, style, 0.37 * s, wheel + 0.62 * s)
    d.add(across(0.08 * s, 0.012, (crank[0], crank[1], 0.05), 2, 14), metal)
    d.tube(((rear[0], wheel + 0.04, 0.05), (crank[0], crank[1] + 0.08 * s, 0.05)), 0.006, DARK, 4)
    d.tube(((rear[0], wheel - 0.04, 0.05), (crank[0], crank[1] - 0.08 * s, 0.05)), 0.006, DARK, 4)
    for side in SIDES:
        tip = (crank[0] + side * 0.12 * s, crank[1] - side * 0.1 * s, side * 0.08)
        d.tube((crank, tip), 0.01, metal, 5)
        d.box((0.09, 0.02, 0.08), (tip[0], tip[1], tip[2] + side * 0.04), BLACK)
    if style in (1, 3) or draw.chance(0.2):
        _bicycle_extras(d, draw, wheel, s, look if draw.chance(0.5) else metal, style == 3)
    return d


def _handlebar(d: Design, style: int, x: float, y: float) -> None:
    for s in SIDES:
        if style == 0:
            path = (
                (x, y, 0),
                (x, y, s * 0.2),
                (x + 0.1, y, s * 0.2),
                (x + 0.12, y - 0.1, s * 0.2),
                (x + 0.02, y - 0.13, s * 0.2),
            )
        elif style == 2:
            path = ((x, y, 0), (x - 0.02, y + 0.02, s * 0.33))
        else:
            path = (
                (x, y, 0),
                (x + 0.03, y + 0.08, s * 0.15),
                (x - 0.08, y + 0.1, s * 0.27),
                (x - 0.2, y + 0.09, s * 0.28),
            )
        d.tube(path, 0.012, BLACK if style == 0 else STEEL, 6)
        d.tube(path[-2:], 0.016, BLACK, 6)


def _bicycle_extras(d: Design, draw: Draw, wheel: float, s: float, look: Look, child: bool) -> None:
    """Mudguards, a carrier or a basket, and stabilisers."""
    for x in (-0.52 * s, 0.52 * s):
        guard = [
            (x + (wheel + 0.035) * np.cos(a), wheel + (wheel + 0.035) * np.sin(a), 0.0)
            for a in spread(0.5, 3.0, 8)
        ]
        d.tube(guard, 0.018, look, 4)
    if draw.chance(0.6):
        d.box((0.34 * s, 0.015, 0.13), (-0.52 * s, 2 * wheel + 0.08, 0), DARK)
    if draw.chance(0.5):
        wicker = Material((0.62, 0.47, 0.3)), KIND_FABRIC
        open_box(d, (0.24 * s, 0.2 * s, 0.3 * s), (0.53 * s, 2 * wheel + 0.1, 0), wicker)
    if child and draw.chance(0.6):
        for side in SIDES:
            d.add(torus(0.06, 0.015, (-0.52 * s, 0.075, side * 0.16), 2, 12), WHITE)
            d.tube(((-0.52 * s, wheel, 0), (-0.52 * s, 0.075, side * 0.15)), 0.01, STEEL, 5)


def tricycle(draw: Draw) -> Design:
    """A child's, of steel or plastic, some with a bar to push."""
    d = Design("tricycle", "tricycle", ("children's tricycle",))
    look, other, s = vivid(draw), vivid(draw), draw.between(0.85, 1.15)
    front, rear = draw.between(0.12, 0.17) * s, draw.between(0.08, 0.11) * s
    tyre = BLACK if draw.chance(0.6) else other
    wheels = ((0.0, front, 0.25 * s), (-0.17 * s, rear, -0.25 * s), (0.17 * s, rear, -0.25 * s))
    for x, r, z in wheels:
        d.add(across(r, 0.05 * s, (x, r, z), 0, 16), tyre)
        d.add(across(r * 0.65, 0.056 * s, (x, r, z), 0, 12), WHITE if draw.chance(0.5) else look)
    d.add(across(0.014, 0.34 * s, (0, rear, -0.25 * s), 0, 6), STEEL)
    neck = (0.0, 0.42 * s, 0.16 * s)
    d.tube(((0, rear, -0.25 * s), (0, 0.22 * s, -0.05 * s), (0, 0.3 * s, 0.18 * s)), 0.022 * s, look)
    for side in SIDES:
        d.tube(((side * 0.04, front, 0.25 * s), (side * 0.04, front + 0.16, 0.22 * s)), 0.012, look, 6)
        d.tube((neck, (side * 0.18 * s, 0.48 * s, 0.12 * s)), 0.012, STEEL, 6)
        d.tube(
            ((side * 0.11 * s, 0.46 * s, 0.14 * s), (side * 0.19 * s, 0.48 * s, 0.115 * s)), 0.02, other, 6
        )
        d.box((0.08, 0.025, 0.07), (side * 0.09 * s, front + side * 0.05, 0.25 * s), other)
    d.tube(((0, front + 0.13, 0.22 * s), neck), 0.018, look, 6)
    pad(d, (0.2 * s, 0.05, 0.22 * s), (0, 0.3 * s, -0.12 * s), other, 0.025)
    if draw.chance(0.5):
        pad(d, (0.2 * s, 0.16 * s, 0.04), (0, 0.4 * s, -0.23 * s), other, 0.02)
    if draw.chance(0.4):
        d.tube(((0, 0.2 * s, -0.27 * s), (0, 0.95 * s, -0.5 * s)), 0.013, look, 6)
        d.add(across(0.018, 0.26, (0, 0.95 * s, -0.5 * s), 0, 8), BLACK)
    return d


def skateboard(draw: Draw) -> Design:
    """A deck that bends up at both ends on four wheels; also long boards and scooters."""
    if draw.chance(0.3):
        return _scooter(draw)
    d = Design("skateboard", "skateboard", ("longboard",))
    long, wide = draw.between(0.65, 1.0), draw.between(0.18, 0.23)
    look, wheel = draw.wooden() if draw.chance(0.4) else vivid(draw), draw.one_of((WHITE, vivid(draw)))
    top, bend = 0.1, draw.between(0.02, 0.06)
    deck, grip = Design("", ""), []
    outline = ((0.45, 0), (0.9, 0.06), (1, 0.15), (1, 0.5), (1, 0.85), (0.9, 0.94), (0.45, 1))
    for k, look_of in enumerate((look, DARK if draw.chance(0.7) else look)):
        board = turned(slab(outline, (wide, long, 0.012 - 0.008 * k), (0, -long / 2, 0.008 * k)), 0, -QUARTER)
        lift = bend * np.clip((np.abs(board[..., 2]) / long - 0.3) / 0.2, 0, 1) ** 1.5
        grip.append((board + np.array([0, top, 0]) + lift[..., None] * np.array([0, 1, 0]), look_of))
    deck.parts = grip
    for s in SIDES:
        z = s * long * 0.31
        deck.box((0.05, 0.04, 0.07), (0, 0.07, z), STEEL)
        deck.add(across(0.012, wide * 0.9, (0, 0.04, z), 0, 6), STEEL)
        for side in SIDES:
            deck.add(across(0.032, 0.035, (side * wide * 0.42, 0.032, z), 0, 12), wheel)
    merge(d, deck, lambda t: turned(t, 1, QUARTER))
    return d


def _scooter(draw: Draw) -> Design:
    d = Design("kick scooter", "skateboard", ("scooter",))
    look, s, wheel = vivid(draw), draw.between(0.75, 1.05), RUBBER
    for z in (-0.36 * s, 0.36 * s):
        d.add(across(0.07 * s, 0.03, (0, 0.07 * s, z), 0, 14), wheel)
        d.add(across(0.045 * s, 0.034, (0, 0.07 * s, z), 0, 10), WHITE)
    pad(d, (0.12, 0.03, 0.55 * s), (0, 0.09 * s, -0.05), look, 0.012)
    d.tube(((0, 0.09 * s, 0.2 * s), (0, 0.2 * s, 0.3 * s), (0, 0.9 * s, 0.24 * s)), 0.018, STEEL, 7)
    d.tube(((0, 0.07 * s, 0.36 * s), (0, 0.25 * s, 0.3 * s)), 0.022, look, 6)
    for side in SIDES:
        d.tube(((0, 0.9 * s, 0.24 * s), (side * 0.2, 0.9 * s, 0.23 * s)), 0.012, STEEL, 6)
        d.tube(((side * 0.11, 0.9 * s, 0.235 * s), (side * 0.21, 0.9 * s, 0.23 * s)), 0.019, look, 6)
    return d


def stroller(draw: Draw) -> Design:
    """A pram with a hood, or a buggy with a seat."""
    pram = draw.chance(0.5)
    d = Design("pram" if pram else "stroller", "stroller", ("buggy", "baby carriage"))
    cloth, metal, tyre = draw.cloth(), draw.metal(), RUBBER
    wide, bed = draw.between(0.36, 0.44), draw.between(0.5, 0.62)
    rear = draw.between(0.09, 0.17)
    front = rear if draw.chance(0.5) else draw.between(0.07, 0.1)
    spots = [(s * wide * 0.62, r, z) for s in SIDES for r, z in ((rear, -0.32), (front, 0.34))]
    if draw.chance(0.25):
        spots = [*[p for p in spots if p[2] < 0], (0.0, front, 0.42)]
    for x, r, z in spots:
        d.add(torus(r - 0.02, 0.02, (x, r, z), 0, 16), tyre)
        d.add(across(r * 0.35, 0.03, (x, r, z), 0, 8), metal)
        for k in range(3):
            y, off = (r - 0.02) * np.cos(k * 1.047), (r - 0.02) * np.sin(k * 1.047)
            d.tube(((x, r - y, z - off), (x, r + y, z + off)), 0.005, metal, 4)
    handle = draw.between(0.98, 1.08)
    for s in SIDES:
        x = s * wide * 0.55
        d.tube(((spots[0][0] * -s, rear, -0.32), (x, bed - 0.04, 0.15)), 0.014, metal, 6)
        path = (
            (x if len(spots) == 4 else 0.0, front, spots[-1][2]),
            (x, bed - 0.02, 0.0),
            (x, handle, -0.58),
        )
        d.tube(path, 0.014, metal, 6)
    d.add(across(0.018, wide * 1.1, (0, handle, -0.58), 0, 8), BLACK)
    open_box(d, (wide * 0.9, 0.12, 0.45), (0, 0.2, -0.02), DARK, 0.015)
    if pram:
        pad(d, (wide, 0.2, 0.78), (0, bed + 0.07, 0), cloth, 0.09)
        pad(d, (wide * 0.9, 0.07, 0.45), (0, bed + 0.18, 0.12), cloth if draw.chance(0.5) else LINEN, 0.03)
        hood_at, reach = (0.0, bed + 0.12, -0.17), 0.3
    else:
        pad(d, (wide * 0.9, 0.06, 0.32), (0, bed, 0.06), cloth, 0.03)
        back = Design("", "")
        pad(back, (wide * 0.9, 0.5, 0.06), (0, bed + 0.25, -0.12), cloth, 0.03)
        merge(d, back, lambda t: turned(t, 0, -0.35, (0, bed, -0.1)))
        path = (
            (-wide / 2, bed + 0.18, 0.0),
            (-wide / 2, bed + 0.18, 0.25),
            (wide / 2, bed + 0.18, 0.25),
            (wide / 2, bed + 0.18, 0),
        )
        d.tube(path, 0.018, BLACK, 6)
        d.box((wide * 0.8, 0.02, 0.12), (0, 0.24, 0.34), DARK)
        hood_at, reach = (0.0, bed + 0.38, -0.2), 0.3
    hood = rounded((wide * 1.04, 2 * reach, 2 * reach), hood_at, 3.0, 10)
    inside = hood.mean(1) - np.array(hood_at)
    finish = cloth if draw.chance(0.7) else draw.cloth()
    d.add(hood[(inside[:, 1] > -0.02) & (inside[:, 2] < 0.35 * inside[:, 1] + 0.04)], finish)
    return d


def wheelchair(draw: Draw) -> Design:
    """Two large wheels with hoops, two small, foot plates and handles."""
    d = Design("wheelchair", "wheelchair", ("wheel chair",))
    wide, seat, metal = draw.between(0.42, 0.5), draw.between(0.48, 0.52), draw.metal()
    cloth = draw.one_of((BLACK, DARK, plain((0.1, 0.15, 0.35)), plain((0.45, 0.08, 0.1))))
    big = draw.between(0.27, 0.31)
    for s in SIDES:
        x = s * (wide / 2 + 0.05)
        d.add(torus(big - 0.015, 0.015, (x, big, -0.12), 0, 22), RUBBER)
        d.add(torus(big * 0.86, 0.008, (x + s * 0.03, big, -0.12), 0, 22), STEEL)
        d.add(across(0.03, 0.05, (x, big, -0.12), 0, 8), metal)
        for k in range(6):
            y, z = big * 0.93 * np.cos(k * 0.5236), big * 0.93 * np.sin(k * 0.5236)
            d.tube(((x, big - y, -0.12 - z), (x, big + y, -0.12 + z)), 0.003, STEEL, 3)
        d.add(across(0.08, 0.03, (s * wide * 0.45, 0.08, 0.3), 0, 14), RUBBER)
        d.tube(((s * wide * 0.45, 0.08, 0.3), (s * wide * 0.45, seat, 0.26)), 0.015, metal, 6)
        path = ((s * wide * 0.5, 0.2, -0.2), (s * wide * 0.5, 0.93, -0.26), (s * wide * 0.5, 0.93, -0.38))
        d.tube(path, 0.014, metal, 6)
        d.tube(((s * wide * 0.5, 0.93, -0.3), (s * wide * 0.5, 0.93, -0.4)), 0.02, BLACK, 6)
        frame = ((s * wide * 0.5, seat, -0.23), (s * wide * 0.5, seat, 0.25), (s * wide * 0.4, 0.15, 0.42))
        d.tube(frame, 0.014, metal, 6)
        d.box((0.15, 0.015, 0.16), (s * wide * 0.22, 0.12, 0.48), DARK)
        pad(d, (0.06, 0.04, 0.3), (s * wide * 0.52, seat + 0.22, -0.05), BLACK, 0.015)
        d.box((0.012, 0.2, 0.3), (s * wide * 0.5, seat + 0.1, -0.05), metal if draw.chance(0.5) else cloth)
    pad(d, (wide * 0.98, 0.06, 0.44), (0, seat, 0.02), cloth, 0.025)
    d.box((wide * 0.98, 0.4, 0.025), (0, seat + 0.24, -0.24), cloth)
    d.tube(((-wide / 2, 0.2, -0.1), (wide / 2, seat - 0.02, -0.1)), 0.01, metal, 5)
    d.tube(((wide / 2, 0.2, -0.1), (-wide / 2, seat - 0.02, -0.1)), 0.01, metal, 5)
    return d
