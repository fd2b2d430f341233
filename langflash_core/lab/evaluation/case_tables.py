"""Results of protocols as markdown: measures and labels with 95 % intervals, beside published numbers."""

from collections.abc import Sequence

from langflash_core.lab.evaluation.tables import cell

MEASURES = (
    ("Rotation error, median (degrees)", "pose_rotation_median"),
    ("Direction error, median (degrees)", "pose_direction_median"),
    ("Pose AUC at 5 degrees", "pose_auc_5"),
    ("Pose AUC at 10 degrees", "pose_auc_10"),
    ("Pose AUC at 20 degrees", "pose_auc_20"),
    ("Depth AbsRel, each photo's scale aligned", "depth_abs_rel"),
    ("Depth AbsRel of one depth", "depth_abs_rel_flat"),
    ("Depth delta < 1.25", "depth_delta1"),
    ("PSNR of kept back views, whole picture (dB)", "psnr_whole_picture"),
    ("PSNR of kept back views, pose fitted, whole picture (dB)", "psnr_whole_picture_aligned"),
    ("PSNR of kept back views, covered pixels (dB)", "psnr"),
    ("PSNR of the first photo instead, same pixels (dB)", "psnr_first_photo"),
    ("SSIM of kept back views, whole picture", "ssim_whole_picture"),
    ("LPIPS of kept back views, VGG, whole picture", "lpips_whole_picture"),
    ("LPIPS of kept back views, VGG, pose fitted, whole picture", "lpips_whole_picture_aligned"),
    ("Share of kept back views that is covered", "covered"),
    ("Label consistency across views", "label_consistency"),
    ("Presence precision", "presence_precision"),
    ("Presence recall", "presence_recall"),
    ("Presence F1", "presence_f1"),
    ("Calibration error of scores (ECE)", "calibration_error"),
    ("Second photo found its place", "placed"),
    ("Reconstruction, seconds", "seconds"),
)
METHOD_TITLES = {"atoms": "the program: atoms drawn", "features": "2D features of each view, no scene"}
PUBLISHED: dict[str, Sequence[tuple[str, float, float]]] = {
    "scannet": (
        ("LangFlash as published (Liu et al. 2026), main table", 0.7416, 0.8718),
        ("LangFlash as published, table of K, K = 128", 0.7144, 0.8547),
    ),
}
"""Per protocol: title, mIoU, accuracy. Their weights cannot be had here; their view is as they chose it."""


def cases_markdown(protocol: str, title: str, about: str, result: dict) -> str:
    """The tables of `cases.result_of`."""
    intervals = result["intervals"]
    lines = [
        f"## {title}",
        "",
        about,
        "",
        f"{result['cases']} cases of {result['scenes']} scenes; in brackets 95 % of draws of scenes.",
        "",
        "| measure | value | 95 % |",
        "|---|---|---|",
    ]
    for text, key in MEASURES:
        if result["measures"].get(key) is not None:
            value = cell(result["measures"][key])
            lines.append(f"| {text} | {value} | {span(intervals.get(f'measures/{key}'))} |")
    if result["labels"]:
        lines += ["", *_labels(protocol, result)]
    return "\n".join(lines) + "\n"


def _labels(protocol: str, result: dict) -> list[str]:
    kinds = [k for k in ("source", "target") if any(f"{k}_miou" in row for row in result["labels"].values())]
    columns = [f"{kind}_{what}" for kind in kinds for what in ("miou", "picture_miou", "accuracy")]
    lines = ["| labels | " + " | ".join(c.replace("_", " ").replace("miou", "mIoU") for c in columns) + " |"]
    lines.append("|---" * (len(columns) + 1) + "|")
    for method, row in result["labels"].items():
        cells = [
            f"{cell(row.get(c))} {span(result['intervals'].get(f'labels/{method}/{c}'))}".rstrip()
            for c in columns
        ]
        lines.append(f"| {METHOD_TITLES[method]} | " + " | ".join(cells) + " |")
    for title, miou, accuracy in PUBLISHED.get(protocol, ()):
        lines += ["", f"{title}: mIoU {miou:.4f}, accuracy {accuracy:.4f}."]
    return lines


def span(bounds: Sequence[float] | None) -> str:
    """(low to high), or nothing."""
    return "" if bounds is None else f"({bounds[0]:.3f} to {bounds[1]:.3f})"
