"""What is told of an answered view: the folder that `query -o DIR` fills, and the document beside it."""

import itertools
import unicodedata
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from langflash_core.base.colormaps import HeatColours
from langflash_core.base.files import make_folder
from langflash_core.export.npz import write_npz
from langflash_core.export.png import (
    USUAL,
    label_map,
    write_heat,
    write_labels,
    write_mask,
    write_relevance,
    write_rgb,
)
from langflash_core.types import PromptAnswer, QueryResult, Scene

_MAX_NAME = 60


def write_answers(
    result: QueryResult, folder: Path, *, npz: bool = False, colours: HeatColours = USUAL
) -> list[dict[str, str]]:
    """Write `rgb.png`, `labels.png` + `labels.json`, and `<prompt>_{mask,heat,relevance}.png`.

    Args:
        folder: created where missing. npz: `query.npz` as well. colours: of the heat-maps.

    Returns:
        Per prompt the paths of its own files and of the shared ones, by kind.

    Raises:
        OutputError: the folder cannot be created or written.
    """
    make_folder(folder)
    shared = {"rgb": folder / "rgb.png", "labels": folder / "labels.png", "legend": folder / "labels.json"}
    write_rgb(shared["rgb"], result.frame.rgb)
    write_labels(shared["labels"], label_map(result), [answer.prompt for answer in result.answers])
    if npz:
        shared["npz"] = folder / "query.npz"
        write_npz(result, shared["npz"])
    files = []
    for index, name in enumerate(file_names([answer.prompt for answer in result.answers])):
        own = {kind: folder / f"{name}_{kind}.png" for kind in ("mask", "heat", "relevance")}
        relevance, lit_from = result.relevance[index], result.answers[index].lit_from
        write_mask(own["mask"], result.masks[index])
        write_heat(own["heat"], relevance, result.frame.rgb, lit_from, result.mode, colours)
        write_relevance(own["relevance"], relevance, result.mode)
        files.append({kind: str(path) for kind, path in {**own, **shared}.items()})
    return files


def file_names(prompts: Sequence[str]) -> list[str]:
    """A safe, distinct name per prompt: letters and digits of any script, the rest becomes _."""
    names: list[str] = []
    for index, prompt in enumerate(prompts):
        plain = unicodedata.normalize("NFKC", prompt.casefold())
        words = "".join(sign if sign.isalnum() else " " for sign in plain).split()
        name = "_".join(words).encode()[:_MAX_NAME].decode(errors="ignore") or f"prompt_{index}"
        others = (f"{name}_{number}" for number in itertools.count(2))
        names.append(name if name not in names else next(other for other in others if other not in names))
    return names


def answers_document(scene: Scene, result: QueryResult, files: Sequence[dict[str, str]]) -> dict[str, Any]:
    """What `query --json` says of a view; `files` by kind, one entry a phrase."""
    metres = scene.record.metric_scale
    return {
        "mode": result.mode,
        "size": [result.camera.width, result.camera.height],
        "unit": "m" if metres else "scene",
        "prompts": [
            {**answer_fields(answer, metres or 1.0), "files": paths}
            for answer, paths in zip(result.answers, files, strict=True)
        ],
    }


def answer_fields(answer: PromptAnswer, scale: float) -> dict[str, Any]:
    """The JSON of one answer; positions and sizes multiplied by `scale` (metres per scene unit)."""
    return {
        "prompt": answer.prompt,
        "found": answer.found,
        "score": answer.score,
        "threshold": answer.threshold,
        "area": answer.area,
        "centroid": answer.centroid and [scale * value for value in answer.centroid],
        "box": answer.box and scaled_box(answer.box, scale),
        "note": answer.note,
        "reading": answer.reading,
    }


def scaled_box(box: dict[str, Any], scale: float) -> dict[str, Any]:
    """Place and size multiplied by `scale`."""
    return {
        "center": [scale * value for value in box["center"]],
        "axes": [list(axis) for axis in box["axes"]],
        "size": [scale * value for value in box["size"]],
    }
