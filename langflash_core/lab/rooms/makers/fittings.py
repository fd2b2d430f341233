"""Makers for kitchens and baths, of lamps and of screens (see `makers.common`). Metres, y up, front +z."""

import numpy as np

from langflash_core.lab.rooms.makers.kit import (
    BLACK,
    DARK,
    SIDES,
    STEEL,
    WHITE,
    Design,
    Draw,
    Face,
    Look,
    box,
    cylinder,
    fronts,
    laid,
    lathe,
    plain,
    polar,
    rounded,
    scaled,
    shifted,
    spread,
    turned,
)

# ------------------------------------------------------------------------------------------- kitchen


def base_cabinet(draw: Draw) -> Design:
    """Kitchen units of the usual widths with doors or drawers under a work top."""
    d = Design("lower cabinet", "cabinet", ("kitchen cabinet",))
    width, depth = draw.one_of((0.4, 0.5, 0.6, 0.8, 0.9)), draw.between(0.56, 0.63)
    look, front = draw.painted(), draw.body()
    d.box((width, 0.1, depth * 0.9), (0, 0.05, -0.02), DARK)
    d.box((width, 0.76, depth), (0, 0.48, 0), look)
    face = Face(-width / 2, 0.1, width, 0.75, depth / 2)
    if draw.chance(0.35):
        fronts(d, draw, face, draw.count(2, 4), 1, front, draw.metal(), doors=False)
    else:
        fronts(d, draw, face, 1, 1 if width < 0.55 else 2, front, draw.metal(), doors=True)
    d.box((width, 0.035, depth + 0.03), (0, 0.88, 0.01), draw.body() if draw.chance(0.6) else DARK)
    return d


def wall_cabinet(draw: Draw) -> Design:
    """Kitchen units that hang above the others, with one or two doors."""
    d = Design("upper cabinet", "cabinet", ("kitchen cabinet",), elevation=draw.between(1.35, 1.5))
    width = draw.one_of((0.4, 0.6, 0.8, 0.9))
    height, depth = draw.between(0.5, 0.85), draw.between(0.3, 0.37)
    d.box((width, height, depth), (0, height / 2, 0), draw.painted())
    face = Face(-width / 2, 0, width, height, depth / 2)
    fronts(d, draw, face, 1, 1 if width < 0.5 else 2, draw.body(), draw.metal(), doors=True)
    return d


def plain_refrigerator(draw: Draw) -> Design:
    """From low to tall and double: two compartments, split high or low."""
    d = Design("refrigerator", "refrigerator", ("fridge",))
    width, height, depth = draw.between(0.54, 0.92), draw.between(0.85, 2.0), draw.between(0.58, 0.72)
    look = draw.one_of((WHITE, STEEL, draw.painted()))
    d.box((width, height, depth), (0, height / 2, 0), look)
    split = height * (draw.between(0.3, 0.45) if draw.chance(0.5) else draw.between(0.6, 0.75))
    columns = 2 if width > 0.8 else 1
    each = width / columns
    for low, high in ((0.04, split), (split, height - 0.01)):
        y, tall = (low + high) / 2, min(0.4, (high - low) * 0.5)
        for k in range(columns):
            x, side = -width / 2 + (k + 0.5) * each, -1 if k else 1
            d.soft((each - 0.008, high - low - 0.008, 0.05), (x, y, depth / 2 + 0.02), look, 30)
            d.box((0.022, tall, 0.03), (x + side * (each / 2 - 0.05), y, depth / 2 + 0.065), STEEL)
    return d


