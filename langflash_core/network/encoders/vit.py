"""Vision transformers of the paper's size: with rotary codes (geometry), with a class token (LSeg).

B batch, V views, n tokens, C channels; a picture of H x W pixels has a grid of h x w patches.
"""

import torch
from jaxtyping import Float
from torch import Tensor, nn
from torch.nn import functional as F

from langflash_core.network.layers.attention import SelfBlock, rope_2d
from langflash_core.network.layers.decoder import normalised_intrinsics
from langflash_core.network.presets import LSegSizes, PointMaps


def centre_images(images: Float[Tensor, "*n 3 H W"]) -> Float[Tensor, "*n 3 H W"]:
    """Images in [0, 1] -> [-1, 1], as all published networks of this preset read them."""
    return images * 2 - 1


class RotaryEncoder(nn.Module):
    """Pictures and their intrinsics -> tokens. Place is told by rotary codes alone.

    The intrinsics K, normalised by the picture's size, are one more token, at row h, column 0;
    it stays with the view through the decoder.

    Source: Weinzaepfel et al. 2023 (CroCo v2); the token: Ye et al. 2025 (NoPoSplat).
    """

    def __init__(self, preset: PointMaps):
        super().__init__()
        dim, heads = preset.encoder_dim, preset.encoder_heads
        self.patch_size, self.base, self.head_dim = preset.patch, preset.rope_base, dim // heads
        self.patch = nn.Conv2d(3, dim, preset.patch, preset.patch)
        self.intrinsics = nn.Linear(9, dim)
        self.blocks = nn.ModuleList(
            SelfBlock(dim, heads, preset.norm_eps) for _ in range(preset.encoder_depth)
        )
        self.norm = nn.LayerNorm(dim, preset.norm_eps)

    def forward(self, images: Float[Tensor, "B V 3 H W"], Ks: Float[Tensor, "B V 3 3"]) -> Tensor:
        """(B, V, h*w + 1, C) from images (B, V, 3, H, W) in [0, 1] and Ks (B, V, 3, 3), pixels."""
        height, width = images.shape[-2:]
        patches = self.patch(centre_images(images.flatten(0, 1))).flatten(2).transpose(1, 2)
        camera = self.intrinsics(normalised_intrinsics(Ks, width, height)).flatten(0, 1)
        x = torch.cat((patches, camera[:, None]), 1)
        grid = (height // self.patch_size, width // self.patch_size)
        code = rope_2d(grid, self.head_dim, self.base, extra=1).to(x.device)
        for block in self.blocks:
            x = block(x, code)
        return self.norm(x).unflatten(0, images.shape[:2])


class ClassTokenEncoder(nn.Module):
    """A plain ViT with a class token and learned position codes, read after some blocks.

    Source: Dosovitskiy et al. 2021; the codes are resized bilinearly, as in LSeg.
    """

    def __init__(self, sizes: LSegSizes):
        super().__init__()
        self.hooks, self.trained_grid = sizes.hooks, sizes.trained_grid
        self.patch = nn.Conv2d(3, sizes.dim, sizes.patch, sizes.patch)
        self.class_token = nn.Parameter(torch.zeros(1, 1, sizes.dim))
        self.places = nn.Parameter(torch.zeros(1, sizes.trained_grid**2 + 1, sizes.dim))
        self.blocks = nn.ModuleList(SelfBlock(sizes.dim, sizes.heads, 1e-6) for _ in range(sizes.depth))

    def forward(self, images: Float[Tensor, "n 3 H W"]) -> tuple[Float[Tensor, "n T C"], ...]:
        """Tokens (n, 1 + h*w, C) after every hook, class token first; images (n, 3, H, W) in [-1, 1]."""
        maps = self.patch(images)
        x = torch.cat((self.class_token.expand(len(maps), -1, -1), maps.flatten(2).transpose(1, 2)), 1)
        x = x + self._codes((maps.shape[-2], maps.shape[-1]))
        given = []
        for depth, block in enumerate(self.blocks):
            x = block(x)
            if depth in self.hooks:
                given.append(x)
        return tuple(given)

    def _codes(self, grid: tuple[int, int]) -> Tensor:
        side = self.trained_grid
        learned = self.places[:, 1:].transpose(1, 2).unflatten(2, (side, side))
        resized = F.interpolate(learned, size=grid, mode="bilinear", align_corners=False)
        return torch.cat((self.places[:, :1], resized.flatten(2).transpose(1, 2)), 1)
