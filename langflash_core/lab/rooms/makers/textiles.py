"""Makers of what is laid and hung: rugs, curtains, cushions, pictures, books (see `makers.common`).

Metres, y up, front +z.
"""

import numpy as np

from langflash_core.lab.rooms.builtin import KIND_ART, KIND_FABRIC, KIND_RUG
from langflash_core.lab.rooms.makers.kit import (
    DARK,
    LINEN,
    PAGES,
    QUARTER,
    SIDES,
    TURN,
    WHITE,
    Design,
    Draw,
    Look,
    Material,
    across,
    between_all,
    box,
    displaced,
    grid_triangles,
    lathe,
    loft,
    pad,
    pillow_at,
    plain,
    rounded,
    shifted,
    spread,
    torus,
    turned,
    twins,
)

_ART = Material((0.8, 0.8, 0.8), gloss=0.1), KIND_ART
_PATTERN_MIDDLE = 0.32  # m: shaders draw pictures and rugs from 0 to 0.77 m of a model's own axes


def _rolled(d: Design, draw: Draw, radius: float, length: float, look: Look, lining: Look) -> Design:
    """Something soft rolled up along x, its layers to be seen at the ends, with two straps."""
    strap, rolls = draw.cloth(), [(radius * (1 - 0.23 * k), length / 2 + 0.004 * k, 0.0) for k in range(4)]
    rolls += [(radius * 1.03, 0.015, x) for x in (-0.28 * length, 0.28 * length)]
    for k, (r, half, x) in enumerate(rolls):
        layer = turned(lathe(((0, -half), (r, -half), (r, half), (0, half)), segments=14), 2, QUARTER)
        d.add(shifted(layer, (x, radius, 0)), strap if k > 3 else lining if k % 2 else look)
    return d


def mattress(draw: Draw) -> Design:
    """A sprung block with piping, a tufted futon, or an air bed with ridges."""
    style = draw.style(3)
    d = Design(("mattress", "futon", "air mattress")[style], "mattress", ("bed mattress",))
    w, h, deep = draw.one_of((0.8, 0.9, 1.2, 1.4, 1.6)), *between_all(draw, 0.14, 0.3, 1.88, 2.06)
    look, second = draw.one_of((LINEN, WHITE, draw.cloth())), plain(draw.colour(0.6, 0.2))
    h *= (1, 0.6, 0.7)[style]
    d.soft((w, h, deep), (0, h / 2, 0), second if style == 2 else look, (14, 7, 10)[style])
    if style == 2:
        for z in spread(-deep * 0.43, deep * 0.43, 9):
            d.add(rounded((w * 0.95, 0.1, deep * 0.11), (0, h * 0.94, z), 3.0, 6), second)
        return d
    if style == 0:
        d.soft((w * 1.005, h * draw.between(0.3, 0.6), deep * 1.003), (0, h / 2, 0), second, 14)
        x, z = w * 0.48, deep * 0.49
        for y in (0.02, h - 0.02):
            d.tube(((-x, y, z), (x, y, z), (x, y, -z), (-x, y, -z), (-x, y, z)), 0.014, second, 6)
    for x in spread(-w * 0.33, w * 0.33, 3):
        for z in spread(-deep * 0.4, deep * 0.4, 5):
            d.add(rounded((0.05, 0.014, 0.05), (x, h, z), 2.0, 4), second)
    return d


