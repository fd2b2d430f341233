"""Two-stack decoder (views look at each other) and the Siamese decoder of the semantic branch."""

import torch
from torch import Tensor, nn

from langflash_core.network.attention import CrossBlock, SelfBlock, rope_2d
from langflash_core.network.encoder import Tokens
from langflash_core.network.presets import Preset


def normalised_intrinsics(Ks: Tensor, width: int, height: int) -> Tensor:
    """K (..., 3, 3) in pixels -> (..., 9): row 0 over width, row 1 over height, row-major."""
    size = torch.tensor([width, height, 1.0]).to(Ks)
    return (Ks / size[:, None]).flatten(-2)


class TwoStackDecoder(nn.Module):
    """View 0 through the first stack, every other view through the second.

    Each layer reads the previous layer's tokens of all *other* views; a single view reads
    itself. One intrinsics token per view rides along and is dropped at the end.

    Source: the paper's decoder, after DUSt3R (Wang et al. 2024) and NoPoSplat (Ye et al. 2025).
    """

    def __init__(self, preset: Preset):
        super().__init__()
        dim, heads = preset.decoder_dim, preset.decoder_heads
        self.head_dim, self.base, self.patch = dim // heads, preset.rope_base, preset.patch
        self.embed = nn.Linear(preset.encoder_dim, dim)
        self.intrinsics = nn.Linear(9, dim)
        self.first = nn.ModuleList(CrossBlock(dim, heads) for _ in range(preset.decoder_depth))
        self.other = nn.ModuleList(CrossBlock(dim, heads) for _ in range(preset.decoder_depth))
        self.norm = nn.LayerNorm(dim)

    def forward(self, tokens: Tokens, Ks: Tensor) -> tuple[Tensor, Tensor]:
        """Tokens (B, V, h*w, C) after half of the layers and after the last.

        Args:
            tokens: of the encoder; the last hook is decoded.
            Ks: (B, V, 3, 3), pixels of the encoded images.
        """
        height, width = (side * self.patch for side in tokens.grid)
        camera = self.intrinsics(normalised_intrinsics(Ks, width, height))[:, :, None]
        x = torch.cat((self.embed(tokens.hooks[-1]), camera), 2)  # (B, V, n + 1, C)
        code = rope_2d(tokens.grid, self.head_dim, self.base, extra=1).to(x.device)
        middle = x
        for depth, (first, other) in enumerate(zip(self.first, self.other, strict=True)):
            x = self._layer(x, code, first, other)
            if depth + 1 == len(self.first) // 2:
                middle = x
        return middle[:, :, :-1], self.norm(x)[:, :, :-1]

    @staticmethod
    def _layer(x: Tensor, code: Tensor, first: nn.Module, other: nn.Module) -> Tensor:
        num_views = x.shape[1]
        memory_code = code.repeat(1, max(num_views - 1, 1), 1)
        outputs = []
        for view in range(num_views):
            others = [v for v in range(num_views) if v != view] or [view]
            memory = x[:, others].flatten(1, 2)
            outputs.append((other if view else first)(x[:, view], memory, code, memory_code))
        return torch.stack(outputs, 1)


class SiameseDecoder(nn.Module):
    """The same self-attention stack for every view: tokens of the semantic branch."""

    def __init__(self, preset: Preset):
        super().__init__()
        dim, heads = preset.decoder_dim, preset.decoder_heads
        self.head_dim, self.base = dim // heads, preset.rope_base
        self.embed = nn.Linear(preset.encoder_dim, dim)
        self.blocks = nn.ModuleList(SelfBlock(dim, heads) for _ in range(preset.semantic_depth))
        self.norm = nn.LayerNorm(dim)

    def forward(self, tokens: Tokens) -> tuple[Tensor, Tensor]:
        """Tokens (B, V, h*w, C) after half of the layers and after the last."""
        x = self.embed(tokens.hooks[-1]).flatten(0, 1)
        code = rope_2d(tokens.grid, self.head_dim, self.base).to(x.device)
        middle = x
        for depth, block in enumerate(self.blocks):
            x = block(x, code)
            if depth + 1 == len(self.blocks) // 2:
                middle = x
        return tuple(t.unflatten(0, tokens.shape) for t in (middle, self.norm(x)))
