"""Language feature aggregation: one vector per group. K groups, C channels, V views."""

import math

import torch
from jaxtyping import Float
from torch import Tensor, nn
from torch.nn import functional as F

from langflash_core.base.many import groups_of, in_groups
from langflash_core.network.layers.attention import QueryBlock
from langflash_core.network.presets import Preset

_CLOSELY = 32  # views that groups read at half of the features' size; more at less: as many tokens in all


def average_atoms(
    weights: Float[Tensor, "B V K h w"], features: Float[Tensor, "B V C h w"], eps: float = 1e-6
) -> Float[Tensor, "B K C"]:
    """d_k = sum_x w_k(x) L(x) / (sum_x w_k(x) + eps), not normalised.

    Args:
        weights: (B, V, K, h, w) >= 0. features: (B, V, C, h, w), unit channel norm.

    Returns:
        (B, K, C); norm in [0, 1]: how much the group's pixels agree.

    Source: the paper, initialisation of the aggregation.
    """
    sums = [
        torch.einsum("bvkhw,bvchw->bkc", weights[:, some], features[:, some].to(weights))
        for some in groups_of(weights.shape[1])
    ]
    total = sums[0] if len(sums) == 1 else torch.stack(sums).sum(0)
    return total / (weights.sum((1, 3, 4))[..., None] + eps)


def averaged_atoms(
    weights: Float[Tensor, "B V K h w"], features: Float[Tensor, "B V C h w"], eps: float = 1e-6
) -> Float[Tensor, "B K C"]:
    """`average_atoms` of unit norm; a group without agreement points nowhere."""
    return F.normalize(average_atoms(weights, features, eps), dim=-1)


def _average_pool(features: Tensor, side: int) -> Tensor:
    """Means (B, V, C, h / side, w / side) of features (B, V, C, h, w)."""
    side = min(side, *features.shape[-2:])
    return F.avg_pool2d(features.flatten(0, 1), side).unflatten(0, features.shape[:2])


class Aggregation(nn.Module):
    """Blocks in which groups read L(x) and each other; starts as the plain average."""

    def __init__(self, preset: Preset):
        super().__init__()
        dim = preset.language_dim
        self.eps = preset.eps
        self.embed, self.memory = nn.Linear(dim, dim), nn.Linear(dim, dim)
        self.blocks = nn.ModuleList(
            QueryBlock(dim, preset.aggregation_heads) for _ in range(preset.aggregation_blocks)
        )
        self.norm, self.out = nn.LayerNorm(dim), nn.Linear(dim, dim)
        nn.init.zeros_(self.out.weight)
        nn.init.zeros_(self.out.bias)

    def forward(
        self, weights: Float[Tensor, "B V K h w"], features: Float[Tensor, "B V C h w"]
    ) -> Float[Tensor, "B K C"]:
        """Atoms (B, K, C) of unit norm.

        Args:
            weights: w_k(x), (B, V, K, h, w), at the features' size.
            features: L(x), (B, V, C, h, w).
        """
        initial = F.normalize(average_atoms(weights, features, self.eps), dim=-1)
        side = 2 * math.ceil((features.shape[1] / _CLOSELY) ** 0.5)
        memory = in_groups(lambda some: _average_pool(some.float(), side), features, dim=1)
        memory = memory.permute(0, 1, 3, 4, 2).flatten(1, 3)  # (B, V*h*w/4, C)
        memory = self.memory(memory * memory.shape[-1] ** 0.5)
        queries = self.embed(initial * initial.shape[-1] ** 0.5)
        for block in self.blocks:
            queries = block(queries, memory)
        return F.normalize(initial + self.out(self.norm(queries)).float(), dim=-1)
