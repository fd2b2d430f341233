"""Makers of chairs, tables, lamps, shelves, cabinets and bunk beds (see `makers.common`).

Metres, y up, front +z.
"""

from collections.abc import Sequence

import numpy as np

from langflash_core.lab.rooms.builtin import KIND_FABRIC
from langflash_core.lab.rooms.makers.fittings import floor_lamp, pendant_lamp, table_lamp
from langflash_core.lab.rooms.makers.furniture import plain_bookcase, plain_chair, plain_cupboard, plain_table
from langflash_core.lab.rooms.makers.kit import (
    BULB,
    DARK,
    LEAF,
    LINEN,
    MIRROR,
    QUARTER,
    SIDES,
    TURN,
    WHITE,
    Design,
    Draw,
    Face,
    Look,
    Material,
    Vector,
    between_all,
    box,
    carcass,
    displaced,
    four_legs,
    fronts,
    grid_triangles,
    lathe,
    pillow_at,
    plain,
    polar,
    rounded,
    shifted,
    spread,
    turned,
    twins,
)

_GLASS = plain((0.8, 0.88, 0.87), 0.9, opacity=0.35)
_WICKER = Material((0.72, 0.58, 0.38)), KIND_FABRIC


def _pair(d: Design, path: Sequence[Vector], radius: float, look: Look) -> None:
    """A rod along a path, and its mirror image on the left."""
    for sx in SIDES:
        d.tube([(sx * x, y, z) for x, y, z in path], radius, look, 6)


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
            d.add(rounded((2.6 * r, room * 0.5, 2.2 * r), (middle, foot + room * 0.55, 0), 2.0, 5), LEAF)
    return d


def dressing_table(draw: Draw) -> Design:
    """A table with drawers on legs or blocks, under a round, an oblong or a three-winged mirror."""
    d = Design("dressing table", "dressing table", ("vanity", "makeup table"))
    w, h, deep, tall = between_all(draw, 0.75, 1.25, 0.7, 0.8, 0.38, 0.5, 0.5, 0.85)
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
    twins(d, (0.03, tall * 0.6, 0.03), (wide * 0.3, h + tall * 0.3, z), look)
    for k, part in enumerate((look, MIRROR)):
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
    w, h, deep, post, rail, lean = between_all(
        draw, 1.9, 2.1, 1.55, 1.9, 0.85, 1.05, 0.04, 0.08, 0.22, 0.36, 0, 0.25
    )
    for sz in SIDES:
        twins(d, (post, h, post), (w / 2, h / 2, sz * deep / 2), look)
    for low in (h - 0.4,) if loft else (h - 0.4, draw.between(0.25, 0.4)):
        d.box((w, 0.1, deep), (0, low, 0), look)
        d.soft((w * 0.96, 0.15, deep * 0.95), (0, low + 0.12, 0), LINEN, 12)
        d.add(shifted(pillow_at(0.4, 0.13, 0.6), (w * 0.36, low + 0.18, 0)), WHITE)
        d.soft((w * draw.between(0.5, 0.7), 0.08, deep), (-w * 0.14, low + 0.18, 0), draw.cloth(), 9)
        twins(d, (0.025, rail, deep), (w / 2, low + 0.1 + rail / 2, 0), look)
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


def chair(draw: Draw) -> Design:
    """Mostly plain; else folding, shell, rocking, ladder-back, bar and bentwood chairs."""
    if draw.chance(0.75):
        return plain_chair(draw)
    styles = (_folding_chair, _shell_chair, _country_chair, _country_chair, _bar_chair, _bentwood_chair)
    return draw.one_of(styles)(draw)


def _folding_chair(draw: Draw) -> Design:
    d, look, plate = Design("folding chair", "chair", ("chair",)), draw.legs(), draw.body()
    x, seat, top, r = between_all(draw, 0.2, 0.25, 0.43, 0.47, 0.76, 0.88, 0.011, 0.018)
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
    w, seat, tall, top, curl = between_all(draw, 0.42, 0.6, 0.42, 0.46, 0.32, 0.42, 0.25, 0.42, 0.04, 0.2)
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
    x, z, seat, top, r = between_all(draw, 0.2, 0.26, 0.19, 0.23, 0.42, 0.46, 0.92, 1.15, 0.014, 0.022)
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
        twins(d, (0.06, 0.025, 2 * z + 0.08), (x, seat + 0.22, 0), look)
    return d


