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

from langflash_core.geometry.cameras import invert_rigid
from langflash_core.geometry.nearness import Chosen, Nearness
from langflash_core.rig.rig import Rig
from langflash_core.rig.settings import CHOICE, Choice

Neighbours = Sequence[Sequence[int]]
"""Of each photo the others that it is compared with."""
By = Literal["all", "sight", "angle"]


def everyone(num_views: int) -> Neighbours:
    """All other photos."""
    return [[other for other in range(num_views) if other != view] for view in range(num_views)]


def neighbours(
    rig: Rig, view: int, by: By = "angle", most: int | None = None, settings: Choice = CHOICE
) -> list[int]:
    """The photos that one is compared with.

    Args:
        by: "all": all others. "sight": all of `most` (16) and fewer; of more so many, spread evenly over
            those that have some of the photo's points before them, so that the work grows with the photos.
            "angle": at most `most` (4), the best first; two photos have each other.
    """
    if by == "all" or (by == "angle" and len(rig) <= 2):
        return list(everyone(len(rig))[view])
    if by == "sight":
        return witnesses(rig, view, rig.points(view), most, settings=settings)
    worth, towards = (values.cpu() for values in _worth(rig, view, settings=settings))  # read one by one
    return _greedy(worth, towards, settings.sources if most is None else most, settings=settings)


def source_views(
    rig: Rig, by: By = "angle", most: int | None = None, settings: Choice = CHOICE
) -> Neighbours:
    """Of each photo its `neighbours`."""
    return [neighbours(rig, view, by, most, settings=settings) for view in range(len(rig))]


def beside(rig: Rig, view: int) -> Chosen:
    """The other photos that a picture at a photo's place would be drawn from, and what each counts there."""
    poses = rig.viewmats.double()
    centres, axes = invert_rigid(poses)[:, :3, 3].cpu().numpy(), poses[:, 2, :3].cpu().numpy()
    others = [other for other in range(len(rig)) if other != view]
    distance = float(rig.depths[view].nanmedian())
    return Nearness(centres[others], axes[others], distance, tuple(others)).seen(centres[view], axes[view])


def witnesses(
    rig: Rig, view: int, points: Float[Tensor, "3 n"], most: int | None = None, settings: Choice = CHOICE
) -> list[int]:
    """`neighbours` by sight, where a photo's points (3, n) in the world are known."""
    most = settings.asked if most is None else most
    others = [other for other in range(len(rig)) if other != view]
    if len(others) <= most:
        return others
    inside = rig.project(points[:, settings.tried // 2 :: settings.tried], slice(None)).inside
    seeing = [other for other, sees in enumerate(inside.any(1).tolist()) if sees and other != view]
    if len(seeing) <= most:
        return seeing
    return [seeing[(2 * k + 1) * len(seeing) // (2 * most)] for k in range(most)]


def _worth(
    rig: Rig, view: int, settings: Choice = CHOICE
) -> tuple[Float[Tensor, "V n"], Float[Tensor, "V n 3"]]:
    """What a photo's points are worth in every photo, in [0, 1], 0 in its own; and unit vectors from every
    photo to them."""
    sparse = (slice(settings.step // 2, None, settings.step), slice(settings.step // 2, None, settings.step))
    points = rig.in_world(rig.in_camera(view)[sparse].flatten(0, 1).T, view)
    towards = F.normalize(points.T - rig.poses[:, None, :3, 3], dim=-1)
    cosines = (towards * towards[view]).sum(-1).clamp(-1, 1)
    angles = torch.rad2deg(torch.acos(cosines))
    worth = (angles / settings.full).clamp(max=1) * torch.exp(
        -(((angles - settings.best).clamp_min(0) / settings.fall) ** 2)
    )
    there = rig.project(points, slice(None))
    gap = there.z.clamp_min(1e-6).log() - there.looked_up(rig.log_depths.flatten(1))
    worth = torch.where(there.inside & (gap.abs() < settings.surface), worth, 0.0)
    worth[view] = 0
    return worth, towards


def _greedy(
    worth: Float[Tensor, "V n"], towards: Float[Tensor, "V n 3"], count: int, settings: Choice = CHOICE
) -> list[int]:
    """At most so many photos by worth, each for the gain in the sum of log worth over the points; to what one
    says others add as much as they see it from elsewhere."""
    chosen: list[int] = []
    had = torch.full_like(worth, settings.enough)
    for _ in range(min(count, len(worth) - 1)):
        gains = torch.log1p(worth / had).mean(1)
        gains[chosen] = 0
        best = int(gains.argmax())
        if gains[best] <= settings.least:
            break
        chosen.append(best)
        angles = torch.rad2deg(torch.acos((towards * towards[best]).sum(-1).clamp(-1, 1))).nan_to_num()
        had = had + worth[best] * torch.exp(-((angles / settings.apart) ** 2))
    return chosen
