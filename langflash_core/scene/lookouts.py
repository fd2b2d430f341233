"""Where people would stand in a scene of nothing but Gaussians, and which way they would look.

Nobody says where such a scene was taken from; its own spread and density do. Eyes are tried all over its
middle box and around that, where nothing is near. What an eye sees is found on a small panorama of the
nearest points. A view counts by the points that it shows, at the distance from which people look at things,
and that no view before showed as well; it counts less where it shows nothing, or what is right before it.

What was seen from near is made of small Gaussians, what was seen from afar of large ones. So where the
logarithms of size and distance of what an eye sees go together, cameras stood; where they do not, one sees
backs. (In a kitchen of nine photos they correlate by .3 to .5 within .3 of a unit of a photo's place, by .1
at .5, and by -.1 beyond 1.)

Sizes: E eyes, S points, B cells of a panorama. Angles in radians; the world has +y down.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from langflash_core.geometry.cameras import intrinsics_from_fov
from langflash_core.scene.bare import middle_box, seen_rows
from langflash_core.types import Camera, Gaussians

FOV = 70.0
"""Degrees of the longer side: a phone's main lens."""
_POINTS = 8_000  # that are looked at
_ACROSS = 9  # eyes along each side of the ground
_HEIGHTS = (0.4, 0.55, 0.75, 1.0)  # of the box, from its floor
_AROUND = 1.7  # times the box, in which eyes are tried
_DEEP = 0.5  # of the diagonal, that the box has at least: before a wall one stands, too
_FREE = 0.07  # of the box's diagonal, within which an eye has nothing
_FAR, _SPREAD = 0.4, 0.7  # of the diagonal, from which people look at things, and of its logarithm
_WAYS = 12  # to look around
_PITCHES = (0.0, 0.3)  # level, and a little down
_DOWN, _AROUND_CELLS = 16, 32  # cells of a panorama
_INFORMED = 0.05  # correlation of size and distance of the best eye, from which they tell anything
_SURE, _DOUBTED = 3, 0.02
"""By which power of its correlation an eye is believed, the best one wholly, and how much one is at least."""
_LEAST = 0.02  # of what the first view adds, that another one adds
_SURFACE = 1.1  # times the nearest distance in a cell, within which others are seen, too


def lookouts(gaussians: Gaussians, count: int, size: tuple[int, int]) -> list[Camera]:
    """Cameras that show a scene between them, the one that shows most first.

    Args:
        gaussians: N >= 1, upright: +y is down. count: of cameras, at most. size: their (width, height).
    """
    rows = seen_rows(gaussians)
    rows = rows[torch.linspace(0, len(rows) - 1, min(_POINTS, len(rows))).long()]
    means = gaussians.means[rows].double().cpu()
    low, high = (corner.numpy() for corner in middle_box(means))
    inside = ((means.numpy() >= low) & (means.numpy() <= high)).all(1)
    points, sizes = means.numpy()[inside], _log_sizes(gaussians, rows)[inside]
    least = float(np.exp(np.median(sizes)))  # of a single Gaussian, or of many in one place
    diagonal = max(float(np.hypot(*(high - low)[[0, 2]])), least)
    panoramas = [_Panorama.of(eye, points, sizes) for eye in _eyes(low, high, points, diagonal)]
    trusts = _trusts(panoramas)
    K = intrinsics_from_fov(FOV, *size)
    halves = math.atan(size[0] / 2 / float(K[0, 0])), math.atan(size[1] / 2 / float(K[1, 1]))
    looks = [
        look
        for panorama, trust in zip(panoramas, trusts, strict=True)
        for look in panorama.looks(halves, diagonal, trust)
    ]
    return [_camera(look, K, size) for look in _best(looks, len(points), count)]


@dataclass(frozen=True)
class _Look:
    """From an eye (3,) along a yaw and a pitch; shown: numbers of the points that it shows, and counts, what
    each counts, in [0, 1]."""

    eye: np.ndarray
    yaw: float
    pitch: float
    shown: np.ndarray
    counts: np.ndarray


