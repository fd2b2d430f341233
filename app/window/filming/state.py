"""Key frames as the state and a scene file have them."""

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from math import isfinite
from typing import Any

from langflash_core.geometry.poses import Pose, Rotation, Vector

MOST_KEYS = 50
WAYS = (("past the photos", "photos"), ("around it", "orbit"), ("along the key frames", "keys"))
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
class Filming:
    """The filming half of the state; the key frames themselves are edits. tour: the flight along them."""

    tour: Tour | None = None


NO_FILMING = Filming()


def stored(keys: Iterable[Pose]) -> tuple[dict[str, Any], ...]:
    """Key frames as plain values for a scene's record."""
    lists = ("centre", "rotation", "shift")  # as a file gives them back
    return tuple(asdict(key) | {name: list(getattr(key, name)) for name in lists} for key in keys)


def read(entries: Iterable[Mapping[str, Any]]) -> tuple[Pose, ...]:
    """Key frames of a scene's record; none where one is damaged."""
    try:
        return tuple(map(read_pose, entries))[:MOST_KEYS]
    except (KeyError, TypeError, ValueError, IndexError):
        return ()


def read_pose(entry: Mapping[str, Any]) -> Pose:
    """A pose out of a file; one of an earlier version has no span.

    Raises:
        KeyError, TypeError, ValueError, IndexError: it is damaged, or no picture can be drawn from there.
    """
    pose = Pose(
        Vector(*map(float, entry["centre"])),
        Rotation(*map(float, entry["rotation"])),
        *(float(entry[name]) for name in ("reach", "fov", "aspect")),
        shift=(float(entry["shift"][0]), float(entry["shift"][1])),
        span=None if entry.get("span") is None else float(entry["span"]),
    )
    if not _can_look(pose):
        raise ValueError(f"pose: expected one from which a picture can be drawn, received {pose}")
    return pose


def _can_look(pose: Pose) -> bool:
    """Whether a picture can be drawn from there."""
    span = 1.0 if pose.span is None else pose.span
    numbers = (*pose.centre, *pose.rotation, pose.reach, pose.fov, pose.aspect, *pose.shift, span)
    turned = sum(part * part for part in pose.rotation)
    return (
        all(map(isfinite, numbers))
        and turned > 0
        and pose.reach > 0
        and 0 < pose.fov < 180
        and pose.aspect > 0
        and span > 0
    )
