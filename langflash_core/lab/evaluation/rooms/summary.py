"""Means, medians and tables of a run over rooms."""

from collections.abc import Sequence

import torch

from langflash_core.lab.evaluation.metrics import (
    POSE_LIMITS,
    Presence,
    calibration_error,
    pose_auc,
    presence,
)
from langflash_core.lab.evaluation.numbers import rounded
from langflash_core.lab.evaluation.rooms.phrases import paraphrase_report
from langflash_core.lab.evaluation.rooms.tally import STUFF, Setting, Tally
from langflash_core.lab.evaluation.words import PAPER_LABELS
from langflash_core.lab.training.measures import accuracy as pixel_accuracy
from langflash_core.lab.training.measures import (
    class_ious,
    mean_iou,
    nan_mean,
)
from langflash_core.language.leads import nearer_threshold

MEDIANS = ("depth_abs_rel", "depth_abs_rel_view_0_twice", "points_view_1")
"""Of these the median room is told beside the mean, which a few wrong poses dominate."""


def summary(tally: Tally, setting: Setting) -> dict:
    """Means, medians and tables of a run, rounded; plain JSON."""
    scores, truths = torch.cat(tally.scores), torch.cat(tally.truths)
    found: Presence = presence(scores, truths, nearer_threshold(setting.threshold, setting.temperature))
    always = presence(torch.ones_like(scores), truths, 0.5)
    overlapping = [error for error, overlap in tally.poses if overlap >= 0.3]
    rotations = torch.tensor([error.rotation for error, _ in tally.poses])
    directions = torch.tensor([error.direction for error, _ in tally.poses])
    geometry = {name: nan_mean(values) for name, values in tally.numbers.items()}
    geometry |= {f"{name}_median": _median(tally.numbers[name]) for name in MEDIANS if name in tally.numbers}
    geometry |= {
        "pose_rotation_median": float(rotations.nanmedian()),
        "pose_direction_median": float(directions.nanmedian()),
        "pose_right_share": nan_mean(float(error.right()) for error in overlapping),
        "pose_pairs_overlapping": float(len(overlapping)),
        "panoptic_quality": tally.panoptic.mean(),
        "panoptic_segmentation": tally.panoptic.mean("segmentation"),
        "panoptic_recognition": tally.panoptic.mean("recognition"),
        "calibration_error": calibration_error(scores, truths),
        "presence_precision": found.precision,
        "presence_recall": found.recall,
        "presence_f1": found.f1,
        "presence_f1_always_found": always.f1,
        "presence_phrases": float(len(scores)),
    }
    areas = pose_auc([error.worst for error, _ in tally.poses])
    geometry |= {f"pose_auc_{limit:g}": area for limit, area in zip(POSE_LIMITS, areas, strict=True)}
    if geometry.get("name_iou"):
        geometry["paraphrase_share"] = geometry["paraphrase_iou"] / geometry["name_iou"]
    labels: dict[str, dict[str, float]] = {}
    for (method, view, kind), counts in tally.counts.items():
        row = labels.setdefault(method, {})
        row[f"{view}_{kind}_accuracy"] = pixel_accuracy(counts)
        row[f"{view}_{kind}_miou"] = mean_iou(counts)
        if kind == "groups":
            things = [i for i, g in enumerate(setting.groups) if g not in STUFF]
            row[f"{view}_objects_miou"] = mean_iou(counts, things)
    paper = tally.counts.get(("lfa", "target", "paper"))
    per_label: dict[str, float] = {}
    if paper is not None:
        per_label = dict(zip(PAPER_LABELS, class_ious(paper).tolist(), strict=True))
    return {
        "measures": rounded(dict(sorted(geometry.items()))),
        "labels": {m: rounded(row) for m, row in labels.items()},
        "target_iou_by_label": rounded(per_label),
        "paraphrases": paraphrase_report(tally),
    }


def _median(values: Sequence[float]) -> float:
    return float(torch.tensor(values).nanmedian())
