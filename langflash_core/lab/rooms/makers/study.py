"""Makers of what lies on desks, hangs in offices and runs on current (see `makers.common`).

Metres, y up, front +z. Flat things are built upright, facing the front, then leant back or laid down.
"""

from collections.abc import Sequence

import numpy as np

from langflash_core.lab.rooms.builtin import KIND_ART
from langflash_core.lab.rooms.makers.kit import (
    BLACK,
    DARK,
    QUARTER,
    SIDES,
    STEEL,
    WHITE,
    Design,
    Draw,
    Look,
    Material,
    Triangles,
    Vector,
    box,
    boxes,
    cylinder,
    grid_triangles,
    plain,
    rounded,
    shifted,
    turned,
)

_RED, _GREEN, _BLUE = (plain(c, 0.4) for c in ((0.75, 0.08, 0.08), (0.08, 0.42, 0.18), (0.1, 0.22, 0.55)))
_PAPER, _INK, _LIT = (plain(c) for c in ((0.92, 0.92, 0.88), (0.1, 0.1, 0.14), (0.55, 0.68, 0.62)))
_GLASS, _YELLOW = plain((0.02, 0.02, 0.03), 0.9), plain((0.9, 0.72, 0.1), 0.4)
_PICTURE = Material((0.85, 0.85, 0.85), gloss=0.2), KIND_ART
_ONES = (1.0,) * 10
_KEY_ROWS = ((1.3, 1.3, 1.3, 6.2, 1.3, 1.3, 2.3), (2.3, *_ONES, 2.7), (1.8, *_ONES, 1, 2.2))
_KEY_ROWS += ((1.5, *_ONES, 1, 1, 1.5), (*_ONES, 1, 1, 1, 2), (*_ONES, 1, 1, 1, 1, 1))


def _case(draw: Draw) -> Look:
    return draw.one_of((BLACK, DARK, WHITE, STEEL, _vivid(draw)))


def _vivid(draw: Draw) -> Look:
    return plain(draw.colour(0.9), 0.35)


def _prism(outline: Sequence[tuple[float, float]], thick: float) -> Triangles:
    """An outline (x, y), visible as a whole from its mean point, made thick along z."""
    ring = np.array([*outline, outline[0]])
    middle = ring * 0 + np.mean(outline, axis=0)
    sheets = ((middle, -0.5), (ring, -0.5), (ring, 0.5), (middle, 0.5))
    return grid_triangles(np.stack([np.insert(xy, 2, s * thick, 1) for xy, s in sheets]))


def _outline(width: float, height: float, corner: float) -> list[tuple[float, float]]:
    """A rectangle with round corners."""
    turn = np.arange(16) // 4 * QUARTER + np.arange(16) % 4 * QUARTER / 3
    signs = np.repeat([[1, 1], [-1, 1], [-1, -1], [1, -1]], 4, 0)
    shift = signs * [width / 2 - corner, height / 2 - corner]
    corners = shift + corner * np.stack([np.cos(turn), np.sin(turn)], 1)
    return [(x, y) for x, y in corners.tolist()]


def _slab(d: Design, look: Look, size: Vector, corner: float, at: Vector = (0, 0, 0)) -> None:
    _put(d, look, _prism(_outline(size[0], size[1], corner), size[2]), at)


def _ring(d: Design, look: Look, size: Vector, thick: float, at: Vector) -> None:
    """A closed loop of wire that faces the front: width, height, radius of the corners."""
    points = _outline(*size)
    d.tube([(x + at[0], y + at[1], at[2]) for x, y in (*points, points[0])], thick, look, 5)


def _put(d: Design, look: Look, triangles: Triangles, place: Vector, *turns: tuple[int, float]) -> None:
    """Adds triangles after turns (axis, angle) about their origin."""
    for axis, angle in turns:
        triangles = turned(triangles, axis, angle)
    d.add(shifted(triangles, place), look)


def _across(d: Design, look: Look, radius: float, length: float, at: Vector, top: float = 0.0) -> None:
    """A cylinder along x; `top` is its radius on the left."""
    _put(d, look, cylinder(radius, length, (0, -length / 2, 0), top or radius, 12), at, (2, QUARTER))


def _leaf(d: Design, look: Look, size: Vector, hinge: Vector, angle: float) -> None:
    """A board upon its lower edge, leant back; at minus a quarter it lies forwards."""
    _put(d, look, box(size, (0, size[1] / 2, 0)), hinge, (0, -angle))


def _buttons(d: Design, look: Look, at: Vector, nx: int, ny: int, pitch: float, high: float = 0.7) -> None:
    for k in range(nx * ny):
        x, y = k % nx - (nx - 1) / 2, k // nx - (ny - 1) / 2
        d.box((pitch * 0.7, pitch * high, 0.004), (at[0] + x * pitch, at[1] + y * pitch, at[2]), look)


def _turn(d: Design, axis: int = 0, angle: float = -QUARTER, foot: float = 0.0) -> Design:
    """Turns all that there is, unless told else on its back; its lowest point goes to the height `foot`."""
    parts = [(turned(triangles, axis, angle), look) for triangles, look in d.parts]
    low = min(float(triangles[..., 1].min()) for triangles, _ in parts)
    d.parts[:] = [(shifted(triangles, (0, foot - low, 0)), look) for triangles, look in parts]
    return d


