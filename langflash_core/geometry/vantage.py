"""Which photos of many stand for the others: how far photos are from each other, places and directions.

The distance of two is that of their places, over the median depth, and that of their unit vectors of view.

Sizes: V views, H W cells of the grid.
"""

import torch
from jaxtyping import Float
from torch import Tensor

from langflash_core.geometry.cameras import invert_rigid
from langflash_core.geometry.settings import VANTAGE


def leading(depths: Float[Tensor, "V H W"], viewmats: Float[Tensor, "V 4 4"]) -> list[int]:
    """Photos near one of which all are, as few as that takes, in order: one by one that which brings the
    others nearest. Of two both lead.

    Args:
        depths: (V, H, W) > 0. viewmats: (V, 4, 4).

    Source: greedy k-medoids (Kaufman and Rousseeuw 1990, BUILD).
    """
    count = len(depths)
    if count <= 2:
        return [*range(count)]
    most = count if count < VANTAGE.many else -(-count // VANTAGE.share)
    between, chosen = _between(depths, viewmats).sum(-1), []
    nearest = torch.full_like(between[0], torch.inf)
    while len(chosen) < most and not float(nearest.mean()) <= VANTAGE.near:
        left = torch.minimum(nearest, between).sum(1)
        left[chosen] = torch.inf
        chosen.append(int(left.argmin()))
        nearest = torch.minimum(nearest, between[chosen[-1]])
    return sorted(chosen)


def from_the_middle(depths: Float[Tensor, "V H W"], viewmats: Float[Tensor, "V 4 4"]) -> list[int]:
    """All V photos by how near they are to all others, the nearest first. Of two neither is nearer: as they
    come.

    Args:
        depths, viewmats: as `leading`.
    """
    if len(depths) <= 2:
        return [*range(len(depths))]
    return _between(depths, viewmats).sum((1, 2)).argsort(stable=True).tolist()


def _between(depths: Tensor, viewmats: Tensor) -> Tensor:
    """(V, V, 2) how far photos are from each other: places over the median depth; unit vectors of view."""
    poses = invert_rigid(viewmats.double())
    seen_at = torch.cat((poses[:, :3, 3] / depths.median(), poses[:, :3, 2]), 1)
    return (seen_at[:, None] - seen_at).unflatten(2, (2, 3)).norm(dim=-1)
