"""Makers of sofas and armchairs (see `makers.common`).

Metres, y up, front +z.
"""

import numpy as np

from langflash_core.lab.rooms.makers.furniture import plain_armchair, plain_sofa
from langflash_core.lab.rooms.makers.kit import (
    DARK,
    QUARTER,
    SIDES,
    STEEL,
    WHITE,
    Design,
    Draw,
    Look,
    Vector,
    across,
    ball,
    cylinder,
    four_legs,
    grid_triangles,
    lathe,
    loft,
    merge,
    mixed,
    pad,
    plain,
    polar,
    rounded,
    shifted,
    slab,
    spread,
    turned,
    vivid,
    woven,
)


def sofa(draw: Draw) -> Design:
    """Mostly plain; else corner sofas, chesterfields, chaises, frames with cushions, wicker."""
    if draw.chance(0.69):
        return plain_sofa(draw)
    many = (_corner_sofa, _corner_sofa, _chesterfield, _chesterfield, _wooden_sofa, _wooden_sofa, _love_seat)
    return draw.one_of((*many, _chaise, _futon, _sectional, _wicker_sofa))(draw)


def _throws(d: Design, draw: Draw, wide: float, seat: float, z: float, most: int = 3) -> None:
    """Loose cushions against the back."""
    for _ in range(draw.count(0, most)):
        side = draw.between(0.34, 0.48)
        cushion = turned(rounded((side, side, 0.15), (0, 0, 0), 3.0, 8), 0, -draw.between(0.2, 0.5))
        cushion = turned(cushion, 1, draw.between(-0.3, 0.3))
        d.add(shifted(cushion, (draw.between(-0.4, 0.4) * wide, seat + side * 0.42, z)), draw.cloth())


def _block_seat(d: Design, size: Vector, at: tuple[float, float], seat: float, look: Look, many: int) -> None:
    """A base with so many cushions along x: size is (width, foot, depth), `at` its middle (x, z)."""
    (wide, foot, deep), (x, z) = size, at
    d.box((wide, seat - 0.15 - foot, deep), (x, (seat - 0.15 + foot) / 2, z), look)
    for k in range(many):
        middle = x - wide / 2 + (k + 0.5) * wide / many
        pad(d, (wide / many - 0.008, 0.17, deep), (middle, seat - 0.075, z), look, 0.05)


def _corner_sofa(draw: Draw) -> Design:
    d = Design("corner sofa", "sofa", ("sectional sofa", "couch"))
    look, seats = draw.upholstery(), draw.count(2, 3)
    each, deep, seat = draw.between(0.6, 0.75), draw.between(0.88, 1.0), draw.between(0.4, 0.46)
    wide, reach, total = seats * each + 0.95, draw.between(1.5, 2.1), draw.between(0.72, 0.9)
    hand, foot, arm = draw.one_of(SIDES), draw.between(0.04, 0.14), draw.between(0.12, 0.24)
    back = 0.22
    left = wide - 0.95
    _block_seat(d, (left, foot, deep), (-hand * 0.475, 0), seat, look, seats)
    _block_seat(d, (0.95, foot, reach), (hand * (wide - 0.95) / 2, (reach - deep) / 2), seat, look, 1)
    rear = -deep / 2 + back / 2
    place = (-hand * arm / 2, (total - 0.06 + foot) / 2, rear - 0.05)
    pad(d, (wide + arm, total - foot, back * 0.8), place, look, 0.06)
    for k in range(seats + 1):
        w = each if k < seats else 0.85
        middle = -wide / 2 + (k + 0.5) * each if k < seats else wide / 2 - 0.45
        part = Design("", "")
        place = (hand * middle, (total + seat) / 2, rear + 0.14)
        pad(part, (w * 0.97, total - seat + 0.04, 0.2), place, look, 0.07)
        merge(d, part, lambda t: turned(t, 0, -0.12, (0, seat, rear)))
    size = (arm, draw.between(0.52, 0.66) - foot, deep)
    pad(d, size, (-hand * (wide + arm) / 2, 0.3 + foot / 2, 0), look, 0.05)
    if draw.chance(0.5):
        place = (hand * (wide / 2 + 0.08), (total - 0.06 + foot) / 2, (reach - deep) / 2)
        pad(d, (back * 0.8, total - foot, reach), place, look, 0.06)
    for sx in SIDES:
        for z in (-deep * 0.42, deep * 0.42):
            d.box((0.05, foot + 0.02, 0.05), (sx * wide * 0.46, foot / 2, z), DARK)
    _throws(d, draw, wide, seat, rear + 0.35)
    return d


