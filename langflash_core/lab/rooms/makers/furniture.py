"""Makers of seats, tables, beds and cupboards (see `makers.common`). Metres, y up, front +z."""

from dataclasses import dataclass

import numpy as np

from langflash_core.lab.rooms.makers.kit import (
    BLACK,
    DARK,
    LINEN,
    SIDES,
    Design,
    Draw,
    Face,
    Look,
    Vector,
    box,
    carcass,
    four_legs,
    fronts,
    plain,
    polar,
    rounded,
    spread,
    turned,
)

# ------------------------------------------------------------------------------------------- seating


def plain_chair(draw: Draw) -> Design:
    """Dining chairs: four legs or a sled, slats, spindles, panels or a shell for a back."""
    d = Design("chair", "chair", ("dining chair",))
    width, depth, seat = draw.between(0.38, 0.52), draw.between(0.38, 0.52), draw.between(0.42, 0.49)
    total, lean = seat + draw.between(0.32, 0.58), draw.between(0.03, 0.22)
    frame, plate = draw.legs(), draw.upholstery() if draw.chance(0.45) else draw.body()
    four_legs(d, draw, width, depth, seat - 0.02, frame)
    if plate[0].texture or draw.chance(0.4):
        d.box((width, draw.between(0.02, 0.05), depth), (0, seat - 0.01, 0), plate)
    else:
        d.soft((width, draw.between(0.05, 0.1), depth), (0, seat, 0), plate)
    for triangles, look in _chair_back(draw, (width, seat, depth), total, frame, plate).parts:
        d.add(turned(triangles, 0, -lean, (0, seat, -depth / 2)), look)
    if draw.chance(0.2):
        _arm_rests(d, draw, width, depth, seat, frame)
    return d


def _chair_back(draw: Draw, under: Vector, total: float, frame: Look, plate: Look) -> Design:
    """Upright from the seat, whose size is `under`, to the total height."""
    back, (width, seat, depth) = Design("back", "chair"), under
    tall, style, bar = total - seat, draw.style(5), draw.between(0.02, 0.045)
    middle, z = seat + tall / 2, -depth / 2 + bar / 2
    if style < 3:
        for sx in SIDES:
            back.box((bar, tall, bar), (sx * (width - bar) / 2, middle, z), frame)
    if style == 0:
        for k in range(draw.count(2, 4)):
            y = seat + tall * (0.35 + 0.2 * k)
            if y < total:
                back.box((width - bar, 0.05, 0.018), (0, y, z), frame)
    elif style == 1:
        back.box((width, 0.06, bar), (0, total - 0.03, z), frame)
        for x in spread(-width / 2 + bar, width / 2 - bar, draw.count(3, 7) + 2)[1:-1]:
            back.box((0.02, tall, 0.015), (x, middle, z), frame)
    else:
        high = tall * draw.between(0.45, 0.95)
        size = (width * draw.between(0.85, 1.0), high, draw.between(0.02, 0.07))
        shape = rounded if style > 3 or not plate[0].texture else box
        back.add(shape(size, (0, total - high / 2, -depth / 2 + 0.02)), plate)
    if style > 2:
        for sx in SIDES:
            bracket = (sx * width * 0.3, seat + tall * 0.35, -depth / 2 + 0.01)
            back.box((0.025, tall * 0.7, 0.025), bracket, frame)
    return back


def _arm_rests(d: Design, draw: Draw, width: float, depth: float, seat: float, look: Look) -> None:
    high = seat + draw.between(0.17, 0.25)
    for sx in SIDES:
        x = sx * (width / 2 + 0.01)
        d.box((0.05, 0.03, depth * 0.85), (x, high, 0), look)
        d.box((0.03, high - seat, 0.03), (x, (high + seat) / 2, depth * 0.35), look)


