"""Makers of boxes and bins (see `makers.common`).

Metres, y up, front +z.
"""

import numpy as np

from langflash_core.lab.rooms.makers.kit import (
    BLACK,
    BRASS,
    DARK,
    MIRROR,
    QUARTER,
    SIDES,
    STEEL,
    TURN,
    WHITE,
    Design,
    Draw,
    across,
    ball,
    box,
    cylinder,
    hull,
    lathe,
    loft,
    merge,
    open_box,
    pad,
    plain,
    polar,
    rounded,
    shifted,
    slab,
    spread,
    torus,
    turned,
    vivid,
)
from langflash_core.lab.rooms.makers.small import crate, plain_trash_bin


def storage_box(draw: Draw) -> Design:
    """Mostly plain; else chests, crates, stacks, and boxes for shoes, toys and jewels."""
    if draw.chance(0.64):
        return crate(draw)
    return draw.one_of(
        (_chest, _chest, _open_crate, _open_crate, _box_stack, _shoe_box, _toy_box, _jewellery_box)
    )(draw)


def _chest(draw: Draw) -> Design:
    d = Design("chest", "box", ("trunk", "wooden chest"))
    w, tall, deep = draw.between(0.5, 1.05), draw.between(0.25, 0.42), draw.between(0.35, 0.5)
    look, metal = draw.wooden() if draw.chance(0.7) else draw.upholstery(), draw.one_of((BRASS, BLACK, DARK))
    d.box((w, tall, deep), (0, tall / 2, 0), look)
    vaulted = draw.chance(0.5)
    if vaulted:
        barrel = across(deep / 2, w, (0, 0, 0), 0, 20)
        barrel[..., 1] = np.clip(barrel[..., 1], 0, None) * 0.65
        d.add(shifted(barrel, (0, tall + 0.008, 0)), look)
    else:
        d.box((w * 1.02, 0.07, deep * 1.03), (0, tall + 0.04, 0), look)
    for x in (-w * 0.36, w * 0.36) if draw.chance(0.7) else (0.0,):
        d.box((0.045, tall, 0.012), (x, tall / 2, deep / 2), metal)
        if vaulted:
            band = across(deep / 2 * 1.02, 0.045, (0, 0, 0), 0, 20)
            band[..., 1] = np.clip(band[..., 1], 0, None) * 0.65
            d.add(shifted(band, (x, tall + 0.008, 0)), metal)
    d.box((0.08, 0.09, 0.02), (0, tall - 0.02, deep / 2 + 0.005), metal)
    for s in SIDES:
        path = (
            (s * w / 2, tall * 0.7, -0.06),
            (s * (w / 2 + 0.03), tall * 0.62, -0.05),
            (s * (w / 2 + 0.03), tall * 0.62, 0.05),
            (s * w / 2, tall * 0.7, 0.06),
        )
        d.tube(path, 0.008, metal, 5)
    return d


def _open_crate(draw: Draw) -> Design:
    plastic = draw.chance(0.4)
    d = Design("crate", "box", ("plastic crate" if plastic else "wooden crate", "box"))
    w, tall, deep = draw.between(0.35, 0.6), draw.between(0.2, 0.34), draw.between(0.28, 0.42)
    look = vivid(draw) if plastic else draw.wooden()
    d.box((w, 0.015, deep), (0, 0.008, 0), look)
    rows = draw.count(3, 4)
    for k in range(rows):
        y, h = tall * (k + 0.5) / rows, tall / rows * 0.72
        for s in SIDES:
            d.box((w, h, 0.012), (0, y, s * deep / 2), look)
            d.box((0.012, h, deep), (s * w / 2, y, 0), look)
    for sx in SIDES:
        for sz in SIDES:
            d.box((0.03, tall, 0.03), (sx * (w / 2 - 0.02), tall / 2, sz * (deep / 2 - 0.02)), look)
    fill = draw.style(4)
    for _ in range(draw.count(5, 9) if fill else 0):
        x, z = draw.between(-0.36, 0.36) * w, draw.between(-0.32, 0.32) * deep
        if fill == 1:
            finish = draw.one_of(((0.75, 0.15, 0.1), (0.9, 0.55, 0.1), (0.5, 0.65, 0.2)))
            ball(d, (0.09, 0.09, 0.09), (x, tall * 0.5, z), plain(finish, 0.3), 5)
        elif fill == 2:
            finish = plain(draw.one_of(((0.1, 0.25, 0.12), (0.35, 0.2, 0.08))), 0.8)
            d.add(cylinder(0.036, tall * 0.95, (x, 0.02, z), segments=10), finish)
        else:
            size = (draw.between(0.03, 0.06), tall * draw.between(0.8, 1.15), deep * 0.4)
            d.box(size, (x, tall * 0.55, z * 0.5), draw.cloth())
    return d


