"""Results as markdown: one table of measures with their trivial rivals, one of labels by method."""

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
COLUMNS = (
    "source_groups_accuracy", "source_groups_miou", "source_objects_miou", "source_paper_miou",
    "target_groups_accuracy", "target_groups_miou", "target_objects_miou", "target_paper_miou",
)  # fmt: skip


def markdown(result: dict) -> str:
    """The two tables of a `run_eval` result."""
    measures = result["measures"]
    lines = ["| measure | value | trivial |", "|---|---|---|"]
    for title, key, rival, rival_key in MEASURES:
        if key in measures:
            other = f"{cell(measures[rival_key])} ({rival})" if rival_key in measures else ""
            lines.append(f"| {title} | {cell(measures[key])} | {other} |")
    lines += ["", "| labels | " + " | ".join(c.replace("_", " ") for c in COLUMNS) + " |"]
    lines.append("|---" * (len(COLUMNS) + 1) + "|")
    for method, title in METHODS.items():
        if method in result["labels"]:
            row = result["labels"][method]
            lines.append(f"| {title} | " + " | ".join(cell(row.get(c)) for c in COLUMNS) + " |")
    return "\n".join(lines) + "\n"


def cell(value: float | None) -> str:
    """Three digits; "-" where nothing could be measured."""
    return "-" if value is None else f"{value:.3f}"
