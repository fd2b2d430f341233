"""Makers of what stands and lies in kitchens (see `makers.common`). Metres, y up, front +z."""

from collections.abc import Sequence

import numpy as np

from langflash_core.lab.rooms import solids
from langflash_core.lab.rooms.makers import common
from langflash_core.lab.rooms.makers.kit import (
    BLACK,
    QUARTER,
    SIDES,
    STEEL,
    WHITE,
    Design,
    Draw,
    Look,
    Triangles,
    Vector,
    boxes,
    cylinder,
    lathe,
    plain,
    shifted,
    turned,
)
from langflash_core.lab.rooms.makers.small import plain_cup

GLASS, GOLD = plain((0.8, 0.87, 0.87), 0.8, 0.4), plain((0.75, 0.6, 0.25), 0.8)
IRON, _RED, _GREEN = (
    plain((0.09, 0.09, 0.095), 0.2),
    plain((0.75, 0.13, 0.08), 0.4),
    plain((0.25, 0.5, 0.15)),
)
CRUST, _CREAM, _ORANGE = plain((0.72, 0.46, 0.2), 0.1), plain((0.95, 0.9, 0.75)), plain((0.95, 0.6, 0.15))
_CORNERS = ((-1, -1), (-1, 1), (1, -1), (1, 1))


def any_made(draw: Draw, group: str, *names: str) -> tuple[int, Design]:
    """One of several things of a group: which, and its design to begin with."""
    style = draw.style(len(names))
    return style, Design(names[style], group, (group,))


def _shell(draw: Draw) -> Look:
    return draw.one_of((STEEL, BLACK, WHITE, draw.painted(), plain(draw.colour(0.9, 0.4), 0.6)))


def _blob(d: Design, size: Vector, centre: Vector, look: Look, squareness: float = 2.0) -> None:
    d.add(solids.rounded(size, centre, squareness, 6), look)


def round_body(
    d: Design, r: float, h: float, look: Look, shape: str, at: Vector = (0, 0, 0), n: int = 14
) -> None:
    """Turned about an upright axis: "radius height" in hundredths of r and h, from the foot to the top."""
    profile = np.array(shape.split(), float).reshape(-1, 2) * [r / 100, h / 100]
    d.add(lathe([(x, y) for x, y in profile.tolist()], at, n), look)


def arc_line(x: float, y: float, wide: float, high: float, start: float, end: float) -> list[Vector]:
    """Points on an ellipse that faces the front; angles run from the top clockwise."""
    return [(x + wide * np.sin(t), y + high * np.cos(t), 0.0) for t in common.spread(start, end, 8)]


def rod_along(d: Design, r: float, long: float, centre: Vector, look: Look) -> None:
    """A rod along x around a centre."""
    d.add(shifted(turned(cylinder(r, long, (0, -long / 2, 0), segments=10), 2, -QUARTER), centre), look)


def _tapered(size: Vector, centre: Vector, x: float, z: float, back: float = 0.0) -> Triangles:
    """A box whose top is narrower by the factors x and z and shifted back."""
    part = solids.box(size, (0, 0, 0))
    return shifted(np.where(part[..., 1:2] > 0, part * np.array([x, 1, z]) - [0, 0, back], part), centre)


def _put(d: Design, parts: Sequence[tuple[Triangles, Look]], place: Vector, angle: float = 0.0) -> None:
    d.parts += [(shifted(turned(triangles, 1, angle), place), look) for triangles, look in parts]


def dishwasher(draw: Draw) -> Design:
    """A door under a panel with buttons, with a bar or a recess to grip; some open, with a rack of plates."""
    d = Design("dishwasher", "dishwasher", ("built-in dishwasher",))
    w, h, z = draw.one_of((0.45, 0.6)), draw.between(0.82, 0.88), draw.between(0.27, 0.3)
    look = draw.body() if draw.chance(0.25) else _shell(draw)
    panel, door = draw.one_of((look, BLACK, STEEL)), h - 0.22
    dark = STEEL if panel is BLACK else BLACK
    boxes(d, look, (w, h - 0.1, 2 * z, 0, h / 2 + 0.05, 0))
    boxes(d, panel, (w - 0.01, 0.105, 0.03, 0, h - 0.056, z + 0.014))
    boxes(
        d, dark, (w * 0.96, 0.1, z * 1.8, 0, 0.05, -0.02), (0.1, 0.03, 0.006, -w * 0.28, h - 0.055, z + 0.03)
    )
    for k in range(draw.count(3, 6)):
        d.roll(0.009, 0.006, (w * 0.4 - 0.035 * k, h - 0.055, z + 0.03), dark, 8)
    if draw.chance(0.3):
        boxes(d, plain((0.25, 0.25, 0.26), 0.5), (w - 0.05, door - 0.02, 0.01, 0, 0.1 + door / 2, z))
        boxes(d, look, (w - 0.01, 0.03, door, 0, 0.11, z + door / 2))
        for out in common.spread(z + 0.03, z + door * 0.7, 7):
            d.tube(((-w * 0.4, 0.3, out), (-w * 0.4, 0.16, out), (w * 0.4, 0.16, out)), 0.006, STEEL, 4)
            d.roll(draw.between(0.09, 0.12), 0.012, (0.05, 0.28, out), WHITE, 12)
        return d
    bar, y, out = draw.chance(0.5), door + 0.05, 0.05 * draw.chance(0.5)
    boxes(d, look, (w - 0.01, door, 0.025, 0, 0.1 + door / 2, z + 0.012))
    boxes(
        d, STEEL if bar else BLACK, (w * draw.between(0.3, 0.9), 0.03, 0.02 + out, 0, y, z + 0.025 + out / 2)
    )
    return d


