"""Which photos a photo's depth is compared with: those that see the same surface from another side.

The photos that share most with one are taken from almost the same place, where depth moves nothing; those
far round see other things. Each sampled point of a photo's depth map is worth something in another photo
that sees it, by the angle between the two rays; partners are chosen one by one, each for what it adds
to points that those before it do not say enough about, so they lie on several sides and together see
most of the picture. Two partners from nearly one place err alike, and the second adds little.

Sizes: V views, H W pixels of the maps, n sampled points of each.

Source: own derivation; the score of angles is that of view selection in multi-view stereo (Goesele et al.
2007; Yao et al. 2018), the choice is greedy on a submodular gain.
"""

import torch
from jaxtyping import Float
from torch import Tensor
from torch.nn import functional as F

from langflash_core.geometry.cameras import invert_rigid, pictured, unproject
from langflash_core.network.stereo.sweep import Neighbours, everyone

PARTNERS = 4
"""Of each photo."""
_STEP = 8  # pixels between sampled points
_SURFACE = 0.3  # log depth by which the other map may differ and still show the point
_FULL, _BEST, _FALL = 8.0, 9.0, 8.0  # degrees: worth grows up to the first, falls beyond the second
_APART = 4.0  # degrees between two partners, from which on they say different things
_ENOUGH = 0.15  # worth that a point has from the start: what more of the same adds to it
_LEAST = 0.01  # of gain a point, for a partner


def partners(
    log_depths: Float[Tensor, "V H W"],
    viewmats: Float[Tensor, "V 4 4"],
    Ks: Float[Tensor, "V 3 3"],
    count: int = PARTNERS,
) -> Neighbours:
    """Of each view at most `count` others, the best first; two views have each other.

    Args:
        log_depths: (V, H, W). viewmats: (V, 4, 4) of the maps' unit. Ks: (V, 3, 3), pixels of the maps.
    """
    if len(log_depths) <= 2:
        return everyone(len(log_depths))
    return [_greedy(*of, count) for of in _worths(log_depths, viewmats, Ks)]


def _worths(log_depths: Tensor, viewmats: Tensor, Ks: Tensor):
    """Of each view (V, n): what its points are worth in every view, in [0, 1]; 0 in its own; and the unit
    vectors (V, n, 3) from every view to them."""
    height, width = log_depths.shape[1:]
    flat, poses = log_depths.flatten(1), torch.stack([invert_rigid(own) for own in viewmats])
    sparse = (slice(_STEP // 2, None, _STEP), slice(_STEP // 2, None, _STEP))
    for view, own in enumerate(log_depths):
        pos_c = unproject(own.exp(), Ks[view])[sparse].flatten(0, 1)
        points = pos_c @ poses[view, :3, :3].T + poses[view, :3, 3]
        towards = F.normalize(points - poses[:, None, :3, 3], dim=-1)  # (V, n, 3)
        cosines = (towards * towards[view]).sum(-1).clamp(-1, 1)
        angles = torch.rad2deg(torch.acos(cosines))
        worth = (angles / _FULL).clamp(max=1) * torch.exp(-(((angles - _BEST).clamp_min(0) / _FALL) ** 2))
        x, y, z = (
            torch.stack(along)
            for along in zip(*(pictured(*of, points.T) for of in zip(viewmats, Ks, strict=True)), strict=True)
        )
        inside = (z > 0) & (x >= 0) & (y >= 0) & (x < width) & (y < height)
        places = torch.where(inside, y.floor() * width + x.floor(), 0.0).long()
        gap = z.clamp_min(1e-6).log() - flat.gather(1, places)
        worth = torch.where(inside & (gap.abs() < _SURFACE), worth, 0.0)
        worth[view] = 0
        yield worth, towards


def _greedy(worth: Tensor, towards: Tensor, count: int) -> list[int]:
    """Partners by worth (V, n), each for the gain in the sum of log worth over the points; to what one says
    others add as much as they see it from elsewhere."""
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
