"""SAM's prompt encoder: points, boxes and rough masks to vectors that the decoder reads.

Sizes: N prompts of one picture, P points each; positions (x, y) in pixels of the padded square of side S.
"""

import math

import torch
from jaxtyping import Float, Int
from torch import Tensor, nn

from langflash_core.network.encoders.mobile_sam import CHANNELS, ChannelNorm

OUTSIDE, INSIDE, LEFT_TOP, RIGHT_BOTTOM, NO_POINT = 0, 1, 2, 3, -1
"""What a point says: not the thing, the thing, a corner of its box, nothing."""


class Frequencies(nn.Module):
    """Sines and cosines of random directions (Tancik et al. 2020)."""

    def __init__(self) -> None:
        super().__init__()
        self.register_buffer("positional_encoding_gaussian_matrix", torch.zeros(2, CHANNELS // 2))

    def forward(self, positions: Float[Tensor, "*n 2"]) -> Float[Tensor, "*n 256"]:
        """(..., 2) in [0, 1] to (..., 256)."""
        phases = 2 * math.pi * (2 * positions - 1) @ self.get_buffer("positional_encoding_gaussian_matrix")
        return torch.cat((phases.sin(), phases.cos()), -1)


class PromptEncoder(nn.Module):
    """Prompts to tokens (N, P, 256) and a map (N, 256, 1 or S/16, ...) that is added to the picture's."""

    def __init__(self) -> None:
        super().__init__()
        self.pe_layer = Frequencies()
        self.point_embeddings = nn.ModuleList(nn.Embedding(1, CHANNELS) for _ in range(4))
        self.not_a_point_embed = nn.Embedding(1, CHANNELS)
        self.no_mask_embed = nn.Embedding(1, CHANNELS)
        self.mask_downscaling = nn.Sequential(
            nn.Conv2d(1, 4, 2, 2),
            ChannelNorm(4),
            nn.GELU(),
            nn.Conv2d(4, 16, 2, 2),
            ChannelNorm(16),
            nn.GELU(),
            nn.Conv2d(16, CHANNELS, 1),
        )

    def points(
        self, positions: Float[Tensor, "N P 2"], says: Int[Tensor, "N P"], side: int
    ) -> Float[Tensor, "N _ 256"]:
        """Tokens of points (N, P, 2) and what each says (N, P)."""
        tokens = self.pe_layer((positions + 0.5) / side)
        tokens = tokens * (says != NO_POINT)[..., None]
        table = torch.cat(
            [e.get_parameter("weight") for e in (*self.point_embeddings, self.not_a_point_embed)]
        )
        return tokens + table[says]  # -1 is the last row

    def rough(self, logits: Float[Tensor, "N _ _"] | None) -> Float[Tensor, "_ 256 _ _"]:
        """The map of rough masks (N, S/4, S/4), or of none."""
        if logits is None:
            return self.no_mask_embed.weight[..., None, None]
        return self.mask_downscaling(logits[:, None])

    def grid(self, cells: int) -> Float[Tensor, "1 256 _ _"]:
        """Where the cells of a picture are, (1, 256, cells, cells)."""
        steps = (torch.arange(cells) + 0.5) / cells
        rows, columns = torch.meshgrid(steps, steps, indexing="ij")
        positions = torch.stack((columns, rows), -1).to(self.no_mask_embed.weight)
        return self.pe_layer(positions).movedim(-1, 0)[None]
