"""Which Gaussians answer a phrase: relevance of f_i = sum_k w_ik d_k itself, without a view."""

from dataclasses import replace

import torch
from torch import Tensor

from langflash_core.language.relevance import CompiledQuery, relevance_maps
from langflash_core.types import Scene, Semantics

_AT_ONCE = 1 << 16  # rows of dense weights: 33 MB for K = 128


def gaussian_relevance(semantics: Semantics, compiled: CompiledQuery) -> Tensor:
    """Relevance (P, N) of prompts at Gaussians, as `compiled.mode` says; 0 where one carries nothing."""
    maps = []
    for first in range(0, max(1, len(semantics.weight_ids)), _AT_ONCE):
        ids = semantics.weight_ids[first : first + _AT_ONCE]
        some = replace(
            semantics, weight_ids=ids, weight_values=semantics.weight_values[first : first + _AT_ONCE]
        )
        maps.append(relevance_maps(some.dense_weights(), compiled))
    return torch.cat(maps, -1)


def kept(scene: Scene, rows: Tensor) -> Scene:
    """The scene with only the Gaussians of `rows` (N,) bool; dictionary, views and photos stay."""
    semantics = replace(
        scene.semantics,
        weight_ids=scene.semantics.weight_ids[rows],
        weight_values=scene.semantics.weight_values[rows],
    )
    return replace(scene, gaussians=scene.gaussians.map(lambda values: values[rows]), semantics=semantics)
