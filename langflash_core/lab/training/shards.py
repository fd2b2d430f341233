"""Shards of rendered scenes with cached encoder tokens: one safetensors file per shard.

Sizes: S scenes in a shard (all of one shape), V views, L hooked encoder blocks, T tokens of a
picture (the class token first where the encoder has one), C channels.

    rgb (S, V, 3, H, W) uint8            depths (S, V, H, W) float16, z, metres, 0 = nothing
    instances (S, V, H, W) uint8         255 = nothing; otherwise an index into the scene's labels
    viewmats (S, V, 4, 4), Ks (S, V, 3, 3) float32
    tokens (S, V, L, T, C) int8          token_scales (S, V, L, T) float16: token = int8 * scale

Tokens are frozen, so they are computed once. Eight bits a value with one scale per token costs a
relative error of about 0.7 % and halves what has to pass through memory. Labels and seeds are
JSON in the file's header. A shard is written whole or not at all.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save_file
from torch import Tensor

from langflash_core.base.files import written_atomically

NOTHING = 255


@dataclass(frozen=True)
class Label:
    """What one instance is called: catalogue name, class group, further names and phrases."""

    name: str
    group: str
    words: tuple[str, ...] = ()


@dataclass(frozen=True)
class RoomRecord:
    """One rendered scene as it goes into a shard; shapes as in the module's docstring, less S.

    tokens and token_scales are None in sets that are only evaluated.
    """

    seed: int
    rgb: Tensor
    depths: Tensor
    instances: Tensor
    viewmats: Tensor
    Ks: Tensor
    labels: tuple[Label, ...]
    tokens: Tensor | None = None
    token_scales: Tensor | None = None


def quantise_tokens(tokens: Tensor) -> tuple[Tensor, Tensor]:
    """Tokens (..., C) as int8 and one float16 scale each; the error is at most half a step.

    Raises:
        ValueError: a token is not finite.
    """
    tokens = tokens.float()
    if not bool(torch.isfinite(tokens).all()):
        raise ValueError("tokens: expected finite values, received NaN or infinity")
    scales = (tokens.abs().amax(-1) / 127).clamp_min(1e-6).half()
    steps = (tokens / scales.float()[..., None]).round().clamp(-127, 127)
    return steps.to(torch.int8), scales


def dequantise_tokens(steps: Tensor, scales: Tensor) -> Tensor:
    """Tokens (..., C) float32 of `quantise_tokens`."""
    return steps.float() * scales.float()[..., None]


def write_shard(path: Path, records: Sequence[RoomRecord]) -> None:
    """Write scenes of one shape atomically.

    Raises:
        ValueError: no scene, or scenes of different shapes.
    """
    if not records:
        raise ValueError("records: expected at least one scene, received none")
    shapes = {tuple(record.rgb.shape) for record in records}
    if len(shapes) > 1:
        raise ValueError(f"records: expected scenes of one shape, received {sorted(shapes)}")
    tensors = {
        field: torch.stack([getattr(record, field) for record in records]).contiguous()
        for field in _fields(records[0])
    }
    header = [
        {"seed": record.seed, "labels": [[lb.name, lb.group, list(lb.words)] for lb in record.labels]}
        for record in records
    ]
    with written_atomically(path, SafetensorError) as temporary:
        save_file(tensors, temporary, metadata={"scenes": json.dumps(header)})


def _fields(record: RoomRecord) -> tuple[str, ...]:
    always = ("rgb", "depths", "instances", "viewmats", "Ks")
    return always if record.tokens is None else (*always, "tokens", "token_scales")


class Shard:
    """A shard opened for reading; scenes are read one by one through the memory map."""

    def __init__(self, path: Path):
        self.path = path
        self._file = safe_open(str(path), framework="pt")
        self.scenes: list[dict] = json.loads(self._file.metadata()["scenes"])
        shape = self._file.get_slice("rgb").get_shape()
        self.views, self.height, self.width = shape[1], shape[3], shape[4]
        self._keys = tuple(self._file.keys())

    def __len__(self) -> int:
        return len(self.scenes)

    def record(
        self, index: int, *, views: Sequence[int] | None = None, with_tokens: bool = True
    ) -> RoomRecord:
        """Scene `index`, restricted to `views` in the order given.

        Raises:
            ValueError: the index is outside the shard.
        """
        if not 0 <= index < len(self):
            raise ValueError(f"index: expected 0 to {len(self) - 1}, received {index}")
        chosen = list(range(self.views)) if views is None else list(views)
        wanted = [k for k in self._keys if with_tokens or not k.startswith("token")]
        tensors = {}
        for key in wanted:
            part = self._file.get_slice(key)
            tensors[key] = torch.stack([part[index : index + 1, v : v + 1][0, 0] for v in chosen])
        scene = self.scenes[index]
        labels = tuple(Label(name, group, tuple(words)) for name, group, words in scene["labels"])
        return RoomRecord(seed=int(scene["seed"]), labels=labels, **tensors)


def open_shards(folder: Path) -> list[Shard]:
    """Every shard of a folder, in name order.

    Raises:
        ValueError: the folder holds none.
    """
    shards = [Shard(path) for path in sorted(folder.glob("*.safetensors"))]
    if not shards:
        raise ValueError(
            f"folder: expected shards (*.safetensors) in {folder}, found none; "
            "run `langflash lab train cache`"
        )
    return shards
