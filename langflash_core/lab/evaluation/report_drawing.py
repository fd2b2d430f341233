"""What `langflash bench` measured as a section of a report: a frame in every mode, what is wrong in it."""

from collections.abc import Mapping
from typing import Any

from langflash_core.lab.evaluation.report_parts import Plot, Point, Section
from langflash_core.lab.evaluation.tables import Table

_COLUMNS = (
    ("times_default", "time of a frame", ".2f"),
    ("ms_median", "ms", ".1f"),
    ("cpu_ms_median", "processor ms", ".0f"),
    ("phrase_ms", "ms of a new phrase", ",.0f"),
    ("psnr_db", "PSNR of colours, dB", ".1f"),
    ("relevance_mean", "error of relevance, mean", ".1e"),
    ("mask_iou", "IoU of masks", ".3f"),
)


def drawing_section(document: Mapping[str, Any]) -> Section:
    """Of a document of one case, as `langflash bench` makes it."""
    (case,) = document["cases"]
    scene, path, phrases = case["scene"], case["path"], case["query"]["phrases"]
    width, height = case["picture"]
    about = (
        f"{scene['gaussians']:,} Gaussians, {scene['atoms']} atoms, {width} x {height} pixels, phrases: "
        f"{', '.join(phrases)}. {path['frames']} frames of a moving camera in every mode by turns, from a "
        f"new camera to the first heat-map, by {document['machine']['gpu']}. Times are medians, that of a "
        "frame of the ratios to the default in the same round; errors are to the float64 reference. Default: "
        f"{case['default']}."
    )
    measures = {
        f"{row['mode']}: {name}": row[name]
        for row in case["rows"]
        for name, _, _ in _COLUMNS
        if row[name] is not None
    }
    rows = [
        (row["mode"], *("-" if row[name] is None else format(row[name], form) for name, _, form in _COLUMNS))
        for row in case["rows"]
    ]
    points = [Point(row["mode"], row["ms_median"] / 1e3, row["relevance_mean"]) for row in case["rows"]]
    return Section(
        "drawing",
        "Drawing: speed against error",
        about,
        {"scenes": 1, "measures": measures},
        {},
        (Table("Modes", ("mode", *(heading for _, heading, _ in _COLUMNS)), rows),),
        (Plot("Speed against error: answers", "seconds of a frame", "mean error of relevance", points),),
    )