def range_hood(draw: Draw) -> Design:
    """A chimney over a slab or a pyramid, flat ones, slanted panes."""
    d = Design("range hood", "range hood", ("cooker hood", "extractor hood"), elevation=1.55)
    w, z, style = draw.one_of((0.6, 0.75, 0.9)), draw.between(0.45, 0.52), draw.style(4)
    look, rim = draw.one_of((STEEL, STEEL, BLACK, WHITE, draw.painted())), draw.between(0.04, 0.08)
    pipe, rise = draw.between(0.22, 0.32), draw.between(0.15, 0.3)
    if style == 2:
        pane = turned(solids.box((w, 0.04, 0.55), (0, 0, 0)), 0, draw.between(0.7, 1.0))
        d.add(shifted(pane, (0, 0.22, 0.02)), BLACK if draw.chance(0.6) else look)
        boxes(d, look, (w * 0.9, 0.3, z * 0.35, 0, 0.2, -z * 0.3))
    else:
        boxes(d, look, (w, rim, z, 0, rim / 2, 0))
        size = (w * (0.6 if style == 3 else 1), 0.1 if style == 1 else rise, z)
        d.add(
            _tapered(size, (0, rim + size[1] / 2, 0), 0.95 if style == 1 else pipe / w, 0.5, z * 0.25), look
        )
    if style != 1:
        boxes(d, look, (pipe, draw.between(0.5, 0.8), pipe * 0.8, 0, 0.5, pipe * 0.4 - z / 2))
    return d


def kitchen_island(draw: Draw) -> Design:
    """A block of drawers or doors under a wide top, some with shelves at the end or a sink; or on legs."""
    d = Design("kitchen island", "kitchen island", ("kitchen counter", "work top"))
    w, z, h, look = draw.between(1.0, 2.4), draw.between(0.6, 1.0), draw.between(0.85, 0.9), draw.body()
    legs, over, top = (
        draw.chance(0.25),
        draw.between(0.02, 0.35),
        draw.one_of((draw.wooden(), WHITE, BLACK, STEEL)),
    )
    shelf, foot = draw.between(0.25, 0.4) * (draw.chance(0.4) and not legs), h - 0.2 if legs else 0.1
    boxes(d, top, (w + 0.05, draw.between(0.025, 0.07), z + over, 0, h, -over / 2 + 0.02))
    for sx, sz in _CORNERS if legs else ():
        boxes(d, look, (0.07, h, 0.07, sx * (w / 2 - 0.04), h / 2, sz * (z / 2 - 0.04)))
    boxes(d, look, (w - 0.06, 0.05, z - 0.08, 0, 0.2 if legs else 0.05, 0))
    boxes(d, look, (w - shelf, h - foot, z, -shelf / 2, (h + foot) / 2, 0))
    for y in common.spread(0.115, h - 0.03, 4) if shelf else ():
        boxes(d, look, (shelf, 0.025, z, (w - shelf) / 2, y, 0))
    face, doors = common.Face(-w / 2, foot, w - shelf, h - foot - 0.03, z / 2), draw.chance(0.5) and not legs
    rows, columns = 1 if doors or legs else draw.count(2, 4), max(2, round((w - shelf) / 0.5))
    common.fronts(d, draw, face, rows, columns, draw.body(), draw.metal(), doors)
    if draw.chance(0.3):
        boxes(d, plain((0.45, 0.45, 0.46), 0.6), (0.5, 0.012, 0.38, 0, h + 0.032, 0.02))
        d.tube(((0, h, -0.2), (0, h + 0.3, -0.2), (0, h + 0.3, -0.03), (0, h + 0.2, -0.03)), 0.012, STEEL)
    return d


