"""Parts of rendered rooms and labelled photos as the namer reads them, on disk: found once, drawn many times.

Of every room twice: the parts that the frozen grouping finds, each called what most of it shows, and
the true masks. The namer is small and the parts take seconds a room, so it learns from this table.

Sizes: P parts, C channels of the language space.
"""

import itertools
import json
import logging
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import torch
from safetensors import safe_open
from safetensors.torch import save
from torch import Tensor

from langflash_core.base.files import make_folder, write_atomically
from langflash_core.lab.training.batches import SceneBatch, collate
from langflash_core.lab.training.shards import Label, open_shards
from langflash_core.lab.training.stages.aggregation import mostly
from langflash_core.lab.training.stages.grouping import group_masks
from langflash_core.lab.training.stages.pixels import nearest
from langflash_core.lab.training.stages.stage import tokens_of
from langflash_core.network.guided import GuidedDepthNet
from langflash_core.network.semantics.naming import describe, places

log = logging.getLogger(__name__)

MIN_QUALITY = 0.3
"""Parts of which less is one thing teach nothing."""

_TENSORS = ("atoms", "looks", "places", "quality")


@dataclass(frozen=True)
class PartBatch:
    """Parts of some rooms, one room after the other.

    atoms (P, C) of the aggregation; looks and places as `network.naming` gives them; quality (P,): the
    share of a part that is what it is called; labels (P); sizes: parts of each room; seeds of the rooms.
    """

    atoms: Tensor
    looks: Tensor
    places: Tensor
    quality: Tensor
    labels: tuple[Label, ...]
    sizes: tuple[int, ...]
    seeds: tuple[int, ...]

    def to(self, device: str | torch.device) -> "PartBatch":
        return replace(self, **{name: getattr(self, name).to(device) for name in _TENSORS})

    def subset(self, rows: Tensor) -> "PartBatch":
        """Some parts of one room; rows: (n,) indices, on the CPU."""
        tensors = [getattr(self, name)[rows.to(self.quality.device)] for name in _TENSORS]
        return _batch(tensors, tuple(self.labels[i] for i in rows.tolist()), (len(rows),), self.seeds)

    def rooms(self) -> list["PartBatch"]:
        """Each room's parts."""
        split = [getattr(self, name).split(list(self.sizes)) for name in _TENSORS]
        ends = list(itertools.accumulate(self.sizes))
        return [
            _batch(tensors, self.labels[end - size : end], (size,), (seed,))
            for *tensors, size, end, seed in zip(*split, self.sizes, ends, self.seeds, strict=True)
        ]


def _batch(
    tensors: Sequence[Tensor], labels: tuple[Label, ...], sizes: tuple[int, ...], seeds: tuple[int, ...]
) -> PartBatch:
    atoms, looks, places, quality = tensors
    return PartBatch(atoms, looks, places, quality, labels, sizes, seeds)


def run_parts(network: GuidedDepthNet, rooms: Path, out: Path, part: tuple[int, int] = (0, 1)) -> int:
    """Write the missing part files of a folder of room shards, one each; returns how many parts.

    A file that is there is left alone: take it away first when the network has changed.

    Args:
        part: (i, n) takes shards i, i + n, ... so that n processes share a folder.
    """
    count = 0
    for shard in open_shards(rooms)[part[0] :: part[1]]:
        path = out / shard.path.name
        if path.exists():
            continue
        found = [
            room
            for i in range(len(shard))
            for room in parts_of(network, collate([shard.record(i, views=range(min(2, shard.views)))]))
        ]
        if found:
            _write(path, joined(found))
        count += sum(len(room.labels) for room in found)
        log.info("%s: %d parts", path.name, sum(len(room.labels) for room in found))
    return count


@torch.inference_mode()
def parts_of(network: GuidedDepthNet, batch: SceneBatch) -> list[PartBatch]:
    """The parts found in one scene (B = 1), and its true masks; what is empty is left out."""
    tokens = tokens_of(network, batch)
    features = network.language(tokens, batch.images).float()
    size = (features.shape[-2], features.shape[-1])
    masks, instances = group_masks(nearest(batch.instances[0], size))
    if len(instances) == 0:
        return []
    depths, viewmats = guessed_geometry(network, batch)
    views = batch.images.shape[1]
    truth = masks.unflatten(1, (views, *size)).transpose(0, 1)
    answer = []
    for weights in (network.parts(tokens, batch.images, size, features), truth):
        if weights.shape[1] == 0:
            continue
        quality, majority = mostly(weights, masks, network.preset.eps)
        kept = quality > MIN_QUALITY
        if not bool(kept.any()):
            continue
        labels = [batch.labels[0][int(k)] for k in instances[majority[kept]]]
        answer.append(
            PartBatch(
                network.aggregation(weights[None], features)[0][kept],
                describe(weights, tokens)[kept],
                places(weights, depths, viewmats, batch.Ks[0])[kept],
                quality[kept],
                tuple(labels),
                (len(labels),),
                (batch.seeds[0],),
            )
        )
    return answer