def plain_stove(draw: Draw) -> Design:
    """An oven under four plates, with a row of knobs and sometimes a back board."""
    d = Design("stove", "stove", ("cooker", "oven"), category="Kitchen")
    width, depth = draw.between(0.5, 0.9), draw.between(0.56, 0.64)
    look = draw.one_of((WHITE, STEEL, BLACK))
    d.box((width, 0.87, depth), (0, 0.435, 0), look)
    d.box((width, 0.015, depth), (0, 0.88, 0), BLACK if draw.chance(0.7) else STEEL)
    d.box((width * 0.86, 0.42, 0.03), (0, 0.42, depth / 2 + 0.01), BLACK if look is not BLACK else DARK)
    d.box((width * 0.8, 0.02, 0.03), (0, 0.67, depth / 2 + 0.05), STEEL)
    for x in spread(-width * 0.38, width * 0.38, draw.count(4, 6)):
        d.roll(0.02, 0.03, (x, 0.78, depth / 2), STEEL if look is BLACK else DARK)
    for x in (-width * 0.24, width * 0.24):
        for z in (-depth * 0.22, depth * 0.2):
            radius, high = draw.between(0.07, 0.11), 0.012 if draw.chance(0.5) else 0.03
            d.cylinder(radius, high, (x, 0.885, z), DARK)
    if draw.chance(0.3):
        d.box((width, draw.between(0.1, 0.25), 0.04), (0, 0.98, -depth / 2 + 0.02), look)
    return d


def washing_machine(draw: Draw) -> Design:
    """White or steel, with a round door of any size."""
    d = Design("washing machine", "washing machine")
    width, height, depth = draw.between(0.58, 0.62), draw.between(0.82, 0.9), draw.between(0.5, 0.62)
    look = WHITE if draw.chance(0.75) else STEEL
    d.box((width, height, depth), (0, height / 2, 0), look)
    radius, front, y = draw.between(0.15, 0.21), depth / 2, height - 0.07
    door = (0, height * 0.47, front)
    ring = ((radius * 0.75, 0.02), (radius * 0.8, 0.05), (radius, 0.04), (radius, 0))
    d.add(laid(lathe(ring, segments=24), door), STEEL)
    d.roll(radius * 0.78, 0.025, door, BLACK, 24)
    d.box((width * 0.3, 0.07, 0.01), (-width * 0.3, y, front + 0.005), look)
    d.box((width * 0.3, 0.06, 0.012), (width * 0.1, y, front + 0.005), DARK)
    d.roll(0.03, 0.03, (width * 0.37, y, front), STEEL)
    return d


def microwave(draw: Draw) -> Design:
    """A box with a dark door and a panel of keys."""
    d = Design("microwave oven", "microwave", ("microwave",))
    width, height, depth = draw.between(0.42, 0.55), draw.between(0.24, 0.31), draw.between(0.3, 0.4)
    d.box((width, height, depth), (0, height / 2, 0), draw.one_of((WHITE, STEEL, DARK)))
    d.box((width * 0.62, height * 0.75, 0.012), (-width * 0.14, height / 2, depth / 2), BLACK)
    d.box((0.015, height * 0.7, 0.02), (width * 0.2, height / 2, depth / 2 + 0.02), STEEL)
    d.box((width * 0.2, height * 0.8, 0.01), (width * 0.36, height / 2, depth / 2), DARK)
    return d


def sink_unit(draw: Draw) -> Design:
    """A kitchen unit whose work top has a hole with a floor, and a tap."""
    d = Design("kitchen sink", "sink", ("sink",), category="Kitchen")
    width, depth = draw.one_of((0.6, 0.8, 0.9, 1.2)), draw.between(0.56, 0.63)
    front = draw.body()
    d.box((width, 0.72, depth), (0, 0.46, 0), front)
    face = Face(-width / 2, 0.1, width, 0.74, depth / 2)
    fronts(d, draw, face, 1, 1 if width < 0.7 else 2, front, draw.metal(), doors=True)
    rim, wide = STEEL if draw.chance(0.7) else WHITE, min(0.5, width * 0.7)
    x = (width - wide) / 2 * (draw.between(-0.7, 0.7) if width > 0.7 else 0)
    for sx in SIDES:
        side = width / 2 - sx * x - wide / 2
        d.box((max(side, 0.01), 0.035, depth), (x + sx * (wide + side) / 2, 0.88, 0), rim)
    for sz in SIDES:
        d.box((wide, 0.035, depth * 0.15), (x, 0.88, sz * depth * 0.425), rim)
    d.box((wide, 0.01, depth * 0.7), (x, 0.83, 0), rim)
    z, tall = -depth * 0.43, draw.between(0.15, 0.35)
    tap = ((x, 0.88, z), (x, 0.88 + tall, z), (x, 0.88 + tall, z + 0.18), (x, 0.84 + tall, z + 0.2))
    d.tube(tap, 0.013, STEEL)
    return d


