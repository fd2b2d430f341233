"""Labelled photos as scenes of one view, in the same shards as rendered rooms.

Regions of a name are instances: connected ones for things, the whole for walls, floors and ceilings.
What is not labelled, or too small to be seen, is `NOTHING` and teaches nothing. A plan writes every photo
several times, each time through another window, mirrored or not, in other light.
"""

import logging
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
import torch
from scipy.ndimage import label as connected
from torch import Tensor

from langflash_core.lab.photos import Name, PhotoFolder
from langflash_core.lab.photos.fitting import FittedPhoto, drawn_window, fitted, network_size
from langflash_core.lab.training.cache import fill_shards, photometric
from langflash_core.lab.training.photo_names import photo_label
from langflash_core.lab.training.shards import NOTHING, Label, RoomRecord
from langflash_core.lab.training.stages.stage import guided
from langflash_core.network.checkpoints.files import initial_network
from langflash_core.network.encoders.shared import Encoder
from langflash_core.network.presets import PRESETS

log = logging.getLogger(__name__)

WHOLE = frozenset({"wall", "floor", "ceiling"})
"""Groups whose regions are one instance, wherever things stand before them."""
MIN_REGION = 0.0008
"""Share of the picture below which a region is too small (40 of 224 x 224 pixels)."""
PER_SHARD = 32
_COPIES = 1000  # more copies of one photo than that would share seeds with the next


@dataclass(frozen=True)
class PhotoPlan:
    """Which photos, and how often each.

    copies: of every photo; the first is the photo as it is, the others are augmented. area: pixels of a
    view, sides multiples of `patch`. with_tokens False keeps pictures only.
    """

    ids: tuple[str, ...]
    copies: int = 1
    area: int = 224 * 224
    patch: int = 14
    with_tokens: bool = True


def fill_photo_cache(
    folder: PhotoFolder, out: Path, plan: PhotoPlan, encoder: Encoder | None, part: tuple[int, int] = (0, 1)
) -> int:
    """Write the missing shards of a plan; returns the number of views written.

    Photos of one shape lie together. An interrupted run continues; `part` (i, n) takes every n-th shard.

    Raises:
        ValueError: tokens are wanted but there is no encoder, or `part` is not i < n.
        InputError: a photo or its maps cannot be used. OutputError: `out` cannot be written.
    """

    def drawn(views: list[tuple[str, int]]) -> Iterator[RoomRecord]:
        return (photo_record(folder, id, copy, plan) for id, copy in views)

    shards = ((path, partial(drawn, views)) for path, views in _shards(folder, out, plan))
    return fill_shards(shards, encoder, part, with_tokens=plan.with_tokens)


def _shards(folder: PhotoFolder, out: Path, plan: PhotoPlan) -> Iterator[tuple[Path, list[tuple[str, int]]]]:
    """Every shard's path and its (id, copy), one size each."""
    by_size: dict[tuple[int, int], list[str]] = {}
    for id in plan.ids:
        by_size.setdefault(network_size(folder.photo(id), plan.area, plan.patch), []).append(id)
    for (width, height), ids in sorted(by_size.items()):
        views = [(id, copy) for copy in range(plan.copies) for id in ids]
        for start in range(0, len(views), PER_SHARD):
            name = f"{folder.root.name}_{width}x{height}_{start:06d}.safetensors"
            yield out / name, views[start : start + PER_SHARD]


def photo_record(folder: PhotoFolder, id: str, copy: int, plan: PhotoPlan) -> RoomRecord:
    """One view of one photo, without tokens; copy 0 is the photo as it is."""
    photo = folder.photo(id)
    size = network_size(photo, plan.area, plan.patch)
    seed = folder.ids.index(id) * _COPIES + copy
    if copy == 0:
        return record_of_photo(fitted(photo, size), folder.names, seed)
    window, mirrored = drawn_window(photo, size, seed)
    record = record_of_photo(fitted(photo, size, window, mirrored), folder.names, seed)
    return replace(record, rgb=photometric(record.rgb, seed))


def record_of_photo(view: FittedPhoto, names: dict[int, Name], seed: int) -> RoomRecord:
    """A scene of one view, as it is stored."""
    instances, labels = regions(view.labels, names)
    return RoomRecord(
        seed=seed,
        rgb=view.rgb[None],
        depths=view.depths[None].half(),
        instances=instances[None],
        viewmats=torch.eye(4)[None],
        Ks=view.K[None],
        labels=labels,
    )


def regions(ids: Tensor, names: dict[int, Name]) -> tuple[Tensor, tuple[Label, ...]]:
    """Instances (H, W) uint8 of a map of ids, and what each is called; the largest 255 at most.

    Ids of one label are one thing. Source: connected regions by 4 neighbours, scipy.
    """
    by_label: dict[Label, np.ndarray] = {}
    for id in np.unique(ids.numpy()).tolist():
        label = photo_label(names[id]) if id in names else None
        if label is not None:
            by_label[label] = by_label.get(label, np.False_) | (ids.numpy() == id)
    found: list[tuple[int, np.ndarray, Label]] = []
    for label, mask in by_label.items():
        pieces = mask.astype(np.int32) if label.group in WHOLE else _connected(mask)
        areas = np.bincount(pieces.ravel())
        large = [k for k in range(1, len(areas)) if areas[k] >= MIN_REGION * ids.numel()]
        found += [(int(areas[k]), pieces == k, label) for k in large]
    found = sorted(found, key=lambda region: -region[0])[:NOTHING]
    instances = np.full(tuple(ids.shape), NOTHING, dtype=np.uint8)
    for index, (_, mask, _) in enumerate(found):
        instances[mask] = index
    return torch.from_numpy(instances), tuple(label for _, _, label in found)


def _connected(mask: np.ndarray) -> np.ndarray:
    """Regions (H, W) of a mask, numbered from 1."""
    regions = np.zeros(mask.shape, dtype=np.int32)
    connected(mask, output=regions)
    return regions


def run_photo_cache(
    folder: PhotoFolder,
    ids: Sequence[str],
    out: Path,
    start: Path,
    *,
    copies: int = 1,
    part: tuple[int, int] = (0, 1),
    preset: str = "mini",
) -> int:
    """Encode photos into shards in `out`; returns the number of views written. Single-threaded, as
    `run_cache`.

    Args:
        start: weights file of the preset, whose encoder is used.

    Raises:
        InputError: a photo or its maps cannot be used.
    """
    torch.set_num_threads(1)
    encoder = guided(initial_network(PRESETS[preset], start)).encoder
    plan = PhotoPlan(tuple(ids), copies, PRESETS[preset].native_area, PRESETS[preset].patch)
    began = time.perf_counter()
    written = fill_photo_cache(folder, out, plan, encoder, part)
    log.info("%d views in %.0f s", written, time.perf_counter() - began)
    return written
