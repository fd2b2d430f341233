"""Fresh numbers for learned parameters."""

import torch
from jaxtyping import Float
from torch import Tensor


def draw_normal(*shape: int, std: float = 1.0) -> Float[Tensor, "..."]:
    """Normally distributed numbers around 0; on the meta device their shape alone.

    There `normal_` would import torch's compiler and sympy, one and a half seconds, to draw nothing.
    """
    numbers = torch.empty(shape)
    return numbers if numbers.is_meta else numbers.normal_(std=std)
