"""Poses of V views: relative poses of the pairs that share most, brought together in one adjustment."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from langflash_core.base.records import FoundFocal
from langflash_core.cameras.adjustment import (
    Adjusted,
    Agreed,
    Sought,
    adjusted_photos,
    given_lenses,
    log_depths,
)
from langflash_core.cameras.alignment import NO_CORRECTION, Correction, fit_correction
from langflash_core.cameras.graph import Placed, place_views
from langflash_core.cameras.inputs import PoseInput, dense_matches, depths_at, key_point_matches, with_dense
from langflash_core.cameras.keypoints import KeyPoints
from langflash_core.cameras.known import agreeing, count_explained, depth_scales, doubt, log_scales
from langflash_core.cameras.matching import Matches, RelativePose, relative_pose, triangulate
from langflash_core.rig.pairs import bridges, scores_of, strongest
from langflash_core.rig.settings import ADJUSTMENT, MATCHING, PAIRING, Pairing


@dataclass(frozen=True)
class Poses:
    """viewmats (V, 4, 4), world = view 0; depth_scales (V,) that bring each view's depth map to
    view 0's unit; corrections: what matches say of each map beyond its scale, on the log depths
    before scaling; guessed: views that no match supports. adjusted: where three and more were placed, what
    they say together, with the lens. doubt: a sentence where photos do not look as known poses say. bent:
    lenses that bend lines, in the order of `Sought`, so that photos are to be straightened first; nothing
    else was sought then."""

    viewmats: Float[np.ndarray, "V 4 4"]
    depth_scales: Float[np.ndarray, " V"]
    corrections: tuple[Correction, ...]
    guessed: tuple[int, ...]
    adjusted: Adjusted | None = None
    doubt: str = ""
    bent: tuple[FoundFocal | None, ...] = ()

    @staticmethod
    def of_bent(lenses: tuple[FoundFocal | None, ...], num_views: int) -> "Poses":
        """No poses, because depth and pictures take lines for straight."""
        nowhere, ones = np.tile(np.eye(4), (num_views, 1, 1)), np.ones(num_views)
        return Poses(nowhere, ones, num_views * (NO_CORRECTION,), (), bent=lenses)

    @property
    def growths(self) -> Float[np.ndarray, " V"]:
        """By what each view's focal length (V,) is longer than was said."""
        return np.ones(len(self.viewmats)) if self.adjusted is None else self.adjusted.growths

    @property
    def lenses(self) -> tuple[FoundFocal | None, ...]:
        """What was found of each lens."""
        return () if self.adjusted is None else self.adjusted.lenses


def estimate_poses(
    views: list[PoseInput],
    points: KeyPoints,
    check: Callable[[], None] = lambda: None,
    known: Float[np.ndarray, "V 4 4"] | None = None,
    sought: Sought | None = None,
    settings: Pairing = PAIRING,
) -> Poses:
    """Poses of all views, deterministic.

    A view that matches nothing keeps view 0's pose and is reported in `guessed`. `check` is called
    before each pair; what it raises ends the work.

    Args:
        points: of the same photos, the same crop, in the same order.
        known: poses (V, 4, 4) that are given, world = view 0: only depths are fitted, to their unit.
        sought: lenses that may be corrected; None: all are given.

    Raises:
        InputError: the photos do not fit the poses that are given.
    """
    num_views = len(views)
    told = {edge: rows for edge, rows in points.pairs.items() if not _blank(points, edge)}
    points = replace(points, pairs=told)
    if known is None and num_views >= ADJUSTMENT.fewest:
        return _together(views, points, sought or given_lenses(num_views), check, settings)
    edges = _edges(views, points, settings)
    if known is None:
        pairs, agreed = _pair_poses(views, edges, check, settings)
        found = place_views(num_views, pairs, settings.graph)
        return _of_pairs(views, found, {edge: agreed[edge] for edge in found.kept}, settings)
    agreed = {}
    for (i, j), matches in edges.items():
        check()
        agreed[i, j] = _agreeing_matches(
            views[i], views[j], matches, known[j] @ np.linalg.inv(known[i]), settings
        )
    scales = _known_scales(views, known, agreed)
    found = _of_pairs(views, Placed(known, scales, (), tuple(agreed)), agreed, settings)
    return replace(found, doubt=_doubt(views, edges, known, settings))


