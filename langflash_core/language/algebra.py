"""Prompt algebra: "sofa + cushion", "chair - armchair".

Only `+` and `-` with white space on both sides are operators, so that "t-shirt", "dining-room
table" and "C++ book" stay phrases. There are no brackets and no precedence.
"""

import re
from collections.abc import Sequence

import torch
from jaxtyping import Float
from torch import Tensor

from langflash_core.errors import PromptError
from langflash_core.language.spaces import LanguageSpace

_OPERATOR = re.compile(r"\s+([+-])\s+")
_CANCELLED = 1e-3  # a sum of unit vectors this short is rounding, not meaning


def terms(prompt: str) -> list[tuple[int, str]]:
    """(sign, phrase) pairs of a prompt; a plain phrase is one positive term.

    Raises:
        PromptError: nothing stands beside an operator, or the prompt is empty.
    """
    phrase, *rest = _OPERATOR.split(f" {prompt} ".replace("\n", " "))
    pairs = [(1, phrase.strip())]
    operands = zip(rest[::2], rest[1::2], strict=True)
    pairs += [(1 if sign == "+" else -1, text.strip()) for sign, text in operands]
    if not rest and not pairs[0][1]:
        raise PromptError("a prompt is empty; describe what to look for in a word or a short phrase")
    if not all(text for _, text in pairs):
        raise PromptError(f"the prompt {prompt!r} is incomplete; write a phrase on both sides of + and -")
    return pairs


def encode_prompts(space: LanguageSpace, prompts: Sequence[str]) -> Float[Tensor, "P C"]:
    """Unit embeddings (P, C) of prompts that may be sums and differences of phrases.

    t = normalise(sum_j sign_j e_j), all phrases encoded in one pass.

    Raises:
        PromptError: a prompt is empty, incomplete, or cancels itself out.
    """
    parsed = [terms(prompt) for prompt in prompts]
    phrases = space.encode([text for pairs in parsed for _, text in pairs])  # (all terms, C)
    embeddings = phrases.new_zeros(len(parsed), space.dimension)
    start = 0
    for row, pairs in enumerate(parsed):
        signs = torch.tensor([sign for sign, _ in pairs]).to(phrases)
        total = signs @ phrases[start : start + len(pairs)]
        if total.norm() < _CANCELLED:
            raise PromptError(f"the prompt {prompts[row]!r} cancels itself out; take another phrase away")
        embeddings[row] = phrases[start] if len(pairs) == 1 else total / total.norm()
        start += len(pairs)
    return embeddings
