"""All photos adjusted together: their matches become tracks, and tracks tell poses, points and lenses.

Twice: what the pairs agree on gives poses that then say of every pair of photos which matches agree, also of
pairs whose own pose nobody asked for.

Sizes: V views, M observations, G lenses.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from langflash_core.base.records import FoundFocal
from langflash_core.cameras.bundle import Bundle, Optics, adjusted_bundle
from langflash_core.cameras.graph import Placed
from langflash_core.cameras.inputs import (
    PoseInput,
    depths_at,
    key_point_matches,
    normalised_sigma,
    without_camera,
)
from langflash_core.cameras.keypoints import KeyPoints
from langflash_core.cameras.known import agreeing
from langflash_core.cameras.matching import Matches
from langflash_core.cameras.tracks import Tracks, join_matches, no_tracks, thin_tracks, with_pairs
from langflash_core.rig.settings import ADJUSTMENT, MATCHING, Adjustment

Agreed = dict[tuple[int, int], Matches]


@dataclass(frozen=True)
class Sought:
    """What may be changed of V cameras. lenses: which of G each has; doubts: of each lens the standard
    deviation expected of the logarithm of its focal length; 0: it is given. bends: those in doubt may bend
    lines."""

    lenses: tuple[int, ...]
    doubts: tuple[float, ...]
    bends: bool = False


def given_lenses(num_views: int) -> Sought:
    """Nothing may be changed."""
    return Sought((0,) * num_views, (0.0,))


@dataclass(frozen=True)
class Adjusted:
    """viewmats (V, 4, 4), world = view 0. tracks: pixels as of focal lengths `growths` (V,) times those that
    were said. depths (M,): z. depth_errors (M,): of its logarithm. agreed: matches by pairs.
    lenses: of each lens what was found, None: it stays."""

    viewmats: Float[np.ndarray, "V 4 4"]
    tracks: Tracks
    depths: Float[np.ndarray, " M"]
    depth_errors: Float[np.ndarray, " M"]
    agreed: Agreed
    growths: Float[np.ndarray, " V"]
    lenses: tuple[FoundFocal | None, ...]

    def after(self, growths: Float[np.ndarray, " V"], lenses: Sequence[int]) -> "Adjusted":
        """The same where focal lengths had grown by `growths` (V,) before; lenses: as `Sought` has them."""
        by_lens = dict(zip(lenses, growths.tolist(), strict=True))
        found = tuple(
            lens and replace(lens, growth=lens.growth * by_lens[g]) for g, lens in enumerate(self.lenses)
        )
        return replace(self, growths=self.growths * growths, lenses=found)


def adjusted_photos(
    views: Sequence[PoseInput],
    points: KeyPoints,
    start: Placed,
    agreed: Agreed,
    sought: Sought,
    check: Callable[[], None],
    settings: Adjustment = ADJUSTMENT,
) -> Adjusted | None:
    """Poses of all placed views, and lenses; None where fewer than three are placed.

    A lens that the photos do not tell (too uncertain, or one that nobody takes a room with) stays as it was.

    Args:
        agreed: matches of pairs that agree with `start`. check: called between steps.
    """
    placed = [v for v in range(len(views)) if v not in start.missing]
    if len(placed) < ADJUSTMENT.fewest:
        return None
    counts = np.bincount(np.array(sought.lenses)[placed], minlength=len(sought.doubts))
    doubts = np.where(counts >= ADJUSTMENT.fewest, np.array(sought.doubts), 0.0)
    while True:
        adjusted = _run_rounds(
            list(views), points, start, agreed, np.array(sought.lenses), doubts, check, settings=settings
        )
        if adjusted is None:
            return None
        bundle, matches = adjusted
        growths = np.exp(bundle.growths)
        lost = (doubts > 0) & ~_determined_lenses(
            views, np.array(sought.lenses), growths, bundle.errors * settings.shared, settings=settings
        )
        if not lost.any():
            break
        doubts = np.where(lost, 0.0, doubts)
    lenses = tuple(
        FoundFocal(float(growth), float(settings.shared * error), int(count)) if doubt else None
        for growth, error, count, doubt in zip(growths, bundle.errors, counts, doubts, strict=True)
    )
    if sought.bends and any(lenses):
        check()
        lenses = _with_bends(
            lenses, list(views), points, bundle, matches, np.array(sought.lenses), doubts, settings=settings
        )
    of_views = growths[list(sought.lenses)]
    return Adjusted(
        bundle.viewmats, bundle.tracks, bundle.depths, bundle.depth_errors, matches, of_views, lenses
    )


def _determined_lenses(
    views: Sequence[PoseInput],
    lenses: np.ndarray,
    growths: np.ndarray,
    errors: np.ndarray,
    settings: Adjustment = ADJUSTMENT,
) -> np.ndarray:
    """Which lenses (G,) the photos tell."""
    known = errors < settings.known
    for view, lens in zip(views, lenses, strict=True):
        field = 2 * np.degrees(np.arctan(max(view.size) / 2 / (view.K[0, 0] * growths[lens])))
        known[lens] &= settings.fields[0] < field < settings.fields[1]
    return known


def _with_bends(
    found: tuple[FoundFocal | None, ...],
    views: list[PoseInput],
    points: KeyPoints,
    straight: Bundle,
    agreed: Agreed,
    lenses: np.ndarray,
    doubts: np.ndarray,
    settings: Adjustment = ADJUSTMENT,
) -> tuple[FoundFocal | None, ...]:
    """The lenses (G,) with their bends, where photos show some: adjusted again, from straight lines on."""
    tracks = thin_tracks(_tracks(views, points, agreed, settings=settings), settings.observations[-1])
    focals = np.array([view.K[0, 0] for view in views])
    optics = Optics(
        focals,
        lenses,
        doubts / settings.shared,
        np.where(doubts > 0, settings.bend_doubt / settings.shared, 0.0),
    )
    depths = log_depths(views, tracks)
    bent = adjusted_bundle(straight.viewmats, np.zeros(len(views)), straight.growths, optics, tracks, depths)
    errors = bent.bend_errors * settings.shared
    corners = np.zeros(len(doubts))  # |q| there
    for view, lens in zip(views, lenses, strict=True):
        focal = view.K[0, 0] * np.exp(bent.growths[lens])
        corners[lens] = max(corners[lens], np.hypot(*view.size) / 2 / focal)
    diagonal = MATCHING.working_side * np.hypot(*views[0].size) / max(views[0].size)
    moved = np.abs(bent.bends) * corners**2 * diagonal / 2
    shown = (np.abs(bent.bends) > settings.bend_sure * errors) & (moved > settings.bend_seen)
    shown &= 1 + 3 * bent.bends * corners**2 > settings.steepest
    return tuple(
        replace(own, growth=float(np.exp(growth)), bend=float(bend), bend_error=float(error))
        if own and seen
        else own
        for own, growth, bend, error, seen in zip(found, bent.growths, bent.bends, errors, shown, strict=True)
    )


def _run_rounds(
    views: list[PoseInput],
    points: KeyPoints,
    start: Placed,
    agreed: Agreed,
    lenses: np.ndarray,
    doubts: np.ndarray,
    check: Callable[[], None],
    settings: Adjustment = ADJUSTMENT,
) -> tuple[Bundle, Agreed] | None:
    """The last round's bundle, and the matches that agree with it."""
    logs, growths = np.log(start.scales), np.zeros(len(doubts))
    doubts = doubts / settings.shared  # what observations say is worth so much less than it seems
    focals = np.array([view.K[0, 0] for view in views])
    viewmats, matches, bundle = start.viewmats, agreed, None
    for most in settings.observations:
        check()
        tracks = thin_tracks(_tracks(views, points, matches, settings=settings), most)
        if not len(tracks):
            return None
        depths = log_depths(views, tracks)
        bundle = adjusted_bundle(viewmats, logs, growths, Optics(focals, lenses, doubts), tracks, depths)
        viewmats, growths = bundle.viewmats, bundle.growths
        matches = _agreeing(
            views, points, viewmats, np.exp(growths[lenses]), start.missing, agreed, settings=settings
        )
    assert bundle is not None
    return bundle, matches


