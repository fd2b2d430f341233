"""Makers of what lies on desks and hangs in offices (see `makers.common`).

Metres, y up, front +z.
"""

import numpy as np

from langflash_core.lab.rooms.makers.flat import (
    BLUE,
    GLASS,
    GREEN,
    INK,
    PAPER,
    PICTURE,
    RED,
    YELLOW,
    casing,
    leaf_at,
    prism,
    put_flat,
    rod_across,
    round_cornered,
    rounded_ring,
    rounded_slab,
    turned_over,
    vivid_paint,
)
from langflash_core.lab.rooms.makers.kit import (
    BLACK,
    DARK,
    QUARTER,
    SIDES,
    STEEL,
    WHITE,
    Design,
    Draw,
    Vector,
    box,
    boxes,
    cylinder,
    plain,
    rounded,
    turned,
)


def whiteboard(draw: Draw) -> Design:
    """White and chalk boards, hung or on wheels, and flip charts; written on, with pens or chalk."""
    style = draw.one_of((0, 0, 1, 2, 3))
    d = Design(("whiteboard", "whiteboard", "flip chart", "chalkboard")[style], "whiteboard", ("board",))
    w, h = (0.7, 1.0) if style == 2 else (draw.between(0.7, 1.9), draw.between(0.6, 1.1))
    frame = draw.wooden() if style == 3 else STEEL
    d.box((w, h, 0.02), (0, 0, 0), draw.one_of((GREEN, DARK)) if style == 3 else WHITE)
    boxes(d, frame, *((w + 0.03, 0.025, 0.03, 0, s * h / 2, 0) for s in SIDES))
    boxes(d, frame, (w * 0.6, 0.012, 0.07, 0, -h / 2, 0.04))
    boxes(d, frame, *((0.025, h, 0.03, s * w / 2, 0, 0) for s in SIDES))
    inks = (PAPER,) if style == 3 else (INK, BLUE, RED, GREEN)
    for k in range(draw.count(3, 12)):
        x, y, ink = w * (0.05 - 0.5 * (k % 2) + 0.02), h * (0.38 - 0.13 * (k // 2)), draw.one_of(inks)
        for start in np.arange(x, x + w * draw.between(0.1, 0.4), 0.14):
            d.tube([(start + m * 0.02, y + draw.between(0, 0.045), 0.011) for m in range(7)], 0.004, ink, 3)
    boxes(d, draw.one_of(inks), *((0.13, 0.016, 0.016, x * w, -h / 2 + 0.014, 0.05) for x in (-0.2, 0.0)))
    d.box((0.12, 0.035, 0.045), (w * 0.2, -h / 2 + 0.02, 0.045), DARK)
    if style in (0, 3):
        d.elevation = draw.between(0.8, 1.0)
        return d
    turned_over(d, 0, 0.12 - 0.12 * style, draw.between(0.75, 0.9))
    for x in (-w / 2, w / 2):
        d.tube(((x * 0.9, 1.2, -0.03), (x, 0.06 * (2 - style), 0.1 * (style - 1))), 0.016, STEEL, 6)
        if style == 1:
            d.box((0.04, 0.03, 0.5), (x, 0.065, 0), STEEL)
            rod_across(d, BLACK, 0.035, 0.025, (x, 0.035, 0.22))
            rod_across(d, BLACK, 0.035, 0.025, (x, 0.035, -0.22))
    bar = ((0, 1.5, -0.12), (0, 0, -0.55)) if style == 2 else ((-w / 2, 0.3, 0), (w / 2, 0.3, 0))
    d.tube(bar, 0.016, STEEL, 6)
    return d


def calendar(draw: Draw) -> Design:
    """A picture above the days of a month, three months below each other, or a tent on the desk."""
    style, head, mark = draw.style(3), vivid_paint(draw), draw.one_of((INK, DARK))
    d = Design("desk calendar" if style == 2 else "calendar", "calendar", ("month",))
    w, h = (0.2, 0.16) if style == 2 else (draw.between(0.25, 0.42), draw.between(0.42, 0.65))
    d.box((w, h, 0.006), (0, 0, 0), PAPER)
    if style < 2:
        d.box((w * 0.94, h * (0.44 - 0.26 * style), 0.002), (0, h * (0.26 + 0.12 * style), 0.003), PICTURE)
    months = (((-0.48, 0.45),), ((-0.48, 0.23), (-0.21, 0.23), (0.05, 0.23)), ((-0.48, 0.93),))
    for low, tall in months[style]:
        d.box((w * 0.9, h * tall * 0.13, 0.002), (0, h * (low + tall * 0.92), 0.003), head)
        for k in range(35):
            x, y = w * (k % 7 - 3) * 0.13, h * (low + tall * (0.1 + (k // 7) * 0.155))
            d.box((w * 0.06, h * tall * 0.08, 0.002), (x, y, 0.003), RED if k % 7 == 6 else mark)
    boxes(d, draw.metal(), *((w * 0.03, 0.012, 0.014, w * k * 0.08, h / 2, 0) for k in range(-5, 6)))
    d.elevation = 0.0 if style == 2 else 1.55 - h / 2
    if style == 2:
        turned_over(d, 0, -0.35)
        leaf_at(d, head, (w, h, 0.004), (0, 0, -0.085), -0.3)
    return d


def newspaper(draw: Draw) -> Design:
    """One or a stack: head lines, columns of print and a photograph."""
    many, grey = draw.one_of((1, 1, draw.count(4, 10))), plain((0.88, 0.87, 0.83))
    d = Design("newspapers" if many > 1 else "newspaper", "newspaper", ("paper",))
    w, h, thick = draw.between(0.26, 0.36), draw.between(0.2, 0.4), draw.between(0.006, 0.014)
    for k in range(many):
        sheaf = box((w, h, thick * 0.9), (0, 0, (k - many + 0.5) * thick))
        d.add(turned(sheaf, 2, draw.between(-0.1, 0.1) * (k < many - 1)), grey)
    boxes(d, INK, (w * 0.8, h * 0.09, 0.001, 0, h * 0.41, 0), (w * 0.94, 0.003, 0.001, 0, h * 0.34, 0))
    columns, side = draw.count(3, 5), draw.one_of(SIDES)
    d.box((w * 0.45, h * 0.33, 0.001), (side * w * 0.23, h * 0.14, 0), PICTURE)
    boxes(d, INK, *((w * 0.42, h * 0.05, 0.001, -side * w * 0.23, h * y, 0) for y in (0.27, 0.17, 0.07)))
    for k in range(columns * 9):
        x, y = w * 0.94 * ((k % columns + 0.5) / columns - 0.5), -h * (0.08 + 0.045 * (k // columns))
        d.box((w * 0.8 / columns, h * 0.018, 0.001), (x, y, 0), DARK)
    return turned_over(d)


def _pen(d: Design, draw: Draw, place: Vector, *turns: tuple[int, float]) -> None:
    radius, long = draw.between(0.0035, 0.006), draw.between(0.12, 0.17)
    put_flat(d, vivid_paint(draw), cylinder(radius, long, (0, 0, 0), None, 6), place, *turns)
    put_flat(d, draw.one_of((BLACK, PAPER)), cylinder(radius, 0.02, (0, long, 0), 0.001, 6), place, *turns)


def stationery(draw: Draw) -> Design:
    """Pens in a holder, scissors, a stapler, a notebook with a pen, sheaves of paper, ring binders."""
    style, look, z = draw.style(6), vivid_paint(draw), draw.between(0.01, 0.03)
    names = ("pen holder", "scissors", "stapler", "notebook", "paper stack", "ring binder")
    d = Design(names[style], "stationery", ("office supplies",))
    if style == 0:
        cup = ((0.04, 0), (0.042, 0.1), (0.038, 0.1), (0.036, 0.01), (0, 0.01))
        d.lathe(cup, draw.legs(), draw.one_of((4, 14)))
        for k in range(draw.count(4, 8)):
            _pen(d, draw, (0, 0.012, 0), (2, draw.between(0.05, 0.2)), (1, 2.4 * k))
    for side in SIDES if style == 1 else ():
        blade = prism(((-0.008, -0.03), (0.008, -0.03), (0.003, 0.11), (0, 0.115)), 0.002)
        d.add(turned(blade, 2, -side * 0.2), STEEL)
        rounded_ring(d, look, (0.045, 0.065, 0.02), 0.006, (side * 0.028, -0.06, 0))
    parts = ((0.04, 0.008, 0.15, 0.004, 0), (0.03, 0.018, 0.15, 0.035, 0.15), (0.022, 0.01, 0.14, 0.022, 0.1))
    for k, (wide, high, long, y, angle) in enumerate(parts) if style == 2 else ():
        bar = rounded((wide, high, long), (0, 0, 0), 7.0, 6)
        put_flat(d, STEEL if k == 2 else look, bar, (0, y, 0), (0, angle))
    if style == 3:
        w, h = draw.one_of(((0.15, 0.21), (0.21, 0.29), (0.1, 0.15)))
        boxes(d, look, (w, 0.003, h, 0, 0.001, 0), (w, 0.003, h, 0, z, 0))
        boxes(d, PAPER, (w * 0.97, z, h * 0.97, 0, z / 2, 0))
        boxes(d, STEEL, *((0.016, z + 0.008, 0.004, -w / 2, z / 2, h * k * 0.06) for k in range(-7, 8)))
        _pen(d, draw, (0.02, z + 0.006, 0.07), (0, -QUARTER), (1, draw.between(-0.5, 0.5)))
    for k in range(draw.count(4, 10) if style == 4 else 0):
        sheet = box((0.21, 0.009, 0.297), (0, 0.005 + k * 0.009, 0))
        d.add(turned(sheet, 1, draw.between(-0.08, 0.08)), PAPER)
    for k in range(draw.count(1, 4) if style == 5 else 0):
        cover, x = vivid_paint(draw), k * 0.075
        boxes(d, cover, (0.07, 0.32, 0.003, x, 0.16, 0.14))
        boxes(d, cover, *((0.003, 0.32, 0.28, x + s * 0.034, 0.16, 0) for s in SIDES))
        boxes(d, PAPER, (0.06, 0.29, 0.25, x, 0.155, 0), (0.05, 0.13, 0.002, x, 0.2, 0.142))
        d.roll(0.013, 0.002, (x, 0.07, 0.141), BLACK, 10)
    return turned_over(d) if style == 1 else d


def flashlight(draw: Draw) -> Design:
    """A lying torch, or a lantern with a handle."""
    d, lantern = Design("flashlight", "flashlight", ("torch",)), draw.chance(0.35)
    look = draw.one_of((BLACK, BLACK, STEEL, vivid_paint(draw)))
    long = 0.03 if lantern else draw.between(0.12, 0.3)
    r = 0.035 if lantern else draw.between(0.014, 0.02)
    wide = r * draw.between(1.3, 1.9)
    foot, z, grip = 0.055 if lantern else wide, 0.05 if lantern else -long / 2, 0.155 if lantern else wide + r
    if lantern:
        d.soft((0.1, 0.1, 0.16), (0, 0.055, -0.02), look, 6)
        d.tube(((0, 0.1, -0.08), (0, 0.15, -0.07), (0, 0.15, 0.05), (0, 0.1, 0.06)), 0.012, BLACK)
    pieces = ((r, r, long), (r, wide, 0.03), (wide, wide, 0.03), (wide * 0.88, wide * 0.8, 0.003))
    for k, (low, top, length) in enumerate(pieces):
        piece = cylinder(low, length, (0, 0, 0), top, 14)
        put_flat(d, (look, look, BLACK, PAPER)[k], piece, (0, foot, z), (0, QUARTER))
        z += length
    d.box((0.012, 0.02, 0.025), (0, grip, 0.01), draw.one_of((RED, DARK)))
    for k in range(0 if lantern else 8):
        d.roll(r * 1.06, 0.004, (0, foot, long * (k * 0.06 - 0.45)), DARK, 10)
    return d


def keys(draw: Draw) -> Design:
    """A bunch on a ring with a tag, or a board with hooks on which keys hang."""
    board, many, w = draw.chance(0.4), draw.count(3, 6), draw.between(0.2, 0.4)
    d = Design("key rack" if board else "keys", "keys", ("bunch of keys",), elevation=1.35 if board else 0.0)
    for k in range(many):
        x, angle = (w * ((k + 0.5) / many - 0.5), 0.0) if board else (0.0, (k - many / 2) * 0.5)
        metal = draw.one_of((STEEL, plain((0.75, 0.6, 0.25), 0.7)))
        size = draw.between(0.9, 1.3) * (1.3 if board else 1)
        bow, place = prism(round_cornered(0.024, 0.022, 0.008), 0.004), (x, 0, 0.008 + 0.001 * k)
        teeth = [box((0.006, 0.004, 0.0024), (0.005, -0.044 - 0.006 * m, 0)) for m in range(draw.count(2, 4))]
        shaft = np.concatenate([box((0.006, 0.04, 0.0025), (0, -0.048, 0)), *teeth])
        put_flat(d, draw.one_of((metal, vivid_paint(draw))), (bow - [0, 0.022, 0]) * size, place, (2, angle))
        put_flat(d, metal, shaft * size, place, (2, angle))
        if board:
            d.tube(((x, 0.02, -0.015), (x, -0.012, 0.0), (x, -0.014, 0.02), (x, 0, 0.022)), 0.0025, STEEL, 5)
    if board:
        rounded_slab(d, draw.body(), (w, 0.1, 0.018), 0.01, (0, 0.03, -0.02))
        return d
    rounded_ring(d, STEEL, (0.036, 0.036, 0.018), 0.0018, (0, 0, 0.008))
    tag = prism(round_cornered(0.035, 0.05, 0.012), 0.006)
    put_flat(d, vivid_paint(draw), tag, (0, 0.04, 0.008), (2, draw.between(-0.6, 0.6)))
    return turned_over(d)


def glasses(draw: Draw) -> Design:
    """Spectacles and sunglasses, round to square, their arms open or folded."""
    dark, folded, w = draw.chance(0.4), draw.chance(0.4), draw.between(0.046, 0.056)
    d = Design("sunglasses" if dark else "glasses", "glasses", ("eyeglasses", "spectacles"))
    thick, h = draw.between(0.0012, 0.0032), w * draw.between(0.65, 1)
    look = draw.one_of((BLACK, draw.metal(), vivid_paint(draw)))
    lens = plain((0.04, 0.04, 0.05), 0.9, 0.9) if dark else plain((0.8, 0.87, 0.9), 0.9, 0.25)
    corner, y = h * draw.between(0.2, 0.5), h * 0.72
    for side in SIDES:
        x, centre = side * (w + 0.012), (side * (w / 2 + 0.009), h / 2, 0)
        rounded_ring(d, look, (w, h, corner), thick, centre)
        rounded_slab(d, lens, (w, h, 0.001), corner, centre)
        ends = [(-x * 0.7, y, -0.015 - 0.004 * side)] if folded else [(x, y, -0.1), (x, 0, -0.14)]
        d.tube([(x, y, 0), (x, y, -0.01), *ends], max(thick, 0.0018), look, 5)
    d.tube(((-0.01, h * 0.6, 0), (0, y, 0.003), (0.01, h * 0.6, 0)), thick, look, 5)
    return d


def watch(draw: Draw) -> Design:
    """Round or square, with hands or a screen, its strap open or closed."""
    smart, closed, r = draw.chance(0.3), draw.chance(0.5), draw.between(0.016, 0.023)
    d = Design("smart watch" if smart else "wristwatch", "watch", ("watch",))
    strap, rim = casing(draw), draw.one_of((STEEL, BLACK, plain((0.8, 0.65, 0.3), 0.7)))
    face, corner = draw.one_of((WHITE, BLACK, BLUE)), r * 0.5 if smart else r
    rounded_slab(d, rim, (2 * r, 2 * r, 0.009), corner)
    rounded_slab(d, GLASS if smart else face, (1.72 * r, 1.72 * r, 0.009), corner * 0.86, (0, 0, 0.0045))
    for long in (0.5, 0.75) if not smart else ():
        hand = box((0.002, r * long, 0.001), (0, r * long / 2, 0.0095))
        put_flat(d, BLACK if face is WHITE else WHITE, hand, (0, 0, 0), (2, draw.between(0, 6)))
    rod_across(d, rim, 0.003, 0.005, (r + 0.002, 0, 0))
    for k in range(-7, 8) if closed else ():
        put_flat(d, strap, box((r * 1.05, 0.014, 0.003), (0, 0, 0.03)), (0, 0, -0.032), (0, k * 0.42))
    if closed:
        return turned_over(d, 2, QUARTER)
    boxes(d, strap, *((r * 1.05, 0.085, 0.0025, 0, side * 0.055, -0.003) for side in SIDES))
    rounded_ring(d, rim, (r * 1.2, 0.014, 0.003), 0.0012, (0, 0.1, -0.003))
    return turned_over(d)


def switch(draw: Draw) -> Design:
    """One to three rockers or levers on a plate, or a turning knob."""
    d = Design("light switch", "switch", ("wall switch",), elevation=1.1)
    many, style = draw.one_of((1, 1, 2, 3)), draw.style(3)
    look, lever = draw.one_of((WHITE, WHITE, PAPER, DARK, STEEL)), style == 1
    pitch = draw.between(0.04, 0.071)
    key = BLACK if look is STEEL and draw.chance(0.5) else look
    wide = 0.014 if lever else min(pitch * 0.93, 0.058)
    rounded_slab(
        d, look, (pitch * (many - 1) + 0.08, 0.118 if lever else 0.082, 0.009), draw.between(0.003, 0.012)
    )
    for k in range(many):
        x, tilt = (k - (many - 1) / 2) * pitch, draw.one_of(SIDES)
        rounded_slab(d, DARK, (wide + 0.003, 0.028 if lever else 0.06, 0.002), 0.002, (x, 0, 0.005))
        if style == 2 and many == 1:
            d.roll(0.02, 0.018, (x, 0, 0.004), key, 14)
        else:
            rocker = box((0.009, 0.02, 0.024) if lever else (wide, 0.056, 0.008), (0, 0, 0))
            put_flat(d, key, rocker, (x, 0, 0.008), (0, tilt * (0.45 if lever else 0.09)))
    return d


def socket(draw: Draw) -> Design:
    """One to three round wells in frames, or plates with slots, some with a plug in."""
    d = Design("wall socket", "socket", ("power outlet", "electrical outlet"), elevation=0.25)
    style = draw.style(3)
    look = draw.one_of((WHITE, WHITE, PAPER, DARK, STEEL))
    many = 2 if style == 1 else draw.one_of((1, 1, 2, 3))
    hole, pitch = GLASS if look is DARK else DARK, 0.042 if style == 1 else 0.071
    width = 0.118 if style == 1 else 0.083 + pitch * (many - 1)
    rounded_slab(d, look, (width, 0.072 if style == 1 else 0.083, 0.009), draw.between(0.003, 0.012))
    pins = ((-0.0095, 0, 0.006, 0.006), (0.0095, 0, 0.006, 0.006), (0, 0.018, 0.007, 0.007))
    slots = ((0.003, -0.007, 0.01, 0.003), (0.003, 0.007, 0.01, 0.003), (-0.009, 0, 0.005, 0.005))
    bars = ((-0.011, -0.008, 0.008, 0.004), (0.011, -0.008, 0.008, 0.004), (0, 0.01, 0.005, 0.01))
    for k in range(many):
        x = (k - (many - 1) / 2) * pitch
        well = ((0.027, 0.007, look), (0.0225, 0.0075, hole), (0.02, 0.008, look))
        for r, long, part in well if style == 0 else ():
            d.roll(r, long, (x, 0, 0.002), part, 14)
        rounded_slab(d, look, (0.03, 0.034, 0.004), 0.008, (x, 0, 0.004))
        boxes(d, hole, *((w, h, 0.004, x + u, v, 0.0085) for u, v, w, h in (pins, slots, bars)[style]))
        if draw.chance(0.2) and style != 1:
            d.roll(0.019, 0.035, (x, 0, 0.009), BLACK, 12)
            d.tube(((x, 0, 0.04), (x, -0.02, 0.05), (x + 0.01, -0.2, 0.02)), 0.004, BLACK, 5)
    if style == 1:
        d.parts[:] = [(turned(triangles, 2, QUARTER), part) for triangles, part in d.parts]
    return d


def dartboard(draw: Draw) -> Design:
    """Twenty fields with their rings, bare or in a cabinet with open doors, with or without darts."""
    d, r = Design("dartboard", "dartboard", ("dart board",), elevation=1.45), 0.17
    pale = plain((0.9, 0.84, 0.68))
    d.roll(r * draw.between(1.3, 1.36), 0.035, (0, 0, -0.035), BLACK, 28)
    for k in range(20):
        for ring, (low, high) in enumerate(((0.09, 0.58), (0.58, 0.64), (0.64, 0.94), (0.94, 1.0))):
            corners = [(low, -1), (high, -1), (high, 1), (low, 1)]
            bent = [(r * s * np.sin(a * np.pi / 20), r * s * np.cos(np.pi / 20)) for s, a in corners]
            field = prism(bent, 0.002)
            put_flat(d, ((BLACK, pale), (RED, GREEN))[ring % 2][k % 2], field, (0, 0, 0), (2, k * np.pi / 10))
        mark = box((0.012, 0.016, 0.002), (0, r * 1.12, 0.001))
        d.add(turned(mark, 2, k * np.pi / 10), WHITE)
    d.roll(r * 0.09, 0.003, (0, 0, 0), GREEN, 12)
    d.roll(r * 0.04, 0.004, (0, 0, 0), RED, 12)
    for _ in range(draw.one_of((0, 3, 3))):
        x, y = draw.between(-0.1, 0.1), draw.between(-0.1, 0.1)
        d.tube(((x, y, 0), (x, y - 0.01, 0.08), (x, y - 0.02, 0.14)), 0.003, STEEL, 5)
        flights = ((0.035, 0.002), (0.002, 0.035))
        boxes(d, vivid_paint(draw), *((u, v, 0.035, x, y - 0.02, 0.13) for u, v in flights))
    wood, cabinet = draw.body(), draw.chance(0.3)
    for side in SIDES if cabinet else ():
        d.box((0.26, 0.56, 0.02), (side * 0.13, 0, -0.05), wood)
        door = box((0.27, 0.56, 0.02), (side * 0.135, 0, 0))
        put_flat(d, wood, door, (side * 0.26, 0, -0.03), (1, -side * 0.35))
    return d


def tool(draw: Draw) -> Design:
    """A hammer, screwdrivers, a hand saw, a cordless drill, a tool box."""
    style, look = draw.style(5), draw.one_of((RED, BLUE, GREEN, YELLOW, vivid_paint(draw)))
    d = Design(("hammer", "screwdriver", "saw", "drill", "toolbox")[style], "tool", ("tool",))
    grip, long = draw.one_of((draw.wooden(), look)), draw.between(0.24, 0.36)
    if style == 0:
        d.cylinder(0.015, long, (0, 0, 0), grip, 0.01)
        rod_across(d, STEEL, 0.016, 0.045, (0.04, long, 0))
        rod_across(d, STEEL, 0.011, 0.05, (0, long, 0))
        claw = ((-0.02, 0.013), (-0.06, 0.006), (-0.09, -0.022), (-0.06, -0.006), (-0.02, -0.013))
        put_flat(d, STEEL, prism(claw, 0.024), (0, long, 0))
    for k in range(draw.count(1, 4) if style == 1 else 0):
        colour, s = vivid_paint(draw), draw.between(0.8, 1.2)
        d.cylinder(0.015 * s, 0.1 * s, (k * 0.045, 0, 0), colour, 0.013 * s)
        d.cylinder(0.013 * s, 0.02, (k * 0.045, 0.1 * s, 0), colour, 0.005)
        d.cylinder(0.0035, long * 0.4, (k * 0.045, 0.11 * s, 0), STEEL)
    if style == 2:
        teeth = [(long * 0.04 * k, -0.05 - 0.006 * (k % 2)) for k in range(41)]
        d.add(prism((*teeth, (long * 1.6, 0.0), (0, 0.05)), 0.002), STEEL)
        rounded_ring(d, grip, (0.09, 0.11, 0.03), 0.014, (-0.045, 0, 0))
    if style < 3:
        return turned_over(d)
    if style == 3:
        rod_across(d, look, 0.033, 0.14, (0, 0.2, 0))
        front = ((0.03, 0.05, 0.095, 0.032), (0.012, 0.045, 0.14, 0.022), (0.004, 0.1, 0.2, 0.004))
        for r, length, x, top in front:
            rod_across(d, STEEL if r < 0.01 else BLACK, r, length, (x, 0.2, 0), top)
        put_flat(d, BLACK, rounded((0.042, 0.15, 0.036), (0, 0, 0), 5.0, 6), (-0.035, 0.11, 0), (2, -0.15))
        boxes(d, look, (0.12, 0.03, 0.075, -0.035, 0.045, 0))
        boxes(d, BLACK, (0.11, 0.03, 0.07, -0.03, 0.015, 0), (0.015, 0.03, 0.02, 0.0, 0.155, 0))
        return d
    w, h, lid = long * 1.5, long * 0.5, draw.one_of((look, BLACK))
    d.box((w, h, 0.2), (0, h / 2, 0), look)
    profile = ((-0.104, 0), (0.104, 0), (0.104, 0.03), (0.05, 0.075), (-0.05, 0.075), (-0.104, 0.03))
    put_flat(d, lid, prism(profile, w * 1.02), (0, h, 0), (1, QUARTER))
    handle = ((-0.09, 0.07), (-0.08, 0.11), (0.08, 0.11), (0.09, 0.07))
    d.tube([(x, h + y, 0) for x, y in handle], 0.011, BLACK, 6)
    boxes(d, draw.metal(), *((0.035, 0.06, 0.012, side * w * 0.3, h, 0.105) for side in SIDES))
    return d
