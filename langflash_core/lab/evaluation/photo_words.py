"""What is asked of real photos: 37 classes, the paper's eight labels, fine names, and absent things.

Ids of a labelled folder are brought to rows of these lists once; maps of ids then become maps of rows.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from langflash_core.lab.evaluation.words import OTHER, PAPER_LABELS
from langflash_core.lab.photos import Name, PhotoFolder
from langflash_core.lab.photos.names import CLASSES37
from langflash_core.lab.training.photo_names import group_of, photo_label
from langflash_core.language.vocabulary import EVALUATED, groups_of

_TABLES = frozenset({"table", "desk", "night stand"})
_TABLE_NAMES = frozenset({"coffee table"})
MIN_PIXELS = 150
"""A photo shows a name from so many pixels on, when photos of a name are counted."""
FINE_PHOTOS, ASKED_PHOTOS = 30, 8
"""Photos from which a fine name is judged, and from which a name is sure enough to be asked."""
SYNONYM = 0.5
"""Cosine to something in the photo above which a name would be found rightly; it is no test of absence."""


def paper_row(label: str | None, text: str = "", *, published: bool = False) -> int:
    """Row of `PAPER_LABELS` of a class of forty: desks and bedside tables are tables, as in rendered rooms.

    Args:
        text: the fine name; a coffee table is a table, whatever its class.
        published: only a class of the same name counts for a label, as the paper's protocol has it.
    """
    if not published and (label in _TABLES or text in _TABLE_NAMES):
        return PAPER_LABELS.index("table")
    return PAPER_LABELS.index(label) if label in PAPER_LABELS else OTHER


@dataclass(frozen=True)
class PhotoWords:
    """Lists that are asked, and tables (largest id + 1,) from ids to their rows; -1 = not judged.

    classes: the 37, in `classes_of`. papers: rows of `PAPER_LABELS`; published: the same, by class alone.
    fine, fine_of: names in at least `FINE_PHOTOS` photos. asked, asked_of: names that may be asked. every,
    every_of: names that say something, in however few photos.
    """

    classes: tuple[str, ...]
    classes_of: Tensor
    papers: Tensor
    published: Tensor
    fine: tuple[str, ...]
    fine_of: Tensor
    asked: tuple[str, ...]
    asked_of: Tensor
    every: tuple[str, ...]
    every_of: Tensor

    @property
    def judged(self) -> tuple[str, ...]:
        """Classes and fine names, each once."""
        return tuple(dict.fromkeys((*self.classes, *self.fine)))

    @property
    def phrases(self) -> tuple[str, ...]:
        """Everything that is asked, each once; first what is judged."""
        return tuple(dict.fromkeys((*self.judged, *self.every)))

    def rows(self, texts: Sequence[str]) -> list[int]:
        """Places of phrases in `phrases`."""
        places = {text: row for row, text in enumerate(self.phrases)}
        return [places[text] for text in texts]

    @staticmethod
    def of(names: dict[int, Name], photos: dict[str, int]) -> "PhotoWords":
        """Lists for the ids of a folder, of which `photos` counts the photos of every name."""
        fine = tuple(sorted(text for text, count in photos.items() if count >= FINE_PHOTOS))
        asked = tuple(sorted(text for text, count in photos.items() if count >= ASKED_PHOTOS))
        every = tuple(sorted(photos))
        size = max(names, default=0) + 1

        def table(row_of) -> Tensor:
            values = torch.full((size,), -1)
            for id, name in names.items():
                values[id] = row_of(name)
            return values

        return PhotoWords(
            classes=CLASSES37,
            classes_of=table(lambda n: _place(CLASSES37, n.label)),
            papers=table(lambda n: paper_row(n.label, n.text)),
            published=table(lambda n: paper_row(n.label, published=True)),
            fine=fine,
            fine_of=table(lambda n: _place(fine, n.text)),
            asked=asked,
            asked_of=table(lambda n: _place(asked, n.text)),
            every=every,
            every_of=table(lambda n: _place(every, n.text)),
        )


def _place(texts: Sequence[str], text: str | None) -> int:
    return texts.index(text) if text in texts else -1


def photos_of_names(folder: PhotoFolder, ids: Iterable[str]) -> dict[str, int]:
    """How many photos show each name that says something, with at least `MIN_PIXELS`."""
    counts: dict[str, int] = {}
    for id in ids:
        areas = np.bincount(folder.labels(id).ravel())
        texts: dict[str, int] = {}
        for number in np.flatnonzero(areas).tolist():
            if number in folder.names and photo_label(folder.names[number]) is not None:
                text = folder.names[number].text
                texts[text] = texts.get(text, 0) + int(areas[number])
        for text, area in texts.items():
            if area >= MIN_PIXELS:
                counts[text] = counts.get(text, 0) + 1
    return counts


def _true_of(text: str) -> frozenset[str]:
    """Groups of the vocabulary that a word is true of, also of those that no training says."""
    return groups_of(text) | EVALUATED.get(text, frozenset())


def absent_rows(
    there: Sequence[str], asked: Sequence[str], embeddings: Tensor, count: int, generator: torch.Generator
) -> list[int]:
    """Rows of up to `count` names of `asked` that a photo does not show and that mean something else.

    Left out are names of a group that is there, by the vocabulary, and such as are near in words.

    Args:
        there: every name in the photo, however small. embeddings: (len(asked), C), unit rows.
    """
    groups = {group_of(text) for text in there}.union(*(_true_of(text) for text in there))
    shown = [row for row, text in enumerate(asked) if text in there]
    near = (embeddings @ embeddings[shown].T).amax(1) if shown else torch.zeros(len(asked))
    free = [
        row
        for row, text in enumerate(asked)
        if float(near[row]) <= SYNONYM and group_of(text) not in groups and not _true_of(text) & groups
    ]
    order = torch.randperm(len(free), generator=generator).tolist()
    return [free[i] for i in order[:count]]