def _doubt(
    views: list[PoseInput], edges: dict[tuple[int, int], Matches], known: np.ndarray, settings: Pairing
) -> str:
    """What is wrong with known poses, by the pairs of photos that share most; nothing where they fit."""
    pairs = []
    for i, j in sorted(edges, key=lambda edge: (-len(edges[edge]), edge))[: settings.checked]:
        sought = _pair_pose(views[i], views[j], edges[i, j], settings)
        if sought is not None:
            pairs.append(
                (count_explained(edges[i, j], known[j] @ np.linalg.inv(known[i])), sought.num_inliers)
            )
    return doubt(pairs)


def _of_pairs(views: list[PoseInput], found: Placed, agreed: Agreed, settings: Pairing) -> Poses:
    """Corrections from the matches of pairs."""
    corrections = tuple(
        _correction(v, own, found.viewmats, found.scales[v], agreed, settings) for v, own in enumerate(views)
    )
    return Poses(found.viewmats, found.scales, corrections, found.missing)


def _together(
    views: list[PoseInput], points: KeyPoints, sought: Sought, check: Callable[[], None], settings: Pairing
) -> Poses:
    """Poses of three views and more, and lenses.

    A few photos tell a lens first: pairs through a wrong one start the adjustment of all at wrong places,
    from where it does not come back.
    """
    growths, solved = np.ones(len(views)), None
    if max(sought.doubts) > 0:
        few = _few(len(views), points.counts, settings)
        first = _solve_poses(*_part(views, points, sought, few), check, settings)
        bent = _bent_lenses(first[2])
        if bent:
            return Poses.of_bent(bent, len(views))
        sought = replace(sought, bends=False)
        growths = _other_lenses(first[2], sought, settings)
        solved = first if len(few) == len(views) and (growths == 1).all() else None
    seen = [view.through(growth) for view, growth in zip(views, growths, strict=True)]
    found, agreed, adjusted = solved or _solve_poses(seen, points, sought, check, settings)
    if (growths != 1).any() and (adjusted is None or None in adjusted.lenses):  # all of them tell it no more
        return _together(views, points, replace(sought, doubts=(0.0,) * len(sought.doubts)), check, settings)
    if adjusted is None:
        return _of_pairs(views, found, agreed, settings)
    adjusted = adjusted.after(growths, sought.lenses)
    seen = [view.through(growth) for view, growth in zip(views, adjusted.growths, strict=True)]
    return _of_adjusted(adjusted, seen, found.missing, settings)


def _bent_lenses(adjusted: Adjusted | None) -> tuple[FoundFocal | None, ...]:
    """All lenses, where one of them bends lines."""
    some = adjusted is not None and any(lens is not None and lens.bend for lens in adjusted.lenses)
    return adjusted.lenses if some and adjusted is not None else ()


def _solve_poses(
    views: list[PoseInput], points: KeyPoints, sought: Sought, check: Callable[[], None], settings: Pairing
) -> tuple[Placed, Agreed, Adjusted | None]:
    """Poses by pairs, the matches that agree with them, and what all say together."""
    edges = _edges(views, points, settings)
    pairs, agreed = _pair_poses(views, edges, check, settings)
    found = place_views(len(views), pairs, settings.graph)
    agreed = {edge: agreed[edge] for edge in found.kept}
    return found, agreed, adjusted_photos(views, points, found, agreed, sought, check, settings.adjustment)


def _edges(views: list[PoseInput], points: KeyPoints, settings: Pairing) -> dict[tuple[int, int], Matches]:
    """Matches of the pairs to look at: those of each photo with the most, and a tree that connects all."""
    chosen = sorted(strongest(scores_of(len(views), points.counts), settings.graph.sources))
    return {edge: key_point_matches(views, points, *edge) for edge in chosen}


