"""Labels inside RealEstate10K's chunks, in pixelSplat's layout: the data set is enriched in place.

A chunk is a list of {"key", "cameras", "images", ...}; a labelled video has one more entry, which readers
that do not know it leave alone:

    "labels": {"format": "langflash-labels-1",   "document": JSON text of everything that is no tensor
               "ids": [uint8 tensors, PNG of 8 or 16 bits, one a frame],   "vectors": (M, C) float16}

Chunks are read by torch's reader of tensors alone (`weights_only`), so nothing in them is executed, and what
is written is read so as well. Source of the layout: Charatan et al., pixelSplat, CVPR 2024.
"""

import itertools
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import numpy as np
import torch

from langflash_core.errors import InputError
from langflash_core.files import written_atomically
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
from langflash_core.lab.photos.layouts import read_table
from langflash_core.lab.photos.published import read_chunk

ENTRY = "labels"


def enrich(split: Path, labelled: Path, told: Callable[[str], None] = lambda key: None) -> int:
    """Put labels into the chunks of a split, in place, a chunk at a time; videos without labels stay as they
    are, and everything else a video holds does, too.

    Args:
        split: folder with index.json and chunks. labelled: folder with a folder a video, as
            `langflash labels` fills it. told: called with the key of each video that was enriched.

    Returns:
        How many videos were enriched.

    Raises:
        InputError: index, a chunk or labels cannot be used, or labels are not of their video's frames.
        OutputError: a chunk cannot be written; the old one is then whole.
    """
    count = 0
    for path, keys in _chunks(split):
        ready = {key for key in keys if (labelled / key / LABELS).is_file()}
        if not ready:
            continue
        entries = read_chunk(path)
        for entry in entries:
            if entry["key"] in ready:
                labels = read_labels(labelled / entry["key"] / LABELS)
                entry[ENTRY] = _as_entry(labels, len(entry["images"]))
                count += 1
                told(entry["key"])
        with written_atomically(path) as temporary:
            torch.save(entries, temporary)
    return count


def labels_inside(split: Path) -> Iterator[ClipLabels]:
    """The labels that the chunks of a split hold, video by video.

    Raises:
        InputError: index or a chunk cannot be used.
    """
    for path, _ in _chunks(split):
        for entry in read_chunk(path):
            if ENTRY in entry:
                yield of_entry(entry[ENTRY], str(entry["key"]))


def _chunks(split: Path) -> list[tuple[Path, list[str]]]:
    """Every chunk of a split, with the keys that its index has in it."""
    index = sorted((str(chunk), key) for key, chunk in read_table(split / INDEX).items())
    grouped = itertools.groupby(index, key=lambda row: row[0])
    return [(split / chunk, [key for _, key in rows]) for chunk, rows in grouped]


def _as_entry(labels: ClipLabels, frames: int) -> dict:
    """Plain tensors and texts.

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
