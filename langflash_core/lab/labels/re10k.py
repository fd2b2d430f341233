"""Labels inside RealEstate10K's chunks, in pixelSplat's layout: the data set is enriched in place.

A chunk is a list of {"key", "cameras", "images", ...}; a labelled video has one more entry, which readers
that do not know it leave alone:

    "labels": {"format": "langflash-labels-1",   "document": JSON text of everything that is no tensor
               "ids": [uint8 tensors, PNG of 8 or 16 bits, one a frame],   "vectors": (M, C) float16}

Chunks are read by torch's reader of tensors alone (`weights_only`), so nothing in them is executed, and what
is written is read so as well. Source of the layout: Charatan et al., pixelSplat, CVPR 2024.
"""

import itertools
from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import torch

from langflash_core.base.files import held_alone
from langflash_core.batch.sets import check_name
from langflash_core.errors import InputError
from langflash_core.lab.labels.clips import INDEX
from langflash_core.lab.labels.storage import (
    FORMAT,
    LABELS,
    ClipLabels,
    described,
    encoded_map,
    read_labels,
    unpacked,
)
from langflash_core.lab.photos.published import read_chunk
from langflash_core.lab.photos.reading import read_table
from langflash_core.lab.saving import save_whole

ENTRY = "labels"


def enrich(split: Path, labelled: Path, keys: Collection[str] | None = None) -> int:
    """Put labels into the chunks of a split, in place, a chunk at a time; videos without labels stay as they
    are, everything else a video holds does, too, and a chunk that has them all is not written again.

    Args:
        split: folder with index.json and chunks. labelled: folder with a folder a video, as
            `langflash lab labels` fills it. keys: only these videos.

    Returns:
        How many videos hold those labels now.

    Raises:
        InputError: index, a chunk or labels cannot be used, or labels are not of their video's frames.
        OutputError: a chunk cannot be written (the old one is then whole), or another run writes to them.
    """
    count = 0
    with held_alone(split):
        for path, known in _chunks(split):
            ready = {
                key for key in known if (keys is None or key in keys) and (labelled / key / LABELS).is_file()
            }
            count += _enriched(path, labelled, ready) if ready else 0
    return count


def _enriched(path: Path, labelled: Path, keys: Collection[str]) -> int:
    """One chunk; how many of the videos are in it."""
    entries, count, changed = read_chunk(path), 0, False
    for entry in entries:
        if entry["key"] in keys:
            labels = as_entry(read_labels(labelled / entry["key"] / LABELS), len(entry["images"]))
            changed |= not _same(entry.get(ENTRY), labels)
            entry[ENTRY] = labels
            count += 1
    if changed:
        save_whole(entries, path)
    return count


def _same(old: object, new: Mapping) -> bool:
    """Whether a video has these labels already; what is there may be anything."""
    if not isinstance(old, dict) or old.get("document") != new["document"]:
        return False
    before, now = ([*entry.get("ids", ()), entry.get("vectors")] for entry in (old, new))
    return len(before) == len(now) and all(
        isinstance(a, torch.Tensor) and a.dtype == b.dtype and torch.equal(a, b)
        for a, b in zip(before, now, strict=True)
    )


def labels_inside(split: Path) -> Iterator[ClipLabels]:
    """The labels that the chunks of a split hold, video by video, by the videos' keys.

    Raises:
        InputError: index or a chunk cannot be used, or a key cannot be the name of a folder.
    """
    for path, _ in _chunks(split):
        for entry in read_chunk(path):
            if ENTRY in entry:
                key = str(entry["key"])
                check_name(key, str(path))
                yield replace(of_entry(entry[ENTRY], key), name=key)


def _chunks(split: Path) -> list[tuple[Path, list[str]]]:
    """Every chunk of a split, with the keys that its index has in it."""
    index = sorted((str(chunk), key) for key, chunk in read_table(split / INDEX).items())
    grouped = itertools.groupby(index, key=lambda row: row[0])
    return [(split / chunk, [key for _, key in rows]) for chunk, rows in grouped]


def as_entry(labels: ClipLabels, frames: int) -> dict:
    """What a video's entry gets: plain tensors and texts.

    Raises:
        InputError: there are not as many id maps as frames.
    """
    if len(labels.ids) != frames:
        raise InputError(
            f"the labels of {labels.name} are of {len(labels.ids)} frames, the video has {frames}; "
            "collect them from every frame (without --start, --count and --step)"
        )
    return {
        "format": FORMAT,
        "document": described(labels),
        "ids": [torch.frombuffer(bytearray(encoded_map(ids)), dtype=torch.uint8) for ids in labels.ids],
        "vectors": torch.from_numpy(labels.vectors.astype(np.float16)),
    }


def of_entry(entry: Mapping, key: str) -> ClipLabels:
    """Labels of a video's entry.

    Raises:
        InputError: it is damaged, or of another version.
    """
    try:
        if entry["format"] != FORMAT:
            raise ValueError(f"it says {entry['format']}, not {FORMAT}")
        streams = [stream.numpy().tobytes() for stream in entry["ids"]]
        return unpacked(entry["document"], streams, entry["vectors"].numpy())
    except (KeyError, ValueError, TypeError, OSError, AttributeError, IndexError) as error:
        raise InputError(f"the labels of {key} cannot be read ({error}); collect them again") from None
