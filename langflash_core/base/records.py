"""What is known of a scene besides its tensors. Imports no torch: `langflash info` reads it without."""

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any


@dataclass(frozen=True)
class Cost:
    """What it took to make a scene. It differs from run to run, so scene files do not hold it.

    timings: seconds per stage, disjoint, in order. seconds: "network" and "total", from start to
    end. peak_memory_mb: the most that the process held, None where it cannot be asked.
    """

    timings: Mapping[str, float] = field(default_factory=dict)
    seconds: Mapping[str, float] = field(default_factory=dict)
    peak_memory_mb: int | None = None


@dataclass(frozen=True)
class FoundFocal:
    """Of one lens: by what its focal length grew, its standard error as a share, photos that told it.

    bend: Brown's first radial term, k of (1 + k r^2) r, with its standard error; 0: lines are straight.
    """

    growth: float
    error: float
    photos: int
    bend: float = 0.0
    bend_error: float = 0.0


@dataclass(frozen=True)
class FoundLens:
    """What photos told of the lens that they were taken with.

    fov: degrees of the photos' longer side; error: standard error of it, degrees. photos: that told it.
    said: degrees that were assumed, or that the photos record (`recorded`). bend: Brown's first radial term,
    by which the photos were straightened, with its standard error; 0: they are as they were taken.
    """

    fov: float
    error: float
    photos: int
    said: float
    recorded: bool
    bend: float = 0.0
    bend_error: float = 0.0

    def __str__(self) -> str:
        whose = "recorded" if self.recorded else "assumed"
        straightened = f", straightened by k1 = {self.bend:.3f} ± {self.bend_error:.3f}" if self.bend else ""
        return (
            f"{self.fov:.1f} ± {self.error:.1f} degrees, found from {self.photos} photos "
            f"({whose}: {self.said:.1f}){straightened}"
        )


@dataclass(frozen=True)
class Guess:
    """How large a scene may be, where nobody told: metres per scene unit, the bounds between which it is in
    two of three rooms, and the names of what tells it."""

    metres: float
    low: float
    high: float
    by: tuple[str, ...]

    @property
    def spread(self) -> float:
        """The half width, as a share."""
        return math.sqrt(self.high / self.low) - 1


_KNOWN = {
    "up_by": ("edges", "surfaces", "told"),
    "floor_by": ("floor", "lowest", "told"),
    "north_by": ("walls", "told"),
}
"""How it is known where a scene stands."""

SURE = 2.0
"""Degrees of expected error of up, to which edges of the photos are believed without asking. Surfaces alone
lean with their depth."""


@dataclass(frozen=True)
class World:
    """Where a scene stands: level, on its floor, turned north.

    A point p of the scene is at turn (p - origin) in the world, scene units: +x east, +y down, +z north, and
    y = 0 the floor.

    turn: unit quaternion wxyz. origin: the scene's point that lies at 0. up_by: "edges" of photos,
    "surfaces" of the scene, or "told". up_error: degrees expected, 0 where it was told. floor_by: "floor"
    (what is called so), "lowest" (of what is there), or "told". north_by: "walls" (the wall that the first
    photo looks at most squarely) or "told". guess: of metres, None: nothing tells any.
    """

    turn: tuple[float, float, float, float]
    origin: tuple[float, float, float]
    up_by: str = "told"
    up_error: float = 0.0
    floor_by: str = "told"
    north_by: str = "told"
    guess: Guess | None = None

    @property
    def sure(self) -> bool:
        """Whether up is known well enough to stand a scene on it unasked."""
        return self.up_by == "told" or (self.up_by == "edges" and self.up_error <= SURE)


def world_to_json(world: World) -> dict[str, Any]:
    """Plain values, as scene files have them."""
    return asdict(world) | {"guess": asdict(world.guess) if world.guess else None}


def world_from_json(values: Mapping[str, Any]) -> World:
    """The world of plain values; keys that this version does not know are left out.

    Raises:
        ValueError: numbers that are none, no rotation, or a way of knowing that there is not.
    """
    try:
        w, x, y, z = map(float, values["turn"])
        right, down, ahead = map(float, values["origin"])
        error, length = float(values.get("up_error", 0.0)), math.hypot(w, x, y, z)
        known = {name: values.get(name, "told") for name in _KNOWN}
        guess = None if values.get("guess") is None else _guess_from_json(values["guess"])
    except (TypeError, LookupError, AttributeError) as problem:
        raise ValueError(f"world: expected turn, origin and how they are known ({problem})") from problem
    if not (abs(length - 1) < 1e-3 and all(map(math.isfinite, (right, down, ahead, error)))):
        raise ValueError(f"world: expected a unit quaternion and a place, received {values}")
    for name, value in known.items():
        if value not in _KNOWN[name]:
            raise ValueError(
                f"world: expected {name} as one of {', '.join(_KNOWN[name])}, received {value!r}"
            )
    turn = (w, x, y, z) if abs(length - 1) < 1e-12 else (w / length, x / length, y / length, z / length)
    return World(turn, (right, down, ahead), up_error=error, guess=guess, **known)