def keyboard(draw: Draw) -> Design:
    """Flat to high keys, with or without a number pad, some with keys of two colours."""
    d = Design("keyboard", "keyboard", ("computer keyboard",))
    key, rows, pad = draw.between(0.0165, 0.0195), draw.count(5, 6), draw.one_of((0.0, 4.4, 4.4))
    case, caps, accent, mixed = _case(draw), _case(draw), _vivid(draw), draw.chance(0.35)
    caps = draw.one_of((BLACK, WHITE)) if caps is case and case is not BLACK else caps
    width, gap, rim = (15 + pad) * key, draw.between(0.1, 0.25), draw.between(0.012, 0.05)
    thick, high = draw.between(0.007, 0.022), draw.between(0.006, 0.016)
    _slab(d, case, (width + 0.014, rows * key + rim, thick), draw.between(0.003, 0.012), (0, rim * 0.2, 0))
    for row, run in enumerate(_KEY_ROWS[:rows]):
        x, y = -width / 2, (row + 0.5 - rows / 2) * key
        for wide in (*run, *((0.4, 1, 1, 1, 1) if pad else ())):
            size, look = ((wide - gap) * key, (1 - gap) * key, high), accent if mixed and wide > 1 else caps
            if wide >= 1:
                d.box(size, (x + wide * key / 2, y, thick / 2), WHITE if look is case else look)
            x += wide * key
    return _turn(d, 0, draw.between(0.02, 0.1) - QUARTER)


def phone(draw: Draw) -> Design:
    """Mobile phones, cordless ones in a cradle, desk phones with a handset."""
    style, look = draw.style(3), _case(draw)
    d = Design(("mobile phone", "cordless phone", "telephone")[style], "phone", ("telephone",))
    w, h, t = ((0.072, 0.15, 0.009), (0.052, 0.16, 0.026), (0.2, 0.21, 0.035))[style]
    w, h = w * draw.between(0.9, 1.1), h * draw.between(0.9, 1.1)
    keys = DARK if look in (WHITE, STEEL) else WHITE
    _slab(d, look, (w, h, t), draw.between(0.005, 0.02))
    if style == 0:
        _slab(d, draw.one_of((_GLASS, _BLUE, _PICTURE)), (w * 0.93, h * 0.94, 0.002), 0.006, (0, 0, 0.0045))
        return _turn(d)
    right, z = (w * 0.16 if style == 2 else 0.0), t / 2 + 0.001
    d.box((w * 0.6, h * 0.2, 0.004), (right, h * 0.3, z), _LIT)
    _buttons(d, keys, (right, -h * 0.13, z), 3, 4, 0.0125 if style == 1 else 0.0215)
    for y, wide, long in ((0, 0.036, h), (-0.36, 0.055, 0.06), (0.36, 0.055, 0.06)) if style == 2 else ():
        end = rounded((wide, long, 0.045), (-w * 0.34, y * h, 0.03 if y else 0.05), 4.0, 5)
        d.add(end, look)
    curl = [(0.008 * np.cos(k) - w * 0.55, h * (k - 15) / 40, 0.008 * np.sin(k)) for k in range(26)]
    d.tube(curl if style == 2 else [(0, 0, 0), (0, 0, -0.02)], 0.003, BLACK, 4)
    angle = draw.between(0.9, 1.3) if style == 2 else draw.between(0.15, 0.5)
    _turn(d, 0, -angle, 0.015 * (2 - style))
    tall = h * np.cos(angle) if style == 2 else 0.05
    d.add(rounded((max(w * 0.8, 0.08), tall, 0.09), (0, tall / 2, 0.04 - 0.04 * style), 6.0, 5), look)
    return d


def printer(draw: Draw) -> Design:
    """A desk inkjet with paper behind, a laser printer, a copier on the floor."""
    style, look, second = draw.style(3), draw.one_of((WHITE, _PAPER, DARK)), draw.one_of((DARK, BLACK, STEEL))
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
        boxes(d, _PAPER, (0.3, 0.03, 0.22, w * 0.12, h + 0.015, 0.05))
        _leaf(d, second, (w * 0.45, 0.26, 0.012), (w * 0.1, h + 0.4, depth * 0.1), 1.1)
        _leaf(d, second, (w * 0.6, 0.16, 0.03), (0, h + 0.28, z), -0.9)
        _leaf(d, _BLUE, (w * 0.25, 0.1, 0.03), (0, h + 0.3, z + 0.01), -0.9)
        return d
    d.soft((w, h, depth), (0, h / 2, 0), look, 14)
    boxes(d, BLACK, (w * 0.62, h * 0.25, 0.02, 0, h * 0.3, z), (w * 0.96, 0.006, 0.02, 0, h * 0.46, z))
    _leaf(d, second, (w * 0.55, 0.13, 0.008), (0, h * 0.16, z - 0.01), -1.45)
    _leaf(d, second, (w * 0.6, 0.16 - 0.1 * style, 0.008), (0, h * 0.97, z * (style - 0.8)), 0.35)
    sheet = (0.21, 0.24 - 0.05 * style, 0.01)
    _leaf(d, _PAPER, sheet, (0, h * 0.98, z * (style * 1.2 - 0.75)), 0.35 + style * 1.2)
    boxes(d, _PAPER, (0.21, 0.006, 0.12, 0, h * 0.25, z + 0.04))
    _leaf(d, _GLASS if style else _LIT, (w * 0.3, 0.06, 0.01), (-w * 0.1, h * 0.72, z), 0.5)
    _buttons(d, _GREEN if draw.chance(0.4) else STEEL, (w * 0.25, h * 0.8, z), 3, 2, 0.016)
    return d


