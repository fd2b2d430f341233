"""What `export` writes of an answered view: pictures, and tables of places and sizes."""

import csv
import io
import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from langflash_core.colormaps import HeatColours
from langflash_core.export import glb
from langflash_core.export.png import USUAL, heat_over, label_map, to_8bit, write_labels, write_mask
from langflash_core.files import make_folder, write_atomically
from langflash_core.types import Frame, QueryResult, Scene

from . import pictures
from .commands.query import answer_fields

COLUMNS = (
    "view", "prompt", "found", "score", "threshold", "area", "unit",
    "center_x", "center_y", "center_z", "size_x", "size_y", "size_z",
    *(f"axis{axis}_{part}" for axis in "123" for part in "xyz"),
)  # fmt: skip


def write_plain(path: Path, frame: Frame) -> None:
    """The colours of a frame."""
    pictures.write_picture(path, to_8bit(frame.rgb))


def write_answered(what: str, path: Path, result: QueryResult, colours: HeatColours = USUAL) -> None:
    """One picture of an answer.

    Args:
        what: "heat" (of the first phrase), or of the phrases that are there "mask", or "labels" with a
            legend beside it.
        colours: of the heat-map.
    """
    if what == "labels":
        write_labels(path, label_map(result), [answer.prompt for answer in result.answers])
    elif what == "mask":
        write_mask(path, result.masks.any(0))
    else:
        threshold = result.answers[0].threshold
        lit = heat_over(result.relevance[0], result.frame.rgb, threshold, result.mode, colours)
        pictures.write_picture(path, to_8bit(lit))


def box_rows(
    results: Iterable[QueryResult], views: Iterable[int | None], scene: Scene
) -> list[dict[str, Any]]:
    """A row per view and phrase; lengths in metres where the scene's scale is known."""
    metres = scene.record.metric_scale
    return [
        {"view": view, **answer_fields(answer, metres or 1.0), "unit": "m" if metres else "scene"}
        for view, result in zip(views, results, strict=True)
        for answer in result.answers
    ]


def write_boxes(path: Path, rows: Sequence[dict[str, Any]]) -> None:
    """The rows as JSON, as CSV with a column per number, or as boxes in glTF.

    Raises:
        OutputError: the path cannot be written.
    """
    make_folder(path.parent)
    if path.suffix.lower() == ".glb":
        return glb.write_boxes([(_node(row), row["box"]) for row in rows if row["box"]], path)
    if path.suffix.lower() == ".json":
        content = json.dumps(rows, indent=2, ensure_ascii=False, allow_nan=False)
    else:
        stream = io.StringIO(newline="")
        table = csv.DictWriter(stream, COLUMNS)
        table.writeheader()
        table.writerows(_flat(row) for row in rows)
        content = stream.getvalue()
    write_atomically(path, content.encode())


def _node(row: dict[str, Any]) -> str:
    return row["prompt"] if row["view"] is None else f"{row['prompt']} (view {row['view']})"


def _flat(row: dict[str, Any]) -> dict[str, Any]:
    """One number a column; those of a phrase that is not there stay empty."""
    flat = {name: row[name] for name in COLUMNS[:7]}
    flat["view"] = "" if row["view"] is None else row["view"]
    box = row["box"]
    if box is not None:
        flat.update(zip(COLUMNS[7:10], box["center"], strict=True))
        flat.update(zip(COLUMNS[10:13], box["size"], strict=True))
        flat.update(zip(COLUMNS[13:], (part for axis in box["axes"] for part in axis), strict=True))
    return flat
