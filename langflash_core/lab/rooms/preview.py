"""Contact sheets: what the rooms look like, with depth and instances."""

import colorsys
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float, UInt8
from PIL import Image

from langflash_core.lab.rooms.catalogue import TRAIN_LIBRARIES
from langflash_core.lab.rooms.pack import Pack
from langflash_core.lab.rooms.render import RoomRenderer
from langflash_core.lab.rooms.sample import RoomViews, staged_room


def contact_sheet(
    pack: Pack,
    seeds: Sequence[int],
    libraries: tuple[str, ...] = TRAIN_LIBRARIES,
    size: tuple[int, int] = (224, 224),
) -> Image.Image:
    """One column per view; rows are photo, depth (near bright) and instances, six views a band."""
    with RoomRenderer(pack) as renderer:
        samples = [staged_room(seed, pack, renderer, size=size, libraries=libraries).views for seed in seeds]
    bands = [_band(samples[k : k + 3]) for k in range(0, len(samples), 3)]
    width = max(band.shape[1] for band in bands)
    padded = [np.pad(band, ((0, 4), (0, width - band.shape[1]), (0, 0))) for band in bands]
    return Image.fromarray(np.concatenate(padded))


def colour_instances(instances: UInt8[np.ndarray, "*n"]) -> UInt8[np.ndarray, "*n 3"]:
    """A distinct colour per id; black for 0."""
    table = [
        colorsys.hsv_to_rgb(k * 0.618 % 1.0, 0.45 + 0.5 * (k % 3) / 2, 0.95 - 0.12 * (k % 4))
        for k in range(256)
    ]
    table[0] = (0.0, 0.0, 0.0)
    return (np.array(table) * 255).astype(np.uint8)[instances]


def colour_depth(depth: Float[np.ndarray, "H W"]) -> UInt8[np.ndarray, "H W 3"]:
    """Nearness as grey; nothing is dark blue."""
    near = np.where(depth > 0, 0.6 / np.maximum(depth, 0.6), 0.0) ** 0.7
    grey = (near * 255).astype(np.uint8)
    return np.where(depth[..., None] > 0, grey[..., None], np.array([20, 20, 80], dtype=np.uint8)).astype(
        np.uint8
    )


def _band(samples: Sequence[RoomViews]) -> UInt8[np.ndarray, "R C 3"]:
    columns = []
    for sample in samples:
        for image, depth, ids in zip(sample.images, sample.depths, sample.instances, strict=True):
            columns.append(np.concatenate([image, colour_depth(depth), colour_instances(ids)]))
    return np.concatenate(columns, axis=1)
