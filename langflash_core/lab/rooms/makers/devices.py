"""Makers of what runs on current and is held or looked at (see `makers.common`).

Metres, y up, front +z.
"""

import numpy as np

from langflash_core.lab.rooms.makers.flat import (
    BLUE,
    GLASS,
    GREEN,
    INK,
    LIT,
    PAPER,
    PICTURE,
    RED,
    YELLOW,
    button_rows,
    casing,
    leaf_at,
    put_flat,
    rod_across,
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
    box,
    boxes,
    plain,
    rounded,
)

_ONES = (1.0,) * 10
_KEY_ROWS = ((1.3, 1.3, 1.3, 6.2, 1.3, 1.3, 2.3), (2.3, *_ONES, 2.7), (1.8, *_ONES, 1, 2.2))
_KEY_ROWS += ((1.5, *_ONES, 1, 1, 1.5), (*_ONES, 1, 1, 1, 2), (*_ONES, 1, 1, 1, 1, 1))


def keyboard(draw: Draw) -> Design:
    """Flat to high keys, with or without a number pad, some with keys of two colours."""
    d = Design("keyboard", "keyboard", ("computer keyboard",))
    key, rows, pad = draw.between(0.0165, 0.0195), draw.count(5, 6), draw.one_of((0.0, 4.4, 4.4))
    case, caps, accent, mixed = casing(draw), casing(draw), vivid_paint(draw), draw.chance(0.35)
    caps = draw.one_of((BLACK, WHITE)) if caps is case and case is not BLACK else caps
    width, gap, rim = (15 + pad) * key, draw.between(0.1, 0.25), draw.between(0.012, 0.05)
    thick, high = draw.between(0.007, 0.022), draw.between(0.006, 0.016)
    rounded_slab(
        d, case, (width + 0.014, rows * key + rim, thick), draw.between(0.003, 0.012), (0, rim * 0.2, 0)
    )
    for row, run in enumerate(_KEY_ROWS[:rows]):
        x, y = -width / 2, (row + 0.5 - rows / 2) * key
        for wide in (*run, *((0.4, 1, 1, 1, 1) if pad else ())):
            size, look = ((wide - gap) * key, (1 - gap) * key, high), accent if mixed and wide > 1 else caps
            if wide >= 1:
                d.box(size, (x + wide * key / 2, y, thick / 2), WHITE if look is case else look)
            x += wide * key
    return turned_over(d, 0, draw.between(0.02, 0.1) - QUARTER)


def phone(draw: Draw) -> Design:
    """Mobile phones, cordless ones in a cradle, desk phones with a handset."""
    style, look = draw.style(3), casing(draw)
    d = Design(("mobile phone", "cordless phone", "telephone")[style], "phone", ("telephone",))
    w, h, t = ((0.072, 0.15, 0.009), (0.052, 0.16, 0.026), (0.2, 0.21, 0.035))[style]
    w, h = w * draw.between(0.9, 1.1), h * draw.between(0.9, 1.1)
    keys = DARK if look in (WHITE, STEEL) else WHITE
    rounded_slab(d, look, (w, h, t), draw.between(0.005, 0.02))
    if style == 0:
        rounded_slab(
            d, draw.one_of((GLASS, BLUE, PICTURE)), (w * 0.93, h * 0.94, 0.002), 0.006, (0, 0, 0.0045)
        )
        return turned_over(d)
    right, z = (w * 0.16 if style == 2 else 0.0), t / 2 + 0.001
    d.box((w * 0.6, h * 0.2, 0.004), (right, h * 0.3, z), LIT)
    button_rows(d, keys, (right, -h * 0.13, z), 3, 4, 0.0125 if style == 1 else 0.0215)
    for y, wide, long in ((0, 0.036, h), (-0.36, 0.055, 0.06), (0.36, 0.055, 0.06)) if style == 2 else ():
        end = rounded((wide, long, 0.045), (-w * 0.34, y * h, 0.03 if y else 0.05), 4.0, 5)
        d.add(end, look)
    curl = [(0.008 * np.cos(k) - w * 0.55, h * (k - 15) / 40, 0.008 * np.sin(k)) for k in range(26)]
    d.tube(curl if style == 2 else [(0, 0, 0), (0, 0, -0.02)], 0.003, BLACK, 4)
    angle = draw.between(0.9, 1.3) if style == 2 else draw.between(0.15, 0.5)
    turned_over(d, 0, -angle, 0.015 * (2 - style))
    tall = h * np.cos(angle) if style == 2 else 0.05
    d.add(rounded((max(w * 0.8, 0.08), tall, 0.09), (0, tall / 2, 0.04 - 0.04 * style), 6.0, 5), look)
    return d


