"""Every name that any set of photos has, in the space of texts, and which of them a set can deny.

A set that labels every chair says of a pixel of a sofa that it is no chair. A set of six outlined kinds says
nothing of curtains: what one set does not name is no example against it.

Sizes: S sets, N names, C channels of the language space.
"""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor

from langflash_core.lab.photos import Name
from langflash_core.lab.photos.names import CLASSES37
from langflash_core.lab.training.photo_names import photo_label

RARITY = 0.25
"""A class counts frequency^-RARITY: 0 is as pixels come, 1 all classes alike."""
MIN_PHOTOS = 5
"""A fine name that fewer photos of all sets show teaches nothing; its class still does."""
VISIBLE = 0.002
"""Share of a photo from which on it shows a thing."""


@dataclass(frozen=True)
class Shown:
    """What one photo shows: pixels by id of its set (0 left out)."""

    pixels: Mapping[int, int]
    size: int

    @staticmethod
    def of(labels: np.ndarray) -> "Shown":
        ids, counts = np.unique(labels, return_counts=True)
        pairs = zip(ids.tolist(), counts.tolist(), strict=True)
        return Shown({id: count for id, count in pairs if id}, labels.size)

    @property
    def seen(self) -> tuple[int, ...]:
        """Ids that are large enough to be seen."""
        return tuple(id for id, count in self.pixels.items() if count >= VISIBLE * self.size)


@dataclass(frozen=True)
class NamedSet:
    """Names of one set's ids, and what its photos show."""

    names: Mapping[int, Name]
    shown: Sequence[Shown]


@dataclass(frozen=True)
class NameBank:
    """texts: the N names; vectors (N, C) and classes (37, C): unit texts; balance (37,): what a pixel of a
    class counts; class_of and name_of: by set, rows by id, -1 = none; against (S, N, N) bool: where a set
    says the first, it denies the second (a name does not deny its kinds, nor what the set does not name).
    of_text (N,): the row of `heard` that a name belongs to; evidence (257, 38): of what another network says,
    for each class and anything else (`heard`), None where it says nothing.
    """

    texts: tuple[str, ...]
    vectors: Tensor
    classes: Tensor
    balance: Tensor
    class_of: tuple[Tensor, ...]
    name_of: tuple[Tensor, ...]
    against: Tensor
    of_text: Tensor | None = None
    evidence: Tensor | None = None

    @staticmethod
    def of(
        sets: Sequence[NamedSet],
        encode: Callable[[Sequence[str]], Tensor],
        evidence: Tensor | None = None,
    ) -> "NameBank":
        """All names that `MIN_PHOTOS` show, and the 37 classes."""
        counts: Counter[str] = Counter()
        for one in sets:
            said = {id: label.name for id, name in one.names.items() if (label := photo_label(name))}
            for photo in one.shown:
                counts.update({said[id] for id in photo.seen if id in said})
        frequent = sorted(name for name, count in counts.items() if count >= MIN_PHOTOS)
        texts = tuple(dict.fromkeys((*frequent, *CLASSES37)))
        at = {text: row for row, text in enumerate(texts)}
        rows = [_rows(one, at, set(frequent)) for one in sets]
        return NameBank(
            texts,
            encode(texts),
            encode(CLASSES37),
            _balance(sets, [classes for classes, _ in rows]),
            tuple(classes for classes, _ in rows),
            tuple(names for _, names in rows),
            torch.stack([_denied(one, at, names) for one, (_, names) in zip(sets, rows, strict=True)]),
            _classes_of(sets, texts),
            evidence,
        )

    def denying(self, texts: Tensor) -> "NameBank":
        """The same with more texts (M, C) that are true of nothing, behind the classes and the names."""
        shape = (*self.against.shape[:2], len(texts))
        return replace(
            self,
            vectors=torch.cat((self.vectors, texts)),
            classes=torch.cat((self.classes, texts)),
            against=torch.cat((self.against, torch.ones(shape, dtype=torch.bool)), 2),
        )

    def heard(self, said: Tensor) -> tuple[Tensor, Tensor] | None:
        """Evidence of what another network says (...), in nats, for the 37 classes (..., 37) and for all
        names (..., N); None: it says nothing."""
        if self.evidence is None or self.of_text is None:
            return None
        found = self.evidence.to(said.device)[said]  # -1 is the last row
        return found[..., :-1], found[..., self.of_text.to(said.device)]


def _classes_of(sets: Sequence[NamedSet], texts: Sequence[str]) -> Tensor:
    """Rows (N,) of the classes of names, by the first set that has them; the last row for anything else."""
    found = {text: row for row, text in enumerate(CLASSES37)}
    for one in sets:
        for name in one.names.values():
            label = photo_label(name)
            if label is not None and name.label in CLASSES37:
                found.setdefault(label.name, CLASSES37.index(name.label))
    return torch.tensor([found.get(text, len(CLASSES37)) for text in texts])


def _rows(one: NamedSet, at: Mapping[str, int], frequent: set[str]) -> tuple[Tensor, Tensor]:
    """Rows of classes and of names by id, -1 = none."""
    size = max(one.names, default=0) + 1
    class_of, name_of = torch.full((size,), -1), torch.full((size,), -1)
    for id, name in one.names.items():
        label = photo_label(name)
        if name.label in CLASSES37:
            class_of[id] = CLASSES37.index(name.label)
        if label is not None and label.name in frequent:
            name_of[id] = at[label.name]
    return class_of, name_of


def _denied(one: NamedSet, at: Mapping[str, int], name_of: Tensor) -> Tensor:
    """(N, N) of one set."""
    named = torch.zeros(len(at), dtype=torch.bool)
    named[name_of[name_of >= 0]] = True
    against = named[None].repeat(len(at), 1)
    against.fill_diagonal_(True)
    for id, name in one.names.items():
        label, row = photo_label(name), int(name_of[id])
        if label is None or row < 0:
            continue
        for other in (label.group, name.label, *label.words):
            if other is not None and other in at and other != label.name:
                against[row, at[other]] = False
    return against


def _balance(sets: Sequence[NamedSet], rows: Sequence[Tensor]) -> Tensor:
    """What a pixel of each class counts, 1 on average over the pixels of all sets that name one."""
    pixels = torch.zeros(len(CLASSES37))
    for one, class_of in zip(sets, rows, strict=True):
        for photo in one.shown:
            for id, count in photo.pixels.items():
                if class_of[id] >= 0:
                    pixels[class_of[id]] += count / photo.size
    share = pixels / pixels.sum().clamp_min(1e-9)
    balance = share.clamp_min(1e-5) ** -RARITY
    return balance / (balance * share).sum().clamp_min(1e-9)
