"""Makers of animals, living and plush (see `makers.common`).

Metres, y up, front +z.
"""

from collections.abc import Sequence

import numpy as np

from langflash_core.lab.rooms.makers.kit import (
    BLACK,
    SIDES,
    WHITE,
    Design,
    Draw,
    Look,
    Triangles,
    Vector,
    ball,
    dappled,
    loft,
    mixed,
    plain,
    shifted,
    torus,
    turned,
    vivid,
)

_CATS = (
    (0.08, 0.08, 0.085),
    (0.9, 0.88, 0.84),
    (0.75, 0.45, 0.18),
    (0.45, 0.44, 0.43),
    (0.5, 0.38, 0.26),
    (0.78, 0.68, 0.55),
)
_DOGS = (
    *((0.08, 0.07, 0.07), (0.88, 0.85, 0.8), (0.7, 0.48, 0.25), (0.4, 0.24, 0.13), (0.82, 0.68, 0.45)),
    *((0.45, 0.43, 0.42), (0.55, 0.3, 0.13)),
)


def teddy_bear(draw: Draw) -> Design:
    """Plush bears, rabbits and elephants that sit."""
    style = draw.one_of((0, 0, 0, 0, 1, 2))
    d = Design(
        ("teddy bear", "plush rabbit", "plush elephant")[style], "teddy bear", ("plush toy", "stuffed animal")
    )
    s, fat = draw.between(0.22, 0.6), draw.between(0.85, 1.2)
    furs = (
        (0.5, 0.32, 0.17),
        (0.72, 0.52, 0.3),
        (0.33, 0.2, 0.12),
        (0.88, 0.82, 0.72),
        draw.colour(0.6, 0.5),
    )
    fur = plain((0.55, 0.58, 0.62) if style == 2 and draw.chance(0.6) else draw.one_of(furs))
    pale = mixed(fur, (0.95, 0.88, 0.78), 0.55)
    ball(d, (0.5 * s * fat, 0.52 * s, 0.42 * s * fat), (0, 0.26 * s, 0), fur)
    ball(d, (0.32 * s * fat, 0.36 * s, 0.1 * s), (0, 0.26 * s, 0.18 * s * fat), pale, 5)
    y, r = 0.68 * s, draw.between(0.36, 0.42) * s
    ball(d, (r, r * 0.92, r * 0.9), (0, y, 0.03 * s), fur)
    for side in SIDES:
        path = (
            (side * 0.2 * s, 0.43 * s, 0),
            (side * 0.3 * s, 0.3 * s, 0.08 * s),
            (side * 0.3 * s, 0.2 * s, 0.16 * s),
        )
        d.add(loft(path, (0.07 * s, 0.075 * s, 0.07 * s)), fur)
        path = (
            (side * 0.14 * s, 0.1 * s, 0.08 * s),
            (side * 0.2 * s, 0.1 * s, 0.3 * s),
            (side * 0.21 * s, 0.12 * s, 0.4 * s),
        )
        d.add(loft(path, (0.1 * s, 0.09 * s, 0.1 * s)), fur)
        ball(d, (0.14 * s, 0.16 * s, 0.04 * s), (side * 0.21 * s, 0.12 * s, 0.455 * s), pale, 5)
        ball(d, (0.04 * s, 0.04 * s, 0.03 * s), (side * 0.08 * s, y + 0.05 * s, 0.03 * s + r * 0.4), BLACK, 4)
        if style == 0:
            ball(d, (0.15 * s, 0.15 * s, 0.07 * s), (side * r * 0.42, y + r * 0.4, 0.01 * s), fur, 5)
            ball(d, (0.09 * s, 0.09 * s, 0.04 * s), (side * r * 0.42, y + r * 0.4, 0.035 * s), pale, 4)
        elif style == 1:
            path = (
                (side * 0.07 * s, y + r * 0.4, 0),
                (side * 0.1 * s, y + 0.3 * s, 0),
                (side * 0.13 * s, y + 0.42 * s, 0),
            )
            d.add(loft(path, (0.05 * s, 0.06 * s, 0.03 * s)), fur)
        else:
            ball(d, (0.3 * s, 0.34 * s, 0.05 * s), (side * 0.28 * s, y, -0.02 * s), fur)
            ball(d, (0.2 * s, 0.24 * s, 0.05 * s), (side * 0.28 * s, y, 0.0), pale, 5)
    z = 0.03 * s + r * 0.4
    if style == 2:
        path = ((0, y - 0.04 * s, z), (0, y - 0.14 * s, z + 0.1 * s), (0, y - 0.2 * s, z + 0.22 * s))
        d.add(loft(path, (0.07 * s, 0.055 * s, 0.045 * s)), fur)
    else:
        ball(d, (0.17 * s, 0.14 * s, 0.12 * s), (0, y - 0.06 * s, z), pale, 5)
        ball(d, (0.06 * s, 0.04 * s, 0.04 * s), (0, y - 0.02 * s, z + 0.05 * s), BLACK, 4)
    if draw.chance(0.4):
        bow = vivid(draw)
        for side in SIDES:
            ball(d, (0.13 * s, 0.1 * s, 0.05 * s), (side * 0.07 * s, 0.49 * s, 0.2 * s), bow, 4)
    return d


