"""Makers of desks (see `makers.common`).

Metres, y up, front +z.
"""

from langflash_core.lab.rooms.makers.furniture import (
    plain_desk,
)
from langflash_core.lab.rooms.makers.kit import (
    BLACK,
    DARK,
    SIDES,
    STEEL,
    WHITE,
    Design,
    Draw,
    Face,
    across,
    box,
    four_legs,
    pad,
    panels,
    plain,
    turned,
)
from langflash_core.lab.rooms.makers.storage import shelf_rows


def desk(draw: Draw) -> Design:
    """Mostly plain; else secretaries, corner desks, hutches, trestles, standing and school desks."""
    if draw.chance(0.71):
        return plain_desk(draw)
    many = (_secretary, _corner_desk, _hutch_desk, _trestle_desk, _trestle_desk, _standing_desk, _school_desk)
    return draw.one_of(many)(draw)


def _secretary(draw: Draw) -> Design:
    d = Design("secretary desk", "desk", ("bureau", "secretaire"))
    look, front = draw.body(), draw.body()
    wide, deep, tall, top = draw.between(0.75, 1.05), draw.between(0.38, 0.46), draw.between(1.15, 1.9), 0.75
    if draw.chance(0.5):
        d.box((wide, top - 0.1, deep), (0, top / 2 + 0.03, 0), look)
        panels(d, draw, Face(-wide / 2, 0.1, wide, top - 0.14, deep / 2), draw.count(2, 3), 1, front)
    else:
        four_legs(d, draw, wide, deep, top - 0.02, look)
        panels(d, draw, Face(-wide / 2, top - 0.15, wide, 0.13, deep / 2 - 0.02), 1, 2, front)
        d.box((wide * 0.96, 0.13, deep * 0.9), (0, top - 0.085, 0), look)
    d.box((wide, 0.025, deep + 0.3), (0, top, 0.15), look)
    upper = tall - top
    d.box((wide, upper, 0.02), (0, top + upper / 2, -deep / 2 + 0.01), look)
    place = (wide, upper, deep * 0.7)
    shelf_rows(
        d, draw, place, (0, top, -deep * 0.15), max(2, round(upper / 0.3)), draw.count(2, 3), look, 0.55
    )
    if tall > 1.6:
        d.box((wide + 0.06, 0.06, deep), (0, tall + 0.03, -deep * 0.1), look)
    return d


def _corner_desk(draw: Draw) -> Design:
    d = Design("corner desk", "desk", ("L-shaped desk", "computer desk"))
    wide, reach, top = draw.between(1.35, 1.8), draw.between(1.2, 1.6), draw.between(0.72, 0.76)
    a, b, hand = draw.between(0.55, 0.68), draw.between(0.48, 0.6), draw.one_of(SIDES)
    look, leg = draw.body(), draw.legs()
    d.box((wide, 0.03, a), (0, top, -reach / 2 + a / 2), look)
    d.box((b, 0.03, reach - a), (hand * (wide - b) / 2, top, a / 2), look)
    spots = (
        (wide / 2, -reach / 2),
        (wide / 2, reach / 2),
        (-wide / 2, -reach / 2),
        (-wide / 2, -reach / 2 + a),
        (wide / 2 - b, reach / 2),
    )
    for x, z in spots:
        d.box((0.05, top, 0.05), (hand * x * 0.96, top / 2, z * 0.96), leg)
    d.box((wide * 0.9, 0.35, 0.018), (0, top - 0.2, -reach / 2 + 0.05), look)
    if draw.chance(0.6):
        x = -hand * (wide / 2 - 0.22)
        d.box((0.4, top - 0.06, a * 0.9), (x, top / 2 - 0.02, -reach / 2 + a / 2), look)
        face = Face(x - 0.2, 0.04, 0.4, top - 0.1, -reach / 2 + a * 0.95)
        panels(d, draw, face, draw.count(2, 4), 1, draw.body())
    if draw.chance(0.5):
        place = (hand * wide * 0.15, top, -reach / 2 + 0.13)
        shelf_rows(d, draw, (wide * 0.6, draw.between(0.3, 0.55), 0.24), place, draw.count(1, 2), 2, look)
    return d


def _hutch_desk(draw: Draw) -> Design:
    d = Design("desk with hutch", "desk", ("computer desk", "writing desk"))
    wide, deep, top, tall = draw.between(1.0, 1.4), draw.between(0.5, 0.62), 0.74, draw.between(0.55, 0.95)
    look, front, side = draw.body(), draw.body(), draw.one_of(SIDES)
    d.box((wide, 0.03, deep), (0, top, 0), look)
    for s in SIDES:
        d.box((0.03, top, deep), (s * (wide / 2 - 0.015), top / 2, 0), look)
    x = side * (wide / 2 - 0.2)
    d.box((0.37, top - 0.05, deep * 0.95), (x, top / 2, 0), look)
    face = Face(x - 0.19, 0.05, 0.38, top - 0.1, deep * 0.475)
    panels(d, draw, face, draw.count(1, 4), 1, front, draw.chance(0.2))
    d.box((wide, 0.3, 0.018), (0, top - 0.2, -deep / 2 + 0.04), look)
    shelf_rows(d, draw, (wide, tall, 0.25), (0, top, -deep / 2 + 0.13), 2, draw.count(2, 3), look, 0.6)
    d.box((wide, tall, 0.01), (0, top + tall / 2, -deep / 2 + 0.01), front)
    if draw.chance(0.5):
        face = Face(-wide / 2, top + tall / 2, wide * 0.4, tall / 2, -deep / 2 + 0.255)
        panels(d, draw, face, 1, 1, front, True)
    return d


