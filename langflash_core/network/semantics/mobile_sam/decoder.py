"""SAM's mask decoder: two layers in which prompts and picture look at each other, then masks as products.

Sizes: N prompts, T tokens each (1 of quality, 4 of masks, then the prompt's), L cells of the picture.
"""

import torch
from jaxtyping import Float
from torch import Tensor, nn
from torch.nn import functional as F

from langflash_core.network.encoders.mobile_sam import CHANNELS, ChannelNorm

_HEADS = 8
_HIDDEN = 2048
_MASKS = 4  # one for prompts that say enough, three for those that could mean more than one thing


class Attention(nn.Module):
    """Attention with a narrower inside."""

    def __init__(self, inner: int = CHANNELS // 2):
        super().__init__()
        self.q_proj, self.k_proj, self.v_proj = (nn.Linear(CHANNELS, inner) for _ in range(3))
        self.out_proj = nn.Linear(inner, CHANNELS)

    def forward(
        self, q: Float[Tensor, "N T 256"], k: Float[Tensor, "... L 256"], v: Float[Tensor, "... L 256"]
    ) -> Float[Tensor, "... T 256"]:
        asked, keys, values = (
            project(x).unflatten(-1, (_HEADS, -1)).transpose(1, 2)
            for project, x in ((self.q_proj, q), (self.k_proj, k), (self.v_proj, v))
        )
        return self.out_proj(F.scaled_dot_product_attention(asked, keys, values).transpose(1, 2).flatten(2))


class Hidden(nn.Module):
    """The two layers between attentions."""

    def __init__(self) -> None:
        super().__init__()
        self.lin1, self.lin2 = nn.Linear(CHANNELS, _HIDDEN), nn.Linear(_HIDDEN, CHANNELS)

    def forward(self, x: Float[Tensor, "*n C"]) -> Float[Tensor, "*n C"]:
        return self.lin2(self.lin1(x).relu())


class TwoWayBlock(nn.Module):
    """Tokens among themselves, tokens to cells, cells to tokens."""

    def __init__(self, first: bool):
        super().__init__()
        self.first = first
        self.self_attn = Attention(CHANNELS)
        self.cross_attn_token_to_image, self.cross_attn_image_to_token = Attention(), Attention()
        self.mlp = Hidden()
        self.norm1, self.norm2, self.norm3, self.norm4 = (nn.LayerNorm(CHANNELS) for _ in range(4))

    def forward(
        self,
        x: Float[Tensor, "N T 256"],
        cells: Float[Tensor, "... L 256"],
        asked: Float[Tensor, "N T 256"],
        where: Float[Tensor, "... L 256"],
    ) -> tuple[Tensor, Float[Tensor, "... L 256"]]:
        """Tokens x (N, T, 256) and cells (N, L, 256), with what they were at first and where they are."""
        if self.first:
            x = self.norm1(self.self_attn(x, x, x))
        else:
            x = self.norm1(x + self.self_attn(x + asked, x + asked, x))
        x = self.norm2(x + self.cross_attn_token_to_image(x + asked, cells + where, cells))
        x = self.norm3(x + self.mlp(x))
        cells = self.norm4(cells + self.cross_attn_image_to_token(cells + where, x + asked, x))
        return x, cells


class TwoWayTransformer(nn.Module):
    """Two such blocks, and a last look at the cells."""

    def __init__(self) -> None:
        super().__init__()
        self.layers = nn.ModuleList((TwoWayBlock(True), TwoWayBlock(False)))
        self.final_attn_token_to_image = Attention()
        self.norm_final_attn = nn.LayerNorm(CHANNELS)

    def forward(
        self,
        cells: Float[Tensor, "... L 256"],
        where: Float[Tensor, "... L 256"],
        asked: Float[Tensor, "N T 256"],
    ) -> tuple[Float[Tensor, "N T 256"], Float[Tensor, "N L 256"]]:
        x = asked
        for layer in self.layers:
            x, cells = layer(x, cells, asked, where)
        x = self.norm_final_attn(x + self.final_attn_token_to_image(x + asked, cells + where, cells))
        return x, cells


class Layers(nn.Module):
    """Three linear layers with ReLU between."""

    def __init__(self, after: int):
        super().__init__()
        self.layers = nn.ModuleList(
            (nn.Linear(CHANNELS, CHANNELS), nn.Linear(CHANNELS, CHANNELS), nn.Linear(CHANNELS, after))
        )

    def forward(self, x: Float[Tensor, "*n C"]) -> Float[Tensor, "*n D"]:
        first, second, last = self.layers
        return last(second(first(x).relu()).relu())


class MaskDecoder(nn.Module):
    """A picture's map and prompts to mask logits and predicted IoU."""

    def __init__(self) -> None:
        super().__init__()
        self.transformer = TwoWayTransformer()
        self.iou_token = nn.Embedding(1, CHANNELS)
        self.mask_tokens = nn.Embedding(_MASKS, CHANNELS)
        self.output_upscaling = nn.Sequential(
            nn.ConvTranspose2d(CHANNELS, CHANNELS // 4, 2, 2),
            ChannelNorm(CHANNELS // 4),
            nn.GELU(),
            nn.ConvTranspose2d(CHANNELS // 4, CHANNELS // 8, 2, 2),
            nn.GELU(),
        )
        self.output_hypernetworks_mlps = nn.ModuleList(Layers(CHANNELS // 8) for _ in range(_MASKS))
        self.iou_prediction_head = Layers(_MASKS)

    def forward(
        self,
        picture: Float[Tensor, "1 256 h w"],
        where: Float[Tensor, "1 256 h w"],
        tokens: Float[Tensor, "N P 256"],
        rough: Float[Tensor, "... 256 _ _"],
    ) -> tuple[Float[Tensor, "N 4 _ _"], Float[Tensor, "N 4"]]:
        """Logits (N, 4, 4h, 4w) and predicted IoU (N, 4).

        Args:
            picture: (1, 256, h, w). where: the same size, codes of places. tokens (N, P, 256) and rough
                (N or 1, 256, h or 1, w or 1): of `PromptEncoder`.
        """
        own = torch.cat((self.iou_token.weight, self.mask_tokens.weight))
        asked = torch.cat((own.expand(len(tokens), -1, -1), tokens), 1)
        size = picture.shape[-2:]
        cells = (picture + rough).expand(len(tokens), -1, -1, -1).flatten(2).transpose(1, 2)
        x, cells = self.transformer(cells, where.flatten(2).transpose(1, 2), asked)
        fine = self.output_upscaling(cells.transpose(1, 2).unflatten(2, size))
        heads = zip(self.output_hypernetworks_mlps, x[:, 1 : 1 + _MASKS].unbind(1), strict=True)
        directions = torch.stack([head(token) for head, token in heads], 1)
        return torch.einsum("nmc,nchw->nmhw", directions, fine), self.iou_prediction_head(x[:, 0])
