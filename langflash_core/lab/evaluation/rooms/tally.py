"""What a run over rooms collects, and what every room is judged with. C channels, G class groups, P
phrases."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import torch
from torch import Tensor

from langflash_core.lab.evaluation.lpips import Lpips
from langflash_core.lab.evaluation.metrics import (
    PoseError,
)
from langflash_core.lab.evaluation.segments import Panoptic
from langflash_core.lab.evaluation.words import OTHER, PAPER_LABELS
from langflash_core.language.spaces import LanguageSpace, language_space
from langflash_core.network import LangFlashNet

STUFF = frozenset({"wall", "floor", "ceiling"})
MIN_SHARE = 0.004
"""Of a view: a thing counts as there from this share of its pixels on (200 of 224 x 224)."""


@dataclass
class Tally:
    """What a run collects: numbers per scene by name, confusion counts by (row, view, label set),
    presence scores, per present phrase its mask's IoU at each of `MASK_THRESHOLDS`, and per
    paraphrase its IoU and that of the plain names, a pair for each scene that shows it; segments of the
    target view against true instances."""

    numbers: dict[str, list[float]] = field(default_factory=dict)
    counts: dict[tuple[str, str, str], Tensor] = field(default_factory=dict)
    scores: list[Tensor] = field(default_factory=list)
    truths: list[Tensor] = field(default_factory=list)
    poses: list[tuple[PoseError, float]] = field(default_factory=list)
    mask_ious: list[Tensor] = field(default_factory=list)
    paraphrases: dict[str, list[tuple[float, float]]] = field(default_factory=dict)
    panoptic: Panoptic = field(default_factory=Panoptic)

    def note(self, **values: float) -> None:
        for name, value in values.items():
            self.numbers.setdefault(name, []).append(float(value))

    def count(self, key: tuple[str, str, str], table: Tensor) -> None:
        self.counts[key] = self.counts[key] + table if key in self.counts else table


@dataclass(frozen=True)
class Setting:
    """What every scene is judged with: network, language space, class groups and their vectors."""

    network: LangFlashNet
    space: LanguageSpace
    groups: tuple[str, ...]
    texts: Tensor
    paper_texts: Tensor
    median_depth: float
    temperature: float
    threshold: float
    negatives: Tensor
    lpips: Lpips | None = None

    @staticmethod
    def of(
        network: LangFlashNet, groups: Sequence[str], median_depth: float, lpips: Lpips | None = None
    ) -> "Setting":
        space = language_space(network.preset.space)
        own = network.calibration
        with torch.no_grad():
            return Setting(
                network=network,
                space=space,
                groups=tuple(groups),
                texts=space.encode(list(groups)),
                paper_texts=space.encode(list(PAPER_LABELS[:OTHER])),
                median_depth=median_depth,
                temperature=float(own.get("temperature", space.temperature)),
                threshold=float(own.get("threshold", space.threshold)),
                negatives=space.encode(list(own.get("negatives", space.negatives))),
                lpips=lpips,
            )