def office_chair(draw: Draw) -> Design:
    """A seat on a gas spring and five castors, most with arm rests."""
    d = Design("office chair", "chair", ("desk chair", "swivel chair"))
    seat, width, depth = draw.between(0.42, 0.54), draw.between(0.45, 0.54), draw.between(0.44, 0.52)
    look, dark = draw.upholstery(), DARK if draw.chance(0.6) else draw.metal()
    reach = draw.between(0.25, 0.33)
    for k in range(5):
        tip = polar(reach, 2 * np.pi * k / 5 + 0.3, 0.07)
        d.tube(((0, 0.1, 0), tip), 0.022, dark)
        d.soft((0.06, 0.06, 0.06), (tip[0], 0.03, tip[2]), BLACK, 2.5)
    d.cylinder(0.03, seat - 0.1, (0, 0.08, 0), dark)
    d.soft((width, 0.09, depth), (0, seat, 0), look, 4.0)
    tall = draw.between(0.4, 0.75)
    back = rounded((width * draw.between(0.8, 1), tall, 0.08), (0, seat + 0.1 + tall / 2, -depth / 2), 4.0)
    d.add(turned(back, 0, -0.12, (0, seat, -depth / 2)), look)
    d.box((0.06, 0.22, 0.03), (0, seat + 0.06, -depth / 2 - 0.04), dark)
    if draw.chance(0.7):
        _arm_rests(d, draw, width + 0.06, depth * 0.7, seat, dark)
    return d


def plain_armchair(draw: Draw) -> Design:
    """One wide soft seat between arms."""
    d = Design("armchair", "armchair", ("easy chair",))
    _couch(d, draw, 1, draw.between(0.5, 0.66))
    return d


def plain_sofa(draw: Draw) -> Design:
    """Two to four soft seats between arms."""
    d = Design("sofa", "sofa", ("couch",))
    seats = draw.count(2, 4)
    _couch(d, draw, seats, draw.between(0.55, 0.75))
    return d


@dataclass(frozen=True)
class _Couch:
    """What the parts of a soft seat share: lengths, m, the cushions' squareness, and the cover."""

    seats: int
    each: float
    width: float
    depth: float
    seat: float
    total: float
    arm: float
    foot: float
    back: float
    squareness: float
    look: Look


def _couch(d: Design, draw: Draw, seats: int, each: float) -> None:
    look = draw.upholstery()
    depth, seat = draw.between(0.75, 1.02), draw.between(0.38, 0.47)
    total = draw.between(0.68, 1.05 if seats == 1 else 0.92)
    arm, arm_high = draw.between(0.07, 0.26), draw.between(0.52, 0.68)
    foot, back = draw.between(0.02, 0.18), draw.between(0.14, 0.26)
    width = seats * each + 2 * arm
    four_legs(d, draw, width * 0.95, depth * 0.9, foot + 0.02, draw.legs())
    c = _Couch(seats, each, width, depth, seat, total, arm, foot, back, draw.between(4, 14), look)
    inner = width - 2 * arm
    d.box((inner, seat - 0.14 - foot, depth), (0, (seat - 0.14 + foot) / 2, 0), look)
    wide, thick = inner / seats, draw.between(0.12, 0.2)
    for k in range(seats):
        x = -inner / 2 + (k + 0.5) * wide
        d.soft((wide * 0.99, thick, depth - back), (x, seat - thick / 2, 0.03), look, 8.0)
    _couch_back(d, draw, c)
    _couch_arms(d, draw, c, arm_high)


