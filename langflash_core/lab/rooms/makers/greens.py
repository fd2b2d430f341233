"""Makers of plants (see `makers.common`).

Metres, y up, front +z.
"""

from collections.abc import Sequence

import numpy as np

from langflash_core.lab.rooms.makers.kit import (
    BARK,
    QUARTER,
    SIDES,
    TURN,
    Design,
    Draw,
    Look,
    Triangles,
    Vector,
    ball,
    cylinder,
    grid_triangles,
    lathe,
    leaflet,
    loft,
    mixed,
    open_box,
    plain,
    polar,
    put,
    rounded,
    scaled,
    shifted,
    spread,
    tube,
    turned,
    woven,
)
from langflash_core.lab.rooms.makers.small import plain_plant

_SOIL = plain((0.14, 0.10, 0.07))


def plant(draw: Draw) -> Design:
    """Mostly plain; else of kinds that people know by name."""
    if draw.chance(0.77):
        return plain_plant(draw)
    large = (_monstera, _cactus, _palm, _ivy, _snake_plant, _fern, _ficus)
    return draw.one_of((*large, _bonsai, _bouquet, _orchid, _succulents))(draw)


def _leafy(draw: Draw) -> list[Look]:
    green = plain((draw.between(0.1, 0.33), draw.between(0.36, 0.6), draw.between(0.07, 0.26)), 0.25)
    return [mixed(green, (0.0, 0.0, 0.0), shade) for shade in (0.33, 0.17, 0.0)]


def _pot(d: Design, draw: Draw, radius: float, tall: float, foot: float = 0.0) -> float:
    """A pot of some kind with soil; returns where things grow from."""
    style, look = draw.style(5), draw.ceramic() if draw.chance(0.6) else plain((0.68, 0.38, 0.25), 0.1)
    if style == 0:
        open_box(d, (1.8 * radius, tall, 1.8 * radius), (0, foot, 0), look, 0.02)
    elif style == 1:
        low = ((0.75, 0), (0.92, 0.78), (1, 0.8), (1.04, 1), (0.92, 1), (0.86, 0.85), (0, 0.85))
        d.add(lathe(scaled(low, radius, tall), (0, foot, 0), 16), look)
    elif style == 2:
        path = ((0.6, 0), (1, 0.3), (1.08, 0.6), (0.9, 1), (0.8, 1), (0.8, 0.85), (0, 0.85))
        d.add(lathe(scaled(path, radius, tall), (0, foot, 0), 18), look)
    elif style == 3:
        wicker = woven(draw)
        for k in range(5):
            y, r = foot + tall * k / 5, radius * (0.85 + 0.17 * k / 5)
            d.add(lathe(((r * 0.94, y), (r, y + tall / 10), (r * 0.94, y + tall / 5)), (0, 0, 0), 16), wicker)
    else:
        path = ((0.9, 0), (1, 0), (1, 1), (0.9, 1), (0.88, 0.85), (0, 0.85))
        d.add(lathe(scaled(path, radius, tall), (0, foot, 0), 16), look)
        if foot == 0.0 and draw.chance(0.4):
            for k in range(3):
                path = (
                    polar(radius * 1.1, k * TURN / 3, 0),
                    polar(radius * 0.98, k * TURN / 3, tall * 0.6),
                )
                d.tube(path, 0.012, draw.wooden(), 5)
    d.add(cylinder(radius * 0.86, 0.01, (0, foot + tall * 0.86, 0), segments=14), _SOIL)
    return foot + tall * 0.86


def _monstera(draw: Draw) -> Design:
    d = Design("monstera", "plant", ("potted plant", "houseplant"))
    radius, greens = draw.between(0.12, 0.2), _leafy(draw)
    base, size = _pot(d, draw, radius, draw.between(0.2, 0.36)), draw.between(0.24, 0.38)
    for k in range(draw.count(8, 14)):
        yaw = 2.4 * k + draw.between(-0.4, 0.4)
        reach, high = draw.between(0.1, 0.32), base + draw.between(0.2, 0.75)
        x, z = reach * np.sin(yaw), reach * np.cos(yaw)
        d.tube(
            ((0, base, 0), (x * 0.6, base + (high - base) * 0.7, z * 0.6), (x, high, z)), 0.007, greens[0], 4
        )
        leaf = leaflet(size * draw.between(0.8, 1.15), size * draw.between(0.85, 1.0), 0.45, 0.5, 13, 0.6)
        d.add(put(leaf, draw.between(-0.4, 0.4), yaw, (x, high, z)), draw.one_of(greens))
    return d