def rug(draw: Draw) -> Design:
    """Oblong, round, a runner or a hide, with patterns, borders, stripes or rings, some fringed."""
    style, bordered, fringed = draw.style(4), draw.chance(0.5), draw.chance(0.4)
    d = Design(("rug", "round rug", "runner", "cowhide rug")[style], "rug", ("carpet",))
    w, deep = between_all(draw, *((1.4, 2.6, 0.5, 0.8) if style == 2 else (1.1, 2.4, 0.8, 1.7)))
    looks = [(Material(draw.colour(0.6, 0.25)), draw.one_of((KIND_FABRIC, 0))) for _ in range(4)]
    if patterned := draw.chance(0.4):
        looks = [(Material(draw.colour(0.7, 0.3)), KIND_RUG)]
    if style == 3:
        a = np.linspace(0, TURN, 49)
        paws = sum(np.exp(-((((a - at + np.pi) % TURN - np.pi) / 0.2) ** 2)) for at in (0.6, 2.5, 3.8, 5.6))
        reach = w * 0.55 * (0.62 + 0.35 * paws + 0.1 * np.cos(2 * a))
        rim = np.stack([reach * np.cos(a), np.full(49, 0.006), reach * np.sin(a) * 0.8], -1)
        hides = (0.9, 0.87, 0.8), (0.4, 0.25, 0.15), (0.1, 0.09, 0.08), (0.6, 0.5, 0.4)
        d.add(grid_triangles(np.stack([rim * np.array([0, 1, 0]), rim])), plain(draw.one_of(hides)))
        for _ in range(draw.count(4, 9)):
            a, b, x, z = between_all(draw, 0.1, 0.4, 0.08, 0.25, -0.28, 0.28, -0.18, 0.18)
            d.add(rounded((a, 0.008, b), (x * w, 0.007, z * w), 2.0, 5), (looks[-1][0], KIND_FABRIC))
    for k, look in enumerate(looks if style < 3 else ()):
        y, r = 0.012 + 0.002 * k, min(w, 2) / 2 * (1 - 0.22 * k)
        if style == 1:
            d.lathe(((0, 0), (r, 0), (r, y), (0, y)), look, 28)
        elif k == 0 or bordered:
            d.box((w - 0.14 * k, y, deep - 0.14 * k), (0, y / 2, 0), look)
    if style in (0, 2):
        for x in () if bordered or patterned else spread(-w * 0.45, w * 0.45, draw.count(3, 9)):
            d.box((w * draw.between(0.02, 0.07), 0.014, deep), (x, 0.007, 0), draw.one_of(looks[1:]))
        for z in spread(-deep * 0.48, deep * 0.48, 22) if fringed else ():
            d.box((w + 0.12, 0.005, 0.01), (0, 0.003, z), LINEN)
    return displaced(d, (_PATTERN_MIDDLE, 0, _PATTERN_MIDDLE))


def _drape(width: float, height: float, folds: int, deep: float, side: int, tie: float) -> np.ndarray:
    """A sheet in folds, hung from `height`; a share `tie` of its width is drawn to one side."""
    across, up = np.meshgrid(np.linspace(-0.5, 0.5, 6 * folds + 1), np.linspace(0, 1, 9 if tie else 3))
    near = np.exp(-(((up - 0.38) / 0.2) ** 2))
    x = (across - side / 2) * (1 - tie * np.where(up < 0.38, 0.7 + 0.3 * near, near)) + side / 2
    z = deep * np.sin(TURN * folds * across) * (1.1 - 0.4 * up)
    return grid_triangles(np.stack([x * width, up * height, z], -1))


def curtain(draw: Draw) -> Design:
    """One or two drapes on a rod, open, closed or tied aside; roller and venetian blinds."""
    style, look, second, metal = draw.style(5), draw.cloth(), draw.cloth(), draw.legs()
    w, h, deep, tie, each = between_all(draw, 0.8, 1.6, 1.6, 2.4, 0.025, 0.05, 0.4, 0.65, 0.25, 0.48)
    d = Design(
        "curtain" if style < 3 else "blind", "curtain", ("drapes",) if style < 3 else ("window blind",)
    )
    if style < 3:
        tie, each = tie * (style == 2), w * (0.9, each, 0.48)[style]
        for side in SIDES if style else (0,):
            sheet = _drape(each, h, draw.count(4, 6) if side else draw.count(6, 10), deep, side, tie)
            d.add(shifted(sheet, (side * (w - each) / 2, 0, 0)), look)
            if tie:
                narrow = each * (1 - tie)
                d.box((narrow + 0.03, 0.05, 0.11), (side * (w - narrow) / 2, h * 0.38, 0), second)
        d.tube(((-w * 0.53, h + 0.03, 0), (w * 0.53, h + 0.03, 0)), 0.015, metal)
        for x in (-w * 0.54, w * 0.54):
            d.add(rounded((0.06, 0.06, 0.06), (x, h + 0.03, 0), 2.0, 5), metal)
        return d
    h *= 0.75
    d.elevation = 2.25 - h
    d.box((w, 0.07, 0.07), (0, h - 0.035, 0), metal if style == 4 else look)
    low, slat, tilt = (
        (h * draw.between(0, 0.4) if style == 3 else 0.0),
        *between_all(draw, 0.035, 0.06, 0.2, 0.9),
    )
    if style == 3:
        d.box((w * 0.97, h - low - 0.03, 0.006), (0, (h + low) / 2, 0.02), look)
    else:
        look = draw.body()
        for y in np.arange(0.05, h - 0.08, slat * 0.85).tolist():
            d.add(turned(box((w * 0.98, 0.004, slat), (0, y, 0)), 0, tilt, (0, y, 0)), look)
        twins(d, (0.012, h - 0.05, 0.005), (w * 0.3, h / 2, slat * 0.45), WHITE)
    d.box((w * 0.98, 0.03, 0.03), (0, low + 0.015, 0.015), look if style == 4 else metal)
    d.tube(((w * 0.46, h - 0.05, 0.04), (w * 0.46, h * draw.between(0.25, 0.6), 0.04)), 0.005, WHITE, 5)
    return d


