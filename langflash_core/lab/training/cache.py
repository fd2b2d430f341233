"""Rendered rooms and their encoder tokens on disk: work that is done once, before training.

Rendering and encoding take turns in one single-threaded process; run one process per core
(`part`). Everything follows from the seeds, so an interrupted run continues where it stopped and
two runs write the same shards.
"""

import logging
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
import torch
from scipy.ndimage import distance_transform_edt
from torch import Tensor

from langflash_core.lab.rooms import TRAIN_LIBRARIES, Pack, RoomRenderer, RoomViews, staged_room
from langflash_core.lab.training.shards import NOTHING, Label, RoomRecord, quantise_tokens, write_shard
from langflash_core.network.encoders.shared import Encoder
from langflash_core.network.precision import mixed_precision
from langflash_core.types import LUMA

log = logging.getLogger(__name__)

HELD_OUT_SEED = 900_000_000
VALIDATION_SEED = 800_000_000
SIZES = ((224, 224), (252, 196), (252, 196), (196, 252), (224, 224), (252, 196), (196, 252), (294, 168))
"""(width, height) shard by shard: landscape as often as square, portrait less, wide least."""
OPENINGS = frozenset({"window", "door"})


@dataclass(frozen=True)
class CachePlan:
    """What is rendered: scenes `first_seed` to `first_seed + scenes - 1`, furnished from `libraries`.

    with_tokens False keeps pictures only (evaluation encodes itself). One shard in
    `three_view_every` holds three views a scene, the rest two; 0 means never. sizes: (width, height),
    shard by shard.
    """

    first_seed: int
    scenes: int
    libraries: tuple[str, ...] = TRAIN_LIBRARIES
    with_tokens: bool = True
    augment: bool = True
    scenes_per_shard: int = 32
    three_view_every: int = 4
    sizes: tuple[tuple[int, int], ...] = SIZES

    def shards(self) -> Iterator["ShardPlan"]:
        """The shards in order; each has one picture size and one number of views."""
        for index in range(-(-self.scenes // self.scenes_per_shard)):
            first = self.first_seed + index * self.scenes_per_shard
            count = min(self.scenes_per_shard, self.first_seed + self.scenes - first)
            three = self.three_view_every > 0 and index % self.three_view_every == self.three_view_every - 1
            yield ShardPlan(first, count, 3 if three else 2, self.sizes[index % len(self.sizes)])


@dataclass(frozen=True)
class ShardPlan:
    """One shard: seeds, views per scene, (width, height)."""

    first_seed: int
    count: int
    views: int
    size: tuple[int, int]

    @property
    def name(self) -> str:
        width, height = self.size
        return f"rooms_{self.first_seed:09d}_{self.views}v_{width}x{height}.safetensors"


RenderScene = Callable[[int, ShardPlan], RoomRecord]


def fill_cache(
    folder: Path,
    plan: CachePlan,
    render: RenderScene,
    encoder: Encoder | None,
    part: tuple[int, int] = (0, 1),
) -> int:
    """Write the missing shards of a plan; returns the number of scenes written.

    Args:
        render: seed, shard plan -> record without tokens (`rooms_renderer`).
        encoder: the frozen encoder; None where the plan keeps no tokens.
        part: (i, n) writes shard numbers i, i + n, ... so that n processes share a plan.

    Raises:
        ValueError: tokens are wanted but there is no encoder, or `part` is not i < n.
    """

    def drawn(shard: ShardPlan) -> Iterator[RoomRecord]:
        for seed in range(shard.first_seed, shard.first_seed + shard.count):
            record = render(seed, shard)
            yield replace(record, rgb=photometric(record.rgb, record.seed)) if plan.augment else record

    shards = ((folder / shard.name, partial(drawn, shard)) for shard in plan.shards())
    return fill_shards(shards, encoder, part, with_tokens=plan.with_tokens)


def fill_shards(
    shards: Iterable[tuple[Path, Callable[[], Iterable[RoomRecord]]]],
    encoder: Encoder | None,
    part: tuple[int, int],
    *,
    with_tokens: bool,
) -> int:
    """Write those that are missing, each of records without tokens; what `fill_cache` says.

    Raises:
        ValueError: tokens are wanted but there is no encoder, or `part` is not i < n.
    """
    if with_tokens and encoder is None:
        raise ValueError("encoder: expected the frozen encoder, received None")
    if not 0 <= part[0] < part[1]:
        raise ValueError(f"part: expected (i, n) with 0 <= i < n, received {part}")
    written = 0
    for path, drawn in list(shards)[part[0] :: part[1]]:
        if path.exists():
            continue
        records = [_encoded(record, encoder) if encoder and with_tokens else record for record in drawn()]
        write_shard(path, records)
        written += len(records)
        log.info("%s: %d scenes", path.name, len(records))
    return written


def _encoded(record: RoomRecord, encoder: Encoder) -> RoomRecord:
    steps, scales = quantise_tokens(encode_pictures(encoder, record.rgb))
    return replace(record, tokens=steps, token_scales=scales)


def encode_pictures(encoder: Encoder, rgb: Tensor) -> Tensor:
    """Hook tokens (V, L, T, C) float32 of pictures (V, 3, H, W) uint8, in bfloat16 where that is quick."""
    images = rgb.to(next(encoder.parameters()).device).float()[None] / 255
    with mixed_precision(images.device):
        hooks = encoder(images)[0].hooks
    return torch.stack([hook[0].float() for hook in hooks], 1).cpu()


def photometric(rgb: Tensor, seed: int) -> Tensor:
    """Grey pictures (15 %), and brightness, contrast and saturation shifted, alike in all views;
    in every second scene each view has an exposure of its own besides, as automatic cameras do.

    The generator already varies white balance, noise and blur; this only widens it, and teaches
    that colour may be missing. rgb (V, 3, H, W) uint8; the same seed gives the same result.
    """
    generator = torch.Generator().manual_seed(seed * 2 + 1)
    grey_draw, gain, contrast, saturation, own = torch.rand(5, generator=generator).tolist()
    images = rgb.float() / 255
    grey = (images * torch.tensor(LUMA)[:, None, None]).sum(1, keepdim=True)
    share = 0.0 if grey_draw < 0.15 else 0.7 + 0.6 * saturation
    images = grey + share * (images - grey)
    mean = images.mean()
    images = ((images - mean) * (0.85 + 0.3 * contrast) + mean) * (0.85 + 0.3 * gain)
    if own < 0.5:
        drift = 0.1 * torch.randn(len(images), generator=generator)
        images = images * drift.clamp(-0.25, 0.25).exp()[:, None, None, None]
    return (images.clamp(0, 1) * 255).round().to(torch.uint8)


def rooms_renderer(pack: Pack, renderer: RoomRenderer, libraries: tuple[str, ...]) -> RenderScene:
    """A `RenderScene` that draws rooms furnished from some libraries."""

    def render(seed: int, shard: ShardPlan) -> RoomRecord:
        width, height = shard.size
        sample = staged_room(
            seed, pack, renderer, num_views=shard.views, size=(height, width), libraries=libraries
        ).views
        return record_of(sample)

    return render


def fill_panes(ids: np.ndarray, openings: list[int]) -> np.ndarray:
    """Empty pixels of an instance map (H, W) given to the nearest opening: what is seen through a
    window is called window, as people do. Their depth stays unknown."""
    empty, frames = ids == NOTHING, np.isin(ids, openings)
    if not empty.any() or not frames.any():
        return ids
    nearest = np.empty((2, *ids.shape), dtype=np.int32)
    distance_transform_edt(~frames, return_distances=False, return_indices=True, indices=nearest)
    return np.where(empty, ids[nearest[0], nearest[1]], ids)


def record_of(sample: RoomViews) -> RoomRecord:
    """A rendered sample as it is stored: ids count from 0, and `NOTHING` marks empty pixels."""
    ids = sample.instances.astype(np.int64) - 1
    ids[ids < 0] = NOTHING
    openings = [k - 1 for k, group in enumerate(sample.groups) if group in OPENINGS]
    ids = np.stack([fill_panes(view, openings) for view in ids])
    labels = tuple(
        Label(names[0], group, tuple(n for n in names[1:] if n != group))
        for names, group in zip(sample.names[1:], sample.groups[1:], strict=True)
    )
    return RoomRecord(
        seed=sample.seed,
        rgb=torch.from_numpy(np.ascontiguousarray(sample.images.transpose(0, 3, 1, 2))),
        depths=torch.from_numpy(sample.depths).half(),
        instances=torch.from_numpy(ids.astype(np.uint8)),
        viewmats=torch.from_numpy(sample.viewmats),
        Ks=torch.from_numpy(sample.Ks),
        labels=labels,
    )
