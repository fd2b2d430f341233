"""Makers of what is laid, hung and slept on, and of more tables, shelves, chairs and lamps.

Metres, y up, front +z (see `makers.common`).
"""

from collections.abc import Sequence

import numpy as np

from langflash_core.rooms.builtin import KIND_ART, KIND_FABRIC, KIND_MIRROR, KIND_RUG
from langflash_core.rooms.makers.common import (
    DARK,
    LINEN,
    QUARTER,
    SIDES,
    WHITE,
    Design,
    Draw,
    Face,
    Look,
    carcass,
    four_legs,
    fronts,
    plain,
    polar,
    spread,
)
from langflash_core.rooms.objfile import Material
from langflash_core.rooms.solids import Vector, box, grid_triangles, lathe, rounded, shifted, turned

_TURN = 2 * np.pi
_GLASS = plain((0.8, 0.88, 0.87), 0.9, opacity=0.35)
_MIRROR = Material((0.8, 0.8, 0.8), gloss=0.5), KIND_MIRROR
_ART = Material((0.8, 0.8, 0.8), gloss=0.1), KIND_ART
_PAGES, _BULB, _LEAF = plain((0.93, 0.91, 0.84)), plain((1.0, 0.95, 0.8), 0.3), plain((0.2, 0.42, 0.16))
_WICKER = Material((0.72, 0.58, 0.38)), KIND_FABRIC
_PATTERN_MIDDLE = 0.32  # m: shaders draw pictures and rugs from 0 to 0.77 m of a model's own axes


def _sizes(draw: Draw, *ends: float) -> list[float]:
    """Any numbers, one between each two ends."""
    return [draw.between(low, high) for low, high in zip(ends[::2], ends[1::2], strict=True)]


def _pair(d: Design, path: Sequence[Vector], radius: float, look: Look) -> None:
    """A rod along a path, and its mirror image on the left."""
    for sx in SIDES:
        d.tube([(sx * x, y, z) for x, y, z in path], radius, look, 6)


def _twins(d: Design, size: Vector, centre: Vector, look: Look) -> None:
    for sx in SIDES:
        d.box(size, (sx * centre[0], centre[1], centre[2]), look)


def _moved(d: Design, offset: Vector) -> Design:
    d.parts = [(shifted(triangles, offset), look) for triangles, look in d.parts]
    return d


def _rolled(d: Design, draw: Draw, radius: float, length: float, look: Look, lining: Look) -> Design:
    """Something soft rolled up along x, its layers to be seen at the ends, with two straps."""
    strap, rolls = draw.cloth(), [(radius * (1 - 0.23 * k), length / 2 + 0.004 * k, 0.0) for k in range(4)]
    rolls += [(radius * 1.03, 0.015, x) for x in (-0.28 * length, 0.28 * length)]
    for k, (r, half, x) in enumerate(rolls):
        layer = turned(lathe(((0, -half), (r, -half), (r, half), (0, half)), segments=14), 2, QUARTER)
        d.add(shifted(layer, (x, radius, 0)), strap if k > 3 else lining if k % 2 else look)
    return d


def _pillow(width: float, height: float, depth: float) -> np.ndarray:
    """Two sheets sewn together at their edges and stuffed, lying."""
    x, z = np.meshgrid(np.linspace(-1, 1, 9), np.linspace(-1, 1, 9))
    puff = height / 2 * ((1 - np.abs(x) ** 2.6) * (1 - np.abs(z) ** 2.6)) ** 0.55
    wide, deep = width / 2 * (1 - 0.07 * (1 - z**2) * x**2), depth / 2 * (1 - 0.07 * (1 - x**2) * z**2)
    halves = [np.stack([x * wide, height / 2 + s * puff, z * deep], -1) for s in SIDES]
    return np.concatenate([grid_triangles(half) for half in halves])


def _stock(d: Design, draw: Draw, left: float, right: float, foot: float, room: float, deep: float) -> Design:
    """Books in a row or a pile, a basket, a vase or a plant on a shelf."""
    middle, style, r = (left + right) / 2, draw.style(7), 0.3 * min(deep, right - left, room)
    while style < 3 and left < right - 0.05:
        thick, tall = draw.between(0.02, 0.05), room * draw.between(0.6, 0.92)
        cover = plain(draw.colour(0.7))
        d.box((thick * 0.95, tall, deep * 0.7), (left + thick / 2, foot + tall / 2, 0), cover)
        left += thick * (1 if draw.chance(0.9) else 3)
    for k in range(draw.count(2, 4) if style == 3 else 0):
        d.box((2.4 * r, 0.03, deep * 0.65), (middle, foot + 0.016 + 0.032 * k, 0), plain(draw.colour(0.7)))
    if style == 4:
        size = ((right - left) * 0.8, room * 0.65, deep * 0.85)
        d.box(size, (middle, foot + room * 0.325, 0), _WICKER)
    elif style > 4:
        vase = ((0, 0), (r * 0.6, 0), (r, room * 0.3), (r * 0.4, room * 0.6), (r * 0.55, room * 0.75))
        d.add(lathe(vase[: 5 if style == 5 else 3], (middle, foot, 0), 10), draw.ceramic())
        if style == 6:
            d.add(rounded((2.6 * r, room * 0.5, 2.2 * r), (middle, foot + room * 0.55, 0), 2.0, 5), _LEAF)
    return d


