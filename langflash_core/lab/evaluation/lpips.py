"""LPIPS, how far apart two pictures look. Its weights are not shipped: name a file that holds them.

The file: `features.{0,2,...,28}.{weight,bias}` of VGG-16 and `lin{0..4}.model.1.weight` of the five heads.
Source: Zhang et al. 2018, "The Unreasonable Effectiveness of Deep Features as a Perceptual Metric", v0.1.
"""

from collections.abc import Iterator
from pathlib import Path

import torch
from safetensors.torch import load_file
from torch import Tensor
from torch.nn import functional as F

from langflash_core.errors import WeightsError
from langflash_core.network.checkpoints.parts import digest

_BLOCKS = ((0, 2), (5, 7), (10, 12, 14), (17, 19, 21), (24, 26, 28))
_MEAN, _DEVIATION = (-0.030, -0.088, -0.188), (0.458, 0.448, 0.450)


class Lpips:
    """The distance with VGG-16; 0 for equal pictures, about .7 for pictures of different things. digest: of
    its weights."""

    def __init__(self, path: Path) -> None:
        """Read the weights.

        Raises:
            WeightsError: the file cannot be read, or holds something else.
        """
        needed = [f"features.{i}.{part}" for block in _BLOCKS for i in block for part in ("weight", "bias")]
        needed += [f"lin{level}.model.1.weight" for level in range(len(_BLOCKS))]
        try:
            stored = load_file(path)
        except Exception as error:  # safetensors' own exception and OSError
            raise WeightsError(f"{path} is no safetensors file; name LPIPS weights of VGG-16") from error
        missing = [name for name in needed if name not in stored]
        if missing:
            raise WeightsError(f"{path} holds no {missing[0]}; name LPIPS weights of VGG-16")
        self._weights = {name: stored[name].float() for name in needed}
        self.digest = digest(self._weights)

    @torch.no_grad()
    def maps(self, left: Tensor, right: Tensor) -> Tensor:
        """Distance per pixel (B, H, W) of pictures (B, H, W, 3) in [0, 1], each level upsampled."""
        height, width = left.shape[1:3]
        total = left.new_zeros(len(left), height, width)
        for distance in self._levels(left, right):
            total += F.interpolate(distance, size=(height, width), mode="bilinear", align_corners=False)[:, 0]
        return total

    @torch.no_grad()
    def whole(self, left: Tensor, right: Tensor) -> list[float]:
        """The published distance of pictures (B, H, W, 3) in [0, 1], one number a pair: each level's mean,
        added up, which is not quite the mean of `maps`."""
        total = sum(distance.mean((1, 2, 3)) for distance in self._levels(left.clamp(0, 1), right))
        return torch.as_tensor(total).tolist()

    def _levels(self, left: Tensor, right: Tensor) -> Iterator[Tensor]:
        """Distance (B, 1, h, w) of every level, finest first."""
        both = torch.cat((left, right)).permute(0, 3, 1, 2) * 2 - 1
        both = (both - both.new_tensor(_MEAN)[:, None, None]) / both.new_tensor(_DEVIATION)[:, None, None]
        for level, block in enumerate(_BLOCKS):
            both = F.max_pool2d(both, 2) if level else both
            for layer in block:
                weight, bias = (self._weights[f"features.{layer}.{part}"] for part in ("weight", "bias"))
                both = F.relu(F.conv2d(both, weight, bias, padding=1))
            units = both / (both.norm(dim=1, keepdim=True) + 1e-10)
            first, second = units.chunk(2)
            yield F.conv2d((first - second) ** 2, self._weights[f"lin{level}.model.1.weight"])

    def __call__(self, drawn: Tensor, truth: Tensor, counted: Tensor) -> list[float]:
        """Mean over the pixels that count, one number a picture; the others are given the truth, so that
        they say nothing.

        Args:
            drawn, truth: (B, H, W, 3). counted: (B, H, W) bool, at least one in each picture.
        """
        filled = torch.where(counted[..., None], drawn.clamp(0, 1), truth)
        return [float(map[mask].mean()) for map, mask in zip(self.maps(filled, truth), counted, strict=True)]
