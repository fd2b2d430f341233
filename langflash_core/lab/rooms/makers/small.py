"""Makers of plants, vessels, boxes and toys (see `makers.common`). Metres, y up, front +z."""

import numpy as np

from langflash_core.lab.rooms.builtin import KIND_FABRIC
from langflash_core.lab.rooms.makers.kit import (
    BLACK,
    DARK,
    WHITE,
    Design,
    Draw,
    Look,
    Material,
    Triangles,
    Vector,
    box,
    plain,
    polar,
    rounded,
    scaled,
    shifted,
    turned,
)

_SOIL = plain((0.14, 0.10, 0.07))
_STEM = plain((0.33, 0.25, 0.15))
_CARD = plain((0.66, 0.5, 0.33))
_TAPE = plain((0.75, 0.62, 0.42))
_FRUITS = ((0.75, 0.15, 0.1), (0.9, 0.55, 0.1), (0.85, 0.8, 0.2), (0.45, 0.65, 0.2), (0.4, 0.1, 0.3))
_FULL_TURN = 6.28  # radians; more digits would make other plants

# -------------------------------------------------------------------------------------------- plants


def plain_plant(draw: Draw) -> Design:
    """A pot with blades, broad leaves, a bush or a little tree, some in bloom."""
    d = Design("plant", "plant", ("potted plant", "houseplant"))
    radius, pot = draw.between(0.06, 0.18), draw.between(0.1, 0.32)
    outside = ((0, 0), (draw.between(0.6, 0.95), 0), (1, 1))
    d.lathe(scaled((*outside, (0.9, 1), (0.85, 0.9), (0, 0.9)), radius, pot), draw.ceramic())
    base = pot * 0.9
    d.cylinder(radius * 0.85, 0.01, (0, base, 0), _SOIL)
    greens = [_green(draw) for _ in range(3)]
    tall, style = draw.between(1.0, 6.0) * radius, draw.style(4)
    if style == 3:
        d.tube(((0, base, 0), (0.02, base + tall * 0.6, 0.01)), 0.015, _STEM)
        base += tall * 0.55
    if style in (0, 2):
        for _ in range(draw.count(10, 27)):
            angle, reach = draw.between(0, _FULL_TURN), radius * draw.between(0.5, 2.6)
            high, width = tall * draw.between(0.5, 1), draw.between(0.012, 0.05) * (2.5 if style == 2 else 1)
            d.add(_blade((0, base, 0), angle, reach, high, width), draw.one_of(greens))
    else:
        _bush(d, draw, base, tall, radius * draw.between(1.0, 2.4), greens, stems=5 if style == 1 else 0)
    if draw.chance(0.25):
        bloom = plain(draw.colour(0.9, 0.7, 0.97))
        for _ in range(draw.count(3, 9)):
            angle, reach = draw.between(0, _FULL_TURN), radius * draw.between(0.2, 1.3)
            d.soft((0.05, 0.04, 0.05), polar(reach, angle, base + tall * draw.between(0.7, 1.05)), bloom, 2)
    return d


def _green(draw: Draw) -> Look:
    return plain((draw.between(0.08, 0.3), draw.between(0.28, 0.5), draw.between(0.05, 0.2)))


def _bush(
    d: Design, draw: Draw, base: float, tall: float, spread: float, greens: list[Look], stems: int
) -> None:
    """A cloud of small leaves above `base`, with stems from there."""
    for _ in range(draw.count(25, 59)):
        x, y, z = draw.rng.normal(0, 0.42, 3) * [spread, tall * 0.32, spread]
        leaf = rounded((draw.between(0.04, 0.12), 0.012, draw.between(0.03, 0.07)), (0, 0, 0), 2.0, 4)
        leaf = turned(turned(leaf, 2, draw.between(-0.9, 0.9)), 1, draw.between(0, _FULL_TURN))
        d.add(shifted(leaf, (x, max(base + tall * 0.45 + y, base + 0.02), z)), draw.one_of(greens))
    for _ in range(stems):
        tip = polar(spread * 0.5, draw.between(0, _FULL_TURN), base + tall * 0.7)
        d.tube(((0, base, 0), tip), 0.006, _STEM)


