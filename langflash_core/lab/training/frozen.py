"""What frozen networks say of the scenes that are drawn, kept on disk: the second time it is read.

For networks whose tokens no shard holds (`full`: encoder and decoder, and LSeg's features where a stage reads
them). A scene is known by its pixels and intrinsics, in the order of its views, and lies in a folder of the
networks' own numbers, so nothing stale is ever read. Numbers are kept as 8 bits with a scale a vector, a
relative error of about 0.7 %, and the first time they are used so, too: a run that goes on learns the same.

At 256 x 256 pixels tokens take 0.86 MB a view, features 8.4 MB. Sizes: B scenes, V views, T tokens, C
channels, h w of features.
"""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import torch
from safetensors.torch import load_file, save
from torch import Tensor

from langflash_core.base.files import make_folder, write_atomically
from langflash_core.lab.training.batches import Frozen, SceneBatch
from langflash_core.lab.training.mixing import ToldSet
from langflash_core.lab.training.shards import dequantise_tokens, quantise_tokens
from langflash_core.network.checkpoints.parts import digest
from langflash_core.network.encoders.shared import Tokens
from langflash_core.network.model import LangFlashNet

MODULES = ("encoder", "decoder", "grouping_encoder", "grouping_decoder", "language_head")
"""Whose answers are kept."""


@dataclass(frozen=True)
class FrozenSet(ToldSet):
    """A set whose batches bring what the network's frozen parts say of them. features: L(x), too."""

    network: LangFlashNet
    folder: Path
    features: bool = False

    @staticmethod
    def of(inner: Any, network: LangFlashNet, folder: Path, *, features: bool) -> "FrozenSet":
        """Kept below `folder`, in a folder of these networks' own."""
        own = {k: v for k, v in network.state_dict().items() if k.partition(".")[0] in MODULES}
        return FrozenSet(inner, network, folder / digest(own), features)

    def told(self, batch: SceneBatch) -> SceneBatch:
        paths = [self._path(image, K) for image, K in zip(batch.images, batch.Ks, strict=True)]
        missing = [row for row, path in enumerate(paths) if not path.is_file()]
        if missing:
            self._write([paths[row] for row in missing], batch.images[missing], batch.Ks[missing])
        patch = self.network.preset.patch
        grid = (batch.size[0] // patch, batch.size[1] // patch)
        return replace(batch, frozen=_joined([load_file(path) for path in paths], grid))

    def _path(self, images: Tensor, Ks: Tensor) -> Path:
        content = hashlib.blake2b(digest_size=16)
        for part in (images, Ks):
            content.update(part.contiguous().numpy().data)
        name = content.hexdigest() + ("_features" if self.features else "")
        return self.folder / name[:2] / f"{name}.safetensors"

    @torch.no_grad()
    def _write(self, paths: Sequence[Path], images: Tensor, Ks: Tensor) -> None:
        device = next(self.network.parameters()).device
        images, Ks = images.to(device), Ks.to(device)
        tokens = self.network.encode(images, Ks)
        said = {f"hook{n}": hook for n, hook in enumerate(tokens.hooks)}
        said |= {f"grouped{n}": hook for n, hook in enumerate(tokens.grouped)}
        if self.features:
            said["features"] = self.network.language(tokens, images).movedim(2, -1)
        for row, path in enumerate(paths):
            tensors = {}
            for name, values in said.items():
                steps, scales = quantise_tokens(values[row].cpu())
                tensors |= {name: steps.contiguous(), f"{name}_scales": scales.contiguous()}
            make_folder(path.parent)
            write_atomically(path, save(tensors))


def _joined(scenes: Sequence[Mapping[str, Tensor]], grid: tuple[int, int]) -> Frozen:
    """What is kept of B scenes."""
    said = {
        name: torch.stack([dequantise_tokens(scene[name], scene[f"{name}_scales"]) for scene in scenes])
        for name in scenes[0]
        if not name.endswith("_scales")
    }
    hooks, grouped = (
        tuple(said[f"{kind}{n}"] for n in range(sum(name.startswith(kind) for name in said)))
        for kind in ("hook", "grouped")
    )
    features = said["features"].movedim(-1, 2) if "features" in said else None
    return Frozen(Tokens(hooks, grid, grouped=grouped), features)
