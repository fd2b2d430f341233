"""Tables and bodies of places and sizes: where each phrase is in a view."""

import csv
import io
import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from langflash_core.base.files import make_folder, write_atomically
from langflash_core.export import glb
from langflash_core.export.answers import answer_fields
from langflash_core.types import QueryResult, Scene
from langflash_core.writing.job import Job

COLUMNS = (
    "view", "prompt", "found", "score", "threshold", "area", "unit",
    "center_x", "center_y", "center_z", "size_x", "size_y", "size_z",
    *(f"axis{axis}_{part}" for axis in "123" for part in "xyz"),
)  # fmt: skip


def write_boxes(job: Job) -> str:
    """Where each phrase is and how large, as JSON, CSV or glTF; a row or a box per phrase and view.

    Raises:
        LangFlashError: a phrase cannot be used, or the file cannot be written.
    """
    request, scene = job.request, job.scene
    cameras = job.cameras()
    views = [None] if request.camera is not None else [request.view or 0]
    with job.renderer() as renderer:
        results = job.answers(cameras, renderer)
        rows = box_rows(results, range(scene.num_views) if request.all_views else views, scene)
    write_rows(request.output, rows)
    return f"{sum(row['found'] for row in rows)} of {len(rows)} found"


def box_rows(
    results: Iterable[QueryResult], views: Iterable[int | None], scene: Scene
) -> list[dict[str, Any]]:
    """A row per view, counted from 1, and phrase; lengths in metres where the scene's scale is known."""
    metres = scene.record.metric_scale
    return [
        {
            "view": None if view is None else view + 1,
            **answer_fields(answer, metres or 1.0),
            "unit": "m" if metres else "scene",
        }
        for view, result in zip(views, results, strict=True)
        for answer in result.answers
    ]


def write_rows(path: Path, rows: Sequence[dict[str, Any]]) -> None:
    """The rows as JSON, as CSV with a column per number, or as boxes in glTF.

    Raises:
        OutputError: the path cannot be written.
    """
    make_folder(path.parent)
    if path.suffix.lower() == ".glb":
        photo = {row["view"]: f" (photo {row['view']})" if row["view"] else "" for row in rows}
        found = [(row["prompt"] + photo[row["view"]], row["box"]) for row in rows if row["box"]]
        return glb.write_boxes(found, path)
    if path.suffix.lower() == ".json":
        content = json.dumps(rows, indent=2, ensure_ascii=False, allow_nan=False)
    else:
        stream = io.StringIO(newline="")
        table = csv.DictWriter(stream, COLUMNS)
        table.writeheader()
        table.writerows(_flat(row) for row in rows)
        content = stream.getvalue()
    write_atomically(path, content.encode())


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
