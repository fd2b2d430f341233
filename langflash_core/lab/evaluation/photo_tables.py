"""Results on real photos as markdown, in the manner of `tables`: measures beside their trivial rivals."""

from collections.abc import Sequence

from langflash_core.lab.evaluation.tables import cell
from langflash_core.lab.evaluation.words import PAPER_LABELS

PHOTOS = (
    ("Depth AbsRel, scale aligned", "depth_abs_rel", "one depth", "depth_abs_rel_flat"),
    ("Depth AbsRel, median photo", "depth_abs_rel_median", "", ""),
    ("Depth delta < 1.25, scale aligned", "depth_delta1", "", ""),
    ("Depth AbsRel in metres, no alignment", "depth_abs_rel_metric", "", ""),
    ("True metres per guessed metre, median photo", "depth_scale", "", ""),
    ("Presence precision", "presence_precision", "", ""),
    ("Presence recall", "presence_recall", "", ""),
    ("Presence F1", "presence_f1", "", ""),
    ("Phrases asked, half of them absent", "presence_phrases", "", ""),
    ("Calibration error of scores (ECE)", "calibration_error", "", ""),
    ("Border F of 37 classes", "border_f_atoms", "2D features", "border_f_features"),
    ("At the photo's size: F1 of borders, 4 pixels", "border_f1", "", ""),
    ("At the photo's size: named right within 8 pixels of a border", "right_near_borders", "", ""),
    ("At the photo's size: named right elsewhere", "right_elsewhere", "", ""),
    ("At the photo's size: mIoU of 37 classes", "large_classes_miou", "", ""),
    (
        "True masks called by their name, of all names of the folder",
        "masks_right_atoms",
        "2D features",
        "masks_right_features",
    ),
    ("... mean over names", "mask_names_right_atoms", "2D features", "mask_names_right_features"),
    ("... masks judged", "masks", "", ""),
    ("Share of the picture that the scene covers", "covered", "", ""),
    ("Reconstruction, seconds a photo", "seconds", "", ""),
)
POSED = (
    ("Rotation error, median (degrees)", "pose_rotation_median", "no motion", "true_rotation_median"),
    ("Direction error, median (degrees)", "pose_direction_median", "", ""),
    ("Rotation error of placed photos, median (degrees)", "rotation_placed_median", "", ""),
    ("Direction error of placed photos, median (degrees)", "direction_placed_median", "", ""),
    ("Right pose (5 / 15 degrees)", "pose_right_share", "", ""),
    ("Pose AUC at 5 degrees", "pose_auc_5", "", ""),
    ("Pose AUC at 10 degrees", "pose_auc_10", "", ""),
    ("Pose AUC at 20 degrees", "pose_auc_20", "", ""),
    ("Second photo found its place", "placed", "", ""),
    ("Depth AbsRel, each photo's scale aligned", "depth_abs_rel", "one depth", "depth_abs_rel_flat"),
    ("Depth AbsRel, median photo", "depth_abs_rel_median", "", ""),
    ("Depth delta < 1.25", "depth_delta1", "", ""),
    ("PSNR of the photo between, covered pixels (dB)", "psnr", "first photo", "psnr_first_photo"),
    ("PSNR of the photo between, median pair (dB)", "psnr_median", "mean colour", "psnr_mean_colour"),
    ("... from the pose fitted to it, pixels covered from there (dB)", "psnr_aligned", "", ""),
    ("SSIM of the photo between, covered pixels", "ssim", "", ""),
    ("PSNR of the photo between, whole picture (dB)", "psnr_whole_picture", "", ""),
    ("... from the pose fitted to it (dB), whole picture", "psnr_whole_picture_aligned", "", ""),
    ("LPIPS of the photo between (VGG), whole picture", "lpips_whole_picture", "", ""),
    ("... from the pose fitted to it", "lpips_whole_picture_aligned", "", ""),
    ("SSIM of the photo between, whole picture, Gaussian window", "ssim_whole_picture", "", ""),
    ("Share of the photo between that is covered", "covered", "", ""),
    ("Reconstruction, seconds a pair", "seconds", "", ""),
)  # fmt: skip
METHODS = {"atoms": "the program: atoms drawn", "features": "2D features of the photo, no scene"}
LABEL_LISTS = {
    "classes": "37 classes",
    "paper": "8 labels",
    "published": "8 labels, desks are other",
    "fine": "fine names",
}
BEST = 10
"""So many fine names are listed from either end."""


