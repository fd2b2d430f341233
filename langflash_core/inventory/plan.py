"""A room from above: walls, what opens in them, and where things stand.

Walls are planes: what they are made of (`langflash_core/inventory/upright.py`) lies, seen from above, on a
few lines along two directions across each other; along them a histogram of offsets has a peak a wall. A wall
reaches as far as its points do, over gaps of `FLOOR_PLAN.gap`, and to the wall it meets. What is short, or
small and not seen down to the floor, may be no wall, and is none where a thing stands across it.

Lengths are in the inventory's unit; places are (east, north).
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from scipy.ndimage import gaussian_filter1d

from langflash_core.base.records import Guess
from langflash_core.inventory.pieces import OPENINGS
from langflash_core.inventory.settings import FLOOR_PLAN
from langflash_core.inventory.things import Inventory, Thing
from langflash_core.inventory.upright import Upright, upright_of

Place = tuple[float, float]  # east, north


@dataclass(frozen=True)
class PlanWall:
    """A straight wall. share: of the weight of all walls that photos saw. doubt: why it may be none."""

    start: Place
    end: Place
    share: float
    doubt: str = ""

    @property
    def length(self) -> float:
        return math.dist(self.start, self.end)


@dataclass(frozen=True)
class Opening:
    """A door or a window, as it lies in its wall."""

    thing: Thing
    start: Place
    end: Place


@dataclass(frozen=True)
class Plan:
    """A room from above. turn: degrees of its walls from east to north, in [-45, 45). things: what stands
    there, without what is in walls. astray: ids of those that go through a wall. eyes: where the photos were
    taken. unit, guess: as the inventory's."""

    walls: tuple[PlanWall, ...]
    openings: tuple[Opening, ...]
    things: tuple[Thing, ...]
    astray: frozenset[str]
    eyes: tuple[Place, ...]
    turn: float
    unit: str
    guess: Guess | None

    @property
    def bounds(self) -> tuple[Place, Place]:
        """Corners (west, south) and (east, north) of all that is drawn."""
        ends = [place for wall in self.walls for place in (wall.start, wall.end)]
        ends += [tuple(corner) for thing in self.things for corner in thing.corners]
        points = np.array([*ends, *self.eyes] or [(-1.0, -1.0), (1.0, 1.0)])
        (west, south), (east, north) = points.min(0).tolist(), points.max(0).tolist()
        return (west, south), (east, north)


def floor_plan(found: Inventory) -> Plan:
    """The plan of an inventory."""
    metre = 1.0
    if found.unit != "m":  # by the median of its extents on the floor: rooms are 4 m across
        low, high = np.nanquantile(found.stands[:, [0, 2]], (0.02, 0.98), axis=0)
        metre = float(max(np.median(high - low), 1e-6)) / 4
    pieces = upright_of(found.scene, found.world, found.stands, found.eyes, metre)
    turn = pieces.turn
    matrix = np.array([[math.cos(turn), math.sin(turn)], [-math.sin(turn), math.cos(turn)]])
    walls = _extend_to_corners(_walls(pieces.along(matrix), metre), metre)
    walls = [_back(wall, matrix) for wall in walls]
    others = [thing for thing in found.things if thing.kind not in OPENINGS]
    walls = [wall for wall in walls if not (wall.doubt and any(goes_through(t, wall, metre) for t in others))]
    placed = ((thing, _in_wall(thing, walls, metre)) for thing in found.things if thing.kind in OPENINGS)
    openings = [Opening(thing, *place) for thing, place in placed if place is not None]
    astray = {thing.id for thing in others if any(goes_through(thing, wall, metre) for wall in walls)}
    parts = tuple(walls), tuple(openings), tuple(others), frozenset(astray)
    return Plan(*parts, found.eyes, math.degrees(turn), found.unit, found.guess)


def goes_through(thing: Thing, wall: PlanWall, metre: float) -> bool:
    """Whether a thing lies on both sides of a wall. metre: one in the plan's unit."""
    start, along = np.array(wall.start), (np.array(wall.end) - wall.start) / wall.length
    aside = (thing.corners - start) @ np.array([-along[1], along[0]])
    middle = float((thing.corners.mean(0) - start) @ along)
    deep = FLOOR_PLAN.across * metre
    return bool(aside.min() < -deep and aside.max() > deep and 0 < middle < wall.length)


def _walls(pieces: Upright, metre: float) -> list[PlanWall]:
    """Walls along both axes, the largest first."""
    walls: list[PlanWall] = []
    total = float(pieces.weights.sum())
    tall = FLOOR_PLAN.low * weighted_quantile(pieces.heights, pieces.weights, 0.9) if total else 0.0
    for axis in (0, 1):
        facing = np.abs(pieces.normals[:, axis]) >= FLOOR_PLAN.faces
        offsets, along = pieces.places[facing, axis], pieces.places[facing, 1 - axis]
        weights, heights = pieces.weights[facing], pieces.heights[facing]
        for offset in _peaks(offsets, weights, metre, FLOOR_PLAN.least * total):
            near = np.abs(offsets - offset) <= FLOOR_PLAN.thick * metre
            exact = weighted_quantile(offsets[near], weights[near], 0.5)
            for low, high in _runs(along[near], weights[near], metre):
                own = near & (along >= low) & (along <= high)
                share = float(weights[own].sum()) / total
                high_enough = weighted_quantile(heights[own], weights[own], 0.9) >= tall
                if share >= FLOOR_PLAN.least / 2 and high_enough:
                    ends = ((exact, low), (exact, high)) if axis == 0 else ((low, exact), (high, exact))
                    down = weighted_quantile(heights[own], weights[own], 0.02) / metre
                    walls.append(PlanWall(*ends, share, _doubt((high - low) / metre, down, share)))
    walls.sort(key=lambda wall: -wall.share)
    return [wall for row, wall in enumerate(walls) if not any(_before(wall, w, metre) for w in walls[:row])]


