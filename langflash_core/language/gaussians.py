"""Which Gaussians answer a phrase: relevance of f_i = sum_k w_ik d_k itself, without a view."""

import torch
from jaxtyping import Bool, Float
from torch import Tensor

from langflash_core.language.relevance import CompiledQuery, relevance_maps
from langflash_core.language.settings import ANSWERING
from langflash_core.types import Scene, Semantics

_ENOUGH = 200_000  # Gaussians of a scene that are asked: of each of 32 photos some six of `top_fraction`
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


def answering_shares(
    scene: Scene, compiled: CompiledQuery, there: Bool[Tensor, " N"] | None = None
) -> Float[Tensor, "P W"]:
    """Share (P, V + 1) of each photo's own Gaussians that answer phrases, of as many as do for a guess; last
    of those of which no photo is known. there: those that count; None: all."""
    rows = torch.arange(0, len(scene.gaussians), 1 + len(scene.gaussians) // _ENOUGH)
    rows = rows if there is None else rows[there[rows]]
    count = scene.num_views + 1
    if scene.view_ids is None:
        views = torch.full((len(rows),), count - 1)
    else:
        views = scene.view_ids[rows].cpu().long()
        views = torch.where(views < 0, count - 1, views)
    hits = gaussian_relevance(scene.semantics.rows(rows), compiled).cpu() >= compiled.threshold
    numbers = torch.stack([views[each].bincount(minlength=count) for each in hits])
    return numbers / views.bincount(minlength=count).clamp_min(1)


def photos_that_answer(shares: Float[Tensor, "P W"]) -> tuple[int | None, ...]:
    """Of `answering_shares` the photo that shows most of each phrase, from 0; None where too little of any
    answers for it to be found there."""
    known = shares[:, :-1]
    if not known.shape[1]:
        return (None,) * len(shares)
    return tuple(
        int(view) if share >= ANSWERING.top_fraction else None
        for share, view in zip(*known.max(1), strict=True)
    )
