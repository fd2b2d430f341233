"""What another network's opinions are worth: how often it says what of which class, over labelled photos.

What it says is turned into evidence for and against each of the 37 classes and "something else", whatever
its own names are and however it was trained: log P(said | class) - log P(said), in nats. Added to the
logits of who looks himself it gives the odds of both together, as far as they err independently (Bayes).

On the kept photos of NYU Depth v2 the eighth version's features name .300 of the 37 classes alone and .324
with such evidence of a DeepLab of 2.3 MB, which alone names half as well (MEASURED.md).
"""

from collections.abc import Iterable, Mapping

import numpy as np
import torch
from torch import Tensor

from langflash_core.lab.photos import Name
from langflash_core.lab.photos.folder import LabelledPhoto
from langflash_core.lab.photos.names import CLASSES37

OTHER = len(CLASSES37)
"""The row of what is none of the 37 classes, but labelled."""
VALUES = 256
SMOOTH = 30.0
"""Pixels of every class, said as often as of all classes together, beside those that were counted."""
WEIGHT = 0.75
"""Of the evidence: neighbouring pixels and both networks err together. (.5 to 1 name as well, 1.5 worse.)"""


def counted(names: Mapping[int, Name], photos: Iterable[LabelledPhoto]) -> Tensor:
    """How often each value is said of each class, (38, 256) float64, over labelled pixels of photos that have
    opinions."""
    row_of = np.full(max(names, default=0) + 1, OTHER)
    row_of[0] = -1
    for id, name in names.items():
        if name.label in CLASSES37:
            row_of[id] = CLASSES37.index(name.label)
    counts = np.zeros((OTHER + 1) * VALUES)
    for photo in photos:
        if photo.labels is not None and photo.opinions is not None:
            rows = row_of[photo.labels]
            known = rows >= 0
            counts += np.bincount(VALUES * rows[known] + photo.opinions[known], minlength=len(counts))
    return torch.from_numpy(counts.reshape(OTHER + 1, VALUES))


def evidence(counts: Tensor) -> Tensor:
    """Evidence (257, 38) float32 of every value for each class, in nats, times `WEIGHT`; the last row, of
    what nobody said (-1), is 0, and so is what was never counted."""
    usual = counts.sum(0) / counts.sum().clamp_min(1)
    likely = (counts + SMOOTH * VALUES * usual) / (counts.sum(1, keepdim=True) + SMOOTH * VALUES)
    logs = likely.clamp_min(1e-12).log() - usual.clamp_min(1e-12).log()
    found = torch.where(usual > 0, logs, 0.0).T.float()
    return torch.cat((WEIGHT * found, torch.zeros(1, OTHER + 1)))
