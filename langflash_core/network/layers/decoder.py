"""Two-stack decoder (views look at each other) and the Siamese decoder of the semantic branch."""

from collections.abc import Iterator, Sequence
from typing import cast

import torch
from jaxtyping import Float
from torch import Tensor, nn

from langflash_core.network.encoders.shared import Tokens
from langflash_core.network.layers.attention import CrossBlock, Memory, SelfBlock, rope_2d
from langflash_core.network.presets import GuidedDepth, Preset

Readings = Sequence[Sequence[int]]
"""Of each view the others that it reads, at least one."""


def normalised_intrinsics(Ks: Float[Tensor, "... 3 3"], width: int, height: int) -> Float[Tensor, "... 9"]:
    """K (..., 3, 3) in pixels -> (..., 9): row 0 over width, row 1 over height, row-major."""
    size = torch.tensor([width, height, 1.0]).to(Ks)
    return (Ks / size[:, None]).flatten(-2)


class TwoStacks(nn.Module):
    """View 0 through the first stack, every other view through the second.

    Each layer reads the previous layer's tokens of all *other* views; a single view reads
    itself.

    Source: the paper's decoder, after DUSt3R (Wang et al. 2024) and NoPoSplat (Ye et al. 2025).
    """

    def __init__(self, preset: Preset, eps: float = 1e-5):
        super().__init__()
        dim, heads, depth = preset.decoder_dim, preset.decoder_heads, preset.decoder_depth
        self.head_dim, self.base, self.patch = dim // heads, preset.rope_base, preset.patch
        self.embed = nn.Linear(preset.encoder_dim, dim)
        self.first = nn.ModuleList(CrossBlock(dim, heads, eps) for _ in range(depth))
        self.other = nn.ModuleList(CrossBlock(dim, heads, eps) for _ in range(depth))
        self.norm = nn.LayerNorm(dim, eps)

    def layers(
        self, x: Float[Tensor, "..."], grid: tuple[int, int], read: Readings | None = None
    ) -> list[Float[Tensor, "..."]]:
        """What every layer gives, the last one normalised, from embedded tokens (B, V, h*w + 1, C);
        the last token of a view is the one of its intrinsics. read: which others each view reads; None:
        all."""
        code = rope_2d(grid, self.head_dim, self.base, extra=1).to(x.device)
        given = []
        for first, other in zip(self.first, self.other, strict=True):
            x = self._layer(x, code, cast(CrossBlock, first), cast(CrossBlock, other), read)
            given.append(x)
        return [*given[:-1], self.norm(x)]

    @staticmethod
    def _layer(
        x: Tensor, code: Tensor, first: CrossBlock, other: CrossBlock, read: Readings | None
    ) -> Tensor:
        seen = x[:, 1:] if x.shape[1] > 1 else x
        if read is not None:
            seen = x[:, list(read[0])]
        memory = first.memory(seen.flatten(1, 2), code.repeat(1, seen.shape[1], 1))
        outputs = [first(x[:, 0], memory, code)]
        memories = _memories(x, code, other) if read is None else _chosen_memories(x, code, other, read)
        for view, memory in enumerate(memories, start=1):
            outputs.append(other(x[:, view], memory, code))
        return torch.stack(outputs, 1)


def _memories(x: Tensor, code: Tensor, block: CrossBlock) -> Iterator[Memory]:
    """What each view but the first reads of all others, from tokens (B, V, m, C).

    Keys and values are made once, not once a reader. They lie there twice, so that all views but one are a
    slice of that ring; attention does not mind their order.
    """
    num_views, length = x.shape[1], x.shape[2]
    if num_views == 2:
        yield block.memory(x[:, 0], code)
    if num_views < 3:
        return
    keys, values = block.memory(x.flatten(1, 2), code.repeat(1, num_views, 1))
    keys, values = torch.cat((keys, keys), 2), torch.cat((values, values), 2)
    for view in range(1, num_views):
        others = slice((view + 1) * length, (view + num_views) * length)
        yield keys[:, :, others], values[:, :, others]


def _chosen_memories(x: Tensor, code: Tensor, block: CrossBlock, read: Readings) -> Iterator[Memory]:
    """What each view but the first reads of those it reads: keys and values are made once a view that is
    read."""
    keys, values = block.memory(x.flatten(1, 2), code.repeat(1, x.shape[1], 1))
    keys, values = (of.unflatten(2, (x.shape[1], x.shape[2])) for of in (keys, values))
    for others in read[1:]:
        yield keys[:, :, list(others)].flatten(2, 3), values[:, :, list(others)].flatten(2, 3)


class TwoStackDecoder(TwoStacks):
    """The stacks behind an encoder that knows no intrinsics: their token joins here."""

    def __init__(self, preset: Preset):
        super().__init__(preset)
        self.intrinsics = nn.Linear(9, preset.decoder_dim)
        # Called so in weights files: before depth had a half of its own it read that of names.
        self.embed_named = nn.Linear(preset.encoder_dim, preset.decoder_dim, bias=False)
        nn.init.zeros_(self.embed_named.weight)

    def forward(
        self, tokens: Tokens, Ks: Float[Tensor, "B V 3 3"], read: Readings | None = None
    ) -> tuple[Float[Tensor, "B V n C"], Float[Tensor, "B V n C"]]:
        """Tokens (B, V, h*w, C) after half of the layers and after the last.

        Args:
            tokens: of the encoder; the last hook is decoded, and what depth of real photos taught beside it.
            Ks: (B, V, 3, 3), pixels of the encoded images.
            read: which others each view reads; None: all.
        """
        height, width = (side * self.patch for side in tokens.grid)
        camera = self.intrinsics(normalised_intrinsics(Ks, width, height))[:, :, None]
        seen = self.embed(tokens.hooks[-1]) + self.embed_named(tokens.deep[-1])
        given = self.layers(torch.cat((seen, camera), 2), tokens.grid, read)
        middle = given[max(len(given) // 2, 1) - 1]
        return middle[:, :, :-1], given[-1][:, :, :-1]


class SiameseDecoder(nn.Module):
    """The same self-attention stack for every view: tokens of the semantic branch."""

    def __init__(self, preset: GuidedDepth):
        super().__init__()
        dim, heads = preset.decoder_dim, preset.decoder_heads
        self.head_dim, self.base = dim // heads, preset.rope_base
        self.embed = nn.Linear(preset.encoder_dim, dim)
        self.blocks = nn.ModuleList(SelfBlock(dim, heads) for _ in range(preset.semantic_depth))
        self.norm = nn.LayerNorm(dim)

    def forward(self, tokens: Tokens) -> tuple[Float[Tensor, "B V n C"], Float[Tensor, "B V n C"]]:
        """Tokens (B, V, h*w, C) after half of the layers and after the last."""
        x = self.embed(tokens.hooks[-1]).flatten(0, 1)
        code = rope_2d(tokens.grid, self.head_dim, self.base).to(x.device)
        middle = x
        for depth, block in enumerate(self.blocks):
            x = block(x, code)
            if depth + 1 == len(self.blocks) // 2:
                middle = x
        return tuple(t.unflatten(0, tokens.shape) for t in (middle, self.norm(x)))
