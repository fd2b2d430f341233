"""The folder that `query -o DIR` fills: one view, and per prompt its mask, heat, and relevance."""

import itertools
import unicodedata
from collections.abc import Sequence
from pathlib import Path

from langflash_core.colormaps import HeatColours
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
from langflash_core.files import make_folder
from langflash_core.types import QueryResult

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
        relevance, threshold = result.relevance[index], result.answers[index].threshold
        write_mask(own["mask"], result.masks[index])
        write_heat(own["heat"], relevance, result.frame.rgb, threshold, result.mode, colours)
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