def log_depths(views: Sequence[PoseInput], tracks: Tracks) -> Float[np.ndarray, " M"]:
    """Of the monocular maps where each observation lies, (M,)."""
    found = np.zeros(len(tracks))
    for v, view in enumerate(views):
        own = tracks.views == v
        found[own] = np.log(depths_at(view, tracks.pixels[own] / view.K[0, 0]))
    return found


def _tracks(
    views: Sequence[PoseInput], points: KeyPoints, agreed: Agreed, settings: Adjustment = ADJUSTMENT
) -> Tracks:
    """Pixels from the principal point, square ones. Dense matches are points that two views saw."""
    focals = [view.K[0, 0] for view in views]
    positions = [
        without_camera(own, view) * focal
        for own, view, focal in zip(points.positions, views, focals, strict=True)
    ]
    sigmas = [
        settings.sigma * normalised_sigma(view, 1.0) * focal
        for view, focal in zip(views, focals, strict=True)
    ]
    exact = {edge: matches.key_points[matches.key_points[:, 0] >= 0] for edge, matches in agreed.items()}
    tracks = join_matches(positions, exact, sigmas) if positions else no_tracks()
    dense = []
    for (i, j), matches in agreed.items():
        own = matches.key_points[:, 0] < 0
        if own.any():
            sigma = settings.sigma * matches.sigma * focals[j]
            dense.append((i, j, matches.x_i[own] * focals[i], matches.x_j[own] * focals[j], sigma))
    return with_pairs(tracks, dense)


def _agreeing(
    views: list[PoseInput],
    points: KeyPoints,
    viewmats: np.ndarray,
    growths: np.ndarray,
    missing: Sequence[int],
    agreed: Agreed,
    settings: Adjustment = ADJUSTMENT,
) -> Agreed:
    """Matches of all pairs of placed views that the poses allow; pairs that needed dense ones keep theirs.

    In coordinates of the lenses `growths` (V,) times as long as those of `views`; so are the answer's.
    """
    found = {}
    for i, j in points.pairs:
        if i in missing or j in missing:
            continue
        if (i, j) in agreed and (agreed[i, j].key_points[:, 0] < 0).any():
            found[i, j] = _through(agreed[i, j], growths[i], growths[j])
        elif len(points.pairs[i, j]) >= MATCHING.fewest:
            own = _through(key_point_matches(views, points, i, j), growths[i], growths[j])
            wide = replace(own, sigma=own.sigma * settings.agrees)
            own = replace(agreeing(wide, viewmats[j] @ np.linalg.inv(viewmats[i])), sigma=own.sigma)
            if len(own) >= MATCHING.fewest // 2:
                found[i, j] = own
    return found


def _through(matches: Matches, growth_i: float, growth_j: float) -> Matches:
    """Matches through lenses of so many times the focal length."""
    return replace(
        matches, x_i=matches.x_i / growth_i, x_j=matches.x_j / growth_j, sigma=matches.sigma / growth_j
    )
