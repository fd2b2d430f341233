"""What a score means: how many phrases that scored so were there, on photos kept aside for it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

_SETS = (("photos", "real photos"), ("rooms", "rendered rooms"))  # the better one first, with its name


@dataclass(frozen=True)
class Reliability:
    """A reliability diagram, scores ascending. present: share of phrases with that score that were there.
    on: what it was measured on."""

    scores: tuple[float, ...]
    present: tuple[float, ...]
    on: str

    def at(self, score: float) -> float:
        """The share at a score, between the measured ones on a line, outside the nearest one."""
        return float(np.interp(score, self.scores, self.present))


def reliability(
    calibration: Mapping[str, Any], newer: Sequence[tuple[float, float]] = ()
) -> Reliability | None:
    """Of a scene's calibration, which its network brought; None where nobody measured it.

    Args:
        newer: scores and shares of photos that go before the calibration's own (`Leads.reliability`).
    """
    sets = calibration.get("reliability")
    if sets and newer:
        sets = {"photos": [{"score": score, "present": present} for score, present in newer]}
    for name, on in _SETS:
        try:
            pairs = sorted((float(row["score"]), float(row["present"])) for row in sets[name])  # type: ignore[index]
        except (KeyError, TypeError, ValueError):
            continue
        if len(pairs) > 1 and np.isfinite(pairs).all():
            scores, present = zip(*pairs, strict=True)
            return Reliability(scores, present, on)
    return None
