"""Language feature aggregation: one vector per group. K groups, C channels, V views."""

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from langflash_core.network.layers.attention import QueryBlock
from langflash_core.network.presets import Preset


def average_atoms(weights: Tensor, features: Tensor, eps: float = 1e-6) -> Tensor:
    """d_k = sum_x w_k(x) L(x) / (sum_x w_k(x) + eps), not normalised.

    Args:
        weights: (B, V, K, h, w) >= 0. features: (B, V, C, h, w), unit channel norm.

    Returns:
        (B, K, C); norm in [0, 1]: how much the group's pixels agree.

    Source: the paper, initialisation of the aggregation.
    """
    total = torch.einsum("bvkhw,bvchw->bkc", weights, features)
    return total / (weights.sum((1, 3, 4))[..., None] + eps)


def averaged_atoms(weights: Tensor, features: Tensor, eps: float = 1e-6) -> Tensor:
    """`average_atoms` of unit norm; a group without agreement points nowhere."""
    return F.normalize(average_atoms(weights, features, eps), dim=-1)


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

    def forward(self, weights: Tensor, features: Tensor) -> Tensor:
        """Atoms (B, K, C) of unit norm.

        Args:
            weights: w_k(x), (B, V, K, h, w), at the features' size.
            features: L(x), (B, V, C, h, w).
        """
        initial = F.normalize(average_atoms(weights, features, self.eps), dim=-1)
        memory = F.avg_pool2d(features.flatten(0, 1), 2).unflatten(0, features.shape[:2])
        memory = memory.permute(0, 1, 3, 4, 2).flatten(1, 3)  # (B, V*h*w/4, C)
        memory = self.memory(memory * memory.shape[-1] ** 0.5)
        queries = self.embed(initial * initial.shape[-1] ** 0.5)
        for block in self.blocks:
            queries = block(queries, memory)
        return F.normalize(initial + self.out(self.norm(queries)).float(), dim=-1)