def _fur(draw: Draw, colours: Sequence[Vector]) -> tuple[Look, Look]:
    """Two coats: the same, or a second for the marks."""
    fur = plain(draw.one_of(colours))
    return fur, fur if draw.chance(0.35) else plain(
        draw.one_of(((0.93, 0.91, 0.87), (0.07, 0.06, 0.06), draw.one_of(colours)))
    )


def _head(
    d: Design, draw: Draw, at: Vector, s: float, snout: float, coats: tuple[Look, Look], ears: int
) -> None:
    """Skull, snout, eyes, nose and ears (0 pointed, 1 hanging, 2 long) of a head of size s."""
    (x, y, z), (fur, marks) = at, coats
    ball(d, (0.92 * s, 0.85 * s, 0.95 * s), at, fur)
    tip = z + (0.4 + snout) * s
    path = ((x, y - 0.1 * s, z + 0.2 * s), (x, y - 0.15 * s, tip))
    d.add(loft(path, (0.3 * s, (0.24 - 0.08 * min(snout, 1)) * s)), marks)
    ball(d, (0.16 * s, 0.12 * s, 0.12 * s), (x, y - 0.08 * s, tip + 0.1 * s), BLACK, 4)
    eye = plain((0.5, 0.55, 0.15), 0.7) if snout < 0.15 and draw.chance(0.5) else BLACK
    for side in SIDES:
        wide = 0.13 * s if snout < 0.15 else 0.1 * s
        ball(d, (wide, wide, 0.1 * s), (x + side * 0.22 * s, y + 0.12 * s, z + 0.4 * s), eye, 4)
        if ears == 0:
            path = (
                (side * 0.25 * s, 0.2 * s, 0),
                (side * 0.32 * s, 0.42 * s, 0),
                (side * 0.36 * s, 0.62 * s, 0),
            )
            cone = loft(path, (0.2 * s, 0.13 * s, 0.02 * s), 8, 0.5)
            d.add(shifted(cone, at), fur)
        elif ears == 1:
            path = (
                (side * 0.36 * s, 0.32 * s, 0),
                (side * 0.52 * s, 0.1 * s, 0),
                (side * 0.54 * s, -0.3 * s, 0.05 * s),
            )
            flap = loft(path, (0.1 * s, 0.18 * s, 0.12 * s), 8, 1.2)
            d.add(shifted(flap, at), marks)
        else:
            path = (
                (side * 0.15 * s, 0.3 * s, -0.1 * s),
                (side * 0.2 * s, 0.75 * s, -0.2 * s),
                (side * 0.24 * s, 1.15 * s, -0.25 * s),
            )
            flap = loft(path, (0.1 * s, 0.16 * s, 0.06 * s), 8, 0.6)
            d.add(shifted(flap, at), fur)


def _coat(d: Design, draw: Draw, body: Triangles, coats: tuple[Look, Look], s: float) -> None:
    """A body in one colour, striped, or spotted."""
    centre, style = body.mean(1), draw.style(3)
    marked = np.zeros(len(body), dtype=bool)
    if style == 1:
        marked = (np.sin(centre[:, 2] * 30 / s) > 0.4) & (centre[:, 1] > np.median(centre[:, 1]))
    elif style == 2:
        waves = draw.rng.normal(0, 9 / s, (3, 2))
        marked = np.sin(centre @ waves).sum(1) > 0.6
    dappled(d, body, marked, *coats)