@dataclass(frozen=True)
class _Panorama:
    """What an eye (3,) sees: numbers of the points, with azimuth, angle below the horizon and distance; and
    the nearest distance in each cell (_DOWN, _AROUND_CELLS), endless where there is nothing. alike:
    correlation of the logarithms of size and distance of what it sees."""

    eye: np.ndarray
    seen: np.ndarray
    azimuth: np.ndarray
    below: np.ndarray
    distance: np.ndarray
    nearest: np.ndarray
    alike: float

    @staticmethod
    def of(eye: np.ndarray, points: np.ndarray, sizes: np.ndarray) -> "_Panorama":
        ways = points - eye
        distance = np.linalg.norm(ways, axis=1).clip(1e-12)
        azimuth, below = np.arctan2(ways[:, 0], ways[:, 2]), np.arcsin((ways[:, 1] / distance).clip(-1, 1))
        column = ((azimuth / (2 * math.pi) + 0.5) * _AROUND_CELLS).astype(int).clip(0, _AROUND_CELLS - 1)
        row = ((below / math.pi + 0.5) * _DOWN).astype(int).clip(0, _DOWN - 1)
        nearest = np.full((_DOWN, _AROUND_CELLS), np.inf)
        np.minimum.at(nearest, (row, column), distance)
        seen = np.flatnonzero(distance <= _SURFACE * nearest[row, column])
        alike = _correlation(np.log(distance[seen]), sizes[seen])
        return _Panorama(eye, seen, azimuth[seen], below[seen], distance[seen], nearest, alike)

    def looks(self, halves: tuple[float, float], diagonal: float, trust: float) -> Iterator[_Look]:
        """All around; halves: angles that half of a picture takes, across and down. trust: that cameras stood
        here, in [0, 1]."""
        fits = np.exp(-((np.log(self.distance / (_FAR * diagonal)) / _SPREAD) ** 2) / 2)
        cells = ((np.arange(_AROUND_CELLS) + 0.5) / _AROUND_CELLS - 0.5) * 2 * math.pi
        lines = ((np.arange(_DOWN) + 0.5) / _DOWN - 0.5) * math.pi
        for pitch in _PITCHES:
            for yaw in 2 * math.pi * np.arange(_WAYS) / _WAYS:
                inside = _within(self.azimuth, yaw, halves[0]) & (np.abs(self.below - pitch) < halves[1])
                window = np.ix_(np.abs(lines - pitch) < halves[1], _within(cells, yaw, halves[0]))
                far = self.nearest[window]
                good = float((np.isfinite(far) & (far > _FREE * diagonal)).mean()) if far.size else 0.0
                counts = trust * good**2 * fits[inside]
                yield _Look(self.eye, float(yaw), pitch, self.seen[inside], counts)


def _log_sizes(gaussians: Gaussians, rows: Tensor) -> np.ndarray:
    """Of Gaussians (n,): the logarithm of the mean of their two larger axes, which a surface has."""
    axes = gaussians.scales[rows].double().cpu().clamp_min(1e-12).log().sort(-1).values
    return axes[:, 1:].mean(-1).numpy()


def _trusts(panoramas: Sequence[_Panorama]) -> np.ndarray:
    """That cameras stood at eyes (E,), in [0, 1]: by their correlation beside the best one's, and by how much
    they see, which behind a wall is that wall, whose sizes are the same from both sides."""
    alike, seen = np.array([[eye.alike, len(eye.seen)] for eye in panoramas]).T
    told = alike.max() > _INFORMED
    trusts = ((alike / alike.max()).clip(0) ** _SURE).clip(_DOUBTED) if told else np.ones(len(alike))
    return trusts * seen / max(seen.max(), 1)


def _correlation(first: np.ndarray, second: np.ndarray) -> float:
    """Of two rows (n,); 0 where one does not change."""
    ours, theirs = first - first.mean(), second - second.mean()
    norms = float(np.linalg.norm(ours) * np.linalg.norm(theirs))
    return float(ours @ theirs) / norms if norms > 0 else 0.0


def _within(azimuth: np.ndarray, yaw: float, half: float) -> np.ndarray:
    return np.abs((azimuth - yaw + math.pi) % (2 * math.pi) - math.pi) < half


def _eyes(low: np.ndarray, high: np.ndarray, points: np.ndarray, diagonal: float) -> np.ndarray:
    """Places (E, 3) all over a box and around it that have nothing near; its middle where there is none."""
    from scipy.spatial import KDTree

    middle, half = (low + high) / 2, _AROUND * (high - low).clip(_DEEP * diagonal) / 2
    steps = np.linspace(-1, 1, _ACROSS)
    heights = high[1] - np.array(_HEIGHTS) * (high[1] - low[1])
    grid = np.meshgrid(middle[0] + half[0] * steps, heights, middle[2] + half[2] * steps, indexing="ij")
    eyes = np.stack(grid, -1).reshape(-1, 3)
    free = KDTree(points).query(eyes)[0] > _FREE * diagonal
    return eyes[free] if free.any() else middle[None]


def _best(looks: list[_Look], num_points: int, count: int) -> Iterator[_Look]:
    """At most so many, each the one that adds most to those before, as long as that is something."""
    known, first = np.zeros(num_points), 0.0
    for _ in range(count):
        gains = [float((k.counts - known[k.shown]).clip(0).sum()) for k in looks]
        best = int(np.argmax(gains))
        first = max(first, gains[best])
        if not gains[best] > _LEAST * first:
            return
        yield looks[best]
        known[looks[best].shown] = np.maximum(known[looks[best].shown], looks[best].counts)


def _camera(look: _Look, K: Tensor, size: tuple[int, int]) -> Camera:
    sine, cosine = math.sin(look.yaw), math.cos(look.yaw)
    down, level = math.sin(look.pitch), math.cos(look.pitch)
    forward = np.array([sine * level, down, cosine * level])
    right = np.array([cosine, 0.0, -sine])
    rotation = np.stack((right, np.cross(forward, right), forward))
    viewmat = np.eye(4)
    viewmat[:3, :3], viewmat[:3, 3] = rotation, -rotation @ look.eye
    return Camera(torch.from_numpy(viewmat).float(), K, *size)