# ---------------------------------------------------------------------------------- bath and heating


def plain_sink(draw: Draw) -> Design:
    """A wash basin on a column, on a cabinet or alone on the wall."""
    d = Design("sink", "sink", ("washbasin",))
    width, depth, top = draw.between(0.42, 0.75), draw.between(0.38, 0.5), draw.between(0.8, 0.9)
    style = draw.style(3)
    _basin(d, draw, width, depth, top)
    if style == 0:
        d.lathe(((0.13, 0), (0.08, 0.1), (0.07, top - 0.3), (0.14, top - 0.1)), WHITE)
    elif style == 1:
        look = draw.body()
        d.box((width * 1.05, top - 0.12, depth * 0.95), (0, (top - 0.12) / 2 + 0.03, 0), look)
        face = Face(-width / 2, 0.08, width, top - 0.2, depth * 0.475)
        fronts(d, draw, face, draw.count(1, 2), draw.count(1, 2), look, draw.metal(), doors=True)
        d.box((width * 1.1, 0.03, depth), (0, top - 0.03, 0), WHITE)
    else:
        d.cylinder(0.03, top - 0.1, (0, 0, -depth * 0.2), STEEL)
    return d


def _basin(d: Design, draw: Draw, width: float, depth: float, top: float) -> None:
    """A bowl that is open above, with a tap."""
    under = ((0.02, top - 0.14), (width * 0.38, top - 0.13))
    rim = ((width * 0.5, top), (width * 0.46, top))
    inside = ((width * 0.33, top - 0.1), (0, top - 0.11))
    d.lathe((*under, *rim, *inside), WHITE, 24, depth / width)
    z, tall = -depth * 0.44, draw.between(0.1, 0.28)
    tap = (
        (0, top - 0.02, z),
        (0, top + tall, z),
        (0, top + tall, z + 0.15),
        (0, top + tall - 0.03, z + 0.16),
    )
    d.tube(tap, 0.014, STEEL)


def plain_toilet(draw: Draw) -> Design:
    """A bowl, its lid closed or up, with or without a cistern."""
    d = Design("toilet", "toilet", ("wc",))
    width, length, seat = draw.between(0.34, 0.4), draw.between(0.42, 0.5), draw.between(0.38, 0.44)
    outside = ((0.3, 0), (0.28, 0.35), (0.5, 0.9), (0.5, 1))
    inside = ((0.36, 1), (0.25, 0.7), (0, 0.6))
    d.lathe(scaled((*outside, *inside), width, seat), WHITE, 24, length / width)
    if draw.chance(0.7):
        rim = width * 0.52
        lid = ((0, seat), (rim, seat), (rim, seat + 0.03), (0, seat + 0.03))
        d.lathe(lid, WHITE, 24, length / width)
    else:
        z = -length * 0.42
        d.add(
            turned(rounded((width, length, 0.03), (0, seat + length / 2, z), 3), 0, -0.1, (0, seat, z)), WHITE
        )
    if draw.chance(0.75):
        tall = draw.between(0.28, 0.4)
        d.soft((width * 1.05, tall, 0.18), (0, seat + tall / 2, -length / 2 - 0.08), WHITE, 12)
        d.box((width * 0.6, seat, 0.14), (0, seat / 2, -length / 2 - 0.06), WHITE)
    return d