def _standing(d: Design, draw: Draw, s: float, leg: float, girth: float, coats: tuple[Look, Look]) -> Vector:
    """A four-legged body of length s; returns where the head goes."""
    fur, marks = coats
    back = leg + girth * 0.8
    path = (
        (0, back, -0.5 * s),
        (0, back + 0.01, -0.2 * s),
        (0, back - 0.02 * s, 0.2 * s),
        (0, back, 0.45 * s),
    )
    body = loft(path, (girth, girth * 0.95, girth * 1.1, girth), 12, 0.85)
    _coat(d, draw, body, coats, s)
    stride = draw.between(-0.15, 0.15) * leg
    for side in SIDES:
        for z, bow in ((-0.46 * s, -0.06 * s), (0.42 * s, 0.0)):
            x, foot = side * girth * 0.55, z + side * stride
            limb = (
                (x, back - 0.2 * girth, z),
                (x, leg * 0.5, (z + foot) / 2 + bow),
                (x, 0.03 * s, foot + 0.01 * s),
            )
            d.add(loft(limb, (girth * 0.6, girth * 0.32, girth * 0.27), 8), fur)
            ball(d, (girth * 0.55, 0.07 * s, girth * 0.8), (x, 0.03 * s, foot + 0.03 * s), marks, 5)
    head = (0.0, back + draw.between(0.25, 0.42) * s, 0.68 * s)
    d.add(loft(((0, back, 0.4 * s), head), (girth * 0.85, girth * 0.6)), fur)
    return head


def _sitting(d: Design, draw: Draw, s: float, girth: float, coats: tuple[Look, Look]) -> Vector:
    fur, marks = coats
    path = (
        (0, girth * 0.9, -0.3 * s),
        (0, 0.32 * s, -0.18 * s),
        (0, 0.6 * s, 0.04 * s),
        (0, 0.85 * s, 0.14 * s),
    )
    body = loft(path, (girth * 1.15, girth * 1.25, girth * 0.95, girth * 0.55), 12)
    _coat(d, draw, body, coats, s)
    ball(d, (girth * 1.1, 0.45 * s, girth * 0.9), (0, 0.52 * s, 0.09 * s), marks, 5)
    for side in SIDES:
        x = side * girth * 0.5
        path = ((x, 0.5 * s, 0.12 * s), (x, 0.25 * s, 0.2 * s), (x, 0.03 * s, 0.2 * s))
        d.add(loft(path, (girth * 0.4, girth * 0.28, girth * 0.25), 8), fur)
        ball(d, (girth * 0.55, 0.08 * s, girth * 0.8), (x, 0.04 * s, 0.24 * s), marks, 5)
        ball(d, (girth * 0.9, 0.36 * s, 0.5 * s), (side * girth * 0.95, 0.19 * s, -0.12 * s), fur, 5)
        ball(d, (girth * 0.5, 0.08 * s, 0.26 * s), (side * girth * 1.1, 0.04 * s, 0.1 * s), marks, 5)
    return 0.0, 0.98 * s, 0.2 * s


def _lying(d: Design, draw: Draw, s: float, girth: float, coats: tuple[Look, Look]) -> Vector:
    fur, marks = coats
    path = ((0, girth, -0.5 * s), (0, girth * 1.1, -0.2 * s), (0, girth, 0.2 * s), (0, girth * 1.2, 0.42 * s))
    body = loft(path, (girth, girth * 1.1, girth, girth * 0.9), 12, 1.1)
    _coat(d, draw, body, coats, s)
    for side in SIDES:
        x = side * girth * 0.7
        d.add(loft(((x, 0.08 * s, 0.3 * s), (x, 0.05 * s, 0.7 * s)), (girth * 0.35, girth * 0.28), 8), fur)
        ball(d, (girth * 0.6, 0.09 * s, girth * 0.8), (x, 0.045 * s, 0.74 * s), marks, 5)
        ball(d, (girth * 0.9, girth * 1.4, 0.45 * s), (side * girth * 0.95, girth * 0.7, -0.38 * s), fur, 5)
        ball(d, (girth * 0.5, 0.09 * s, 0.3 * s), (side * girth * 1.25, 0.045 * s, -0.18 * s), marks, 5)
    head = (0.0, girth * 1.3 + draw.between(0.12, 0.35) * s, 0.62 * s)
    d.add(loft(((0, girth * 1.2, 0.4 * s), head), (girth * 0.8, girth * 0.55)), fur)
    return head


