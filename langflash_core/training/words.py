"""Phrases of the training rooms in the language space: one table, sampled per instance.

Sizes: A phrases, C channels, I instances of one scene. A phrase of an instance is its catalogue
name, its class group, or one of its further words (tags, synonyms, broader terms, colours).
"""

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from langflash_core.training.shards import Label

PAPER_LABELS = ("wall", "floor", "ceiling", "chair", "table", "sofa", "bed", "other")
NAME_SHARE, GROUP_SHARE = 0.3, 0.35
"""How often an instance is called by its name or its group; further words take the rest."""


@dataclass(frozen=True)
class PhraseTable:
    """phrases (A) with embeddings (A, C), unit rows; groups: all class groups with instance counts."""

    phrases: tuple[str, ...]
    embeddings: Tensor
    groups: tuple[str, ...]
    group_counts: Tensor

    def index(self) -> dict[str, int]:
        return {phrase: row for row, phrase in enumerate(self.phrases)}

    def group_rows(self) -> Tensor:
        """Rows of the class groups' own names, (number of groups,)."""
        rows = self.index()
        return torch.tensor([rows[group] for group in self.groups], dtype=torch.int64)


def build_table(labels: Iterable[Label], encode: Callable[[Sequence[str]], Tensor]) -> PhraseTable:
    """Every phrase of the labels and its embedding; labels may repeat and are counted per group.

    Args:
        encode: phrases -> (A, C) unit rows (`LanguageSpace.encode`).

    Raises:
        ValueError: there is no label.
    """
    counts: Counter[str] = Counter()
    phrases: set[str] = set()
    for label in labels:
        counts[label.group] += 1
        phrases.update((label.name, label.group, *label.words))
    if not counts:
        raise ValueError("labels: expected at least one label, received none")
    ordered, groups = tuple(sorted(phrases)), tuple(sorted(counts))
    with torch.no_grad():
        embeddings = encode(ordered).float()
    return PhraseTable(
        ordered, embeddings, groups, torch.tensor([counts[g] for g in groups], dtype=torch.float32)
    )


class PhraseSampler:
    """Draws one phrase per instance; deterministic for a given generator."""

    def __init__(self, table: PhraseTable):
        self.table = table
        self._rows = table.index()
        self._groups = {group: row for row, group in enumerate(table.groups)}
        frequency = table.group_counts / table.group_counts.sum()
        median = frequency.median()
        self._balance = (frequency / median).clamp(0.1, 10).rsqrt()

    def draw(self, labels: Sequence[Label], generator: torch.Generator) -> Tensor:
        """Rows (I,) of one phrase per label."""
        chosen = torch.rand(len(labels), 2, generator=generator).tolist()
        return torch.tensor(
            [self._rows[self._pick(lb, *u)] for lb, u in zip(labels, chosen, strict=True)], dtype=torch.int64
        )

    def groups(self, labels: Sequence[Label]) -> Tensor:
        """Class index (I,) of every label into `table.groups`; -1 for a group the table lacks."""
        return torch.tensor([self._groups.get(lb.group, -1) for lb in labels], dtype=torch.int64)

    def balance(self, labels: Sequence[Label]) -> Tensor:
        """Weights (I,): rare groups up to 3 times, common ones down to 0.3 times the median's."""
        rows = self.groups(labels)
        return torch.where(rows >= 0, self._balance[rows.clamp_min(0)], torch.ones(len(labels)))

    @staticmethod
    def _pick(label: Label, kind: float, which: float) -> str:
        if kind < NAME_SHARE or (not label.words and kind < 0.5):
            return label.name
        if kind < NAME_SHARE + GROUP_SHARE or not label.words:
            return label.group
        return label.words[int(which * len(label.words))]
