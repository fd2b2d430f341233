"""What one photo sees through cannot be there. N Gaussians of V views, order (v h w)."""

import torch
from torch import Tensor

from langflash_core.geometry.cameras import pictured

TOLERANCE = 0.12
"""A Gaussian this much nearer (relative depth) than the surface another photo sees is in its way:
beyond the depth error of the shipped network, so that double surfaces of good depth merge instead."""


def seen_through(
    means: Tensor,
    viewmats: Tensor,
    Ks: Tensor,
    depths: Tensor,
    confidences: Tensor,
    tolerance: float = TOLERANCE,
) -> Tensor:
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
        for other in range(num_views):
            if other == view:
                continue
            x, y, z = pictured(viewmats[other], Ks[other], own.T)
            inside = (z > 0) & (x >= 0) & (x < width) & (y >= 0) & (y < height)
            places = torch.where(inside, y.floor() * width + x.floor(), 0.0).long()
            theirs = trusts[other].index_select(0, places)
            outvoted = (theirs > trusts[view]) if other > view else (theirs >= trusts[view])
            blocked[view] |= inside & (z < limits[other].index_select(0, places)) & outvoted
    return blocked.flatten()