def _blade(foot: Vector, angle: float, reach: float, high: float, width: float) -> Triangles:
    """A leaf that rises from `foot` and bends outwards."""
    t = np.linspace(0, 1, 7)
    out, up = reach * t**1.5, high * np.sin(t * np.pi * 0.6) / np.sin(np.pi * 0.6)
    half = width * np.sin(np.pi * np.clip(t + 0.12, 0, 1)) ** 0.7
    direction = np.array([np.cos(angle), 0, np.sin(angle)])
    side = np.array([-np.sin(angle), 0, np.cos(angle)])
    middle = np.array(foot) + out[:, None] * direction + up[:, None] * np.array([0.0, 1.0, 0.0])
    left, right = middle - half[:, None] * side, middle + half[:, None] * side
    rising = np.stack([left[:-1], right[:-1], right[1:]], 1)
    return np.concatenate([rising, np.stack([left[:-1], right[1:], left[1:]], 1)])


# ------------------------------------------------------------------------------------------- vessels


def plain_vase(draw: Draw) -> Design:
    """Smooth from foot over belly to neck."""
    d = Design("vase", "vase", ("flower vase",))
    height, widest = draw.between(0.14, 0.42), draw.between(0.05, 0.13)
    neck = widest * draw.between(0.3, 0.9)
    t, belly = np.linspace(0, 1, 14), draw.between(0.25, 0.7)
    knots = [widest * draw.between(0.5, 0.9), widest, neck, neck * draw.between(0.9, 1.3)]
    radii = np.interp(t, [0, belly, 0.85, 1], knots)
    radii = np.convolve(np.pad(radii, 2, mode="edge"), np.ones(5) / 5, mode="valid").tolist()
    inside = ((radii[-1] * 0.85, height), (radii[-1] * 0.8, height * 0.6))
    outside = zip(radii, (t * height).tolist(), strict=True)
    d.lathe(((0.0, 0.0), *outside, *inside), draw.ceramic())
    return d


def bottle(draw: Draw) -> Design:
    """Glass of any colour with a cap, most with a label."""
    d = Design("bottle", "bottle")
    height, radius = draw.between(0.16, 0.33), draw.between(0.025, 0.045)
    glass = draw.one_of(((0.1, 0.25, 0.12), (0.35, 0.2, 0.08), (0.8, 0.85, 0.85), draw.colour(0.8)))
    shoulder, neck = draw.between(0.5, 0.75), radius * draw.between(0.3, 0.5)
    below = ((0, 0), (radius, 0), (radius, height * shoulder))
    above = ((neck, height * (shoulder + 0.15)), (neck, height), (0, height))
    d.lathe((*below, *above), plain(glass, 0.8))
    d.cylinder(neck * 1.15, height * 0.06, (0, height * 0.96, 0), draw.painted())
    if draw.chance(0.6):
        d.cylinder(radius * 1.02, height * 0.25, (0, height * 0.15, 0), draw.painted())
    return d


def plain_cup(draw: Draw) -> Design:
    """Straight or narrow at the foot, most with a handle."""
    d = Design("cup", "cup", ("mug",))
    height, radius = draw.between(0.07, 0.12), draw.between(0.033, 0.05)
    look = draw.ceramic()
    outside = ((0, 0), (draw.between(0.6, 1), 0), (1, 1))
    d.lathe(scaled((*outside, (0.9, 1), (0.7, 0.15), (0, 0.12)), radius, height), look)
    if draw.chance(0.7):
        turns = np.linspace(0, np.pi, 6)
        handle = [(radius + 0.028 * np.sin(t), height * (0.5 + 0.3 * np.cos(t)), 0.0) for t in turns]
        d.tube(handle, 0.006, look, 6)
    return d


def bowl(draw: Draw) -> Design:
    """Plates and bowls, shallow to deep."""
    flat = draw.chance(0.4)
    d = Design("plate" if flat else "bowl", "bowl")
    radius = draw.between(0.07, 0.16)
    height = radius * (0.18 if flat else draw.between(0.4, 0.9))
    profile = ((0, 0), (0.5, 0), (1, 1), (0.95, 1), (0.45, 0.25), (0, 0.2))
    d.lathe(scaled(profile, radius, height), draw.ceramic(), 24)
    return d


def basket(draw: Draw) -> Design:
    """Eight rings of wicker or cord, round or oval."""
    d = Design("basket", "basket", ("wicker basket",))
    radius, height = draw.between(0.13, 0.26), draw.between(0.18, 0.5)
    wicker = Material((0.62, 0.47, 0.3) if draw.chance(0.7) else draw.colour(0.4)), KIND_FABRIC
    squash = draw.between(0.6, 1)
    for k in range(8):
        y, r = height * k / 8, radius * (0.82 + 0.18 * k / 8)
        ring = ((r * 0.93, y), (r, y + height / 16), (r * 0.93, y + height / 8))
        d.lathe(ring, wicker, squash=squash)
    d.lathe(((0, 0.01), (radius * 0.8, 0.01)), wicker, squash=squash)
    return d


