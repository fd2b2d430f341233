"""Weights of Gaussians over the atoms of a dictionary: the few that a scene keeps of each."""

import torch
from jaxtyping import Float, Int
from torch import Tensor


def sparse_weights(
    dense: Float[Tensor, "N K"], top_m: int
) -> tuple[Int[Tensor, "N m"], Float[Tensor, "N m"]]:
    """The `top_m` largest of w_ik (n, K), renormalised: ids (n, m) int64 and values (n, m).

    m = min(top_m, K). Rows without weight, or with values that are not finite, become 0.
    """
    clean = dense.float()
    finite = (clean * 0).sum(-1, keepdim=True) == 0  # as isfinite tells, in a third of the time
    values, ids = torch.where(finite, clean, 0.0).clamp_min(0).topk(min(top_m, dense.shape[1]), dim=-1)
    return ids, renormalise(values)


def renormalise(values: Float[Tensor, "n m"]) -> Float[Tensor, "n m"]:
    """Rows (n, m) >= 0 scaled to sum 1; rows of zeros stay."""
    sums = values.sum(-1, keepdim=True)
    return torch.where(sums > 0, values / sums.clamp_min(1e-12), 0.0)
