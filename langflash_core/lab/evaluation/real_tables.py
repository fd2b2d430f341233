"""Results of `lab eval real` as markdown: a column for the scene, one for what fewer photos bring."""

import math
from collections.abc import Mapping

from langflash_core.lab.evaluation.real import ALONE, BETWEEN, OWN
from langflash_core.lab.evaluation.sides import number
from langflash_core.lab.evaluation.walk_tables import told

ROWS = (
    ("PSNR, light fitted (dB)", "psnr", ".2f"),
    ("structure (1 is the photo)", "structure", ".3f"),
    ("fog (%)", "fog", "share"),
    ("LPIPS", "lpips", ".3f"),
    ("covered (%)", "covered", "share"),
)
_KINDS = {
    OWN: ("at the photos' own places", "that photo alone"),
    BETWEEN: ("at frames held back", "the two photos around it alone"),
}


def real_markdown(result: Mapping) -> str:
    """A table a number of photos: means, and the worst frame in brackets."""
    parts = []
    for case in result["cases"]:
        lines = [
            f"{case['photos']} photos, {told(number(case['placed']), 'share')} % of the frames placed, "
            f"{case['gaussians']:,.0f} Gaussians, {case['seconds']:.1f} s, "
            f"{case['cpu_seconds']:.1f} s of the processor",
            "",
        ]
        for kind, (title, alone) in _KINDS.items():
            if not case[kind]:
                continue
            lines += [f"| {title}, {len(case[kind])} | scene | {alone} |", "|---|---|---|"]
            lines += [line for row in ROWS if (line := _line(case, kind, *row))]
            lines.append("")
        parts.append("\n".join(lines))
    return "\n".join(parts)


def _line(case: Mapping, kind: str, title: str, key: str, form: str) -> str:
    names = (key, f"{ALONE}_{key}")
    means = [number(case["mean"][kind].get(name)) for name in names]
    if all(math.isnan(mean) for mean in means):
        return ""
    worst = [number(case["worst"][kind].get(name)) for name in names]
    cells = [
        told(mean, form) + ("" if math.isnan(low) else f" ({told(low, form)})")
        for mean, low in zip(means, worst, strict=True)
    ]
    return f"| {title} | " + " | ".join(cells) + " |"
