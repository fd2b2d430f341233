"""Atoms from pictures of the groups: each group is cut out of the photo that shows most of it.

For a tower that embeds whole pictures (CLIP): its vocabulary is wider than that of dense features
distilled from it. V views, K groups, H W pixels, C channels.
"""

from collections.abc import Callable

import torch
from jaxtyping import Float
from torch import Tensor
from torch.nn import functional as F

from langflash_core.network.semantics.settings import CROPS

Embed = Callable[[Tensor], Tensor]


def crop_atoms(
    weights: Float[Tensor, "V K H W"], photos: list[Float[Tensor, "3 _ _"]], embed: Embed
) -> Float[Tensor, "K C"]:
    """Atoms (K, C) of unit norm.

    Args:
        weights: w_k(x), (V, K, H, W) >= 0. photos: (3, h, w) in [0, 1], one per view, of any size.
        embed: pictures (K, 3, 224, 224) in [0, 1] -> (K, C).

    Source: CLIP on cut-out regions, as Gu et al. 2022 (ViLD); the box is ours.
    """
    pictures = [
        _picture(photos[view], group_box(weights[view, k])) for k, view in enumerate(_best_views(weights))
    ]
    if not pictures:
        return embed(weights.new_zeros(0, 3, CROPS.side, CROPS.side))
    return F.normalize(embed(torch.stack(pictures)).float(), dim=-1)


def _best_views(weights: Tensor) -> list[int]:
    return weights.sum((2, 3)).argmax(0).tolist()


def group_box(weights: Float[Tensor, "H W"]) -> tuple[float, float, float, float]:
    """(left, top, right, bottom) in shares of the picture, square in pixels where it fits; weights (H, W)."""
    height, width = weights.shape
    left, right = _extent(weights.sum(0))
    top, bottom = _extent(weights.sum(1))
    longest = max((right - left) * width, (bottom - top) * height)
    half = max(longest * (0.5 + CROPS.margin), CROPS.smallest * max(width, height) / 2)
    x, y = (left + right) / 2 * width, (top + bottom) / 2 * height
    return (
        max(x - half, 0) / width, max(y - half, 0) / height,
        min(x + half, width) / width, min(y + half, height) / height,
    )  # fmt: skip


def _extent(mass: Tensor) -> tuple[float, float]:
    """Where the mass (n,) along one side begins and ends, in shares of it."""
    shares = mass.double() / mass.double().sum().clamp_min(1e-12)
    until = shares.cumsum(0)
    inside = ((until > CROPS.tail) & (until - shares < 1 - CROPS.tail)).nonzero()
    if len(inside) == 0:
        return 0.0, 1.0
    return float(inside[0]) / len(mass), (float(inside[-1]) + 1) / len(mass)


def _picture(photo: Tensor, box: tuple[float, float, float, float]) -> Tensor:
    """(3, 224, 224): the box of a photo (3, h, w), its shorter side padded by repeating the edge."""
    height, width = photo.shape[-2:]
    left, right = int(box[0] * width), max(int(box[2] * width), int(box[0] * width) + 1)
    top, bottom = int(box[1] * height), max(int(box[3] * height), int(box[1] * height) + 1)
    cut = photo[:, top:bottom, left:right]
    missing_x, missing_y = max(0, cut.shape[1] - cut.shape[2]), max(0, cut.shape[2] - cut.shape[1])
    pads = (missing_x // 2, missing_x - missing_x // 2, missing_y // 2, missing_y - missing_y // 2)
    square = F.pad(cut[None], pads, mode="replicate")
    resized = F.interpolate(
        square, size=(CROPS.side, CROPS.side), mode="bicubic", align_corners=False, antialias=True
    )
    return resized[0].clamp(0, 1)