def _couch_back(d: Design, draw: Draw, c: _Couch) -> None:
    """A cushion for each seat before a board, or one piece."""
    lean, rear = draw.between(0.02, 0.2), -c.depth / 2
    if draw.chance(0.6):
        size = (c.each * 0.98, c.total - c.seat + 0.05, c.back * 1.1)
        for k in range(c.seats):
            x = -c.width / 2 + c.arm + (k + 0.5) * c.each
            pillow = rounded(size, (x, (c.total + c.seat) / 2, rear + c.back * 0.8), c.squareness)
            d.add(turned(pillow, 0, -lean, (0, c.seat, rear + c.back)), c.look)
        board = (c.width - 2 * c.arm, c.total * 0.85 - c.foot, c.back * 0.6)
        d.box(board, (0, (c.total * 0.85 + c.foot) / 2, rear + c.back * 0.3), c.look)
    else:
        size, centre = (c.width, c.total - c.foot, c.back), (0, (c.total + c.foot) / 2, rear + c.back / 2)
        d.add(turned(rounded(size, centre, c.squareness), 0, -lean * 0.6, (0, c.foot, rear)), c.look)


def _couch_arms(d: Design, draw: Draw, c: _Couch, high: float) -> None:
    """Square, soft or rolled arms, or open wooden ones."""
    style, frame = draw.style(4), draw.wooden()
    arm, foot, depth = c.arm, c.foot, c.depth
    for sx in SIDES:
        x = sx * (c.width - arm) / 2
        if style == 0:
            d.box((arm, high - foot, depth * 0.97), (x, (high + foot) / 2, 0.01), c.look)
        elif style == 1:
            d.soft((arm, high - foot, depth), (x, (high + foot) / 2, 0), c.look, c.squareness)
        elif style == 2:
            under = (arm * 0.8, high - foot - arm / 2, depth * 0.95)
            d.box(under, (x, (high + foot - arm / 2) / 2, 0), c.look)
            d.roll(arm * 0.6, depth * 0.95, (x, high - arm * 0.5, -depth * 0.47), c.look)
        else:
            for z in (-depth * 0.4, depth * 0.42):
                d.box((0.05, high, 0.05), (x, high / 2, z), frame)
            d.box((0.07, 0.035, depth * 0.92), (x, high, 0.01), frame)


def stool(draw: Draw) -> Design:
    """Low or at bar height; three or four legs, or a column on a plate."""
    high = draw.chance(0.4)
    d = Design("bar stool" if high else "stool", "stool")
    seat = draw.between(0.6, 0.8) if high else draw.between(0.38, 0.5)
    radius = draw.between(0.15, 0.22)
    look, frame = draw.upholstery() if draw.chance(0.5) else draw.body(), draw.legs()
    if draw.chance(0.3):
        d.cylinder(radius * 1.1, 0.02, (0, 0, 0), frame)
        d.cylinder(0.03, seat, (0, 0, 0), frame)
    elif draw.chance(0.5):
        for k in range(draw.count(3, 4)):
            a = 2 * np.pi * k / 3.5
            d.tube((polar(radius, a, 0), polar(0.7 * radius, a, seat)), 0.015, frame)
    else:
        four_legs(d, draw, 2 * radius, 2 * radius, seat, frame)
    if draw.chance(0.6):
        d.cylinder(radius, draw.between(0.03, 0.08), (0, seat - 0.02, 0), look)
    else:
        d.soft((2 * radius, 0.06, 2 * radius), (0, seat, 0), look)
    return d


def bench(draw: Draw) -> Design:
    """A long plain seat; half of them with a cushion."""
    d = Design("bench", "bench")
    width, depth, seat = draw.between(0.9, 1.6), draw.between(0.3, 0.42), draw.between(0.42, 0.48)
    look = draw.body()
    four_legs(d, draw, width, depth, seat, draw.legs())
    d.box((width, 0.04, depth), (0, seat, 0), look)
    if draw.chance(0.5):
        d.soft((width * 0.98, 0.06, depth * 0.95), (0, seat + 0.04, 0), draw.upholstery())
    return d


def pouf(draw: Draw) -> Design:
    """A soft block, from a ball to a cube."""
    d = Design("pouf", "pouf", ("ottoman",))
    width, height = draw.between(0.38, 0.7), draw.between(0.3, 0.46)
    size = (width, height, width * draw.between(0.8, 1))
    d.soft(size, (0, height / 2, 0), draw.upholstery(), draw.between(2.5, 9))
    return d