def _buttons(d: Design, wide: float, low: float, high: float, z: float, look: Look) -> None:
    columns = max(3, round(wide / 0.22))
    for row, y in enumerate(spread(low, high, 2)):
        for x in spread(-wide / 2, wide / 2, columns + row % 2):
            ball(d, (0.035, 0.035, 0.03), (x * 0.95, y, z), look, 3)


def _chesterfield(draw: Draw) -> Design:
    d = Design("chesterfield sofa", "sofa", ("chesterfield", "couch"))
    leather = plain(
        draw.one_of(((0.3, 0.15, 0.08), (0.36, 0.09, 0.07), (0.1, 0.08, 0.07), (0.15, 0.22, 0.17))), 0.45
    )
    look = leather if draw.chance(0.7) else draw.cloth()
    button = mixed(look, (0.0, 0.0, 0.0), 0.4)
    seats = draw.count(2, 3)
    wide, deep, seat = seats * draw.between(0.55, 0.65), 0.9, draw.between(0.4, 0.45)
    top, roll = draw.between(0.68, 0.78), draw.between(0.09, 0.12)
    _block_seat(d, (wide, 0.1, deep * 0.8), (0, 0.06), seat, look, seats)
    rear = -deep / 2 + roll
    d.box((wide + 0.1, top - 0.1, 0.14), (0, top / 2 + 0.02, rear + 0.02), look)
    d.add(across(roll, wide + 4 * roll, (0, top, rear), 0, 14), look)
    _buttons(d, wide, seat + 0.08, top - 0.1, rear + 0.09, button)
    for s in SIDES:
        x = s * (wide / 2 + roll)
        d.box((1.3 * roll, top - 0.1, deep - 0.02), (x, top / 2 + 0.02, 0.02), look)
        d.add(across(roll, deep, (x + s * 0.02, top, 0.02), 2, 14), look)
        d.add(across(roll * 0.35, deep + 0.02, (x + s * 0.02, top, 0.02), 2, 10), button)
        for z in (-deep * 0.42, deep * 0.42):
            d.add(cylinder(0.025, 0.1, (x, 0, z), 0.045, 10), draw.wooden())
    _throws(d, draw, wide, seat, rear + 0.3, 2)
    return d


def _wooden_frame(
    d: Design, draw: Draw, wide: float, deep: float, seat: float, total: float, seats: int
) -> None:
    """Arms, rails and slats of wood, and a loose cushion below and behind each sitter."""
    wood, look = draw.wooden() if draw.chance(0.8) else draw.metal(), draw.upholstery()
    lean, high, broad = draw.between(0.15, 0.35), draw.between(0.54, 0.64), draw.between(0.04, 0.09)
    sled = draw.chance(0.3)
    for s in SIDES:
        x = s * (wide / 2 + 0.04)
        for z in (-deep * 0.42, deep * 0.45):
            d.box((0.045, high, 0.05), (x, high / 2, z), wood)
        d.box((broad, 0.035, deep * 0.98), (x, high, 0.01), wood)
        d.box((0.035, 0.06, deep * 0.87), (x, 0.03 if sled else seat - 0.16, 0), wood)
    for z in (-deep * 0.3, deep * 0.42):
        d.box((wide + 0.1, 0.06, 0.035), (0, seat - 0.16, z), wood)
    back = Design("", "")
    for y in spread(seat, total - 0.06, draw.count(3, 5)):
        back.box((wide + 0.04, 0.05, 0.022), (0, y, -deep * 0.4), wood)
    for k in range(seats):
        x = -wide / 2 + (k + 0.5) * wide / seats
        pad(d, (wide / seats - 0.01, 0.14, deep * 0.82), (x, seat - 0.06, 0.06), look, 0.05)
        size = (wide / seats - 0.02, total - seat, 0.15)
        pad(back, size, (x, (total + seat) / 2, -deep * 0.4 + 0.1), look, 0.06)
    merge(d, back, lambda t: turned(t, 0, -lean, (0, seat, -deep * 0.4)))