def tablet(draw: Draw) -> Design:
    """Tablets and electronic readers, lying or on a stand."""
    reader, stands, look = draw.chance(0.3), draw.chance(0.55), draw.legs()
    d = Design("e-reader" if reader else "tablet", "tablet", ("tablet computer",))
    w, h = (0.12, 0.17) if reader else draw.one_of(((0.16, 0.24), (0.2, 0.27), (0.25, 0.17), (0.28, 0.2)))
    rim, screen = draw.between(0.006, 0.02), draw.one_of((_GLASS, _BLUE, _BLUE, _PICTURE, _PAPER))
    _slab(d, _case(draw), (w, h, 0.009), draw.between(0.005, 0.014))
    _slab(d, draw.one_of((WHITE, BLACK)), (w - 0.005, h - 0.005, 0.002), 0.005, (0, 0, 0.0045))
    d.box((w - 2 * rim, h - 2.5 * rim, 0.002), (0, 0, 0.0055), _PAPER if reader else screen)
    if reader:
        lines = ((w * draw.between(0.5, 0.68), 0.003, 0.001, 0, h * k * 0.08, 0.0068) for k in range(-4, 5))
        boxes(d, _INK, *lines)
    elif screen is _BLUE:
        _buttons(d, _vivid(draw), (0, 0.01, 0.006), 5, 3, 0.026)
    angle = draw.between(0.25, 0.7) if stands else QUARTER
    near = h / 2 * np.sin(angle)
    _turn(d, 0, -angle, 0.02 if stands else 0)
    if stands:
        boxes(d, look, (w * 0.6, 0.012, near * 2 + 0.06, 0, 0.006, 0))
        boxes(d, look, (w * 0.6, 0.035, 0.01, 0, 0.018, near + 0.02))
        _leaf(d, look, (w * 0.3, h * 0.7, 0.008), (0, 0.01, near - 0.02), angle)
    return d


def headphones(draw: Draw) -> Design:
    """Over the ears: a slim or padded band, lying or on a stand."""
    d = Design("headphones", "headphones", ("headset",))
    r, cup, thick = 0.08, draw.between(0.032, 0.046), draw.between(0.005, 0.012)
    look, pad = _case(draw), _case(draw)
    arc = [(r * np.cos(t), r * 1.15 * np.sin(t), 0.0) for t in np.linspace(0, np.pi, 13)]
    d.tube(arc, thick * 0.6, draw.metal(), 6)
    d.tube(arc[2:-2], thick, look, 6)
    for radius, x, part in ((cup, 0.012, look), (cup * 0.93, -0.008, pad), (cup * 0.6, 0.02, pad)):
        for side in SIDES:
            _across(d, part, radius, 0.022, (side * (r + x), -0.01, 0))
    if draw.chance(0.5):
        return _turn(d)
    foot, wood = draw.between(0.03, 0.1), draw.legs()
    top = foot + r * 1.15 + cup
    _turn(d, 0, 0.0, foot)
    d.cylinder(0.008, top, (0, 0, 0), wood)
    d.cylinder(draw.between(0.06, 0.08), 0.012, (0, 0, 0), wood)
    _across(d, wood, 0.016, 0.07, (0, top - 0.015, 0))
    return d


def game_controller(draw: Draw) -> Design:
    """A gamepad with grips or a flat old one, alone or before its console."""
    flat, console, look, body = draw.chance(0.3), draw.chance(0.45), _case(draw), _case(draw)
    d = Design("game console" if console else "gamepad", "game controller", ("video game",))
    if flat:
        _slab(d, look, (0.13, 0.058, 0.016), draw.between(0.003, 0.025))
    for side in SIDES if not flat else ():
        d.add(rounded((0.1, 0.075, 0.042), (side * 0.022, 0.015, 0), 3.5, 6), look)
        grip = rounded((0.042, 0.1, 0.04), (0, 0, 0), 3.0, 6)
        _put(d, look, grip, (side * 0.062, -0.025, 0), (2, side * 0.35))
        d.roll(0.011, 0.016, (side * 0.028, -0.006, 0.016), BLACK if look is not BLACK else DARK, 10)
    z, keys = 0.01 if flat else 0.021, DARK if look is not DARK else STEEL
    boxes(d, keys, (0.024, 0.008, 0.008, -0.045, 0.018, z), (0.008, 0.024, 0.008, -0.045, 0.018, z))
    for k, colour in enumerate((_RED, _GREEN, _BLUE, _YELLOW)[: 2 if flat else 4]):
        x, y = 0.012 * float(np.cos(k * QUARTER)), 0.012 * float(np.sin(k * QUARTER))
        d.roll(0.006, 0.006, (0.045 + x, 0.018 + y, z - 0.001), colour, 8)
    _turn(d, 0, -1.45)
    w, h, t = draw.one_of(((0.29, 0.06, 0.25), (0.08, 0.36, 0.25), (0.16, 0.3, 0.16), (0.24, 0.08, 0.2)))
    if console:
        _slab(d, body, (w, h, t), 0.012, (0, h / 2, -t / 2 - 0.09))
        boxes(d, DARK if body is BLACK else BLACK, (w * 0.9, 0.008, t, 0, h * 0.55, -t / 2 - 0.088))
        d.box((0.012, 0.006, 0.004), (w * 0.3, h * 0.75, -0.089), _BLUE)
    return d


