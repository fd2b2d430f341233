"""A camera that somebody carries through a rendered room: smooth, free of walls and furniture.

It goes some two metres sideways around what the first photo looks at, looking about, so that even the first
and the last picture share `MIN_OVERLAP` of what they show.

Worlds: the room's (y up), metres; T places on the way; H W pixels.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from langflash_core.lab.evaluation.side_subjects import centre_depth
from langflash_core.lab.rooms import RoomRenderer, StagedRoom
from langflash_core.lab.rooms.cameras import (
    MIN_MEDIAN_DEPTH,
    MIN_OVERLAP,
    look_at,
    overlap_fraction,
    stands_free,
)

TRIES = 40
_LOOKED = 33  # places at which the way is proven
_SMALL = 96  # pixels of the longer side, to prove what cameras see

Way = Callable[[float], Float[np.ndarray, "4 4"]]
"""World of the room to the camera, by the share of the way in [0, 1]."""


@dataclass(frozen=True)
class _Lens:
    K: np.ndarray
    size: tuple[int, int]  # (height, width)


def found_way(staged: StagedRoom, renderer: RoomRenderer, seed: int) -> Way | None:
    """A way through the room that `renderer` was last given; None where none of `TRIES` is free."""
    rng = np.random.default_rng([seed, 35, 0])
    lens = _small_lens(staged)
    for attempt in range(TRIES):
        way = _aside(staged, rng, 0.97**attempt)
        if _free(staged, way) and _shares(renderer, way, lens):
            return way
    return None


def _aside(staged: StagedRoom, rng: np.random.Generator, shrunk: float) -> Way:
    """An arc around what the sample's first photo looks at; the eye sways up, down, near and far."""
    first = staged.home
    eye, forward = -first[:3, :3].T @ first[:3, 3], first[2, :3]
    reach = float(np.clip(centre_depth(staged.views.depths[0].astype(float)), 1.0, 4.0))
    pivot = eye + forward * reach
    length = float(rng.uniform(1.4, 2.6)) * shrunk
    turn = min(length / reach, math.radians(75)) * float(rng.choice([-1.0, 1.0]))
    start = float(rng.uniform(-0.75, -0.25))  # of the arc, so that the first photo lies on it
    phases = rng.uniform(0, 2 * math.pi, 5)
    near, high = float(rng.uniform(0.08, 0.2)), float(rng.uniform(0.05, 0.15))
    yaw, pitch, roll = (math.radians(d) for d in rng.uniform((5, 2, 0.5), (11, 5, 2.0)))
    flat = eye - pivot

    def way(share: float) -> np.ndarray:
        angle = turn * (share + start)
        wave = np.sin(2 * math.pi * share * np.array([0.8, 1.1, 1.0, 0.7, 1.3]) + phases)
        cos, sin = math.cos(angle), math.sin(angle)
        arm = np.array([cos * flat[0] + sin * flat[2], flat[1], cos * flat[2] - sin * flat[0]])
        place = pivot + arm * np.array([1 + near * wave[0], 1.0, 1 + near * wave[0]])
        place[1] += high * wave[1]
        target = _turned(pivot - place, yaw * wave[2], pitch * wave[3])
        return look_at(place, place + target, roll * wave[4])

    return way


def _turned(direction: np.ndarray, yaw: float, pitch: float) -> np.ndarray:
    """A direction (y up) swung aside and tilted up."""
    flat = math.hypot(direction[0], direction[2])
    bearing = math.atan2(direction[2], direction[0]) + yaw
    rise = math.atan2(direction[1], flat) + pitch
    return np.array([math.cos(rise) * math.cos(bearing), math.sin(rise), math.cos(rise) * math.sin(bearing)])


def _free(staged: StagedRoom, way: Way) -> bool:
    """Whether a camera fits everywhere on the way."""
    views = [way(share) for share in np.linspace(0, 1, _LOOKED)]
    return all(stands_free(staged.room, -view[:3, :3].T @ view[:3, 3]) for view in views)


def _small_lens(staged: StagedRoom) -> _Lens:
    height, width = staged.views.depths.shape[1:]
    factor = _SMALL / max(height, width)
    size = (round(height * factor), round(width * factor))
    scales = np.array([size[1] / width, size[0] / height, 1.0])
    return _Lens(staged.views.Ks[0].astype(float) * scales[:, None], size)


def _shares(renderer: RoomRenderer, way: Way, lens: _Lens) -> bool:
    """Whether neither the first picture nor the last is blocked, and each shares enough with the other."""
    views = np.stack([way(0.0), way(1.0)])
    depths = np.stack([renderer.draw(view, lens.K, lens.size).depth for view in views])
    if any(np.median(d[d > 0]) < MIN_MEDIAN_DEPTH if (d > 0).any() else True for d in depths):
        return False
    Ks = np.repeat(lens.K[None], 2, axis=0)
    return all(overlap_fraction(depths[order], views[order], Ks) >= MIN_OVERLAP for order in ([0, 1], [1, 0]))
