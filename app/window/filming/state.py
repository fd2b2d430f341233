"""Key frames as the state and a scene file have them."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from langflash_core.geometry.poses import Pose, alike, on_tour, read_pose, told_pose, tour_place, tour_seconds

MOST_KEYS = 50
WAYS = (
    ("past the photos", "photos"),
    ("around it", "orbit"),
    ("along the key frames", "keys"),
    ("along the tour", "tour"),
)
"""How a film goes: for people, and for `--path`."""


@dataclass(frozen=True)
class Tour:
    """A flight along the key frames. poses: evenly spread over `seconds`. began: on the session's clock."""

    poses: tuple[Pose, ...]
    seconds: float
    began: float

    def at(self, now: float) -> Pose | None:
        """Where it is; None at its end."""
        fraction = (now - self.began) / max(self.seconds, 1e-6)
        return self.poses[int(fraction * (len(self.poses) - 1))] if 0 <= fraction < 1 else None


@dataclass(frozen=True)
class Walk:
    """A flight past the stops of a scene's tour. poses: of the stops. began: on the session's clock."""

    poses: tuple[Pose, ...]
    began: float

    def at(self, now: float) -> Pose | None:
        """Where it is; None at its end."""
        passed = now - self.began
        return on_tour(alike(self.poses), passed) if passed < tour_seconds(len(self.poses)) else None

    def place(self, now: float) -> int:
        """The number of the stop that is shown, or flown to."""
        return tour_place(len(self.poses), now - self.began)


@dataclass(frozen=True)
class Filming:
    """The filming half of the state; key frames and stops themselves are edits. tour: the flight along
    them."""

    tour: Tour | Walk | None = None


NO_FILMING = Filming()


def stored(keys: Iterable[Pose]) -> tuple[dict[str, Any], ...]:
    """Key frames as plain values for a scene's record."""
    return tuple(map(told_pose, keys))


def read(entries: Iterable[Mapping[str, Any]]) -> tuple[Pose, ...]:
    """Key frames of a scene's record; none where one is damaged."""
    try:
        return tuple(map(read_pose, entries))[:MOST_KEYS]
    except (KeyError, TypeError, ValueError, IndexError):
        return ()