def coffee_machine(draw: Draw) -> Design:
    """Espresso machine, filter machine with its pot, capsule machine, moka pot."""
    names = ("espresso machine", "coffee maker", "capsule coffee machine", "moka pot")
    style, d = any_made(draw, "coffee machine", *names)
    look, w, h = (
        _shell(draw),
        (0.28, 0.22, 0.14, 0.05)[style] * draw.between(0.85, 1.15),
        draw.between(0.26, 0.38),
    )
    dark = STEEL if look is BLACK else BLACK
    if style == 3:
        round_body(d, w, h * 0.6, STEEL, "0 0 100 0 95 38 72 45 78 50 105 92 50 98 8 100 15 108 0 110", n=8)
        d.tube(((w * 0.8, h * 0.52, 0), (w * 2, h * 0.53, 0), (w * 1.9, h * 0.27, 0)), 0.009, BLACK, 6)
        d.add(_tapered((w, 0.03, w * 0.5), (-w * 0.8, h * 0.52, 0), 1.3, 1.0), STEEL)
        return d
    boxes(d, look, (w, 0.05, 0.28, 0, 0.025, 0), (w, h - 0.02, 0.12, 0, h / 2, -0.08))
    boxes(d, dark, (w * 0.8, 0.008, 0.14, 0, 0.052, 0.056))
    _blob(d, (w, h * 0.34, 0.28), (0, h * 0.85, 0), look, 4.0 if style == 2 else 20.0)
    d.add(cylinder(0.035, h * 0.12, (0, h * 0.58, 0.056), 0.055, 12), dark)
    for k in range(draw.count(2, 4) if style < 2 else 0):
        d.roll(0.016, 0.02, (0.05 * k - w * 0.33, h * 0.87, 0.134), dark, 10)
    if style == 1:
        coffee, place = plain((0.13, 0.07, 0.04), 0.9), (0, 0.056, 0.056)
        round_body(d, 0.065, 0.13, coffee, "0 0 100 5 110 50 0 50", place)
        round_body(d, 0.065, 0.13, GLASS, "110 50 75 90 80 100 0 100", place)
        d.tube([(0, y, x) for x, y, _ in arc_line(0.12, 0.12, 0.045, 0.05, 0, np.pi)], 0.009, BLACK, 6)
    else:
        d.tube(((0, h * 0.6, 0.056), (0, h * 0.57, 0.056 + 0.14 * (style == 0))), 0.014, BLACK)
        _put(d, plain_cup(draw).parts if draw.chance(0.6) else (), (0, 0.056, 0.056), draw.between(0, 6))
    return d


def kettle(draw: Draw) -> Design:
    """Electric on a base with a handle at its side; for the stove, squat with a bail."""
    style, d = any_made(draw, "kettle", "electric kettle", "kettle")
    look, dark = STEEL if draw.chance(0.4) else _shell(draw), BLACK if draw.chance(0.7) else draw.wooden()
    if style == 0:
        r, h, top = draw.between(0.065, 0.085), draw.between(0.18, 0.25), draw.between(0.6, 0.85)
        round_body(
            d, r, h, look, f"0 10 100 10 {draw.count(80, 110)} 50 {100 * top} 95 10 100 15 108 0 110", n=18
        )
        d.cylinder(r * 1.15, 0.02, (0, 0, 0), BLACK)
        d.tube(arc_line(r * top * 0.9, h * 0.56, 0.07, h * 0.37, 0, 3), 0.011, dark, 6)
        d.add(_tapered((0.05, 0.05, 0.03), (-r * top - 0.005, h * 0.87, 0), 1.6, 1.2), look)
    else:
        r, h = draw.between(0.085, 0.12), draw.between(0.11, 0.16)
        round_body(d, r, h, look, "0 0 100 0 105 25 80 75 40 97 10 100 15 110 0 112", n=18)
        d.tube(arc_line(0, h * 0.75, r * 0.85, h * draw.between(0.8, 1.1), -QUARTER, QUARTER), 0.009, dark, 6)
        d.tube(((-r * 0.8, h * 0.45, 0), (-r * 1.25, h * 0.75, 0), (-r * 1.45, h * 0.95, 0)), r * 0.14, look)
    return d


def teapot(draw: Draw) -> Design:
    """Round to tall, of china, iron or glass: spout, lid with a knob, a handle at the back or above."""
    d = Design("teapot", "teapot", ("tea pot", "pot"))
    r, look = draw.between(0.065, 0.095), draw.one_of((draw.ceramic(), draw.ceramic(), IRON, STEEL, GLASS))
    h, neck = r * draw.between(1.2, 2.0), draw.count(40, 65)
    above = f"85 80 {neck} 95 {neck} 100 {neck * 0.8} 107 8 112 16 120 10 127 0 129"
    round_body(d, r, h, look, f"0 0 60 0 95 {draw.count(15, 30)} 100 {draw.count(35, 60)} {above}", n=18)
    if look is IRON or draw.chance(0.2):
        d.tube(arc_line(0, h * 0.85, r * 0.85, h * 0.95, -QUARTER, QUARTER), 0.006, IRON, 6)
    else:
        d.tube(arc_line(r * 0.85, h * 0.55, r * 0.7, h * 0.33, 0, np.pi), r * 0.09, look, 6)
    spout = [(-r * x, h * y, 0.0) for x, y in ((0.85, 0.3), (1.2, 0.5), (1.4, 0.8), (1.65, 0.98))]
    for k in range(3):
        d.tube(spout[k : k + 2], r * (0.24 - 0.06 * k), look)
    return d


