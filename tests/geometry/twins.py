"""What the product computes, said plainly."""

import torch
from torch import Tensor


def seen_at(pos_c: Tensor, K: Tensor) -> Tensor:
    """Pixels (..., 2) of points (..., 3) in the frame of a camera with K (3, 3): K p, over its third row."""
    across = torch.cat((pos_c[..., :2], pos_c[..., 2:].clamp_min(1e-8)), -1) @ K.T
    return across[..., :2] / across[..., 2:]
