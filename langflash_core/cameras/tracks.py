"""Tracks: one point seen in several photos, joined from the matches of pairs.

Sizes: V views, M observations, P points.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse
from jaxtyping import Bool, Float, Int
from scipy.sparse.csgraph import connected_components

from langflash_core.rig.settings import BUNDLE


@dataclass(frozen=True)
class Tracks:
    """Observations in the order of their points, two and more of each, no two of one in one view.

    points, views (M,): which point each shows, from 0 without gaps, and where it was seen.
    pixels (M, 2): there. sigmas (M,): their standard deviations, pixels.
    """

    points: Int[np.ndarray, " M"]
    views: Int[np.ndarray, " M"]
    pixels: Float[np.ndarray, "M 2"]
    sigmas: Float[np.ndarray, " M"]

    def __len__(self) -> int:
        return len(self.points)

    @property
    def num_points(self) -> int:
        return int(self.points[-1]) + 1 if len(self.points) else 0

    def subset(
        self, keep: Bool[np.ndarray, " M"]
    ) -> tuple["Tracks", Int[np.ndarray, " m"], Int[np.ndarray, " p"]]:
        """Some of the observations (M,) bool, without points that are seen once then; and which observations
        and points those are."""
        stays = np.bincount(self.points[keep], minlength=self.num_points) >= 2
        rows = np.flatnonzero(keep & stays[self.points])
        numbers = np.cumsum(stays) - 1
        parts = (self.views[rows], self.pixels[rows], self.sigmas[rows])
        return Tracks(numbers[self.points[rows]], *parts), rows, np.flatnonzero(stays)


def thin_tracks(tracks: Tracks, most: int) -> Tracks:
    """Points that most views saw, so many that each view has `most` observations, or all of its own."""
    if len(tracks) == 0:
        return tracks
    tracks = tracks.subset(_spread_observations(tracks))[0]
    lengths = np.bincount(tracks.points)
    ends = np.cumsum(lengths)
    kept, seen = np.zeros(len(lengths), bool), np.zeros(int(tracks.views.max()) + 1, int)
    for point in np.argsort(-lengths, kind="stable"):
        views = tracks.views[ends[point] - lengths[point] : ends[point]]
        if seen[views].min() < most:
            kept[point] = True
            seen[views] += 1
    return tracks.subset(kept[tracks.points])[0]


def _spread_observations(tracks: Tracks) -> np.ndarray:
    """Of each point the observations (M,) bool that stay: all of `BUNDLE.longest` and fewer; of more so many,
    evenly, the first and the last of them too. A point that a hundred photos saw is known from a part of
    them."""
    lengths = np.bincount(tracks.points)
    ranks = np.arange(len(tracks)) - (np.cumsum(lengths) - lengths)[tracks.points]
    steps = np.maximum(lengths[tracks.points] - 1, 1)
    place, before = (number * (BUNDLE.longest - 1) // steps for number in (ranks, ranks - 1))
    return (steps < BUNDLE.longest) | (ranks == 0) | (place != before)


def no_tracks() -> Tracks:
    """Not one."""
    return Tracks(np.zeros(0, int), np.zeros(0, int), np.zeros((0, 2)), np.zeros(0))


def join_matches(
    positions: Sequence[Float[np.ndarray, "_ 2"]],
    pairs: Mapping[tuple[int, int], Int[np.ndarray, "_ 2"]],
    sigmas: Sequence[float],
) -> Tracks:
    """Matches of pairs brought together; a track with two places in one view contradicts itself and goes.

    Args:
        positions: per view (n, 2) of its key points, pixels. pairs: of views i < j the rows (m, 2) that
            correspond. sigmas: per view, pixels.
    """
    firsts = np.concatenate(([0], np.cumsum([len(own) for own in positions])))
    places = np.concatenate([_places(own) for own in positions]) if len(positions) else np.zeros(0, int)
    count, views = int(firsts[-1]), np.repeat(np.arange(len(positions)), np.diff(firsts))
    places = places + firsts[views]  # key points of one place, of several directions, are one
    links = [firsts[list(edge)] + rows for edge, rows in pairs.items() if len(rows)]
    if not links:
        return no_tracks()
    ends = places[np.concatenate(links)]
    graph = scipy.sparse.coo_matrix((np.ones(len(ends), bool), (ends[:, 0], ends[:, 1])), (count, count))
    _, parts = connected_components(graph, directed=False)
    nodes = np.unique(ends)
    nodes = nodes[np.lexsort((views[nodes], parts[nodes]))]
    twice = np.flatnonzero((np.diff(parts[nodes]) == 0) & (np.diff(views[nodes]) == 0))
    nodes = nodes[~np.isin(parts[nodes], parts[nodes[twice]])]
    _, points = np.unique(parts[nodes], return_inverse=True)
    return Tracks(points, views[nodes], np.concatenate(positions)[nodes], np.asarray(sigmas)[views[nodes]])


def with_pairs(
    tracks: Tracks,
    pairs: Sequence[tuple[int, int, Float[np.ndarray, "_ 2"], Float[np.ndarray, "_ 2"], float]],
) -> Tracks:
    """Tracks, and after them points that two views alone saw.

    Args:
        pairs: views i and j, pixels (n, 2) in each, and their standard deviation.
    """
    points, views, pixels, sigmas = [tracks.points], [tracks.views], [tracks.pixels], [tracks.sigmas]
    count = tracks.num_points
    for i, j, seen_i, seen_j, sigma in pairs:
        points.append(np.repeat(np.arange(len(seen_i)) + count, 2))
        views.append(np.tile((i, j), len(seen_i)))
        pixels.append(np.stack((seen_i, seen_j), 1).reshape(-1, 2))
        sigmas.append(np.full(2 * len(seen_i), sigma))
        count += len(seen_i)
    return Tracks(*(np.concatenate(parts) for parts in (points, views, pixels, sigmas)))


def _places(positions: np.ndarray) -> np.ndarray:
    """Of each key point the first one at the same place, (n,)."""
    if not len(positions):
        return np.zeros(0, int)
    _, firsts, inverse = np.unique(positions, axis=0, return_index=True, return_inverse=True)
    return firsts[inverse.ravel()]
