"""Batches of cached scenes: pictures, truth and dequantised tokens of one shape.

Sizes as in `shards`: B scenes, V views, H W pixels.
"""

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, replace
from pathlib import Path

import torch
from torch import Tensor

from langflash_core.geometry.cameras import invert_rigid
from langflash_core.lab.training.shards import Label, RoomRecord, Shard, dequantise_tokens, open_shards
from langflash_core.network.encoders.shared import Tokens
from langflash_core.network.presets import MINI


@dataclass(frozen=True)
class Frozen:
    """What networks that do not learn say of B scenes: tokens, and language features L(x) (B, V, C, h, w), or
    None where a stage does not read these."""

    tokens: Tokens
    features: Tensor | None = None

    def to(self, device: str | torch.device) -> "Frozen":
        features = None if self.features is None else self.features.to(device)
        return Frozen(self.tokens.each(lambda hook: hook.to(device)), features)

    def scene(self, index: int) -> "Frozen":
        """Of one scene, B = 1."""
        features = None if self.features is None else self.features[index : index + 1]
        return Frozen(self.tokens.scene(index), features)


@dataclass(frozen=True)
class SceneBatch:
    """images (B, V, 3, H, W) in [0, 1]; depths (B, V, H, W) metres, 0 = nothing; instances
    (B, V, H, W) int64, 255 = nothing; viewmats (B, V, 4, 4), world = view 0; Ks (B, V, 3, 3)
    pixels; tokens of the frozen encoder, or None; labels per scene; seeds (B); partly: what no instance
    claims is something that nobody has named, not nothing; dense (B, V, 256, h, w): SAM's embedding, or
    None; vectors: per scene those of its instances (M, C), where they were collected, else None; frozen: what
    networks that do not learn say of the scenes, where it is kept."""

    images: Tensor
    depths: Tensor
    instances: Tensor
    viewmats: Tensor
    Ks: Tensor
    tokens: Tokens | None
    labels: tuple[tuple[Label, ...], ...]
    seeds: tuple[int, ...]
    partly: bool = False
    dense: Tensor | None = None
    vectors: tuple[Tensor | None, ...] = ()
    frozen: Frozen | None = None

    @property
    def size(self) -> tuple[int, int]:
        """(height, width)."""
        return self.images.shape[-2], self.images.shape[-1]

    def to(self, device: str | torch.device) -> "SceneBatch":
        tokens = self.tokens
        if tokens is not None:
            tokens = tokens.each(lambda hook: hook.to(device))
        return replace(
            self,
            images=self.images.to(device),
            depths=self.depths.to(device),
            instances=self.instances.to(device),
            viewmats=self.viewmats.to(device),
            Ks=self.Ks.to(device),
            tokens=tokens,
            dense=None if self.dense is None else self.dense.to(device),
            frozen=None if self.frozen is None else self.frozen.to(device),
        )


def collate(records: Sequence[RoomRecord]) -> SceneBatch:
    """Records of one shape and number of views -> a batch; poses become relative to view 0.

    Raises:
        ValueError: no records.
    """
    if not records:
        raise ValueError("records: expected at least one, received none")
    viewmats = torch.stack([r.viewmats for r in records])
    return SceneBatch(
        images=torch.stack([r.rgb for r in records]).float() / 255,
        depths=torch.stack([r.depths for r in records]).float(),
        instances=torch.stack([r.instances for r in records]).long(),
        viewmats=viewmats @ invert_rigid(viewmats[:, :1]),
        Ks=torch.stack([r.Ks for r in records]),
        tokens=_tokens(records),
        labels=tuple(r.labels for r in records),
        seeds=tuple(r.seed for r in records),
    )


def _tokens(records: Sequence[RoomRecord]) -> Tokens | None:
    if records[0].tokens is None:
        return None
    height, width = records[0].rgb.shape[-2:]
    steps = torch.stack([r.tokens for r in records if r.tokens is not None])
    scales = torch.stack([r.token_scales for r in records if r.token_scales is not None])
    hooks = dequantise_tokens(steps, scales).unbind(2)  # (B, V, T, C) each
    return Tokens(hooks, (height // MINI.patch, width // MINI.patch))


class RoomSet:
    """All scenes of a folder of shards; draws random batches or walks through them in order."""

    def __init__(self, folder: Path, *, limit: int | None = None, partly: bool = False, tokens: bool = True):
        """limit: use only the first so many scenes. partly: they are labelled in part, as photos are.
        tokens: read the cached ones, too, where there are any.

        Raises:
            ValueError: the folder holds no shard.
        """
        self.folder, self.partly, self.tokens = folder, partly, tokens
        self.shards = open_shards(folder)
        self._keep([(shard, i) for shard in self.shards for i in range(len(shard))][:limit])

    def __len__(self) -> int:
        return len(self.entries)

    def labels(self) -> list[Label]:
        """Every label of every scene, repeated as often as it occurs."""
        return [
            Label(name, group, tuple(words))
            for shard, i in self.entries
            for name, group, words in shard.scenes[i]["labels"]
        ]

    def part(self, number: int, count: int) -> "RoomSet":
        """Every `count`-th scene from `number` on: those of one of so many batches of a step. Where there are
        fewer scenes than batches, all."""
        if len(self) < count:
            return self
        mine = copy(self)
        mine._keep(self.entries[number::count])
        return mine

    def _keep(self, entries: list[tuple[Shard, int]]) -> None:
        self.entries = entries
        self._by_shape: dict[tuple[int, int, int], list[int]] = {}
        for row, (shard, _) in enumerate(entries):
            self._by_shape.setdefault((shard.views, shard.height, shard.width), []).append(row)

    def draw(self, count: int, views: int, generator: torch.Generator) -> SceneBatch:
        """`count` random scenes of one random shape, `views` random views of each in random order.

        Scenes with fewer views than asked for give all they have; shapes are drawn in proportion
        to their scenes.
        """
        shapes = list(self._by_shape)
        usable = [s for s in shapes if s[0] >= views] or shapes
        sizes = torch.tensor([float(len(self._by_shape[s])) for s in usable])
        shape = usable[int(torch.multinomial(sizes, 1, generator=generator))]
        rows = self._by_shape[shape]
        picked = torch.randint(len(rows), (count,), generator=generator).tolist()
        records = []
        for row in picked:
            shard, index = self.entries[rows[row]]
            order = torch.randperm(shape[0], generator=generator)[: min(views, shape[0])].tolist()
            records.append(shard.record(index, views=order, with_tokens=self.tokens))
        return replace(collate(records), partly=self.partly)

    def walk(self, count: int, *, views: int | None = None):
        """All scenes in order, `count` at a time, never mixing shapes; the first `views` views."""
        for (available, _, _), rows in self._by_shape.items():
            order = list(range(min(views or available, available)))
            for start in range(0, len(rows), count):
                entries = [self.entries[row] for row in rows[start : start + count]]
                records = [s.record(i, views=order, with_tokens=self.tokens) for s, i in entries]
                yield replace(collate(records), partly=self.partly)