def _trestle_desk(draw: Draw) -> Design:
    d = Design("trestle desk", "desk", ("glass desk", "work table"))
    wide, deep, top = draw.between(1.2, 1.7), draw.between(0.6, 0.8), draw.between(0.72, 0.76)
    glass = draw.chance(0.6)
    look = plain((0.7, 0.82, 0.8), 0.9, opacity=0.4) if glass else draw.body()
    wood = draw.legs()
    d.box((wide, 0.012 if glass else 0.03, deep), (0, top, 0), look)
    for s in SIDES:
        x = s * wide * 0.36
        if draw.style(2):
            for sz in SIDES:
                for sx in SIDES:
                    path = (
                        (x + sx * 0.14, 0, sz * deep * 0.42),
                        (x + sx * 0.03, top - 0.03, sz * deep * 0.36),
                    )
                    d.tube(path, 0.02, wood, 5)
                d.box((0.22, 0.025, 0.025), (x, 0.3, sz * deep * 0.4), wood)
            d.box((0.1, 0.05, deep * 0.85), (x, top - 0.03, 0), wood)
        else:
            for sz in SIDES:
                d.tube(((x, 0, sz * deep * 0.45), (x, top - 0.01, -sz * deep * 0.4)), 0.022, wood, 6)
            d.box((0.05, 0.03, deep * 0.85), (x, top - 0.02, 0), wood)
    if draw.chance(0.5):
        d.box((wide * 0.5, 0.07, deep * 0.5), (0, top - 0.06, 0), wood)
    else:
        d.box((wide * 0.72, 0.03, 0.03), (0, 0.3, -deep * 0.1), wood)
    return d


def _standing_desk(draw: Draw) -> Design:
    d = Design("standing desk", "desk", ("height-adjustable desk",))
    wide, deep, top = draw.between(1.1, 1.7), draw.between(0.6, 0.8), draw.between(0.72, 1.12)
    look, leg = draw.body(), draw.one_of((DARK, WHITE, STEEL))
    pad(d, (wide, 0.03, deep), (0, top, 0), look, 0.015)
    for s in SIDES:
        x = s * wide * 0.36
        d.box((0.08, 0.04, deep * 0.9), (x, 0.02, 0), leg)
        d.box((0.09, top * 0.55, 0.06), (x, top * 0.28, 0), leg)
        d.box((0.07, top * 0.95, 0.045), (x, top / 2, 0), leg)
        d.box((0.05, 0.03, deep * 0.8), (x, top - 0.03, 0), leg)
    d.box((wide * 0.72, 0.05, 0.06), (0, top - 0.05, 0), leg)
    d.box((0.12, 0.02, 0.05), (wide * 0.3, top - 0.03, deep / 2 - 0.02), BLACK)
    return d


def _school_desk(draw: Draw) -> Design:
    d = Design("school desk", "desk", ("pupil's desk", "children's desk"))
    wide, deep = draw.between(0.6, 0.75), draw.between(0.45, 0.55)
    top, slope = draw.between(0.66, 0.76), draw.between(0.0, 0.18)
    wood, leg = draw.body(), draw.metal()
    board = box((wide, 0.025, deep), (0, top, 0))
    d.add(turned(board, 0, slope, (0, top, 0)), wood)
    d.box((wide * 0.92, 0.1, deep * 0.85), (0, top - 0.09, -0.01), leg if draw.chance(0.4) else wood)
    for s in SIDES:
        x = s * wide * 0.42
        d.tube(((x, top - 0.05, 0), (x, 0.03, -deep * 0.1)), 0.018, leg, 6)
        d.tube(((x, 0.02, -deep * 0.5), (x, 0.02, deep * 0.5)), 0.018, leg, 6)
    d.add(across(0.014, wide * 0.84, (0, 0.2, -deep * 0.07), 0, 6), leg)
    if draw.chance(0.5):
        d.box((wide * 0.7, 0.025, 0.3), (0, 0.42, deep * 0.5 + 0.22), wood)
        for s in SIDES:
            x = s * wide * 0.3
            path = ((x, 0.02, deep * 0.5), (x, 0.02, deep * 0.5 + 0.36), (x, 0.85, deep * 0.5 + 0.42))
            d.tube(path, 0.016, leg, 6)
            d.tube(((x, 0.02, deep * 0.5 + 0.1), (x, 0.41, deep * 0.5 + 0.12)), 0.016, leg, 6)
        d.box((wide * 0.68, 0.2, 0.02), (0, 0.75, deep * 0.5 + 0.4), wood)
    return d