def _bar_chair(draw: Draw) -> Design:
    d, look, plate = Design("bar chair", "chair", ("bar stool", "high chair")), draw.legs(), draw.upholstery()
    seat, x, tall, soft = between_all(draw, 0.62, 0.78, 0.17, 0.22, 0.2, 0.4, 3, 8)
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
    r, seat, tall, inner = between_all(draw, 0.2, 0.23, 0.44, 0.47, 0.38, 0.46, 0.5, 0.7)
    d.lathe(((0, seat - 0.03), (r, seat - 0.03), (r * 1.03, seat - 0.01), (r, seat + 0.01)), look)
    d.lathe(((r, seat + 0.01), (0, seat + 0.005)), _WICKER if draw.chance(0.6) else look)
    d.lathe([(r * 0.85 + 0.008 * np.cos(a), 0.2 + 0.008 * np.sin(a)) for a in spread(0, TURN, 5)], look, 16)
    for z in (-r, r):
        _pair(d, ((r * 0.85, 0, z * 0.95), (r * 0.65, seat, z * 0.65)), 0.014, look)
    a = np.linspace(0, np.pi, 11)
    for k in (1.0, inner):
        arch = 0.9 * k * r * np.cos(a), seat + k * tall * np.sin(a) ** 0.6, -r * 0.75 - 0.09 * k * np.sin(a)
        d.tube(list(zip(*(v.tolist() for v in arch), strict=True)), 0.012, look, 6)
    return d


def table(draw: Draw) -> Design:
    """Mostly plain; else pedestal, trestle, glass, tulip, console and side tables."""
    if draw.chance(0.72):
        return plain_table(draw)
    style, look, metal = draw.style(6), draw.body(), draw.legs()
    names = ("round table", "side table", "tulip table", "console table", "trestle table", "glass table")
    d = Design(names[style], "table", ("table",))
    w, deep, h, r = between_all(draw, 1.2, 1.9, 0.7, 0.95, 0.71, 0.77, 0.4, 0.65)
    if style < 3:
        r, h = between_all(draw, 0.2, 0.28, 0.45, 0.62) if style == 1 else (r, h)
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
        for a in spread(0.5, 0.5 + TURN, draw.count(4, 5))[1:] if style < 2 else ():
            d.tube(
                (polar(0.02, a, h * 0.25), polar(r * 0.45, a, h * 0.18), polar(r * 0.75, a, 0.02)),
                0.02,
                metal,
                6,
            )
        return d
    if style == 3:
        w, deep, h = between_all(draw, 0.8, 1.4, 0.28, 0.4, 0.74, 0.9)
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
        twins(d, (0.05, 0.05, deep * 0.75), (w * 0.34, h - 0.05, 0), metal)
        twins(d, (w * 0.12, 0.02, deep * 0.75), (w * 0.34, h * 0.3, 0), metal)
    d.box((w, 0.015 if style == 5 else 0.03, deep), (0, h, 0), _GLASS if style == 5 else look)
    return d


def lamp(draw: Draw) -> Design:
    """Mostly plain; else desk lamps with arms, tripods, arcs, paper globes, wall lamps, chandeliers."""
    if draw.chance(0.78):
        return draw.one_of((floor_lamp, table_lamp, pendant_lamp))(draw)
    makers = (_desk_lamp, _tripod_or_arc, _tripod_or_arc, _paper_lamp, _wall_lamp, _chandelier, _lantern)
    d = draw.one_of(makers)(draw, draw.metal() if draw.chance(0.6) else draw.painted())
    d.light, d.tags = True, ("lamp", "light")
    return d


def _shade_look(draw: Draw) -> Look:
    return plain((0.95, 0.92, 0.84) if draw.chance(0.6) else draw.colour(0.6, 0.4))


def _desk_lamp(draw: Draw, metal: Look) -> Design:
    d, (a, b, y, r) = (
        Design("desk lamp", "lamp"),
        between_all(draw, 0.12, 0.2, 0.18, 0.3, 0.28, 0.4, 0.07, 0.1),
    )
    d.cylinder(r, 0.03, (0, 0, 0), metal)
    for z in (-0.012, 0.012):
        d.tube(((0, 0.02, z), (-a, y, z), (b, y + b * 0.7, z)), 0.006, metal, 6)
    d.add(rounded((0.04, 0.04, 0.05), (-a, y, 0), 2.0, 5), DARK)
    head = lathe(((0.085, -0.12), (0.07, -0.04), (0.03, 0), (0.03, 0.04), (0, 0.04)), segments=14)
    for part, look in ((head, metal), (rounded((0.08, 0.08, 0.08), (0, -0.07, 0), 2.0, 5), BULB)):
        d.add(shifted(turned(part, 2, 0.5), (b, y + b * 0.7, 0)), look)
    return d