def plain_bathtub(draw: Draw) -> Design:
    """Built in behind panels, or standing free."""
    d = Design("bathtub", "bathtub", ("bath",))
    width, length, height = draw.between(0.68, 0.85), draw.between(1.45, 1.85), draw.between(0.5, 0.62)
    squash = width / length
    if draw.chance(0.55):
        look = WHITE if draw.chance(0.7) else draw.body()
        for sz in SIDES:
            d.box((length, height, 0.03), (0, height / 2, sz * (width / 2 - 0.015)), look)
        for sx in SIDES:
            d.box((0.03, height, width), (sx * (length / 2 - 0.015), height / 2, 0), look)
        inside = ((0.5, 1), (0.46, 1), (0.38, 0.25), (0, 0.22))
        d.lathe(scaled(inside, length, height), WHITE, 28, squash)
        for sz in SIDES:
            d.box((length, 0.012, width * 0.12), (0, height, sz * width * 0.44), WHITE)
    else:
        outside = ((0, 0.03), (length * 0.36, 0.05), (length * 0.5, height))
        inside = ((length * 0.47, height), (length * 0.36, 0.16), (0, 0.14))
        d.lathe((*outside, *inside), WHITE, 30, squash)
    x, z = -length * 0.4, -width * 0.3
    d.tube(((x, height, z), (x, height + 0.14, z), (-length * 0.3, height + 0.13, z)), 0.014, STEEL)
    return d


def plain_shower(draw: Draw) -> Design:
    """A tray behind glass on two or three sides, and a pipe with a head."""
    d = Design("shower", "shower", ("shower cabin",))
    width, depth, height = draw.between(0.75, 1.1), draw.between(0.75, 0.95), draw.between(1.9, 2.15)
    d.box((width, 0.1, depth), (0, 0.05, 0), WHITE)
    glass = plain((0.82, 0.88, 0.88), 0.9, opacity=0.35)
    metal = STEEL if draw.chance(0.7) else DARK
    tall, middle = height - 0.1, height / 2 + 0.05
    for sx in SIDES:
        if sx > 0 or draw.chance(0.5):
            d.box((0.012, tall, depth), (sx * width / 2, middle, 0), glass)
    d.box((width * 0.5, tall, 0.012), (-width * 0.25, middle, depth / 2), glass)
    for x in (-width / 2, 0.0, width / 2):
        d.box((0.025, tall, 0.025), (x, middle, depth / 2), metal)
    d.box((width, 0.03, 0.03), (0, height, depth / 2), metal)
    z = -depth / 2 + 0.04
    d.tube(((0, 1.0, z), (0, height, z), (0, height, z + 0.25)), 0.012, STEEL)
    d.cylinder(draw.between(0.05, 0.13), 0.02, (0, height - 0.04, z + 0.25), STEEL)
    return d


def radiator(draw: Draw) -> Design:
    """Ribs between two pipes, or a ribbed plate."""
    d = Design("radiator", "radiator", ("heater",), elevation=draw.between(0.08, 0.2))
    width, height = draw.between(0.5, 1.4), draw.between(0.45, 0.8)
    look = WHITE if draw.chance(0.8) else draw.painted()
    if draw.chance(0.5):
        pitch = draw.between(0.05, 0.085)
        for x in np.arange(-width / 2, width / 2, pitch).tolist():
            d.soft((pitch * 0.7, height, 0.11), (x, height / 2, 0), look, 4)
        for y in (0.06, height - 0.06):
            d.box((width, 0.04, 0.04), (-pitch / 2, y, 0), look)
    else:
        d.box((width, height, 0.06), (0, height / 2, 0), look)
        for x in np.arange(-width / 2 + 0.03, width / 2 - 0.02, 0.045).tolist():
            d.box((0.018, height * 0.94, 0.02), (x, height / 2, 0.035), look)
    return d


# ------------------------------------------------------------------------------------ lamps


