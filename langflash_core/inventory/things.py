"""What is in a room, how many, how large, where, how sure, and seen by which photos.

Pieces that touch are one thing where one name of the vocabulary does for all of them
(`langflash_core/inventory/pieces.py`), and it counts where it answers that name. Things stand upright: a box
has a height and a rectangle on the floor, along the walls unless another turn saves `LISTING.saves` of its
area. Sizes are those of what photos saw: the back of a cupboard that nobody saw is not measured.

Lengths are metres where the scene's scale is known or guessed, else scene units. World: +x east, +y down,
+z north, the floor at y = 0 (`langflash_core.base.records.World`). Sizes: N Gaussians, G kinds, V views.
"""

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Bool, Float, Integer
from torch import Tensor

from langflash_core.base.records import Guess, World
from langflash_core.errors import InputError
from langflash_core.export import open_scene
from langflash_core.geometry.rotations import turn_of
from langflash_core.geometry.surfels import covered_areas
from langflash_core.inventory.apart import SEAT, SEATS, SURELY, largest, put_together, taken_apart
from langflash_core.inventory.pieces import OPENINGS, STRUCTURE, Parts, parts_of_room
from langflash_core.inventory.settings import LISTING
from langflash_core.inventory.upright import upright_of
from langflash_core.language.gaussians import gaussian_relevance
from langflash_core.language.relevance import compile_query
from langflash_core.language.settings import ANSWERING
from langflash_core.language.spaces import language_space
from langflash_core.language.vocabulary import OWN
from langflash_core.level import found_world, metres_of, picture_shares
from langflash_core.scene.regions import regions_of
from langflash_core.segments import evenly, photo_shares
from langflash_core.surface.fused import fused_rows, told_in_layers
from langflash_core.types import Scene, Segments

FLAT = frozenset({
    *OPENINGS, "picture", "mirror", "clock", "calendar", "whiteboard", "dartboard", "tv", "tablet",
    "keyboard", "curtain", "rug", "mat", "towel", "towel rack", "blanket", "clothes", "hanging clothes",
    "coat hanger", "switch", "socket", "radiator", "room divider", "book", "newspaper", "tray", "ladder",
    "broom", "lamp",
})  # fmt: skip
"""Kinds that may be as thin as they look."""
Box = tuple[tuple[float, float, float], tuple[float, float, float], float, float]
Namer = Callable[[Integer[np.ndarray, " k"]], tuple[str, float]]
"""Of some of a scene's rows, by their places: their kind, and their cosine with it."""
_TURNS = np.radians(np.arange(0.0, 90.0, 3.0))


@dataclass(frozen=True)
class Thing:
    """One thing.

    id: its kind and a number, the largest first ("chair 1"). name: a person's own, or none. sure: mean
    relevancy of its surface, in (0, 1). place: of its box's middle. size: width and depth on the floor, the
    larger first, and height. turn: degrees of the width from east to north. bottom: height of its lower end
    over the floor. photos: those that show it, the one that shows most first; shares: of their pixels. cut:
    it goes on beyond the border of every photo that shows it, or nobody knows. rows: (N,) bool. thin: of a
    body photos show one side, so nobody knows its depth.
    """

    id: str
    kind: str
    name: str
    sure: float
    place: tuple[float, float, float]
    size: tuple[float, float, float]
    turn: float
    bottom: float
    photos: tuple[int, ...]
    shares: tuple[float, ...]
    cut: bool
    rows: Bool[np.ndarray, " N"] = field(repr=False, compare=False)
    thin: bool = False

    @property
    def title(self) -> str:
        """What it is called: a person's name, or its id."""
        return self.name or self.id

    @property
    def corners(self) -> Float[np.ndarray, "4 2"]:
        """East and north of its box on the floor, in order around it."""
        turn = math.radians(self.turn)
        along = np.array([math.cos(turn), math.sin(turn)]) * self.size[0] / 2
        across = np.array([-math.sin(turn), math.cos(turn)]) * self.size[1] / 2
        middle = np.array([self.place[0], self.place[2]])
        return middle + np.stack((-along - across, along - across, along + across, across - along))


