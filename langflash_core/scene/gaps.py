"""Gaps of a picture, filled by what is around them: to look at, never for answers, depth or cut-outs.

Seen from aside a scene of surface elements opens: where a depth is a little off, and behind things, nothing
is drawn, and dark cracks catch the eye more than anything else. There the colours of ever coarser pictures
of what is drawn around show through. They reach about an eighth of the picture; what is farther from
everything that is drawn stays empty, so nothing is invented where no photo looked.

Source: the pull-push of Gortler et al. 1996, "The Lumigraph", with a box filter and a linear one. The twin of
shaders/splat/pull.frag, push.frag and gaps.glsl.

Sizes: H W pixels, h = ceil(H / 2), w = ceil(W / 2).
"""

import math

import torch
from jaxtyping import Float
from torch import Tensor
from torch.nn import functional as F

from langflash_core.scene.settings import GAPS


def num_levels(width: int, height: int) -> int:
    """Of the coarser pictures, each half the size of the one before; at least one."""
    return max(1, round(math.log2(max(1.0, min(width, height) / GAPS.reach))))


def fill_gaps(
    rgb: Float[Tensor, "H W 3"], alphas: Float[Tensor, "H W"], background: float | Tensor = 0.0
) -> Float[Tensor, "H W 3"]:
    """The picture where it is covered, and where it is not what is around, or else the background.

    Args:
        rgb: over black. alphas: what of each pixel is covered, in [0, 1]. background: grey, or (3,).
    """
    levels = [torch.cat((rgb, alphas[..., None]), -1)]
    for _ in range(num_levels(rgb.shape[1], rgb.shape[0])):
        levels.append(pull_level(levels[-1]))
    behind = levels.pop()
    while levels:
        behind = push_level(levels.pop(), behind)
    return behind[..., :3] + (1 - behind[..., 3:]) * background


def pull_level(fine: Float[Tensor, "H W 4"]) -> Float[Tensor, "h w 4"]:
    """Sums of 2 x 2 premultiplied colours, covered at most once."""
    pairs = F.avg_pool2d(fine.movedim(-1, 0)[None], 2, ceil_mode=True, divisor_override=1)
    sums = pairs[0].movedim(0, -1)
    return sums / sums[..., 3:].clamp_min(1)


def push_level(fine: Float[Tensor, "H W 4"], coarse: Float[Tensor, "h w 4"]) -> Float[Tensor, "H W 4"]:
    """The coarse picture, interpolated linearly, behind the fine one."""
    height, width = fine.shape[:2]
    smooth = F.interpolate(coarse.movedim(-1, 0)[None], scale_factor=2, mode="bilinear")
    return fine + (1 - fine[..., 3:]) * smooth[0, :, :height, :width].movedim(0, -1)
