"""Means, medians and tables of a run over rooms."""

import torch

from langflash_core.lab.evaluation.metrics import pose_measures, presence, presence_measures
from langflash_core.lab.evaluation.rooms.phrases import paraphrase_report
from langflash_core.lab.evaluation.rooms.tally import STUFF, Setting, Tally
from langflash_core.lab.evaluation.tables import Table, labels_table, measures_table, rounded
from langflash_core.lab.evaluation.words import PAPER_LABELS
from langflash_core.lab.training.measures import accuracy as pixel_accuracy
from langflash_core.lab.training.measures import class_ious, mean_iou, nan_mean
from langflash_core.language.leads import nearer_threshold

MEASURES = (
    ("Depth AbsRel, view 1", "depth_abs_rel", "constant depth", "depth_abs_rel_constant"),
    ("Depth AbsRel, fed view 1 twice", "depth_abs_rel_view_0_twice", "", ""),
    ("Depth AbsRel, view 1, median room", "depth_abs_rel_median", "fed view 1 twice",
     "depth_abs_rel_view_0_twice_median"),
    ("Depth delta < 1.25, view 1", "depth_delta1", "", ""),
    ("Depth AbsRel in metres, no alignment", "depth_abs_rel_metric", "", ""),
    ("View-2 points in frame 1, relative", "points_view_1", "true depth, identity pose",
     "points_view_1_true_depth_identity_pose"),
    ("View-2 points in frame 1, median room", "points_view_1_median", "", ""),
    ("Rotation error, median (degrees)", "pose_rotation_median", "", ""),
    ("Direction error, median (degrees)", "pose_direction_median", "", ""),
    ("Pose AUC at 5 degrees", "pose_auc_5", "", ""),
    ("Pose AUC at 10 degrees", "pose_auc_10", "", ""),
    ("Pose AUC at 20 degrees", "pose_auc_20", "", ""),
    ("Right pose (5 / 15 degrees), overlap >= 30 %", "pose_right_share", "", ""),
    ("Novel view PSNR where a photo sees it (dB)", "psnr", "mean colour", "psnr_mean_colour"),
    ("... from the pose fitted to the photo (dB)", "psnr_aligned", "", ""),
    ("Novel view SSIM, same pixels", "ssim", "", ""),
    ("Novel view PSNR, whole picture, holes black (dB)", "psnr_whole_picture", "", ""),
    ("... from the pose fitted to the photo (dB), whole picture", "psnr_whole_picture_aligned", "", ""),
    ("Novel view SSIM, whole picture, Gaussian window", "ssim_whole_picture", "", ""),
    ("Novel view LPIPS (VGG), whole picture", "lpips_whole_picture", "", ""),
    ("... from the pose fitted to the photo", "lpips_whole_picture_aligned", "", ""),
    ("Share of the novel view that a photo sees", "target_seen_share", "", ""),
    ("Panoptic quality of the novel view", "panoptic_quality", "", ""),
    ("Panoptic quality: segmentation of pairs", "panoptic_segmentation", "", ""),
    ("Panoptic quality: recognition", "panoptic_recognition", "", ""),
    ("Instance IoU of the novel view, whatever it is called", "instance_iou", "", ""),
    ("Border F of the novel view's labels", "border_f", "", ""),
    ("Label consistency, photo 1 and novel view", "label_consistency", "", ""),
    ("Presence precision", "presence_precision", "", ""),
    ("Presence recall", "presence_recall", "", ""),
    ("Presence F1", "presence_f1", "always found", "presence_f1_always_found"),
    ("Calibration error of scores (ECE)", "calibration_error", "", ""),
    ("IoU of plain names", "name_iou", "", ""),
    ("IoU of other words for them", "paraphrase_iou", "", ""),
    ("IoU of other words as a share of the names'", "paraphrase_share", "", ""),
    ("Network, seconds for two photos", "seconds", "", ""),
)  # fmt: skip
METHODS = {
    "features": "2D features per view, no 3D",
    "averaged": "averaged atoms",
    "averaged_named": "averaged and named atoms",
    "lfa": "aggregated and named atoms (LFA)",
    "true_masks_lfa": "true masks, aggregated and named",
    "majority": 'always "wall"',
}
COLUMNS = {
    f"{view}_{what}": f"{view} {text}"
    for view in ("source", "target")
    for what, text in {
        "groups_accuracy": "groups accuracy",
        "groups_miou": "groups mIoU",
        "objects_miou": "objects mIoU",
        "paper_miou": "paper mIoU",
    }.items()
}
MEDIANS = ("depth_abs_rel", "depth_abs_rel_view_0_twice", "points_view_1")
"""Of these the median room is told beside the mean, which a few wrong poses dominate."""


def summary(tally: Tally, setting: Setting) -> dict:
    """Means, medians and tables of a run, rounded; plain JSON."""
    scores, truths = torch.cat(tally.scores), torch.cat(tally.truths)
    found = presence(scores, truths, nearer_threshold(setting.threshold, setting.temperature))
    always = presence(torch.ones_like(scores), truths, 0.5)
    overlapping = [error for error, overlap in tally.poses if overlap >= 0.3]
    geometry = {
        **tally.means(),
        **{f"{name}_median": tally.median(name) for name in MEDIANS if name in tally.numbers},
        **pose_measures([error for error, _ in tally.poses]),
        "pose_right_share": nan_mean(float(error.right()) for error in overlapping),
        "pose_pairs_overlapping": float(len(overlapping)),
        "panoptic_quality": tally.panoptic.mean(),
        "panoptic_segmentation": tally.panoptic.mean("segmentation"),
        "panoptic_recognition": tally.panoptic.mean("recognition"),
        **presence_measures(found, scores, truths),
        "presence_f1_always_found": always.f1,
        "presence_phrases": float(len(scores)),
    }
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


def tables(result: dict) -> list[Table]:
    """Measures with their trivial rivals, and labels by method."""
    return [
        measures_table("", MEASURES, result["measures"]),
        labels_table("", METHODS, COLUMNS, result["labels"]),
    ]