def dressing_table(draw: Draw) -> Design:
    """A table with drawers on legs or blocks, under a round, an oblong or a three-winged mirror."""
    d = Design("dressing table", "dressing table", ("vanity", "makeup table"))
    w, h, deep, tall = _sizes(draw, 0.75, 1.25, 0.7, 0.8, 0.38, 0.5, 0.5, 0.85)
    look, metal, blocks, style = draw.body(), draw.metal(), draw.style(3), draw.style(3)
    d.box((w, 0.03, deep), (0, h - 0.015, 0), look)
    if blocks < 2:
        four_legs(d, draw, w * 0.96, deep * 0.94, h - 0.02, look if draw.chance(0.6) else draw.legs())
    wide, low = (w * 0.32, 0.06) if blocks else (w * 0.94, h - 0.18)
    for x in (w * 0.33, -w * 0.33)[:blocks] or (0.0,):
        d.box((wide, h - low - 0.02, deep * 0.9), (x, (h + low) / 2 - 0.01, 0), look)
        face, many = Face(x - wide / 2, low, wide, h - low - 0.03, deep * 0.45), draw.count(2, 4)
        fronts(d, draw, face, many if blocks else 1, 1 if blocks else many - 1, look, metal, doors=False)
    wide, y, z = w * draw.between(0.45, 0.65), h + 0.04 + tall / 2, 0.03 - deep / 2
    _twins(d, (0.03, tall * 0.6, 0.03), (wide * 0.3, h + tall * 0.3, z), look)
    for k, part in enumerate((look, _MIRROR)):
        if style == 0:
            d.roll(tall / 2 - 0.03 * k, 0.02, (0, y, z + 0.006 * k), part, 24)
        for wing in ((), (0,), (-1, 0, 1))[style]:
            size = (wide * (0.5 if wing else 1) - 0.06 * k, tall * (0.85 if wing else 1) - 0.06 * k, 0.02)
            pane = box(size, (wing * wide * 0.76, y, z + 0.006 * k))
            d.add(turned(pane, 1, -0.5 * wing, (wing * wide * 0.5, 0, z)), part)
    return d


def bunk_bed(draw: Draw) -> Design:
    """Two bunks on four posts, or one over a desk, with slatted or boarded rails and a ladder."""
    loft, slatted, look = (
        draw.chance(0.3),
        draw.chance(0.5),
        draw.metal() if draw.chance(0.3) else draw.body(),
    )
    d = Design("loft bed" if loft else "bunk bed", "bunk bed", ("bed", "kids bed"))
    w, h, deep, post, rail, lean = _sizes(
        draw, 1.9, 2.1, 1.55, 1.9, 0.85, 1.05, 0.04, 0.08, 0.22, 0.36, 0, 0.25
    )
    for sz in SIDES:
        _twins(d, (post, h, post), (w / 2, h / 2, sz * deep / 2), look)
    for low in (h - 0.4,) if loft else (h - 0.4, draw.between(0.25, 0.4)):
        d.box((w, 0.1, deep), (0, low, 0), look)
        d.soft((w * 0.96, 0.15, deep * 0.95), (0, low + 0.12, 0), LINEN, 12)
        d.add(shifted(_pillow(0.4, 0.13, 0.6), (w * 0.36, low + 0.18, 0)), WHITE)
        d.soft((w * draw.between(0.5, 0.7), 0.08, deep), (-w * 0.14, low + 0.18, 0), draw.cloth(), 9)
        _twins(d, (0.025, rail, deep), (w / 2, low + 0.1 + rail / 2, 0), look)
    x, z, top = draw.between(0.25, 0.5) - w / 2, deep / 2 + 0.03, h - 0.4 + rail
    for y in (top, top - 0.13) if slatted else (top - rail * 0.3,):
        for sz, gap in ((-1, 0.0), (1, 0.5)):
            size = (w - gap, 0.06 if slatted else rail * 0.7, 0.025)
            d.box(size, (gap / 2, y, sz * deep / 2), look)
    for side in (x - 0.18, x + 0.18):
        d.tube(((side, 0, z + lean), (side, top, z)), 0.02, look, 6)
    for t in spread(0.15, 0.9, 5):
        y, out = top * t, z + lean * (1 - t)
        d.tube(((x - 0.18, y, out), (x + 0.18, y, out)), 0.016, look, 6)
    if loft:
        d.box((w * 0.6, 0.03, deep * 0.6), (w * 0.18, 0.72, -deep * 0.18), draw.body())
    return d


def mattress(draw: Draw) -> Design:
    """A sprung block with piping, a tufted futon, or an air bed with ridges."""
    style = draw.style(3)
    d = Design(("mattress", "futon", "air mattress")[style], "mattress", ("bed mattress",))
    w, h, deep = draw.one_of((0.8, 0.9, 1.2, 1.4, 1.6)), *_sizes(draw, 0.14, 0.3, 1.88, 2.06)
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
    w, deep = _sizes(draw, *((1.4, 2.6, 0.5, 0.8) if style == 2 else (1.1, 2.4, 0.8, 1.7)))
    looks = [(Material(draw.colour(0.6, 0.25)), draw.one_of((KIND_FABRIC, 0))) for _ in range(4)]
    if patterned := draw.chance(0.4):
        looks = [(Material(draw.colour(0.7, 0.3)), KIND_RUG)]
    if style == 3:
        a = np.linspace(0, _TURN, 49)
        paws = sum(np.exp(-((((a - at + np.pi) % _TURN - np.pi) / 0.2) ** 2)) for at in (0.6, 2.5, 3.8, 5.6))
        reach = w * 0.55 * (0.62 + 0.35 * paws + 0.1 * np.cos(2 * a))
        rim = np.stack([reach * np.cos(a), np.full(49, 0.006), reach * np.sin(a) * 0.8], -1)
        hides = (0.9, 0.87, 0.8), (0.4, 0.25, 0.15), (0.1, 0.09, 0.08), (0.6, 0.5, 0.4)
        d.add(grid_triangles(np.stack([rim * np.array([0, 1, 0]), rim])), plain(draw.one_of(hides)))
        for _ in range(draw.count(4, 9)):
            a, b, x, z = _sizes(draw, 0.1, 0.4, 0.08, 0.25, -0.28, 0.28, -0.18, 0.18)
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
    return _moved(d, (_PATTERN_MIDDLE, 0, _PATTERN_MIDDLE))


