"""From a language vector back to words, and to a query of its own."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import torch
from jaxtyping import Float
from torch import Tensor

from langflash_core.language.relevance import CompiledQuery, reduce_dictionary
from langflash_core.language.settings import RELEVANCE


@dataclass(frozen=True)
class NearWord:
    """A word and its cosine with what was asked about."""

    word: str
    cosine: float


def nearest_words(
    vector: Float[Tensor, " C"], words: Sequence[str], embeddings: Float[Tensor, "A C"], count: int = 5
) -> tuple[NearWord, ...]:
    """The words of a vocabulary nearest to a language vector, best first.

    Args:
        vector: (C,), any length. embeddings: (A, C) of the words, unit rows.

    Returns:
        At most `count`, each word once whatever its capitals; none for a vector that says nothing.

    Raises:
        ValueError: words and embeddings differ in number, or C disagrees.
    """
    if embeddings.shape != (len(words), vector.shape[-1]):
        expected = (len(words), vector.shape[-1])
        raise ValueError(f"embeddings: expected {expected}, received {tuple(embeddings.shape)}")
    norm = float(vector.norm())
    if not RELEVANCE.empty_norm <= norm < float("inf"):
        return ()
    cosines = embeddings @ (vector / norm).to(embeddings)
    best: dict[str, NearWord] = {}
    for row in cosines.argsort(descending=True, stable=True).tolist():
        word = str(words[row]).strip()
        best.setdefault(word.lower(), NearWord(word, float(cosines[row].clamp(-1, 1))))
        if len(best) == count:
            break
    return tuple(best.values())


def feature_at(weights: Float[Tensor, " K"], dictionary: Float[Tensor, "K C"]) -> Float[Tensor, " C"]:
    """F = W D (C,) of one pixel's weights (K,); atoms that are not finite count as 0."""
    return weights.to(dictionary) @ torch.where(torch.isfinite(dictionary), dictionary, 0.0)


def with_vectors(
    compiled: CompiledQuery, dictionary: Float[Tensor, "K C"], vectors: Mapping[int, Float[Tensor, " C"]]
) -> CompiledQuery:
    """The query with language vectors (C,) instead of some of its phrases, by their place.

    Args:
        dictionary: (K, C), the one that `compiled` was made for (`spoken_dictionary` of a scene).

    Raises:
        ValueError: a vector says nothing, or there is no such place.
    """
    if not vectors:
        return compiled
    _, basis = reduce_dictionary(dictionary)
    prompts = compiled.prompts.clone()
    for place, vector in vectors.items():
        norm = float(vector.norm())
        if not 0 <= place < len(prompts) or not RELEVANCE.empty_norm <= norm < float("inf"):
            raise ValueError(f"vectors: expected a finite vector for place 0 to {len(prompts) - 1}")
        prompts[place] = basis @ (vector / norm).to(basis)
    return replace(compiled, prompts=prompts)
