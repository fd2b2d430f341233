"""Numbers that say how good a prediction is, pure functions. Shared by training and evaluation.

Every measure returns NaN where nothing can be measured (no valid pixel, no class present), so
that a mean over scenes can leave it out (`nan_mean`).
"""

import math
from collections.abc import Iterable, Sequence

import torch
from torch import Tensor


def nan_mean(values: Iterable[float]) -> float:
    """Mean of the values that are not NaN; NaN if there is none."""
    kept = [v for v in values if not math.isnan(v)]
    return sum(kept) / len(kept) if kept else math.nan


def align_scale(depths: Tensor, targets: Tensor) -> Tensor:
    """depths times the median of z* / z over pixels where both are positive and finite."""
    valid = (targets > 0) & (depths > 0) & torch.isfinite(targets) & torch.isfinite(depths)
    return depths * (targets[valid] / depths[valid]).median() if bool(valid.any()) else depths


def abs_rel(depths: Tensor, targets: Tensor) -> float:
    """Mean of |z - z*| / z* where z* > 0."""
    valid = (targets > 0) & torch.isfinite(targets)
    if not bool(valid.any()):
        return math.nan
    return float(((depths[valid] - targets[valid]).abs() / targets[valid]).mean())


def delta1(depths: Tensor, targets: Tensor, limit: float = 1.25) -> float:
    """Share of pixels with max(z / z*, z* / z) < limit where z* > 0."""
    valid = (targets > 0) & torch.isfinite(targets)
    if not bool(valid.any()):
        return math.nan
    ratio = depths[valid].clamp_min(1e-6) / targets[valid]
    return float((torch.maximum(ratio, 1 / ratio) < limit).float().mean())


def depth_measures(depths: Tensor, targets: Tensor) -> dict[str, float]:
    """Of depths with their scale aligned, and of one flat wall instead."""
    aligned = align_scale(depths, targets)
    return {
        "depth_abs_rel": abs_rel(aligned, targets),
        "depth_delta1": delta1(aligned, targets),
        "depth_abs_rel_flat": abs_rel(align_scale(torch.ones_like(targets), targets), targets),
    }


def confusion(predicted: Tensor, truth: Tensor, classes: int) -> Tensor:
    """Counts (classes, classes), rows truth, columns prediction; entries with truth < 0 are left out.

    Raises:
        ValueError: a prediction is outside 0 .. classes - 1.
    """
    kept = truth >= 0
    truth, predicted = truth[kept], predicted[kept]
    if len(predicted) and not (int(predicted.min()) >= 0 and int(predicted.max()) < classes):
        raise ValueError(f"predicted: expected classes 0 to {classes - 1}, received {int(predicted.max())}")
    return torch.bincount(truth * classes + predicted, minlength=classes * classes).reshape(classes, classes)


def accuracy(counts: Tensor) -> float:
    """Share of the diagonal of a confusion matrix."""
    total = float(counts.sum())
    return float(counts.diagonal().sum()) / total if total else math.nan


def class_ious(counts: Tensor) -> Tensor:
    """IoU per class, NaN for classes that never occur in the truth."""
    hits, unions = _hits_and_unions(counts)
    return torch.where(counts.sum(1) > 0, hits / unions.clamp_min(1), torch.nan)


def occurring_mean_iou(counts: Tensor, classes: Sequence[int] | None = None) -> float:
    """Mean IoU over classes, or those of `classes`, that occur in truth or prediction: what nobody labelled
    but somebody said is 0.

    As torchmetrics' `JaccardIndex` has it, by which LSM and the paper report on ScanNet.
    """
    hits, unions = _hits_and_unions(counts)
    ious = hits / unions  # 0 / 0 is NaN
    return nan_mean((ious if classes is None else ious[list(classes)]).tolist())


def _hits_and_unions(counts: Tensor) -> tuple[Tensor, Tensor]:
    counts = counts.double()
    hits = counts.diagonal()
    return hits, counts.sum(0) + counts.sum(1) - hits


def mean_iou(counts: Tensor, classes: Sequence[int] | None = None) -> float:
    """Mean of `class_ious` over the classes that occur, or over those of `classes` that occur."""
    ious = class_ious(counts)
    return nan_mean((ious if classes is None else ious[list(classes)]).tolist())


def psnr(rendered: Tensor, photo: Tensor) -> float:
    """Peak signal-to-noise ratio in dB of pictures in [0, 1]; 100 for equal ones."""
    error = float(((rendered.clamp(0, 1) - photo) ** 2).mean())
    return 100.0 if error < 1e-10 else -10 * math.log10(error)
