"""How much to draw, so that a slow machine stays fluent: what the last pictures cost decides.

While the camera moves, a picture should take `MOVING_SECONDS`: one that takes longer sends the next
ones down a ladder of smaller pictures, for large scenes also of fewer Gaussians once those are made; where
OpenGL runs on the processor, a scene that knows its levels moves as its coarse Gaussians with less and less
of the detail on them, and of a huge one only ever a small share is brought there. Ones that take less than
three quarters send them up again, a rung at a time, and less than half where the next rung is known to take
too long. Colour, colour with the fast mode's relevance, and exact maps are paced apart, because they cost so
differently. At rest the picture settles: at once at full size where that is quick, else smaller first and
full after a longer pause, so that neither the next drag nor the next keystroke is met by a frozen window.
"""

import math
from dataclasses import dataclass, field, replace
from enum import Enum

from langflash_core.geometry.poses import Vector

MOVING_SECONDS = 0.060
QUICK_SECONDS = 0.15  # a full picture this quick is drawn as soon as the hands rest
SETTLE_AFTER = 0.12  # seconds since the last motion, key or pointer event
FULL_AFTER = 0.70
LARGE_SCENE = 200_000  # Gaussians, from which drawing fewer of them pays
MIDDLING_SCENE = 30_000  # the same where OpenGL runs on the processor
HUGE_SCENE = 1_000_000  # the same, from which bringing all of them there would stop the window
MANY_ROWS = 1_000_000  # Gaussians, of which taking the coarse ones takes a frame's time
MANY_COARSE = 60_000  # coarse Gaussians, from which drawing fewer of these pays there
LEAST_OF_HUGE = 0.25  # of the share of a huge scene that moves: where the smallest picture of all is too slow
FAR = 0.2
"""Of the way to the middle Gaussian of what moves through a huge scene: an eye that has come so far wants
other ones, since what is near has grown by as much."""
_RUNG_FACTOR = 1.8  # about what a rung saves


class Kind(Enum):
    """What a picture holds; the value is its expected cost over colour alone, until measured."""

    COLOUR = 1.0
    FAST = 1.5
    MAPS = 4.0


@dataclass(frozen=True)
class Plan:
    """One picture to draw: its kind, the scale of the panel's sides, the share of the Gaussians."""

    kind: Kind
    scale: float = 1.0
    share: float = 1.0

    def covers(self, other: "Plan") -> bool:
        """Whether a picture of this plan has all that `other` asks for."""
        enough = self.kind is other.kind or self.kind is Kind.MAPS or other.kind is Kind.COLOUR
        return enough and self.scale >= other.scale and self.share >= other.share


SIZES = ((1.0, 1.0), (0.75, 1.0), (0.5, 1.0), (0.35, 1.0), (0.25, 1.0))
"""(scale, share) from dear to cheap; few, so that textures and levels are reused."""
SIZES_OF_LARGE_SCENES = (
    (1.0, 1.0),
    (0.75, 1.0),
    (0.5, 1.0),
    (0.5, 0.25),
    (0.35, 0.25),
    (0.35, 0.0625),
    (0.25, 0.0625),
)
SIZES_OF_MIDDLING_SCENES = (
    (1.0, 1.0),
    (0.75, 1.0),
    (0.5, 1.0),
    (0.35, 1.0),
    (0.35, 0.5),
    (0.25, 0.5),
    (0.25, 0.25),
    (0.18, 0.25),
)
"""Pixels go before Gaussians: MEASURED.md, "What moves", has all combinations."""
_START = 2  # rung of an unknown machine


SIZES_WITH_DETAIL = (
    (1.0, 1.0),
    (0.75, 1.0),
    (0.75, 0.5),
    (0.5, 0.5),
    (0.5, 0.25),
    (0.35, 0.25),
    (0.25, 0.25),
    (0.25, 0.0),
)
"""(scale, part of the detail on the coarse Gaussians); these alone show nothing more in more pixels."""
COARSER_SIZES = ((0.25, 0.5), (0.18, 0.25))
"""(scale, share of the coarse Gaussians), where these alone are `MANY_COARSE`."""


def _ladder(num_gaussians: int, slow: bool, coarse: float) -> tuple[tuple[float, float], ...]:
    if slow and num_gaussians >= MIDDLING_SCENE and coarse < 1:
        detailed = (
            (scale, part if part == 1 else coarse + part * (1 - coarse)) for scale, part in SIZES_WITH_DETAIL
        )
        many = coarse * num_gaussians >= MANY_COARSE
        return (*detailed, *((scale, coarse * share) for scale, share in COARSER_SIZES if many))
    if num_gaussians >= LARGE_SCENE:
        return SIZES_OF_LARGE_SCENES
    return SIZES_OF_MIDDLING_SCENES if slow and num_gaussians >= MIDDLING_SCENE else SIZES


@dataclass(frozen=True)
class Around:
    """Where the share of a huge scene was chosen that moves. reach: how far from the eye its middle Gaussian
    is, scene units."""

    eye: Vector
    reach: float

    def serves(self, eye: Vector) -> bool:
        """Whether another eye sees about the same sizes."""
        return math.dist(self.eye, eye) <= FAR * self.reach