# -------------------------------------------------------------------------------------------- tables


def plain_table(draw: Draw) -> Design:
    """Dining tables: long, square or round."""
    d = Design("table", "table", ("dining table",))
    width = draw.between(0.8, 2.0)
    depth = width if width < 1.1 and draw.chance(0.6) else draw.between(0.7, 1.0)
    _table(d, draw, width, depth, draw.between(0.70, 0.78))
    return d


def coffee_table(draw: Draw) -> Design:
    """Low tables: long, square or round, some with a board below."""
    d = Design("coffee table", "coffee table", ("low table",))
    width, height = draw.between(0.55, 1.25), draw.between(0.32, 0.48)
    depth = draw.between(0.45, 0.7) if width > 0.75 else width
    look = _table(d, draw, width, depth, height)
    if draw.chance(0.4):
        d.box((width * 0.85, 0.018, depth * 0.85), (0, height * 0.35, 0), look)
    return d


def _table(d: Design, draw: Draw, width: float, depth: float, height: float) -> Look:
    """Top and legs; returns the look of the top."""
    look, thick = draw.body(), draw.between(0.018, 0.05)
    if draw.chance(0.3):
        rim, under = width / 2, height - thick
        d.lathe(((0, under), (rim, under), (rim, height), (0, height)), look, 28, depth / width)
    else:
        d.box((width, thick, depth), (0, height - thick / 2, 0), look)
    _table_legs(d, draw, width, depth, height, look if draw.chance(0.6) else draw.legs())
    return look


def _table_legs(d: Design, draw: Draw, width: float, depth: float, height: float, look: Look) -> None:
    """A column, two trestles, or four legs, some with rails."""
    style = draw.style(5)
    if style == 0:
        base, low = depth * 0.3, depth * 0.28
        d.lathe(((0, 0), (base, 0), (low, 0.03), (0.05, 0.08), (0.04, height), (0, height)), look)
    elif style == 1:
        for sx in SIDES:
            x = sx * width * 0.36
            d.box((0.06, height, 0.1), (x, height / 2, 0), look)
            d.box((0.08, 0.05, depth * 0.75), (x, 0.025, 0), look)
        d.box((width * 0.72, 0.06, 0.04), (0, height * 0.35, 0), look)
    else:
        inset = draw.between(0.8, 0.98)
        four_legs(d, draw, width * inset, depth * inset, height - 0.02, look)
        if draw.chance(0.5):
            rail = draw.between(0.05, 0.1)
            for sz in SIDES:
                centre = (0, height - 0.03 - rail / 2, sz * depth * inset * 0.44)
                d.box((width * inset * 0.92, rail, 0.02), centre, look)


def plain_desk(draw: Draw) -> Design:
    """A work top on legs, on blocks of drawers or on both, sometimes a shelf above."""
    d = Design("desk", "desk", ("writing desk",))
    width, depth, height = draw.between(0.95, 1.7), draw.between(0.5, 0.8), draw.between(0.71, 0.77)
    look, front, metal = draw.body(), draw.body(), draw.metal()
    d.box((width, draw.between(0.02, 0.04), depth), (0, height - 0.015, 0), look)
    blocks = draw.count(0, 2)
    if blocks < 2:
        four_legs(d, draw, width, depth, height - 0.02, look if draw.chance(0.4) else draw.legs())
    for k in range(blocks):
        side, wide = 1 - 2 * k, draw.between(0.32, 0.45)
        x = side * (width / 2 - wide / 2 - 0.01)
        d.box((wide, height - 0.08, depth * 0.92), (x, height / 2 + 0.02, 0), look)
        face = Face(x - wide / 2, 0.06, wide, height - 0.1, depth * 0.46)
        fronts(d, draw, face, draw.count(2, 4), 1, front, metal, doors=False)
    if blocks:
        d.box((width * 0.9, height * 0.5, 0.018), (0, height * 0.7, -depth * 0.42), look)
    if draw.chance(0.2):
        tall, z = draw.between(0.25, 0.6), -depth / 2 + 0.11
        for x in (-width / 2 + 0.01, width / 2 - 0.01):
            d.box((0.02, tall, 0.22), (x, height + tall / 2, z), look)
        d.box((width, 0.02, 0.22), (0, height + tall, z), look)
    return d


