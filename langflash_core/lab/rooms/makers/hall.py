"""Makers of what stands in halls, is worn and carried, and of people (see `makers.common`)."""

from collections.abc import Sequence

import numpy as np

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
    Triangles,
    Vector,
    box,
    grid_triangles,
    lathe,
    plain,
    polar,
    rounded,
    spread,
    turned,
)

_RED = plain((0.72, 0.06, 0.05), 0.6)
_BLUE = plain((0.35, 0.6, 0.88), 0.8, 0.5)
_ORANGE = (0.95, 0.45, 0.08)
_GOLD = plain((0.9, 0.72, 0.2), 0.7)
_SKINS = ((0.93, 0.76, 0.65), (0.87, 0.67, 0.53), (0.72, 0.5, 0.36), (0.5, 0.33, 0.22), (0.32, 0.2, 0.14))
_HAIRS = ((0.07, 0.05, 0.04), (0.2, 0.12, 0.07), (0.4, 0.25, 0.13), (0.8, 0.65, 0.38), (0.6, 0.59, 0.57))


def _blob(d: Design, size: Vector, centre: Vector, look: Look, square: float = 2, cells: int = 4) -> None:
    """A coarse ellipsoid, or a soft box."""
    d.add(rounded(size, centre, square, cells), look)


def _put(d: Design, triangles: Triangles, place: Vector, look: Look) -> None:
    """What is made about the origin, moved to its place."""
    d.add(triangles + np.array(place), look)


def _limb(points: Sequence[Vector], radii: Sequence[float], segments: int = 7) -> Triangles:
    """A round rod along a path, of one radius at each point."""
    path = np.array(points, dtype=float)
    along = np.gradient(path, axis=0)
    side = np.cross(along, (0.8, 0.1, 0.6))
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    other = np.cross(along, side)
    other /= np.linalg.norm(other, axis=1, keepdims=True)
    turn = np.linspace(0, 2 * np.pi, segments + 1)[:, None]
    ring = np.cos(turn) * side[:, None] + np.sin(turn) * other[:, None]
    return grid_triangles(path[:, None] + np.array(radii)[:, None, None] * ring)


def _arch(width: float, foot: float, height: float, z: float, turn: float = np.pi) -> list[Vector]:
    """Half an ellipse (or as much of it as asked) in a plane that faces front."""
    angles = spread(0, turn, 7 if turn < 4 else 19)
    return [(width / 2 * np.cos(t), foot + height * np.sin(t), z) for t in angles]


def _garment(draw: Draw, wide: float, long: float, thick: float) -> Triangles:
    """A coat, shirt or dress that hangs from its neck at the origin, flat to the front."""
    flare, sleeve, out = draw.between(0.4, 0.62), draw.one_of((0.0, 0.2, 0.5)), draw.between(0.5, 0.62) * wide
    profile = ((0.045, 0.02), (0.06, -0.01), (wide * 0.47, -0.07), (wide * 0.42, -long * 0.5))
    body = lathe((*profile, (wide * flare, -long)), (0, 0, 0), 8, thick)
    arm = ((wide * 0.36, -0.09, 0), (out, -0.12 - sleeve / 2, 0.01), (out, -0.15 - sleeve, 0.03))
    arms = [_limb([(s * x, y, z) for x, y, z in arm], (0.06, 0.06, 0.05), 5) for s in SIDES]
    return np.concatenate([body, *arms])


def hanging_clothes(draw: Draw) -> Design:
    """Clothes on a standing rack, along a rail at the wall, or on a row of hooks."""
    style, width, longest = draw.style(3), draw.between(0.7, 1.3), draw.between(0.8, 1.1)
    name, top = ("clothes rack", "hanging clothes", "coat rack")[style], (1.65, longest + 0.12)[style > 0]
    d = Design(name, "hanging clothes", ("clothes", "coats"), elevation=1.75 - top if style else 0.0)
    frame, hooks = draw.legs(), style == 2
    d.box((width, draw.between(0.02, 0.15), 0.025), (0, top, -0.06 if hooks else 0), frame)
    for x in (-width / 2, width / 2) if style == 0 else ():
        d.tube(((x, 0.05, 0), (x, top, 0)), 0.016, frame)
        d.box((0.035, 0.035, 0.45), (x, 0.05, 0), frame)
    if style < 2:
        d.box((width, 0.025, 0.34), (0, 0.12 if style == 0 else top + 0.09, -0.05), frame)
    for x in spread(0.1 - width / 2, width / 2 - 0.1, round(width / draw.between(0.09, 0.14) / (1 + hooks))):
        long, yaw = longest * draw.between(0.6, 1), draw.between(-0.2, 0.2) + (0 if hooks else QUARTER)
        shirt = _garment(draw, draw.between(0.3, 0.4) + 0.1 * (1 - hooks), long, 0.4 if hooks else 0.18)
        _put(d, turned(shirt, 1, yaw), (x, top - 0.05, 0.03 * hooks), draw.cloth())
        d.tube(((x, top, -0.05 * hooks), (x, top - 0.06, 0.03 * hooks)), 0.006, STEEL, 5)
    return d