def blanket(draw: Draw) -> Design:
    """Folded in layers, spread in soft waves with stripes at its ends, or rolled."""
    d, style, look, second = (
        Design("blanket", "blanket", ("throw", "plaid")),
        draw.style(3),
        draw.cloth(),
        draw.cloth(),
    )
    w, deep, thick, a, b, c = between_all(draw, 0.35, 0.6, 0.28, 0.42, 0.025, 0.05, 2, 5, -4, 4, 0, 6)
    if style == 2:
        return _rolled(d, draw, draw.between(0.07, 0.12), w, look, second)
    if style == 0:
        layers = draw.count(2, 5)
        for k in range(layers):
            d.add(rounded((w, thick, deep), (0, thick * (k + 0.5), 0.004 * b * (k % 2)), 6, 8), look)
        d.soft(
            (w * 0.06 * a, thick * layers + 0.005, deep * 1.07), (w * 0.2, thick * layers / 2, 0), second, 8
        )
        return d
    x, z = np.meshgrid(np.linspace(-1, 1, 25), np.linspace(-1, 1, 15))
    y = 0.03 + 0.012 * (np.sin(a * x + b * z + c) + np.sin(2.3 * b * x - 1.7 * a * z))
    y = np.maximum(y * (1 - 0.8 * np.maximum(np.abs(x), np.abs(z)) ** 8), 0.002)
    x, z = x * w * 1.2 * (1 + 0.03 * np.sin(5 * z + c)), z * deep * 1.2 * (1 + 0.04 * np.sin(4 * x))
    sheet, edge = np.stack([x, y, z], -1), 4 if draw.chance(0.6) else 1
    for low, high, part in ((0, edge, second), (edge, 21, look), (21, 24, second)):
        d.add(grid_triangles(sheet[:, low : high + 1]), part)
    return d


def cushion(draw: Draw) -> Design:
    """Square ones with piping or a band, round ones with a button, bolsters, and pillows for the bed."""
    style, look, second = draw.style(5), draw.cloth(), draw.cloth()
    name = ("cushion", "cushion", "cushion", "bolster", "pillow")[style]
    d = Design(name, "cushion", ("pillow", "cushion"))
    w, h, deep, band, long = between_all(draw, 0.36, 0.56, 0.1, 0.19, 0.6, 0.8, 0.2, 0.5, 1.2, 1.6)
    deep = w * (deep if style in (1, 4) else 1)
    if style in (0, 1):
        d.add(pillow_at(w, h, deep), look)
        if draw.chance(0.4):
            d.add(pillow_at(w, h * 1.04, deep) * np.array([band, 1, 0.97]), second)
        elif draw.chance(0.5):
            x, y, z = w * 0.49, h / 2, deep * 0.49
            d.tube(((-x, y, z), (x, y, z), (x, y, -z), (-x, y, -z), (-x, y, z)), 0.008, second, 6)
    elif style == 2:
        d.add(rounded((w, h, w), (0, h / 2, 0), 2 + band, 10), look)
        d.lathe(((w * 0.49, h * 0.42), (w * 0.51, h / 2), (w * 0.49, h * 0.58)), second)
        d.add(rounded((0.06, 0.02, 0.06), (0, h, 0), 2.0, 5), second)
    elif style == 3:
        shape = (
            (0, -0.5),
            (0.6, -0.5),
            (0.95, -0.48),
            (1, -0.44),
            (1, 0.44),
            (0.95, 0.48),
            (0.6, 0.5),
            (0, 0.5),
        )
        roll = turned(lathe([(r * h * 0.6, y * w * long) for r, y in shape]), 2, QUARTER)
        d.add(shifted(roll, (0, h * 0.6, 0)), look)
        d.add(rounded((w * long * 1.03, h * 0.3, h * 0.3), (0, h * 0.6, 0), 4.0, 5), second)
    else:
        d.add(pillow_at(w * long, h, deep * long * 0.8), LINEN if draw.chance(0.7) else look)
    return d