def _wooden_sofa(draw: Draw) -> Design:
    d = Design("wooden sofa", "sofa", ("sofa with wooden frame", "couch"))
    seats = draw.count(2, 3)
    wide, deep, seat = seats * draw.between(0.56, 0.68), draw.between(0.72, 0.85), draw.between(0.4, 0.45)
    _wooden_frame(d, draw, wide, deep, seat, draw.between(0.78, 0.92), seats)
    _throws(d, draw, wide, seat, -deep * 0.2, 2)
    return d


def _love_seat(draw: Draw) -> Design:
    d = Design("love seat", "sofa", ("two-seater sofa", "settee"))
    look, wood = draw.upholstery(), draw.wooden()
    wide, deep = draw.between(1.15, 1.45), draw.between(0.7, 0.85)
    seat, total = draw.between(0.42, 0.47), draw.between(0.85, 1.05)
    four_legs(d, draw, wide, deep, 0.2, wood)
    pad(d, (wide, 0.12, deep), (0, 0.24, 0), look, 0.04)
    pad(d, (wide * 0.9, 0.16, deep * 0.9), (0, seat - 0.08, 0.03), look, 0.06)
    arch = (
        ((1, 0), (1, 0.6), (0.85, 0.78), (0.5, 0.95), (0.05, 1))
        if draw.chance(0.6)
        else ((0.9, 0), (1, 0.5), (0.7, 0.85), (0.3, 0.85), (0.05, 1))
    )
    shape = slab(arch, (wide, total - 0.25, 0.13), (0, 0.25, -deep / 2 + 0.05))
    d.add(turned(shape, 0, -0.1, (0, 0.25, -deep / 2)), look)
    arch = slab(arch, (wide * 1.05, total - 0.22, 0.05), (0, 0.25, -deep / 2 - 0.01))
    d.add(turned(arch, 0, -0.1, (0, 0.25, -deep / 2)), wood)
    _buttons(d, wide * 0.7, seat + 0.15, seat + 0.3, -deep / 2 + 0.08, wood)
    for s in SIDES:
        path = (
            (s * wide / 2, 0.62, -deep * 0.4),
            (s * wide * 0.51, 0.6, 0.1),
            (s * wide * 0.52, 0.55, deep * 0.4),
        )
        d.add(loft(path, (0.06, 0.065, 0.07)), look)
        d.box((0.08, 0.34, deep * 0.75), (s * wide * 0.49, 0.4, 0), look)
    return d


def _chaise(draw: Draw) -> Design:
    d = Design("chaise longue", "sofa", ("chaise lounge", "recamier"))
    look, long = draw.upholstery(), draw.between(1.5, 1.85)
    deep, seat = draw.between(0.65, 0.8), draw.between(0.4, 0.46)
    hand, wood = draw.one_of(SIDES), draw.legs()
    four_legs(d, draw, long * 0.9, deep * 0.9, 0.2, wood)
    pad(d, (long, 0.1, deep), (0, 0.24, 0), look if draw.chance(0.5) else wood, 0.04)
    pad(d, (long * 0.97, seat - 0.26, deep), (0, (seat + 0.28) / 2, 0), look, 0.07)
    end = Design("", "")
    pad(end, (0.16, draw.between(0.4, 0.6), deep), (-hand * long * 0.46, seat + 0.2, 0), look, 0.07)
    merge(d, end, lambda t: turned(t, 2, hand * 0.35, (-hand * long * 0.46, seat, 0)))
    rear = ((-0.5, 0.42), (-0.45, 0.48), (-0.2, 0.4), (0.1, 0.22), (0.35, 0.1))
    back = [(hand * x * long, seat + y, -deep / 2 + 0.04) for x, y in rear]
    low = [(x, seat - 0.1, z) for x, _, z in back]
    for off in (0.0, 0.09):
        grid = np.array([low, back]) + np.array([0, 0, off])
        d.add(grid_triangles(grid), look)
    d.add(loft([(x, y, z + 0.045) for x, y, z in back], (0.06,) * 5, 8), look)
    bolster = across(0.09, deep * 0.8, (-hand * long * 0.33, seat + 0.08, 0), 2, 14)
    d.add(bolster, draw.cloth())
    return d