def printer(draw: Draw) -> Design:
    """A desk inkjet with paper behind, a laser printer, a copier on the floor."""
    style, look, second = draw.style(3), draw.one_of((WHITE, PAPER, DARK)), draw.one_of((DARK, BLACK, STEEL))
    d = Design(("inkjet printer", "laser printer", "copier")[style], "printer", ("printer",))
    w, drawers = draw.between(0.36, 0.48) + 0.17 * (style == 2), draw.count(2, 4)
    depth = w * draw.between(0.75, 1)
    h = (draw.between(0.13, 0.2), draw.between(0.22, 0.4), drawers * 0.14 + 0.2)[style]
    z = depth / 2
    if style == 2:
        boxes(d, look, (w, h, depth, 0, h / 2, 0), (w * 0.25, 0.2, depth, -w * 0.375, h + 0.1, 0))
        boxes(d, second, (w * 0.75, 0.2, 0.05, w * 0.12, h + 0.1, -z + 0.02))
        boxes(d, second, (w, 0.07, depth * 0.85, 0, h + 0.33, -0.04))
        boxes(d, look, (w, 0.1, depth, 0, h + 0.25, 0))
        boxes(d, look, *((w * 0.96, 0.125, 0.02, 0, 0.1 + k * 0.14, z) for k in range(drawers)))
        boxes(d, DARK, *((w * 0.3, 0.025, 0.02, 0, 0.13 + k * 0.14, z + 0.005) for k in range(drawers)))
        boxes(d, PAPER, (0.3, 0.03, 0.22, w * 0.12, h + 0.015, 0.05))
        leaf_at(d, second, (w * 0.45, 0.26, 0.012), (w * 0.1, h + 0.4, depth * 0.1), 1.1)
        leaf_at(d, second, (w * 0.6, 0.16, 0.03), (0, h + 0.28, z), -0.9)
        leaf_at(d, BLUE, (w * 0.25, 0.1, 0.03), (0, h + 0.3, z + 0.01), -0.9)
        return d
    d.soft((w, h, depth), (0, h / 2, 0), look, 14)
    boxes(d, BLACK, (w * 0.62, h * 0.25, 0.02, 0, h * 0.3, z), (w * 0.96, 0.006, 0.02, 0, h * 0.46, z))
    leaf_at(d, second, (w * 0.55, 0.13, 0.008), (0, h * 0.16, z - 0.01), -1.45)
    leaf_at(d, second, (w * 0.6, 0.16 - 0.1 * style, 0.008), (0, h * 0.97, z * (style - 0.8)), 0.35)
    sheet = (0.21, 0.24 - 0.05 * style, 0.01)
    leaf_at(d, PAPER, sheet, (0, h * 0.98, z * (style * 1.2 - 0.75)), 0.35 + style * 1.2)
    boxes(d, PAPER, (0.21, 0.006, 0.12, 0, h * 0.25, z + 0.04))
    leaf_at(d, GLASS if style else LIT, (w * 0.3, 0.06, 0.01), (-w * 0.1, h * 0.72, z), 0.5)
    button_rows(d, GREEN if draw.chance(0.4) else STEEL, (w * 0.25, h * 0.8, z), 3, 2, 0.016)
    return d


def tablet(draw: Draw) -> Design:
    """Tablets and electronic readers, lying or on a stand."""
    reader, stands, look = draw.chance(0.3), draw.chance(0.55), draw.legs()
    d = Design("e-reader" if reader else "tablet", "tablet", ("tablet computer",))
    w, h = (0.12, 0.17) if reader else draw.one_of(((0.16, 0.24), (0.2, 0.27), (0.25, 0.17), (0.28, 0.2)))
    rim, screen = draw.between(0.006, 0.02), draw.one_of((GLASS, BLUE, BLUE, PICTURE, PAPER))
    rounded_slab(d, casing(draw), (w, h, 0.009), draw.between(0.005, 0.014))
    rounded_slab(d, draw.one_of((WHITE, BLACK)), (w - 0.005, h - 0.005, 0.002), 0.005, (0, 0, 0.0045))
    d.box((w - 2 * rim, h - 2.5 * rim, 0.002), (0, 0, 0.0055), PAPER if reader else screen)
    if reader:
        lines = ((w * draw.between(0.5, 0.68), 0.003, 0.001, 0, h * k * 0.08, 0.0068) for k in range(-4, 5))
        boxes(d, INK, *lines)
    elif screen is BLUE:
        button_rows(d, vivid_paint(draw), (0, 0.01, 0.006), 5, 3, 0.026)
    angle = draw.between(0.25, 0.7) if stands else QUARTER
    near = h / 2 * np.sin(angle)
    turned_over(d, 0, -angle, 0.02 if stands else 0)
    if stands:
        boxes(d, look, (w * 0.6, 0.012, near * 2 + 0.06, 0, 0.006, 0))
        boxes(d, look, (w * 0.6, 0.035, 0.01, 0, 0.018, near + 0.02))
        leaf_at(d, look, (w * 0.3, h * 0.7, 0.008), (0, 0.01, near - 0.02), angle)
    return d