def _art(d: Design, draw: Draw, w: float, h: float, y: float, z: float) -> None:
    """What a picture shows around the height y: hills, fields and discs, somebody, or the shader's own."""
    style, side = draw.style(4), min(w, h)
    d.box((w, h, 0.004), (0, y, z), _ART if style == 0 else plain(draw.colour(0.5, 0.5, 0.95)))
    for k in range(draw.count(3, 6) if style == 2 else 0):
        a, b, u, v = between_all(draw, 0.15, 0.6, 0.1, 0.5, -0.5, 0.5, -0.5, 0.5)
        middle, colour = (
            (w * u * (1 - a), y + h * v * (1 - b), z + 0.003 + 0.002 * k),
            plain(draw.colour(0.9, 0.1)),
        )
        d.box((w * a, h * b, 0.002), middle, colour)
    if style == 1:
        x, sun = np.linspace(-w / 2, w / 2, 9), draw.between(-0.3, 0.3) * w
        d.roll(side * 0.12, 0.002, (sun, y + h * 0.3, z + 0.002), plain(draw.colour(0.8, 0.9)))
        for k in range(3):
            a, c = between_all(draw, 3, 9, 0, 6)
            edge = np.stack(
                [x, y + h * (0.15 - 0.15 * k + 0.1 * np.sin(x / w * a + c)), 0 * x + z + 0.006 + 0.002 * k],
                -1,
            )
            foot = edge * np.array([1, 0, 1]) + np.array([0, y - h / 2, 0])
            d.add(grid_triangles(np.stack([foot, edge])), plain(draw.colour(0.8, 0.2, 0.8)))
    elif style == 3:
        skin = plain(draw.one_of(((0.85, 0.65, 0.52), (0.55, 0.37, 0.27), (0.92, 0.78, 0.68))))
        d.box((side * 0.7, side * 0.24, 0.003), (0, y - h / 2 + side * 0.12, z + 0.003), draw.cloth())
        d.roll(side * 0.2, 0.002, (0, y - h / 2 + side * 0.48, z + 0.003), DARK)
        d.roll(side * 0.16, 0.003, (0, y - h / 2 + side * 0.44, z + 0.004), skin)