def remote_control(draw: Draw) -> Design:
    """Long ones full of buttons to small ones with a ring."""
    d = Design("remote control", "remote control", ("remote", "tv remote"))
    w, h, ring = draw.between(0.036, 0.055), draw.between(0.13, 0.22), draw.chance(0.6)
    look = draw.one_of((BLACK, BLACK, DARK, WHITE, STEEL))
    keys, z = DARK if look in (WHITE, STEEL) else draw.one_of((WHITE, STEEL)), 0.009
    _slab(d, look, (w, h, 0.017), draw.between(0.003, 0.017))
    d.roll(0.004, 0.004, (-w * 0.28, h * 0.43, z - 0.001), _RED, 8)
    for k, part in enumerate((keys, look)) if ring else ():
        d.roll(w * (0.36 - k * 0.16), 0.004 + k * 0.001, (0, h * 0.2, z - 0.002), part, 12)
    rows = min(draw.count(3, 9), int(h * (0.42 if ring else 0.7) / w / 0.28))
    _buttons(d, keys, (0, -h * 0.2 if ring else -h * 0.03, z), 3, rows, w * 0.28)
    for k, colour in enumerate((_RED, _GREEN, _YELLOW, _BLUE)):
        d.box((w * 0.14, 0.005, 0.004), (w * (k - 1.5) * 0.22, -h * 0.46, z), colour)
    return _turn(d)


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
        boxes(d, _GLASS, (w * 0.35, h * 0.25, 0.004, w * 0.05, h * 0.75, z))
        boxes(d, _GLASS, (w * 0.3, h * 0.12, 0.006, -w * 0.3, h * 0.5, z))
        boxes(d, _LIT, (w * 0.2, h * 0.1, 0.004, w * 0.05, h * 0.75, z + 0.002))
        _buttons(d, trim, (w * 0.35, h * 0.4, z), 4, 1 + (style > 0), w * 0.05, 0.4)
    for x, r in ((-0.15, 0.15), (0.0, 0.1), (0.36, 0.22)) if style in (1, 2) else ():
        d.roll(h * r, 0.02, (w * x, h * 0.4, z), trim, 12)
    for side in SIDES if style in (2, 4) else ():
        r, x = (0.07, side * (w / 2 + 0.1)) if style == 2 else (h * 0.33, side * w * 0.25)
        size = (0.17, h * 1.35, depth) if style == 2 else (w * 0.4, h * 0.7, 0.004)
        d.box(size, (x, h * (0.68 if style == 2 else 0.42), z * (style / 2 - 1)), DARK)
        d.roll(r, 0.006, (x, h * 0.42, z), STEEL, 14)
        d.roll(r * 0.85, 0.008, (x, h * 0.42, z), BLACK, 14)
    if style == 4:
        boxes(d, _PAPER, (w * 0.6, h * 0.14, 0.006, 0, h * 0.95, z))
        boxes(d, _RED, (0.003, h * 0.13, 0.008, w * draw.between(-0.2, 0.2), h * 0.95, z))
        handle = ((-0.42, 1), (-0.4, 1.25), (0.4, 1.25), (0.42, 1))
        d.tube([(w * x, h * y, 0) for x, y in handle], 0.006, trim, 5)
        d.tube(((w * 0.4, h, -z), (w * 0.4 + draw.between(-0.2, 0.2), h + 0.25, -z)), 0.002, STEEL, 4)
    disc = ((0.155, STEEL), (0.15, BLACK), (0.05, _vivid(draw)))
    for k, (r, part) in enumerate(disc if style == 3 else ()):
        d.cylinder(r, 0.012 - 0.003 * k, (-w * 0.08, h + 0.01 + 0.006 * k, 0.01), part)
    if style == 3:
        arm = ((0.4, 0.04, -0.7), (0.38, 0.04, 0), (0.2, 0.025, 0.4))
        d.tube([(w * x, h + y, z * t) for x, y, t in arm], 0.004, STEEL, 5)
        d.cylinder(0.022, 0.035, (w * 0.4, h, -z * 0.7), STEEL)
    if style == 3 and draw.chance(0.5):
        lid = plain((0.6, 0.65, 0.7), 0.9, 0.35)
        _leaf(d, lid, (w, depth, 0.01), (0, h + 0.02, -z), draw.between(0.1, 0.4))
    return d


def camera(draw: Draw) -> Design:
    """Photo cameras with a short or long lens, flat ones and camcorders, some on a tripod."""
    style, look = draw.style(3), draw.one_of((BLACK, BLACK, DARK, _vivid(draw)))
    d = Design(("camera", "compact camera", "camcorder")[style], "camera", ("photo camera",))
    w, h, t = ((0.135, 0.09, 0.045), (0.1, 0.06, 0.025), (0.06, 0.07, 0.14))[style]
    r, long = ((draw.between(0.03, 0.038), draw.between(0.03, 0.12)), (0.02, 0.02), (0.025, 0.04))[style]
    _slab(d, look, (w, h * 0.8, t), 0.01, (0, h * 0.4, 0))
    upper = draw.one_of((BLACK, STEEL)) if style < 2 else look
    _slab(d, upper, (w * 0.98, h * 0.25, t * 0.95), 0.008, (0, h * 0.87, 0))
    for k, (share, part) in enumerate(((1.0, BLACK), (1.05, STEEL), (0.95, BLACK), (0.75, _GLASS))):
        d.roll(r * share, long * (0.4 if k < 3 else 0.02), (0, h * 0.45, t / 2 + long * 0.33 * k), part, 14)
    d.box((w * 0.25, h * 0.3, t * 0.6), ((style > 0) * w * 0.25, h * (0.8 if style else 1.1), t * 0.22), look)
    d.cylinder(0.008, 0.008, (-w * 0.37, h, 0), STEEL)
    if style == 2:
        _put(d, _GLASS, box((0.003, 0.06, 0.09), (0, 0, -0.045)), (w / 2, h * 0.5, 0.05), (1, -0.9))
    if draw.chance(0.35):
        high, metal = draw.between(0.9, 1.4), draw.metal()
        _turn(d, 0, 0.0, high)
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
    look = draw.one_of((WHITE, WHITE, _PAPER, DARK, STEEL))
    r, x, y, z = h * draw.between(0.28, 0.4), w * draw.one_of((-0.26, 0, 0.24)), h / 2 + 0.015, depth / 2
    trim = STEEL if look is DARK else DARK
    _slab(d, look, (w, h, depth), draw.between(0.008, h * 0.3), (0, y, 0))
    for share, near, part in ((1.0, 0.02, trim), (0.85, 0.035, BLACK), (0.65, 0.038, _BLUE)):
        d.roll(r * share, near, (x, y, z), part, 16)
    left = -w * 0.28 if x >= 0 else w * 0.28
    slits = [(w * 0.3, h * 0.035, 0.006, left, y + h * k * 0.09, z) for k in range(-3, 4)]
    boxes(d, BLACK, *slits, *((0.006, h * 0.5, 0.008, -w / 2, y, z * k * 0.2) for k in range(-3, 4)))
    spots = ((0, 1), (1, 0), (-1, 0), (0, -1))
    boxes(d, trim, *((0.012, 0.006, 0.012, -x + k * 0.02, h + 0.016, -z * 0.5 + m * 0.02) for k, m in spots))
    boxes(d, BLACK, *((0.025, 0.016, depth * 0.8, side * w * 0.38, 0.008, 0) for side in SIDES))
    return d