def toaster(draw: Draw) -> Design:
    """With one or two rows of slots, some with toast in them; or a small oven with a glass door."""
    style, d = any_made(draw, "toaster", "toaster", "toaster", "toaster oven")
    look, oven = _shell(draw), style == 2
    w, h, rows = (
        draw.between(0.24, 0.33) + 0.15 * oven,
        draw.between(0.17, 0.21) + 0.05 * oven,
        draw.count(1, 2),
    )
    z, dark = 0.3 if oven else 0.09 + 0.06 * rows, STEEL if look is BLACK else BLACK
    _blob(d, (w, h, z), (0, h / 2 + 0.01, 0), look, 30.0 if oven else draw.between(6, 14))
    boxes(d, dark, (w * 0.9, 0.02, z * 0.9, 0, 0.01, 0))
    if oven:
        boxes(d, plain((0.08, 0.06, 0.05), 0.9), (w * 0.7, h * 0.75, 0.015, -w * 0.11, h * 0.5, z / 2))
        boxes(d, STEEL, (w * 0.6, 0.014, 0.014, -w * 0.11, h * 0.8, z / 2 + 0.035))
        for k in range(3):
            d.roll(0.02, 0.02, (w * 0.37, h * (0.25 + 0.27 * k), z / 2), dark, 10)
        return d
    toast = draw.chance(0.5)
    for at in (0.0,) if rows == 1 else (-0.033, 0.033):
        boxes(d, BLACK, (w * 0.7, 0.006, 0.032, 0, h + 0.009, at))
        boxes(
            d, CRUST if toast else dark, (w * 0.42, 0.06 if toast else 0.01, 0.018, 0, h + 0.03 * toast, at)
        )
    boxes(
        d, dark, (0.03, 0.018, 0.05, w / 2 + 0.012, h * 0.7, 0), (0.02, 0.03, 0.03, w / 2, h * 0.25, z * 0.2)
    )
    return d


def kitchen_appliance(draw: Draw) -> Design:
    """Blender, food processor, citrus press, stand mixer or rice cooker."""
    names = ("blender", "food processor", "juicer", "stand mixer", "rice cooker")
    style, d = any_made(draw, "kitchen appliance", *names)
    look, r, h = _shell(draw), draw.between(0.075, 0.1), draw.between(0.28, 0.36)
    dark, foot = STEEL if look is BLACK else BLACK, (0.13, 0.12, 0.15, 0, 0)[style]
    if style == 3:
        _blob(d, (0.36, 0.05, 0.2), (0, 0.025, 0), look, 4)
        d.add(_tapered((0.1, h * 0.75, 0.13), (0.12, h * 0.4, 0), 0.9, 0.8), look)
        _blob(d, (0.36, 0.13, 0.13), (0.01, h * 0.88, 0), look, 3)
        round_body(d, 0.105, 0.14, STEEL, "0 0 55 0 100 100 94 100 20 80 20 170", (-0.07, 0.05, 0))
        return d
    if style == 4:
        round_body(d, r * 1.4, h * 0.65, look, "0 0 85 0 100 25 100 65 94 80 60 97 0 100", n=18)
        round_body(d, r * 1.4, h * 0.65, dark, "102 63 102 69", n=18)
        boxes(d, dark, (r, h * 0.2, 0.02, 0, h * 0.22, r * 1.4))
        d.tube(arc_line(0, h * 0.48, r * 1.33, h * 0.3, -QUARTER, QUARTER), 0.01, dark, 6)
        return d
    d.add(_tapered((2 * r, foot, 2 * r), (0, foot / 2, 0), 0.85, 0.85), look)
    for k in (-1, 0, 1):
        d.roll(0.014 if k else 0.022, 0.02, (0.045 * k, foot * 0.4, r * 0.92), dark, 10)
    tall, wide = ((0.22, 75), (0.13, 95), (0.05, 70))[style]
    round_body(d, r, tall, GLASS, f"0 0 {wide} 0 100 100 94 100", (0, foot, 0))
    if style == 2:
        round_body(d, r, 0.09, WHITE, "70 0 50 50 0 100", (0, foot + 0.01, 0), 8)
        return d
    round_body(d, r, tall, plain(draw.colour(0.8, 0.5)), "0 3 65 3 70 55 0 55", (0, foot, 0))
    round_body(
        d,
        r,
        0.03,
        dark,
        f"0 0 100 0 100 80 35 80 35 {180 + 150 * style} 0 {180 + 150 * style}",
        (0, foot + tall, 0),
    )
    d.tube(arc_line(r * wide / 100, foot + tall * 0.5, 0.055, tall * 0.4, 0, np.pi), 0.011, dark, 6)
    return d


