"""The encoder's late half twice more, corrected by what real photos taught: by names, and by depth.

Stereo and grouping go on reading the tokens they were trained on; names, and depth beside its own, read
these, each those of a half of its own, so that neither moves the other. All share the early blocks: a photo
costs half an encoder more for each.
"""

from dataclasses import replace
from typing import cast

import torch
from jaxtyping import Float
from torch import Tensor, nn
from torch.nn import functional as F

from langflash_core.network.encoders.plain import NORM_EPS, Block, LayerScale, PlainViT, attend, patch_tokens
from langflash_core.network.encoders.shared import Tokens
from langflash_core.network.presets import GuidedDepth

_OWN = ("norm1.weight", "norm1.bias", "norm2.weight", "norm2.bias", "ls1.gamma", "ls2.gamma")
"""What a block has for itself."""


@torch.no_grad()
def take_own(block: nn.Module, other: nn.Module) -> None:
    """Give a block the norms and layer scales of another, corrected or whole."""
    for name in _OWN:
        block.get_parameter(name).copy_(other.get_parameter(name))


class LateHalf(nn.Module):
    """Blocks after the second hook whose matrices are the encoder's plus one of rank `late_rank`; norms,
    biases and layer scales are their own. It gives the last `given` hooks.

    Whole blocks would be three times as large; what was learned fits into few directions.

    Source: Hu et al. 2022 (LoRA). How they are found: `lab/training/late.py`.
    """

    def __init__(self, preset: GuidedDepth, given: int = 2):
        super().__init__()
        self.preset = preset
        self.first = preset.hooks[1] + 1
        self.hooks = tuple(hook - self.first for hook in preset.hooks[-given:])
        self.blocks = nn.ModuleList(
            CorrectedBlock(preset.encoder_dim, preset.encoder_heads, preset.late_rank)
            for _ in range(self.first, preset.encoder_depth)
        )
        self.norm = nn.LayerNorm(preset.encoder_dim, NORM_EPS)

    @torch.no_grad()
    def begin(self, vit: PlainViT) -> None:
        """Give the encoder's own tokens, until something is learned."""
        self.norm.load_state_dict(vit.norm.state_dict())
        for block, base in self.pairs(vit):
            take_own(block, base)
            for correction, layer in block.pairs(base):
                correction.up.zero_()
                correction.down.zero_()
                correction.bias.copy_(layer.bias)

    def pairs(self, vit: PlainViT) -> list[tuple["CorrectedBlock", Block]]:
        """Every block, and the encoder's beside which it stands."""
        pairs = zip(self.blocks, vit.blocks[self.first :], strict=True)
        return [(cast(CorrectedBlock, own), cast(Block, base)) for own, base in pairs]

    def forward(self, early: Float[Tensor, "n T C"], vit: PlainViT) -> tuple[Float[Tensor, "n _ C"], ...]:
        """Normed tokens (n, h*w, C) of each hook; early (n, 1 + h*w, C): of `vit.states`."""
        given, x = [], early
        for depth, (own, block) in enumerate(self.pairs(vit)):
            x = own(x, block)
            if depth in self.hooks:
                given.append(patch_tokens(self.norm(x)))
        return tuple(given)


def with_taught(
    tokens: Tokens, early: Float[Tensor, "n T C"], vit: PlainViT, late: nn.Module, deep: nn.Module | None
) -> Tokens:
    """Tokens of the encoder with those of both halves that photos taught, `late` names and `deep` depth
    (None: nobody asks for depth); early (B*V, 1 + h*w, C): of `vit.states`."""
    named, far = (
        () if half is None else tuple(t.unflatten(0, tokens.shape) for t in half(early, vit))
        for half in (late, deep)
    )
    return replace(tokens, named=named, deep=far)


class CorrectedBlock(nn.Module):
    """A block beside one of the encoder's."""

    def __init__(self, dim: int, heads: int, rank: int):
        super().__init__()
        self.heads = heads
        self.norm1, self.norm2 = nn.LayerNorm(dim, NORM_EPS), nn.LayerNorm(dim, NORM_EPS)
        self.ls1, self.ls2 = LayerScale(dim), LayerScale(dim)
        self.qkv, self.proj = Correction(dim, 3 * dim, rank), Correction(dim, dim, rank)
        self.fc1, self.fc2 = Correction(dim, 4 * dim, rank), Correction(4 * dim, dim, rank)

    def pairs(self, base: Block) -> list[tuple["Correction", nn.Linear]]:
        """Every correction, and the layer of a block that it corrects."""
        return [
            (self.qkv, base.attn.qkv),
            (self.proj, base.attn.proj),
            (self.fc1, base.mlp.fc1),
            (self.fc2, base.mlp.fc2),
        ]

    def forward(self, x: Float[Tensor, "N T C"], base: Block) -> Float[Tensor, "N T C"]:
        values = attend(self.qkv(self.norm1(x), base.attn.qkv), self.heads)
        x = x + self.ls1(self.proj(values, base.attn.proj))
        hidden = F.gelu(self.fc1(self.norm2(x), base.mlp.fc1))
        return x + self.ls2(self.fc2(hidden, base.mlp.fc2))


class Correction(nn.Module):
    """y = (W + U D) x + b, with W of another layer."""

    def __init__(self, inputs: int, outputs: int, rank: int):
        super().__init__()
        self.down = nn.Parameter(torch.zeros(rank, inputs))
        self.up = nn.Parameter(torch.zeros(outputs, rank))
        self.bias = nn.Parameter(torch.zeros(outputs))

    def forward(self, x: Float[Tensor, "N T C"], base: nn.Linear) -> Float[Tensor, "N T D"]:
        return F.linear(x, self.matrix(base), self.bias)

    def matrix(self, base: nn.Linear) -> Float[Tensor, "outputs inputs"]:
        """W + U D, (outputs, inputs)."""
        return base.weight + self.up @ self.down
