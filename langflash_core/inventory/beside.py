"""Two scenes of one room: what came, what went, what moved.

One is brought onto the other (`langflash_core/inventory/alignment.py`). What changed is told by what photos
see, not by names, which may differ between the scenes: a listed thing of which half has gone
(`langflash_core/inventory/gone.py`) is not there; and what else has gone, touches and is large enough is a
thing too, since an inventory lists neither what it cannot name nor what it takes for a part of the wall.
What went from the first scene and what came into the second are paired where they are called the same, or
language and colours agree, and are about one size: those moved. What is flat is not looked through; there
a thing of the same kind that is farther than `BESIDE.stays` of its own width moved. What no photo of the
other scene looks at nobody knows.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Integer
from scipy.optimize import linear_sum_assignment
from scipy.spatial import KDTree

from langflash_core.errors import InputError
from langflash_core.geometry.harmonics import SH_C0
from langflash_core.geometry.surfels import covered_areas
from langflash_core.inventory.alignment import Fit, Render, align_scenes
from langflash_core.inventory.gone import Fate, changes, fate
from langflash_core.inventory.pieces import OPENINGS
from langflash_core.inventory.settings import BESIDE, GONE
from langflash_core.inventory.things import Inventory, Thing, unlisted_thing, unsure


@dataclass(frozen=True)
class Pair:
    """A thing that both scenes have. by: how far its middle moved, in the first's unit."""

    before: Thing
    after: Thing
    by: float


@dataclass(frozen=True)
class Difference:
    """What changed from the first scene to the second; `unseen`: of the first, where no photo of the second
    looks, or something is there that it has no name for, so nobody knows."""

    fit: Fit
    stayed: tuple[Pair, ...]
    moved: tuple[Pair, ...]
    went: tuple[Thing, ...]
    came: tuple[Thing, ...]
    unseen: tuple[Thing, ...]
    unit: str


def difference(first: Inventory, second: Inventory, render: Render) -> Difference:
    """What became of the things of the first scene.

    Args:
        render: draws depth of a scene from a camera.

    Raises:
        InputError: a scene holds no photos, their photos show no common room, or their languages differ.
    """
    spaces = first.scene.semantics.space, second.scene.semantics.space
    if spaces[0] != spaces[1]:
        raise InputError(
            f"one scene speaks {spaces[0]}, the other {spaces[1]}; make both with the same language"
        )
    fit, metre = align_scenes(first, second, render), first.metre
    ours = fate(first, second, fit.inverse, render, metre / fit.scale)
    fates = ours, fate(second, first, fit, render, metre)
    every = (*first.things, *unsure(first)), (*second.things, *unsure(second))
    gone, come = _absent(first, fates[0]), _absent(second, fates[1])
    moved = _pair_things(_look_at_things(first, gone), _look_at_things(second, come, fit), metre, far=True)
    here = [
        [thing for thing in things if not _has_gone(found, thing, told)]
        for found, things, told in zip((first, second), every, fates, strict=True)
    ]
    looks = _look_at_things(first, here[0]), _look_at_things(second, here[1], fit)
    still = _pair_things(*looks, metre, far=False)
    flat = [pair for pair in still if _flat(pair.before, metre) and pair.by > _still(pair.before, metre)]
    had = {pair.before.id for pair in (*moved, *still)} | {thing.id for thing in gone}
    listed = {thing.id for thing in first.things}
    return Difference(
        fit, tuple(pair for pair in still if pair not in flat and pair.before.id in listed), (*moved, *flat),
        _rest(gone, [pair.before for pair in moved], first, metre),
        _rest(come, [pair.after for pair in moved], second, metre),
        tuple(thing for thing in first.things if thing.id not in had), first.unit,
    )  # fmt: skip


def _absent(found: Inventory, told: Fate) -> list[Thing]:
    """Things that the other scene has not where this one has them; also what no name was given to."""
    things = [t for t in found.things if _has_gone(found, t, told) and max(t.shares) >= GONE.least]
    taken = np.zeros(len(told.gone), bool)
    for thing in things:
        taken |= thing.rows
    for rows in changes(found, told.gone & ~_stands(found, told)):
        left = rows[~taken[rows]]
        if _fills(found, left) >= max(GONE.least, BESIDE.rest * _fills(found, rows)):
            things.append(unlisted_thing(found, left, things))
    return things


def _stands(found: Inventory, told: Fate) -> Bool[np.ndarray, " N"]:
    """Whose part of the room, a thing, wall or floor, is still there: of it less than `BESIDE.edge` has
    gone."""
    numbers, own = found.parts.numbers, found.shares.sum(0)
    some, count = numbers >= 0, len(found.parts.kinds)
    known, gone = (np.bincount(numbers[some], (own * w)[some], count) for w in (told.known, told.gone))
    return np.append(gone < BESIDE.edge * known, False)[numbers]


def _rest(
    things: Sequence[Thing], moved: Sequence[Thing], found: Inventory, metre: float
) -> tuple[Thing, ...]:
    """What is left of what changed, but for pieces of what moved: they touch it and look the same."""
    left = [thing for thing in things if thing not in moved]
    looks = {thing.id: _look(found, thing) for thing in things}
    trees = [(thing, KDTree(found.stands[thing.rows])) for thing in moved]

    def piece(thing: Thing) -> bool:
        return any(
            looks[thing.id].affinity(looks[other.id]) >= BESIDE.same
            and tree.query(found.stands[thing.rows])[0].min() <= BESIDE.touching * metre
            for other, tree in trees
        )

    return tuple(thing for thing in left if not piece(thing))


