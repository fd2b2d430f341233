"""Results of `langflash lab eval sides` as markdown: one version, or two on the same rooms and pairs."""

import math
from collections.abc import Iterator, Sequence

from langflash_core.lab.evaluation.sides import grouped, number
from langflash_core.lab.training.measures import nan_mean

LOOKS = (
    ("PSNR, holes black (dB)", "psnr"),
    ("PSNR of what is covered (dB)", "psnr_covered"),
    ("PSNR, gaps filled (dB)", "psnr_filled"),
    ("SSIM", "ssim"),
    ("LPIPS, holes black", "lpips"),
    ("LPIPS, gaps filled", "lpips_filled"),
    ("sheets (% of drawn)", "sheets"),
    ("holes (% of seen)", "holes"),
    ("seen by a photo (%)", "seen"),
)
_FILLED = "_filled"
"""Ends what is measured with gaps filled. A version that did not fill them showed its holes black."""
_SHARES = ("sheets", "holes", "seen")
ONCE = (
    ("Depth boundaries in the photos, F1", "boundary_f1"),
    ("Layers: distance of the two photos' surfaces, median (% of depth)", "layers_median"),
    ("Layers, 90th percentile (% of depth)", "layers_p90"),
    ("Distance of drawn points from their true places, median (% of depth)", "misfit"),
    ("Rotation error, median (degrees)", "rotation_median"),
    ("Direction error, median (degrees)", "direction_median"),
    ("Second photo found its place", "placed"),
    ("Reconstruction, seconds", "seconds"),
)
_PERCENT = (*_SHARES, "layers_median", "layers_p90", "misfit")


def sides_markdown(result: dict) -> str:
    """The tables of a `run_sides` result: what a scene has once, and by where it is seen from."""
    measures, looks = result["measures"], result["by_look"]
    lines = [f"| measure | mean of {len(result['cases'])} |", "|---|---|"]
    lines += [f"| {title} | {told(key, measures[key])} |" for title, key in ONCE]
    columns = [(title, key) for title, key in LOOKS if any(key in row for row in looks.values())]
    lines += ["", "| seen from | scenes | " + " | ".join(title for title, _ in columns) + " |"]
    lines.append("|---" * (len(columns) + 2) + "|")
    for group, row in looks.items():
        cells = [str(row["cases"]), *(told(key, row.get(key)) for _, key in columns)]
        lines.append(f"| {place_name(group)} | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def beside_markdown(before: dict, after: dict) -> str:
    """Two results beside each other, over the cases and looks that both have: means, and the mean
    difference with its standard error over cases."""
    cases, others = ({row["name"]: row for row in result["cases"]} for result in (before, after))
    pairs = [(row, others[name]) for name, row in cases.items() if name in others]
    lines = [f"| measure ({len(pairs)} scenes) | before | after | difference |", "|---|---|---|---|"]
    for title, key in ONCE:
        name = key.removesuffix("_median") if key.startswith(("rotation", "direction")) else key
        values = [(number(old[name]), number(new[name])) for old, new in pairs]
        lines += _row(title.replace(", median (degrees)", " (degrees)"), key, values)
    for group in [group for group in before["by_look"] if group in after["by_look"]]:
        for title, key in LOOKS:
            lines += _row(f"{place_name(group)}: {title}", key, list(_looks(pairs, group, key)))
    return "\n".join(lines) + "\n"


def _looks(pairs: list[tuple[dict, dict]], group: str, key: str) -> Iterator[tuple[float, float]]:
    """Means of a group in each case, before and after, over looks of one name."""
    for old, new in pairs:
        shared = old["looks"].keys() & new["looks"].keys()
        means = [
            grouped({"looks": {name: row["looks"][name] for name in shared}}).get(group, {})
            for row in (old, new)
        ]
        yield (
            number(means[0].get(key, means[0].get(key.removesuffix(_FILLED)))),
            number(means[1].get(key)),
        )


def _row(title: str, key: str, values: list[tuple[float, float]]) -> list[str]:
    kept = [(old, new) for old, new in values if not (math.isnan(old) or math.isnan(new))]
    if not kept:
        return []
    mean, spread = mean_change(kept)
    old, new = (nan_mean(side) for side in zip(*kept, strict=True))
    cells = (told(key, old), told(key, new), f"{told(key, mean, '+')} ± {told(key, spread)}")
    return [f"| {title} | " + " | ".join(cells) + " |"]


def mean_change(pairs: Sequence[tuple[float, float]]) -> tuple[float, float]:
    """Mean of after - before over at least one pair, and its standard error, 0 of a single one."""
    changes = [new - old for old, new in pairs]
    mean = nan_mean(changes)
    return mean, math.sqrt(sum((c - mean) ** 2 for c in changes) / max(len(changes) - 1, 1) / len(changes))


def place_name(group: str) -> str:
    """Of a group of looks, for people."""
    if group == "0":
        return "the photos' own places"
    if group == "between":
        return "between the photos"
    return f"{group} degrees aside" if group.isdigit() else f"{group} degrees"


def told(key: str, value: float | None, sign: str = "") -> str:
    """A number of a measure, shares in percent; "-" where there is none."""
    if value is None or math.isnan(value):
        return "-"
    return format(100 * value, f"{sign}.2f") if key in _PERCENT else format(value, f"{sign}.3f")
