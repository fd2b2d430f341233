"""CLIP as the encoder of objects: each mask's surroundings cut out, as its own space has them."""

from collections.abc import Sequence

import numpy as np
import torch
from jaxtyping import Bool, Float, UInt8
from torch import Tensor

from langflash_core.language.clip import DIMENSION, load_clip, load_clip_images
from langflash_core.network.semantics.crops import crop_atoms


class ClipCrops:
    """open_clip's ViT-B/32 on cut-outs."""

    space, dimension = "clip", DIMENSION

    def __init__(self, source: str | None = None) -> None:
        """Reads the weights.

        Args:
            source: a file or a tag of open_clip; None: where `language.clip` looks.

        Raises:
            WeightsError: there are none. MissingPackageError: open_clip is not installed.
        """
        self._pictures, self._phrases = load_clip_images(source), load_clip(source)

    def embed(
        self, image: UInt8[np.ndarray, "H W 3"], masks: Bool[np.ndarray, "N H W"]
    ) -> Float[Tensor, "N C"]:
        """Unit vectors of square cut-outs around masks."""
        photo = torch.from_numpy(image).movedim(-1, 0).float() / 255
        return crop_atoms(torch.from_numpy(masks)[None].float(), [photo], self._pictures.encode)

    def texts(self, phrases: Sequence[str]) -> Float[Tensor, "P C"]:
        """Of the same model's text tower."""
        return self._phrases.encode(phrases)
