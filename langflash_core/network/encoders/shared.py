"""The shared image encoder: pictures in, tokens of four blocks out. Run once, read by all heads."""

from dataclasses import dataclass

import torch
from torch import Tensor, nn

from langflash_core.network.encoders.plain import PlainViT
from langflash_core.network.presets import GuidedDepth

_MEAN = (0.485, 0.456, 0.406)
_STD = (0.229, 0.224, 0.225)


@dataclass(frozen=True)
class Tokens:
    """Encoder tokens of V views: four hooks (B, V, h*w, C), after the final norm; grid (h, w)."""

    hooks: tuple[Tensor, ...]
    grid: tuple[int, int]

    @property
    def shape(self) -> tuple[int, int]:
        """(B, V)."""
        return self.hooks[0].shape[0], self.hooks[0].shape[1]

    def maps(self, index: int) -> Tensor:
        """Hook `index` as feature maps (B*V, C, h, w)."""
        return tokens_to_maps(self.hooks[index].flatten(0, 1), self.grid)

    def scene(self, index: int) -> "Tokens":
        """Those of one scene of the batch, B = 1."""
        return Tokens(tuple(hook[index : index + 1] for hook in self.hooks), self.grid)


def tokens_to_maps(tokens: Tensor, grid: tuple[int, int]) -> Tensor:
    """(n, h*w, C) -> (n, C, h, w)."""
    return tokens.transpose(1, 2).unflatten(2, grid)


class Encoder(nn.Module):
    """A plain ViT, frozen: sides are multiples of the patch, any aspect ratio."""

    def __init__(self, preset: GuidedDepth):
        super().__init__()
        self.patch = preset.patch
        self.hook_blocks = preset.hooks
        self.vit = PlainViT(preset)
        self.requires_grad_(False).eval()

    def train(self, mode: bool = True) -> "Encoder":
        """Stays in evaluation mode: the encoder is frozen."""
        return super().train(False)

    @torch.no_grad()
    def forward(self, images: Tensor) -> Tokens:
        """Tokens of images (B, V, 3, H, W) in [0, 1]."""
        mean, std = (images.new_tensor(values)[:, None, None] for values in (_MEAN, _STD))
        flat = (images.flatten(0, 1) - mean) / std
        maps = self.vit(flat, self.hook_blocks)
        batch, num_views, _, height, width = images.shape
        hooks = tuple(m.unflatten(0, (batch, num_views)) for m in maps)
        return Tokens(hooks, (height // self.patch, width // self.patch))