def cat(draw: Draw) -> Design:
    """Sitting, standing or lying."""
    d = Design("cat", "cat", ("pet", "animal"))
    coats, s, girth = _fur(draw, _CATS), draw.between(0.3, 0.38), draw.between(0.075, 0.1)
    style = draw.style(3)
    if style == 0:
        s *= 0.95
        head, root = _sitting(d, draw, s, girth, coats), (0.0, 0.03, -0.4 * s)
        tail = (root, (0.09, 0.03, -0.38 * s), (0.16, 0.03, -0.1 * s), (0.15, 0.03, 0.12 * s))
    elif style == 1:
        head, root = _standing(d, draw, s, 0.15, girth * 0.9, coats), (0.0, 0.22, -0.52 * s)
        tail = (root, (0.0, 0.3, -0.62 * s), (0.03, 0.42, -0.66 * s), (0.06, 0.5, -0.6 * s))
    else:
        head, root = _lying(d, draw, s, girth, coats), (0.0, 0.06, -0.58 * s)
        tail = (root, (0.1, 0.03, -0.66 * s), (0.17, 0.03, -0.4 * s), (0.18, 0.03, -0.1 * s))
    d.add(loft(tail, (0.022, 0.02, 0.019, 0.014), 8), coats[0])
    _head(d, draw, head, draw.between(0.11, 0.13), 0.02, coats, 0)
    return d


def dog(draw: Draw) -> Design:
    """Sitting, standing or lying, from the size of a terrier to a great dog's."""
    d = Design("dog", "dog", ("pet", "animal"))
    coats, s = _fur(draw, _DOGS), draw.between(0.3, 0.75)
    girth, leg = s * draw.between(0.19, 0.27), s * draw.between(0.35, 0.75)
    style = draw.style(3)
    if style == 0:
        head = _sitting(d, draw, s, girth, coats)
        tail = ((0, 0.05 * s, -0.45 * s), (0, 0.06 * s, -0.7 * s), (0.1 * s, 0.1 * s, -0.85 * s))
    elif style == 1:
        head, back = _standing(d, draw, s, leg, girth, coats), leg + girth
        tail = (
            (0, back, -0.55 * s),
            (0, back + draw.between(-0.1, 0.2) * s, -0.72 * s),
            (0, back + draw.between(-0.2, 0.4) * s, -0.8 * s),
        )
    else:
        head = _lying(d, draw, s, girth, coats)
        tail = ((0, girth * 0.6, -0.6 * s), (0.1 * s, 0.05 * s, -0.75 * s), (0.3 * s, 0.05 * s, -0.8 * s))
    thick = s * draw.between(0.035, 0.08)
    d.add(loft(tail, (thick, thick, thick * 0.6), 8), coats[0])
    ears = 1 if draw.chance(0.6) else 0
    _head(d, draw, head, s * draw.between(0.36, 0.46), draw.between(0.35, 0.75), coats, ears)
    if draw.chance(0.4):
        neck = (head[0], head[1] - 0.18 * s, head[2] - 0.1 * s)
        d.add(turned(torus(girth * 0.68, 0.025 * s, neck, 1, 14), 0, 0.5, neck), vivid(draw))
    return d


def rabbit(draw: Draw) -> Design:
    """A crouching body, long ears, a white tail."""
    d = Design("rabbit", "rabbit", ("bunny", "pet"))
    coats, s = _fur(draw, _DOGS), draw.between(0.2, 0.3)
    path = ((0, 0.36 * s, -0.38 * s), (0, 0.44 * s, -0.1 * s), (0, 0.38 * s, 0.2 * s), (0, 0.42 * s, 0.4 * s))
    body = loft(path, (0.3 * s, 0.38 * s, 0.28 * s, 0.18 * s), 12)
    _coat(d, draw, body, coats, s)
    for side in SIDES:
        ball(d, (0.24 * s, 0.4 * s, 0.5 * s), (side * 0.28 * s, 0.22 * s, -0.18 * s), coats[0], 5)
        ball(d, (0.14 * s, 0.1 * s, 0.4 * s), (side * 0.28 * s, 0.05 * s, 0.02 * s), coats[1], 5)
        ball(d, (0.13 * s, 0.25 * s, 0.22 * s), (side * 0.12 * s, 0.12 * s, 0.36 * s), coats[0], 5)
    ball(d, (0.2 * s, 0.2 * s, 0.18 * s), (0, 0.32 * s, -0.7 * s), WHITE, 5)
    at, big = (0.0, 0.66 * s, 0.5 * s), 0.42 * s
    _head(d, draw, at, big, 0.08, coats, 2)
    return d