def bedside_table(draw: Draw) -> Design:
    """A small box with one door, or two or three drawers."""
    d = Design("bedside table", "bedside table", ("nightstand",))
    width, depth, height = draw.between(0.35, 0.55), draw.between(0.33, 0.45), draw.between(0.4, 0.65)
    look = draw.body()
    foot = carcass(d, draw, width, height, depth, look)
    rows, front = draw.count(1, 3), draw.body() if draw.chance(0.3) else look
    face = Face(-width / 2, foot + 0.01, width, height - foot - 0.03, depth / 2)
    fronts(d, draw, face, rows, 1, front, draw.metal(), doors=rows == 1)
    return d


# ---------------------------------------------------------------------------------------------- beds


def plain_bed(draw: Draw) -> Design:
    """Single or double: frame, mattress, pillows, blanket; head boards of slats, panels or cushions."""
    d = Design("bed", "bed", ("double bed",))
    double = draw.chance(0.6)
    width = draw.between(1.35, 1.85) if double else draw.between(0.85, 1.1)
    length = draw.between(1.95, 2.1)
    look = draw.body() if draw.chance(0.7) else draw.upholstery()
    sheet = LINEN if draw.chance(0.6) else draw.cloth()
    frame, top = draw.between(0.2, 0.36), draw.between(0.42, 0.62)
    if draw.chance(0.5):
        four_legs(d, draw, width, length, frame * 0.5, draw.legs())
        d.box((width, frame * 0.55, length), (0, frame * 0.75, 0), look)
    else:
        d.box((width, frame, length), (0, frame / 2, 0), look)
    mattress = (width * 0.98, top - frame + 0.06, length * 0.97)
    d.soft(mattress, (0, (top + frame) / 2 - 0.02, 0.0), sheet, 14)
    pillow, count = (min(0.68, width * 0.46), 0.15, 0.42), 2 if double else 1
    for k in range(count):
        centre = ((k - (count - 1) / 2) * width * 0.48, top + 0.06, -length / 2 + 0.3)
        d.soft(pillow, centre, LINEN if draw.chance(0.7) else sheet, 3)
    if draw.chance(0.8):
        cover, long = draw.cloth(), length * draw.between(0.3, 0.72)
        centre = (0, (top + frame * 0.6) / 2 + 0.04, length / 2 - long / 2)
        d.soft((width * 1.04, top - frame * 0.6, long), centre, cover, 12)
    _bed_board(d, draw, width, draw.between(0.75, 1.25), -length / 2 - 0.03, look)
    if draw.chance(0.35):
        _bed_board(d, draw, width, draw.between(0.45, 0.75), length / 2 + 0.03, look)
    return d


def _bed_board(d: Design, draw: Draw, width: float, height: float, z: float, look: Look) -> None:
    """A panel, a cushion or bars at one end of a bed."""
    style = draw.style(3)
    if style == 0:
        d.box((width + 0.06, height, 0.05), (0, height / 2, z), look)
    elif style == 1:
        d.soft((width + 0.06, height * 0.6, 0.13), (0, height * 0.7, z), draw.upholstery(), 8)
        d.box((width, height * 0.5, 0.04), (0, height * 0.25, z), look)
    else:
        for x in (-width / 2, width / 2):
            d.box((0.06, height, 0.06), (x, height / 2, z), look)
        d.box((width, 0.07, 0.04), (0, height - 0.05, z), look)
        for x in spread(-width / 2, width / 2, draw.count(5, 12))[1:-1]:
            d.box((0.03, height - 0.3, 0.02), (x, height / 2 + 0.1, z), look)