def _drape(width: float, height: float, folds: int, deep: float, side: int, tie: float) -> np.ndarray:
    """A sheet in folds, hung from `height`; a share `tie` of its width is drawn to one side."""
    across, up = np.meshgrid(np.linspace(-0.5, 0.5, 6 * folds + 1), np.linspace(0, 1, 9 if tie else 3))
    near = np.exp(-(((up - 0.38) / 0.2) ** 2))
    x = (across - side / 2) * (1 - tie * np.where(up < 0.38, 0.7 + 0.3 * near, near)) + side / 2
    z = deep * np.sin(_TURN * folds * across) * (1.1 - 0.4 * up)
    return grid_triangles(np.stack([x * width, up * height, z], -1))


def curtain(draw: Draw) -> Design:
    """One or two drapes on a rod, open, closed or tied aside; roller and venetian blinds."""
    style, look, second, metal = draw.style(5), draw.cloth(), draw.cloth(), draw.legs()
    w, h, deep, tie, each = _sizes(draw, 0.8, 1.6, 1.6, 2.4, 0.025, 0.05, 0.4, 0.65, 0.25, 0.48)
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
    low, slat, tilt = (h * draw.between(0, 0.4) if style == 3 else 0.0), *_sizes(draw, 0.035, 0.06, 0.2, 0.9)
    if style == 3:
        d.box((w * 0.97, h - low - 0.03, 0.006), (0, (h + low) / 2, 0.02), look)
    else:
        look = draw.body()
        for y in np.arange(0.05, h - 0.08, slat * 0.85).tolist():
            d.add(turned(box((w * 0.98, 0.004, slat), (0, y, 0)), 0, tilt, (0, y, 0)), look)
        _twins(d, (0.012, h - 0.05, 0.005), (w * 0.3, h / 2, slat * 0.45), WHITE)
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
    w, deep, thick, a, b, c = _sizes(draw, 0.35, 0.6, 0.28, 0.42, 0.025, 0.05, 2, 5, -4, 4, 0, 6)
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
    w, h, deep, band, long = _sizes(draw, 0.36, 0.56, 0.1, 0.19, 0.6, 0.8, 0.2, 0.5, 1.2, 1.6)
    deep = w * (deep if style in (1, 4) else 1)
    if style in (0, 1):
        d.add(_pillow(w, h, deep), look)
        if draw.chance(0.4):
            d.add(_pillow(w, h * 1.04, deep) * np.array([band, 1, 0.97]), second)
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
        d.add(_pillow(w * long, h, deep * long * 0.8), LINEN if draw.chance(0.7) else look)
    return d


