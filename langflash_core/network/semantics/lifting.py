"""Groups of a scene out of masks of single photos: masks that cover the same points are one group.

For photos without trained grouping. Each photo's pixels get one mask at most, small ones over large
ones. The points of a photo are looked up in the others, and masks of two photos that share most of
what both see are joined, the surest first. What no mask covers is one group more.

V views, N masks of a view, K groups, H W pixels.
"""

from collections.abc import Sequence
from itertools import combinations

import torch
from jaxtyping import Float
from torch import Tensor
from torch.nn import functional as F

from langflash_core.network.model import Geometry
from langflash_core.network.presets import MaskFilter
from langflash_core.network.semantics.grouping import Groups
from langflash_core.network.semantics.residual import filter_queries
from langflash_core.network.semantics.settings import LIFTING
from langflash_core.rig.projected import project_points

SURE = MaskFilter(min_score=0.7, min_stability=0.9, offset=1.0, min_area=100, max_overlap=0.7)
"""Between SAM's own values (0.88, 0.95) and the lax ones of the released grouping: a photo of 256
pixels has few masks, and what is missing falls to the rest."""


def lifted_weights(
    segments: Sequence[Groups], geometry: Geometry, Ks: Float[Tensor, "V 3 3"], most: int = 256
) -> Float[Tensor, "V K H W"]:
    """w_k(x), (V, K, H, W), sums to 1 over K; the largest groups first, the rest last.

    Args:
        segments: of each photo, B = V = 1: masks (1, 1, N, H, W) and scores (1, N), logits.
        geometry: of the same photos. Ks: (V, 3, 3) pixels. most: K at most.
    """
    _, height, width = geometry.depths.shape
    labels, counts = _paint_labels(segments, (height, width))
    labels = labels.to(geometry.depths.device)
    groups = _join_masks(_shares(labels, sum(counts), geometry, Ks), counts)
    ids = F.pad(groups, (0, 1), value=-1).to(labels.device)[labels]  # no mask stays -1
    sizes = torch.bincount(ids[ids >= 0].flatten(), minlength=len(groups))
    order = sizes.argsort(descending=True, stable=True)[: most - 1]
    order = order[sizes[order] > 0]
    rank = torch.full((len(groups) + 1,), len(order), device=ids.device)  # the rest, and id -1
    rank[order] = torch.arange(len(order), device=ids.device)
    hard = F.one_hot(rank[ids], len(order) + 1).movedim(-1, 1).float()  # (V, K, H, W)
    if not bool(hard[:, -1].any()):
        hard = hard[:, :-1]
    return F.avg_pool2d(hard, LIFTING.soft, stride=1, padding=LIFTING.soft // 2, count_include_pad=False)


def _paint_labels(segments: Sequence[Groups], size: tuple[int, int]) -> tuple[Tensor, list[int]]:
    """Labels (V, H, W), -1 where no mask is, running over all views; how many masks each view has."""
    pictures, counts = [], []
    for found in segments:
        picture = torch.full(size, -1, dtype=torch.long)
        masks = found.mask_logits[0, 0, filter_queries(found, SURE)].cpu() > 0
        for number, index in enumerate(masks.flatten(1).sum(1).argsort(descending=True, stable=True)):
            picture[masks[index]] = sum(counts) + number
        pictures.append(picture)
        counts.append(len(masks))
    return torch.stack(pictures), counts


def _shares(labels: Tensor, total: int, geometry: Geometry, Ks: Tensor) -> dict[tuple[int, int], float]:
    """For masks of two views: the part of the pixels of either that both cover, where both views see."""
    shares: dict[tuple[int, int], float] = {}
    points = geometry.gaussians.means.unflatten(0, tuple(labels.shape))
    for a, b in combinations(range(len(labels)), 2):
        both = torch.zeros(total + 1, total + 1)  # the last row and column: no mask
        for here, there in ((a, b), (b, a)):
            seen, place = _looked_up(points[here], geometry, Ks, there)
            own, other = labels[here].flatten()[seen], labels[there].flatten()[place]
            if here == b:
                own, other = other, own
            pairs = (own % (total + 1)) * (total + 1) + other % (total + 1)
            both += torch.bincount(pairs, minlength=(total + 1) ** 2).view_as(both).cpu()
        covered = both.sum(1)[:, None] + both.sum(0) - both
        likeness = both[:-1, :-1] / covered[:-1, :-1].clamp_min(1)
        for i, j in (likeness > LIFTING.same_mask).nonzero().tolist():
            shares[i, j] = float(likeness[i, j])
    return shares


def _looked_up(points: Tensor, geometry: Geometry, Ks: Tensor, view: int) -> tuple[Tensor, Tensor]:
    """Which of the points (H, W, 3) a view sees, and at which of its pixels; flat indices (n,) each."""
    size, flat = (points.shape[0], points.shape[1]), points.flatten(0, 1).T
    there = project_points(flat, geometry.viewmats[view], Ks[view].to(flat), size)
    seen = there.inside.nonzero()[:, 0]
    place = there.pixels[seen]
    depths = geometry.depths[view].flatten()[place]
    same = (there.z[seen] - depths).abs() <= LIFTING.same_depth * depths
    return seen[same], place[same]


def _join_masks(shares: dict[tuple[int, int], float], counts: list[int]) -> Tensor:
    """A group for every mask, (sum of counts,): the surest pairs first, one mask of a view in a group."""
    views = [view for view, count in enumerate(counts) for _ in range(count)]
    members = {mask: {mask} for mask in range(len(views))}
    for i, j in sorted(shares, key=lambda pair: (-shares[pair], pair)):
        first, second = members[i], members[j]
        if first is second or {views[m] for m in first} & {views[m] for m in second}:
            continue
        first |= second
        for mask in second:
            members[mask] = first
    return torch.tensor([min(members[mask]) for mask in range(len(views))], dtype=torch.long)