def pan(draw: Draw) -> Design:
    """Frying pan, sauce pan with a long handle, cooking pot with two handles and a lid."""
    style, d = any_made(draw, "pan", "frying pan", "sauce pan", "cooking pot")
    r, look = (0.125, 0.085, 0.125)[style] * draw.between(0.8, 1.2), draw.one_of((STEEL, IRON, _shell(draw)))
    h, grip = r * (0.32, 1.1, 1.1)[style] * draw.between(0.8, 1.3), draw.one_of((BLACK, draw.wooden(), look))
    round_body(d, r, h, look, f"0 0 {80 if style == 0 else 96} 0 100 100 93 100 76 10 0 10", n=18)
    if style < 2:
        long = r + draw.between(0.15, 0.21)
        d.tube(((r * 0.95, h * 0.85, 0), (r + 0.06, h + 0.01, 0), (long, h + 0.02, 0)), 0.011, grip, 6)
    for sx in SIDES if style == 2 else ():
        ear = [
            (sx * (r - 0.005 + y), h * 0.8, x) for x, y, _ in arc_line(0, 0, r * 0.4, 0.04, -QUARTER, QUARTER)
        ]
        d.tube(ear, 0.008, grip, 6)
    if style == 2 or draw.chance(0.3 * style):
        round_body(d, r, r * 0.2, look, "102 0 100 10 60 80 8 100 20 140 0 150", (0, h, 0), 18)
    return d


def _tool(draw: Draw, kind: int) -> list[tuple[Triangles, Look]]:
    """Knife, fork, spoon or spatula, flat along x from the end of its handle."""
    d, head, long = (
        Design("", ""),
        STEEL if kind < 2 or draw.chance(0.6) else draw.wooden(),
        draw.between(0.1, 0.17),
    )
    rod_along(
        d, 0.007 + 0.004 * (kind == 0), long, (long / 2, 0.009, 0), draw.one_of((BLACK, head, draw.wooden()))
    )
    if kind == 0:
        d.add(turned(_tapered((0.035, 0.17, 0.003), (0, long + 0.085, 0), 0.3, 1), 2, -QUARTER), head)
        d.parts[-1] = (shifted(turned(d.parts[-1][0], 0, QUARTER), (0, 0.009, 0)), head)
    elif kind == 2:
        _blob(d, (0.075, 0.016, 0.046), (long + 0.035, 0.009, 0), head)
    wide = (0, 0.015, 0, 0.035)[kind]
    for z in common.spread(-wide, wide, 4) if wide else ():
        boxes(
            d,
            head,
            (0.04, 0.005, wide * 0.7, long + 0.02, 0.009, z),
            (0.06, 0.004, wide * 0.4, long + 0.06, 0.009, z),
        )
    return d.parts


