"""Results of `langflash eval walk` as markdown: one version, or two along the same walks."""

import math
from collections.abc import Mapping

from langflash_core.lab.evaluation.sides import number

ROWS = (
    ("photos placed (%)", "placed", "share"),
    ("places, mean (% of the walk)", "places", "share"),
    ("places, farthest (% of the walk)", "places_most", "share"),
    ("rotation, mean (degrees)", "rotation", ".2f"),
    ("focal length off by (%)", "focal", "share"),
    ("depth AbsRel, one scale", "depth_abs_rel", ".3f"),
    ("depth delta 1, one scale", "depth_delta1", ".3f"),
    ("depth AbsRel, a scale per photo", "depth_own_scale", ".3f"),
    ("depth AbsRel of own two photos alone", "between_alone_photos_depth_abs_rel", ".3f"),
    ("PSNR between, whole (dB)", "between_psnr", ".2f"),
    ("... own two photos alone", "between_alone_psnr", ".2f"),
    ("... against fewer photos, same frames", "gain_psnr", "+.2f"),
    ("PSNR between, covered (dB)", "between_psnr_covered", ".2f"),
    ("... own two photos alone", "between_alone_psnr_covered", ".2f"),
    ("PSNR between, covered, light fitted (dB)", "between_psnr_lit", ".2f"),
    ("... own two photos alone", "between_alone_psnr_lit", ".2f"),
    ("covered (%)", "between_covered", "share"),
    ("... own two photos alone", "between_alone_covered", "share"),
    ("PSNR between, pose fitted (dB)", "between_aligned_psnr", ".2f"),
    ("... own two photos alone", "between_alone_aligned_psnr", ".2f"),
    ("... against fewer photos, same frames", "gain_aligned_psnr", "+.2f"),
    ("LPIPS between", "between_lpips", ".3f"),
    ("... own two photos alone", "between_alone_lpips", ".3f"),
    ("LPIPS between, pose fitted", "between_aligned_lpips", ".3f"),
    ("... own two photos alone", "between_alone_aligned_lpips", ".3f"),
    ("depth AbsRel between", "between_depth", ".3f"),
    ("... own two photos alone", "between_alone_depth", ".3f"),
    ("PSNR between at the photo's size (dB)", "between_large_psnr", ".2f"),
    ("... own two photos alone", "between_alone_large_psnr", ".2f"),
    ("PSNR between at the photo's size, pose fitted (dB)", "between_large_aligned_psnr", ".2f"),
    ("... own two photos alone", "between_alone_large_aligned_psnr", ".2f"),
    ("LPIPS between at the photo's size", "between_large_lpips", ".3f"),
    ("... own two photos alone", "between_alone_large_lpips", ".3f"),
    ("LPIPS between at the photo's size, pose fitted", "between_large_aligned_lpips", ".3f"),
    ("... own two photos alone", "between_alone_large_aligned_lpips", ".3f"),
    ("Gaussians", "gaussians", ",.0f"),
    ("of these coarse", "coarse", ",.0f"),
    ("seconds", "seconds", ".1f"),
    ("processor seconds", "cpu_seconds", ".1f"),
    ("peak memory (MB)", "memory_mb", ",.0f"),
    ("length of the walk (m)", "length", ".1f"),
)
"""What is said, the number it is, and how it is told."""


def walk_markdown(result: Mapping) -> str:
    """A row a measure, a column a number of photos."""
    columns = result["by_photos"]
    counts = [columns[photos]["walks"] for photos in columns]
    lines = [
        f"| mean of {counts[0]} walk{'s' * (counts[0] != 1)} | "
        + " | ".join(f"{p} photos" for p in columns)
        + " |"
    ]
    lines.append("|---" * (len(columns) + 1) + "|")
    for title, key, form in ROWS:
        values = [number(row.get(key)) for row in columns.values()]
        if not all(math.isnan(value) for value in values):
            lines.append(f"| {title} | " + " | ".join(told(value, form) for value in values) + " |")
    return "\n".join(lines) + "\n"


def told(value: float, form: str) -> str:
    """A number of a measure; "-" where there is none."""
    if math.isnan(value):
        return "-"
    return f"{100 * value:.2f}" if form == "share" else format(value, form)