def headphones(draw: Draw) -> Design:
    """Over the ears: a slim or padded band, lying or on a stand."""
    d = Design("headphones", "headphones", ("headset",))
    r, cup, thick = 0.08, draw.between(0.032, 0.046), draw.between(0.005, 0.012)
    look, pad = casing(draw), casing(draw)
    arc = [(r * np.cos(t), r * 1.15 * np.sin(t), 0.0) for t in np.linspace(0, np.pi, 13)]
    d.tube(arc, thick * 0.6, draw.metal(), 6)
    d.tube(arc[2:-2], thick, look, 6)
    for radius, x, part in ((cup, 0.012, look), (cup * 0.93, -0.008, pad), (cup * 0.6, 0.02, pad)):
        for side in SIDES:
            rod_across(d, part, radius, 0.022, (side * (r + x), -0.01, 0))
    if draw.chance(0.5):
        return turned_over(d)
    foot, wood = draw.between(0.03, 0.1), draw.legs()
    top = foot + r * 1.15 + cup
    turned_over(d, 0, 0.0, foot)
    d.cylinder(0.008, top, (0, 0, 0), wood)
    d.cylinder(draw.between(0.06, 0.08), 0.012, (0, 0, 0), wood)
    rod_across(d, wood, 0.016, 0.07, (0, top - 0.015, 0))
    return d


def game_controller(draw: Draw) -> Design:
    """A gamepad with grips or a flat old one, alone or before its console."""
    flat, console, look, body = draw.chance(0.3), draw.chance(0.45), casing(draw), casing(draw)
    d = Design("game console" if console else "gamepad", "game controller", ("video game",))
    if flat:
        rounded_slab(d, look, (0.13, 0.058, 0.016), draw.between(0.003, 0.025))
    for side in SIDES if not flat else ():
        d.add(rounded((0.1, 0.075, 0.042), (side * 0.022, 0.015, 0), 3.5, 6), look)
        grip = rounded((0.042, 0.1, 0.04), (0, 0, 0), 3.0, 6)
        put_flat(d, look, grip, (side * 0.062, -0.025, 0), (2, side * 0.35))
        d.roll(0.011, 0.016, (side * 0.028, -0.006, 0.016), BLACK if look is not BLACK else DARK, 10)
    z, keys = 0.01 if flat else 0.021, DARK if look is not DARK else STEEL
    boxes(d, keys, (0.024, 0.008, 0.008, -0.045, 0.018, z), (0.008, 0.024, 0.008, -0.045, 0.018, z))
    for k, colour in enumerate((RED, GREEN, BLUE, YELLOW)[: 2 if flat else 4]):
        x, y = 0.012 * float(np.cos(k * QUARTER)), 0.012 * float(np.sin(k * QUARTER))
        d.roll(0.006, 0.006, (0.045 + x, 0.018 + y, z - 0.001), colour, 8)
    turned_over(d, 0, -1.45)
    w, h, t = draw.one_of(((0.29, 0.06, 0.25), (0.08, 0.36, 0.25), (0.16, 0.3, 0.16), (0.24, 0.08, 0.2)))
    if console:
        rounded_slab(d, body, (w, h, t), 0.012, (0, h / 2, -t / 2 - 0.09))
        boxes(d, DARK if body is BLACK else BLACK, (w * 0.9, 0.008, t, 0, h * 0.55, -t / 2 - 0.088))
        d.box((0.012, 0.006, 0.004), (w * 0.3, h * 0.75, -0.089), BLUE)
    return d