def _shade(d: Design, draw: Draw, foot: float, look: Look) -> float:
    """A cone or a ball from `foot` upwards; returns where the cone ends."""
    radius, tall = draw.between(0.1, 0.24), draw.between(0.14, 0.3)
    narrow, top = radius * draw.between(0.45, 1.0), foot + tall
    if draw.chance(0.75):
        d.lathe(((radius, foot), (narrow, top), (narrow * 0.98, top), (radius * 0.98, foot)), look, 22)
    else:
        d.soft((2 * radius, 2 * radius, 2 * radius), (0, foot + radius, 0), look, 2)
    return top


def _shade_look(draw: Draw) -> Look:
    return plain((0.95, 0.92, 0.85) if draw.chance(0.6) else draw.colour(0.6, 0.4))


def floor_lamp(draw: Draw) -> Design:
    """On three legs, on a pole, or hanging from an arc."""
    d = Design("floor lamp", "lamp", ("lamp",), light=True)
    height, metal = draw.between(1.25, 1.6), draw.legs()
    if draw.chance(0.25):
        for k in range(3):
            d.tube((polar(0.28, 2 * np.pi * k / 3, 0), (0, height, 0)), 0.014, metal)
    elif draw.chance(0.3):
        out = draw.between(0.4, 0.9)
        d.cylinder(0.15, 0.03, (0, 0, 0), metal)
        arc = [(out * (1 - np.cos(t)), height * np.sin(t) * 1.15, 0.0) for t in np.linspace(0, 2.0, 9)]
        d.tube(arc, 0.012, metal)
        d.cylinder(0.14, 0.12, (arc[-1][0], arc[-1][1] - 0.12, 0), _shade_look(draw), top=0.03)
        return d
    else:
        d.cylinder(draw.between(0.11, 0.17), 0.025, (0, 0, 0), metal)
        d.cylinder(0.013, height, (0, 0, 0), metal)
    _shade(d, draw, height - 0.02, _shade_look(draw))
    return d


def table_lamp(draw: Draw) -> Design:
    """A shade on a turned foot or on a pole, or a reading lamp with an elbow."""
    d = Design("table lamp", "lamp", ("lamp",), light=True)
    height, style = draw.between(0.18, 0.38), draw.style(3)
    if style == 0:
        radii = [draw.between(0.02, 0.09) for _ in range(5)]
        belly = ((r, height * (k + 1) / 6) for k, r in enumerate(radii))
        d.lathe(((0.0, 0.0), (0.08, 0.0), *belly, (0.012, height)), draw.ceramic())
    elif style == 1:
        d.cylinder(draw.between(0.06, 0.1), 0.02, (0, 0, 0), draw.metal())
        d.cylinder(0.01, height, (0, 0, 0), draw.metal())
    else:
        metal = draw.metal() if draw.chance(0.5) else draw.painted()
        d.cylinder(0.09, 0.025, (0, 0, 0), metal)
        elbow, tip = (-0.08, height, 0.0), (0.14, height * 1.5, 0.0)
        d.tube(((0, 0.02, 0), elbow, tip), 0.01, metal)
        head = turned(cylinder(0.085, 0.11, (0, 0, 0), 0.03), 2, -0.5)
        d.add(shifted(head, (tip[0] + 0.02, tip[1] - 0.1, 0)), metal)
        return d
    _shade(d, draw, height * 0.97, _shade_look(draw))
    return d


def pendant_lamp(draw: Draw) -> Design:
    """One shade on a cord, or a ring of three to six small ones."""
    d = Design("pendant lamp", "lamp", ("ceiling lamp",), light=True)
    drop, look = draw.between(0.2, 0.6), _shade_look(draw) if draw.chance(0.5) else draw.painted()
    if draw.chance(0.3):
        count = draw.count(3, 6)
        for k in range(count):
            tip = polar(0.3, 2 * np.pi * k / count, 0.0)
            d.tube(((0, 0.05, 0), tip), 0.01, draw.metal())
            d.soft((0.1, 0.14, 0.1), (tip[0], 0.07, tip[2]), look, 2)
        d.cylinder(0.012, drop, (0, 0, 0), DARK)
        return d
    top = _shade(d, draw, 0.0, look)
    d.cylinder(0.006, drop, (0, top - 0.02, 0), DARK)
    d.cylinder(0.05, 0.02, (0, top + drop - 0.02, 0), DARK)
    return d