def _shares(found: Inventory, thing: Thing, told: Fate) -> tuple[float, float]:
    """Of a thing, as photos show it, that the other photos look at; and of that, what has gone."""
    own = found.shares.sum(0) * thing.rows
    known = float(own[told.known].sum())
    return known / max(float(own.sum()), 1e-30), float(own[told.gone].sum()) / max(known, 1e-30)


def _has_gone(found: Inventory, thing: Thing, told: Fate) -> bool:
    known, gone = _shares(found, thing, told)
    return thing.kind not in OPENINGS and known >= BESIDE.known and gone >= BESIDE.gone


def _fills(found: Inventory, rows: Integer[np.ndarray, " n"]) -> float:
    """Of the photo that shows most of some rows."""
    return float(found.shares[:, rows].sum(1).max())


def _still(thing: Thing, metre: float) -> float:
    return max(BESIDE.still * metre, BESIDE.stays * thing.size[0])


def _flat(thing: Thing, metre: float) -> bool:
    """Whether what is behind it is too near to be told from it. Doors and windows stay."""
    return thing.kind not in OPENINGS and min(thing.size) < BESIDE.flat * metre


def _place_thing(thing: Thing, fit: Fit) -> Thing:
    """A thing of the second scene in the first's world."""
    place = fit.placed(np.array([thing.place]))[0]
    yaw = math.degrees(math.atan2(fit.turn[2, 0], fit.turn[0, 0]))
    width, depth, height = (fit.scale * side for side in thing.size)
    bottom = -float(place[1]) - height / 2
    return replace(
        thing, place=tuple(place.tolist()), size=(width, depth, height), turn=thing.turn + yaw, bottom=bottom
    )


@dataclass(frozen=True)
class _Look:
    """What a thing's surface says on average, unit length, and the shares of its colours, 64 bins."""

    language: Float[np.ndarray, " r"]
    colours: Float[np.ndarray, " 64"]

    def affinity(self, other: "_Look") -> float:
        """Cosine of what both say, and Bhattacharyya's coefficient of their colours: at most 2."""
        return float(self.language @ other.language) + float(np.sqrt(self.colours * other.colours).sum())


def _look(found: Inventory, thing: Thing) -> _Look:
    scene, rows = found.scene, np.flatnonzero(thing.rows)
    semantics, areas = scene.semantics, covered_areas(scene.gaussians)[rows] + 1e-12
    weights, ids = semantics.weight_values.double().numpy()[rows], semantics.weight_ids.numpy()[rows]
    mean = np.bincount(ids.ravel(), (weights * areas[:, None]).ravel(), semantics.num_atoms)
    vector = mean @ np.nan_to_num(semantics.dictionary.double().numpy())
    colours = (0.5 + SH_C0 * scene.gaussians.sh[:, 0].double().numpy()[rows]).clip(0, 1 - 1e-9)
    bins = np.bincount((4 * colours).astype(int) @ [16, 4, 1], areas, 64)
    return _Look(vector / max(float(np.linalg.norm(vector)), 1e-12), bins / bins.sum())


@dataclass(frozen=True)
class _Seen:
    """A thing, as it stands in the first world, and its look."""

    thing: Thing
    placed: Thing
    look: _Look


def _look_at_things(found: Inventory, things: Sequence[Thing], fit: Fit | None = None) -> list[_Seen]:
    return [
        _Seen(thing, thing if fit is None else _place_thing(thing, fit), _look(found, thing))
        for thing in things
    ]


def _pair_things(before: Sequence[_Seen], after: Sequence[_Seen], metre: float, *, far: bool) -> list[Pair]:
    """Things that may be the same, so that the sum of their differences is least.

    Args:
        far: they are alike in name or look, and size; else they are near, or of one name and size.
    """
    never = 1e6
    costs = np.full((len(before), len(after)), never)
    for row, one in enumerate(before):
        for column, other in enumerate(after):
            way = math.dist(one.placed.place, other.placed.place)
            alike, named = one.look.affinity(other.look), one.thing.kind == other.thing.kind
            same = (named or (far and alike >= BESIDE.same)) and _alike(one.placed, other.placed)
            if same or (not far and way <= _still(one.thing, metre)):
                costs[row, column] = way / metre + BESIDE.looks * (2 - alike)
    rows, columns = linear_sum_assignment(costs)
    return [
        Pair(before[r].thing, after[c].thing, math.dist(before[r].placed.place, after[c].placed.place))
        for r, c in zip(rows, columns, strict=True)
        if costs[r, c] < never
    ]


def _alike(one: Thing, other: Thing) -> bool:
    """Whether both may be the same thing: what a photo's border cuts has no size."""
    if one.cut or other.cut:
        return True
    sides = ((one.size[0], other.size[0]), (one.size[2], other.size[2]))
    return all(abs(a - b) <= BESIDE.alike * max(a, b) for a, b in sides)