def _art(d: Design, draw: Draw, w: float, h: float, y: float, z: float) -> None:
    """What a picture shows around the height y: hills, fields and discs, somebody, or the shader's own."""
    style, side = draw.style(4), min(w, h)
    d.box((w, h, 0.004), (0, y, z), _ART if style == 0 else plain(draw.colour(0.5, 0.5, 0.95)))
    for k in range(draw.count(3, 6) if style == 2 else 0):
        a, b, u, v = _sizes(draw, 0.15, 0.6, 0.1, 0.5, -0.5, 0.5, -0.5, 0.5)
        middle, colour = (
            (w * u * (1 - a), y + h * v * (1 - b), z + 0.003 + 0.002 * k),
            plain(draw.colour(0.9, 0.1)),
        )
        d.box((w * a, h * b, 0.002), middle, colour)
    if style == 1:
        x, sun = np.linspace(-w / 2, w / 2, 9), draw.between(-0.3, 0.3) * w
        d.roll(side * 0.12, 0.002, (sun, y + h * 0.3, z + 0.002), plain(draw.colour(0.8, 0.9)))
        for k in range(3):
            a, c = _sizes(draw, 3, 9, 0, 6)
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
    w, h, bar, mat = _sizes(draw, 0.3, 0.95, 0.3, 0.95, 0.015, 0.06, 0.08, 0.2)
    d.name, parts = ("picture", "poster", "canvas", "picture frame")[style], 1
    if style == 3:
        d.tags, w, h, bar = ("photo frame", "photo"), *_sizes(draw, 0.12, 0.22, 0.12, 0.23, 0.008, 0.022)
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
            d.parts += _moved(one, ((k - parts // 2) * w * 0.75, 0, 0)).parts
    else:
        mat = mat * min(w, h) * draw.chance(0.6)
        d.box((w, h, 0.01), (0, h / 2, -0.008), WHITE if mat else look)
        _art(d, draw, w - 2 * bar - 2 * mat, h - 2 * bar - 2 * mat, h / 2, 0)
        _twins(d, (bar, h, 0.03), ((w - bar) / 2, h / 2, 0.005), look)
        for y in (bar / 2, h - bar / 2):
            d.box((w, bar, 0.03), (0, y, 0.005), look)
    if style == 3:
        d.parts = [(turned(triangles, 0, -0.25), part) for triangles, part in d.parts]
        d.add(
            turned(box((w * 0.3, h * 0.75, 0.004), (0, h * 0.36, 0)), 0, 0.35, (0, h * 0.72, -h * 0.2)), DARK
        )
    shown = parts == 1 and any(part is _ART for _, part in d.parts)
    return _moved(d, (_PATTERN_MIDDLE, _PATTERN_MIDDLE - h / 2, 0)) if shown else d


def book(draw: Draw) -> Design:
    """One closed, a pile, a row that stands and leans, or one open."""
    style, w, deep, arch = draw.style(4), *_sizes(draw, 0.12, 0.22, 0.18, 0.3, 0.012, 0.03)
    d = Design(("book", "books", "books", "open book")[style], "book", ("books",))
    if style == 3:
        x, z = np.meshgrid(np.linspace(0, 1, 9), np.array([-deep / 2, deep / 2]))
        d.box((2.04 * w, 0.006, deep * 1.04), (0, 0.003, 0), draw.painted())
        for side in SIDES:
            d.add(
                grid_triangles(np.stack([side * x * w, 0.012 + arch * np.sin(np.pi * x**0.6), z], -1)), _PAGES
            )
            for k in range(9):
                d.box((w * 0.5, 0.002, 0.006), (side * w * 0.4, 0.011 + arch, deep * (0.09 * k - 0.36)), DARK)
        return d
    x, y = 0.0, 0.0
    for _ in range((1, draw.count(2, 5), draw.count(4, 10))[style]):
        look, one = plain(draw.colour(0.8), 0.15), Design("one", "book")
        thick, k, spin = _sizes(draw, 0.015, 0.05, 0.8, 1.1, -0.3, 0.3)
        one.box((w * k * 0.96, thick - 0.004, deep * k * 0.95), (0, thick / 2, 0), _PAGES)
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


def chair_more(draw: Draw) -> Design:
    """Folding, shell, rocking, ladder-back, bar and bentwood chairs."""
    styles = (_folding_chair, _shell_chair, _country_chair, _country_chair, _bar_chair, _bentwood_chair)
    return draw.one_of(styles)(draw)


def _folding_chair(draw: Draw) -> Design:
    d, look, plate = Design("folding chair", "chair", ("chair",)), draw.legs(), draw.body()
    x, seat, top, r = _sizes(draw, 0.2, 0.25, 0.43, 0.47, 0.76, 0.88, 0.011, 0.018)
    _pair(d, ((x, 0, 0.25), (x, top, -0.25)), r, look)
    _pair(d, ((x - 0.04, 0, -0.25), (x - 0.04, seat, 0.17)), r, look)
    d.tube(((-x, 0.12, 0.17), (x, 0.12, 0.17)), r * 0.8, look, 6)
    for z in spread(-0.15, 0.15, 4) if draw.chance(0.5) else (0.0,):
        d.box((2 * x - 0.04, 0.018, 0.08 if z else 0.38), (0, seat, z), plate)
    for y in (top - 0.06, top - 0.16)[: draw.count(1, 2)]:
        d.box((2 * x, 0.08, 0.014), (0, y, 0.25 - 0.5 * y / top), plate)
    return d


def _shell_chair(draw: Draw) -> Design:
    d, look, metal = Design("shell chair", "chair", ("chair", "plastic chair")), draw.painted(), draw.legs()
    w, seat, tall, top, curl = _sizes(draw, 0.42, 0.6, 0.42, 0.46, 0.32, 0.42, 0.25, 0.42, 0.04, 0.2)
    x, at = np.meshgrid(np.linspace(-1, 1, 9), np.linspace(0, 1, 9))
    z = np.interp(at[:, 0], np.linspace(0, 1, 7), (0.24, 0.22, 0.1, -0.1, -0.2, -0.26, -0.3))[:, None]
    y = np.interp(at[:, 0], np.linspace(0, 1, 7), (-0.04, 0, -0.02, -0.03, 0.03, tall / 2, tall))[:, None]
    wide, back = np.interp(at, (0, 0.4, 0.7, 1), (0.42, 0.5, 0.5, top)), np.clip((at - 0.4) * 3, 0, 1)
    lift = curl * (1 - at) * x**4
    d.add(grid_triangles(np.stack([x * wide * w, seat + y + lift, z + 0.6 * curl * back * x**2], -1)), look)
    if draw.chance(0.25):
        d.lathe(((0, 0), (0.22, 0), (0.2, 0.015), (0.03, 0.05), (0.025, seat - 0.03)), metal)
        return d
    wire = draw.chance(0.5)
    for z in (-0.22, 0.22):
        _pair(d, ((w * 0.45, 0, z), (w * 0.22, seat - 0.03, z * 0.5)), 0.008 if wire else 0.016, metal)
        if wire:
            _pair(
                d, ((w * 0.45, 0.01, z), (0, seat * 0.6, 0), (w * 0.22, seat - 0.04, -z * 0.5)), 0.005, metal
            )
    return d


def _country_chair(draw: Draw) -> Design:
    """Turned posts with slats or spindles between; on rockers and with arms, or not."""
    rocking, spindles, look = draw.chance(0.5), draw.chance(0.4), draw.body()
    d = Design("rocking chair" if rocking else "ladder-back chair", "chair", ("chair", "wooden chair"))
    x, z, seat, top, r = _sizes(draw, 0.2, 0.26, 0.19, 0.23, 0.42, 0.46, 0.92, 1.15, 0.014, 0.022)
    _pair(d, ((x, 0.06 * rocking, -z), (x, seat, -z), (x * 0.95, top, -z - 0.12)), r, look)
    _pair(d, ((x, 0.06 * rocking, z), (x, seat + 0.22 * rocking, z)), r, look)
    d.soft((2 * x + 0.06, 0.05, 2 * z + 0.06), (0, seat, 0), _WICKER if draw.chance(0.6) else look, 7)
    for y in (seat * 0.35, seat * 0.6):
        _pair(d, ((x, y, -z), (x, y, z)), r * 0.6, look)
        d.tube(((-x, y + 0.04, z), (x, y + 0.04, z)), r * 0.6, look, 6)
    for y in (top - 0.05,) if spindles else spread(seat + 0.15, top - 0.05, draw.count(3, 5)):
        d.box((2 * x * 0.96, 0.06, 0.014), (0, y, -z - 0.12 * (y - seat) / (top - seat)), look)
    for u in spread(-x * 0.75, x * 0.75, 6) if spindles else ():
        d.tube(((u, seat, -z), (u, top - 0.05, -z - 0.11)), 0.007, look, 5)
    if rocking:
        _pair(d, [(x, 0.03 + 0.25 * t * t, t) for t in spread(-0.48, 0.4, 7)], 0.022, look)
        _twins(d, (0.06, 0.025, 2 * z + 0.08), (x, seat + 0.22, 0), look)
    return d


def _bar_chair(draw: Draw) -> Design:
    d, look, plate = Design("bar chair", "chair", ("bar stool", "high chair")), draw.legs(), draw.upholstery()
    seat, x, tall, soft = _sizes(draw, 0.62, 0.78, 0.17, 0.22, 0.2, 0.4, 3, 8)
    for z in (-x, x):
        _pair(d, ((x * 1.2, 0, 1.2 * z), (x * 0.8, seat, 0.8 * z)), 0.014, look)
        d.tube(((-x * 1.1, 0.24, z * 1.1), (x * 1.1, 0.24, z * 1.1)), 0.011, look, 6)
    d.soft((2 * x + 0.04, 0.07, 2 * x + 0.04), (0, seat, 0), plate, soft)
    back = rounded((2 * x + 0.02, tall * 0.65, 0.05), (0, seat + tall * 0.7, -x), 5.0, 8)
    d.add(turned(back, 0, -0.15, (0, seat, -x)), plate)
    _pair(d, ((x * 0.6, seat, -x), (x * 0.6, seat + tall, -x - tall * 0.15 - 0.02)), 0.011, look)
    return d


def _bentwood_chair(draw: Draw) -> Design:
    d, look = Design("bentwood chair", "chair", ("chair", "bistro chair")), draw.body()
    r, seat, tall, inner = _sizes(draw, 0.2, 0.23, 0.44, 0.47, 0.38, 0.46, 0.5, 0.7)
    d.lathe(((0, seat - 0.03), (r, seat - 0.03), (r * 1.03, seat - 0.01), (r, seat + 0.01)), look)
    d.lathe(((r, seat + 0.01), (0, seat + 0.005)), _WICKER if draw.chance(0.6) else look)
    d.lathe([(r * 0.85 + 0.008 * np.cos(a), 0.2 + 0.008 * np.sin(a)) for a in spread(0, _TURN, 5)], look, 16)
    for z in (-r, r):
        _pair(d, ((r * 0.85, 0, z * 0.95), (r * 0.65, seat, z * 0.65)), 0.014, look)
    a = np.linspace(0, np.pi, 11)
    for k in (1.0, inner):
        arch = 0.9 * k * r * np.cos(a), seat + k * tall * np.sin(a) ** 0.6, -r * 0.75 - 0.09 * k * np.sin(a)
        d.tube(np.stack(arch, -1).tolist(), 0.012, look, 6)
    return d


def table_more(draw: Draw) -> Design:
    """Pedestal, trestle, glass, tulip, console and side tables."""
    style, look, metal = draw.style(6), draw.body(), draw.legs()
    names = ("round table", "side table", "tulip table", "console table", "trestle table", "glass table")
    d = Design(names[style], "table", ("table",))
    w, deep, h, r = _sizes(draw, 1.2, 1.9, 0.7, 0.95, 0.71, 0.77, 0.4, 0.65)
    if style < 3:
        r, h = _sizes(draw, 0.2, 0.28, 0.45, 0.62) if style == 1 else (r, h)
        d.lathe(((0, h - 0.025), (r * 0.97, h - 0.025), (r, h - 0.01), (r, h), (0, h)), look, 28)
        tulip = (
            (r * 0.55, 0),
            (r * 0.5, 0.02),
            (r * 0.1, 0.2),
            (0.04, 0.4),
            (r * 0.1, 0.65),
            (r * 0.3, h - 0.02),
        )
        stem = [(draw.between(0.03, 0.075), h * (0.15 + 0.16 * k)) for k in range(6)]
        d.lathe((stem, ((0.015, 0.1), (0.015, h)), tulip)[style], draw.painted() if style == 2 else metal, 14)
        for a in spread(0.5, 0.5 + _TURN, draw.count(4, 5))[1:] if style < 2 else ():
            d.tube(
                (polar(0.02, a, h * 0.25), polar(r * 0.45, a, h * 0.18), polar(r * 0.75, a, 0.02)),
                0.02,
                metal,
                6,
            )
        return d
    if style == 3:
        w, deep, h = _sizes(draw, 0.8, 1.4, 0.28, 0.4, 0.74, 0.9)
        if draw.chance(0.6):
            d.box((w * 0.92, 0.12, deep * 0.85), (0, h - 0.08, 0), look)
            face = Face(-w * 0.46, h - 0.14, w * 0.92, 0.12, deep * 0.43)
            fronts(d, draw, face, 1, draw.count(2, 3), look, draw.metal(), doors=False)
        if draw.chance(0.6):
            d.box((w * 0.95, 0.02, deep * 0.9), (0, h * 0.2, 0), look)
    crossed = style == 5 and draw.chance(0.5)
    if style == 3 or (style == 5 and not crossed):
        four_legs(d, draw, w * 0.95, deep * 0.92, h - 0.01, metal)
    for z in (-deep * 0.4, deep * 0.4) if style == 4 or crossed else ():
        for x, top in ((w * 0.44, w * 0.34), (w * 0.24, w * 0.34)) if style == 4 else ((w * 0.4, -w * 0.3),):
            _pair(d, ((x, 0, z), (top, h - 0.03, z * 0.8)), 0.02, metal)
    if style == 4:
        _twins(d, (0.05, 0.05, deep * 0.75), (w * 0.34, h - 0.05, 0), metal)
        _twins(d, (w * 0.12, 0.02, deep * 0.75), (w * 0.34, h * 0.3, 0), metal)
    d.box((w, 0.015 if style == 5 else 0.03, deep), (0, h, 0), _GLASS if style == 5 else look)
    return d


def lamp_more(draw: Draw) -> Design:
    """Desk lamps with arms, tripods, arcs, paper globes, wall lamps, chandeliers and lanterns."""
    makers = (_desk_lamp, _tripod_or_arc, _tripod_or_arc, _paper_lamp, _wall_lamp, _chandelier, _lantern)
    d = draw.one_of(makers)(draw, draw.metal() if draw.chance(0.6) else draw.painted())
    d.light, d.tags = True, ("lamp", "light")
    return d


def _shade_look(draw: Draw) -> Look:
    return plain((0.95, 0.92, 0.84) if draw.chance(0.6) else draw.colour(0.6, 0.4))


def _desk_lamp(draw: Draw, metal: Look) -> Design:
    d, (a, b, y, r) = Design("desk lamp", "lamp"), _sizes(draw, 0.12, 0.2, 0.18, 0.3, 0.28, 0.4, 0.07, 0.1)
    d.cylinder(r, 0.03, (0, 0, 0), metal)
    for z in (-0.012, 0.012):
        d.tube(((0, 0.02, z), (-a, y, z), (b, y + b * 0.7, z)), 0.006, metal, 6)
    d.add(rounded((0.04, 0.04, 0.05), (-a, y, 0), 2.0, 5), DARK)
    head = lathe(((0.085, -0.12), (0.07, -0.04), (0.03, 0), (0.03, 0.04), (0, 0.04)), segments=14)
    for part, look in ((head, metal), (rounded((0.08, 0.08, 0.08), (0, -0.07, 0), 2.0, 5), _BULB)):
        d.add(shifted(turned(part, 2, 0.5), (b, y + b * 0.7, 0)), look)
    return d


def _tripod_or_arc(draw: Draw, metal: Look) -> Design:
    d, (r, h, out, narrow) = (
        Design("tripod floor lamp", "lamp"),
        _sizes(draw, 0.13, 0.24, 1.1, 1.35, 0.7, 1.2, 0.6, 1),
    )
    if draw.chance(0.5):
        for a in spread(0.5, 0.5 + _TURN, 4)[1:]:
            d.tube((polar(out * 0.27, a, 0), polar(0.03, a, h)), 0.018, metal, 6)
        d.cylinder(0.05, 0.06, (0, h - 0.05, 0), metal)
        d.lathe(((r, h), (r * narrow, h + 0.32)), _shade_look(draw))
        return d
    d.name = "arc floor lamp"
    d.box((0.3, 0.06, 0.3), (0, 0.03, 0), draw.one_of((WHITE, DARK, metal)))
    arc = [(out * (1 - np.cos(t)) / 1.3, 0.5 + 1.35 * np.sin(t), 0.0) for t in spread(0, 2.1, 10)]
    d.tube([(0, 0.05, 0), *arc], 0.013, metal, 6)
    d.add(lathe(((r, -0.2), (r * 0.9, -0.1), (r * 0.5, -0.02), (0, 0)), arc[-1]), metal)
    d.add(shifted(rounded((r, r, r), (0, -0.14, 0), 2.0, 5), arc[-1]), _BULB)
    return d


def _paper_lamp(draw: Draw, metal: Look) -> Design:
    """A ribbed ball that hangs, or stands on three legs, tall or short."""
    foot, t, r, flat = (
        draw.one_of((0.0, 0.05, 0.9)),
        np.linspace(0.15, np.pi - 0.15, 25),
        *_sizes(draw, 0.16, 0.32, 0.75, 1),
    )
    d = Design("paper lamp" if foot else "paper pendant lamp", "lamp")
    ribs = r * np.sin(t) * (1 + 0.02 * np.cos(np.arange(25) * np.pi))
    d.lathe(np.stack([ribs, foot + r * (1 - flat * np.cos(t))], -1).tolist(), _shade_look(draw), 18)
    if not foot:
        d.tube(((0, 1.7 * r, 0), (0, 2 * r + draw.between(0.1, 0.4), 0)), 0.005, DARK, 5)
    for a in spread(0, _TURN, 4)[1:] if foot else ():
        d.tube((polar(r * 0.8, a, 0), polar(r * 0.25, a, foot + 0.1 * r)), 0.01, metal, 6)
    return d


def _wall_lamp(draw: Draw, metal: Look) -> Design:
    d, style = Design("wall lamp", "lamp", elevation=1.7), draw.style(3)
    out, plate, look = draw.between(0.1, 0.22), draw.between(0.1, 0.25), _shade_look(draw)
    d.box((0.09, plate, 0.02), (0, 0.12, -out), metal)
    for x in (-0.1, 0.1) if draw.chance(0.3) else (0.0,):
        d.tube(((0, 0.1, -out), (x / 2, 0.06, -out / 2), (x, 0.1, 0)), 0.01, metal, 6)
        if style == 0:
            d.add(rounded((0.15, 0.15, 0.15), (x, 0.17, 0), 2.0, 8), _BULB)
        else:
            d.add(
                lathe(((0.09, 0.1), (0.05 + 0.04 * style, 0.27)), (x, 0, 0), 16),
                look if style == 1 else metal,
            )
            d.cylinder(0.03, 0.13, (x, 0.1, 0), _BULB)
    return d


def _chandelier(draw: Draw, metal: Look) -> Design:
    d, (reach, drop), shaded = (
        Design("chandelier", "lamp"),
        _sizes(draw, 0.25, 0.45, 0.5, 0.8),
        draw.chance(0.4),
    )
    stem = (
        (0, 0),
        (0.03, 0.02),
        (0.05, 0.06),
        (0.02, 0.12),
        (0.04, 0.2),
        (0.01, 0.26),
        (0.008, drop),
        (0.06, drop),
    )
    d.lathe((*stem, (0, drop + 0.03)), metal, 12)
    look = _shade_look(draw)
    for a in spread(0, _TURN, draw.count(6, 9))[1:]:
        arm = (
            polar(0.03, a, 0.16),
            polar(reach * 0.5, a, 0.05),
            polar(reach * 0.85, a, 0.07),
            polar(reach, a, 0.16),
        )
        d.tube(arm, 0.009, metal, 5)
        d.add(
            lathe(((0, 0), (0.035, 0.012), (0.013, 0.013), (0.013, 0.09)), arm[-1], 8),
            metal if shaded else WHITE,
        )
        d.add(rounded((0.03, 0.06, 0.03), polar(reach, a, 0.27), 2.0, 4), _BULB)
        if shaded:
            d.add(lathe(((0.07, 0), (0.035, 0.1)), polar(reach, a, 0.22), 10), look)
    return d


def _lantern(draw: Draw, metal: Look) -> Design:
    d, (w, tall) = Design("lantern", "lamp"), _sizes(draw, 0.1, 0.2, 0.18, 0.4)
    for y in (0.01, tall):
        d.box((w + 0.03, 0.02, w + 0.03), (0, y, 0), metal)
    for z in (-w / 2, w / 2):
        _twins(d, (0.014, tall, 0.014), (w / 2, tall / 2, z), metal)
        d.box((w, tall - 0.03, 0.003), (0, tall / 2, z), _GLASS)
    d.cylinder(w * 0.25, tall * 0.4, (0, 0.02, 0), LINEN)
    d.add(rounded((0.02, 0.045, 0.02), (0, 0.05 + tall * 0.4, 0), 2.0, 4), _BULB)
    top = tall + w * 0.5
    d.add(turned(lathe(((w * 0.75, tall), (0.02, top), (0, top)), segments=4), 1, np.pi / 4), metal)
    d.tube([(0.05 * np.cos(a), top + 0.06 * np.sin(a), 0) for a in spread(0, np.pi, 7)], 0.005, metal, 5)
    return d


def bookcase_more(draw: Draw) -> Design:
    """Leaning ladders, cubes, boards on the wall and corner shelves, filled or nearly empty."""
    style, look, frame, fill = draw.style(4), draw.body(), draw.legs(), draw.between(0.2, 1)
    name = ("ladder shelf", "corner shelf", "cube shelf", "wall shelf")[style]
    d = Design(name, "bookcase", ("shelf", "bookcase"), elevation=draw.between(1.1, 1.4) * (style == 3))
    w, h, deep, side, b = _sizes(draw, 0.5, 0.9, 1.6, 2.0, 0.35, 0.5, 0.32, 0.38, 0.2, 0.36)
    rows, columns, closed = draw.count(4, 5), draw.count(2, 4), draw.chance(0.5)
    places: list[tuple[float, float, float, float, float, float]] = []  # left, right, foot, room, depth, z
    if style == 0:
        for z in (deep / 2, -deep / 2)[: 1 + closed]:
            _pair(d, ((w / 2, 0, z), (w / 2, h, -deep / 2)), 0.018, frame)
        for y in spread(h * 0.12, h * 0.92, rows):
            b = max(deep * (1 - y / h), 0.12)
            d.box((w, 0.022, b), (0, y, b / 2 - deep / 2), look)
            places.append((-w * 0.42, w * 0.42, y + 0.012, h * 0.8 / rows - 0.03, b, b / 2 - deep / 2))
    elif style == 1:
        edge = np.array([polar(deep * 0.9, a, 0) for a in spread(0, QUARTER, 9 if closed else 2)]) - deep / 2
        rim = np.stack([edge * 0 - deep / 2, edge, edge, edge * 0 - deep / 2])
        for y in spread(0.06, h - 0.04, rows):
            rim[..., 1] = y + np.array([[0], [0], [0.025], [0.025]])
            d.add(grid_triangles(rim), look)
            places.append((-deep * 0.42, deep * 0.05, y + 0.026, h / rows - 0.08, deep * 0.45, -deep * 0.2))
        for x, z in ((-0.48, -0.48), (0.38, -0.48), (-0.48, 0.38)):
            d.box((0.025, h, 0.025), (x * deep, h / 2, z * deep), look)
    elif style == 2:
        rows = draw.count(2, 4)
        for x in spread(-side * columns / 2, side * columns / 2, columns + 1):
            d.box((0.03, side * rows + 0.03, b), (x, side * rows / 2 + 0.015, 0), look)
            places += [(x + 0.03, x + side - 0.03, k * side + 0.03, side - 0.04, b, 0) for k in range(rows)]
        places = places[: rows * columns]
        for k in range(rows + 1):
            d.box((side * columns, 0.03, b), (0, 0.015 + k * side, 0), look)
    else:
        for y in spread(0.1, 0.1 + side, 2)[: draw.count(1, 2)]:
            d.box((w * 1.2, 0.03, b * 0.7), (0, y, 0), look)
            places += [(x, x + w * 0.5, y + 0.015, 0.25, b * 0.7, 0) for x in (-w * 0.58, w * 0.05)]
            _pair(d, ((w * 0.45, y - 0.09, -b * 0.34), (w * 0.45, y - 0.02, b * 0.3)), 0.008, frame)
            _twins(d, (0.02, 0.09, 0.012), (w * 0.45, y - 0.05, -b * 0.34), frame)
    for left, right, foot, room, b, z in places:
        if draw.chance(fill):
            shelf = _stock(Design("shelf", "bookcase"), draw, left, right, foot, room, b)
            d.parts += _moved(shelf, (0, 0, z)).parts
    return d


def cabinet_more(draw: Draw) -> Design:
    """Ribbed sideboards, glass cabinets, buffets with an upper part, filing and shoe cabinets."""
    makers = (
        _sideboard_or_buffet,
        _sideboard_or_buffet,
        _display_cabinet,
        _tilting_or_filing,
        _tilting_or_filing,
    )
    return draw.one_of(makers)(draw, draw.body(), draw.metal())


def _tilting_or_filing(draw: Draw, look: Look, metal: Look) -> Design:
    """Rows of wide fronts: drawers with labels in a steel box, or shallow flaps for shoes."""
    filing, rows = draw.chance(0.5), draw.count(2, 4)
    d = Design("filing cabinet" if filing else "shoe cabinet", "cabinet", ("cabinet", "storage cabinet"))
    w, deep, each, lift = _sizes(draw, 0.5, 0.9, 0.17, 0.26, 0.28, 0.36, 0.1, 0.3)
    if filing:
        w, deep, look = w * 0.55, deep * 2, plain(draw.colour(0.3, 0.2, 0.9), 0.4)
    h, z = rows * each + 0.06, deep / 2 + 0.01
    d.box((w, h, deep), (0, h / 2, 0), look)
    for k in range(rows):
        y = 0.04 + (k + 0.5) * each
        d.box((w - 0.03, each - 0.015, 0.018), (0, y, z), look)
        d.box((w * lift, 0.015, 0.025), (0, y + each * 0.15, z + 0.02), metal)
        if filing:
            d.box((w * 0.22, 0.04, 0.004), (0, y + each * 0.3, z + 0.01), WHITE)
    return d


def _display_cabinet(draw: Draw, look: Look, metal: Look) -> Design:
    d = Design("display cabinet", "cabinet", ("glass cabinet", "vitrine"))
    w, h, deep = _sizes(draw, 0.6, 1.1, 1.3, 1.95, 0.32, 0.45)
    d.box((w, 0.12, deep), (0, 0.06, 0), look)
    d.box((w, 0.03, deep), (0, h, 0), look)
    d.box((w, h, 0.02), (0, h / 2, -deep / 2), look)
    _twins(d, (0.03, h, deep), (w / 2, h / 2, 0), look)
    for y in spread(0.12, h, draw.count(4, 6))[:-1]:
        d.box((w, 0.015, deep * 0.95), (0, y, 0), _GLASS)
        for x in spread(-w * 0.35, w * 0.35, 4):
            r, tall = _sizes(draw, 0.02, 0.05, 0.05, 0.16)
            d.add(lathe(((0, 0), (r * 0.6, 0), (r, tall)), (x, y + 0.01, 0), 8), draw.ceramic())
    d.box((w, h - 0.14, 0.006), (0, h / 2 + 0.06, deep / 2), _GLASS)
    for x in (0.017, w / 2 - 0.015):
        _twins(d, (0.03, h - 0.14, 0.02), (x, h / 2 + 0.06, deep / 2 + 0.005), look)
    _twins(d, (0.012, 0.12, 0.02), (0.02, h * 0.5, deep / 2 + 0.02), metal)
    return d


def _sideboard_or_buffet(draw: Draw, look: Look, metal: Look) -> Design:
    """Doors under a board; above it nothing, or shelves with things and a door."""
    buffet, front = draw.chance(0.5), look if draw.chance(0.5) else draw.body()
    d = Design("buffet" if buffet else "sideboard", "cabinet", ("cabinet", "hutch" if buffet else "credenza"))
    w, h, deep, tall = _sizes(draw, 1.2, 1.9, 0.6, 0.85, 0.36, 0.46, 0.75, 1.05)
    w, h = (w * 0.75, h + 0.15) if buffet else (w, h)
    foot = carcass(d, draw, w, h, deep, look)
    face = Face(0.02 - w / 2, foot + 0.02, w - 0.04, h - foot - 0.04, deep / 2)
    fronts(d, draw, face, 1, draw.count(2, 4), front, metal, doors=True)
    if not buffet:
        for x in spread(-w * 0.46, w * 0.46, draw.count(24, 44)) if draw.chance(0.6) else ():
            d.box((0.012, h - foot - 0.08, 0.014), (x, (h + foot) / 2, deep / 2 + 0.026), front)
        return d
    d.box((w + 0.03, 0.03, deep + 0.03), (0, h, 0), look)
    d.box((w, tall, 0.02), (0, h + tall / 2, 0.01 - deep / 2), look)
    _twins(d, (0.025, tall, deep * 0.6), (w / 2 - 0.012, h + tall / 2, -deep * 0.2), look)
    for y in (h + tall * 0.36, h + tall * 0.68, h + tall):
        d.box((w, 0.025, deep * 0.62), (0, y, -deep * 0.2), look)
        _stock(d, draw, -w * 0.4, -w * 0.05, y - tall * 0.3, tall * 0.26, deep * 0.4)
    if draw.chance(0.6):
        upper = Face(0.0, h + tall * 0.37, w / 2, tall * 0.6, deep * 0.11)
        fronts(d, draw, upper, 1, 1, front, metal, doors=True)
    return d
