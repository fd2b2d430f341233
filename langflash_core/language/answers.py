"""From relevance to an answer: is it there, which pixels, where in space, how large.

A phrase is present where its best pixels pass the threshold, not where it is least bad.
"""

import math
from dataclasses import replace

import torch
from jaxtyping import Bool, Float
from torch import Tensor

from langflash_core.errors import PromptError
from langflash_core.geometry.cameras import invert_rigid, transform, unproject
from langflash_core.language.relevance import CompiledQuery
from langflash_core.language.settings import ANSWERING
from langflash_core.types import Camera, Frame, PromptAnswer, QueryResult


def answer(
    relevance: Float[Tensor, "P H W"],
    frame: Frame,
    camera: Camera,
    compiled: CompiledQuery,
    threshold: float | None = None,
) -> QueryResult:
    """Answer P prompts in one view.

    score = mean of the highest 0.1 % of the covered pixels (alpha >= 0.5), at least one;
    mask = relevance >= the threshold if one is given, else half of the score's log odds, at covered
    pixels; found = score >= threshold and the mask covers at least 0.05 % of the image. The mask of a
    phrase that is not found is empty.

    Args:
        relevance: (P, H, W) of `relevance_maps`.
        frame: rendered by `camera`; alphas and depths are used.
        threshold: instead of the compiled one; in [0, 1] for relevancy, [-1, 1] for cosine.

    Raises:
        ValueError: sizes disagree. PromptError: the threshold is out of range.
    """
    expected = (len(compiled.texts), *frame.alphas.shape)
    if tuple(relevance.shape) != expected:
        raise ValueError(f"relevance: expected {expected}, received {tuple(relevance.shape)}")
    limit = compiled.threshold if threshold is None else _check_threshold(threshold, compiled.mode)
    # Without atoms nothing can be there, whatever the threshold.
    covered = (frame.alphas >= ANSWERING.covered_alpha) & (compiled.factor.shape[0] > 0)  # (H, W)
    scores = presence_scores(relevance, covered)
    lit = lit_from(scores, compiled, threshold)
    masks = (relevance >= relevance.new_tensor(lit)[:, None, None]) & covered
    found = (scores >= limit) & (masks.flatten(1).float().mean(1) >= ANSWERING.min_area)
    masks = masks & found[:, None, None]
    points = world_points(frame.depths, camera)  # (H, W, 3)
    answers = tuple(
        replace(_one(text, float(score), limit, mask, points[mask], values[mask]), lit_from=least)
        for text, score, mask, values, least in zip(
            compiled.texts, scores, masks, relevance, lit, strict=True
        )
    )
    if compiled.notes:
        answers = tuple(replace(one, note=note) for one, note in zip(answers, compiled.notes, strict=True))
    if compiled.readings:
        read = ("" if reading.whole else str(reading) for reading in compiled.readings)
        answers = tuple(replace(one, reading=text) for one, text in zip(answers, read, strict=True))
    return QueryResult(answers, compiled.mode, relevance, masks, frame, camera)


def lit_from(scores: Float[Tensor, " P"], compiled: CompiledQuery, threshold: float | None) -> list[float]:
    """The values from which pixels belong to phrases that score so; threshold: as of `answer`."""
    if threshold is not None or compiled.mode == "cosine":
        return [compiled.threshold if threshold is None else threshold] * len(scores)
    return [ANSWERING.lit_from(score, compiled.threshold) for score in scores.tolist()]


def presence_scores(relevance: Float[Tensor, "P H W"], covered: Bool[Tensor, "H W"]) -> Float[Tensor, " P"]:
    """Scores (P,) of maps (P, H, W): mean of the highest 0.1 % where `covered` (H, W); 0 if nowhere."""
    inside = relevance[:, covered]  # (P, n)
    count = inside.shape[1]
    if count == 0:
        return relevance.new_zeros(relevance.shape[0])
    return inside.topk(math.ceil(ANSWERING.top_fraction * count), dim=1).values.mean(1)


def best_places(
    relevance: Float[Tensor, "P H W"], frame: Frame, camera: Camera
) -> tuple[tuple[float, float, float] | None, ...]:
    """Where each of P maps (P, H, W) is highest among the covered pixels, scene units; None without any.

    Of those within `ANSWERING.peak` of the highest it is the one nearest to their middle, not one at an edge.
    """
    covered = frame.alphas >= ANSWERING.covered_alpha
    if not covered.any():
        return (None,) * len(relevance)
    points = world_points(frame.depths, camera).flatten(0, 1)
    rows = covered.flatten().nonzero().squeeze(1)
    places = []
    for values in relevance.flatten(1)[:, rows]:
        peak = points[rows[values >= values.max() - ANSWERING.peak]]
        x, y, z = peak[(peak - peak.median(0).values).norm(dim=1).argmin()].tolist()
        places.append((x, y, z))
    return tuple(places)


