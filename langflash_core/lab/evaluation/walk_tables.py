"""Results of `langflash lab eval walk` as markdown: one version, or two along the same walks."""

import math
from collections.abc import Iterator, Mapping, Sequence

from langflash_core.lab.evaluation.side_tables import mean_change
from langflash_core.lab.evaluation.sides import number
from langflash_core.lab.evaluation.walk import flat
from langflash_core.lab.training.measures import nan_mean

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
    ("PSNR at the photos' own places, as shown (dB)", "own_psnr", ".2f"),
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
    ("COLMAP: photos placed (%)", "colmap_placed", "share"),
    ("COLMAP: places, mean (% of the walk)", "colmap_places", "share"),
    ("... ours, of the same photos", "colmap_ours_places", "share"),
    ("COLMAP: rotation, mean (degrees)", "colmap_rotation", ".2f"),
    ("... ours, of the same photos", "colmap_ours_rotation", ".2f"),
    ("COLMAP: focal length off by (%)", "colmap_focal", "share"),
    ("COLMAP: seconds", "colmap_seconds", ".1f"),
    ("length of the walk (m)", "length", ".1f"),
)
"""What is said, the number it is, and how it is told."""


def walk_markdown(result: Mapping) -> str:
    """A row a measure, a column a number of photos."""
    columns = result["by_photos"]
    counts = [columns[photos]["walks"] for photos in columns]
    heads = [f"mean of {_walks(counts[0])}", *(f"{photos} photos" for photos in columns)]
    lines = ["| " + " | ".join(heads) + " |"]
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


def beside_markdown(before: Mapping, after: Mapping) -> str:
    """Two results beside each other, over the walks that both have: means, and the mean difference with its
    standard error over walks."""
    first, second = ({row["name"]: row["photos"] for row in result["cases"]} for result in (before, after))
    shared = [name for name in first if name in second]
    lines = [f"| measure ({_walks(len(shared))}) | before | after | difference |", "|---|---|---|---|"]
    for photos in sorted({int(p) for name in shared for p in first[name]}):
        pairs = [
            (flat(first[name], str(photos)), flat(second[name], str(photos)))
            for name in shared
            if str(photos) in first[name] and str(photos) in second[name]
        ]
        for title, key, form in _full_titles():
            values = [(old.get(key, math.nan), new.get(key, math.nan)) for old, new in pairs]
            lines += _change(f"{photos} photos: {title}", form, values)
    return "\n".join(lines) + "\n"


def _walks(count: int) -> str:
    return f"{count} walk{'s' * (count != 1)}"


def _full_titles() -> Iterator[tuple[str, str, str]]:
    """`ROWS`, what follows another row with that row's title before it."""
    whole = ""
    for title, key, form in ROWS:
        whole = whole if title.startswith("...") else title
        yield (f"{whole}, {title.removeprefix('... ')}" if title.startswith("...") else title), key, form


def _change(title: str, form: str, values: Sequence[tuple[float, float]]) -> list[str]:
    kept = [(old, new) for old, new in values if not (math.isnan(old) or math.isnan(new))]
    if not kept:
        return []
    mean, spread = mean_change(kept)
    old, new = (nan_mean(side) for side in zip(*kept, strict=True))
    plain = form.removeprefix("+")
    signed = f"{100 * mean:+.2f}" if form == "share" else format(mean, f"+{plain}")
    return [f"| {title} | {told(old, form)} | {told(new, form)} | {signed} ± {told(spread, plain)} |"]