def _futon(draw: Draw) -> Design:
    d = Design("futon", "sofa", ("sofa bed", "futon sofa"))
    wide, deep = draw.between(1.3, 1.95), draw.between(0.8, 0.95)
    seat, look, wood = 0.4, draw.cloth(), draw.legs()
    pad(d, (wide, 0.15, deep * 0.95), (0, seat - 0.06, 0.06), look, 0.06, 4)
    part = Design("", "")
    pad(part, (wide, 0.62, 0.15), (0, seat + 0.28, -deep / 2 + 0.12), look, 0.06, 4)
    for x in spread(-wide * 0.45, wide * 0.45, 7):
        part.box((0.05, 0.6, 0.02), (x, seat + 0.25, -deep / 2 + 0.03), wood)
    merge(d, part, lambda t: turned(t, 0, -0.35, (0, seat, -deep / 2 + 0.1)))
    d.box((wide, 0.05, deep * 0.9), (0, seat - 0.16, 0.03), wood)
    for s in SIDES:
        for z in (-deep * 0.38, deep * 0.42):
            d.box((0.06, 0.58 if draw.chance(0.8) else 0.3, 0.07), (s * (wide / 2 + 0.03), 0.29, z), wood)
        d.box((0.08, 0.035, deep * 0.95), (s * (wide / 2 + 0.03), 0.6, 0.02), wood)
    _throws(d, draw, wide, seat, -deep * 0.15, 2)
    return d


def _sectional(draw: Draw) -> Design:
    d = Design("sectional sofa", "sofa", ("modular sofa", "couch"))
    look, many, seat = draw.upholstery(), draw.count(3, 4), draw.between(0.36, 0.42)
    side = draw.between(0.72, 0.85)
    total, hand = draw.between(0.62, 0.75), draw.one_of(SIDES)
    places = [((k - (many - 1) / 2) * side, 0.0) for k in range(many)]
    places.append((hand * (many - 1) / 2 * side, side))
    for x, z in places:
        pad(d, (side * 0.99, seat - 0.05, side * 0.99), (x, seat / 2 + 0.02, z), look, 0.06)
        if z == 0:
            place = (x, (total + seat) / 2 - 0.02, -side / 2 + 0.12)
            pad(d, (side * 0.97, total - seat + 0.1, 0.2), place, look, 0.08)
    for s in SIDES:
        if s != hand or draw.chance(0.6):
            place = (s * (many / 2 * side - 0.1), (total + seat) / 2 - 0.04, 0)
            pad(d, (0.2, total - seat + 0.05, side * 0.95), place, look, 0.07)
    cloths = [draw.cloth() for _ in range(3)]
    for _ in range(draw.count(4, 8)):
        x, z = draw.one_of(places)
        cushion = turned(rounded((0.45, 0.42, 0.17), (0, 0, 0), 3.0, 6), 0, -0.4)
        cushion = turned(cushion, 1, draw.between(-0.4, 0.4))
        d.add(shifted(cushion, (x + draw.between(-0.15, 0.15), seat + 0.18, z - 0.1)), draw.one_of(cloths))
    return d


def _wicker_shell(d: Design, wide: float, deep: float, seat: float, total: float, look: Look) -> None:
    """Arms that run round into the back, as of rattan."""
    d.box((wide, seat - 0.2, deep), (0, (seat - 0.1) / 2 + 0.03, 0), look)
    angles = np.linspace(-0.15, np.pi + 0.15, 17)
    x = (wide / 2 + 0.03) * np.sign(np.cos(angles)) * np.abs(np.cos(angles)) ** 0.4
    z = deep * 0.45 - (deep * 0.95) * np.clip(np.sin(angles), 0, 1) ** 0.4
    top = seat + 0.18 + (total - seat - 0.18) * np.clip(np.sin(angles), 0, 1) ** 2
    rows = [np.stack([x, np.full_like(x, 0.05), z], -1), np.stack([x, top, z], -1)]
    d.add(grid_triangles(np.array(rows)), look)
    d.add(loft([(float(a), float(b), float(c)) for a, b, c in rows[1]], (0.04,) * 17, 6), look)