def _ribbed(profile: Sequence[tuple[float, float]], ribs: int, depth: float, at: Vector) -> Triangles:
    """A profile turned about the y axis, with ribs."""
    turn = np.linspace(0, TURN, 4 * ribs + 1)
    wave = 1 - depth * (0.5 - 0.5 * np.cos(turn * ribs))
    r, y = np.array(profile).T
    ring = np.stack([np.cos(turn) * wave, 0 * turn, np.sin(turn) * wave], -1)
    return grid_triangles(
        r[:, None, None] * ring[None] + y[:, None, None] * np.array([0.0, 1.0, 0.0]) + np.array(at)
    )


def _cactus(draw: Draw) -> Design:
    d = Design("cactus", "plant", ("cactus plant", "succulent"))
    style, green = draw.style(3), _leafy(draw)[1]
    radius = draw.between(0.05, 0.14)
    base = _pot(d, draw, radius, radius * draw.between(1.2, 1.8))
    if style == 0:
        r, tall = radius * 0.5, radius * draw.between(4, 8)
        path = ((r * 0.8, 0), (r, tall * 0.15), (r, tall * 0.88), (r * 0.7, tall * 0.97), (0, tall))
        d.add(_ribbed(path, 8, 0.25, (0, base, 0)), green)
        for s in SIDES:
            if draw.chance(0.75):
                y, out = base + tall * draw.between(0.3, 0.55), r * draw.between(1.9, 2.6)
                arm = (
                    (s * r * 0.6, y, 0),
                    (s * out, y + r * 0.3, 0),
                    (s * out, y + tall * 0.15, 0),
                    (s * out, y + tall * draw.between(0.25, 0.4), 0),
                )
                d.add(loft(arm, (r * 0.55, r * 0.6, r * 0.6, r * 0.5)), green)
    elif style == 1:
        r = radius * draw.between(0.75, 1.0)
        outline = [(r * np.sin(a), r * 0.9 * (1 - np.cos(a))) for a in spread(0.35, np.pi, 8)]
        d.add(_ribbed(outline, 11, 0.2, (0, base - r * 0.06, 0)), green)
        for k in range(5):
            a = k * TURN / 5
            place = polar(r * 0.25, a, base + 1.72 * r)
            ball(d, (r * 0.25, r * 0.2, r * 0.25), place, plain(draw.colour(0.9, 0.8)), 4)
    else:
        places = [(0.0, base, 1.0)]
        for x, y, s in list(places):
            for k in range(draw.count(2, 3)):
                places.append((x + (k - 0.8) * radius * 0.9, y + radius * 1.7 * s, draw.between(0.6, 0.8)))
        for x, y, s in places:
            size = (radius * 1.3 * s, radius * 2.1 * s, radius * 0.35)
            d.add(turned(rounded(size, (x, y + radius * s, 0), 2.0, 7), 1, draw.between(-0.4, 0.4)), green)
    return d


