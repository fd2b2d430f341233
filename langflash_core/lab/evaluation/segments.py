"""Segments against true segments: panoptic quality, instance IoU, and how well borders are followed.

A segment map holds one id per pixel; -1 belongs to none. Classes are whole numbers.

Sizes: H W pixels, n found and m true segments.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Bool, Float, Integer
from scipy.ndimage import binary_dilation

MATCHED = 0.5
"""IoU above which a found and a true segment are a pair; above a half there is at most one partner."""


@dataclass(frozen=True)
class ClassQuality:
    """Pairs of one class: summed IoU, pairs, found and true segments without a partner."""

    iou: float = 0.0
    pairs: int = 0
    false_alarms: int = 0
    misses: int = 0

    def __add__(self, other: "ClassQuality") -> "ClassQuality":
        return ClassQuality(
            self.iou + other.iou,
            self.pairs + other.pairs,
            self.false_alarms + other.false_alarms,
            self.misses + other.misses,
        )

    @property
    def recognition(self) -> float:
        """RQ, the F1 of pairs; NaN where the class occurs in neither."""
        total = self.pairs + (self.false_alarms + self.misses) / 2
        return self.pairs / total if total else math.nan

    @property
    def segmentation(self) -> float:
        """SQ, the mean IoU of pairs; 0 without one, NaN where the class occurs in neither."""
        if not self.pairs:
            return 0.0 if self.false_alarms + self.misses else math.nan
        return self.iou / self.pairs

    @property
    def quality(self) -> float:
        """PQ = SQ RQ."""
        return self.segmentation * self.recognition


@dataclass(frozen=True)
class Panoptic:
    """Counts by class, to be added up over pictures."""

    classes: Mapping[int, ClassQuality] = field(default_factory=dict)

    def __add__(self, other: "Panoptic") -> "Panoptic":
        every = self.classes.keys() | other.classes.keys()
        none = ClassQuality()
        return Panoptic({c: self.classes.get(c, none) + other.classes.get(c, none) for c in sorted(every)})

    def mean(self, what: str = "quality") -> float:
        """PQ ("quality"), SQ ("segmentation") or RQ ("recognition"), mean over classes that occur."""
        values = [getattr(counts, what) for counts in self.classes.values()]
        known = [value for value in values if not math.isnan(value)]
        return sum(known) / len(known) if known else math.nan


def overlaps(
    found: Integer[np.ndarray, "H W"], truth: Integer[np.ndarray, "H W"]
) -> tuple[Integer[np.ndarray, " n"], Integer[np.ndarray, " m"], Integer[np.ndarray, "n+1 m+1"]]:
    """Ids of the found and of the true segments, and pixels in common; the last row and column are
    pixels that belong to none."""
    found_ids, rows = np.unique(found, return_inverse=True)
    true_ids, columns = np.unique(truth, return_inverse=True)
    shape = (len(found_ids), len(true_ids))
    table = np.bincount(rows.ravel() * shape[1] + columns.ravel(), minlength=shape[0] * shape[1])
    own, real = found_ids[found_ids >= 0], true_ids[true_ids >= 0]
    whole = np.zeros((len(own) + 1, len(real) + 1), dtype=np.int64)
    places = np.where(found_ids >= 0, np.searchsorted(own, found_ids), len(own))
    real_places = np.where(true_ids >= 0, np.searchsorted(real, true_ids), len(real))
    np.add.at(whole, (places[:, None], real_places[None, :]), table.reshape(shape))
    return own, real, whole


def panoptic(
    found: Integer[np.ndarray, "H W"],
    truth: Integer[np.ndarray, "H W"],
    found_classes: Mapping[int, int],
    true_classes: Mapping[int, int],
) -> Panoptic:
    """Pairs of one picture. Pixels without a true segment count for nothing: not in a union, and a found
    segment more than half of which lies there is no false alarm.

    Args:
        found, truth: segment maps. found_classes, true_classes: class of every id.

    Source: Kirillov, He, Girshick, Rother, Dollár, Panoptic Segmentation, CVPR 2019, eq. 1.
    """
    own, real, table = overlaps(found, truth)
    sizes, true_sizes, beside = table.sum(1)[:-1], table.sum(0)[:-1], table[:-1, -1]
    counts: dict[int, ClassQuality] = {}
    paired, met = set(), set()
    for row, column in zip(*np.nonzero(table[:-1, :-1]), strict=True):
        kind = true_classes[int(real[column])]
        if found_classes[int(own[row])] != kind:
            continue
        both = table[row, column]
        iou = both / (sizes[row] + true_sizes[column] - both - beside[row])
        if iou > MATCHED:
            counts[kind] = counts.get(kind, ClassQuality()) + ClassQuality(float(iou), 1)
            paired.add(row)
            met.add(column)
    for column in set(range(len(real))) - met:
        kind = true_classes[int(real[column])]
        counts[kind] = counts.get(kind, ClassQuality()) + ClassQuality(misses=1)
    for row in set(range(len(own))) - paired:
        if beside[row] <= sizes[row] / 2:
            kind = found_classes[int(own[row])]
            counts[kind] = counts.get(kind, ClassQuality()) + ClassQuality(false_alarms=1)
    return Panoptic(counts)


def instance_iou(
    found: Integer[np.ndarray, "H W"], truth: Integer[np.ndarray, "H W"], smallest: int = 1
) -> float:
    """Mean over true segments of the IoU of the found one that fits best, whatever either is called.

    Pixels without a true segment count for nothing.

    Args:
        smallest: true segments of fewer pixels are left out.
    """
    _, _, table = overlaps(found, truth)
    if table.shape[1] == 1:
        return math.nan
    inside = table[:, :-1]
    unions = inside.sum(1, keepdims=True) + inside.sum(0, keepdims=True) - inside
    ious = (inside / np.maximum(unions, 1))[:-1]
    best = ious.max(0) if len(ious) else np.zeros(inside.shape[1])
    kept = best[inside.sum(0) >= smallest]
    return float(kept.mean()) if len(kept) else math.nan


def border(mask: Bool[np.ndarray, "H W"]) -> Bool[np.ndarray, "H W"]:
    """Pixels of a mask with a 4-neighbour outside of it; the picture's own edge is no border."""
    padded = np.pad(mask, 1, mode="edge")
    inner = padded[:-2, 1:-1] & padded[2:, 1:-1] & padded[1:-1, :-2] & padded[1:-1, 2:]
    return mask & ~inner


