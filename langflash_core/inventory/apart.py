"""Pieces that are deeper than any one thing, taken apart where their borders are.

Things in a row that answer one name touch, and come as one piece: two counters and the cupboards behind
them. Such a piece is cut along the tree of regions that a click goes through
(`langflash_core/scene/regions.py`), into the largest ones that are no deeper than a thing is.

Sizes: n Gaussians, t regions of a tree.
"""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float, Integer

from langflash_core.scene.regions import Regions

DEEPEST = 2.4
"""m, of the shorter side on the floor: beds for two are 2.1, corner sofas some 2.3 deep."""


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
