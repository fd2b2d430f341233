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
from langflash_core.scene.settings import LOOKOUTS
from langflash_core.types import Camera, Gaussians


def lookouts(gaussians: Gaussians, count: int, size: tuple[int, int]) -> list[Camera]:
    """Cameras that show a scene between them, the one that shows most first.

    Args:
        gaussians: N >= 1, upright: +y is down. count: of cameras, at most. size: their (width, height).
    """
    rows = seen_rows(gaussians)
    rows = rows[torch.linspace(0, len(rows) - 1, min(LOOKOUTS.points, len(rows))).long()]
    means = gaussians.means[rows].double().cpu()
    low, high = (corner.numpy() for corner in middle_box(means))
    inside = ((means.numpy() >= low) & (means.numpy() <= high)).all(1)
    points, sizes = means.numpy()[inside], _log_sizes(gaussians, rows)[inside]
    least = float(np.exp(np.median(sizes)))  # of a single Gaussian, or of many in one place
    diagonal = max(float(np.hypot(*(high - low)[[0, 2]])), least)
    panoramas = [_Panorama.of(eye, points, sizes) for eye in _eyes(low, high, points, diagonal)]
    trusts = _trusts(panoramas)
    K = intrinsics_from_fov(LOOKOUTS.fov, *size)
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
        column = (
            ((azimuth / (2 * math.pi) + 0.5) * LOOKOUTS.around_cells)
            .astype(int)
            .clip(0, LOOKOUTS.around_cells - 1)
        )
        row = ((below / math.pi + 0.5) * LOOKOUTS.down).astype(int).clip(0, LOOKOUTS.down - 1)
        nearest = np.full((LOOKOUTS.down, LOOKOUTS.around_cells), np.inf)
        np.minimum.at(nearest, (row, column), distance)
        seen = np.flatnonzero(distance <= LOOKOUTS.surface * nearest[row, column])
        alike = _correlation(np.log(distance[seen]), sizes[seen])
        return _Panorama(eye, seen, azimuth[seen], below[seen], distance[seen], nearest, alike)

    def looks(self, halves: tuple[float, float], diagonal: float, trust: float) -> Iterator[_Look]:
        """All around; halves: angles that half of a picture takes, across and down. trust: that cameras stood
        here, in [0, 1]."""
        fits = np.exp(-((np.log(self.distance / (LOOKOUTS.far * diagonal)) / LOOKOUTS.spread) ** 2) / 2)
        cells = ((np.arange(LOOKOUTS.around_cells) + 0.5) / LOOKOUTS.around_cells - 0.5) * 2 * math.pi
        lines = ((np.arange(LOOKOUTS.down) + 0.5) / LOOKOUTS.down - 0.5) * math.pi
        for pitch in LOOKOUTS.pitches:
            for yaw in 2 * math.pi * np.arange(LOOKOUTS.ways) / LOOKOUTS.ways:
                inside = _within(self.azimuth, yaw, halves[0]) & (np.abs(self.below - pitch) < halves[1])
                window = np.ix_(np.abs(lines - pitch) < halves[1], _within(cells, yaw, halves[0]))
                far = self.nearest[window]
                good = (
                    float((np.isfinite(far) & (far > LOOKOUTS.free * diagonal)).mean()) if far.size else 0.0
                )
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
    told = alike.max() > LOOKOUTS.informed
    trusts = (
        ((alike / alike.max()).clip(0) ** LOOKOUTS.sure).clip(LOOKOUTS.doubted)
        if told
        else np.ones(len(alike))
    )
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

    middle, half = (low + high) / 2, LOOKOUTS.around * (high - low).clip(LOOKOUTS.deep * diagonal) / 2
    steps = np.linspace(-1, 1, LOOKOUTS.across)
    heights = high[1] - np.array(LOOKOUTS.heights) * (high[1] - low[1])
    grid = np.meshgrid(middle[0] + half[0] * steps, heights, middle[2] + half[2] * steps, indexing="ij")
    eyes = np.stack(grid, -1).reshape(-1, 3)
    free = KDTree(points).query(eyes)[0] > LOOKOUTS.free * diagonal
    return eyes[free] if free.any() else middle[None]


def _best(looks: list[_Look], num_points: int, count: int) -> Iterator[_Look]:
    """At most so many, each the one that adds most to those before, as long as that is something."""
    known, first = np.zeros(num_points), 0.0
    for _ in range(count):
        gains = [float((k.counts - known[k.shown]).clip(0).sum()) for k in looks]
        best = int(np.argmax(gains))
        first = max(first, gains[best])
        if not gains[best] > LOOKOUTS.least * first:
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
