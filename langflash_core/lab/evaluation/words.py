"""Phrases for evaluation: the paper's eight labels, other words for them, and absent things."""

from collections.abc import Sequence

import torch
from torch import Tensor

from langflash_core.language.vocabulary import EVALUATED

PAPER_LABELS = ("wall", "floor", "ceiling", "chair", "table", "sofa", "bed", "other")
OTHER = len(PAPER_LABELS) - 1
_GROUPS_OF_PAPER = {
    "wall": ("wall",),
    "floor": ("floor",),
    "ceiling": ("ceiling",),
    "chair": ("chair", "armchair", "stool", "high chair"),
    "table": ("table", "coffee table", "desk", "bedside table", "game table", "dressing table"),
    "sofa": ("sofa",),
    "bed": ("bed", "bunk bed", "crib"),
}
_PAPER_OF_GROUP = {group: label for label, groups in _GROUPS_OF_PAPER.items() for group in groups}
PARAPHRASES = EVALUATED
"""Other words as people use them -> the class groups that each is true of; no training says them."""


def paper_label(group: str) -> int:
    """Index into `PAPER_LABELS` of a class group; things without a label of their own are "other"."""
    return PAPER_LABELS.index(_PAPER_OF_GROUP.get(group, "other"))


def absent_phrases(
    present: Sequence[str], groups: Sequence[str], embeddings: Tensor, count: int, generator: torch.Generator
) -> list[str]:
    """Up to `count` groups that a scene does not hold and that mean something else.

    A group whose name has a cosine above 0.5 to one that is there ("armchair" for "chair") would
    be found rightly; it is no test of absence.

    Args:
        present: groups in the scene. groups: all groups. embeddings: (len(groups), C), unit rows.
    """
    names = list(groups)
    rows = {group: row for row, group in enumerate(names)}
    there = [rows[g] for g in present if g in rows]
    alike = (embeddings @ embeddings[there].T).amax(1) if there else torch.zeros(len(names))
    free = [i for i in range(len(names)) if float(alike[i]) <= 0.5]
    order = torch.randperm(len(free), generator=generator).tolist()
    return [names[free[i]] for i in order[:count]]
