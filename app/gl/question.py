"""What lives as long as the question: the phrases, who answers them, what Gaussians carry for them."""

from itertools import count

import numpy as np

from langflash_core.geometry.nearness import NEAREST
from langflash_core.language.relevance import CompiledQuery

from .answers import MakeAnswers, in_numbers
from .fast import MAX_PHRASES, splat_numbers
from .level import Level

_names = count(1)


class Question:
    """Phrases compiled for one dictionary. `key` names the question; `answers` makes who answers it."""

    def __init__(self, compiled: CompiledQuery, answers: MakeAnswers):
        self.compiled = compiled
        self.answers = answers
        self.key = next(_names)
        self._numbers: dict[Level, np.ndarray] = {}

    @property
    def num_phrases(self) -> int:
        return len(self.compiled.prompts)

    @property
    def fits_fast(self) -> bool:
        """Whether the fast mode has numbers enough for the phrases, of a scene that has atoms."""
        return self.compiled.factor.shape[0] > 0 and self.num_phrases <= MAX_PHRASES

    def numbers(self, level: Level) -> np.ndarray:
        """What each Gaussian of a level carries in the fast mode (fast.py), (N, 3 L); kept for the last
        levels, as many as a picture has layers."""
        numbers = self._numbers.pop(level, None)
        if numbers is None:
            factor, *_ = in_numbers(self.compiled)
            numbers = splat_numbers(level.splats, self.compiled, level.norms(factor))
        self._numbers[level] = numbers
        while len(self._numbers) > NEAREST:
            self._numbers.pop(next(iter(self._numbers)))
        return numbers