def _wicker_sofa(draw: Draw) -> Design:
    d = Design("wicker sofa", "sofa", ("rattan sofa",))
    wide, deep, seat, cloth = draw.between(1.2, 1.8), draw.between(0.7, 0.85), 0.42, draw.cloth()
    _wicker_shell(d, wide, deep, seat, draw.between(0.75, 0.95), woven(draw))
    many = draw.count(2, 3)
    for k in range(many):
        x = (k - (many - 1) / 2) * wide * 0.92 / many
        pad(d, (wide * 0.91 / many, 0.13, deep * 0.85), (x, seat - 0.04, 0.04), cloth, 0.05)
        cushion = rounded((wide * 0.88 / many, 0.4, 0.17), (0, 0, 0), 3.5, 8)
        d.add(shifted(turned(cushion, 0, -0.25), (x, seat + 0.2, -deep / 2 + 0.16)), cloth)
    _throws(d, draw, wide, seat, -deep * 0.1, 2)
    return d


def armchair(draw: Draw) -> Design:
    """Mostly plain; else wing chairs, eggs, clubs, recliners, swinging frames, bean bags."""
    if draw.chance(0.68):
        return plain_armchair(draw)
    many = (_wing_chair, _wing_chair, _egg_chair, _club_chair, _club_chair, _recliner, _cantilever, _bean_bag)
    return draw.one_of((*many, _wooden_armchair, _wooden_armchair, _rocking_armchair))(draw)


def _wing_chair(draw: Draw) -> Design:
    d = Design("wing chair", "armchair", ("wingback chair", "easy chair"))
    look, seat, total = draw.upholstery(), draw.between(0.43, 0.48), draw.between(1.0, 1.2)
    wide, deep, lean = draw.between(0.52, 0.6), draw.between(0.68, 0.8), draw.between(0.1, 0.2)
    four_legs(d, draw, wide + 0.08, deep * 0.9, 0.2, draw.wooden())
    d.box((wide, 0.14, deep * 0.9), (0, 0.25, 0), look)
    pad(d, (wide * 0.99, 0.16, deep * 0.82), (0, seat - 0.08, 0.07), look, 0.06)
    back = Design("", "")
    pad(back, (wide, total - 0.2, 0.16), (0, (total + 0.2) / 2, -deep / 2 + 0.08), look, 0.07)
    for s in SIDES:
        wing = ((-0.3, 0.0), (0.12, 0.0), (0.28, 0.12), (0.26, 0.34), (0.08, 0.5), (-0.2, 0.52))
        z = [-deep / 2 + 0.1 + 0.7 * a for a, _ in wing]
        y = [0.64 + b * (total - 0.66) / 0.52 for _, b in wing]
        for x in (s * wide / 2, s * (wide / 2 + 0.07)):
            ring = np.array([(x, b, max(a, -deep / 2)) for a, b in zip(z, y, strict=True)])
            fan = np.stack([np.broadcast_to(ring.mean(0), ring.shape), ring, np.roll(ring, -1, 0)], 1)
            back.add(fan, look)
        loop = [(s * (wide / 2 + 0.035), b, max(a, -deep / 2)) for a, b in zip(z, y, strict=True)]
        back.add(loft(loop, (0.04,) * 6, 8), look)
        path = (
            (s * (wide / 2 + 0.04), 0.62, -deep * 0.35),
            (s * (wide / 2 + 0.05), 0.61, 0),
            (s * (wide / 2 + 0.06), 0.58, deep * 0.38),
        )
        d.add(loft(path, (0.06, 0.065, 0.075)), look)
        d.box((0.09, 0.38, deep * 0.82), (s * (wide / 2 + 0.04), 0.4, 0), look)
    merge(d, back, lambda t: turned(t, 0, -lean, (0, seat, -deep / 2)))
    if draw.chance(0.35):
        _buttons(d, wide * 0.8, seat + 0.25, seat + 0.42, -deep / 2 + 0.13, DARK)
    return d


