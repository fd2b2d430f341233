"""Which Gaussians answer a phrase: relevance of f_i = sum_k w_ik d_k itself, without a view."""

import torch
from jaxtyping import Float
from torch import Tensor

from langflash_core.language.relevance import CompiledQuery, relevance_maps
from langflash_core.types import Semantics

_AT_ONCE = 1 << 16  # rows of dense weights: 33 MB for K = 128


def gaussian_relevance(semantics: Semantics, compiled: CompiledQuery) -> Float[Tensor, "P N"]:
    """Relevance (P, N) of prompts at Gaussians, as `compiled.mode` says; 0 where one carries nothing.

    `compiled.factor` may come from an edited dictionary of the same K atoms.
    """
    maps = []
    for first in range(0, max(1, len(semantics.weight_ids)), _AT_ONCE):
        some = semantics.rows(torch.arange(first, min(first + _AT_ONCE, len(semantics.weight_ids))))
        maps.append(relevance_maps(some.dense_weights(), compiled))
    return torch.cat(maps, -1)
