"""Pieces that are larger than any one thing, taken apart where their borders are.

Things in a row that answer one name touch, and come as one piece: two counters and the cupboards behind
them, the chairs along a table. Such a piece is cut along the tree of regions that a click goes through
(`langflash_core/scene/regions.py`), into the largest ones that are no larger than a thing of their name.
Borders within a chair are as strong as those between two, so what is cut of seats is put together again
where it has room on one.

Sizes: n Gaussians, t regions of a tree, p pieces, T directions.
"""

import math
from collections.abc import Callable

import numpy as np
from jaxtyping import Float, Integer

from langflash_core.scene.regions import Regions

DEEPEST = 2.4
"""m, of the shorter side on the floor: beds for two are 2.1, corner sofas some 2.3 deep."""
SEATS = ("chair", "stool", "high chair", "wheelchair")
"""Kinds for one person each, which stand in rows and touch."""
SEAT = 0.95
"""m, of a seat's longer side on the floor: chairs are up to .7, lengths that are guessed a third longer."""
SURELY = 1.6
"""Times as large as one seat: less may be one, whose depth errs. In 14 held-out rooms the widest is 1.3 m."""


def largest(kind: str) -> tuple[float, float]:
    """Metres: the longer and the shorter side on the floor that one thing of a kind has at the most."""
    return (SEAT, SEAT) if kind in SEATS else (math.inf, DEEPEST)


def taken_apart(
    tree: Regions,
    leaves: Integer[np.ndarray, " n"],
    masses: Float[np.ndarray, " n"],
    least: float,
    fits: Callable[[Integer[np.ndarray, " k"]], bool],
) -> Integer[np.ndarray, " n"]:
    """Numbers from 0 of the largest regions that fit, of some Gaussians; -1 of what is in none.

    Args:
        leaves: the region that each is of, -1 of none. masses, least: a region with less is a speck.
        fits: whether some of them, by their places, are one thing.
    """
    first, last = _spans(tree.parents)
    children: list[list[int]] = [[] for _ in range(len(tree.parents))]
    for region, parent in enumerate(tree.parents.tolist()):
        if parent >= 0:
            children[parent].append(region)
    places, numbers, count = np.append(first, -1)[leaves], np.full(len(leaves), -1), 0
    todo = [(int(root), np.flatnonzero(leaves >= 0)) for root in np.flatnonzero(tree.parents < 0)]
    while todo:
        region, rows = todo.pop()
        own = rows[(places[rows] >= first[region]) & (places[rows] < last[region])]
        if float(masses[own].sum()) < least:
            continue
        while True:  # down to where two parts are more than specks
            parts = [(child, own[(places[own] >= first[child]) & (places[own] < last[child])])
                     for child in children[region]]  # fmt: skip
            large = [part for part in parts if float(masses[part[1]].sum()) >= least]
            if len(large) != 1:
                break
            region, own = large[0]
        if not large or fits(own):
            numbers[own] = count
            count += 1
        else:
            todo += large
    return numbers


def put_together(
    lows: Float[np.ndarray, "p T"], highs: Float[np.ndarray, "p T"], most: float
) -> Integer[np.ndarray, " p"]:
    """The piece that each is put together with, again and again those two that are shortest together.

    Args:
        lows, highs: from where to where each reaches along directions over half a turn, T even.
        most: longer side of the smallest rectangle around what is put together.
    """
    into, left = np.arange(len(lows)), np.arange(len(lows))
    while len(left) > 1:
        extents = np.maximum(highs[:, None], highs) - np.minimum(lows[:, None], lows)  # (p, p, T)
        sides = np.maximum(*np.split(extents, 2, axis=-1)).min(-1)
        np.fill_diagonal(sides, np.inf)
        first, second = np.unravel_index(int(sides.argmin()), sides.shape)
        if sides[first, second] > most:
            break
        lows[first], highs[first] = np.minimum(*lows[[first, second]]), np.maximum(*highs[[first, second]])
        into[into == left[second]] = left[first]
        lows, highs, left = (np.delete(each, second, 0) for each in (lows, highs, left))
    return into


def _spans(parents: Integer[np.ndarray, " t"]) -> tuple[Integer[np.ndarray, " t"], Integer[np.ndarray, " t"]]:
    """Of each region two places, between which those of its parts are; parents come later in the tree."""
    sizes = np.ones(len(parents), int)
    for region, parent in enumerate(parents.tolist()):
        if parent >= 0:
            sizes[parent] += sizes[region]
    first, free = np.zeros(len(parents), int), 0
    starts = np.zeros(len(parents), int)  # where the next part of a region begins
    for region in range(len(parents) - 1, -1, -1):
        parent = int(parents[region])
        if parent < 0:
            first[region], free = free, free + int(sizes[region])
        else:
            first[region] = starts[parent]
            starts[parent] += sizes[region]
        starts[region] = first[region] + 1
    return first, first + sizes
