"""Where depth jumps from a pixel to the next. Any leading sizes, H W pixels."""

import torch
from jaxtyping import Float
from torch import Tensor


def steps_along(
    log_depths: Float[Tensor, "*n H W"], dim: int
) -> tuple[Float[Tensor, "*n H W"], Float[Tensor, "*n H W"]]:
    """From a pixel to the next along an axis, and to the one before it, (..., H, W); 0 at the border."""
    steps = log_depths.diff(dim=dim)
    none = torch.zeros_like(log_depths.narrow(dim, 0, 1))
    return torch.cat((steps, none), dim), torch.cat((none, -steps), dim)


def towards_nearer(log_depths: Float[Tensor, "*n H W"], jump: float) -> Float[Tensor, "*n H W 2"]:
    """(..., H, W, 2) of -1, 0, 1 along columns and rows: where the nearer side of a jump is from a pixel of
    the farther one; 0 where it is on both sides.

    Args:
        log_depths: (..., H, W). jump: of log depth from a pixel to the next.
    """
    signs = []
    for dim in (-1, -2):
        after, before = steps_along(log_depths, dim)
        signs.append((after < -jump).to(log_depths) - (before < -jump).to(log_depths))
    return torch.stack(signs, -1)