def plain_trash_bin(draw: Draw) -> Design:
    """A metal or painted bucket, half of them with a lid."""
    d = Design("trash bin", "trash bin", ("waste basket",))
    radius, height = draw.between(0.11, 0.2), draw.between(0.26, 0.65)
    look = draw.metal() if draw.chance(0.4) else draw.painted()
    outside = ((0, 0), (radius * draw.between(0.7, 1), 0), (radius, height))
    d.lathe((*outside, (radius * 0.93, height), (radius * 0.7, 0.05)), look)
    if draw.chance(0.5):
        lid = ((radius * 1.03, height), (radius, height + 0.05), (0, height + 0.08))
        d.lathe(lid, DARK if draw.chance(0.5) else look)
    return d


# ------------------------------------------------------------------------------------- other things


def fruit(draw: Draw) -> Design:
    """One fruit, or a few of its kind around it."""
    d = Design("fruit", "food", ("fruits", "food"))
    look, radius = plain(draw.one_of(_FRUITS), 0.3), draw.between(0.03, 0.05)
    for k in range(draw.count(1, 5)):
        centre = polar(2.0 * radius if k else 0.0, 2.4 * k, radius)
        d.soft((2 * radius, 1.9 * radius, 2 * radius), centre, look, 2)
    return d


def crate(draw: Draw) -> Design:
    """Cardboard boxes with tape, and wooden or painted ones, some with a lid."""
    d = Design("box", "box", ("cardboard box",))
    size = width, height, depth = draw.between(0.18, 0.6), draw.between(0.15, 0.45), draw.between(0.18, 0.45)
    look = _CARD if draw.chance(0.5) else draw.body()
    d.box(size, (0, height / 2, 0), look)
    if look is _CARD:
        d.box((width * 1.002, height * 1.002, 0.05), (0, height / 2, 0), _TAPE)
    elif draw.chance(0.5):
        d.box((width * 1.02, height * 0.15, depth * 1.02), (0, height * 0.93, 0), look)
    return d


def plain_clock(draw: Draw) -> Design:
    """A round wall clock at any time of day."""
    d = Design("wall clock", "clock", ("clock",), elevation=1.6)
    radius = draw.between(0.11, 0.22)
    rim, face = draw.body(), WHITE if draw.chance(0.75) else DARK
    hands, centre = BLACK if face is WHITE else WHITE, (0, radius, 0)
    d.roll(radius, 0.035, (0, radius, -0.02), rim, 28)
    d.roll(radius * 0.9, 0.006, (0, radius, 0.014), face, 28)
    for long, wide in ((0.5, 0.012), (0.75, 0.008)):
        hand = box((wide, radius * long, 0.003), (0, radius * long / 2, 0.024))
        d.add(shifted(turned(hand, 2, draw.between(0, _FULL_TURN)), centre), hands)
    mark = box((0.008, radius * 0.1, 0.003), (0, radius * 0.8, 0.022))
    for hour in range(12):
        d.add(shifted(turned(mark, 2, hour * np.pi / 6), centre), hands)
    return d


def plain_toy(draw: Draw) -> Design:
    """A ball, or blocks side by side and on each other."""
    if draw.chance(0.5):
        d = Design("ball", "toy", ("toy ball",))
        radius = draw.between(0.06, 0.15)
        look = Material(draw.colour(0.9, 0.5)), KIND_FABRIC
        d.soft((2 * radius, 2 * radius, 2 * radius), (0, radius, 0), look, 2)
        return d
    d = Design("toy blocks", "toy", ("building blocks",))
    side, foot = draw.between(0.04, 0.09), 0.0
    for _ in range(draw.count(2, 6)):
        block = box((side * draw.between(1, 2.2), side, side), (0, 0, 0))
        block = turned(block, 1, draw.between(0, _FULL_TURN))
        place = (draw.between(-1, 1) * side * 0.6, foot + side / 2, 0)
        d.add(shifted(block, place), plain(draw.colour(0.9, 0.6)))
        if draw.chance(0.6):
            foot += side
    return d