def _few(num_views: int, counts: Mapping[tuple[int, int], int], settings: Pairing) -> list[int]:
    """Views that tell a lens best: each shares enough with one before it, and no more than it must."""
    if num_views <= settings.first:
        return list(range(num_views))
    shared = np.zeros((num_views, num_views), int)
    for (i, j), count in counts.items():
        shared[i, j] = shared[j, i] = count
    few = [int(shared.sum(1).argmax())]
    while len(few) < settings.first:
        best = shared[few].max(0)
        best[few] = -1
        enough = np.flatnonzero(best >= settings.enough)
        few.append(int(enough[best[enough].argmin()]) if len(enough) else int(best.argmax()))
    return sorted(few)


def _part(
    views: list[PoseInput], points: KeyPoints, sought: Sought, few: list[int]
) -> tuple[list[PoseInput], KeyPoints, Sought]:
    """Some of the views, numbered anew."""
    numbers = {view: number for number, view in enumerate(few)}
    pairs = {
        (numbers[i], numbers[j]): rows
        for (i, j), rows in points.pairs.items()
        if i in numbers and j in numbers
    }
    own = KeyPoints(tuple(points.positions[v] for v in few), pairs)
    return [views[v] for v in few], own, replace(sought, lenses=tuple(sought.lenses[v] for v in few))


def _other_lenses(adjusted: Adjusted | None, sought: Sought, settings: Pairing) -> np.ndarray:
    """By what focal lengths (V,) grow that were said much too wrongly; 1 of all others."""
    growths = np.ones(len(sought.doubts))
    for lens, found in enumerate(adjusted.lenses if adjusted else ()):
        if found is not None and abs(np.log(found.growth)) > settings.other_lens:
            growths[lens] = found.growth
    return growths[list(sought.lenses)]


def on_other_maps(poses: Poses, views: Sequence[PoseInput], settings: Pairing = PAIRING) -> Poses:
    """The poses with other depth maps of the same photos, and the unit of view 0's."""
    assert poses.adjusted is not None, "lenses are found where photos are adjusted together"
    return _of_adjusted(poses.adjusted, views, poses.guessed, settings)


def _of_adjusted(
    adjusted: Adjusted, views: Sequence[PoseInput], guessed: tuple[int, ...], settings: Pairing
) -> Poses:
    """Scales and corrections of the depth maps from the points that many photos saw.

    The bundle's unit hangs on all maps a little; here it becomes that of view 0's.
    """
    tracks, num_views = adjusted.tracks, len(views)
    priors = log_depths(views, tracks)
    said = np.log(adjusted.depths) - priors
    sure = adjusted.depth_errors < settings.max_depth_sigma
    logs, corrections = np.zeros(num_views), []
    of_views = [np.flatnonzero(tracks.views == v) for v in range(num_views)]
    for v, own in enumerate(of_views):
        best = own[sure[own]] if sure[own].sum() >= settings.min_points else own
        logs[v] = np.median(said[best]) if len(best) else 0.0
    for v, (view, own) in enumerate(zip(views, of_views, strict=True)):
        own = own[sure[own]]
        if len(own) < settings.min_points:
            corrections.append(NO_CORRECTION)
            continue
        x = tracks.pixels[own] / (view.K[0, 0])
        targets = np.log(adjusted.depths[own]) - logs[v]
        corrections.append(
            fit_correction(x, priors[own], targets, adjusted.depth_errors[own], settings.straightening)
        )
    viewmats = adjusted.viewmats.copy()
    viewmats[:, :3, 3] /= np.exp(logs[0])
    scales = np.exp(logs - logs[0])
    return Poses(viewmats, scales, tuple(corrections), guessed, adjusted)


def _blank(points: KeyPoints, edge: tuple[int, int]) -> bool:
    """Whether one of two photos shows nothing to tell places by: dense matches are its borders then, which
    agree with those of any photo."""
    return min(len(points.positions[view]) for view in edge) < MATCHING.fewest