def _egg_chair(draw: Draw) -> Design:
    d = Design("egg chair", "armchair", ("shell chair", "lounge chair"))
    outside, inside = vivid(draw) if draw.chance(0.5) else WHITE, draw.cloth()
    radius, seat = draw.between(0.42, 0.52), 0.43
    middle, tall = (0.0, seat + 0.24, 0.0), draw.between(1.0, 1.4)
    ball = rounded((2 * radius, 2 * radius * tall, 2 * radius), (0, 0, 0), 2.0, 12)
    centre = ball.mean(1)
    keep = (centre[:, 2] < radius * (0.45 - 0.35 * centre[:, 1] / radius)) | (centre[:, 1] < -radius * 0.55)
    for scale, look in ((1.0, outside), (0.94, inside)):
        d.add(turned(ball[keep] * scale, 0, -0.15) + np.array(middle), look)
    pad(d, (radius * 1.35, 0.14, radius * 1.4), (0, seat - 0.07, 0.06), inside, 0.06)
    cushion = turned(rounded((radius * 1.1, 0.4, 0.15), (0, 0, 0), 3.0, 8), 0, -0.3)
    d.add(shifted(cushion, (0, seat + 0.28, -radius * 0.5)), inside)
    low = middle[1] - radius * tall
    if draw.chance(0.5):
        d.cylinder(0.26, 0.025, (0, 0, 0), STEEL)
    else:
        for k in range(4):
            d.tube(((0, 0.1, 0), polar(0.33, k * QUARTER + 0.78, 0.02)), 0.02, STEEL, 6)
    d.cylinder(0.035, max(low, 0.05) + 0.06, (0, 0.01, 0), STEEL)
    return d


def _club_chair(draw: Draw) -> Design:
    tub = draw.chance(0.5)
    d = Design("tub chair" if tub else "club chair", "armchair", ("easy chair", "leather armchair"))
    look, seat, deep = draw.upholstery(), draw.between(0.4, 0.45), draw.between(0.7, 0.85)
    wide, total = draw.between(0.5, 0.58), draw.between(0.68, 0.85)
    if tub:
        radius = wide / 2 + 0.1
        for a in spread(-0.35, np.pi + 0.35, 11):
            x, _, z = polar(radius, a, 0)
            high = total - 0.14 * (1 - np.sin(max(0.0, min(np.pi, a))))
            part = Design("", "")
            pad(part, (0.12, high - 0.1, radius * 0.4), (0, (high + 0.1) / 2, 0), look, 0.055)
            merge(d, part, lambda t, a=a, x=x, z=z: shifted(turned(t, 1, a), (x, 0.0, -z)))
        d.cylinder(radius, seat - 0.2, (0, 0.1, 0), look)
        path = (
            (0, seat - 0.14),
            (radius * 0.92, seat - 0.13),
            (radius * 0.95, seat - 0.05),
            (radius * 0.85, seat),
            (0, seat),
        )
        d.lathe(path, look, 18)
        for k in range(4):
            d.cylinder(0.025, 0.12, polar(radius * 0.75, k * QUARTER + 0.78, 0), draw.legs())
        return d
    fat = draw.between(0.16, 0.24)
    _block_seat(d, (wide, 0.08, deep * 0.85), (0, 0.05), seat, look, 1)
    pad(d, (wide + fat, total - 0.08, 0.24), (0, total / 2 + 0.04, -deep / 2 + 0.12), look, 0.11, 4)
    for s in SIDES:
        x, high = s * (wide + fat) / 2, draw.between(0.54, 0.6)
        pad(d, (fat, high - 0.08, deep), (x, high / 2 + 0.04, 0), look, fat / 2.1, 4)
        d.add(across(fat * 0.42, 0.03, (x, high - fat * 0.5, deep / 2), 2, 14), look)
        for z in (-deep * 0.4, deep * 0.4):
            d.cylinder(0.03, 0.09, (x, 0, z), DARK)
    cushion = turned(rounded((wide * 0.95, total - seat + 0.05, 0.2), (0, 0, 0), 4.0, 8), 0, -0.15)
    d.add(shifted(cushion, (0, (total + seat) / 2, -deep / 2 + 0.25)), look)
    return d


