"""The plain vision transformer that `mini` builds on, frozen: pictures to tokens.

n pictures of H x W pixels, a grid of h x w patches, C channels.
"""

from collections.abc import Iterable, Sequence

import torch
from jaxtyping import Float
from torch import Tensor, nn
from torch.nn import functional as F

from langflash_core.network.layers.draws import draw_normal
from langflash_core.network.presets import GuidedDepth

NORM_EPS = 1e-6
PREFIX = 1  # tokens before those of patches: the class token, and R more of an encoder with R registers
_FIRST_SCALE = 1e-5  # of what a fresh block adds, as the paper of layer scale has it


class PlainViT(nn.Module):
    """A ViT whose blocks scale what they add, as DINOv2 has it; any picture of whole patches.

    Its tensors have the names of the published files (`blocks.0.attn.qkv.weight`). The learned
    position codes are resized bicubically, smoothed where the grid is smaller than the trained one.

    Source: Dosovitskiy et al. 2021; Touvron et al. 2021 (layer scale); Oquab et al. 2023 (DINOv2).
    Twin: timm's vit_small_patch14_dinov2, tests/network/test_plain.py.
    """

    def __init__(self, preset: GuidedDepth):
        super().__init__()
        dim, heads = preset.encoder_dim, preset.encoder_heads
        self.trained_grid = preset.trained_grid
        self.cls_token = nn.Parameter(torch.zeros(1, 1, dim))
        self.pos_embed = nn.Parameter(draw_normal(1, preset.trained_grid**2 + 1, dim, std=0.02))
        self.patch_embed = _Patches(dim, preset.patch)
        self.blocks = nn.ModuleList(Block(dim, heads) for _ in range(preset.encoder_depth))
        self.norm = nn.LayerNorm(dim, NORM_EPS)

    def forward(self, images: Float[Tensor, "n 3 H W"], hooks: Sequence[int]) -> list[Float[Tensor, "n T C"]]:
        """Normed tokens (n, h*w, C) after every hooked block, class token left out; images (n, 3, H, W)."""
        return [patch_tokens(self.norm(x)) for x in self.states(images, hooks)]

    def states(self, images: Float[Tensor, "n 3 H W"], hooks: Sequence[int]) -> list[Float[Tensor, "n T C"]]:
        """What every hooked block hands on, (n, 1 + h*w, C), class token first."""
        maps = self.patch_embed(images)
        tokens = maps.flatten(2).transpose(1, 2)
        x = torch.cat((self.cls_token.expand(len(tokens), -1, -1), tokens), 1)
        return through(self.blocks, x + self._codes((maps.shape[-2], maps.shape[-1])), hooks)

    def _codes(self, grid: tuple[int, int]) -> Tensor:
        side = self.trained_grid
        if grid == (side, side):
            return self.pos_embed
        learned = self.pos_embed[:, 1:].unflatten(1, (side, side)).permute(0, 3, 1, 2)
        resized = F.interpolate(learned, size=grid, mode="bicubic", antialias=True)
        return torch.cat((self.pos_embed[:, :1], resized.permute(0, 2, 3, 1).flatten(1, 2)), 1)


def patch_tokens(x: Float[Tensor, "n T C"]) -> Float[Tensor, "n _ C"]:
    """Those of the h*w patches alone, of all that a block hands on."""
    return x[:, PREFIX:]


def attend(qkv: Float[Tensor, "n T D"], heads: int) -> Float[Tensor, "n T C"]:
    """Values (n, T, C) that every head gathers; qkv (n, T, 3 C): queries, keys and values."""
    q, k, v = qkv.unflatten(-1, (3, heads, -1)).permute(2, 0, 3, 1, 4)
    return F.scaled_dot_product_attention(q, k, v).transpose(1, 2).flatten(2)


def through(
    blocks: Iterable[nn.Module], x: Float[Tensor, "N T C"], hooks: Sequence[int]
) -> list[Float[Tensor, "N T C"]]:
    """What the hooked ones of `blocks` hand on; x (n, 1 + h*w, C)."""
    given = []
    for depth, block in enumerate(blocks):
        x = block(x)
        if depth in hooks:
            given.append(x)
    return given


class _Patches(nn.Module):
    def __init__(self, dim: int, patch: int):
        super().__init__()
        self.proj = nn.Conv2d(3, dim, patch, patch)

    def forward(self, images: Tensor) -> Tensor:
        """(n, C, h, w)."""
        return self.proj(images)


class _Attention(nn.Module):
    """Queries, keys and values from one matrix."""

    def __init__(self, dim: int, heads: int):
        super().__init__()
        self.heads = heads
        self.qkv, self.proj = nn.Linear(dim, 3 * dim), nn.Linear(dim, dim)

    def forward(self, x: Tensor) -> Tensor:
        return self.proj(attend(self.qkv(x), self.heads))


class _MLP(nn.Module):
    def __init__(self, dim: int):
        super().__init__()
        self.fc1, self.fc2 = nn.Linear(dim, 4 * dim), nn.Linear(4 * dim, dim)

    def forward(self, x: Tensor) -> Tensor:
        return self.fc2(F.gelu(self.fc1(x)))


class LayerScale(nn.Module):
    """A learned factor for every channel."""

    def __init__(self, dim: int):
        super().__init__()
        self.gamma = nn.Parameter(torch.full((dim,), _FIRST_SCALE))

    def forward(self, x: Float[Tensor, "N T C"]) -> Float[Tensor, "N T C"]:
        return x * self.gamma


class Block(nn.Module):
    """Attention and a two-layer network, each scaled and added to what it reads."""

    def __init__(self, dim: int, heads: int):
        super().__init__()
        self.norm1, self.norm2 = nn.LayerNorm(dim, NORM_EPS), nn.LayerNorm(dim, NORM_EPS)
        self.attn, self.mlp = _Attention(dim, heads), _MLP(dim)
        self.ls1, self.ls2 = LayerScale(dim), LayerScale(dim)

    def forward(self, x: Float[Tensor, "N T C"]) -> Float[Tensor, "N T C"]:
        x = x + self.ls1(self.attn(self.norm1(x)))
        return x + self.ls2(self.mlp(self.norm2(x)))
