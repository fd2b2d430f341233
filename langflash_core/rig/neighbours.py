"""Which photos a photo is compared with: all others, those that have its points before them, or those that
see the same surface from another side.

The photos that share most with one are taken from almost the same place, where depth moves nothing; those
far round see other things. By the angle, each sampled point of a photo's depth map is worth something in
another photo that sees it, by the angle between the two rays; neighbours are chosen one by one, each for what
it adds to points that those before it do not say enough about, so they lie on several sides and together see
most of the picture. Two from nearly one place err alike, and the second adds little.

Sizes: V photos, H W pixels of the depth maps, n sampled points of each.

Source: own derivation; the score of angles is that of view selection in multi-view stereo (Goesele et al.
2007; Yao et al. 2018), the choice is greedy on a submodular gain.
"""

from collections.abc import Sequence
from typing import Literal

import torch
from jaxtyping import Float
from torch import Tensor
from torch.nn import functional as F

from langflash_core.rig.rig import Rig

Neighbours = Sequence[Sequence[int]]
"""Of each photo the others that it is compared with."""
By = Literal["all", "sight", "angle"]

PARTNERS = 4
"""Of each photo, by the angle."""
_ASKED = 16  # photos that are asked about one photo's points
_TRIED = 67  # of whose points one is looked for in the others
_STEP = 8  # pixels between sampled points
_SURFACE = 0.3  # log depth by which the other map may differ and still show the point
_FULL, _BEST, _FALL = 8.0, 9.0, 8.0  # degrees: worth grows up to the first, falls beyond the second
_APART = 4.0  # degrees between two neighbours, from which on they say different things
_ENOUGH = 0.15  # worth that a point has from the start: what more of the same adds to it
_LEAST = 0.01  # of gain a point, for a neighbour


def everyone(num_views: int) -> Neighbours:
    """All other photos."""
    return [[other for other in range(num_views) if other != view] for view in range(num_views)]


def neighbours(rig: Rig, view: int, by: By = "angle", most: int | None = None) -> list[int]:
    """The photos that one is compared with.

    Args:
        by: "all": all others. "sight": all of `most` (16) and fewer; of more so many, spread evenly over
            those that have some of the photo's points before them, so that the work grows with the photos.
            "angle": at most `most` (4), the best first; two photos have each other.
    """
    if by == "all" or (by == "angle" and len(rig) <= 2):
        return list(everyone(len(rig))[view])
    if by == "sight":
        return witnesses(rig, view, rig.points(view), _ASKED if most is None else most)
    return _greedy(*_worth(rig, view), PARTNERS if most is None else most)


def source_views(rig: Rig, by: By = "angle", most: int | None = None) -> Neighbours:
    """Of each photo its `neighbours`."""
    return [neighbours(rig, view, by, most) for view in range(len(rig))]


def witnesses(rig: Rig, view: int, points: Float[Tensor, "3 n"], most: int = _ASKED) -> list[int]:
    """`neighbours` by sight, where a photo's points (3, n) in the world are known."""
    others = [other for other in range(len(rig)) if other != view]
    if len(others) <= most:
        return others
    inside = rig.project(points[:, _TRIED // 2 :: _TRIED], slice(None)).inside
    seeing = [other for other, sees in enumerate(inside.any(1).tolist()) if sees and other != view]
    if len(seeing) <= most:
        return seeing
    return [seeing[(2 * k + 1) * len(seeing) // (2 * most)] for k in range(most)]


def _worth(rig: Rig, view: int) -> tuple[Float[Tensor, "V n"], Float[Tensor, "V n 3"]]:
    """What a photo's points are worth in every photo, in [0, 1], 0 in its own; and unit vectors from every
    photo to them."""
    sparse = (slice(_STEP // 2, None, _STEP), slice(_STEP // 2, None, _STEP))
    points = rig.in_world(rig.in_camera(view)[sparse].flatten(0, 1).T, view)
    towards = F.normalize(points.T - rig.poses[:, None, :3, 3], dim=-1)
    cosines = (towards * towards[view]).sum(-1).clamp(-1, 1)
    angles = torch.rad2deg(torch.acos(cosines))
    worth = (angles / _FULL).clamp(max=1) * torch.exp(-(((angles - _BEST).clamp_min(0) / _FALL) ** 2))
    there = rig.project(points, slice(None))
    gap = there.z.clamp_min(1e-6).log() - there.looked_up(rig.log_depths.flatten(1))
    worth = torch.where(there.inside & (gap.abs() < _SURFACE), worth, 0.0)
    worth[view] = 0
    return worth, towards


def _greedy(worth: Float[Tensor, "V n"], towards: Float[Tensor, "V n 3"], count: int) -> list[int]:
    """At most so many photos by worth, each for the gain in the sum of log worth over the points; to what one
    says others add as much as they see it from elsewhere."""
    chosen: list[int] = []
    had = torch.full_like(worth, _ENOUGH)
    for _ in range(min(count, len(worth) - 1)):
        gains = torch.log1p(worth / had).mean(1)
        gains[chosen] = 0
        best = int(gains.argmax())
        if gains[best] <= _LEAST:
            break
        chosen.append(best)
        angles = torch.rad2deg(torch.acos((towards * towards[best]).sum(-1).clamp(-1, 1))).nan_to_num()
        had = had + worth[best] * torch.exp(-((angles / _APART) ** 2))
    return chosen