def border_f(
    found: Bool[np.ndarray, "H W"],
    truth: Bool[np.ndarray, "H W"],
    tolerance: float = 0.008,
    judged: Bool[np.ndarray, "H W"] | None = None,
) -> float:
    """F measure of two masks' borders; NaN where neither has one.

    A border pixel is right when the other border is within `tolerance` of the picture's diagonal,
    rounded up, by a disk. judged: where the truth is known; None: everywhere. Next to what is not known
    no pixel is a border, since an edge of knowledge is no edge of a thing.

    Source: Perazzi et al., A Benchmark Dataset for Video Object Segmentation (DAVIS), CVPR 2016.
    """
    own, real = border(found), border(truth)
    if judged is not None:
        inside = np.logical_not(binary_dilation(~judged, np.ones((3, 3), bool)))
        own, real = own & inside, real & inside
    if not own.any() and not real.any():
        return math.nan
    radius = math.ceil(tolerance * math.hypot(*found.shape))
    span = np.arange(-radius, radius + 1)
    disk = span[:, None] ** 2 + span[None, :] ** 2 <= radius**2
    precision = float(binary_dilation(real, disk)[own].mean()) if own.any() else 0.0
    recall = float(binary_dilation(own, disk)[real].mean()) if real.any() else 0.0
    return 2 * precision * recall / (precision + recall) if precision + recall else 0.0


def label_border_f(
    found: Integer[np.ndarray, "H W"], truth: Integer[np.ndarray, "H W"], tolerance: float = 0.008
) -> float:
    """`border_f` of label maps, mean over the labels of the truth; -1 is no label, and no border is
    looked for next to such pixels of the truth."""
    judged = truth >= 0
    values = [
        border_f(found == label, truth == label, tolerance, judged)
        for label in np.unique(truth[judged]).tolist()
    ]
    known: Float[np.ndarray, " n"] = np.array([v for v in values if not math.isnan(v)], dtype=np.float64)
    return float(known.mean()) if len(known) else math.nan