def _box_stack(draw: Draw) -> Design:
    d = Design("stack of boxes", "box", ("cardboard boxes", "moving boxes"))
    y, card, paper = 0.0, plain((draw.between(0.58, 0.72), 0.5, 0.33)), draw.chance(0.7)
    w, deep = draw.between(0.35, 0.6), draw.between(0.3, 0.45)
    for k in range(draw.count(2, 4)):
        shrink = 1 - draw.between(0.0, 0.14) * k
        tall, turn = draw.between(0.16, 0.36), draw.between(-0.25, 0.25) * (k > 0)
        size, look = (w * shrink, tall, deep * shrink), card if paper else draw.cloth()
        parts = [(box(size, (0, 0, 0)), look)]
        if paper:
            parts.append((box((size[0] * 1.003, tall * 1.003, 0.05), (0, 0, 0)), plain((0.78, 0.66, 0.47))))
            parts.append((box((0.12, 0.06, 0.004), (size[0] * 0.25, -tall * 0.1, size[2] / 2)), WHITE))
        else:
            parts.append((box((size[0] * 1.03, tall * 0.25, size[2] * 1.04), (0, tall * 0.4, 0)), look))
        for triangles, part in parts:
            d.add(shifted(turned(triangles, 1, turn), (draw.between(-0.02, 0.02), y + tall / 2, 0)), part)
        y += tall
    return d


def _shoe_box(draw: Draw) -> Design:
    d = Design("shoe box", "box", ("carton", "box"))
    w, tall, deep = draw.between(0.28, 0.36), draw.between(0.1, 0.14), draw.between(0.17, 0.22)
    look = vivid(draw) if draw.chance(0.6) else plain((0.66, 0.5, 0.33))
    lid = look if draw.chance(0.5) else vivid(draw)
    if draw.chance(0.6):
        d.box((w, tall, deep), (0, tall / 2, 0), look)
        d.box((w * 1.02, tall * 0.3, deep * 1.03), (0, tall * 0.88, 0), lid)
        d.box((0.09, 0.05, 0.002), (w * 0.25, tall * 0.4, deep / 2 + 0.001), WHITE)
        return d
    open_box(d, (w, tall, deep), (0, 0, 0), look, 0.006)
    leaning = Design("", "")
    open_box(leaning, (w * 1.02, tall * 0.3, deep * 1.03), (0, 0, 0), lid, 0.006)
    merge(d, leaning, lambda t: shifted(turned(t, 0, -1.1), (0, 0.1, -deep * 0.8)))
    shoe = draw.upholstery()
    for s in SIDES:
        path = (
            (-w * 0.36, tall * 0.7, s * deep * 0.22),
            (0, tall * 0.65, s * deep * 0.22),
            (w * 0.36, tall * 0.55, s * deep * 0.22),
        )
        d.add(loft(path, (deep * 0.18, deep * 0.2, deep * 0.14), 8), shoe)
    return d


