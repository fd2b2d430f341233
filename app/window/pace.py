"""How large to draw, so that a slow machine stays fluent: what the last pictures cost decides.

Colour and weight maps are paced apart, because maps cost many passes. While the camera moves,
each is drawn at the scale that keeps a picture near `MOVING_SECONDS`, and colour alone when
even small maps take too long. At rest the picture settles: at once at full size where that is
quick, else smaller first and full after a longer pause, so that neither the next drag nor the
next keystroke is met by a frozen window.
"""

from dataclasses import dataclass, replace

SCALES = (1.0, 0.75, 0.5, 0.35, 0.25)  # of the panel's sides; few, so that textures are reused
MOVING_SECONDS = 0.060
QUICK_SECONDS = 0.15  # a full picture this quick is drawn as soon as the hands rest
SETTLE_AFTER = 0.12  # seconds since the last motion, key or pointer event
FULL_AFTER = 0.70
MAPS_OVER_COLOUR = 4.0  # cost of colour and maps over colour alone, until measured


@dataclass(frozen=True)
class Plan:
    """One picture to draw: scale of the panel's sides, and whether with weight maps."""

    scale: float
    maps: bool


@dataclass(frozen=True)
class Pace:
    """Seconds that a full-size picture is expected to take; None before the first."""

    colour_seconds: float | None = None
    maps_seconds: float | None = None

    def learn(self, plan: Plan, seconds: float) -> "Pace":
        """Account for a picture just drawn. Cost is taken as proportional to the pixels."""
        full = seconds / plan.scale**2
        if plan.maps:
            return replace(self, maps_seconds=_smooth(self.maps_seconds, full))
        return replace(self, colour_seconds=_smooth(self.colour_seconds, full))

    def moving(self, wants_maps: bool) -> Plan:
        """What to draw while the camera moves."""
        if wants_maps:
            scale = _scale_for(self._expected(maps=True), MOVING_SECONDS)
            if scale is not None:
                return Plan(scale, maps=True)
        return Plan(_scale_for(self.colour_seconds, MOVING_SECONDS) or SCALES[-1], maps=False)

    def resting(self, wants_maps: bool, still: float) -> Plan | None:
        """What to draw `still` seconds after the last event; None while more may come."""
        if still < SETTLE_AFTER:
            return None
        scale = 1.0 if still >= FULL_AFTER else _scale_for(self._expected(wants_maps), QUICK_SECONDS)
        return Plan(scale or SCALES[-1], maps=wants_maps)

    def _expected(self, maps: bool) -> float | None:
        """Seconds of a full picture; None before anything was measured."""
        if not maps:
            return self.colour_seconds
        if self.maps_seconds is None and self.colour_seconds is not None:
            return MAPS_OVER_COLOUR * self.colour_seconds
        return self.maps_seconds

    def next_rest(self, still: float) -> float:
        """Seconds until `resting` may answer otherwise; infinity when it never will."""
        for moment in (SETTLE_AFTER, FULL_AFTER):
            if still < moment:
                return moment - still
        return float("inf")


def _scale_for(full_seconds: float | None, budget: float) -> float | None:
    """The largest scale within the budget; the middle one when unknown; None when none fits."""
    if full_seconds is None:
        return SCALES[2]
    return next((s for s in SCALES if full_seconds * s * s <= budget), None)


def _smooth(old: float | None, new: float) -> float:
    """Half old, half new: one slow frame does not blur the picture for long."""
    return new if old is None else 0.5 * (old + new)