def picture(draw: Draw) -> Design:
    """Framed with or without a mat, posters on rails, canvases in parts, standing photo frames."""
    style, look, d = draw.style(4), draw.legs(), Design("picture", "picture", ("painting", "wall art"))
    w, h, bar, mat = between_all(draw, 0.3, 0.95, 0.3, 0.95, 0.015, 0.06, 0.08, 0.2)
    d.name, parts = ("picture", "poster", "canvas", "picture frame")[style], 1
    if style == 3:
        d.tags, w, h, bar = ("photo frame", "photo"), *between_all(draw, 0.12, 0.22, 0.12, 0.23, 0.008, 0.022)
    if style == 1:
        _art(d, draw, w, h, h / 2, 0)
        for y in (0.0, h) if draw.chance(0.5) else ():
            d.tube(((-w * 0.52, y, 0), (w * 0.52, y, 0)), 0.012, look, 6)
    elif style == 2:
        parts = draw.one_of((1, 1, 3))
        for k in range(parts):
            one = Design("part", "picture")
            one.box((w * 0.7, h, 0.03), (0, h / 2, -0.015), LINEN)
            _art(one, draw, w * 0.7, h, h / 2, 0.002)
            d.parts += displaced(one, ((k - parts // 2) * w * 0.75, 0, 0)).parts
    else:
        mat = mat * min(w, h) * draw.chance(0.6)
        d.box((w, h, 0.01), (0, h / 2, -0.008), WHITE if mat else look)
        _art(d, draw, w - 2 * bar - 2 * mat, h - 2 * bar - 2 * mat, h / 2, 0)
        twins(d, (bar, h, 0.03), ((w - bar) / 2, h / 2, 0.005), look)
        for y in (bar / 2, h - bar / 2):
            d.box((w, bar, 0.03), (0, y, 0.005), look)
    if style == 3:
        d.parts = [(turned(triangles, 0, -0.25), part) for triangles, part in d.parts]
        d.add(
            turned(box((w * 0.3, h * 0.75, 0.004), (0, h * 0.36, 0)), 0, 0.35, (0, h * 0.72, -h * 0.2)), DARK
        )
    shown = parts == 1 and any(part is _ART for _, part in d.parts)
    return displaced(d, (_PATTERN_MIDDLE, _PATTERN_MIDDLE - h / 2, 0)) if shown else d


def book(draw: Draw) -> Design:
    """One closed, a pile, a row that stands and leans, or one open."""
    style, w, deep, arch = draw.style(4), *between_all(draw, 0.12, 0.22, 0.18, 0.3, 0.012, 0.03)
    d = Design(("book", "books", "books", "open book")[style], "book", ("books",))
    if style == 3:
        x, z = np.meshgrid(np.linspace(0, 1, 9), np.array([-deep / 2, deep / 2]))
        d.box((2.04 * w, 0.006, deep * 1.04), (0, 0.003, 0), draw.painted())
        for side in SIDES:
            d.add(
                grid_triangles(np.stack([side * x * w, 0.012 + arch * np.sin(np.pi * x**0.6), z], -1)), PAGES
            )
            for k in range(9):
                d.box((w * 0.5, 0.002, 0.006), (side * w * 0.4, 0.011 + arch, deep * (0.09 * k - 0.36)), DARK)
        return d
    x, y = 0.0, 0.0
    for _ in range((1, draw.count(2, 5), draw.count(4, 10))[style]):
        look, one = plain(draw.colour(0.8), 0.15), Design("one", "book")
        thick, k, spin = between_all(draw, 0.015, 0.05, 0.8, 1.1, -0.3, 0.3)
        one.box((w * k * 0.96, thick - 0.004, deep * k * 0.95), (0, thick / 2, 0), PAGES)
        for low in (0.002, thick - 0.002):
            one.box((w * k, 0.004, deep * k), (0, low, 0), look)
        one.box((0.004, thick, deep * k), (-w * k / 2, thick / 2, 0), look)
        one.box(
            (w * k * 0.5, 0.001, deep * k * 0.2),
            (0, thick + 0.0005, -deep * 0.2),
            plain(draw.colour(0.6, 0.5)),
        )
        lean = 0.25 * draw.chance(0.15)
        for triangles, part in one.parts:
            upright = turned(turned(turned(triangles, 0, -QUARTER), 1, QUARTER), 2, lean)
            standing = shifted(upright, (x + thick, deep * k / 2, 0))
            d.add(standing if style == 2 else shifted(turned(triangles, 1, spin), (0, y, 0)), part)
        x, y = x + thick * 1.03 + 0.6 * deep * lean, y + thick
    return d


def sleeping_bag(draw: Draw) -> Design:
    """Rolled up with straps, or spread out with its hood open."""
    d = Design("sleeping bag", "sleeping bag", ("camping bag",))
    look, lining = plain(draw.colour(0.8, 0.3)), plain(draw.colour(0.5, 0.5))
    if draw.chance(0.5):
        radius, long = draw.between(0.11, 0.17), draw.between(0.3, 0.5)
        d.add(loft(((-long / 2, radius, 0), (long / 2, radius, 0)), (radius, radius), 16), look)
        for s in SIDES:
            for r, part in ((0.75, lining), (0.5, look), (0.25, lining)):
                place = (s * (long / 2 + radius * 0.62 - 0.05 * r), radius, 0)
                d.add(across(radius * r, 0.03, place, 0, 12), part)
            d.add(torus(radius, 0.012, (s * long * 0.3, radius, 0), 0, 16), DARK)
        path = (
            (-long * 0.3, 2 * radius, 0),
            (-long * 0.2, 2.3 * radius, 0),
            (long * 0.2, 2.3 * radius, 0),
            (long * 0.3, 2 * radius, 0),
        )
        d.tube(path, 0.01, DARK, 5)
        return d
    wide, long = draw.between(0.65, 0.8), draw.between(1.8, 2.1)
    for k, z in enumerate(spread(-long * 0.3, long * 0.5, 10)):
        narrow = wide * (1 - 0.4 * k / 9)
        pad(d, (narrow, 0.13 - 0.004 * k, long * 0.095), (0, 0.065, z), look, 0.05)
    pad(d, (wide * 0.9, 0.06, long * 0.25), (0, 0.03, -long * 0.42), lining, 0.03)
    pad(d, (wide * 0.8, 0.09, 0.1), (0, 0.13, -long * 0.33), lining, 0.04)
    d.add(torus(wide * 0.36, 0.05, (0, 0.06, -long * 0.45), 1, 16), look)
    d.tube(((wide * 0.49, 0.08, -long * 0.33), (wide * 0.3, 0.08, long * 0.5)), 0.008, DARK, 4)
    return d