def _toy_box(draw: Draw) -> Design:
    d = Design("toy box", "box", ("toy chest", "storage box"))
    w, tall, deep = draw.between(0.5, 0.8), draw.between(0.3, 0.45), draw.between(0.32, 0.45)
    look = draw.painted() if draw.chance(0.6) else draw.wooden()
    open_box(d, (w, tall, deep), (0, 0.02, 0), look, 0.018)
    front = vivid(draw)
    d.box((w * 0.7, tall * 0.5, 0.006), (0, tall * 0.5, deep / 2 + 0.002), front)
    if draw.chance(0.6):
        lid = box((w, 0.02, deep), (0, tall + 0.03, 0))
        d.add(turned(lid, 0, -draw.between(1.1, 1.7), (0, tall + 0.02, -deep / 2)), look)
    for _ in range(draw.count(5, 8)):
        x, z, side = draw.between(-0.36, 0.36) * w, draw.between(-0.3, 0.3) * deep, draw.between(0.09, 0.17)
        if draw.chance(0.5):
            ball(d, (side, side, side), (x, tall * 0.9, z), vivid(draw), 6)
        else:
            d.add(
                turned(turned(box((side, side * 0.8, side), (0, 0, 0)), 1, draw.between(0, 2)), 0, 0.4)
                + np.array([x, tall * 0.9, z]),
                vivid(draw),
            )
    for s in SIDES:
        d.box((0.08, 0.04, deep), (s * w * 0.4, 0.02, 0), look)
    return d


def _jewellery_box(draw: Draw) -> Design:
    d = Design("jewellery box", "box", ("jewelry box", "casket"))
    w, tall, deep = draw.between(0.14, 0.28), draw.between(0.06, 0.14), draw.between(0.1, 0.18)
    look = draw.wooden() if draw.chance(0.6) else draw.upholstery()
    lining = plain(draw.one_of(((0.5, 0.08, 0.12), (0.15, 0.2, 0.4), (0.85, 0.75, 0.7))))
    open_box(d, (w, tall, deep), (0, 0, 0), look, 0.01)
    d.box((w * 0.9, 0.01, deep * 0.88), (0, tall * 0.75, 0), lining)
    lean = draw.between(1.2, 1.9) if draw.chance(0.65) else 0.0
    for size, y, part in (((w, 0.02, deep), 0.01, look), ((w * 0.8, 0.004, deep * 0.75), -0.002, MIRROR)):
        d.add(turned(box(size, (0, tall + y, 0)), 0, -lean, (0, tall, -deep / 2)), part)
    for k in range(draw.count(2, 3)):
        place = (draw.between(-0.3, 0.3) * w, tall * 0.82, (k - 1) * deep * 0.2)
        d.add(torus(draw.between(0.012, 0.022), 0.003, place, 1, 10), BRASS)
    d.box((0.02, 0.025, 0.008), (0, tall * 0.85, deep / 2 + 0.003), BRASS)
    for sx in SIDES:
        for sz in SIDES:
            ball(d, (0.02, 0.02, 0.02), (sx * w * 0.44, 0.005, sz * deep * 0.42), BRASS, 4)
    if draw.chance(0.5):
        d.box((w * 0.9, 0.003, 0.004), (0, tall * 0.4, deep / 2 + 0.001), BLACK)
        ball(d, (0.012, 0.012, 0.012), (0, tall * 0.22, deep / 2 + 0.004), BRASS, 4)
    return d


def trash_bin(draw: Draw) -> Design:
    """Mostly plain; else with a pedal, of wire, with a swing lid, for sorting, for the office."""
    if draw.chance(0.64):
        return plain_trash_bin(draw)
    return draw.one_of(
        (_pedal_bin, _pedal_bin, _wire_bin, _swing_bin, _swing_bin, _sorting_bins, _office_bin)
    )(draw)