def clothes(draw: Draw) -> Design:
    """A folded pile, a shirt that lies, a hat or cap, shoes or boots."""
    name = draw.one_of(("folded clothes", "shirt", "hat", "shoes", "boots"))
    d, look = Design(name, "clothes", ("clothing",)), draw.cloth()
    w, high, cap = draw.between(0.2, 0.3), draw.between(0.2, 0.4), draw.chance(0.4)
    for k in range(draw.count(2, 7) if name == "folded clothes" else 0):
        size = (w * draw.between(1, 1.2), 0.048, w * draw.between(0.85, 1))
        _blob(d, size, (draw.between(-0.015, 0.015), 0.042 * k, 0), draw.cloth(), 5, 6)
    if name == "shirt":
        shirt = _garment(draw, w + 0.2, w * 2.6, 0.09) + np.array((0, w * 1.3, 0.03))
        d.add(turned(turned(shirt, 0, -QUARTER), 1, draw.between(-0.5, 0.5)), look)
    elif name == "hat":
        brim = (0.092 if cap else w * 0.65, 0.004)
        d.lathe(((0.09, 0), brim, (0.09, 0.015), (0.083, high * 0.3), (0, high * 0.4)), look)
        d.lathe(((0.094, 0.01), (0.09, 0.035)), draw.cloth(), 16)
        _blob(d, (0.16, 0.02, 0.16), (0, 0.012, 0.09 if cap else 0), look)
    for x in (0.05 - w / 2, w / 2 - 0.05) if name in ("shoes", "boots") else ():
        _blob(d, (0.095, 0.03, w), (x, 0.015, 0), DARK if cap else WHITE, 3, 5)
        for wide, tall, long, z in ((0.09, 0.085, 0.65, 0.16), (0.08, 0.11, 0.48, -0.22)):
            _blob(d, (wide, tall, w * long), (x, tall * 0.54, w * z), look, 2.5, 5)
        _blob(d, (0.05, 0.03, w * 0.3), (x, 0.105, -w * 0.22), DARK)
        if name == "boots":
            d.cylinder(0.04, high - 0.05, (x, 0.05, -w * 0.2), look, 0.055)
    return d