def _guess_from_json(values: Mapping[str, Any]) -> Guess:
    metres, low, high = (float(values[name]) for name in ("metres", "low", "high"))
    if not (math.isfinite(high) and 0 < low <= metres <= high):
        raise ValueError(f"world: expected a guess of 0 < low <= metres <= high, received {values}")
    return Guess(metres, low, high, tuple(map(str, values.get("by", ()))))


Shift = tuple[float, float, float]


def told_shift(shift: Shift) -> str:
    """For people: (500,000, 4,649,776, 0)."""
    return f"({', '.join(f'{value:,.15g}' for value in shift)})"


@dataclass(frozen=True)
class Record:
    """What is known of a scene besides its tensors. Mappings hold plain JSON values; empty: unknown.

    preset: of the network. source: the splat file it came from. antialiased: its splats were trained to be
    drawn so, which splat files say. photos: names, one per view.
    warnings: a sentence each. metric_scale: metres per scene unit. network_unit: the network's
    length units per scene unit. shift: what was taken off the positions of a splat file far from 0, to be put
    back where they are written as doubles; None: nothing. counts: Gaussians predicted and left out. pruning:
    as `prune` left it. layered: every photo has a whole layer of its own (`splat.compose`). detail: what
    was spent on how fine elements, and what it bought. light: `gains` and `offsets`, a row of red, green
    and blue for each view, by which `surface.exposure_compensation` brought the photos' colours to one
    light. lens: `found`, a mapping of `FoundLens` for each lens that the photos told. left_out: `shares`,
    of each view what was left out since the others do not show it (`surface.transients`), `unplaced`, names
    of photos that could not be placed, and `films`, each with its name (`film`), how many `frames` were
    looked at, and what became of those that were not taken, `why` (phrases to counts). foreseen: `covered`,
    `alike` and `nearest`, a number for each view, as `surface.foreseen` has them. world: where
    it stands; None: nobody looked. thing_names: a person's own, by what the inventory calls a thing.
    calibration: what the network's checkpoint says about scores, instead of its language space. atom_names:
    a person's own, by atom, which it answers to. atom_denials: what a person said that an atom is not.
    silent_atoms: those that answer no phrase. lone_atoms: of parts that somebody took out of an answer; what
    they are told is told to no other. num_deleted: Gaussians that edits took away. camera_path:
    the window's key frames. tour: stops and notes, as `scene.tour` has them. others: what a file says under
    keys that this version does not know.
    """

    preset: str | None = None
    layered: bool = False
    source: str | None = None
    antialiased: bool = False
    photos: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    metric_scale: float | None = None
    network_unit: float | None = None
    shift: Shift | None = None
    counts: Mapping[str, int] = field(default_factory=dict)
    pruning: Mapping[str, int] = field(default_factory=dict)
    detail: Mapping[str, Any] = field(default_factory=dict)
    light: Mapping[str, Any] = field(default_factory=dict)
    lens: Mapping[str, Any] = field(default_factory=dict)
    left_out: Mapping[str, Any] = field(default_factory=dict)
    foreseen: Mapping[str, Any] = field(default_factory=dict)
    world: World | None = None
    thing_names: Mapping[str, str] = field(default_factory=dict)
    calibration: Mapping[str, Any] = field(default_factory=dict)
    atom_names: Mapping[int, str] = field(default_factory=dict)
    atom_denials: Mapping[int, tuple[str, ...]] = field(default_factory=dict)
    silent_atoms: tuple[int, ...] = ()
    lone_atoms: tuple[int, ...] = ()
    num_deleted: int = 0
    camera_path: tuple[Mapping[str, Any], ...] = ()
    tour: Mapping[str, Any] = field(default_factory=dict)
    cost: Cost = Cost()
    others: Mapping[str, Any] = field(default_factory=dict)


def check_light(light: Mapping[str, Any], num_views: int) -> None:
    """Refuse a record's `light` that is not a finite gain above 0 and a finite offset per view and channel.

    Raises:
        ValueError: says what was expected and what was received.
    """
    if not light:
        return
    if set(light) != {"gains", "offsets"}:
        raise ValueError(f"light: expected gains and offsets, received {', '.join(map(str, light))}")
    for name, rows in light.items():
        if not isinstance(rows, list) or len(rows) != num_views or not all(map(_is_colour, rows)):
            expected = f"{num_views} rows of 3 finite numbers"
            raise ValueError(f"light: expected {name} in {expected}, received {rows!r}")
    if not all(gain > 0 for row in light["gains"] for gain in row):
        raise ValueError(f"light: expected gains above 0, received {light['gains']!r}")


def _is_colour(row: object) -> bool:
    return isinstance(row, list) and len(row) == 3 and all(map(_is_finite, row))


def _is_finite(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)