def _pedal_bin(draw: Draw) -> Design:
    d = Design("pedal bin", "trash bin", ("trash can", "step bin"))
    r, tall = draw.between(0.1, 0.17), draw.between(0.26, 0.68)
    look = STEEL if draw.chance(0.6) else draw.painted()
    square, dark = draw.chance(0.35), BLACK if draw.chance(0.7) else look
    if square:
        pad(d, (2 * r, tall - 0.04, 1.7 * r), (0, tall / 2 + 0.02, 0), look, 0.03)
        d.box((2.03 * r, 0.04, 1.73 * r), (0, 0.02, 0), dark)
        pad(d, (2.05 * r, 0.05, 1.8 * r), (0, tall + 0.025, 0), dark if draw.chance(0.5) else look, 0.02)
        front = 0.85 * r
    else:
        d.cylinder(r, tall, (0, 0.01, 0), look)
        d.cylinder(r * 1.05, 0.035, (0, 0, 0), dark)
        lid = ((r * 1.03, 0), (r * 1.03, 0.025), (r * 0.7, 0.06), (0, 0.075))
        opened = draw.between(0.7, 1.3) if draw.chance(0.2) else 0.0
        shape = turned(lathe(lid, (0, tall, 0), 18), 0, -opened, (0, tall, -r))
        d.add(shape, dark if draw.chance(0.5) else look)
        d.add(cylinder(r * 0.95, 0.01, (0, tall, 0), segments=14), BLACK)
        front = r
    d.box((0.07, 0.015, 0.07), (0, 0.03, front + 0.03), BLACK)
    if draw.chance(0.4):
        path = [
            (r * np.cos(a), tall * 0.75 + 0.2 * r * np.sin(a), -r * 0.2 + r * 1.2 * np.sin(a))
            for a in spread(0.1, np.pi - 0.1, 7)
        ]
        d.tube(path, 0.005, STEEL, 5)
    return d


def _wire_bin(draw: Draw) -> Design:
    d = Design("wire paper bin", "trash bin", ("waste paper basket", "wastebasket"))
    r, tall = draw.between(0.12, 0.16), draw.between(0.26, 0.36)
    look, many = draw.one_of((BLACK, STEEL, BRASS, vivid(draw))), draw.count(14, 20)
    low = draw.between(0.68, 0.95)
    for k in range(many):
        a = k * TURN / many
        path = (polar(r * low, a, 0.01), polar(r, a + 0.25 * (low < 0.8), tall))
        d.tube(path, 0.003, look, 3)
        if low < 0.8:
            d.tube((polar(r * low, a, 0.01), polar(r, a - 0.25, tall)), 0.003, look, 3)
    for t in (0.0, 0.35, 0.7, 1.0):
        spot = (0, 0.01 + t * (tall - 0.01), 0)
        d.add(torus(r * (low + (1 - low) * t), 0.004 if t < 1 else 0.007, spot, 1, 16), look)
    d.cylinder(r * low, 0.008, (0, 0, 0), look)
    for _ in range(draw.count(0, 6)):
        size = draw.between(0.05, 0.09)
        place = polar(draw.between(0, 0.55) * r, draw.between(0, 6), draw.between(0.06, 0.2))
        crumple = rounded((size, size, size), (0, 0, 0), 2.0, 5)
        crumple = crumple * (1 + 0.25 * np.sin(crumple[..., :1] * 160) * np.sin(crumple[..., 1:2] * 140))
        d.add(shifted(crumple, place), WHITE)
    return d


def _swing_bin(draw: Draw) -> Design:
    d = Design("swing-lid bin", "trash bin", ("trash can", "waste bin"))
    w, deep, tall = draw.between(0.24, 0.42), draw.between(0.2, 0.32), draw.between(0.4, 0.75)
    look, top = draw.painted() if draw.chance(0.7) else STEEL, DARK if draw.chance(0.5) else vivid(draw)
    d.add(hull([(0, 0, 0), (w * 0.78, deep * 0.78, 0), (w, deep, tall)]), look)
    hood = [(1.04, 1.04, -0.03), (1.04, 1.04, 0.0), (0.75, 0.45, 0.16), (0.0, 0.0, 0.16)]
    d.add(hull([(w * a, deep * b, tall + y) for a, b, y in hood]), top)
    flap = box((w * 0.68, 0.17, 0.012), (0, 0, 0))
    tilt = np.arctan2(0.16, deep * 0.29)
    shape = turned(flap, 0, tilt - QUARTER + draw.between(-0.35, 0.0))
    d.add(shifted(shape, (0, tall + 0.08, deep * 0.39)), look if draw.chance(0.5) else WHITE)
    return d


