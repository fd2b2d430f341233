"""Masks of phrases as COCO instances: one picture per view, one category per phrase.

Segmentations are run lengths, counts of pixels down the columns from the top left, outside first.
Source: the data format of cocodataset.org.
"""

import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from langflash_core.base.files import write_atomically
from langflash_core.types import QueryResult


def write_answer(result: QueryResult, path: Path) -> None:
    """One view; its picture is expected beside the file, named `<stem>.png`."""
    write_coco([result], [path.with_suffix(".png").name], path)


def write_coco(results: Iterable[QueryResult], pictures: Sequence[str], path: Path) -> None:
    """Several views of the same phrases.

    Args:
        results: one per view, taken one after the other. pictures: their file names, relative to `path`.

    Raises:
        OutputError: the path cannot be written.
    """
    write_atomically(path, json.dumps(coco(results, pictures), ensure_ascii=False).encode())


def coco(results: Iterable[QueryResult], pictures: Sequence[str]) -> dict[str, Any]:
    """The document: `info, licenses, images, categories, annotations`; ids count from 1.

    An annotation is the whole mask of a phrase in a view, with `score` beside COCO's own fields.
    """
    images, annotations, prompts = [], [], []
    for result, name in zip(results, pictures, strict=True):
        image = len(images) + 1
        height, width = result.frame.alphas.shape
        images.append({"id": image, "file_name": name, "width": width, "height": height})
        prompts = [answer.prompt for answer in result.answers]
        masks = result.masks.cpu().numpy()
        for category, (mask, answer) in enumerate(zip(masks, result.answers, strict=True), start=1):
            if mask.any():
                own = {"id": len(annotations) + 1, "image_id": image, "category_id": category}
                annotations.append({**own, **_region(mask), "score": float(answer.score)})
    categories = [
        {"id": index, "name": prompt, "supercategory": "prompt"}
        for index, prompt in enumerate(prompts, start=1)
    ]
    return {
        "info": {"description": "Masks of phrases, by LangFlash"},
        "licenses": [],
        "images": images,
        "categories": categories,
        "annotations": annotations,
    }


def _region(mask: np.ndarray) -> dict[str, Any]:
    """`segmentation`, `area`, `bbox` (x, y, width, height) in pixels, and `iscrowd` of a mask (H, W)."""
    rows, columns = np.flatnonzero(mask.any(1)), np.flatnonzero(mask.any(0))
    left, top = int(columns[0]), int(rows[0])
    return {
        "segmentation": {"size": list(mask.shape), "counts": run_lengths(mask)},
        "area": int(mask.sum()),
        "bbox": [left, top, int(columns[-1]) - left + 1, int(rows[-1]) - top + 1],
        "iscrowd": 0,
    }


def run_lengths(mask: np.ndarray) -> list[int]:
    """Lengths of equal runs of a mask (H, W) in column order; the first, which may be 0, is outside."""
    flat = mask.astype(bool).flatten(order="F")
    changes = np.flatnonzero(np.diff(flat)) + 1
    edges = np.concatenate(([0], changes, [flat.size]))
    lengths = np.diff(edges).tolist()
    return [0, *lengths] if flat.size and flat[0] else lengths
