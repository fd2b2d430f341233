"""What one photo sees through cannot be there. N Gaussians of V views, order (v h w)."""

import torch
from jaxtyping import Bool, Float
from torch import Tensor
from torch.nn import functional as F

from langflash_core.geometry.cameras import pictured

TOLERANCE = 0.12
"""A Gaussian this much nearer (relative depth) than the surface another photo sees is in its way:
beyond the depth error of the shipped network, so that double surfaces of good depth merge instead."""

_VOTES = 2
"""Photos that see through something, one of which may be wrong."""
_ASKED = 16  # photos that are asked about one photo's points
_TRIED = 67  # of whose points one is looked for in the others
_SKIRT = 0.05  # relative depth beyond all of the other's around a place, from which it is another surface
_AROUND, _JUMP = 5, 0.1  # pixels of a window, and log depth within it from which depth jumps there


def seen_through(
    means: Float[Tensor, "N 3"],
    viewmats: Float[Tensor, "V 4 4"],
    Ks: Float[Tensor, "V 3 3"],
    depths: Float[Tensor, "V H W"],
    confidences: Float[Tensor, "V H W"],
    tolerance: float = TOLERANCE,
) -> Bool[Tensor, " N"]:
    """Gaussians that stand in free space of a photo which knows its depth better.

    Gaussian i of view v is projected into every other view u. If it lies in front of u's surface
    by more than `tolerance` there, one of the two depths is wrong: the less confident one loses;
    of equals the later view. So never both sides of a conflict vanish.

    Args:
        means: (V*H*W, 3) world. viewmats: (V, 4, 4). Ks: (V, 3, 3), pixels of the depth maps.
        depths: (V, H, W) > 0, unit of the means. confidences: (V, H, W) in [0, 1].

    Returns:
        (V*H*W,) bool.

    Source: free-space rule of depth-map fusion (Merrell et al. 2007).
    """
    num_views, height, width = depths.shape
    blocked = torch.zeros(num_views, height * width, dtype=torch.bool, device=means.device)
    limits, trusts = (1 - tolerance) * depths.flatten(1), confidences.flatten(1)
    for view, own in enumerate(means.reshape(num_views, -1, 3)):
        for other in witnesses(view, own, viewmats, Ks, (height, width)):
            x, y, z = pictured(viewmats[other], Ks[other], own.T)
            inside = (z > 0) & (x >= 0) & (x < width) & (y >= 0) & (y < height)
            places = torch.where(inside, y.floor() * width + x.floor(), 0.0).long()
            theirs = trusts[other].index_select(0, places)
            outvoted = (theirs > trusts[view]) if other > view else (theirs >= trusts[view])
            blocked[view] |= inside & (z < limits[other].index_select(0, places)) & outvoted
    return blocked.flatten()


def witnesses(
    view: int,
    points: Float[Tensor, "n 3"],
    viewmats: Float[Tensor, "V 4 4"],
    Ks: Float[Tensor, "V 3 3"],
    size: tuple[int, int],
    most: int = _ASKED,
) -> list[int]:
    """The other photos that are asked about a photo's points (n, 3): all of `most` and fewer; of more so
    many, spread evenly over those that have some of the points before them, so that the work grows with the
    photos."""
    others = [other for other in range(len(viewmats)) if other != view]
    if len(others) <= most:
        return others
    some = points[_TRIED // 2 :: _TRIED].T  # (3, m)
    pos_c = viewmats[:, :3, :3] @ some + viewmats[:, :3, 3:]  # (V, 3, m)
    ahead = pos_c[:, 2].clamp_min(1e-8)
    x, y = (pos_c[:, axis] / ahead * Ks[:, axis, axis, None] + Ks[:, axis, 2, None] for axis in (0, 1))
    inside = (pos_c[:, 2] > 0) & (x >= 0) & (y >= 0) & (x < size[1]) & (y < size[0])
    seeing = [other for other, sees in enumerate(inside.any(1).tolist()) if sees and other != view]
    if len(seeing) <= most:
        return seeing
    return [seeing[(2 * k + 1) * len(seeing) // (2 * most)] for k in range(most)]


def outvoted(
    points: Float[Tensor, "V n 3"],
    viewmats: Float[Tensor, "V 4 4"],
    Ks: Float[Tensor, "V 3 3"],
    depths: Float[Tensor, "V H W"],
) -> Bool[Tensor, "V H W"]:
    """(V, H, W) bool: what lies beside a jump of depth, where two other photos and more see through it, and
    more than see it as their surface.

    Where depth jumps, a photo's map has values from between, which lie on no surface: skirts. Other photos
    look through them from aside. Away from jumps nothing is outvoted: where a near thing's depth is hard,
    most photos may have it too far, and they would vote down the one that has it right.

    Args:
        points: (V, H*W, 3) world, of each photo's pixels. viewmats, Ks, depths: as `seen_through`.
    """
    num_views, height, width = depths.shape
    through, same = torch.zeros(2, num_views, height * width, dtype=torch.int16)
    nearest = -F.max_pool2d(-depths[:, None], 3, 1, 1)[:, 0].flatten(1)
    farthest = F.max_pool2d(depths[:, None], 3, 1, 1)[:, 0].flatten(1)
    for view, own in enumerate(points):
        for other in witnesses(view, own, viewmats, Ks, (height, width)):
            x, y, z = pictured(viewmats[other], Ks[other], own.T)
            inside = (z > 0) & (x >= 0) & (x < width) & (y >= 0) & (y < height)
            places = torch.where(inside, y.floor() * width + x.floor(), 0.0).long()
            before = z < (1 - _SKIRT) * nearest[other].index_select(0, places)
            behind = z > (1 + _SKIRT) * farthest[other].index_select(0, places)
            through[view] += inside & before
            same[view] += inside & ~before & ~behind
    seen = ((through >= _VOTES) & (through > same)).view_as(depths)
    logs = depths.log()[:, None]
    steps = F.max_pool2d(logs, _AROUND, 1, _AROUND // 2) + F.max_pool2d(-logs, _AROUND, 1, _AROUND // 2)
    return seen & (steps[:, 0] > _JUMP)