@torch.inference_mode()
def guessed_geometry(network: GuidedDepthNet, batch: SceneBatch) -> tuple[Tensor, Tensor]:
    """Depths (V, H, W) and poses (V, 4, 4) of one scene as at run time: monocular depth in metres as
    guessed; views agree in scale, which matches would settle; true poses in view 0's unit."""
    depths = network.monocular_depth(tokens_of(network, batch), batch.Ks).depths[0].float()
    truth = batch.depths[0]
    ratios = [
        float((d[t > 0] / t[t > 0]).median()) if bool((t > 0).any()) else 1.0
        for d, t in zip(depths, truth, strict=True)
    ]
    same = torch.tensor([ratios[0] / r for r in ratios]).to(depths)
    viewmats = batch.viewmats[0].clone()
    viewmats[:, :3, 3] *= ratios[0]
    return depths * same[:, None, None], viewmats


def _write(path: Path, batch: PartBatch) -> None:
    tensors = {
        name: getattr(batch, name)
        .to(torch.float16 if name in ("atoms", "looks") else torch.float32)
        .contiguous()
        for name in _TENSORS
    }
    header = {
        "labels": [[label.name, label.group, list(label.words)] for label in batch.labels],
        "sizes": batch.sizes,
        "seeds": batch.seeds,
    }
    make_folder(path.parent)
    write_atomically(path, save(tensors, {"parts": json.dumps(header)}))


class PartSet:
    """All parts of some folders. What is drawn are rooms and photos, once cut as the network cuts and once
    by true masks."""

    def __init__(self, *folders: Path):
        """Raises:
        ValueError: the first folder holds no part file.
        """
        paths = [path for folder in folders for path in sorted(folder.glob("*.safetensors"))]
        if not any(path.parent == folders[0] for path in paths):
            raise ValueError(
                f"folder: expected parts in {folders[0]}, found none; run `langflash lab train parts`"
            )
        self.rooms = [room for path in paths for room in _read(path).rooms()]

    def __len__(self) -> int:
        return len(self.rooms)

    def draw(self, count: int, views: int, generator: torch.Generator) -> PartBatch:
        """Parts of `count` random rooms; a room's views are already joined, so `views` says nothing."""
        picked = torch.randint(len(self.rooms), (count,), generator=generator).tolist()
        return joined([self.rooms[i] for i in picked])

    def walk(self, count: int, *, views: int | None = None) -> Iterator[PartBatch]:
        """All rooms in order, `count` at a time."""
        for start in range(0, len(self.rooms), count):
            yield joined(self.rooms[start : start + count])

    def statistics(self) -> tuple[Tensor, Tensor]:
        """Mean and standard deviation of what the namer reads: looks, places, atoms."""
        every = joined(self.rooms)
        inputs = torch.cat((every.looks, every.places, every.atoms), 1)
        return inputs.mean(0), inputs.std(0).clamp_min(1e-3)


def joined(rooms: Sequence[PartBatch]) -> PartBatch:
    """Several rooms as one batch; `PartBatch.rooms` takes them apart again."""
    return _batch(
        [torch.cat([getattr(room, name) for room in rooms]) for name in _TENSORS],
        tuple(label for room in rooms for label in room.labels),
        tuple(size for room in rooms for size in room.sizes),
        tuple(seed for room in rooms for seed in room.seeds),
    )


def _read(path: Path) -> PartBatch:
    with safe_open(str(path), framework="pt") as file:
        header = json.loads(file.metadata()["parts"])
        tensors = [file.get_tensor(name).float() for name in _TENSORS]
    labels = tuple(Label(name, group, tuple(words)) for name, group, words in header["labels"])
    return _batch(tensors, labels, tuple(header["sizes"]), tuple(header["seeds"]))
