"""SAM's dense embedding, which the map that masks are read from regresses (L_SG), kept on disk.

The teacher is frozen and sees each view alone, so what it says of a picture is computed once and kept on disk
by the picture's pixels, 8 bits a number with a scale a cell: a relative error of about 0.7 %, and 1 MB a view
where the longer side is brought to 1024 pixels.

Sizes: B scenes, V views, h w the teacher's grid.
"""

import hashlib
from dataclasses import dataclass, replace
from pathlib import Path

import torch
from safetensors.torch import load_file, save
from torch import Tensor

from langflash_core.base.files import make_folder, write_atomically
from langflash_core.lab.training.batches import SceneBatch
from langflash_core.lab.training.mixing import ToldSet
from langflash_core.lab.training.shards import dequantise_tokens, quantise_tokens
from langflash_core.network.encoders.mobile_sam import MobileSamEncoder


@dataclass(frozen=True)
class DenseSet(ToldSet):
    """A set whose batches bring SAM's embedding of their views. folder: where it is kept."""

    teacher: MobileSamEncoder
    folder: Path

    def told(self, batch: SceneBatch) -> SceneBatch:
        dense = [self._of(image) for image in batch.images.flatten(0, 1)]
        return replace(batch, dense=torch.stack(dense).unflatten(0, batch.images.shape[:2]))

    def _of(self, image: Tensor) -> Tensor:
        """(256, h, w) of a picture (3, H, W) in [0, 1]."""
        key = hashlib.blake2b(image.contiguous().numpy().data, digest_size=16).hexdigest()
        path = self.folder / str(self.teacher.side) / key[:2] / f"{key}.safetensors"
        if not path.is_file():
            said = self.teacher.dense(image[None].to(self.teacher.device))[0].cpu()
            steps, scales = quantise_tokens(said.movedim(0, -1))
            make_folder(path.parent)
            write_atomically(path, save({"dense": steps.contiguous(), "scales": scales.contiguous()}))
        kept = load_file(path)
        return dequantise_tokens(kept["dense"], kept["scales"]).movedim(-1, 0)
