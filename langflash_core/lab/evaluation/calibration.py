"""One threshold for "found" and for masks, from rendered rooms and real photos alike; how far to trust it.

The threshold maximises the lower of precision and recall plus the mean IoU of the masks of what is there,
averaged over the sets: one who trusts "found" must be able to trust "not found", and masks decide where the
two are level. Each set counts the same, however many phrases it holds.

Sizes: P phrases, M masks, T trial thresholds.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import torch
from torch import Tensor

from langflash_core.base.running import Progress
from langflash_core.errors import InputError
from langflash_core.lab.evaluation.bench import Bench
from langflash_core.lab.evaluation.labelled import Judged, ask_photo, draw_photo
from langflash_core.lab.evaluation.labelled import Tally as PhotoTally
from langflash_core.lab.evaluation.metrics import Presence, presence
from langflash_core.lab.evaluation.rooms.phrases import MASK_THRESHOLDS
from langflash_core.lab.evaluation.rooms.run import asked_rooms
from langflash_core.lab.photos import PhotoFolder
from langflash_core.language.leads import nearer_threshold
from langflash_core.language.spaces import language_space
from langflash_core.network import LangFlashNet

BINS = 20
"""Of scores, in the reliability diagram."""


@dataclass(frozen=True)
class Asked:
    """Answers of one set: scores (P,) in (0, 1), truths (P,) bool, ious (M, T) of the masks of present
    phrases at each of `MASK_THRESHOLDS`; halves (P,) and mask_halves (M,): 0 or 1, whole scenes."""

    scores: Tensor
    truths: Tensor
    ious: Tensor
    halves: Tensor
    mask_halves: Tensor

    @staticmethod
    def of(scores: Sequence[Tensor], truths: Sequence[Tensor], ious: Sequence[Tensor]) -> "Asked":
        """From tallies, a tensor per scene and a row per mask; scenes go to the halves in eighths of the
        whole, so that neighbours, which may show one room, stay together.

        Raises:
            InputError: nothing was asked.
        """
        if not scores:
            raise InputError("nothing could be asked of this set; give scenes that show known things")
        blocks = min(8, len(scores))
        half = torch.tensor([blocks * k // len(scores) % 2 for k in range(len(scores))])
        sizes = torch.tensor([len(s) for s in scores])
        there = torch.tensor([int(t.sum()) for t in truths])
        return Asked(
            torch.cat(list(scores)),
            torch.cat(list(truths)),
            torch.stack(list(ious)),
            half.repeat_interleave(sizes),
            half.repeat_interleave(there),
        )

    def half(self, which: int) -> "Asked":
        rows, masks = self.halves == which, self.mask_halves == which
        return Asked(
            self.scores[rows], self.truths[rows], self.ious[masks], self.halves[rows], self.mask_halves[masks]
        )


def rooms_asked(network: LangFlashNet, data: Path, *, limit: int | None = None) -> Asked:
    """Phrases in the validation rooms of a cache.

    Raises:
        InputError: there is no such set.
    """
    tally = asked_rooms(network, data, limit=limit)
    return Asked.of(tally.scores, tally.truths, tally.mask_ious)


def photos_asked(
    folder: PhotoFolder,
    ids: Sequence[str],
    bench: Bench,
    progress: Progress = lambda stage, fraction: None,
) -> Asked:
    """Phrases in labelled photos, as `run_photos` asks them.

    Raises:
        InputError: the folder has no labels, or a map cannot be used.
    """
    judged, tally = Judged.of(folder, bench), PhotoTally()
    for done, id in enumerate(ids):
        progress(f"photo {id}, {done + 1} of {len(ids)}", done / len(ids))
        drawn, _ = draw_photo(judged, folder.photo(id))
        ask_photo(judged, drawn, int(id) if id.isdigit() else 0, tally)
    return Asked.of(tally.scores, tally.truths, tally.ious)


def calibration(network: LangFlashNet, sets: dict[str, Asked]) -> dict:
    """What the weights' header keeps ("temperature", "threshold", "negatives", "validation": by set), and
    the reliability of every set ("reliability"), for the model card.

    "crossed" of a set: precision and recall where each half was judged by the threshold of the other
    half of every set, so that no phrase chose what it is judged by.
    """
    space = language_space(network.preset.space)
    best = best_threshold(sets)
    crossed = {name: _crossed(sets, name) for name in sets}
    temperature = float(network.calibration.get("temperature", space.temperature))
    return {
        "temperature": temperature,
        "threshold": nearer_threshold(MASK_THRESHOLDS[best], -temperature),  # as `calibration_of` reads it
        "negatives": list(network.calibration.get("negatives", space.negatives)),
        "validation": {name: _validation(asked, best, crossed[name]) for name, asked in sets.items()},
        "reliability": {name: reliability(asked) for name, asked in sets.items()},
    }


def best_threshold(sets: dict[str, Asked]) -> int:
    """Row of `MASK_THRESHOLDS`."""
    return int(torch.stack([_worth(asked) for asked in sets.values()]).mean(0).argmax())


def _worth(asked: Asked) -> Tensor:
    """The lower of precision and recall plus mean IoU, (T,)."""
    trials = [presence(asked.scores, asked.truths, threshold) for threshold in MASK_THRESHOLDS]
    level = torch.tensor([(t.precision, t.recall) for t in trials]).nan_to_num(0).amin(1)
    return level + asked.ious.mean(0).nan_to_num(0)


def _crossed(sets: dict[str, Asked], name: str) -> Presence:
    total = Presence()
    for which in (0, 1):
        others = {key: asked.half(1 - which) for key, asked in sets.items()}
        threshold = MASK_THRESHOLDS[best_threshold(others)]
        own = sets[name].half(which)
        total += presence(own.scores, own.truths, threshold)
    return total


def _validation(asked: Asked, best: int, crossed: Presence) -> dict:
    found = presence(asked.scores, asked.truths, MASK_THRESHOLDS[best])
    numbers = {
        "precision": found.precision,
        "recall": found.recall,
        "f1": found.f1,
        "mask_iou": float(asked.ious.mean(0)[best]),
        "crossed_precision": crossed.precision,
        "crossed_recall": crossed.recall,
    }
    known = {key: None if math.isnan(value) else round(value, 3) for key, value in numbers.items()}
    return {**known, "phrases": len(asked.scores)}


def reliability(asked: Asked, bins: int = BINS) -> list[dict]:
    """How often what scored alike was there: per bin of score its mean, the share present, and phrases.

    Bins hold equally many phrases, as far as scores allow; the lowest come first.
    """
    order = asked.scores.argsort()
    rows = []
    for chunk in order.chunk(min(bins, len(order))):
        rows.append(
            {
                "score": round(float(asked.scores[chunk].mean()), 4),
                "present": round(float(asked.truths[chunk].float().mean()), 4),
                "phrases": len(chunk),
            }
        )
    return rows


def trade_off(asked: Asked) -> list[tuple[float, float, float]]:
    """(threshold, precision, recall) at every trial threshold where both can be measured."""
    trials = [(t, presence(asked.scores, asked.truths, t)) for t in MASK_THRESHOLDS]
    rows = [(threshold, found.precision, found.recall) for threshold, found in trials]
    return [row for row in rows if not math.isnan(row[1]) and not math.isnan(row[2])]
