"""What lies behind an edge goes on a little under what hides it.

A photo ends a background at the edge of the thing before it. Seen from aside, a gap opens there as soon as
edge or depth is a pixel off, and a dark crack catches the eye more than anything else. So the last pixel of
the background before a jump of depth moves under the thing, at its own depth, and grows: the photo
shows it as before, since the thing is in front. The thing ends there for good: its last elements are drawn
back from the jump, or they would lie half over what is behind them, and depth would go down there by steps.

Sizes: V views, H W pixels.
"""

import torch
from jaxtyping import Float
from torch import Tensor

from langflash_core.geometry.surfels import steps_along, towards_nearer
from langflash_core.network.settings import OCCLUSION


def under_edges(log_depths: Float[Tensor, "V H W"]) -> Float[Tensor, "V H W 2"]:
    """(V, H, W, 2), as `towards_nearer` has them, of the jumps that a background goes on under."""
    return towards_nearer(log_depths, OCCLUSION.jump)


def over_edges(log_depths: Float[Tensor, "V H W"]) -> Float[Tensor, "V H W 2"]:
    """(V, H, W, 2) of -1, 0, 1 along columns and rows: where the farther side of a jump is from the last
    pixel of the nearer one."""
    signs = []
    for dim in (-1, -2):
        after, before = steps_along(log_depths, dim)
        ends = after > (2 * before.abs()).clamp_min(OCCLUSION.end)
        begins = before > (2 * after.abs()).clamp_min(OCCLUSION.end)
        signs.append(ends.to(log_depths) - begins.to(log_depths))
    return torch.stack(signs, -1)


def drawn_back(
    pos_c: Float[Tensor, "V H W 3"],
    tangent_u: Float[Tensor, "V H W 3"],
    tangent_v: Float[Tensor, "V H W 3"],
    edges: Float[Tensor, "V H W 2"],
) -> tuple[Float[Tensor, "V H W 3"], Float[Tensor, "V H W 3"], Float[Tensor, "V H W 3"]]:
    """Points and the tangents that span their elements (V, H, W, 3); those at `edges` (V, H, W, 2), as
    `over_edges` has them, are away from the jump and shorter across it."""
    across, down = edges[..., :1], edges[..., 1:]
    pos_c = pos_c - OCCLUSION.back * (across * tangent_u + down * tangent_v)
    shorter = 1 - (1 - OCCLUSION.short) * edges.abs()
    return pos_c, tangent_u * shorter[..., :1], tangent_v * shorter[..., 1:]


def extend_surfaces(
    pos_c: Float[Tensor, "V H W 3"],
    scales: Float[Tensor, "V H W 3"],
    log_depths: Float[Tensor, "V H W"],
    Ks: Float[Tensor, "V 3 3"],
) -> tuple[Float[Tensor, "V H W 3"], Float[Tensor, "V H W 3"]]:
    """Points and scales (V, H, W, 3) in the camera's frame; those on the farther side of a jump are moved by
    half of `OCCLUSION.under` pixels and, within the surface, as wide.

    Args:
        log_depths: (V, H, W) of the points. Ks: (V, 3, 3) pixels.
    """
    signs = under_edges(log_depths)
    lengths = signs.norm(dim=-1, keepdim=True)
    half = (OCCLUSION.under / 2 * log_depths.exp() / Ks[:, 0, 0, None, None])[..., None]
    move = torch.cat((signs / lengths.clamp_min(1) * half, torch.zeros_like(half)), -1)
    wider = torch.cat((torch.maximum(scales[..., :2], half), scales[..., 2:]), -1)
    return pos_c + move, torch.where(lengths > 0, wider, scales)