def remote_control(draw: Draw) -> Design:
    """Long ones full of buttons to small ones with a ring."""
    d = Design("remote control", "remote control", ("remote", "tv remote"))
    w, h, ring = draw.between(0.036, 0.055), draw.between(0.13, 0.22), draw.chance(0.6)
    look = draw.one_of((BLACK, BLACK, DARK, WHITE, STEEL))
    keys, z = DARK if look in (WHITE, STEEL) else draw.one_of((WHITE, STEEL)), 0.009
    rounded_slab(d, look, (w, h, 0.017), draw.between(0.003, 0.017))
    d.roll(0.004, 0.004, (-w * 0.28, h * 0.43, z - 0.001), RED, 8)
    for k, part in enumerate((keys, look)) if ring else ():
        d.roll(w * (0.36 - k * 0.16), 0.004 + k * 0.001, (0, h * 0.2, z - 0.002), part, 12)
    rows = min(draw.count(3, 9), int(h * (0.42 if ring else 0.7) / w / 0.28))
    button_rows(d, keys, (0, -h * 0.2 if ring else -h * 0.03, z), 3, rows, w * 0.28)
    for k, colour in enumerate((RED, GREEN, YELLOW, BLUE)):
        d.box((w * 0.14, 0.005, 0.004), (w * (k - 1.5) * 0.22, -h * 0.46, z), colour)
    return turned_over(d)


def player(draw: Draw) -> Design:
    """Flat players, amplifiers with big knobs, stereos with loudspeakers, record players, radios."""
    style, look = draw.style(5), draw.one_of((BLACK, DARK, STEEL))
    d = Design(("DVD player", "amplifier", "stereo", "record player", "radio")[style], "player", ("hi-fi",))
    sizes = ((0.43, 0.055, 0.25), (0.43, 0.14, 0.33), (0.24, 0.2, 0.24), (0.42, 0.1, 0.36), (0.28, 0.17, 0.1))
    w, h, depth = (side * draw.between(0.85, 1.15) for side in sizes[style])
    look, trim, z = draw.body() if style > 2 else look, DARK if look is STEEL else STEEL, depth / 2
    d.box((w, h, depth), (0, h / 2 + 0.01, 0), look)
    boxes(d, BLACK, *((0.03, 0.012, z * 1.6, side * w * 0.4, 0.006, 0) for side in SIDES))
    if style < 3:
        boxes(d, GLASS, (w * 0.35, h * 0.25, 0.004, w * 0.05, h * 0.75, z))
        boxes(d, GLASS, (w * 0.3, h * 0.12, 0.006, -w * 0.3, h * 0.5, z))
        boxes(d, LIT, (w * 0.2, h * 0.1, 0.004, w * 0.05, h * 0.75, z + 0.002))
        button_rows(d, trim, (w * 0.35, h * 0.4, z), 4, 1 + (style > 0), w * 0.05, 0.4)
    for x, r in ((-0.15, 0.15), (0.0, 0.1), (0.36, 0.22)) if style in (1, 2) else ():
        d.roll(h * r, 0.02, (w * x, h * 0.4, z), trim, 12)
    for side in SIDES if style in (2, 4) else ():
        r, x = (0.07, side * (w / 2 + 0.1)) if style == 2 else (h * 0.33, side * w * 0.25)
        size = (0.17, h * 1.35, depth) if style == 2 else (w * 0.4, h * 0.7, 0.004)
        d.box(size, (x, h * (0.68 if style == 2 else 0.42), z * (style / 2 - 1)), DARK)
        d.roll(r, 0.006, (x, h * 0.42, z), STEEL, 14)
        d.roll(r * 0.85, 0.008, (x, h * 0.42, z), BLACK, 14)
    if style == 4:
        boxes(d, PAPER, (w * 0.6, h * 0.14, 0.006, 0, h * 0.95, z))
        boxes(d, RED, (0.003, h * 0.13, 0.008, w * draw.between(-0.2, 0.2), h * 0.95, z))
        handle = ((-0.42, 1), (-0.4, 1.25), (0.4, 1.25), (0.42, 1))
        d.tube([(w * x, h * y, 0) for x, y in handle], 0.006, trim, 5)
        d.tube(((w * 0.4, h, -z), (w * 0.4 + draw.between(-0.2, 0.2), h + 0.25, -z)), 0.002, STEEL, 4)
    disc = ((0.155, STEEL), (0.15, BLACK), (0.05, vivid_paint(draw)))
    for k, (r, part) in enumerate(disc if style == 3 else ()):
        d.cylinder(r, 0.012 - 0.003 * k, (-w * 0.08, h + 0.01 + 0.006 * k, 0.01), part)
    if style == 3:
        arm = ((0.4, 0.04, -0.7), (0.38, 0.04, 0), (0.2, 0.025, 0.4))
        d.tube([(w * x, h + y, z * t) for x, y, t in arm], 0.004, STEEL, 5)
        d.cylinder(0.022, 0.035, (w * 0.4, h, -z * 0.7), STEEL)
    if style == 3 and draw.chance(0.5):
        lid = plain((0.6, 0.65, 0.7), 0.9, 0.35)
        leaf_at(d, lid, (w, depth, 0.01), (0, h + 0.02, -z), draw.between(0.1, 0.4))
    return d