def _tripod_or_arc(draw: Draw, metal: Look) -> Design:
    d, (r, h, out, narrow) = (
        Design("tripod floor lamp", "lamp"),
        between_all(draw, 0.13, 0.24, 1.1, 1.35, 0.7, 1.2, 0.6, 1),
    )
    if draw.chance(0.5):
        for a in spread(0.5, 0.5 + TURN, 4)[1:]:
            d.tube((polar(out * 0.27, a, 0), polar(0.03, a, h)), 0.018, metal, 6)
        d.cylinder(0.05, 0.06, (0, h - 0.05, 0), metal)
        d.lathe(((r, h), (r * narrow, h + 0.32)), _shade_look(draw))
        return d
    d.name = "arc floor lamp"
    d.box((0.3, 0.06, 0.3), (0, 0.03, 0), draw.one_of((WHITE, DARK, metal)))
    arc = [(out * (1 - np.cos(t)) / 1.3, 0.5 + 1.35 * np.sin(t), 0.0) for t in spread(0, 2.1, 10)]
    d.tube([(0, 0.05, 0), *arc], 0.013, metal, 6)
    d.add(lathe(((r, -0.2), (r * 0.9, -0.1), (r * 0.5, -0.02), (0, 0)), arc[-1]), metal)
    d.add(shifted(rounded((r, r, r), (0, -0.14, 0), 2.0, 5), arc[-1]), BULB)
    return d


def _paper_lamp(draw: Draw, metal: Look) -> Design:
    """A ribbed ball that hangs, or stands on three legs, tall or short."""
    foot, t, r, flat = (
        draw.one_of((0.0, 0.05, 0.9)),
        np.linspace(0.15, np.pi - 0.15, 25),
        *between_all(draw, 0.16, 0.32, 0.75, 1),
    )
    d = Design("paper lamp" if foot else "paper pendant lamp", "lamp")
    ribs = r * np.sin(t) * (1 + 0.02 * np.cos(np.arange(25) * np.pi))
    heights = foot + r * (1 - flat * np.cos(t))
    d.lathe(list(zip(ribs.tolist(), heights.tolist(), strict=True)), _shade_look(draw), 18)
    if not foot:
        d.tube(((0, 1.7 * r, 0), (0, 2 * r + draw.between(0.1, 0.4), 0)), 0.005, DARK, 5)
    for a in spread(0, TURN, 4)[1:] if foot else ():
        d.tube((polar(r * 0.8, a, 0), polar(r * 0.25, a, foot + 0.1 * r)), 0.01, metal, 6)
    return d


def _wall_lamp(draw: Draw, metal: Look) -> Design:
    d, style = Design("wall lamp", "lamp", elevation=1.7), draw.style(3)
    out, plate, look = draw.between(0.1, 0.22), draw.between(0.1, 0.25), _shade_look(draw)
    d.box((0.09, plate, 0.02), (0, 0.12, -out), metal)
    for x in (-0.1, 0.1) if draw.chance(0.3) else (0.0,):
        d.tube(((0, 0.1, -out), (x / 2, 0.06, -out / 2), (x, 0.1, 0)), 0.01, metal, 6)
        if style == 0:
            d.add(rounded((0.15, 0.15, 0.15), (x, 0.17, 0), 2.0, 8), BULB)
        else:
            d.add(
                lathe(((0.09, 0.1), (0.05 + 0.04 * style, 0.27)), (x, 0, 0), 16),
                look if style == 1 else metal,
            )
            d.cylinder(0.03, 0.13, (x, 0.1, 0), BULB)
    return d