def _doubt(length: float, down: float, share: float) -> str:
    """Why a wall may be none, or "". length, down: m; the latter of its lower end over the floor."""
    if length < FLOOR_PLAN.long:
        return "it is short"
    return "no photo shows it down to the floor" if share < FLOOR_PLAN.few and down > FLOOR_PLAN.down else ""


def _before(wall: PlanWall, larger: PlanWall, metre: float) -> bool:
    """Whether it stands close before a larger one, over most of its own length."""
    axis = _axis(wall)
    if axis != _axis(larger) or abs(wall.start[axis] - larger.start[axis]) > FLOOR_PLAN.beside * metre:
        return False
    low = max(wall.start[1 - axis], larger.start[1 - axis])
    high = min(wall.end[1 - axis], larger.end[1 - axis])
    return high - low > wall.length / 2


def _peaks(offsets: np.ndarray, weights: np.ndarray, metre: float, least: float) -> list[float]:
    """Offsets of walls, the heaviest first, none nearer than `FLOOR_PLAN.apart` to a heavier one."""
    if not len(offsets):
        return []
    step = FLOOR_PLAN.bin * metre
    start = float(offsets.min()) - 3 * step
    counts = np.bincount(((offsets - start) / step).astype(int), weights)
    smooth = gaussian_filter1d(np.pad(counts, 4), FLOOR_PLAN.blur / FLOOR_PLAN.bin, mode="constant")
    chosen: list[float] = []
    for row in np.argsort(-smooth, kind="stable"):
        place = start + (row - 4 + 0.5) * step
        mass = float(weights[np.abs(offsets - place) <= FLOOR_PLAN.thick * metre].sum())
        if smooth[row] <= 0 or len(chosen) > 20:
            break
        if mass >= least and all(abs(place - other) >= FLOOR_PLAN.apart * metre for other in chosen):
            chosen.append(place)
    return chosen


def _runs(along: np.ndarray, weights: np.ndarray, metre: float) -> list[tuple[float, float]]:
    """From where to where a wall's points reach, in pieces where it stops for long."""
    step = FLOOR_PLAN.step * metre
    start = float(along.min())
    counts = np.bincount(((along - start) / step).astype(int), weights)
    full = np.flatnonzero(counts > 0.1 * np.median(counts[counts > 0]))
    parts = np.split(full, np.flatnonzero(np.diff(full) * step > FLOOR_PLAN.gap * metre) + 1)
    runs = [(start + part[0] * step, start + (part[-1] + 1) * step) for part in parts if len(part)]
    return [(low, high) for low, high in runs if high - low >= FLOOR_PLAN.shortest * metre]


def _extend_to_corners(walls: list[PlanWall], metre: float) -> list[PlanWall]:
    """Walls whose ends lie on the walls that they meet."""
    met = []
    for wall in walls:
        axis, ends = _axis(wall), []
        others, far = [other for other in walls if _axis(other) != axis], FLOOR_PLAN.meets * metre
        for end in (wall.start, wall.end):
            across = [(sorted((w.start[axis], w.end[axis])), w.start[1 - axis]) for w in others]
            near = [
                place
                for (low, high), place in across
                if abs(place - end[1 - axis]) <= far and low - far <= wall.start[axis] <= high + far
            ]
            place = min(near, key=lambda value: abs(value - end[1 - axis])) if near else end[1 - axis]
            ends.append((end[0], place) if axis == 0 else (place, end[1]))
        if math.dist(*ends) >= FLOOR_PLAN.shortest * metre / 2:
            met.append(replace(wall, start=ends[0], end=ends[1]))
    return met


def _axis(wall: PlanWall) -> int:
    """Which coordinate is the same all along it."""
    return int(abs(wall.start[1] - wall.end[1]) < abs(wall.start[0] - wall.end[0]))


def _back(wall: PlanWall, matrix: np.ndarray) -> PlanWall:
    ends = np.array([wall.start, wall.end]) @ matrix
    return replace(wall, start=tuple(ends[0].tolist()), end=tuple(ends[1].tolist()))


def _in_wall(thing: Thing, walls: list[PlanWall], metre: float) -> tuple[Place, Place] | None:
    """Where a door or window lies in the wall nearest to it; None where none is near."""
    middle = np.array([thing.place[0], thing.place[2]])
    best: tuple[float, Place, Place] | None = None
    for wall in walls:
        start, end = np.array(wall.start), np.array(wall.end)
        along = (end - start) / wall.length
        place = float((middle - start) @ along)
        aside = middle - start
        across = abs(float(along[0] * aside[1] - along[1] * aside[0]))
        reach = np.abs((thing.corners - middle) @ along).max()
        near = across <= FLOOR_PLAN.hangs * metre and -reach <= place <= wall.length + reach
        if near and (best is None or across < best[0]):
            ends = (start + along * np.clip(place + step * reach, 0, wall.length) for step in (-1, 1))
            low, high = (tuple(point.tolist()) for point in ends)
            best = (across, low, high)
    return None if best is None else best[1:]


def weighted_quantile(
    values: Float[np.ndarray, " n"], weights: Float[np.ndarray, " n"], share: float
) -> float:
    """The value below which this share of the weight lies."""
    order = np.argsort(values, kind="stable")
    ends = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(ends, share * ends[-1]).clip(max=len(values) - 1)])
