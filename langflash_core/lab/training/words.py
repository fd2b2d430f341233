"""Phrases of the training rooms in the language space: one table, sampled per instance.

Sizes: A phrases, C channels, G class groups, I instances of one scene. A phrase of an instance is
its catalogue name, its class group, or a further word: tags, and what `vocabulary` says of its
group. Words are added when the table is built, so rendered rooms know nothing of them. Phrases
that the evaluation keeps for itself are never drawn.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from langflash_core.lab.training.shards import Label
from langflash_core.language.vocabulary import OWN, further_words, groups_of, is_name, is_trainable

NAME_SHARE, GROUP_SHARE = 0.3, 0.3
"""How often an instance is called by its name or its group; further words take the rest."""
SYNONYM = 0.6
"""Cosine from which a phrase outside the vocabulary is no evidence against a name."""
BASELINES: tuple[str, ...] = ("object", "things", "stuff", "texture")
"""What queries compare a phrase with; always among the negatives, so that they mean little."""


@dataclass(frozen=True)
class PhraseTable:
    """phrases (A) with embeddings (A, C), unit rows; meanings (A): the groups each is true of, by the
    vocabulary or else by the labels that carry it; groups: all class groups with instance counts."""

    phrases: tuple[str, ...]
    embeddings: Tensor
    meanings: tuple[frozenset[str], ...]
    groups: tuple[str, ...]
    group_counts: Tensor

    def index(self) -> dict[str, int]:
        return {phrase: row for row, phrase in enumerate(self.phrases)}

    def group_rows(self) -> Tensor:
        """Rows of the class groups' own names, (G,)."""
        rows = self.index()
        return torch.tensor([rows[group] for group in self.groups], dtype=torch.int64)

    def standing_rows(self) -> Tensor:
        """Rows that are negatives in every batch: class groups and `BASELINES`."""
        return torch.cat((self.group_rows(), self.baseline_rows()))

    def baseline_rows(self) -> Tensor:
        """Rows of `BASELINES`."""
        rows = self.index()
        return torch.tensor([rows[phrase] for phrase in BASELINES])


def names_of(label: Label) -> tuple[str, str, tuple[str, ...]]:
    """Name, group and further words of a label, as they may be taught.

    A name that the evaluation keeps for itself gives way to the group; tags that do not name the
    thing ("ceiling" for a lamp) are dropped.
    """
    name = label.name if is_trainable(label.name) else label.group
    words = (*(w for w in label.words if is_name(w, label.group)), *further_words(label.group))
    kept = dict.fromkeys(word for word in words if is_trainable(word) and word not in (name, label.group))
    return name, label.group, tuple(kept)


def build_table(labels: Iterable[Label], encode: Callable[[Sequence[str]], Tensor]) -> PhraseTable:
    """Every phrase of the labels and its embedding; labels may repeat and are counted per group.

    Args:
        encode: phrases -> (A, C) unit rows (`LanguageSpace.encode`).

    Raises:
        ValueError: there is no label.
    """
    repeats = Counter(labels)
    if not repeats:
        raise ValueError("labels: expected at least one label, received none")
    counts: Counter[str] = Counter()
    carriers: dict[str, set[str]] = {phrase: set() for phrase in BASELINES}
    for label, count in repeats.items():
        counts[label.group] += count
        name, group, words = names_of(label)
        for phrase in (name, group, *words):
            carriers.setdefault(phrase, set()).add(group)
    ordered, groups = tuple(sorted(carriers)), tuple(sorted(counts))
    meanings = tuple(groups_of(phrase) or frozenset(carriers[phrase]) for phrase in ordered)
    with torch.no_grad():
        embeddings = encode(ordered).float()
    group_counts = torch.tensor([counts[g] for g in groups], dtype=torch.float32)
    return PhraseTable(ordered, embeddings, meanings, groups, group_counts)


class PhraseSampler:
    """Draws one phrase per instance; deterministic for a given generator."""

    def __init__(self, table: PhraseTable):
        self.table = table
        self._rows = table.index()
        self._groups = {group: row for row, group in enumerate(table.groups)}
        frequency = table.group_counts / table.group_counts.sum()
        median = frequency.median()
        self._balance = (frequency / median).clamp(0.1, 10).rsqrt()
        self._listed = torch.tensor([bool(groups_of(p)) or p in BASELINES for p in table.phrases])
        self._names: dict[Label, tuple[str, str, tuple[str, ...]]] = {}
        self._truths: dict[Label, Tensor] = {}

    def draw(self, labels: Sequence[Label], generator: torch.Generator) -> Tensor:
        """Rows (I,) of one phrase per label."""
        chosen = torch.rand(len(labels), 2, generator=generator).tolist()
        return torch.tensor(
            [self._rows[self._pick(lb, *u)] for lb, u in zip(labels, chosen, strict=True)], dtype=torch.int64
        )

    def true(self, labels: Sequence[Label]) -> Tensor:
        """Which phrases of the table hold for which label, (I, A) bool: none of these is a negative.

        Its own phrases; whatever else means its group; and of other groups' names and tags, those
        nearer than `SYNONYM` to its name or group. Phrases that the vocabulary lists are true of
        the groups listed and no other, however near ("armchair" is false of a sofa).
        """
        return torch.stack([self._truth(label) for label in labels])

    def groups(self, labels: Sequence[Label]) -> Tensor:
        """Class index (I,) of every label into `table.groups`; -1 for a group the table lacks."""
        return torch.tensor([self._groups.get(lb.group, -1) for lb in labels], dtype=torch.int64)

    def balance(self, labels: Sequence[Label]) -> Tensor:
        """Weights (I,): rare groups up to 3 times, common ones down to 0.3 times the median's."""
        rows = self.groups(labels)
        return torch.where(rows >= 0, self._balance[rows.clamp_min(0)], torch.ones(len(labels)))

    def _truth(self, label: Label) -> Tensor:
        if label not in self._truths:
            name, group, words = self._called(label)
            own = [self._rows[phrase] for phrase in (name, group, *words)]
            table = self.table.embeddings
            near = (table @ table[own[:2]].T).amax(1) > SYNONYM
            if group in OWN:
                near &= ~self._listed
            true = near | torch.tensor([group in meaning for meaning in self.table.meanings])
            true[own] = True
            self._truths[label] = true
        return self._truths[label]

    def _called(self, label: Label) -> tuple[str, str, tuple[str, ...]]:
        if label not in self._names:
            self._names[label] = names_of(label)
        return self._names[label]

    def _pick(self, label: Label, kind: float, which: float) -> str:
        name, group, words = self._called(label)
        if kind < NAME_SHARE or (not words and kind < 0.5):
            return name
        if kind < NAME_SHARE + GROUP_SHARE or not words:
            return group
        return words[int(which * len(words))]