def _pair_poses(
    views: list[PoseInput],
    edges: dict[tuple[int, int], Matches],
    check: Callable[[], None],
    settings: Pairing,
) -> tuple[dict[tuple[int, int], RelativePose], dict[tuple[int, int], Matches]]:
    """Relative poses of pairs and the matches that agree with them.

    Few agreeing key points are often wrong, and dense matches as well: both are asked only for photos that
    nothing better connects.
    """
    weak: dict[tuple[int, int], RelativePose] = {}
    pairs: dict[tuple[int, int], RelativePose] = {}
    agreed: dict[tuple[int, int], Matches] = {}
    for (i, j), matches in edges.items():
        check()
        pose = _pair_pose(views[i], views[j], matches, settings)
        if pose is not None:
            (pairs if pose.num_inliers >= settings.few else weak)[i, j] = pose
            agreed[i, j] = matches.subset(pose.inliers)
    counts = {edge: len(matches) for edge, matches in edges.items()}
    for _ in range(settings.bridges):
        for i, j in bridges(scores_of(len(views), counts), pairs):
            check()
            more = with_dense(edges[i, j], dense_matches(views[i], views[j]))
            better = _pair_pose(views[i], views[j], more, settings)
            if better is not None and better.cost < settings.dense_cost:
                pairs[i, j], agreed[i, j] = better, more.subset(better.inliers)
            elif (i, j) in weak:
                pairs[i, j] = weak[i, j]
            else:
                del counts[i, j]  # the next best of these photos is asked
    return pairs, {edge: agreed[edge] for edge in pairs}


def _agreeing_matches(
    view_i: PoseInput, view_j: PoseInput, matches: Matches, relative: np.ndarray, settings: Pairing
) -> Matches:
    """Matches that a known relative pose allows; dense ones as well where few do."""
    own = agreeing(matches, relative)
    if len(own) >= settings.few:
        return own
    return agreeing(with_dense(matches, dense_matches(view_i, view_j)), relative)


def _known_scales(
    views: list[PoseInput], viewmats: np.ndarray, agreed: dict[tuple[int, int], Matches]
) -> np.ndarray:
    """Factors (V,) that bring each depth map to the unit of known poses; 1 for a single photo."""
    said: list[list[np.ndarray]] = [[np.zeros(0)] for _ in views]
    for (i, j), matches in agreed.items():
        relative = viewmats[j] @ np.linalg.inv(viewmats[i])
        depths = depths_at(views[i], matches.x_i), depths_at(views[j], matches.x_j)
        for view, logs in zip((i, j), log_scales(matches, relative, *depths), strict=True):
            said[view].append(logs)
    return np.ones(1) if len(views) == 1 else depth_scales([np.concatenate(own) for own in said])


def _pair_pose(
    view_i: PoseInput, view_j: PoseInput, matches: Matches, settings: Pairing
) -> RelativePose | None:
    """The pose of the matches, if enough of them agree with it."""
    pose = relative_pose(matches, depths_at(view_i, matches.x_i), depths_at(view_j, matches.x_j))
    return pose if pose is not None and pose.num_inliers >= settings.min_share * len(matches) else None


def _correction(
    view: int,
    own: PoseInput,
    viewmats: np.ndarray,
    scale: float,
    agreed: dict[tuple[int, int], Matches],
    settings: Pairing,
) -> Correction:
    """What the matches with all other views say of one depth map."""
    points, targets, sigmas = [], [], []
    for (i, j), matches in agreed.items():
        if view not in (i, j):
            continue
        mine, theirs = (matches.x_i, matches.x_j) if view == i else (matches.x_j, matches.x_i)
        relative = viewmats[j if view == i else i] @ np.linalg.inv(viewmats[view])
        depths = triangulate(mine, theirs, relative[:3, :3], relative[:3, 3])
        baseline = np.linalg.norm(relative[:3, 3])
        usable = (depths > 0.05 * baseline) & (depths * matches.sigma < settings.max_depth_sigma * baseline)
        points.append(mine[usable])
        targets.append(np.log(depths[usable] / scale))
        sigmas.append(depths[usable] * matches.sigma / baseline)  # one pixel over the parallax
    if sum(map(len, points)) < settings.min_points:
        return NO_CORRECTION
    x = np.concatenate(points)
    told = np.concatenate(targets), np.concatenate(sigmas)
    return fit_correction(x, np.log(depths_at(own, x)), *told, settings.straightening)
