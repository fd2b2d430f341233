"""What could be an object in photos that nobody labelled: outlines of a proposer, as a folder of photos.

A map of a photo numbers its objects from 1; 0 is nobody's, and says nothing. There are no names, so no
names.csv: `outlined` reads such maps.

Sizes: H W pixels of a photo.
"""

import logging
import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import UInt8, UInt16

from langflash_core.errors import InputError
from langflash_core.lab.labels.masks import cleaned, painted, without_gaps, without_parts, without_repeats
from langflash_core.lab.labels.protocols import MaskProposer
from langflash_core.lab.photos import PhotoFolder
from langflash_core.lab.photos.folder import LabelledPhoto
from langflash_core.lab.photos.writing import FolderWriter

log = logging.getLogger(__name__)

SMALLEST = 0.0008
"""Share of a photo below which an outline is too small to be a group."""


def objects_of(image: UInt8[np.ndarray, "H W 3"], proposer: MaskProposer) -> UInt16[np.ndarray, "H W"]:
    """Numbers (H, W) of what a proposer finds: sure and stable masks, each once, wholes instead of their
    parts, smaller ones over larger ones; 0 where there is none."""
    proposed = proposer.propose(image)
    found = without_parts(without_repeats(proposed.rows(proposed.masks.mean((1, 2)) >= SMALLEST)))
    masks = np.array([cleaned(mask) for mask in found.masks], dtype=bool).reshape(-1, *image.shape[:2])
    ids = without_gaps(painted(masks, np.arange(1, len(masks) + 1), image.shape[:2]))
    small = np.bincount(ids.ravel(), minlength=len(masks) + 1) < SMALLEST * ids.size
    small[0] = True
    kept = np.cumsum(~small)
    return np.where(small, 0, kept)[ids].astype(np.uint16)


def write_outlines(
    folder: PhotoFolder, ids: Sequence[str], writer: FolderWriter, proposer: MaskProposer, what: str
) -> None:
    """The photos, cropped, with maps of their objects; those that are there already are left.

    Args:
        what: the proposer, for people.

    Raises:
        LangFlashError: a photo cannot be read, or the folder not be written.
    """
    began = time.perf_counter()
    for number, id in enumerate(ids, 1):
        if (writer.root / "labels" / f"{id}.png").is_file():
            continue
        image = np.ascontiguousarray(folder.photo(id).image)
        writer.photo(id, image)
        writer.labels(id, objects_of(image, proposer))
        if number % 50 == 0:
            log.info("%d of %d photos, %.0f s", number, len(ids), time.perf_counter() - began)
    writer.finish({}, f"{folder.root.name}, objects outlined by {what}")


def outlined(folder: PhotoFolder, id: str) -> LabelledPhoto:
    """A photo of such a folder with its map.

    Raises:
        InputError: the map is missing, damaged, or of another size.
    """
    photo, labels = folder.photo(id), folder.stored_labels(id)
    if labels.shape != photo.image.shape[:2]:
        raise InputError(
            f"the outlines of photo {id} in {folder.root} have another size than the photo; outline it again"
        )
    return replace(photo, labels=labels)