def whiteboard(draw: Draw) -> Design:
    """White and chalk boards, hung or on wheels, and flip charts; written on, with pens or chalk."""
    style = draw.one_of((0, 0, 1, 2, 3))
    d = Design(("whiteboard", "whiteboard", "flip chart", "chalkboard")[style], "whiteboard", ("board",))
    w, h = (0.7, 1.0) if style == 2 else (draw.between(0.7, 1.9), draw.between(0.6, 1.1))
    frame = draw.wooden() if style == 3 else STEEL
    d.box((w, h, 0.02), (0, 0, 0), draw.one_of((_GREEN, DARK)) if style == 3 else WHITE)
    boxes(d, frame, *((w + 0.03, 0.025, 0.03, 0, s * h / 2, 0) for s in SIDES))
    boxes(d, frame, (w * 0.6, 0.012, 0.07, 0, -h / 2, 0.04))
    boxes(d, frame, *((0.025, h, 0.03, s * w / 2, 0, 0) for s in SIDES))
    inks = (_PAPER,) if style == 3 else (_INK, _BLUE, _RED, _GREEN)
    for k in range(draw.count(3, 12)):
        x, y, ink = w * (0.05 - 0.5 * (k % 2) + 0.02), h * (0.38 - 0.13 * (k // 2)), draw.one_of(inks)
        for start in np.arange(x, x + w * draw.between(0.1, 0.4), 0.14):
            d.tube([(start + m * 0.02, y + draw.between(0, 0.045), 0.011) for m in range(7)], 0.004, ink, 3)
    boxes(d, draw.one_of(inks), *((0.13, 0.016, 0.016, x * w, -h / 2 + 0.014, 0.05) for x in (-0.2, 0.0)))
    d.box((0.12, 0.035, 0.045), (w * 0.2, -h / 2 + 0.02, 0.045), DARK)
    if style in (0, 3):
        d.elevation = draw.between(0.8, 1.0)
        return d
    _turn(d, 0, 0.12 - 0.12 * style, draw.between(0.75, 0.9))
    for x in (-w / 2, w / 2):
        d.tube(((x * 0.9, 1.2, -0.03), (x, 0.06 * (2 - style), 0.1 * (style - 1))), 0.016, STEEL, 6)
        if style == 1:
            d.box((0.04, 0.03, 0.5), (x, 0.065, 0), STEEL)
            _across(d, BLACK, 0.035, 0.025, (x, 0.035, 0.22))
            _across(d, BLACK, 0.035, 0.025, (x, 0.035, -0.22))
    bar = ((0, 1.5, -0.12), (0, 0, -0.55)) if style == 2 else ((-w / 2, 0.3, 0), (w / 2, 0.3, 0))
    d.tube(bar, 0.016, STEEL, 6)
    return d


def calendar(draw: Draw) -> Design:
    """A picture above the days of a month, three months below each other, or a tent on the desk."""
    style, head, mark = draw.style(3), _vivid(draw), draw.one_of((_INK, DARK))
    d = Design("desk calendar" if style == 2 else "calendar", "calendar", ("month",))
    w, h = (0.2, 0.16) if style == 2 else (draw.between(0.25, 0.42), draw.between(0.42, 0.65))
    d.box((w, h, 0.006), (0, 0, 0), _PAPER)
    if style < 2:
        d.box((w * 0.94, h * (0.44 - 0.26 * style), 0.002), (0, h * (0.26 + 0.12 * style), 0.003), _PICTURE)
    months = (((-0.48, 0.45),), ((-0.48, 0.23), (-0.21, 0.23), (0.05, 0.23)), ((-0.48, 0.93),))
    for low, tall in months[style]:
        d.box((w * 0.9, h * tall * 0.13, 0.002), (0, h * (low + tall * 0.92), 0.003), head)
        for k in range(35):
            x, y = w * (k % 7 - 3) * 0.13, h * (low + tall * (0.1 + (k // 7) * 0.155))
            d.box((w * 0.06, h * tall * 0.08, 0.002), (x, y, 0.003), _RED if k % 7 == 6 else mark)
    boxes(d, draw.metal(), *((w * 0.03, 0.012, 0.014, w * k * 0.08, h / 2, 0) for k in range(-5, 6)))
    d.elevation = 0.0 if style == 2 else 1.55 - h / 2
    if style == 2:
        _turn(d, 0, -0.35)
        _leaf(d, head, (w, h, 0.004), (0, 0, -0.085), -0.3)
    return d


def newspaper(draw: Draw) -> Design:
    """One or a stack: head lines, columns of print and a photograph."""
    many, grey = draw.one_of((1, 1, draw.count(4, 10))), plain((0.88, 0.87, 0.83))
    d = Design("newspapers" if many > 1 else "newspaper", "newspaper", ("paper",))
    w, h, thick = draw.between(0.26, 0.36), draw.between(0.2, 0.4), draw.between(0.006, 0.014)
    for k in range(many):
        sheaf = box((w, h, thick * 0.9), (0, 0, (k - many + 0.5) * thick))
        d.add(turned(sheaf, 2, draw.between(-0.1, 0.1) * (k < many - 1)), grey)
    boxes(d, _INK, (w * 0.8, h * 0.09, 0.001, 0, h * 0.41, 0), (w * 0.94, 0.003, 0.001, 0, h * 0.34, 0))
    columns, side = draw.count(3, 5), draw.one_of(SIDES)
    d.box((w * 0.45, h * 0.33, 0.001), (side * w * 0.23, h * 0.14, 0), _PICTURE)
    boxes(d, _INK, *((w * 0.42, h * 0.05, 0.001, -side * w * 0.23, h * y, 0) for y in (0.27, 0.17, 0.07)))
    for k in range(columns * 9):
        x, y = w * 0.94 * ((k % columns + 0.5) / columns - 0.5), -h * (0.08 + 0.045 * (k // columns))
        d.box((w * 0.8 / columns, h * 0.018, 0.001), (x, y, 0), DARK)
    return _turn(d)


def _pen(d: Design, draw: Draw, place: Vector, *turns: tuple[int, float]) -> None:
    radius, long = draw.between(0.0035, 0.006), draw.between(0.12, 0.17)
    _put(d, _vivid(draw), cylinder(radius, long, (0, 0, 0), None, 6), place, *turns)
    _put(d, draw.one_of((BLACK, _PAPER)), cylinder(radius, 0.02, (0, long, 0), 0.001, 6), place, *turns)


def stationery(draw: Draw) -> Design:
    """Pens in a holder, scissors, a stapler, a notebook with a pen, sheaves of paper, ring binders."""
    style, look, z = draw.style(6), _vivid(draw), draw.between(0.01, 0.03)
    names = ("pen holder", "scissors", "stapler", "notebook", "paper stack", "ring binder")
    d = Design(names[style], "stationery", ("office supplies",))
    if style == 0:
        cup = ((0.04, 0), (0.042, 0.1), (0.038, 0.1), (0.036, 0.01), (0, 0.01))
        d.lathe(cup, draw.legs(), draw.one_of((4, 14)))
        for k in range(draw.count(4, 8)):
            _pen(d, draw, (0, 0.012, 0), (2, draw.between(0.05, 0.2)), (1, 2.4 * k))
    for side in SIDES if style == 1 else ():
        blade = _prism(((-0.008, -0.03), (0.008, -0.03), (0.003, 0.11), (0, 0.115)), 0.002)
        d.add(turned(blade, 2, -side * 0.2), STEEL)
        _ring(d, look, (0.045, 0.065, 0.02), 0.006, (side * 0.028, -0.06, 0))
    parts = ((0.04, 0.008, 0.15, 0.004, 0), (0.03, 0.018, 0.15, 0.035, 0.15), (0.022, 0.01, 0.14, 0.022, 0.1))
    for k, (wide, high, long, y, angle) in enumerate(parts) if style == 2 else ():
        bar = rounded((wide, high, long), (0, 0, 0), 7.0, 6)
        _put(d, STEEL if k == 2 else look, bar, (0, y, 0), (0, angle))
    if style == 3:
        w, h = draw.one_of(((0.15, 0.21), (0.21, 0.29), (0.1, 0.15)))
        boxes(d, look, (w, 0.003, h, 0, 0.001, 0), (w, 0.003, h, 0, z, 0))
        boxes(d, _PAPER, (w * 0.97, z, h * 0.97, 0, z / 2, 0))
        boxes(d, STEEL, *((0.016, z + 0.008, 0.004, -w / 2, z / 2, h * k * 0.06) for k in range(-7, 8)))
        _pen(d, draw, (0.02, z + 0.006, 0.07), (0, -QUARTER), (1, draw.between(-0.5, 0.5)))
    for k in range(draw.count(4, 10) if style == 4 else 0):
        sheet = box((0.21, 0.009, 0.297), (0, 0.005 + k * 0.009, 0))
        d.add(turned(sheet, 1, draw.between(-0.08, 0.08)), _PAPER)
    for k in range(draw.count(1, 4) if style == 5 else 0):
        cover, x = _vivid(draw), k * 0.075
        boxes(d, cover, (0.07, 0.32, 0.003, x, 0.16, 0.14))
        boxes(d, cover, *((0.003, 0.32, 0.28, x + s * 0.034, 0.16, 0) for s in SIDES))
        boxes(d, _PAPER, (0.06, 0.29, 0.25, x, 0.155, 0), (0.05, 0.13, 0.002, x, 0.2, 0.142))
        d.roll(0.013, 0.002, (x, 0.07, 0.141), BLACK, 10)
    return _turn(d) if style == 1 else d


def flashlight(draw: Draw) -> Design:
    """A lying torch, or a lantern with a handle."""
    d, lantern = Design("flashlight", "flashlight", ("torch",)), draw.chance(0.35)
    look = draw.one_of((BLACK, BLACK, STEEL, _vivid(draw)))
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
        _put(d, (look, look, BLACK, _PAPER)[k], piece, (0, foot, z), (0, QUARTER))
        z += length
    d.box((0.012, 0.02, 0.025), (0, grip, 0.01), draw.one_of((_RED, DARK)))
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
        bow, place = _prism(_outline(0.024, 0.022, 0.008), 0.004), (x, 0, 0.008 + 0.001 * k)
        teeth = [box((0.006, 0.004, 0.0024), (0.005, -0.044 - 0.006 * m, 0)) for m in range(draw.count(2, 4))]
        shaft = np.concatenate([box((0.006, 0.04, 0.0025), (0, -0.048, 0)), *teeth])
        _put(d, draw.one_of((metal, _vivid(draw))), (bow - [0, 0.022, 0]) * size, place, (2, angle))
        _put(d, metal, shaft * size, place, (2, angle))
        if board:
            d.tube(((x, 0.02, -0.015), (x, -0.012, 0.0), (x, -0.014, 0.02), (x, 0, 0.022)), 0.0025, STEEL, 5)
    if board:
        _slab(d, draw.body(), (w, 0.1, 0.018), 0.01, (0, 0.03, -0.02))
        return d
    _ring(d, STEEL, (0.036, 0.036, 0.018), 0.0018, (0, 0, 0.008))
    tag = _prism(_outline(0.035, 0.05, 0.012), 0.006)
    _put(d, _vivid(draw), tag, (0, 0.04, 0.008), (2, draw.between(-0.6, 0.6)))
    return _turn(d)


def glasses(draw: Draw) -> Design:
    """Spectacles and sunglasses, round to square, their arms open or folded."""
    dark, folded, w = draw.chance(0.4), draw.chance(0.4), draw.between(0.046, 0.056)
    d = Design("sunglasses" if dark else "glasses", "glasses", ("eyeglasses", "spectacles"))
    thick, h = draw.between(0.0012, 0.0032), w * draw.between(0.65, 1)
    look = draw.one_of((BLACK, draw.metal(), _vivid(draw)))
    lens = plain((0.04, 0.04, 0.05), 0.9, 0.9) if dark else plain((0.8, 0.87, 0.9), 0.9, 0.25)
    corner, y = h * draw.between(0.2, 0.5), h * 0.72
    for side in SIDES:
        x, centre = side * (w + 0.012), (side * (w / 2 + 0.009), h / 2, 0)
        _ring(d, look, (w, h, corner), thick, centre)
        _slab(d, lens, (w, h, 0.001), corner, centre)
        ends = [(-x * 0.7, y, -0.015 - 0.004 * side)] if folded else [(x, y, -0.1), (x, 0, -0.14)]
        d.tube([(x, y, 0), (x, y, -0.01), *ends], max(thick, 0.0018), look, 5)
    d.tube(((-0.01, h * 0.6, 0), (0, y, 0.003), (0.01, h * 0.6, 0)), thick, look, 5)
    return d


def watch(draw: Draw) -> Design:
    """Round or square, with hands or a screen, its strap open or closed."""
    smart, closed, r = draw.chance(0.3), draw.chance(0.5), draw.between(0.016, 0.023)
    d = Design("smart watch" if smart else "wristwatch", "watch", ("watch",))
    strap, rim = _case(draw), draw.one_of((STEEL, BLACK, plain((0.8, 0.65, 0.3), 0.7)))
    face, corner = draw.one_of((WHITE, BLACK, _BLUE)), r * 0.5 if smart else r
    _slab(d, rim, (2 * r, 2 * r, 0.009), corner)
    _slab(d, _GLASS if smart else face, (1.72 * r, 1.72 * r, 0.009), corner * 0.86, (0, 0, 0.0045))
    for long in (0.5, 0.75) if not smart else ():
        hand = box((0.002, r * long, 0.001), (0, r * long / 2, 0.0095))
        _put(d, BLACK if face is WHITE else WHITE, hand, (0, 0, 0), (2, draw.between(0, 6)))
    _across(d, rim, 0.003, 0.005, (r + 0.002, 0, 0))
    for k in range(-7, 8) if closed else ():
        _put(d, strap, box((r * 1.05, 0.014, 0.003), (0, 0, 0.03)), (0, 0, -0.032), (0, k * 0.42))
    if closed:
        return _turn(d, 2, QUARTER)
    boxes(d, strap, *((r * 1.05, 0.085, 0.0025, 0, side * 0.055, -0.003) for side in SIDES))
    _ring(d, rim, (r * 1.2, 0.014, 0.003), 0.0012, (0, 0.1, -0.003))
    return _turn(d)


def switch(draw: Draw) -> Design:
    """One to three rockers or levers on a plate, or a turning knob."""
    d = Design("light switch", "switch", ("wall switch",), elevation=1.1)
    many, style = draw.one_of((1, 1, 2, 3)), draw.style(3)
    look, lever = draw.one_of((WHITE, WHITE, _PAPER, DARK, STEEL)), style == 1
    pitch = draw.between(0.04, 0.071)
    key = BLACK if look is STEEL and draw.chance(0.5) else look
    wide = 0.014 if lever else min(pitch * 0.93, 0.058)
    _slab(d, look, (pitch * (many - 1) + 0.08, 0.118 if lever else 0.082, 0.009), draw.between(0.003, 0.012))
    for k in range(many):
        x, tilt = (k - (many - 1) / 2) * pitch, draw.one_of(SIDES)
        _slab(d, DARK, (wide + 0.003, 0.028 if lever else 0.06, 0.002), 0.002, (x, 0, 0.005))
        if style == 2 and many == 1:
            d.roll(0.02, 0.018, (x, 0, 0.004), key, 14)
        else:
            rocker = box((0.009, 0.02, 0.024) if lever else (wide, 0.056, 0.008), (0, 0, 0))
            _put(d, key, rocker, (x, 0, 0.008), (0, tilt * (0.45 if lever else 0.09)))
    return d


def socket(draw: Draw) -> Design:
    """One to three round wells in frames, or plates with slots, some with a plug in."""
    d = Design("wall socket", "socket", ("power outlet", "electrical outlet"), elevation=0.25)
    style = draw.style(3)
    look = draw.one_of((WHITE, WHITE, _PAPER, DARK, STEEL))
    many = 2 if style == 1 else draw.one_of((1, 1, 2, 3))
    hole, pitch = _GLASS if look is DARK else DARK, 0.042 if style == 1 else 0.071
    width = 0.118 if style == 1 else 0.083 + pitch * (many - 1)
    _slab(d, look, (width, 0.072 if style == 1 else 0.083, 0.009), draw.between(0.003, 0.012))
    pins = ((-0.0095, 0, 0.006, 0.006), (0.0095, 0, 0.006, 0.006), (0, 0.018, 0.007, 0.007))
    slots = ((0.003, -0.007, 0.01, 0.003), (0.003, 0.007, 0.01, 0.003), (-0.009, 0, 0.005, 0.005))
    bars = ((-0.011, -0.008, 0.008, 0.004), (0.011, -0.008, 0.008, 0.004), (0, 0.01, 0.005, 0.01))
    for k in range(many):
        x = (k - (many - 1) / 2) * pitch
        well = ((0.027, 0.007, look), (0.0225, 0.0075, hole), (0.02, 0.008, look))
        for r, long, part in well if style == 0 else ():
            d.roll(r, long, (x, 0, 0.002), part, 14)
        _slab(d, look, (0.03, 0.034, 0.004), 0.008, (x, 0, 0.004))
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
            field = _prism(bent, 0.002)
            _put(d, ((BLACK, pale), (_RED, _GREEN))[ring % 2][k % 2], field, (0, 0, 0), (2, k * np.pi / 10))
        mark = box((0.012, 0.016, 0.002), (0, r * 1.12, 0.001))
        d.add(turned(mark, 2, k * np.pi / 10), WHITE)
    d.roll(r * 0.09, 0.003, (0, 0, 0), _GREEN, 12)
    d.roll(r * 0.04, 0.004, (0, 0, 0), _RED, 12)
    for _ in range(draw.one_of((0, 3, 3))):
        x, y = draw.between(-0.1, 0.1), draw.between(-0.1, 0.1)
        d.tube(((x, y, 0), (x, y - 0.01, 0.08), (x, y - 0.02, 0.14)), 0.003, STEEL, 5)
        flights = ((0.035, 0.002), (0.002, 0.035))
        boxes(d, _vivid(draw), *((u, v, 0.035, x, y - 0.02, 0.13) for u, v in flights))
    wood, cabinet = draw.body(), draw.chance(0.3)
    for side in SIDES if cabinet else ():
        d.box((0.26, 0.56, 0.02), (side * 0.13, 0, -0.05), wood)
        door = box((0.27, 0.56, 0.02), (side * 0.135, 0, 0))
        _put(d, wood, door, (side * 0.26, 0, -0.03), (1, -side * 0.35))
    return d


def tool(draw: Draw) -> Design:
    """A hammer, screwdrivers, a hand saw, a cordless drill, a tool box."""
    style, look = draw.style(5), draw.one_of((_RED, _BLUE, _GREEN, _YELLOW, _vivid(draw)))
    d = Design(("hammer", "screwdriver", "saw", "drill", "toolbox")[style], "tool", ("tool",))
    grip, long = draw.one_of((draw.wooden(), look)), draw.between(0.24, 0.36)
    if style == 0:
        d.cylinder(0.015, long, (0, 0, 0), grip, 0.01)
        _across(d, STEEL, 0.016, 0.045, (0.04, long, 0))
        _across(d, STEEL, 0.011, 0.05, (0, long, 0))
        claw = ((-0.02, 0.013), (-0.06, 0.006), (-0.09, -0.022), (-0.06, -0.006), (-0.02, -0.013))
        _put(d, STEEL, _prism(claw, 0.024), (0, long, 0))
    for k in range(draw.count(1, 4) if style == 1 else 0):
        colour, s = _vivid(draw), draw.between(0.8, 1.2)
        d.cylinder(0.015 * s, 0.1 * s, (k * 0.045, 0, 0), colour, 0.013 * s)
        d.cylinder(0.013 * s, 0.02, (k * 0.045, 0.1 * s, 0), colour, 0.005)
        d.cylinder(0.0035, long * 0.4, (k * 0.045, 0.11 * s, 0), STEEL)
    if style == 2:
        teeth = [(long * 0.04 * k, -0.05 - 0.006 * (k % 2)) for k in range(41)]
        d.add(_prism((*teeth, (long * 1.6, 0.0), (0, 0.05)), 0.002), STEEL)
        _ring(d, grip, (0.09, 0.11, 0.03), 0.014, (-0.045, 0, 0))
    if style < 3:
        return _turn(d)
    if style == 3:
        _across(d, look, 0.033, 0.14, (0, 0.2, 0))
        front = ((0.03, 0.05, 0.095, 0.032), (0.012, 0.045, 0.14, 0.022), (0.004, 0.1, 0.2, 0.004))
        for r, length, x, top in front:
            _across(d, STEEL if r < 0.01 else BLACK, r, length, (x, 0.2, 0), top)
        _put(d, BLACK, rounded((0.042, 0.15, 0.036), (0, 0, 0), 5.0, 6), (-0.035, 0.11, 0), (2, -0.15))
        boxes(d, look, (0.12, 0.03, 0.075, -0.035, 0.045, 0))
        boxes(d, BLACK, (0.11, 0.03, 0.07, -0.03, 0.015, 0), (0.015, 0.03, 0.02, 0.0, 0.155, 0))
        return d
    w, h, lid = long * 1.5, long * 0.5, draw.one_of((look, BLACK))
    d.box((w, h, 0.2), (0, h / 2, 0), look)
    profile = ((-0.104, 0), (0.104, 0), (0.104, 0.03), (0.05, 0.075), (-0.05, 0.075), (-0.104, 0.03))
    _put(d, lid, _prism(profile, w * 1.02), (0, h, 0), (1, QUARTER))
    handle = ((-0.09, 0.07), (-0.08, 0.11), (0.08, 0.11), (0.09, 0.07))
    d.tube([(x, h + y, 0) for x, y in handle], 0.011, BLACK, 6)
    boxes(d, draw.metal(), *((0.035, 0.06, 0.012, side * w * 0.3, h, 0.105) for side in SIDES))
    return d