def camera(draw: Draw) -> Design:
    """Photo cameras with a short or long lens, flat ones and camcorders, some on a tripod."""
    style, look = draw.style(3), draw.one_of((BLACK, BLACK, DARK, vivid_paint(draw)))
    d = Design(("camera", "compact camera", "camcorder")[style], "camera", ("photo camera",))
    w, h, t = ((0.135, 0.09, 0.045), (0.1, 0.06, 0.025), (0.06, 0.07, 0.14))[style]
    r, long = ((draw.between(0.03, 0.038), draw.between(0.03, 0.12)), (0.02, 0.02), (0.025, 0.04))[style]
    rounded_slab(d, look, (w, h * 0.8, t), 0.01, (0, h * 0.4, 0))
    upper = draw.one_of((BLACK, STEEL)) if style < 2 else look
    rounded_slab(d, upper, (w * 0.98, h * 0.25, t * 0.95), 0.008, (0, h * 0.87, 0))
    for k, (share, part) in enumerate(((1.0, BLACK), (1.05, STEEL), (0.95, BLACK), (0.75, GLASS))):
        d.roll(r * share, long * (0.4 if k < 3 else 0.02), (0, h * 0.45, t / 2 + long * 0.33 * k), part, 14)
    d.box((w * 0.25, h * 0.3, t * 0.6), ((style > 0) * w * 0.25, h * (0.8 if style else 1.1), t * 0.22), look)
    d.cylinder(0.008, 0.008, (-w * 0.37, h, 0), STEEL)
    if style == 2:
        put_flat(d, GLASS, box((0.003, 0.06, 0.09), (0, 0, -0.045)), (w / 2, h * 0.5, 0.05), (1, -0.9))
    if draw.chance(0.35):
        high, metal = draw.between(0.9, 1.4), draw.metal()
        turned_over(d, 0, 0.0, high)
        d.tube(((0, high - 0.4, 0), (0, high, 0)), 0.018, metal)
        d.tube(((0, high - 0.03, 0), (0.05, high - 0.1, -0.25)), 0.008, BLACK, 5)
        for x, z in ((-0.87, 0.5), (0.87, 0.5), (0, -1)):
            d.tube(((x * 0.03, high - 0.1, z * 0.03), (x * 0.2, high * 0.5, z * 0.2)), 0.014, BLACK, 6)
            d.tube(((x * 0.2, high * 0.5, z * 0.2), (x * 0.4, 0, z * 0.4)), 0.009, metal, 6)
    return d


def projector(draw: Draw) -> Design:
    """Flat cases with a lens, off the middle or in it, air slits and buttons on top."""
    d = Design("projector", "projector", ("video projector", "beamer"))
    w, h, depth = draw.one_of(((0.3, 0.09, 0.23), (0.36, 0.12, 0.28), (0.2, 0.2, 0.18), (0.24, 0.08, 0.2)))
    look = draw.one_of((WHITE, WHITE, PAPER, DARK, STEEL))
    r, x, y, z = h * draw.between(0.28, 0.4), w * draw.one_of((-0.26, 0, 0.24)), h / 2 + 0.015, depth / 2
    trim = STEEL if look is DARK else DARK
    rounded_slab(d, look, (w, h, depth), draw.between(0.008, h * 0.3), (0, y, 0))
    for share, near, part in ((1.0, 0.02, trim), (0.85, 0.035, BLACK), (0.65, 0.038, BLUE)):
        d.roll(r * share, near, (x, y, z), part, 16)
    left = -w * 0.28 if x >= 0 else w * 0.28
    slits = [(w * 0.3, h * 0.035, 0.006, left, y + h * k * 0.09, z) for k in range(-3, 4)]
    boxes(d, BLACK, *slits, *((0.006, h * 0.5, 0.008, -w / 2, y, z * k * 0.2) for k in range(-3, 4)))
    spots = ((0, 1), (1, 0), (-1, 0), (0, -1))
    boxes(d, trim, *((0.012, 0.006, 0.012, -x + k * 0.02, h + 0.016, -z * 0.5 + m * 0.02) for k, m in spots))
    boxes(d, BLACK, *((0.025, 0.016, depth * 0.8, side * w * 0.38, 0.008, 0) for side in SIDES))
    return d