@dataclass(frozen=True)
class Governor:
    """For one scene. slow: where OpenGL runs on the processor. coarse: share of its coarse Gaussians, 1 where
    it has no levels. shares: of the Gaussians, that are made; all of them and the coarse ones always are.
    full_seconds: what a picture of a kind cost last, smoothed, at full size, of `share`; rungs: where on the
    ladder a kind moves; tried: seconds that a kind took last on a rung."""

    num_gaussians: int = 0
    slow: bool = False
    coarse: float = 1.0
    shares: tuple[float, ...] = ()
    full_seconds: dict[Kind, float] = field(default_factory=dict)
    rungs: dict[Kind, int] = field(default_factory=dict)
    tried: dict[tuple[Kind, int], float] = field(default_factory=dict)

    @property
    def huge(self) -> bool:
        """Whether all that moves is a share made elsewhere."""
        return self.slow and self.coarse == 1 and self.num_gaussians >= HUGE_SCENE

    @property
    def waits(self) -> bool:
        """Whether the share that moves is made beside the frames before there is a picture."""
        return self.huge or (self.share < 1 and self.num_gaussians >= MANY_ROWS)

    @property
    def share(self) -> float:
        """Of the Gaussians that move before others are made: all, the coarse ones, or of a huge scene as many
        as a large one has."""
        if self.huge:
            return LARGE_SCENE / self.num_gaussians
        return self.coarse if self.slow and self.num_gaussians >= MIDDLING_SCENE else 1.0

    @property
    def wants(self) -> tuple[float, ...]:
        """Shares of the Gaussians that moving through the scene asks to be thinned to, the larger first."""
        return tuple(sorted({share for _, share in self._best} - {1.0, self.share}, reverse=True))

    @property
    def _best(self) -> tuple[tuple[float, float], ...]:
        """The ladder once everything is made."""
        if self.huge:
            return (*((scale, self.share) for scale, _ in SIZES), (SIZES[-1][0], self.share * LEAST_OF_HUGE))
        return _ladder(self.num_gaussians, self.slow, self.coarse)

    @property
    def ladder(self) -> tuple[tuple[float, float], ...]:
        """(scale, share) from dear to cheap."""
        made = {*self.shares} >= {*self.wants}
        return self._best if made else tuple((scale, self.share) for scale, _ in SIZES)

    def with_share(self, share: float) -> "Governor":
        """Once that share of the Gaussians is made; with other rungs one begins anew."""
        made = replace(self, shares=tuple({*self.shares, share}))
        return made if made.ladder == self.ladder else replace(made, rungs={}, tried={})

    def learn(self, plan: Plan, seconds: float, moving: bool = True) -> "Governor":
        """Account for a picture just drawn, while the camera moved or at rest."""
        full = self.full_seconds
        if plan.share == self.share:  # cost goes with the pixels, nearly
            estimate = seconds / plan.scale**2
            full = {**full, plan.kind: 0.5 * (full.get(plan.kind, estimate) + estimate)}
        if not moving or (plan.scale, plan.share) not in self.ladder:
            return replace(self, full_seconds=full)
        rung = self.ladder.index((plan.scale, plan.share))
        rungs = {**self.rungs, plan.kind: self._next(plan.kind, rung, seconds)}
        return replace(self, full_seconds=full, rungs=rungs, tried={**self.tried, (plan.kind, rung): seconds})

    def _next(self, kind: Kind, rung: int, seconds: float) -> int:
        over = math.log(max(seconds, 1e-6) / MOVING_SECONDS) / math.log(_RUNG_FACTOR)
        if over > 0:
            return min(rung + math.ceil(over), len(self.ladder) - 1)
        too_slow = self.tried.get((kind, rung - 1), 0.0) > MOVING_SECONDS
        return max(rung - 1, 0) if over < (-1.2 if too_slow else -0.5) else rung

    def moving(self, wanted: Kind) -> Plan:
        """What to draw while the camera moves.

        Exact maps where even a full picture of them is quick. Else, for relevance (`Kind.FAST`), the
        fast mode, and for atoms (`Kind.MAPS`) smaller maps, or colour where these take too long.
        """
        unknown = math.inf if self.slow else MOVING_SECONDS
        quick = self.share == 1 and self._expected(Kind.MAPS, unknown) <= MOVING_SECONDS
        if quick and wanted is not Kind.COLOUR:
            return Plan(Kind.MAPS)
        if wanted is Kind.MAPS:
            smallest = min(scale for scale, _ in SIZES)
            if self._expected(Kind.MAPS, 1.0) * smallest**2 > MOVING_SECONDS:
                wanted = Kind.COLOUR
        return Plan(wanted, *self.ladder[self.rungs.get(wanted, self._first_rung(wanted))])

    def _first_rung(self, kind: Kind) -> int:
        """By the cost of another kind, or in the middle."""
        expected = self._expected(kind, math.inf)
        if expected == math.inf:
            return len(self.ladder) - 1 if self.slow else _START
        fits = (
            rung
            for rung, (scale, share) in enumerate(self.ladder)
            if share <= self.share and expected * scale**2 <= MOVING_SECONDS
        )
        return next(fits, len(self.ladder) - 1)

    def resting(self, wanted: Kind, still: float) -> Plan | None:
        """What to draw `still` seconds after the last event; None while more may come."""
        if still < SETTLE_AFTER:
            return None
        kind = Kind.COLOUR if wanted is Kind.COLOUR else Kind.MAPS
        if still >= FULL_AFTER:
            return Plan(kind)
        full = self._expected(kind, math.inf)
        scales = [scale for scale, _ in SIZES]
        if full == math.inf:
            return Plan(kind, scales[_START])
        return Plan(kind, next((s for s in scales if full * s * s <= QUICK_SECONDS), scales[-1]))

    def _expected(self, kind: Kind, unknown: float) -> float:
        """Seconds of a full picture, measured or scaled from another kind's; `unknown` before any."""
        if kind in self.full_seconds:
            return self.full_seconds[kind]
        known = [seconds * kind.value / other.value for other, seconds in self.full_seconds.items()]
        return max(known) if known else unknown

    def next_rest(self, still: float) -> float:
        """Seconds until `resting` may answer otherwise; infinity when it never will."""
        for moment in (SETTLE_AFTER, FULL_AFTER):
            if still < moment:
                return moment - still
        return math.inf