def _recliner(draw: Draw) -> Design:
    d = Design("recliner", "armchair", ("reclining chair", "lounge chair"))
    look, seat, wide, lean = draw.upholstery(), 0.42, draw.between(0.5, 0.58), draw.between(0.3, 0.6)
    back = Design("", "")
    for low, tall, fat in ((0.0, 0.34, 0.2), (0.3, 0.28, 0.2), (0.54, 0.2, 0.22)):
        pad(back, (wide, tall, fat), (0, seat + low + tall / 2, -0.27), look, 0.09)
    merge(d, back, lambda t: turned(t, 0, -lean, (0, seat, -0.27)))
    pad(d, (wide, 0.2, 0.62), (0, seat - 0.09, 0.05), look, 0.08)
    if draw.chance(0.6):
        rest = Design("", "")
        pad(rest, (wide * 0.95, 0.12, 0.45), (0, seat - 0.08, 0.62), look, 0.05)
        merge(d, rest, lambda t: turned(t, 0, 0.15, (0, seat, 0.35)))
        d.box((wide * 0.6, 0.03, 0.35), (0, seat - 0.2, 0.45), STEEL)
    if draw.chance(0.5):
        for s in SIDES:
            pad(d, (0.17, 0.5, 0.85), (s * (wide / 2 + 0.09), 0.33, 0), look, 0.07)
        d.box((wide, 0.2, 0.7), (0, 0.16, 0), look)
    else:
        d.cylinder(0.29, 0.03, (0, 0, 0), STEEL if draw.chance(0.5) else DARK)
        d.cylinder(0.04, seat - 0.2, (0, 0.02, 0), STEEL)
        for s in SIDES:
            pad(d, (0.09, 0.06, 0.45), (s * (wide / 2 + 0.06), 0.6, 0), look, 0.025)
            path = ((s * (wide / 2 + 0.06), 0.58, -0.15), (s * (wide / 2 + 0.06), seat - 0.1, -0.05))
            d.tube(path, 0.02, STEEL, 6)
    return d


def _cantilever(draw: Draw) -> Design:
    d = Design("cantilever chair", "armchair", ("lounge chair",))
    look, wood = draw.upholstery(), draw.wooden() if draw.chance(0.6) else STEEL
    wide = draw.between(0.54, 0.64)
    seat, total, wood_bars = 0.42, draw.between(0.9, 1.05), draw.chance(0.6)
    for s in SIDES:
        x = s * (wide / 2 + 0.02)
        path = (
            (x, 0.57, -0.3),
            (x, 0.6, 0.1),
            (x, 0.56, 0.36),
            (x, 0.4, 0.42),
            (x, 0.12, 0.36),
            (x, 0.02, 0.25),
            (x, 0.02, -0.35),
        )
        if wood_bars:
            d.add(loft(path, (0.02,) * 7, 6, 1.4), wood)
        else:
            d.tube(path, 0.016, wood, 7)
        d.tube(((x, 0.57, -0.28), (x, seat, -0.24)), 0.014, wood, 6)
    for z, y in ((-0.33, 0.02), (0.2, 0.36), (-0.22, 0.36)):
        d.add(across(0.016, wide, (0, y, z), 0, 8), wood)
    seat_pad = Design("", "")
    pad(seat_pad, (wide * 0.96, 0.09, 0.58), (0, seat - 0.02, 0.07), look, 0.04)
    merge(d, seat_pad, lambda t: turned(t, 0, -0.12, (0, seat, 0)))
    back = Design("", "")
    many = draw.count(1, 3)
    for y in spread(seat, total, many + 1)[:-1]:
        tall = (total - seat) / many
        pad(back, (wide * 0.96, tall, 0.1), (0, y + tall / 2, -0.24), look, 0.045)
    merge(d, back, lambda t: turned(t, 0, -0.38, (0, seat, -0.24)))
    return d


