"""Numbers that `inventory` decides by: one frozen record a subject, each number with its unit and its
reason."""

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Alignment:
    """Two scenes of one room, laid over each other (`inventory.alignment`)."""

    ratio: float = 0.8
    """Lowe's, of matches."""
    points: int = 3000
    """Key points of a photo."""
    least: int = 12
    """Matches that agree: fewer do by chance."""
    agree: float = 0.15
    """Share of all matches, that agree."""
    scales: tuple[float, float] = (1.6, 2.5)
    """Up to which scenes in metres and others may differ; guessed ones too, if need be."""
    near: float = 0.12
    """Metres within which matches agree."""
    tries: int = 4000
    """Pairs of matches that say a transform."""


ALIGNMENT = Alignment()


@dataclass(frozen=True)
class Beside:
    """Things of two scenes compared (`inventory.beside`)."""

    stays: float = 0.35
    """Share of a thing's width by which it may seem to move, and stayed; at least `still`."""
    still: float = 0.12
    """Metres by which a thing may seem to move, and stayed: what depth and poses err."""
    alike: float = 0.6
    """Share by which widths and heights of one thing may differ between two scenes."""
    flat: float = 0.12
    """Metres: what is thinner cannot be told from what is behind it."""
    known: float = 0.3
    """Of a thing's surface: so much has to be seen in the other scene,"""
    gone: float = 0.5
    """and of that, so much is looked through where the thing is not."""
    edge: float = 1 / 3
    """Of a part of the room: where less has gone, that is an edge of it that lies otherwise."""
    rest: float = 0.5
    """Of a change, that is of no listed thing."""
    same: float = 1.25
    """Affinity of looks from which two things may be one: the same one in two scenes has 1.3 to 1.9,
    others up to 1.5 (8 rooms beyond those judged)."""
    looks: float = 2.0
    """Metres of way, as which an affinity lower by 1 weighs."""
    touching: float = 0.1
    """Metres between things that touch."""


BESIDE = Beside()


@dataclass(frozen=True)
class Gone:
    """What is there no more (`inventory.gone`)."""

    behind: tuple[float, float] = (0.03, 0.02)
    """Metres, and share of depth: how far behind a surface something else has to be seen. Fits are good to 3
    cm."""
    there: tuple[float, float] = (0.08, 0.05)
    """The same, by which a surface may be off that is still there."""
    otherwise: float = 0.6
    """Cosine of what two places say below which they are of other things: unmoved ones keep .8 and more,
    those that are narrower than a patch of the network .5."""
    colours: tuple[float, float] = (0.15, 3.0)
    """How far apart colours are that differ: of 1, and times what is usual between the two scenes."""
    dark: float = 1e-3
    """Of 1: darker colours say nothing about light."""
    least: float = 0.01
    """Of a photo: smaller changes are edges that lie otherwise. Chosen on eight rooms beyond those judged."""


GONE = Gone()


@dataclass(frozen=True)
class Presence:
    """Pieces of a room (`inventory.pieces`)."""

    things: float = 0.5
    """Share of the cosine from which a phrase of a thing is present; as below, chosen on 18 rooms beyond
    those that are judged."""
    room: float = 0.2
    """The same of a phrase of the room itself."""
    contact: float = 0.1
    """Of the smaller one's border, by which two pieces have to touch."""
    least: float = 1e-4
    """Of a photo: smaller pieces are of nothing."""


PRESENCE = Presence()


@dataclass(frozen=True)
class FloorPlan:
    """Walls of a room 4 m across (`inventory.plan`); all lengths are scaled where the unit is no metre."""

    bin: float = 0.03
    """Metres of offset, of the histogram in which walls are peaks."""
    blur: float = 0.07
    """Metres, standard deviation by which that histogram is smoothed."""
    thick: float = 0.15
    """Metres from a wall's plane, of what belongs to it."""
    apart: float = 0.30
    """Metres between two walls side by side."""
    step: float = 0.10
    """Metres along a wall, in which it is looked for."""
    gap: float = 1.2
    """Metres along a wall without any of it, from which on it is two."""
    shortest: float = 0.5
    """Metres of a wall."""
    meets: float = 0.6
    """Metres by which a wall is lengthened to the wall that it meets."""
    least: float = 0.03
    """Of the weight of all walls, from which a peak is one."""
    nearest: float = 0.5
    """Metres from a photo: what is nearer weighs no more."""
    beside: float = 0.75
    """Metres from a larger wall along the same piece of floor: what is there stands before it."""
    low: float = 0.6
    """Of the height that walls are seen to: what ends below is furniture."""
    upright: float = math.sin(math.radians(35))
    """Sine of a normal's angle to the floor, below which a surface is upright."""
    faces: float = math.cos(math.radians(40))
    """Cosine of a normal with an axis of the room that it faces along."""
    long: float = 1.2
    """Metres: of 61 longer walls of 14 held-out rooms 53 are true ones, of 23 shorter ones 11."""
    few: float = 0.1
    """Of the weight of all walls: what is less, and"""
    down: float = 0.3
    """ends higher than so many metres over the floor, is doubted."""
    across: float = 0.3
    """Metres on either side of a wall, beyond what depth errs: what lies on both goes through it."""
    hangs: float = 0.45
    """Metres from a wall, of a door or window in it."""


FLOOR_PLAN = FloorPlan()


@dataclass(frozen=True)
class Listing:
    """What an inventory lists (`inventory.things`)."""

    least_share: float = 0.003
    """Of a photo: what no photo shows so large is no thing of an inventory."""
    least_size: float = 0.05
    """Metres, of the second of a thing's three extents: what is smaller is a crumb or a line."""
    face: float = 0.06
    """Metres of depth, twice what fits err: a body that is thinner shows one side of it, and nobody knows how
    deep it is;"""
    crumb: float = 0.3
    """metres of width, below which such a side is no thing."""
    over: float = 0.1
    """Metres over the ceiling, from which on nothing stands in the room: depth there errs with its height."""
    seen: float = 0.0005
    """Of a photo that shows a thing."""
    saves: float = 0.25
    """Of its area, that a thing's rectangle saves by another turn than the walls'. A square one that stands
    askew by 20 degrees saves .39; a desk along a wall seemed to save .2, and its corner went through it."""


LISTING = Listing()