def _sorting_bins(draw: Draw) -> Design:
    d = Design("recycling bins", "trash bin", ("recycling boxes", "waste sorting bins"))
    many, w = draw.count(2, 4), draw.between(0.2, 0.3)
    tall, deep = draw.between(0.32, 0.75), draw.between(0.28, 0.38)
    colours = [
        plain(c, 0.3) for c in ((0.15, 0.35, 0.7), (0.9, 0.75, 0.1), (0.15, 0.5, 0.22), (0.45, 0.45, 0.46))
    ]
    grey, lids = draw.one_of((DARK, WHITE, STEEL)), draw.chance(0.6)
    for k in range(many):
        x, look = (k - (many - 1) / 2) * w * 1.04, colours[k]
        if lids:
            d.add(slab(((0.85, 0), (1, 1)), (w, tall, deep), (x, 0, 0)), grey)
            pad(d, (w * 1.02, 0.06, deep * 1.03), (x, tall + 0.02, 0), look, 0.02)
            d.box((w * 0.5, 0.03, 0.015), (x, tall - 0.02, deep / 2 + 0.01), look)
        else:
            open_box(d, (w, tall, deep), (x, 0, 0), look, 0.012)
        label = plain((0.95, 0.95, 0.94))
        d.box((w * 0.4, w * 0.4, 0.004), (x, tall * 0.55, deep / 2 + 0.003), label)
        for j in range(3):
            arrow = box((w * 0.2, w * 0.04, 0.002), (0, w * 0.1, 0))
            d.add(shifted(turned(arrow, 2, j * TURN / 3), (x, tall * 0.55, deep / 2 + 0.006)), look)
    return d


def _office_bin(draw: Draw) -> Design:
    d = Design("office bin", "trash bin", ("waste paper bin", "wastebasket"))
    r, tall = draw.between(0.11, 0.16), draw.between(0.27, 0.38)
    look = draw.one_of((DARK, BLACK, STEEL, draw.wooden(), vivid(draw), draw.upholstery()))
    if draw.chance(0.4):
        open_box(d, (2 * r, tall, 1.5 * r), (0, 0, 0), look, 0.012)
        for s in SIDES:
            place = (0, tall * 0.85, s * (0.75 * r + 0.002))
            d.box((0.09, 0.03, 0.004), place, BLACK if look is not BLACK else STEEL)
    else:
        low = draw.between(0.7, 1.0)
        path = (
            (0, 0),
            (r * low, 0),
            (r, tall),
            (r * 1.05, tall),
            (r * 0.95, tall - 0.01),
            (r * low * 0.95, 0.03),
            (0, 0.03),
        )
        d.lathe(path, look, 18)
    if draw.chance(0.5):
        bag = WHITE if draw.chance(0.5) else plain((0.3, 0.35, 0.5), 0.4)
        path = (
            (r * 1.0, tall * 0.82),
            (r * 1.07, tall * 0.86),
            (r * 1.07, tall + 0.005),
            (r * 0.9, tall),
            (r * 0.85, tall * 0.6),
        )
        d.lathe(path, bag, 14)
    for _ in range(draw.count(0, 4)):
        place = polar(draw.between(0, 0.45) * r, draw.between(0, 6), tall * draw.between(0.55, 0.9))
        ball(d, (0.08, 0.07, 0.08), place, WHITE, 4)
    return d