def coat_hanger(draw: Draw) -> Design:
    """A coat stand with bent or straight arms, or one hanger."""
    alone, tall, thick = draw.chance(0.25), draw.between(1.6, 1.9), draw.between(0.014, 0.024)
    d, look = Design("coat stand", "coat hanger", ("coat rack",)), draw.legs()
    if alone:
        d.name, d.elevation, w, drop = "hanger", 1.5, tall * 0.12, draw.between(0.07, 0.12)
        for s in SIDES:
            d.add(_limb(((0, drop, 0), (s * w / 2, drop * 0.7, 0), (s * w, 0, 0.01)), (thick / 2,) * 3), look)
        d.tube(((-w, 0, 0.01), (w, 0, 0.01)), 0.004, look, 6)
        d.tube((*_arch(0.05, drop + 0.06, 0.025, 0)[::-1], (0, drop, 0)), 0.003, STEEL, 5)
        return d
    d.cylinder(thick, tall - 0.02, (0, 0.02, 0), look)
    d.cylinder(draw.between(0.1, 0.2), 0.03, (0, 0, 0), look)
    arms, reach, dip = draw.count(3, 5), draw.between(0.12, 0.18), draw.between(-0.06, 0.06)
    for k in range(2 * arms):
        a, y = np.pi * (2 * k + k // arms) / arms, tall - 0.14 - 0.35 * (k // arms)
        path = (polar(0, a, y), polar(reach * 0.6, a, y + dip), polar(reach, a, y + 0.1))
        d.tube(path, thick * 0.5, look, 6)
        _blob(d, (0.035, 0.035, 0.035), path[-1], look)
        d.tube((polar(0, a, 0.2), polar(0.25, a, 0.02)), thick * 0.8, look, 6)
    if draw.chance(0.3):
        coat = _garment(draw, draw.between(0.3, 0.38), tall * 0.5, 0.5)
        _put(d, coat, (0, tall - 0.12, 0.13), draw.cloth())
    return d


def fire_extinguisher(draw: Draw) -> Design:
    """A red bottle with a label, valve, levers and a hose with a nozzle or a horn."""
    d = Design("fire extinguisher", "fire extinguisher", ("extinguisher",))
    r, tall, label = draw.between(0.05, 0.095), draw.between(0.32, 0.56), draw.one_of((WHITE, STEEL, _GOLD))
    d.lathe(((0, 0), (r, 0), (r, tall * 0.85), (r * 0.75, tall * 0.96), (0.02, tall)), _RED, 16)
    d.lathe(((r * 0.98, 0), (r * 1.03, 0.03)), BLACK, 16)
    d.lathe(((r * 1.01, tall * 0.4), (r * 1.01, tall * draw.between(0.55, 0.75))), label, 16)
    d.cylinder(0.02, 0.06, (0, tall, 0), draw.one_of((STEEL, BLACK)))
    for rise, tilt in ((0.03, 0.0), (0.065, -0.35)):
        _put(d, turned(box((0.02, 0.012, 0.15), (0, 0, 0.05)), 0, tilt), (0, tall + rise, 0), BLACK)
    side, y = r + 0.025, tall + 0.03
    d.tube(((0, y, 0), (side * 0.7, y, 0), (side, y - 0.06, 0), (side, tall * 0.3, 0)), 0.011, BLACK, 6)
    d.cylinder(draw.between(0.014, 0.045), tall * 0.3, (side, tall * 0.1, 0), BLACK, 0.013)
    return d


def air_conditioner(draw: Draw) -> Design:
    """A long unit that hangs high on a wall, or a tower (`hang_height` takes no elevation below 2 cm)."""
    hung, body = draw.chance(0.75), draw.one_of((WHITE, WHITE, WHITE, BLACK, STEEL, draw.painted()))
    d = Design("air conditioner", "air conditioner", ("air conditioning",), elevation=2.05 if hung else 0.021)
    w, h, deep = draw.between(0.7, 1.1), draw.between(0.26, 0.34), draw.between(0.18, 0.25)
    w, h, deep = (w, h, deep) if hung else (w * 0.5, h * 5.8, deep * 1.5)
    _blob(d, (w, h, deep), (0, h / 2, 0), body, draw.between(6, 16), 8)
    if hung:
        d.box((w * 0.96, 0.004, 0.01), (0, h * 0.36, deep * 0.49), DARK)
        d.box((w * 0.86, h * 0.14, deep * 0.8), (0, h * 0.07, deep * 0.1), DARK)
        flap = turned(box((w * 0.84, 0.01, 0.08), (0, 0, 0)), 0, draw.between(0.1, 0.9))
        _put(d, flap, (0, h * 0.1, deep * 0.45), body)
    for k in range(0 if hung else 9):
        d.box((w * 0.8, 0.012, 0.02), (0, h * (0.92 - k * 0.035), deep / 2), DARK)
    d.box((0.06, 0.025, 0.02), (w * 0.3, h * 0.52, deep / 2), plain((0.3, 0.7, 0.5)))
    return d


def fan(draw: Draw) -> Design:
    """A round cage with blades on a tall or a short foot, or a tower."""
    style, look = draw.style(3), draw.one_of((WHITE, BLACK, STEEL, draw.painted()))
    d = Design(("standing fan", "table fan", "tower fan")[style], "fan", ("fan", "ventilator"))
    tall, r = draw.between(0.9, 1.25) * (1, 0.27, 0.85)[style], draw.between(0.13, 0.19) * (1.3, 1, 1)[style]
    d.lathe(((0, 0), (r * 0.9, 0), (r * 0.9, 0.025), (0.03, 0.05), (0, 0.06)), look)
    if style == 2:
        d.lathe(((r * 0.6, 0.03), (r * 0.5, tall - 0.03), (r * 0.4, tall), (0, tall)), look)
        for k in range(12):
            d.box((r * 0.8, 0.02, 0.02), (0, tall * (0.25 + 0.055 * k), r * 0.52), DARK)
        return d
    for radius, high in ((0.017, tall), (0.028, tall * 0.5)):
        d.cylinder(radius, high, (0, 0, -0.08), look)
    cage, blades, many = draw.one_of((WHITE, STEEL, BLACK)), draw.painted(), draw.count(3, 5)
    for share, z in ((1.0, 0.0), (0.9, 0.045), (0.9, -0.045), (0.5, 0.06)):
        d.tube(_arch(2 * r * share, tall, r * share, z, 2 * np.pi), 0.005, cage, 4)
    for k in range(32):
        x, _, y = polar(r, k * np.pi / 16, 0)
        d.tube(((0, tall, 0.12 * (k % 2) - 0.06), (x, tall + y, 0)), 0.002, cage, 3)
    for k in range(many):
        wing = turned(rounded((r * 0.75, r * 0.55, 0.012), (r * 0.48, 0, 0), 2.4, 5), 0, 0.5)
        _put(d, turned(wing, 2, 2 * np.pi * k / many), (0, tall, 0), blades)
    d.roll(r * 0.2, 0.02, (0, tall, 0.06), look)
    d.roll(0.05, 0.14, (0, tall, -0.17), look)
    return d


def ceiling_fan(draw: Draw) -> Design:
    """Blades around a motor on a rod, most with lamps below."""
    d, metal, look = Design("ceiling fan", "ceiling fan", ("fan",)), draw.metal(), draw.body()
    wide, drop, reach = draw.between(0.1, 0.16), draw.between(0.12, 0.4), draw.between(0.4, 0.65)
    many, lamps, low, shade = draw.count(3, 5), draw.count(0, 4), 0.1, plain((0.96, 0.94, 0.88), 0.5)
    d.lathe(((0, low), (0.08, low), (0.12, low + 0.04), (0.11, low + 0.1), (0.03, low + 0.14)), metal)
    d.cylinder(0.014, drop, (0, low + 0.13, 0), metal)
    d.cylinder(0.035, 0.05, (0, low + 0.11 + drop, 0), metal, 0.075)
    wing = turned(rounded((reach, 0.012, wide), (0.2 + reach / 2, 0, 0), draw.between(4, 12), 6), 0, 0.2)
    for k in range(many):
        for part, part_look in ((wing, look), (box((0.16, 0.012, 0.04), (0.17, 0, 0)), metal)):
            _put(d, turned(part, 1, 2 * np.pi * k / many + 0.3), (0, low + 0.05, 0), part_look)
    for k in range(max(lamps, 1)):
        size, reach = (0.11, 0.12) if lamps else (0.22, 0.0)
        _blob(d, (size, 0.13, size), polar(reach, k * 2 * np.pi / max(lamps, 1), low - 0.03), shade, cells=6)
    return d


def water_cooler(draw: Draw) -> Design:
    """A column with taps over a tray, most with a blue bottle on top, some short for a table."""
    d, short = Design("water cooler", "water cooler", ("water dispenser",)), draw.chance(0.15)
    w, tall = draw.between(0.27, 0.34), draw.between(0.9, 1.05) * (0.48 if short else 1)
    body = draw.one_of((WHITE, STEEL, draw.painted()))
    d.soft((w, tall, w), (0, tall / 2, 0), body, 16)
    d.box((w * 0.7, 0.24, 0.02), (0, tall - 0.2, w / 2 - 0.004), DARK)
    d.box((w * 0.62, 0.02, 0.12), (0, tall - 0.33, w / 2 + 0.03), DARK)
    for x, look in ((-0.22, plain((0.1, 0.3, 0.8), 0.4)), (0.22, _RED), (0.0, WHITE))[: draw.count(2, 3)]:
        d.box((0.03, 0.035, 0.06), (x * w, tall - 0.11, w / 2 + 0.03), look)
        d.cylinder(0.009, 0.04, (x * w, tall - 0.16, w / 2 + 0.045), STEEL)
    if short or draw.chance(0.8):
        r, h = w * 0.42, draw.between(0.32, 0.42)
        ribs = [(r * (1 if k % 2 else 0.94), tall + 0.07 + (h - 0.1) * k / 6) for k in range(7)]
        d.lathe(((0.04, tall), (0.05, tall + 0.02), *ribs, (r * 0.85, tall + h), (0, tall + h)), _BLUE, 16)
    return d


def ladder(draw: Draw) -> Design:
    """Steps between two pairs of legs, or rungs between two rails that lean on a wall."""
    opens, w, thick = draw.chance(0.55), draw.between(0.36, 0.5), draw.between(0.022, 0.035)
    tall = draw.between(0.8, 1.8) if opens else draw.between(1.6, 2.3)
    d = Design("step ladder" if opens else "ladder", "ladder", ("ladder", "stepladder"))
    look = draw.one_of((STEEL, draw.wooden(), draw.wooden(), draw.painted()))
    step, lean, many = look if draw.chance(0.6) else DARK, tall * draw.between(0.2, 0.28), round(tall / 0.28)
    top = 0.0 if opens else -lean / 2
    for x in (-w / 2, w / 2):
        d.tube(((x, 0, lean + top), (x * (0.8 if opens else 1), tall, top)), thick, look, 4)
        if opens:
            d.tube(((x, 0, -lean), (x * 0.8, tall - 0.03, -0.04)), thick * 0.7, look, 4)
            d.tube(((x * 0.9, tall * 0.5, lean * 0.5), (x * 0.9, tall * 0.5, -lean * 0.5)), 0.008, DARK, 5)
    for t in spread(1 / (many + 0.5), many / (many + 0.5), many):
        size = (w * (1 - 0.2 * t * opens), 0.025 if opens else 0.035, 0.09 if opens else 0.035)
        d.box(size, (0, tall * t, lean * (1 - t) + top), step)
    if opens:
        d.box((w * 0.88, 0.03, draw.between(0.14, 0.28)), (0, tall, 0), step)
    if opens and draw.chance(0.4):
        d.tube(_arch(w * 0.8, tall, draw.between(0.3, 0.5), 0.0), 0.014, look, 6)
    return d


def umbrella(draw: Draw) -> Design:
    """Closed and leaning, closed ones in a stand, or open on the floor."""
    style, tall, r = draw.style(3), draw.between(0.8, 0.95), draw.between(0.45, 0.6)
    d = Design(("umbrella", "umbrella stand", "open umbrella")[style], "umbrella", ("umbrella",))
    if style == 2:
        high, looks = draw.between(0.2, 0.3), (draw.cloth(), draw.cloth())
        dome = lathe(((r, 0), (r * 0.75, high * 0.6), (r * 0.4, high * 0.9), (0.001, high)), (0, 0, 0), 8)
        stick = _limb(((0, high + 0.06, 0), (0, -0.5, 0), (0.04, -0.56, 0), (0.08, -0.5, 0)), (0.008,) * 4)
        odd = np.arange(len(dome)) % 2 == 1  # every second panel
        for part, look in ((dome[odd], looks[0]), (dome[~odd], looks[draw.style(2)]), (stick, DARK)):
            _put(d, turned(part, 0, 2.0), (0, 0.5, -0.1), look)
        return d
    for k in range(draw.count(1, 3) if style else 1):
        folds = ((0.012, 0.02), (0.05, 0.3), (0.08, 0.6), (0.06, 0.75), (0.02, 0.8), (0.01, 1.0))
        canopy = lathe([(x * r, y * tall) for x, y in folds], (0, 0, 0), 8)
        grip = _limb([(x + 0.035, y, z) for x, y, z in _arch(0.07, tall, 0.04, 0)], (0.012,) * 7)
        for part, look in ((canopy, draw.cloth()), (grip, draw.body())):
            d.add(turned(turned(part, 2, 0.2 * k - 0.1), 0, 0.0 if style else -0.1), look)
    if style == 1:
        d.lathe(((0, 0.01), (0.1, 0), (draw.between(0.1, 0.13), r), (0.09, r * 0.9)), draw.legs(), 16)
    return d


def bag(draw: Draw) -> Design:
    """A handbag, backpack, shopping bag, sports bag or cloth bag."""
    name = draw.one_of(("handbag", "backpack", "shopping bag", "sports bag", "tote bag"))
    d, look, strap = Design(name, "bag", ("bag",)), draw.upholstery(), draw.upholstery()
    w, h, deep = draw.between(0.26, 0.4), draw.between(0.2, 0.3), draw.between(0.1, 0.17)
    share, rise, handles = 0.5, draw.between(0.35, 0.75), (-0.25, 0.25)
    if name == "sports bag":
        w, deep = w * 1.5, h * 1.1
        d.add(turned(rounded((h, h, w), (0, h / 2, 0), 4, 8), 1, QUARTER), look)
        for x in (-w * 0.28, w * 0.28):
            d.box((0.04, h * 1.01, h * 1.01), (x, h / 2, 0), strap)
    elif name == "shopping bag":
        h, strap = h * 1.4, draw.one_of((WHITE, BLACK))
        d.box((w, h, deep), (0, h / 2, 0), draw.painted())
        d.box((w * 0.94, 0.01, deep * 0.9), (0, h, 0), DARK)
        d.box((w * 0.5, h * 0.3, deep + 0.01), (0, h * 0.5, 0), look)
    else:
        h *= 1.0 if name == "handbag" else 1.45
        _blob(d, (w, h, deep), (0, h / 2, 0), look, draw.between(3.5, 8), 7)
    if name == "backpack":
        share, rise, handles = 0.3, 0.15, (-0.25,)
        _blob(d, (w * 0.8, h * 0.45, deep * 0.6), (0, h * 0.28, deep * 0.4), draw.one_of((look, strap)), 4, 6)
        _blob(d, (w * 0.95, h * 0.3, deep * 0.9), (0, h * 0.86, deep * 0.12), look, 4, 6)
        for x in (-w * 0.25, w * 0.25):
            sling = ((x, h * 0.9, -deep * 0.4), (x, h * 0.6, -deep * 0.8), (x, 0.05, -deep * 0.4))
            d.tube(sling, 0.014, strap, 5)
            d.box((0.02, h * 0.5, 0.01), (x, h * 0.55, deep * 0.7), strap)
    elif name == "handbag":
        d.box((w * 0.5, h * 0.4, deep + 0.02), (0, h * 0.7, 0), strap)
        d.box((0.03, 0.03, deep + 0.03), (0, h * 0.52, 0), STEEL)
    for z in handles:
        d.tube(_arch(w * share, h * 0.92, h * rise, z * deep), 0.008, strap, 5)
    return d


def suitcase(draw: Draw) -> Design:
    """A ribbed shell or a soft case on wheels with a handle, or a trunk with straps."""
    style, w, h, trim = draw.style(3), draw.between(0.36, 0.5), draw.between(0.5, 0.75), draw.metal()
    d, look = Design("suitcase", "suitcase", ("luggage",)), plain(draw.colour(0.8, 0.1), 0.4)
    deep, rise = w * draw.between(0.48, 0.6), h + draw.one_of((0.07, 0.4))
    if style == 2:
        d.name, w, h, deep, look = "trunk", w * 1.9, h * 0.6, w, draw.body()
        for x, wide, size in ((0, w, 1.0), *((w * x, 0.05, 1.04) for x in (-0.48, -0.2, 0.2, 0.48))):
            d.box((wide, h, deep * size), (x, h / 2, 0), look if x == 0 else trim)
            _blob(d, (wide, h * 0.3 * size, deep * size), (x, h, 0), look if x == 0 else trim, 5, 8)
        d.box((w * 0.1, h * 0.2, 0.03), (0, h * 0.85, deep / 2), STEEL)
        return d
    _blob(d, (w, h, deep), (0, h / 2 + 0.05, 0), look, draw.between(7, 14), 10)
    for x, z in ((-1, -1), (-1, 1), (1, -1), (1, 1)):
        _blob(d, (0.03, 0.055, 0.055), (x * w * 0.38, 0.028, z * deep * 0.35), BLACK, 2.5)
    for x in spread(-w * 0.36, w * 0.36, draw.count(4, 7)) if style == 0 else ():
        _blob(d, (0.02, h * 0.85, deep * 1.03), (x, h / 2 + 0.05, 0), look, 8)
    for y, tall in ((0.36, 0.5), (0.8, 0.25)) if style == 1 else ():
        _blob(d, (w * 0.85, h * tall, 0.06), (0, h * y, deep / 2), look, 7, 7)
    d.box((w * 1.005, h * 0.9, 0.012), (0, h / 2 + 0.05, 0), DARK)
    for x, top, z in ((w * 0.2, rise, -deep * 0.3), (0.06, h + 0.075, 0)):
        d.tube(((-x, h, z), (-x, top, z), (x, top, z), (x, h, z)), 0.01, trim, 6)
    return d


def room_divider(draw: Draw) -> Design:
    """A folding screen of cloth, paper under a lattice, boards or slats."""
    d, style = Design("folding screen", "room divider", ("screen", "partition")), draw.style(4)
    many, w, tall, frame = draw.count(3, 5), draw.between(0.38, 0.5), draw.between(1.6, 1.9), draw.body()
    fill, fold = (draw.cloth(), plain((0.93, 0.9, 0.82)), draw.body(), frame)[style], draw.between(0.3, 0.7)
    posts = spread(0.016 - w / 2, w / 2 - 0.016, 4 if style == 1 else 2)
    parts = [(box((0.028, tall, 0.025), (x, tall / 2, 0)), frame) for x in posts]
    for y in spread(0.1, tall - 0.02, draw.count(5, 9) if style == 1 else 2):
        parts.append((box((w, 0.028, 0.022), (0, y, 0)), frame))
    if style < 3:
        parts.append((box((w - 0.05, tall - 0.14, 0.008), (0, tall / 2 + 0.04, 0)), fill))
    for y in spread(0.16, tall - 0.08, 22) if style == 3 else ():
        parts.append((turned(box((w - 0.05, 0.06, 0.006), (0, y, 0)), 0, 0.6, (0, y, 0)), fill))
    for k in range(many):
        for part, look in parts:
            panel = turned(part, 1, fold if k % 2 else -fold)
            _put(d, panel, (k * w * np.cos(fold) - (many - 1) * w * np.cos(fold) / 2, 0, 0), look)
    return d


def _figure(d: Design, draw: Draw, u: float, sits: bool, female: bool, looks: Sequence[Look]) -> Vector:
    """A body of height u in skin, top, trousers and shoes; returns the middle of its head."""
    (skin, top, legs, shoes), bare = looks, draw.chance(0.5)
    hip, g = u * (0.27 if sits else 0.5), draw.between(0.9, 1.15) * u
    for s in SIDES:
        x, z = s * 0.063 * u, 0.23 * u if sits else draw.between(0.0, 0.04) * u
        leg = ((s * 0.048 * u, hip, 0), (x, 0.27 * u, z), (x, 0.04 * u, z - 0.02 * u))
        d.add(_limb(leg, (0.055 * g, 0.038 * g, 0.028 * g)), legs)
        _blob(d, (0.055 * u, 0.05 * u, 0.15 * u), (x, 0.025 * u, z + 0.01 * u), shoes, 2.6, 5)
        hand = (draw.between(0.12, 0.17), draw.between(0, 0.06), draw.between(0, 0.1))
        arm = ((0.105, 0.295, 0), (hand[0] + 0.02, 0.15, -0.02), (0.07, 0.05, 0.17) if sits else hand)
        path = [(s * x * u, hip + y * u, z * u) for x, y, z in arm]
        d.add(_limb(path[:2], (0.034 * g, 0.028 * u)), top)
        d.add(_limb(path[1:], (0.027 * u, 0.02 * u)), skin if bare else top)
        _blob(d, (0.042 * u, 0.06 * u, 0.05 * u), path[2], skin)
    waist, hips, chest = (0.07 * g, 0.1 * g, 0.1 * g) if female else (0.085 * g, 0.092 * g, 0.108 * g)
    trunk = ((0, -0.05), (hips, -0.02), (hips, 0.04))
    d.add(lathe([(r, hip + y * u) for r, y in trunk], (0, 0, 0), 12, 0.62), legs)
    trunk = ((hips, 0.04), (waist, 0.13), (chest, 0.23), (0.1 * g, 0.3), (0.04 * g, 0.335))
    d.add(lathe([(r, hip + y * u) for r, y in trunk], (0, 0, 0), 12, 0.62), top)
    d.cylinder(0.028 * u, 0.07 * u, (0, hip + 0.32 * u, 0), skin)
    return 0.0, hip + 0.425 * u, 0.008 * u


def mannequin(draw: Draw) -> Design:
    """A dress form on a stand, or a whole figure on a plate."""
    whole, look = draw.chance(0.35), draw.one_of((plain((0.9, 0.86, 0.78)), WHITE, BLACK, draw.cloth()))
    d, dressed = Design("mannequin", "mannequin", ("tailor's dummy",)), draw.one_of((look, draw.cloth()))
    w, foot, u, stand = draw.between(0.15, 0.19), draw.between(0.7, 0.85), draw.between(1, 1.1), draw.legs()
    if whole:
        head = _figure(d, draw, 1.7 * u, False, draw.chance(0.6), (look, dressed, look, look))
        _blob(d, (0.15, 0.23, 0.19), head, look, 2, 7)
        d.cylinder(0.2, 0.015, (0, 0, 0), stand)
        return d
    d.name = "dress form"
    bust = ((0.9, 0), (1.05, 0.12), (0.72, 0.3), (1, 0.47), (0.95, 0.6), (0.4, 0.66), (0.33, 0.73), (0, 0.74))
    d.add(lathe([(w * r, foot + u * y) for r, y in bust], (0, 0, 0), 16, 0.68), dressed)
    d.lathe(((w * 0.3, foot + u * 0.72), (w * 0.34, foot + u * 0.74), (0, foot + u * 0.78)), stand, 12)
    d.cylinder(0.018, foot, (0, 0.03, 0), stand)
    for k in range(3):
        d.tube((polar(0.0, 2.1 * k + 0.5, 0.22), polar(0.28, 2.1 * k + 0.5, 0.015)), 0.015, stand)
    if draw.chance(0.3):
        d.lathe(((w * 0.75, foot + 0.3 * u), (w * 1.3, foot), (w * 2, 0.3)), draw.cloth(), 14)
    return d


def person(draw: Draw) -> Design:
    """A man, woman or child, who stands or sits on a block, in clothes of any colour."""
    kind, sits, female, top = draw.style(3), draw.chance(0.35), draw.chance(0.5), draw.cloth()
    d, female = Design(("man", "woman", "child")[kind], "person", ("person",)), (False, True, female)[kind]
    tall = (draw.between(1.68, 1.88), draw.between(1.55, 1.75), draw.between(0.95, 1.4))[kind]
    skin, hair, legs = plain(draw.one_of(_SKINS), 0.1), plain(draw.one_of(_HAIRS), 0.2), draw.cloth()
    looks = (skin, top, legs, draw.one_of((BLACK, WHITE, draw.painted())))
    x, y, z = _figure(d, draw, tall, sits, female, looks)
    r, long = 0.08 * tall + 0.088, draw.between(1.0, 2.2) if female else 0.8
    _blob(d, (r * 0.72, r, r * 0.85), (x, y, z), skin, 2.2, 6)
    _blob(d, (r * 0.8, r * 0.75, r * 0.9), (x, y + r * 0.2, z - r * 0.09), hair, 2.2, 6)
    _blob(d, (r * 0.82, r * long, r * 0.4), (x, y - r * (long * 0.5 - 0.4), z - r * 0.3), hair, 2.4, 5)
    _blob(d, (r * 0.12, r * 0.2, r * 0.2), (x, y - r * 0.08, z + r * 0.42), skin)
    for s in SIDES:
        _blob(d, (0.02, 0.016, 0.02), (s * r * 0.15, y, z + r * 0.39), BLACK, cells=3)
    if female and not sits and draw.chance(0.5):
        skirt = ((0.075, 0.62), (0.11, 0.5), (0.14, draw.between(0.08, 0.3)))
        d.lathe([(tall * r, tall * y) for r, y in skirt], draw.one_of((top, legs)), 14, 0.8)
    if sits:
        d.soft((tall * 0.25, tall * 0.22, tall * 0.22), (0, tall * 0.11, -tall * 0.02), draw.body(), 10)
    return d


def christmas_tree(draw: Draw) -> Design:
    """Boughs of needles or smooth cones over a pot, with balls, a star and a garland."""
    d, bushy = Design("christmas tree", "christmas tree", ("fir tree",)), draw.chance(0.7)
    tall, shape, levels = draw.between(0.5, 2.2), draw.between(0.24, 0.36), 9 if bushy else 5
    green = plain((draw.between(0.03, 0.15), draw.between(0.22, 0.42), draw.between(0.08, 0.2)))
    base, r, size = tall * 0.14, tall * shape, 0.012 * tall + 0.035
    d.cylinder(r * 0.35, base * 0.75, (0, 0, 0), draw.one_of((draw.ceramic(), draw.wooden(), _RED)), r * 0.45)
    d.lathe(((r * 0.07, base * 0.7), (r * 0.07, base), (r / 2, base), (0.005, tall)), green)
    for level in range(levels):
        y, reach = base + (tall - base) * level / levels * 0.95, r * (1.02 - level / levels)
        if not bushy:
            d.lathe(((reach * 0.3, y + 0.02 * tall), (reach, y), (reach * 0.15, y + 0.24 * tall)), green, 14)
        for k in range(15 - level if bushy else 0):
            a, tip = 2 * np.pi * (k + draw.between(0, 0.5)) / (15 - level), tall * draw.between(-0.01, 0.03)
            bough = (polar(reach * 0.1, a, y + tall * 0.07), polar(reach, a, y + tip))
            d.add(_limb(bough, (tall * 0.028, tall * 0.006), 4), green)
    looks = [plain(draw.colour(0.9, 0.6), 0.8) for _ in range(draw.count(1, 3))]
    for k in range(draw.count(12, 26)):
        place = polar(r * (1.0 - k / 28), 2.4 * k, base + (tall - base) * k / 28)
        _blob(d, (size, size, size), place, draw.one_of(looks))
    for k in range(5):
        ray = lathe(((size * 0.5, 0), (0.001, size * 1.3)), (0, size * 0.3, 0), 4, 0.5)
        _put(d, turned(ray, 2, 2 * np.pi * k / 5), (0, tall, 0), _GOLD)
    if draw.chance(0.5):
        turn = [polar(r * (1.0 - k / 44), k * 0.7, base + (tall - base) * k / 48) for k in range(44)]
        d.tube(turn, 0.012, draw.one_of((_GOLD, STEEL, _RED)), 4)
    return d


def gift(draw: Draw) -> Design:
    """One to three wrapped boxes or drums, one on the other, with ribbons and a bow."""
    d, top, ribbon = Design("gift", "gift", ("present", "gift box")), 0.0, plain(draw.colour(0.95, 0.6), 0.5)
    w, drum, size, loops = draw.between(0.14, 0.36), draw.chance(0.25), 0.07, draw.one_of((2, 4, 5))
    for _ in range(draw.one_of((1, 1, 1, 2, 3))):
        h, deep, look = w * draw.between(0.3, 0.8), w * (1 if drum else draw.between(0.6, 1)), draw.cloth()
        if drum:
            d.cylinder(w / 2, h, (0, top, 0), look)
        else:
            d.box((w, h, deep), (0, top + h / 2, 0), look)
        for x, z in ((0.025, deep * 1.02), (w * 1.02, 0.025)):
            d.box((x, h * 1.02, z), (0, top + h / 2, 0), ribbon)
        top, w = top + h, w * draw.between(0.6, 0.85)
    for k in range(loops):
        loop = turned(rounded((size, size * 0.4, size * 0.5), (size * 0.5, 0, 0), 2, 5), 2, 0.5)
        _put(d, turned(loop, 1, 2 * np.pi * k / loops), (0, top + 0.005, 0), ribbon)
    return d


def safe(draw: Draw) -> Design:
    """A strong box with a dial or keys on its door, or lockers side by side."""
    locker, look = draw.chance(0.35), plain(draw.colour(draw.one_of((0.1, 0.6)), 0.15, 0.75), 0.4)
    d, many = Design("locker" if locker else "safe", "safe", ("strongbox", "locker")), draw.count(1, 4)
    w, h, deep = draw.between(0.35, 0.65), draw.between(0.3, 0.9), draw.between(0.35, 0.5)
    w, h, many = (w * 0.65, draw.between(1.7, 1.95), many) if locker else (w, h, 1)
    d.box((w * many, h, deep), (0, h / 2, 0), look)
    for x in spread(-w * (many - 1) / 2, w * (many - 1) / 2, many):
        d.box((w - 0.03, h - 0.03, 0.01), (x, h / 2, deep / 2), DARK)
        d.box((w - 0.05, h - 0.05, 0.03), (x, h / 2, deep / 2), look)
        d.box((0.02, 0.1, 0.03), (x + w * 0.35, h / 2, deep / 2 + 0.02), STEEL)
        for y in (*spread(h - 0.14, h - 0.26, 5), *spread(h * 0.15, h * 0.22, 5)) if locker else ():
            d.box((w * 0.5, 0.01, 0.02), (x, y, deep / 2 + 0.007), DARK)
    y, z, dial = h * 0.6, deep / 2 + 0.015, draw.chance(0.5)
    for k in range(0 if locker or dial else 12):
        d.box((0.03, 0.025, 0.02), (0.04 * (k % 3 - 1) - w * 0.12, y + 0.033 * (k // 3 - 1.5), z), BLACK)
    if dial and not locker:
        d.roll(0.05, 0.035, (-w * 0.12, y, z), STEEL)
        d.roll(0.025, 0.055, (-w * 0.12, y, z), BLACK)
    for k in range(0 if locker else draw.one_of((1, 3, 5))):
        arm = turned(box((0.1, 0.018, 0.018), (0.05, 0, 0.03)), 2, 2 * np.pi * k / 5 - QUARTER)
        _put(d, arm, (w * 0.2, h * 0.45, z), STEEL)
    return d


def aquarium(draw: Draw) -> Design:
    """A tank or a bowl of water over gravel with plants and fish, some on a cupboard."""
    d, globe, edge = Design("aquarium", "aquarium", ("fish tank",)), draw.chance(0.2), draw.painted()
    w, h, foot = draw.between(0.4, 1.1), draw.between(0.28, 0.5), draw.between(0.5, 0.8) * draw.style(2)
    w, h, foot, lid = (h * 0.7, h * 0.7, 0.0, 0.0) if globe else (w, h, foot, draw.between(0.06, 0.2))
    deep = h * 0.9
    glass, gravel = plain((0.6, 0.82, 0.85), 0.9, draw.between(0.25, 0.4)), plain(draw.colour(0.4, 0.4, 0.9))
    if globe:
        bowl = ((0.25, 0), (0.45, 0.25), (0.5, 0.5), (0.42, 0.8), (0.34, 0.92))
        d.lathe([(h * r, h * y) for r, y in bowl], glass)
        d.lathe(((0, 0.01), (h * 0.26, 0.01), (h * 0.38, h * 0.18), (0, h * 0.2)), gravel)
        d.lathe(((0, h * 0.75), (h * 0.42, h * 0.75)), _BLUE)
    else:
        d.box((w, h, deep), (0, foot + h / 2, 0), glass)
        for tall, y, look in ((0.1, 0.07, gravel), (0.01, 0.88, _BLUE), (0.06, 0.03, edge), (lid, 1, edge)):
            share = 1.01 if look is edge else 0.98
            d.box((w * share, h * tall, deep * share), (0, foot + h * y, 0), look)
    if foot:
        d.box((w * 1.05, foot, deep * 1.1), (0, foot / 2, 0), draw.body())
    for k in range(draw.count(8, 16)):
        x, z, size = draw.between(-0.3, 0.3) * w, draw.between(-0.3, 0.3) * deep, draw.between(0.04, 0.08)
        y, look = foot + h * draw.between(0.3, 0.75), plain(draw.one_of((_ORANGE, draw.colour(0.95, 0.6))))
        if k % 2:
            stem = ((x, foot + h * 0.1, z), (x + 0.02, y - h * 0.1, z), (x - 0.01, y + h * 0.1, z))
            d.add(_limb(stem, (0.008, 0.014, 0.002), 4), plain((0.1, draw.between(0.3, 0.55), 0.12)))
            continue
        tail = lathe(((0.03 * size, -0.3 * size), (0.3 * size, -0.75 * size)), (0, 0, 0), 4, 0.2)
        fish = np.concatenate([rounded((size * 0.5, size, size * 0.25), (0, 0, 0), 2, 4), tail])
        _put(d, turned(turned(fish, 2, QUARTER), 1, draw.between(-4, 4)), (x, y, z), look)
    return d