def _chandelier(draw: Draw, metal: Look) -> Design:
    d, (reach, drop), shaded = (
        Design("chandelier", "lamp"),
        between_all(draw, 0.25, 0.45, 0.5, 0.8),
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
    for a in spread(0, TURN, draw.count(6, 9))[1:]:
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
        d.add(rounded((0.03, 0.06, 0.03), polar(reach, a, 0.27), 2.0, 4), BULB)
        if shaded:
            d.add(lathe(((0.07, 0), (0.035, 0.1)), polar(reach, a, 0.22), 10), look)
    return d


def _lantern(draw: Draw, metal: Look) -> Design:
    d, (w, tall) = Design("lantern", "lamp"), between_all(draw, 0.1, 0.2, 0.18, 0.4)
    for y in (0.01, tall):
        d.box((w + 0.03, 0.02, w + 0.03), (0, y, 0), metal)
    for z in (-w / 2, w / 2):
        twins(d, (0.014, tall, 0.014), (w / 2, tall / 2, z), metal)
        d.box((w, tall - 0.03, 0.003), (0, tall / 2, z), _GLASS)
    d.cylinder(w * 0.25, tall * 0.4, (0, 0.02, 0), LINEN)
    d.add(rounded((0.02, 0.045, 0.02), (0, 0.05 + tall * 0.4, 0), 2.0, 4), BULB)
    top = tall + w * 0.5
    d.add(turned(lathe(((w * 0.75, tall), (0.02, top), (0, top)), segments=4), 1, np.pi / 4), metal)
    d.tube([(0.05 * np.cos(a), top + 0.06 * np.sin(a), 0) for a in spread(0, np.pi, 7)], 0.005, metal, 5)
    return d


def bookcase(draw: Draw) -> Design:
    """Mostly plain; else leaning ladders, cubes, boards on the wall, corner shelves; full or nearly empty."""
    if draw.chance(0.71):
        return plain_bookcase(draw)
    style, look, frame, fill = draw.style(4), draw.body(), draw.legs(), draw.between(0.2, 1)
    name = ("ladder shelf", "corner shelf", "cube shelf", "wall shelf")[style]
    d = Design(name, "bookcase", ("shelf", "bookcase"), elevation=draw.between(1.1, 1.4) * (style == 3))
    w, h, deep, side, b = between_all(draw, 0.5, 0.9, 1.6, 2.0, 0.35, 0.5, 0.32, 0.38, 0.2, 0.36)
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
            twins(d, (0.02, 0.09, 0.012), (w * 0.45, y - 0.05, -b * 0.34), frame)
    for left, right, foot, room, b, z in places:
        if draw.chance(fill):
            shelf = _stock(Design("shelf", "bookcase"), draw, left, right, foot, room, b)
            d.parts += displaced(shelf, (0, 0, z)).parts
    return d


def cupboard(draw: Draw) -> Design:
    """Mostly plain; else sideboards, glass cabinets, buffets with an upper part, filing and shoe cabinets."""
    if draw.chance(0.7):
        return plain_cupboard(draw)
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
    w, deep, each, lift = between_all(draw, 0.5, 0.9, 0.17, 0.26, 0.28, 0.36, 0.1, 0.3)
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
    w, h, deep = between_all(draw, 0.6, 1.1, 1.3, 1.95, 0.32, 0.45)
    d.box((w, 0.12, deep), (0, 0.06, 0), look)
    d.box((w, 0.03, deep), (0, h, 0), look)
    d.box((w, h, 0.02), (0, h / 2, -deep / 2), look)
    twins(d, (0.03, h, deep), (w / 2, h / 2, 0), look)
    for y in spread(0.12, h, draw.count(4, 6))[:-1]:
        d.box((w, 0.015, deep * 0.95), (0, y, 0), _GLASS)
        for x in spread(-w * 0.35, w * 0.35, 4):
            r, tall = between_all(draw, 0.02, 0.05, 0.05, 0.16)
            d.add(lathe(((0, 0), (r * 0.6, 0), (r, tall)), (x, y + 0.01, 0), 8), draw.ceramic())
    d.box((w, h - 0.14, 0.006), (0, h / 2 + 0.06, deep / 2), _GLASS)
    for x in (0.017, w / 2 - 0.015):
        twins(d, (0.03, h - 0.14, 0.02), (x, h / 2 + 0.06, deep / 2 + 0.005), look)
    twins(d, (0.012, 0.12, 0.02), (0.02, h * 0.5, deep / 2 + 0.02), metal)
    return d


def _sideboard_or_buffet(draw: Draw, look: Look, metal: Look) -> Design:
    """Doors under a board; above it nothing, or shelves with things and a door."""
    buffet, front = draw.chance(0.5), look if draw.chance(0.5) else draw.body()
    d = Design("buffet" if buffet else "sideboard", "cabinet", ("cabinet", "hutch" if buffet else "credenza"))
    w, h, deep, tall = between_all(draw, 1.2, 1.9, 0.6, 0.85, 0.36, 0.46, 0.75, 1.05)
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
    twins(d, (0.025, tall, deep * 0.6), (w / 2 - 0.012, h + tall / 2, -deep * 0.2), look)
    for y in (h + tall * 0.36, h + tall * 0.68, h + tall):
        d.box((w, 0.025, deep * 0.62), (0, y, -deep * 0.2), look)
        _stock(d, draw, -w * 0.4, -w * 0.05, y - tall * 0.3, tall * 0.26, deep * 0.4)
    if draw.chance(0.6):
        upper = Face(0.0, h + tall * 0.37, w / 2, tall * 0.6, deep * 0.11)
        fronts(d, draw, upper, 1, 1, front, metal, doors=True)
    return d
