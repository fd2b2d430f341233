"""Where one thing, as the scene's language has it, is several as people speak: a cabinet under its white top
is a wooden one, and the walls of a room are a left one and one behind.

Things have m places, in the viewer's axes.
"""

from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Bool, Float, Int

from langflash_core.language.settings import PARTING
from langflash_core.language.things import AWAY, RIGHT, Thing

if TYPE_CHECKING:
    from scipy.spatial import KDTree


def called_part(
    thing: Thing, colours: Float[np.ndarray, "m 3"], well: Float[np.ndarray, " m"]
) -> Bool[np.ndarray, " m"] | None:
    """What of a thing is called by a look, where the rest clearly is of another colour; None where that is
    shade, or too little, or the look is all over it. What is between is of the part that is more like it.
    Some places are judged, by those around them; every other is as the nearest of them is.

    Args:
        colours: CIELAB. well: how well each place is called so.
    """
    some = _some(np.arange(len(thing.places)))
    tree = _tree(thing.places[some])
    around = tree.query(thing.places[some], min(PARTING.around, len(some)))[1].reshape(len(some), -1)
    called = well[some][around].mean(1)
    shades = colours[some][around].mean(1) * (PARTING.shade, 1, 1)
    low, high = PARTING.clearly
    part, rest = called >= high, called <= low
    if min(part.mean(), rest.mean()) < PARTING.cut:
        return None
    one, other = (np.median(shades[own], 0) for own in (part, rest))
    if np.linalg.norm(one - other) < PARTING.another:
        return None
    nearer = np.linalg.norm(shades - one, axis=1) < np.linalg.norm(shades - other, axis=1)
    return (part | nearer)[tree.query(thing.places)[1]]


def wall_faces(thing: Thing) -> Int[np.ndarray, " m"]:
    """Numbers of the upright planes that a room's walls are, of their places; all 0 where they are one.

    Planes are lines seen from above, each the one that most of what is left lies on, of those through two
    places. What lies on none belongs to the nearest.
    """
    ground = thing.places[:, [RIGHT, AWAY]]
    slack = PARTING.off * np.linalg.norm(thing.places, axis=1)
    numbers, chance = np.full(len(ground), -1), np.random.default_rng(0)
    for number in range(PARTING.most_faces):
        some = _some(np.flatnonzero(numbers < 0))
        if not len(some):
            break
        starts, ends = ground[chance.choice(some, (2, PARTING.trials))]
        across = (ends - starts)[:, ::-1] * (1, -1)
        lengths = np.linalg.norm(across, axis=1, keepdims=True)
        across = across / np.where(lengths > 0, lengths, np.nan)  # on a line through one place lies nothing
        offsets = (across * starts).sum(1)
        best = int((abs(ground[some] @ across.T - offsets) <= slack[some, None]).sum(0).argmax())
        own = (numbers < 0) & (abs(ground @ across[best] - offsets[best]) <= slack)
        if own.mean() < PARTING.face:
            break
        numbers[own] = number
    known, left = _some(np.flatnonzero(numbers >= 0)), numbers < 0
    if not len(known):
        return np.zeros(len(ground), int)
    numbers[left] = numbers[known][_tree(thing.places[known]).query(thing.places[left])[1]]
    return numbers


def _some(rows: Int[np.ndarray, " m"]) -> Int[np.ndarray, " n"]:
    return rows[:: max(1, len(rows) // PARTING.most_places)]


def _tree(places: Float[np.ndarray, "n 3"]) -> "KDTree":
    from scipy.spatial import KDTree  # a quarter of a second, which a plain phrase has not to wait for

    return KDTree(places)