def kitchen_utensil(draw: Draw) -> Design:
    """A knife, fork, spoon or spatula; a block or pot of them; a chopping board, a rolling pin."""
    names = ("kitchen knife", "fork", "spoon", "spatula", "knife block", "utensil holder")
    style, d = any_made(draw, "kitchen utensil", *names, "chopping board", "rolling pin")
    wood, r, w = draw.wooden(), draw.between(0.045, 0.065), draw.between(0.28, 0.45)
    if style < 4:
        _put(d, _tool(draw, style), (-0.13, 0, 0))
    elif style == 4:
        boxes(d, draw.one_of((wood, BLACK, draw.painted())), (0.11, 0.22, 0.1, 0, 0.11, 0))
        for k in range(draw.count(4, 7)):
            boxes(d, BLACK, (0.016, 0.1, 0.024, 0.035 * (k % 3 - 1), 0.26, 0.032 * (k // 3 - 1)))
        d.parts = [(turned(part, 0, -0.35), look) for part, look in d.parts]
    elif style == 5:
        round_body(
            d,
            r,
            0.15,
            draw.one_of((draw.ceramic(), STEEL, wood)),
            f"0 0 {draw.count(80, 100)} 0 100 100 90 100",
        )
        for k in range(draw.count(4, 7)):
            tool = [
                (turned(part, 2, QUARTER - 0.05 * (k % 4)), look)
                for part, look in _tool(draw, draw.count(1, 3))
            ]
            _put(d, tool, (0, 0.07, 0), 0.9 * k)
    elif style == 6:
        boxes(d, wood, (w, 0.022, w * 0.65, 0, 0.011, 0), (0.08, 0.022, 0.05, w / 2 + 0.03, 0.011, 0))
        _put(d, _tool(draw, 0) if draw.chance(0.5) else (), (-0.15, 0.02, w * 0.12))
    else:
        rod_along(d, 0.03, 0.24, (0, 0.03, 0), wood)
        rod_along(d, 0.012, 0.42, (0, 0.03, 0), draw.one_of((wood, _RED)))
    return d


def jar(draw: Draw) -> Design:
    """Glass with something in it, or ceramic, with a lid of metal, wood or its own kind."""
    d, r, glass, n = (
        Design("jar", "jar", ("storage jar",)),
        draw.between(0.035, 0.075),
        draw.chance(0.6),
        draw.count,
    )
    h, neck, look = r * draw.between(1.5, 3.6), n(70, 98), GLASS if glass else draw.ceramic()
    round_body(d, r, h, look, f"0 0 90 0 100 6 {n(85, 115)} 50 100 82 {neck} 92 {neck} 100 0 100")
    if glass:
        d.cylinder(r * 0.83, h * draw.between(0.4, 0.8), (0, 0.005, 0), plain(draw.colour(0.8, 0.3), 0.1))
    lid, knob = draw.one_of((STEEL, GOLD, draw.wooden(), draw.painted(), look)), "10 20 22 30 15 38 0 40"
    round_body(
        d,
        r,
        h,
        lid,
        f"0 0 {neck + 5} 0 {neck + 5} {n(8, 18)} {knob if n(0, 1) else '0 18'}",
        (0, h * 0.97, 0),
    )
    return d


def tray(draw: Draw) -> Design:
    """Rectangular with a raised edge and handles, or round; bare, or with cups and a pot."""
    d, disc, w = Design("tray", "tray", ("serving tray",)), draw.chance(0.35), draw.between(0.32, 0.52)
    look, rim = draw.one_of((draw.body(), draw.wooden(), STEEL, GOLD)), draw.between(0.015, 0.05)
    z = w * (1.0 if disc else draw.between(0.55, 0.75))
    if disc:
        round_body(d, w / 2, rim, look, "0 0 95 0 100 100 96 100 90 15 0 15", n=24)
    for s in () if disc else SIDES:
        boxes(d, look, (w, rim, 0.012, 0, rim / 2, s * z / 2), (0.012, rim, z, s * w / 2, rim / 2, 0))
        boxes(d, look, (w / 2, 0.01, z, s * w / 4, 0.005, 0))
        grip = [
            (s * (w / 2 + y * 0.3), rim + y, x) for x, y, _ in arc_line(0, 0, 0.06, 0.04, -QUARTER, QUARTER)
        ]
        d.tube(grip, 0.006, look, 5)
    for k in range(draw.count(-2, 3)):
        _put(d, plain_cup(draw).parts, ((k - 1) * w * 0.26, 0.01, z * 0.17), draw.between(0, 6))
    _put(d, teapot(draw).parts if draw.chance(0.3) else (), (0, 0.01, -z * 0.14), draw.between(0, 6))
    return d


def salt_shaker(draw: Draw) -> Design:
    """Salt and pepper, as shakers or as turned mills, side by side or one alone."""
    mill, d = any_made(draw, "salt shaker", "salt shaker", "pepper mill")
    r, h, belly = draw.between(0.022, 0.03), draw.between(0.07, 0.11) * (1 + mill), draw.count(60, 110)
    looks = (draw.wooden(), draw.wooden()) if mill else (WHITE, draw.one_of((BLACK, GLASS)))
    head = "60 72 95 80 95 86 40 94 0 94" if mill else "95 76 95 78 50 95 0 100"
    for k in range(2 if draw.chance(0.75) else 1):
        round_body(d, r, h, looks[k], f"0 0 100 0 100 10 {belly} 40 80 76", (0.07 * k, 0, 0), 12)
        round_body(d, r, h, looks[k] if mill else STEEL, head, (0.07 * k, 0, 0), 12)
        d.cylinder(0.009, 0.015, (0.07 * k, h * (0.92 if mill else 0.99), 0), STEEL if mill else BLACK)
    return d


def paper_towel_holder(draw: Draw) -> Design:
    """A roll upright on a pole, or across between two posts."""
    d = Design("paper towel holder", "paper towel holder", ("kitchen roll", "paper towels"))
    look, r, long, y = draw.legs(), draw.between(0.045, 0.07), draw.between(0.22, 0.27), 0.1
    for wide, high, part in ((r, long, WHITE), (0.022, long + 0.006, CRUST), (0.007, long + 0.07, look)):
        d.cylinder(wide, high, (0, 0.016, 0), part)
    boxes(d, WHITE, (r, long, 0.003, r / 2, 0.016 + long / 2, r))
    if draw.chance(0.3):
        d.parts = [(shifted(turned(part, 2, QUARTER), (long / 2, y, 0)), p) for part, p in d.parts]
        boxes(d, look, (long + 0.06, 0.015, 0.13, -0.016, 0.0075, 0))
        for sx in SIDES:
            boxes(d, look, (0.015, y + 0.03, 0.05, sx * (long / 2 + 0.015) - 0.016, y / 2 + 0.015, 0))
        return d
    round_body(d, draw.between(0.07, 0.09), 0.016, look, "0 0 100 0 100 100 0 100")
    return d


def bread(draw: Draw) -> Design:
    """Loaf, baguettes, cake, cheese, pizza, hamburger, vegetables."""
    style, d = any_made(
        draw, "food", "bread", "baguette", "cake", "cheese", "pizza", "hamburger", "vegetables"
    )
    r, w, sweet = draw.between(0.09, 0.16), draw.between(0.22, 0.34), plain(draw.colour(0.8, 0.4), 0.2)
    brown, yellow = plain((0.25, 0.13, 0.07)), plain((0.93, 0.75, 0.3), 0.1)
    for k in range((1, draw.count(1, 3))[style] if style < 2 else 0):
        long, high, deep = ((w, 0.11, w * 0.45), (w * 1.7, 0.06, 0.065))[style]
        _blob(d, (long, high, deep), (0, high / 2, 0.068 * k), CRUST, 2.5)
        for x in common.spread(-long * 0.3, long * 0.3, 5):
            boxes(d, _CREAM, (0.012, 0.01, deep * 0.5, x, high * 0.94, 0.068 * k))
    if style == 2:
        d.cylinder(r * 1.25, 0.012, (0, 0, 0), WHITE)
        for k, look in enumerate((sweet, _CREAM, sweet, _CREAM)):
            d.cylinder(r * (1 - 0.01 * (k % 2)), 0.024, (0, 0.012 + 0.024 * k, 0), look)
        for k in range(8):
            _blob(d, (0.026, 0.026, 0.026), common.polar(r * 0.75, 0.785 * k, 0.115), _RED)
    elif style == 3:
        boxes(d, draw.wooden(), (2.4 * r, 0.01, 1.9 * r, 0, 0.005, 0))
        d.add(cylinder(r, r * 0.6, (0, 0.01, 0), segments=3) * np.array([1, 1, 0.7]), yellow)
        for x, y in ((-0.2, 0.2), (0.1, 0.42), (0.35, 0.25), (0.6, 0.4)):
            _blob(d, (0.02, 0.02, 0.02), (r * x, 0.01 + r * y, r * 0.404 * (1 - x)), brown)
    elif style == 4:
        round_body(d, r, 0.025, CRUST, "0 0 100 0 105 50 97 100 88 60", n=20)
        round_body(d, r, 0.018, _ORANGE, "90 85 0 100", n=16)
        for k in range(10):
            place = common.polar(r * (0.35, 0.68)[k % 2], 0.63 * k, 0.018)
            d.add(cylinder(r * 0.13, 0.005, place, segments=8), (_RED, _RED, _GREEN)[k % 3])
    elif style == 5:
        for k, look in enumerate((CRUST, brown, _ORANGE, _GREEN)):
            d.cylinder(r * (0.45 + 0.02 * k), 0.018, (0, 0.016 * k, 0), look)
        round_body(d, r * 0.47, 0.045, CRUST, "100 0 95 40 60 85 0 100", (0, 0.065, 0))
    for k in range(draw.count(4, 8) if style == 6 else 0):
        kind, wide, long = draw.one_of(((_ORANGE, 0.04, 0.16), (_RED, 0.07, 0.07), (_GREEN, 0.05, 0.17)))
        _blob(d, (wide, wide, long), (0.075 * (k % 4) - 0.11, wide / 2, 0.13 * (k // 4)), kind)
    return d


def barrel(draw: Draw) -> Design:
    """A wooden cask with hoops, upright or lying on a cradle, or a metal drum."""
    drum, d = any_made(draw, "barrel", "barrel", "metal drum")
    r, look = draw.between(0.2, 0.32), plain(draw.colour(0.9, 0.3), 0.3) if drum else draw.wooden()
    h, belly = r * draw.between(2.3, 3.0), 0 if drum else draw.count(12, 30)
    hoop, metal = (0.03, 0.33, 0.66, 0.93) if drum else (0.03, 0.2, 0.34, 0.63, 0.76, 0.93), draw.metal()
    wide = [100 + belly * np.sin(np.pi * y) for y in (0, 0.25, 0.5, 0.75, 1)]
    waist = " ".join(f"{x} {25 * k}" for k, x in enumerate(wide))
    round_body(d, r, h, look, f"0 3 92 3 92 0 {waist} 92 100 92 97 0 97", n=18)
    for y in hoop:
        low, high = (102 + belly * np.sin(np.pi * t) for t in (y, y + 0.04))
        edge = f"{low - 4} {100 * y} {low} {100 * y} {high} {100 * y + 4} {high - 4} {100 * y + 4}"
        round_body(d, r, h, look if drum else metal, edge, n=18)
    if not drum and draw.chance(0.35):
        d.parts = [(common.laid(part, (0, r * 1.35, -h / 2)), p) for part, p in d.parts]
        boxes(d, look, *((r * 1.9, r * 0.45, 0.06, 0, r * 0.225, z) for z in (-h * 0.3, h * 0.3)))
    return d


def high_chair(draw: Draw) -> Design:
    """A child's seat on tall splayed legs with a tray, a foot rest and a slatted, padded or moulded back."""
    d, style = Design("high chair", "high chair", ("baby chair", "chair")), draw.style(3)
    look, y, w = draw.body(), draw.between(0.5, 0.6), draw.between(0.17, 0.2)
    shell, frame = draw.one_of((look, WHITE, draw.painted())), look if style == 0 else draw.legs()
    for sx, sz in _CORNERS:
        d.tube(((sx * (w + 0.07), 0, sz * 0.25), (sx * w, y, sz * 0.12)), 0.016, frame)
    for x in common.spread(-w, w, 6 if style == 0 else 2):
        d.tube(((x, y, -0.14), (x, y + 0.42, -0.19)), 0.01, frame, 6)
    for x in (-w - 0.01, w + 0.01):
        boxes(d, shell, (0.03, 0.025, 0.34, x, y + 0.18, 0), (0.03, 0.18, 0.025, x, y + 0.09, 0.1))
    boxes(d, frame, (2 * w + 0.06, 0.02, 0.1, 0, 0.22, 0.22), (2 * w, 0.035, 0.3, 0, y, 0))
    _blob(d, (2 * w + 0.12, 0.035, 0.27), (0, y + 0.2, 0.25), WHITE if draw.chance(0.5) else shell, 5.0)
    pad = (look, draw.cloth(), shell)[style]
    _blob(d, (2 * w, 0.46 if style else 0.09, 0.06), (0, y + (0.22 if style else 0.42), -0.17), pad, 4.0)
    _blob(d, (2 * w - 0.02, 0.06, 0.28), (0, y + 0.03, 0.0), pad, 4.0)
    return d


def _keys(d: Design, w: float, y: float, z: float) -> None:
    """White keys with black ones in twos and threes."""
    boxes(d, WHITE, (w, 0.02, 0.15, 0, y, z))
    for k in range(49):
        if k % 7 not in (0, 3):
            boxes(d, BLACK, (w / 90, 0.016, 0.09, (k / 49 - 0.5) * w, y + 0.016, z - 0.03))


def _slab(outline: Sequence[tuple[float, float]], foot: float, thick: float) -> Triangles:
    """A board of any outline (x, z) that its middle sees."""
    low = np.array([(x, foot, z) for x, z in (*outline, outline[0])])
    under, high = np.broadcast_to(low[:-1].mean(0), low.shape), np.array([0, thick, 0])
    return solids.grid_triangles(np.stack([under, low, low + high, under + high]))


def piano(draw: Draw) -> Design:
    """An upright with keys and pedals, a grand with its lid up, a digital piano on a stand."""
    style, d = any_made(draw, "piano", "upright piano", "grand piano", "digital piano")
    look = draw.one_of((plain((0.03, 0.03, 0.035), 0.9), BLACK, WHITE, draw.wooden()))
    w, h, y, z = draw.between(1.35, 1.5), draw.between(1.05, 1.3), draw.between(0.68, 0.74), 0.13
    if style == 0:
        boxes(d, look, (w, h, 0.34, 0, h / 2, -0.13), (w + 0.03, 0.03, 0.4, 0, h, -0.12))
        for x in (-w * 0.47, w * 0.47):
            boxes(
                d,
                look,
                (w * 0.06, 0.13, 0.28, x, y + 0.02, 0.17),
                (0.07, y, 0.07, x * 0.95, y / 2 - 0.04, 0.26),
            )
    elif style == 1:
        z, curve = draw.between(0.65, 0.95), "-50 0 50 0 50 -40 27 -60 8 -85 -12 -98 -35 -100 -50 -92"
        rim = [
            (x, out + z)
            for x, out in (np.array(curve.split(), float).reshape(-1, 2) * [w / 100, z / 50]).tolist()
        ]
        d.add(_slab(rim, y - 0.04, 0.28), look)
        d.add(_slab([(x * 0.93, out * 0.93) for x, out in rim], y + 0.2, 0.045), GOLD)
        d.add(turned(_slab(rim, y + 0.25, 0.02), 2, draw.between(0.5, 0.7), (-w / 2, y + 0.25, 0)), look)
        d.tube(((w * 0.42, y + 0.2, z * 0.4), (w * 0.22, y + 0.68, z * 0.4)), 0.01, look, 6)
        for x, out in ((-0.42, 0.85), (0.42, 0.85), (-0.2, -0.8)):
            d.add(cylinder(0.035, y, (x * w, 0, out * z), 0.06, 8), look)
        boxes(d, look, (w * 0.5, 0.2, 0.015, 0, y + 0.34, z * 0.75), (0.16, y - 0.1, 0.04, 0, y / 2, z * 0.9))
    else:
        boxes(d, BLACK, (w * 0.4, 0.18, 0.01, 0, y + 0.12, 0.0), (w * 0.9, 0.2, 0.02, 0, y * 0.5, 0.05))
        for sx, sz in _CORNERS:
            d.tube(((sx * 0.6, 0.02, 0.1 + sz * 0.12), (sx * 0.5, y - 0.05, 0.1 + sz * 0.06)), 0.02, look, 6)
    boxes(d, look, (w, 0.08, 0.26, 0, y - 0.05, z + 0.05))
    _keys(d, w * 0.88, y, z + 0.09)
    boxes(d, GOLD, *((0.03, 0.015, 0.12, x, 0.06, z * 0.9 + 0.08) for x in (-0.07, 0, 0.07) if style < 2))
    return d