def world_points(depths: Float[Tensor, "H W"], camera: Camera) -> Float[Tensor, "H W 3"]:
    """World points (H, W, 3) of z-depths (H, W) seen by `camera`."""
    points = unproject(depths, camera.K.to(depths), camera.orthographic).flatten(0, 1)
    return transform(invert_rigid(camera.viewmat.to(depths)), points).unflatten(0, depths.shape)


def weighted_centroid(points: Float[Tensor, "n 3"], weights: Float[Tensor, " n"]) -> Float[Tensor, "3"]:
    """Mean (3,) of points (n, 3) with weights (n,) >= 0; plain mean where all weights are 0."""
    total = weights.sum()
    shares = weights / total if total > 0 else torch.full_like(weights, 1 / len(weights))
    return shares @ points


def oriented_box(points: Float[Tensor, "n 3"]) -> dict:
    """Oriented box of points (n, 3), n >= 1, extents from the 2nd to 98th percentile.

    Gravity is not known. Two sets of axes are tried, the world's (those of view 0, upright
    where that photo was) and the principal ones of the visible surface. The principal ones win
    where they save a tenth of the volume; round and square things have none worth the name.

    Returns:
        {"center": [3], "axes": [3][3] unit rows, right-handed, "size": [3] along them},
        scene units.
    """
    exact = points.double().cpu()
    candidates = [torch.eye(3, dtype=torch.float64)]
    if len(exact) >= ANSWERING.few_points:
        candidates.append(principal_axes(exact))
    boxes = [_extents(exact, axes) for axes in candidates]
    sizes = torch.stack([high - low for low, high in boxes])  # (1 or 2, 3)
    # A flat thing has no volume: every side gets a hundredth of the longest one's thickness.
    volumes = (sizes + 0.01 * sizes.amax(1, keepdim=True)).prod(1)
    best = 1 if len(volumes) > 1 and volumes[1] < ANSWERING.principal_gain * volumes[0] else 0
    low, high = boxes[best]
    center = ((low + high) / 2) @ candidates[best]
    return {"center": center.tolist(), "axes": candidates[best].tolist(), "size": sizes[best].tolist()}


def _extents(points: Tensor, axes: Tensor) -> tuple[Tensor, Tensor]:
    """Low and high (3,) of points (n, 3) along the rows of `axes`."""
    low, high = (points @ axes.T).quantile(torch.tensor(ANSWERING.box_quantiles, dtype=points.dtype), dim=0)
    return low, high


def principal_axes(points: Float[Tensor, "n 3"]) -> Float[Tensor, "3 3"]:
    """Rows (3, 3): orthonormal principal axes of points (n, 3), longest first, determinant 1.

    The 4 % farthest from the median point are left out: squares let a few outliers turn axes.
    The largest component of the first two axes is positive, so that they do not flip by chance.
    """
    distances = (points - points.median(dim=0).values).norm(dim=-1)
    kept = points[distances <= distances.quantile(ANSWERING.box_quantiles[1] - ANSWERING.box_quantiles[0])]
    offsets = kept - kept.mean(dim=0)
    vectors = torch.linalg.eigh(offsets.T @ offsets).eigenvectors.T.flip(0)  # rows, longest first
    first, second = (axis * axis[axis.abs().argmax()].sign() for axis in vectors[:2])
    return torch.stack((first, second, torch.linalg.cross(first, second)))


def _one(text: str, score: float, limit: float, mask: Tensor, points: Tensor, values: Tensor) -> PromptAnswer:
    """The answer to one phrase from its final mask (H, W) and its points (n, 3), values (n,)."""
    if len(points) == 0:
        maybe = ANSWERING.maybe_from(limit) <= score < limit
        return PromptAnswer(text, False, score, limit, 0.0, None, None, mask=mask, maybe=maybe)
    x, y, z = weighted_centroid(points, values.clamp_min(0)).tolist()
    area = float(mask.float().mean())
    box = oriented_box(_thin_points(points))
    return PromptAnswer(text, True, score, limit, area, (x, y, z), box, mask=mask)


def _thin_points(points: Tensor, most: int = 20_000) -> Tensor:
    """Every n-th point, at most about `most`: percentiles need no more."""
    return points[:: max(1, len(points) // most)]


def _check_threshold(threshold: float, mode: str) -> float:
    low = 0.0 if mode == "relevancy" else -1.0
    if not low <= threshold <= 1.0:
        raise PromptError(f"the threshold {threshold} is out of range; {mode} needs {low:g} to 1")
    return float(threshold)