def crib(draw: Draw) -> Design:
    """A small bed between bars."""
    d = Design("crib", "crib", ("baby bed",))
    width, length, height = draw.between(0.6, 0.75), draw.between(1.15, 1.4), draw.between(0.8, 1.0)
    look = draw.body()
    for sx in SIDES:
        x = sx * width / 2
        d.box((0.03, 0.04, length), (x, height - 0.1, 0), look)
        d.box((0.03, 0.04, length), (x, 0.3, 0), look)
        for z in spread(-length / 2, length / 2, draw.count(10, 15)):
            d.box((0.018, height - 0.4, 0.018), (x, height / 2 + 0.1, z), look)
    for sz in SIDES:
        d.box((width, height - 0.2, 0.025), (0, height / 2 + 0.1, sz * length / 2), look)
    four_legs(d, draw, width, length, 0.35, look)
    sheet = LINEN if draw.chance(0.5) else draw.cloth()
    d.soft((width * 0.94, 0.12, length * 0.95), (0, 0.4, 0), sheet, 10)
    return d


# ------------------------------------------------------------------------------------------- storage


def plain_wardrobe(draw: Draw) -> Design:
    """Two to four tall doors, sometimes over drawers, sometimes under a cornice."""
    d = Design("wardrobe", "wardrobe", ("closet",))
    doors = draw.count(2, 4)
    width, height, depth = doors * draw.between(0.4, 0.55), draw.between(1.85, 2.3), draw.between(0.52, 0.65)
    look = draw.body()
    foot = carcass(d, draw, width, height, depth, look)
    front, metal = look if draw.chance(0.6) else draw.body(), draw.metal()
    low = draw.between(0.2, 0.5) * draw.chance(0.35)
    upper = Face(-width / 2, foot + low, width, height - foot - low - 0.02, depth / 2)
    fronts(d, draw, upper, 1, doors, front, metal, doors=True)
    if low:
        lower = Face(-width / 2, foot, width, low, depth / 2)
        fronts(d, draw, lower, 1, max(1, doors // 2), front, metal, doors=False)
    if draw.chance(0.3):
        d.box((width + 0.06, 0.05, depth + 0.05), (0, height + 0.02, 0.01), look)
    return d


def plain_dresser(draw: Draw) -> Design:
    """Three to five rows of drawers under a top board."""
    d = Design("chest of drawers", "dresser", ("dresser",))
    columns, rows = draw.count(1, 3), draw.count(3, 5)
    width, height = columns * draw.between(0.45, 0.75), rows * draw.between(0.18, 0.26) + 0.08
    depth, look = draw.between(0.4, 0.52), draw.body()
    foot = carcass(d, draw, width, height, depth, look)
    face = Face(-width / 2 + 0.01, foot + 0.01, width - 0.02, height - foot - 0.03, depth / 2)
    front = look if draw.chance(0.6) else draw.body()
    fronts(d, draw, face, rows, columns, front, draw.metal(), doors=False)
    d.box((width + 0.02, 0.022, depth + 0.02), (0, height, 0), look)
    return d


def plain_cupboard(draw: Draw) -> Design:
    """Sideboards with drawers over their doors, and tall cupboards with two rows of doors."""
    tall = draw.chance(0.45)
    d = Design("cupboard" if tall else "sideboard", "cabinet", ("storage cabinet",))
    columns = draw.count(1, 2) if tall else draw.count(2, 4)
    width = columns * draw.between(0.4, 0.55)
    height = draw.between(1.2, 2.0) if tall else draw.between(0.65, 1.05)
    depth, look = draw.between(0.35, 0.5), draw.body()
    foot = carcass(d, draw, width, height, depth, look)
    front, metal = look if draw.chance(0.6) else draw.body(), draw.metal()
    split = foot + (height - foot) * draw.between(0.55, 0.8)
    lower = Face(-width / 2, foot, width, split - foot, depth / 2)
    upper = Face(-width / 2, split, width, height - split - 0.02, depth / 2)
    fronts(d, draw, lower, 1, columns, front, metal, doors=True)
    fronts(d, draw, upper, 1, columns, front, metal, doors=tall)
    d.box((width + 0.02, 0.025, depth + 0.02), (0, height, 0), look)
    return d


def plain_bookcase(draw: Draw) -> Design:
    """Open shelves, more or less full of books and boxes."""
    d = Design("bookcase", "bookcase", ("shelves",))
    columns, rows = draw.count(1, 3), draw.count(2, 6)
    each, pitch, depth = draw.between(0.35, 0.8), draw.between(0.28, 0.42), draw.between(0.22, 0.4)
    width, height, board = columns * each, rows * pitch + 0.06, draw.between(0.016, 0.035)
    look = draw.body()
    for x in spread(-width / 2, width / 2, columns + 1):
        d.box((board, height, depth), (x, height / 2, 0), look)
    for k in range(rows + 1):
        d.box((width, board, depth), (0, 0.05 + k * pitch, 0), look)
    if draw.chance(0.75):
        d.box((width, height - 0.05, 0.01), (0, height / 2 + 0.02, -depth / 2 + 0.005), look)
    fill = draw.between(0, 1)
    for row in range(rows):
        for column in range(columns):
            if draw.chance(fill):
                low = -width / 2 + column * each + board
                high = low + (each - 2 * board) * draw.between(0.4, 1)
                _books_on(d, draw, (low, high), 0.05 + row * pitch + board / 2, pitch - 0.05, depth)
    return d


def _books_on(
    d: Design, draw: Draw, across: tuple[float, float], foot: float, room: float, depth: float
) -> None:
    """A row of books from left to right, or one box, on a shelf with so much room above."""
    x, right = across
    if draw.chance(0.15):
        tall = room * draw.between(0.5, 0.9)
        d.box((right - x, tall, depth * 0.85), ((x + right) / 2, foot + tall / 2, 0), draw.cloth())
        return
    covers = [plain(draw.colour(0.7, 0.2, 0.85)) for _ in range(4)]
    while x < right - 0.05:
        thick, tall = draw.between(0.02, 0.06), room * draw.between(0.55, 0.95)
        centre = (x + thick / 2, foot + tall / 2, 0.02)
        d.box((thick * 0.96, tall, depth * 0.7), centre, draw.one_of(covers))
        x += thick


def plain_tv_stand(draw: Draw) -> Design:
    """Low compartments side by side, open or with drawers."""
    d = Design("tv stand", "tv stand", ("tv unit",))
    columns = draw.count(2, 4)
    width, height, depth = (
        columns * draw.between(0.38, 0.55),
        draw.between(0.3, 0.58),
        draw.between(0.35, 0.48),
    )
    look, front, metal = draw.body(), draw.body(), draw.metal()
    foot = draw.between(0.06, 0.18) if draw.chance(0.5) else 0.03
    four_legs(d, draw, width, depth, foot, draw.legs())
    for y in (foot, height):
        d.box((width, 0.03, depth), (0, y, 0), look)
    tall, middle, each = height - foot, (height + foot) / 2, width / columns
    d.box((width, tall, 0.015), (0, middle, -depth / 2 + 0.01), look)
    for k, x in enumerate(spread(-width / 2, width / 2, columns + 1)):
        d.box((0.02, tall, depth), (x, middle, 0), look)
        if k < columns and draw.chance(0.5):
            face = Face(x, foot + 0.015, each, height - foot - 0.03, depth / 2 - 0.02)
            fronts(d, draw, face, draw.count(1, 2), 1, front, metal, doors=False)
    return d