@dataclass(frozen=True)
class Inventory:
    """The things of a room. scene: one surface of `given`, the scene that was asked for (`fused`).
    surface (M,): which Gaussians of that these are; None: all. scale: units of `unit` per scene unit. guess:
    where the scale is one. shares: of the photos that each Gaussian makes up. parts: of the room; those that
    answer well are its things. turn: of its walls, degrees from east to north in [-45, 45)."""

    scene: Scene = field(repr=False)
    given: Scene = field(repr=False)
    surface: Tensor | None = field(repr=False)
    world: World
    unit: str
    scale: float
    guess: Guess | None
    shares: Float[np.ndarray, "V N"] = field(repr=False)
    parts: Parts = field(repr=False)
    turn: float = 0.0
    things: tuple[Thing, ...] = ()

    def __repr__(self) -> str:
        """Three lines: how many things, of which kinds, in which unit."""
        kinds = ", ".join(f"{count} × {kind}" for kind, count in self.counts.items())
        count = len(self.things)
        return (
            f"Inventory: {count} thing{'s' * (count != 1)} (inventory.things)\n"
            f"  {kinds or '-'}\n"
            f"  lengths in {self.unit}{', a guess' if self.guess else ''}"
        )

    @property
    def counts(self) -> dict[str, int]:
        """Things of each kind, the most first."""
        kinds = [thing.kind for thing in self.things]
        return {kind: kinds.count(kind) for kind in sorted(set(kinds), key=lambda k: (-kinds.count(k), k))}

    @cached_property
    def stands(self) -> Float[np.ndarray, "N 3"]:
        """Where the scene's Gaussians are in the world, in `unit`."""
        return self.stand(self.scene.gaussians.means.detach().cpu().double().numpy())

    def stand(self, places: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
        """Where places of the scene are in the world, in `unit`."""
        return self.scale * (places - np.array(self.world.origin)) @ turn_of(self.world).T

    @cached_property
    def eyes(self) -> tuple[tuple[float, float], ...]:
        """East and north of where the photos were taken."""
        if not self.scene.photos:
            return ()
        eyes = self.scene.viewmats.double().inverse()[:, :3, 3].numpy()
        return tuple((float(east), float(north)) for east, _, north in self.stand(eyes))

    @property
    def metre(self) -> float:
        """One in `unit`; of a scene without a scale, by how far its surface spreads in rooms."""
        return 1.0 if self.unit == "m" else float(self.stands[:, [0, 2]].std() / 1.2)

    @cached_property
    def top(self) -> float:
        """Height over the floor up to which there is a room, in `unit`: its ceiling; endless where none is
        seen."""
        ceilings = np.array([kind == "ceiling" for kind in (*self.parts.kinds, "")])[self.parts.numbers]
        heights = -self.stands[ceilings, 1]
        return float(np.nanmedian(heights)) + LISTING.over * self.metre if len(heights) else math.inf

    def holds(self, thing: Thing) -> bool:
        """Whether a thing has a size, and a place in the room: not over its ceiling nor under its floor."""
        sized = sorted(thing.size)[1] >= LISTING.least_size * self.metre
        sized &= not thing.thin or thing.size[0] >= LISTING.crumb * self.metre
        return sized and thing.bottom < self.top and thing.bottom + thing.size[2] > 0

    @cached_property
    def numbers(self) -> Integer[np.ndarray, " M"]:
        """Place in `things` of what each Gaussian of `given` is of, in all of its layers; -1 of none."""
        told = np.full(len(self.scene.gaussians), -1)
        for number, thing in enumerate(self.things):
            told[thing.rows] = number
        if self.surface is None:
            return told
        numbers = np.full(len(self.surface), -1)
        numbers[self.surface.numpy()] = told
        return told_in_layers(self.given, self.surface, numbers, np.ones(len(numbers), bool), -1)

    def segments(self) -> Segments:
        """Its things as phrases of one part each of `given`, for `langflash_core.segments`."""
        members = torch.from_numpy(np.arange(len(self.things))[:, None] == self.numbers)
        sure = tuple(thing.sure for thing in self.things)
        return Segments(tuple(thing.id for thing in self.things), sure, 0.0, members, members.long())


@torch.no_grad()
def inventory(
    scene: Scene | Path | str, *, threshold: float | None = None, least: float = LISTING.least_share
) -> Inventory:
    """The things of a scene.

    Args:
        scene: or the path of one.
        threshold: mean relevancy from which a thing counts; None: the scene's calibration. least: share
            of a photo that a thing must fill in some photo.

    Raises:
        InputError: the scene holds nothing. PromptError: it has no language. WeightsError: it has no weights.
    """
    scene = open_scene(scene)
    if not len(scene.gaussians):
        raise InputError("this scene is empty; make it again, or undo what deleted it")
    surface = fused_rows(scene).cpu() if scene.layered else None
    given, scene = scene, scene if surface is None else scene.rows(surface).with_record(layered=False)
    world = scene.record.world or found_world(scene)
    given, scene = given.with_record(world=world), scene.with_record(world=world)
    metres, guess = metres_of(scene)
    scale = metres or (guess.metres if guess else 1.0)
    unit = "m" if metres or guess else "units"
    shares = photo_shares(scene).numpy()
    parts = parts_of_room(scene, shares.sum(0, dtype=float))
    whole = Inventory(scene, given, surface, world, unit, scale, guess, shares, parts)
    turn = upright_of(scene, world, whole.stands, whole.eyes, whole.metre).turn
    whole = replace(whole, turn=math.degrees(turn))
    whole = replace(whole, parts=_no_larger(whole, least))
    return replace(whole, things=_things(whole, threshold, least))


def unsure(whole: Inventory) -> tuple[Thing, ...]:
    """What answers its name too little to be listed, named on from what is."""
    listed = {thing.id for thing in whole.things}
    return tuple(thing for thing in _things(whole, 0.0, LISTING.least_share) if thing.id not in listed)


def unlisted_thing(whole: Inventory, rows: Integer[np.ndarray, " n"], others: Sequence[Thing]) -> Thing:
    """Some rows of a scene as a thing that the inventory does not list, called what they answer best.

    Args:
        others: whose names are taken, besides those of the list.
    """
    scene, names = whole.scene, [name for name in OWN if name not in (*STRUCTURE, *OPENINGS)]
    areas, seen = covered_areas(scene.gaussians), whole.shares[:, rows].sum(1)
    space, some = language_space(scene.semantics.space), scene.semantics.rows(torch.from_numpy(rows))
    weights = torch.from_numpy(areas[rows] + 1e-12)
    kind, _ = _namer(scene, rows, weights.numpy(), names)(np.arange(len(rows)))
    relevance = gaussian_relevance(some, compile_query(scene, space, [kind]))[0]
    sure = float(relevance @ weights.to(relevance) / weights.sum())
    taken = {thing.id for thing in (*whole.things, *others)}
    id = next(id for number in itertools.count(1) if (id := f"{kind} {number}") not in taken)
    return _thing(whole, id, kind, sure, rows, areas, seen)


def _things(whole: Inventory, threshold: float | None, least: float) -> tuple[Thing, ...]:
    """Parts that are things, are seen well enough, and answer their name as the threshold says: the scene's
    own in relevancy and in cosine, or the one that somebody gave. What the scene's own leaves in is numbered
    first, so that a lower one changes no name."""
    parts = whole.parts
    seen = _sums(parts.numbers, whole.shares, len(parts.kinds))  # (V, parts)
    large = [
        number
        for number in np.argsort(-seen.max(0), kind="stable")
        if parts.kinds[number] not in STRUCTURE and seen[:, number].max() >= least
    ]
    if not large:
        return ()
    scene, areas = whole.scene, covered_areas(whole.scene.gaussians)
    names = sorted({parts.kinds[number] for number in large})
    compiled = compile_query(scene, language_space(scene.semantics.space), names)
    relevance = dict(zip(names, gaussian_relevance(scene.semantics, compiled).numpy(), strict=True))
    rows = {number: np.flatnonzero(parts.numbers == number) for number in large}
    sure = {
        number: float(np.average(relevance[parts.kinds[number]][own], weights=areas[own] + 1e-12))
        for number, own in rows.items()
    }
    told = {n for n in large if sure[n] >= compiled.threshold and parts.cosines[n] >= parts.present}
    chosen = told if threshold is None else {n for n in large if sure[n] >= threshold}
    things: list[Thing] = []
    for number in sorted(chosen, key=lambda n: (n not in told, large.index(n))):  # so no number changes
        kind = parts.kinds[number]
        id = f"{kind} {1 + sum(thing.kind == kind for thing in things)}"
        found = _thing(whole, id, kind, sure[number], rows[number], areas, seen[:, number])
        if whole.holds(found):
            things.append(found)
    return tuple(sorted(things, key=lambda thing: -max(thing.shares)))


def _no_larger(whole: Inventory, least: float) -> Parts:
    """The parts; those that are larger than any thing of their kind in as many as stand there."""
    parts, areas, masses = whole.parts, covered_areas(whole.scene.gaussians), whole.shares.sum(0)
    numbers, kinds, cosines = parts.numbers.copy(), [*parts.kinds], [*parts.cosines]

    def fits(rows: Integer[np.ndarray, " n"], kind: str, slack: float = 1.0) -> bool:
        (width, depth, _), most = _box(whole, rows, areas)[1], largest(kind)
        return width <= slack * most[0] * whole.metre and depth <= slack * most[1] * whole.metre

    def surely(kind: str) -> float:
        return SURELY if kind in SEATS else 1.0

    shown = _sums(numbers, whole.shares, len(kinds)).max(0)
    large = [n for n, kind in enumerate(kinds) if kind not in (*STRUCTURE, *OPENINGS) and shown[n] >= least]
    large = [n for n in large if kinds[n] not in SEATS or cosines[n] >= parts.present]
    rows = {n: np.flatnonzero(numbers == n) for n in large}
    rows = {
        n: own for n, own in rows.items() if kinds[n] not in SEATS or _is_found(whole, kinds[n], own, areas)
    }
    big = [own for n, own in rows.items() if not fits(own, kinds[n], surely(kinds[n]))]
    if not big:
        return parts
    tree = regions_of(whole.given)
    leaves = tree.leaves if whole.surface is None else tree.leaves[whole.surface.numpy()]
    for own in big:
        name = _namer(whole.scene, own, masses[own])

        def one(some: Integer[np.ndarray, " k"], own=own, name=name) -> bool:
            return fits(own[some], name(some)[0])

        told = taken_apart(tree, leaves[own], masses[own], least, one)
        told = _whole_seats(whole, own, told, areas, name)
        numbers[own] = np.where(told < 0, -1, len(kinds) + told)
        for number in range(int(told.max(initial=-1)) + 1):
            kind, cosine = name(np.flatnonzero(told == number))
            kinds.append(kind)
            cosines.append(cosine)
    return Parts(numbers, tuple(kinds), tuple(cosines), parts.present)


def _is_found(whole: Inventory, kind: str, own: Integer[np.ndarray, " n"], areas: np.ndarray) -> bool:
    """Whether some rows of the scene are as sure of a kind as what is listed."""
    some = whole.scene.semantics.rows(torch.from_numpy(own))
    compiled = compile_query(whole.scene, language_space(some.space), [kind])
    relevance = gaussian_relevance(some, compiled)[0].numpy()
    return bool(np.average(relevance, weights=areas[own] + 1e-12) >= compiled.threshold)


def _whole_seats(
    whole: Inventory,
    own: Integer[np.ndarray, " n"],
    told: Integer[np.ndarray, " n"],
    areas: np.ndarray,
    name: Namer,
) -> Integer[np.ndarray, " n"]:
    """What rows of a scene were taken apart into, with what is of one seat as one."""
    pieces = [np.flatnonzero(told == number) for number in range(int(told.max(initial=-1)) + 1)]
    kinds, into = np.array([name(piece)[0] for piece in pieces]), np.arange(len(pieces) + 1)
    directions = np.concatenate((_TURNS, _TURNS + math.pi / 2))
    axes = np.stack((np.cos(directions), np.sin(directions)))  # (2, T)
    for seat in SEATS:
        some = np.flatnonzero(kinds == seat)
        rows = [own[pieces[number]] for number in some]
        flats = [whole.stands[each[evenly(areas[each])]][:, [0, 2]] @ axes for each in rows]
        if ends := [np.quantile(flat, ANSWERING.box_quantiles, axis=0) for flat in flats]:
            lows, highs = np.stack(ends, 1)
            into[some] = some[put_together(lows, highs, SEAT * whole.metre)]
    into[:-1] = np.unique(into[:-1], return_inverse=True)[1]
    into[-1] = -1
    return into[told]


def _namer(
    scene: Scene,
    rows: Integer[np.ndarray, " n"],
    weights: Float[np.ndarray, " n"],
    names: Sequence[str] = tuple(OWN),
) -> Namer:
    """Tells of some of the rows of a scene, by their places, which of some kinds they answer best, and
    their mean cosine with it."""
    compiled = compile_query(scene, language_space(scene.semantics.space), names, mode="cosine")
    cosines = gaussian_relevance(scene.semantics.rows(torch.from_numpy(rows)), compiled).numpy()

    def name(some: Integer[np.ndarray, " k"]) -> tuple[str, float]:
        means = cosines[:, some] @ (weights[some] / weights[some].sum())
        return names[int(means.argmax())], float(means.max())

    return name


def _sums(numbers: np.ndarray, shares: np.ndarray, count: int) -> np.ndarray:
    """(V, count) of the photos that each part fills."""
    some = numbers >= 0
    return np.stack([np.bincount(numbers[some], row[some], count) for row in shares])


def _thing(
    whole: Inventory, id: str, kind: str, sure: float, own: np.ndarray, areas: np.ndarray, seen: np.ndarray
) -> Thing:
    """The thing of some rows of the scene."""
    order = [int(view) for view in np.argsort(-seen, kind="stable") if seen[view] >= LISTING.seen]
    rows, box = np.zeros(len(areas), bool), _box(whole, own, areas)
    rows[own] = True
    return Thing(
        id, kind, whole.scene.record.thing_names.get(id, ""), sure, *box,
        tuple(order), tuple(float(seen[view]) for view in order), _is_cut_off(whole, rows, order), rows,
        kind not in FLAT and box[1][1] < LISTING.face * whole.metre,
    )  # fmt: skip


def _box(whole: Inventory, own: np.ndarray, areas: np.ndarray) -> Box:
    """`upright_box` of some rows of the scene."""
    return upright_box(whole.stands[own[evenly(areas[own])]], whole.turn)


def upright_box(points: Float[np.ndarray, "n 3"], walls: float = 0.0) -> Box:
    """Middle, size (width, depth, height), turn in degrees and height of the bottom of points in the world.

    Extents are from the 2nd to the 98th of a hundred points.

    Args:
        walls: their turn in degrees, which the box has unless another saves `LISTING.saves` of its area.
    """
    heights = np.quantile(-points[:, 1], ANSWERING.box_quantiles)
    flat = points[:, [0, 2]]
    options = []
    turns = math.radians(walls) + _TURNS
    for turn in turns:
        axes = np.array([[math.cos(turn), math.sin(turn)], [-math.sin(turn), math.cos(turn)]])
        low, high = np.quantile(flat @ axes.T, ANSWERING.box_quantiles, axis=0)
        options.append((float(np.prod(high - low + 0.02 * (high - low).max())), axes, low, high))
    best = min(range(len(options)), key=lambda k: options[k][0])
    if options[best][0] > (1 - LISTING.saves) * options[0][0]:
        best = 0
    _, axes, low, high = options[best]
    east, north = (low + high) / 2 @ axes
    (width, depth), turn = high - low, math.degrees(turns[best])
    if depth > width:
        width, depth, turn = depth, width, turn + 90
    place = (float(east), float(-heights.mean()), float(north))
    return place, (float(width), float(depth), float(heights[1] - heights[0])), float(turn), float(heights[0])


def _is_cut_off(whole: Inventory, rows: np.ndarray, views: Sequence[int]) -> bool:
    """Whether the photos that show it show it only up to their border."""
    means = whole.scene.gaussians.means.double().numpy()[rows]
    for view in views:
        shares, depths = picture_shares(whole.scene.camera(view), means)
        if ((depths <= 0) | ((shares < 0.01) | (shares > 0.99)).any(1)).mean() < 0.02:
            return False
    return True