def _palm(draw: Draw) -> Design:
    d = Design("palm", "plant", ("potted palm", "houseplant"))
    radius, greens = draw.between(0.13, 0.2), _leafy(draw)
    base = _pot(d, draw, radius, draw.between(0.22, 0.36))
    tall, trunks = draw.between(0.0, 0.8), draw.count(1, 2)
    for j in range(trunks):
        top = (draw.between(-0.1, 0.1), base + tall + 0.08, (j - 0.5 * (trunks - 1)) * 0.12)
        path = (
            (0, base - 0.02, (j - 0.5 * (trunks - 1)) * 0.06),
            (top[0] * 0.4, base + tall * 0.5, top[2]),
            top,
        )
        d.add(loft(path, (0.035, 0.028, 0.025), 8), BARK)
        for k in range(draw.count(7, 11) // trunks + 1):
            yaw, pitch, long = 2.4 * k + j, draw.between(0.3, 1.2), draw.between(0.45, 0.75)
            bend = 0.9
            spine = np.array(
                [
                    (
                        0,
                        long * (np.sin(pitch) * t - bend * 0.55 * t * t),
                        long * np.cos(pitch) * t * (1 - 0.1 * t),
                    )
                    for t in spread(0, 1, 9)
                ]
            )
            frond = []
            for t, point in zip(spread(0, 1, 9)[1:], spine[1:], strict=True):
                leaf = leaflet(long * 0.38 * np.sin(np.pi * (0.25 + 0.7 * t)), 0.028, 0.35, 0, 4)
                for s in SIDES:
                    frond.append(shifted(turned(leaf, 1, s * 1.0), tuple(point.tolist())))
            frond.append(tube([tuple(p) for p in spine[::2].tolist()], 0.006, 3))
            d.add(shifted(turned(np.concatenate(frond), 1, yaw), top), draw.one_of(greens))
    return d


def _ivy(draw: Draw) -> Design:
    d = Design("hanging ivy", "plant", ("ivy", "trailing plant", "houseplant"))
    radius, tall, greens = draw.between(0.09, 0.14), draw.between(0.55, 1.0), _leafy(draw)
    if draw.chance(0.5):
        look = draw.legs()
        d.cylinder(radius * 1.2, 0.02, (0, tall - 0.02, 0), look)
        for k in range(3):
            d.tube((polar(radius * 1.5, k * TURN / 3, 0), polar(radius, k * TURN / 3, tall)), 0.012, look, 6)
    else:
        look = draw.body()
        d.box((radius * 2.4, 0.03, radius * 2.4), (0, tall - 0.015, 0), look)
        d.box((radius * 1.2, tall, radius * 1.2), (0, tall / 2, 0), look)
        d.box((radius * 2.2, 0.03, radius * 2.2), (0, 0.015, 0), look)
    top = _pot(d, draw, radius, draw.between(0.14, 0.2), tall)
    for k in range(draw.count(9, 14)):
        a, fall = 2.4 * k, draw.between(0.15, 0.9) * tall
        lip, out = radius * 1.1, radius * draw.between(1.3, 2.0)
        path = [
            polar(0.02, a, top),
            polar(lip, a, top + 0.06),
            polar(out, a, top - 0.1 * fall),
            polar(out * 1.08, a + 0.15, top - fall),
        ]
        d.tube(path, 0.004, greens[0], 3)
        points = np.array(path)
        for t in spread(0.1, 1.0, 3 + int(fall * 10)):
            i = min(int(t * 3), 2)
            place = points[i] + (points[i + 1] - points[i]) * (t * 3 - i)
            leaf = leaflet(draw.between(0.05, 0.085), draw.between(0.045, 0.07), 0.2, 0, 5, 0.55)
            shape = put(
                leaf, draw.between(-1.0, 0.2), draw.between(-1.2, 1.2) + QUARTER - a, tuple(place.tolist())
            )
            d.add(shape, draw.one_of(greens))
    return d


def _bonsai(draw: Draw) -> Design:
    d = Design("bonsai", "plant", ("bonsai tree",))
    s, greens, look = draw.between(0.8, 1.5), _leafy(draw), draw.ceramic()
    open_box(d, (0.24 * s, 0.06 * s, 0.16 * s), (0, 0.015, 0), look, 0.012)
    d.box((0.22 * s, 0.01, 0.14 * s), (0, 0.055 * s, 0), _SOIL if draw.chance(0.5) else greens[0])
    for sx in SIDES:
        d.box((0.03, 0.02, 0.12 * s), (sx * 0.08 * s, 0.01, 0), look)
    sway = draw.between(0.03, 0.09) * s * draw.one_of(SIDES)
    trunk = ((0, 0.05 * s, 0), (sway, 0.13 * s, 0.01), (-sway * 0.6, 0.2 * s, 0), (sway * 0.5, 0.29 * s, 0))
    d.add(loft(trunk, (0.022 * s, 0.018 * s, 0.014 * s, 0.009 * s), 8), BARK)
    clouds = [
        (sway * 0.5, 0.33 * s, 0.0, 0.17),
        (sway + 0.09 * s, 0.18 * s, 0.02, 0.13),
        (-sway - 0.09 * s, 0.24 * s, 0.0, 0.14),
        (0.0, 0.25 * s, 0.08 * s, 0.11),
    ]
    for x, y, z, r in clouds:
        d.tube(((0, y - 0.05 * s, 0), (x, y, z)), 0.006 * s, BARK, 5)
        cloud = rounded((r * s, r * 0.45 * s, r * 0.85 * s), (0, 0, 0), 2.0, 7)
        ripple = 1 + 0.18 * np.sin(cloud[..., :1] * 90 / s) * np.sin(cloud[..., 2:] * 80 / s + 1)
        d.add(shifted(cloud * ripple, (x, y, z)), draw.one_of(greens))
    return d


def _blossom(
    d: Design, draw: Draw, at: Vector, size: float, look: Look, heart: Look, tilt: float, yaw: float
) -> None:
    """Five to eight petals about a heart, facing up, then tilted."""
    flower, many = [], draw.count(5, 8)
    for k in range(many):
        flower.append(
            turned(turned(leaflet(size, size * 0.75, 0.1, 0, 4, 1.2), 0, -0.35), 1, k * TURN / many)
        )
    d.add(shifted(turned(turned(np.concatenate(flower), 0, tilt), 1, yaw), at), look)
    ball(d, (size * 0.5, size * 0.4, size * 0.5), at, heart, 4)


def _bouquet(draw: Draw) -> Design:
    d = Design("flowers in a vase", "plant", ("bouquet", "flowers", "cut flowers"))
    tall, r, greens = draw.between(0.16, 0.3), draw.between(0.04, 0.075), _leafy(draw)
    look = plain((0.75, 0.85, 0.87), 0.9, opacity=0.4) if draw.chance(0.4) else draw.ceramic()
    path = (
        ((0.8, 0), (1, 0.4), (0.6, 0.8), (0.75, 1)),
        ((0.7, 0), (0.75, 0.5), (1, 1)),
        ((1, 0), (1, 1)),
        ((0.5, 0), (1.1, 0.3), (1.0, 0.6), (0.45, 0.9), (0.55, 1)),
    )
    vase = draw.one_of(path)
    d.lathe([(0, 0), *scaled(vase, r, tall)], look, 16)
    colours, style = [plain(draw.colour(0.9, 0.75)) for _ in range(draw.count(1, 3))], draw.style(3)
    for k in range(draw.count(7, 13)):
        a, out, high = 2.4 * k, draw.between(0.03, 0.17), tall + draw.between(0.1, 0.26)
        tip, look = polar(out, a, high), draw.one_of(colours)
        d.tube(((0, tall * 0.5, 0), polar(out * 0.3, a, tall), tip), 0.004, greens[0], 4)
        if style == 0:
            finish = plain((0.9, 0.75, 0.2))
            _blossom(d, draw, tip, draw.between(0.03, 0.05), look, finish, 0.3 + out * 4, QUARTER - a)
        elif style == 1:
            cup = lathe(((0, 0), (0.022, 0.012), (0.026, 0.035), (0.012, 0.06)), tip, 7)
            d.add(cup, look)
        else:
            ball(d, (0.065, 0.055, 0.065), tip, look, 5)
            ball(d, (0.04, 0.04, 0.04), (tip[0], tip[1] + 0.02, tip[2]), colours[0], 4)
        for _ in range(2):
            leaf = leaflet(draw.between(0.08, 0.14), 0.03, 0.4, 0, 5)
            place = polar(out * 0.4, a, tall + 0.02)
            d.add(put(leaf, draw.between(0.2, 1.0), draw.between(0, TURN), place), draw.one_of(greens))
    return d


def _snake_plant(draw: Draw) -> Design:
    d = Design("snake plant", "plant", ("sansevieria", "houseplant"))
    radius, greens = draw.between(0.07, 0.16), _leafy(draw)
    base, rim = _pot(d, draw, radius, radius * draw.between(1.3, 2.2)), plain((0.75, 0.75, 0.35))
    for k in range(draw.count(9, 18)):
        a, long = 2.4 * k, draw.between(2.2, 6.0) * radius
        width, twist = radius * draw.between(0.3, 0.5), draw.between(0, TURN)
        t = np.linspace(0, 1, 6)
        half = width / 2 * np.array([0.6, 0.85, 1.0, 0.95, 0.7, 0.05])
        lean = draw.between(0.0, 0.22)
        for scale, look, off in ((1.0, rim, 0.0), (0.72, draw.one_of(greens), 0.003)):
            x = np.stack([-half, half], 1) * scale
            blade = np.stack([x, np.repeat(t[:, None] * long, 2, 1), np.abs(x) * 0.3 + off], -1)
            for face in (1, -1) if off else (1,):
                sheet = grid_triangles(blade - np.array([0, 0, 2 * off * (face < 0)]))
                place = polar(radius * 0.55 * np.sqrt((k % 7) / 7), a, base)
                d.add(shifted(turned(turned(turned(sheet, 1, twist), 0, lean), 1, QUARTER - a), place), look)
    return d


def _fern(draw: Draw) -> Design:
    d = Design("fern", "plant", ("boston fern", "houseplant"))
    radius, greens = draw.between(0.08, 0.15), _leafy(draw)
    foot = 0.0
    if draw.chance(0.4):
        foot, look = draw.between(0.2, 0.5), draw.legs()
        d.cylinder(radius * 1.15, 0.02, (0, foot - 0.02, 0), look)
        for k in range(4):
            d.tube((polar(radius * 1.4, k * QUARTER, 0), polar(radius, k * QUARTER, foot)), 0.012, look, 6)
    base = _pot(d, draw, radius, radius * draw.between(1.2, 1.7), foot)
    for k in range(draw.count(18, 28)):
        yaw, long, up = 2.4 * k, radius * draw.between(2.2, 4.2), draw.between(0.2, 1.3)
        n = 13
        t = np.linspace(0, 1, n)
        half = (
            radius
            * 0.42
            * np.sin(np.pi * np.clip(t * 0.9 + 0.1, 0, 1))
            * np.where(np.arange(n) % 2, 1.0, 0.35)
        )
        middle = np.stack(
            [0 * t, long * (np.sin(up) * t - 0.75 * t * t), long * np.cos(up) * t + 0.1 * long * t], -1
        )
        side = np.array([1.0, 0.1, 0.0]) * half[:, None]
        frond = grid_triangles(np.stack([middle - side, middle, middle + side], 1))
        d.add(shifted(turned(frond, 1, yaw), (0, base, 0)), draw.one_of(greens))
    return d


def _orchid(draw: Draw) -> Design:
    d = Design("orchid", "plant", ("orchid in a pot", "flower"))
    radius, greens = draw.between(0.05, 0.08), _leafy(draw)
    base = _pot(d, draw, radius, radius * draw.between(1.5, 2.2))
    path = ((0.95, 0.94, 0.93), (0.8, 0.35, 0.6), (0.9, 0.7, 0.8), (0.6, 0.3, 0.65), (0.92, 0.85, 0.45))
    petal = plain(draw.one_of(path))
    for k in range(draw.count(5, 7)):
        leaf = leaflet(draw.between(0.14, 0.22), 0.055, 0.5, 0, 6)
        d.add(put(leaf, draw.between(0.2, 0.7), 2.4 * k, (0, base, 0)), greens[k % 3])
    for j in range(draw.count(1, 3)):
        yaw, tall = 2.2 * j + draw.between(0, 1), draw.between(0.35, 0.55)
        stem = [
            (
                0.16 * t**2.5 * 1.6 * np.sin(yaw),
                base + tall * (1 - (1 - t) ** 1.6) - 0.1 * t**4,
                0.16 * t**2.5 * 1.6 * np.cos(yaw),
            )
            for t in spread(0, 1, 9)
        ]
        d.tube(stem, 0.004, greens[0], 4)
        for k, place in enumerate(stem[3:]):
            at = (
                place[0] + 0.02 * (-1) ** k * np.cos(yaw),
                place[1],
                place[2] - 0.02 * (-1) ** k * np.sin(yaw),
            )
            finish = plain((0.75, 0.2, 0.4))
            _blossom(d, draw, at, draw.between(0.032, 0.045), petal, finish, 1.3, yaw + 0.3 * (-1) ** k)
    return d


def _ficus(draw: Draw) -> Design:
    d = Design("ficus", "plant", ("fiddle-leaf fig", "indoor tree", "potted plant"))
    radius, tall, greens = draw.between(0.16, 0.22), draw.between(0.8, 1.4), _leafy(draw)
    wicker, pot = woven(draw), draw.between(0.28, 0.38)
    for k in range(6):
        y, r = pot * k / 6, radius * (0.9 + 0.1 * np.sin(np.pi * (k + 0.5) / 6))
        d.lathe(((r * 0.95, y), (r, y + pot / 12), (r * 0.95, y + pot / 6)), wicker, 18)
    for s in SIDES:
        path = [
            (s * radius * (1 + 0.15 * np.sin(a)), pot - 0.02 + 0.05 * np.sin(a), 0.05 * np.cos(a))
            for a in spread(0, np.pi, 5)
        ]
        d.tube(path, 0.01, wicker, 5)
    d.cylinder(radius * 0.9, 0.01, (0, pot * 0.9, 0), _SOIL)
    many = draw.count(1, 3)
    big = draw.chance(0.5)
    for j in range(many):
        lean = polar(0.1 * (many > 1) + 0.03, 2.1 * j, 0)
        top = (lean[0] * 2, pot + tall * draw.between(0.8, 1.0), lean[2] * 2)
        path = ((lean[0] * 0.3, pot * 0.9, lean[2] * 0.3), (lean[0], pot + tall * 0.5, lean[2]), top)
        d.add(loft(path, (0.018, 0.014, 0.008), 7), BARK)
        for k in range((34 if big else 60) // many):
            t, yaw = draw.between(0.25, 1.0), 2.4 * k
            long = draw.between(0.17, 0.28) if big else draw.between(0.07, 0.13)
            out = 0.03 if big else draw.between(0.02, 0.24) * np.sin(np.pi * min(1.0, t))
            place = (top[0] * t + out * np.sin(yaw), pot + (top[1] - pot) * t, top[2] * t + out * np.cos(yaw))
            shape = leaflet(long, long * (0.65 if big else 0.5), 0.3, 0, 5)
            d.add(put(shape, draw.between(-0.4, 0.9), yaw, place), draw.one_of(greens))
    return d


def _succulents(draw: Draw) -> Design:
    d = Design("succulents", "plant", ("succulent tray", "succulent"))
    wide, deep = draw.between(0.16, 0.4), draw.between(0.11, 0.18)
    tall, look = draw.between(0.05, 0.08), draw.body() if draw.chance(0.5) else draw.ceramic()
    open_box(d, (wide, tall, deep), (0, 0, 0), look, 0.008)
    d.box((wide * 0.95, 0.01, deep * 0.94), (0, tall * 0.85, 0), plain((0.6, 0.55, 0.48)))
    tones = ((0.35, 0.5, 0.38), (0.5, 0.6, 0.5), (0.55, 0.4, 0.45), (0.25, 0.45, 0.25), (0.65, 0.7, 0.45))
    for x in spread(-wide / 2 + 0.05, wide / 2 - 0.05, max(2, round(wide / 0.09))):
        tone, r, kind = plain(draw.one_of(tones), 0.1), draw.between(0.035, 0.055), draw.style(3)
        at = (x, tall * 0.88, draw.between(-0.2, 0.2) * deep)
        if kind < 2:
            for ring, many in ((1.0, 8), (0.7, 6), (0.4, 4)):
                for k in range(many):
                    leaf = leaflet(r * ring, r * 0.55, -0.3, 0, 4, 0.9 if kind else 1.3)
                    d.add(put(leaf, 0.3 + 0.7 * (1 - ring), k * TURN / many + ring, at), tone)
        else:
            d.add(_ribbed(((r * 0.5, 0), (r * 0.6, r), (r * 0.45, r * 2), (0, r * 2.3)), 7, 0.2, at), tone)
    return d