def _bean_bag(draw: Draw) -> Design:
    d = Design("bean bag", "armchair", ("beanbag chair",))
    look, radius, tall = draw.upholstery(), draw.between(0.38, 0.48), draw.between(0.6, 0.9)
    t, segments = np.linspace(0, 1, 9), 18
    profile = np.interp(t, [0, 0.08, 0.3, 0.55, 0.8, 0.95, 1], [0.72, 0.98, 1.0, 0.78, 0.42, 0.2, 0.04])
    bag = lathe(list(zip((profile * radius).tolist(), (t * tall).tolist(), strict=True)), (0, 0, 0), segments)
    height = bag[..., 1] / tall
    bag[..., 2] -= 0.45 * radius * np.clip(height - 0.25, 0, 1)
    dent = np.exp(-((bag[..., 0] / 0.22) ** 2) - ((bag[..., 2] - 0.1) / 0.25) ** 2)
    bag[..., 1] -= draw.between(0.05, 0.16) * dent * (height > 0.3)
    angle = np.arctan2(bag[..., 2], bag[..., 0])
    wrinkle = 1 + 0.025 * np.sin(6 * angle + draw.between(0, 6))
    bag[..., 0] *= wrinkle
    d.add(bag, look)
    if draw.chance(0.5):
        path = (
            (-0.05, tall - 0.03, -0.32 * radius),
            (0, tall + 0.05, -0.32 * radius),
            (0.05, tall - 0.03, -0.32 * radius),
        )
        d.tube(path, 0.012, look, 5)
    return d


def _wooden_armchair(draw: Draw) -> Design:
    d = Design("wooden armchair", "armchair", ("easy chair", "lounge chair"))
    deep, seat = draw.between(0.66, 0.8), draw.between(0.4, 0.45)
    _wooden_frame(d, draw, draw.between(0.52, 0.64), deep, seat, draw.between(0.8, 1.05), 1)
    return d


def _rocking_armchair(draw: Draw) -> Design:
    d = Design("rocking chair", "armchair", ("rocker",))
    wood, look, seat = draw.legs(), draw.upholstery(), draw.between(0.42, 0.46)
    wide, total = draw.between(0.48, 0.58), draw.between(0.95, 1.15)
    soft = draw.chance(0.5)
    for s in SIDES:
        x = s * wide / 2
        rocker = [(x, 0.025 + 0.16 * (z / 0.5) ** 2, z - 0.03) for z in spread(-0.5, 0.45, 9)]
        d.tube(rocker, 0.018, wood, 6)
        for z in (-0.2, 0.22):
            d.tube(((x, 0.05, z), (x, 0.62 if not soft and z > 0 else seat, z * 0.95)), 0.016, wood, 6)
        if not soft:
            d.box((0.06, 0.025, 0.52), (x, 0.64, 0.0), wood)
    for z in (-0.2, 0.22):
        d.add(across(0.014, wide, (0, 0.2, z), 0, 6), wood)
    back = Design("", "")
    if soft:
        shell = rounded((wide + 0.14, total - seat + 0.2, 0.5), (0, 0, 0), 2.6, 10)
        keep = (shell.mean(1)[:, 2] < 0.02) | (shell.mean(1)[:, 1] < -0.2)
        back.add(shifted(shell[keep], (0, (total + seat) / 2, 0.05)), look)
        pad(d, (wide, 0.12, 0.5), (0, seat - 0.03, 0.03), look, 0.05)
    else:
        d.box((wide + 0.02, 0.03, 0.48), (0, seat - 0.02, 0), wood)
        for x in spread(-wide / 2, wide / 2, draw.count(5, 9)):
            back.tube(((x, seat, -0.22), (x, total, -0.22)), 0.012, wood, 6)
        back.box((wide + 0.06, 0.12, 0.025), (0, total, -0.22), wood)
        if draw.chance(0.7):
            pad(d, (wide * 0.9, 0.06, 0.44), (0, seat + 0.02, 0.01), look, 0.03)
    merge(d, back, lambda t: turned(t, 0, -0.25, (0, seat, -0.22)))
    return d