# ---------------------------------------------------------------------------------- screens and sound


def plain_tv(draw: Draw) -> Design:
    """A wide screen on a foot, off or faintly lit."""
    d = Design("tv", "tv", ("television", "flat screen"))
    width = draw.between(0.65, 1.35)
    height, foot = width * draw.between(0.56, 0.62), draw.between(0.05, 0.1)
    size = (width, height, draw.between(0.03, 0.09))
    d.box(size, (0, foot + height / 2, 0), BLACK if draw.chance(0.8) else STEEL)
    screen = plain((0.02, 0.02, 0.03) if draw.chance(0.8) else (0.1, 0.14, 0.2), 0.8)
    d.box((width * 0.97, height * 0.94, 0.02), (0, foot + height / 2, 0.04), screen)
    d.box((width * 0.3, 0.015, 0.2), (0, 0.008, 0), DARK)
    d.box((0.06, foot, 0.04), (0, foot / 2, 0), DARK)
    return d


def computer(draw: Draw) -> Design:
    """A laptop, or a monitor on a foot; the screen dark or of any colour."""
    screen = plain(draw.colour(0.5, 0.1, 0.9) if draw.chance(0.5) else (0.03, 0.03, 0.04), 0.6)
    look = draw.one_of((DARK, STEEL, WHITE, BLACK))
    return _laptop(draw, look, screen) if draw.chance(0.5) else _monitor(draw, look, screen)


def _laptop(draw: Draw, look: Look, screen: Look) -> Design:
    d = Design("laptop", "computer", ("laptop computer", "notebook"))
    width = draw.between(0.29, 0.4)
    depth = width * draw.between(0.65, 0.72)
    d.box((width, 0.018, depth), (0, 0.009, 0), look)
    d.box((width * 0.85, 0.003, depth * 0.45), (0, 0.019, -depth * 0.15), DARK)
    open_by, hinge = draw.between(0.1, 0.5), (0.0, 0.018, -depth / 2)
    lid, pane = (width, depth * 0.97, 0.01), (width * 0.94, depth * 0.86, 0.004)
    for size, z, part in ((lid, 0.0, look), (pane, 0.006, screen)):
        upright = box(size, (0, 0.018 + depth * 0.48, -depth / 2 + z))
        d.add(turned(upright, 0, -open_by, hinge), part)
    return d


def _monitor(draw: Draw, look: Look, screen: Look) -> Design:
    d = Design("monitor", "computer", ("computer monitor", "screen"))
    width = draw.between(0.42, 0.72)
    height, foot = width * draw.between(0.55, 0.68), draw.between(0.08, 0.16)
    d.box((width, height, 0.045), (0, foot + height / 2, 0), look)
    d.box((width * 0.95, height * 0.92, 0.012), (0, foot + height / 2, 0.022), screen)
    d.box((0.05, foot + 0.1, 0.03), (0, (foot + 0.1) / 2, -0.03), look)
    d.box((width * 0.4, 0.015, 0.18), (0, 0.008, -0.02), look)
    return d


def speaker(draw: Draw) -> Design:
    """A box, from a cube to a column, with as many cones as its front has room for."""
    d = Design("speaker", "speaker", ("loudspeaker",))
    width = draw.between(0.12, 0.3)
    height, depth = width * draw.between(1.2, 4.0), width * draw.between(0.8, 1.3)
    d.box((width, height, depth), (0, height / 2, 0), BLACK if draw.chance(0.4) else draw.body())
    y = height - width * 0.5
    while y > width * 0.3:
        radius, centre = width * draw.between(0.2, 0.42), (0, y, depth / 2)
        d.roll(radius, 0.012, centre, DARK)
        d.roll(radius * 0.35, 0.02, centre, STEEL)
        y -= width * draw.between(0.7, 1.0)
    return d