def photos_markdown(result: dict) -> str:
    """The tables of a `run_photos` result."""
    lines = [*_measures(result["measures"], PHOTOS), ""]
    if result["labels"]:
        lines += [*_label_table(result), "", *_ious(result["paper_ious"], PAPER_LABELS), ""]
        lines += [
            *_ious(result["class_ious"], list(result["class_ious"]["atoms"])),
            "",
            *_fine(result["names"]),
        ]
    return "\n".join(lines).rstrip() + "\n"


def posed_markdown(result: dict) -> str:
    """The tables of a `run_posed` result: all pairs, and by how many numbers they are apart."""
    gaps = result["by_gap"]
    keys = ("pairs", "placed", "true_rotation_median", "pose_rotation_median", "pose_direction_median",
            "pose_right_share", "depth_abs_rel", "psnr")  # fmt: skip
    lines = [*_measures(result["measures"], POSED), ""]
    lines.append("| numbers apart | " + " | ".join(key.replace("_", " ") for key in keys) + " |")
    lines.append("|---" * (len(keys) + 1) + "|")
    for gap, row in gaps.items():
        lines.append(f"| {gap} | " + " | ".join(cell(row.get(key)) for key in keys) + " |")
    return "\n".join(lines) + "\n"


def _measures(measures: dict, rows: Sequence[tuple[str, str, str, str]]) -> list[str]:
    lines = ["| measure | value | trivial |", "|---|---|---|"]
    for title, key, rival, rival_key in rows:
        if key in measures:
            other = f"{cell(measures[rival_key])} ({rival})" if rival_key in measures else ""
            lines.append(f"| {title} | {cell(measures[key])} | {other} |")
    return lines


def _label_table(result: dict) -> list[str]:
    kinds = [kind for kind in LABEL_LISTS if f"{kind}_miou" in result["labels"]["atoms"]]
    lines = ["| labels | " + " | ".join(f"{LABEL_LISTS[k]}: mIoU | accuracy" for k in kinds) + " |"]
    lines.append("|---" * (2 * len(kinds) + 1) + "|")
    for method, title in METHODS.items():
        row = result["labels"][method]
        cells = [cell(row[f"{kind}_{what}"]) for kind in kinds for what in ("miou", "accuracy")]
        lines.append(f"| {title} | " + " | ".join(cells) + " |")
    return lines


def _ious(ious: dict[str, dict[str, float | None]], names: Sequence[str]) -> list[str]:
    """IoU of every label that occurs, by method."""
    kept = [name for name in names if ious["atoms"].get(name) is not None]
    lines = ["| IoU | " + " | ".join(kept) + " |", "|---" * (len(kept) + 1) + "|"]
    for method, title in METHODS.items():
        lines.append(f"| {title} | " + " | ".join(cell(ious[method][name]) for name in kept) + " |")
    return lines


def _fine(names: Sequence[dict]) -> list[str]:
    """The best and the worst fine names, with the means over all of them."""
    if not names:
        return []
    means = [sum(row[key] or 0 for row in names) / len(names) for key in ("iou", "asked_iou")]
    listed = names if len(names) <= 2 * BEST else [*names[:BEST], *names[-BEST:]]
    lines = [
        "| fine name | photos | IoU among fine names | IoU of the mask when asked |",
        "|---|---|---|---|",
    ]
    lines.append(f"| mean of {len(names)} | | {cell(means[0])} | {cell(means[1])} |")
    for row in listed:
        cells = (str(row["photos"]), cell(row["iou"]), cell(row["asked_iou"]))
        lines.append(f"| {row['name']} | " + " | ".join(cells) + " |")
    return lines
