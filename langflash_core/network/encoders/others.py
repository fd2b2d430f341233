"""What other networks see of a photo: maps of DeepLab and MOSAIC, side by side.

Both are frozen. They learned from other photos than ours, and from layers of their own, so that they err
elsewhere than our own encoder, and than each other.

Sizes: n pictures, h w a quarter of the sides at which they are seen.
"""

import torch
from jaxtyping import Float
from torch import Tensor, nn
from torch.nn import functional as F

from langflash_core.network.encoders import deeplab, mosaic
from langflash_core.network.encoders.deeplab import DeepLab
from langflash_core.network.encoders.mosaic import Mosaic

CHANNELS = deeplab.CHANNELS + mosaic.CHANNELS
"""Of the maps, DeepLab's first."""
SIDE = 378
"""Pixels to which a picture's longer side is brought (MEASURED.md)."""


class OtherEyes(nn.Module):
    """Pictures of any size -> maps of both networks, at a quarter of `SIDE`."""

    def __init__(self) -> None:
        super().__init__()
        self.deeplab = DeepLab()
        self.mosaic = Mosaic()

    def forward(self, pictures: Float[Tensor, "n 3 H W"]) -> Float[Tensor, "n C h w"]:
        """Maps (n, 576, h, w), 0 or more, of pictures (n, 3, H, W) in [0, 1]."""
        own = resize_pictures(pictures)
        first = self.deeplab(own)
        size = (first.shape[-2], first.shape[-1])
        second = F.interpolate(self.mosaic(own), size, mode="bilinear", align_corners=False)
        return torch.cat((first, second), 1)


def resize_pictures(pictures: Float[Tensor, "n 3 H W"]) -> Float[Tensor, "n 3 _ _"]:
    """Pictures (n, 3, H, W) as they are seen: the longer side is `SIDE`."""
    height, width = pictures.shape[-2:]
    scale = SIDE / max(height, width)
    size = (max(1, round(scale * height)), max(1, round(scale * width)))
    shrinks = scale < 1
    return F.interpolate(pictures, size, mode="bicubic", align_corners=False, antialias=shrinks).clamp(0, 1)
