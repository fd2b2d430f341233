"""The late halves that learn from real photos: whole blocks while they learn, then cut to their rank.

Whole blocks learn more surely than a product of two thin matrices that starts at zero, and what they have
learned lies in few directions: of 384, the 52 that are kept name photos as well (model card).
"""

from collections.abc import Sequence
from typing import cast

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from langflash_core.network.encoders.late import LateHalf, take_own
from langflash_core.network.encoders.plain import (
    NORM_EPS,
    Block,
    LayerScale,
    PlainViT,
    attend,
    patch_tokens,
    through,
)
from langflash_core.network.guided import GuidedDepthNet
from langflash_core.network.presets import GuidedDepth

HALVES = ("late", "deep")
"""Of a network: names teach the one, depth the other."""
KEPT = 0.9
"""Of what a late half learned."""
SKIPPED = 0.1
"""Share of pictures that a branch of a block leaves as they are, while it learns."""


class SkippingBlock(Block):
    """A block whose branches leave out some pictures. Source: Huang et al. 2016 (stochastic depth)."""

    def forward(self, x: Tensor) -> Tensor:
        values = attend(self.attn.qkv(self.norm1(x)), self.attn.heads)
        x = x + self._some(_scaled(self.attn.proj, self.ls1, values))
        hidden = F.gelu(self.mlp.fc1(self.norm2(x)))
        return x + self._some(_scaled(self.mlp.fc2, self.ls2, hidden))

    def _some(self, change: Tensor) -> Tensor:
        if not self.training:
            return change
        kept = torch.rand(len(change), 1, 1) >= SKIPPED  # drawn where the run's generator is
        return change * (kept.to(change) / (1 - SKIPPED))


def _scaled(layer: nn.Linear, scale: LayerScale, x: Tensor) -> Tensor:
    """What a layer gives, times a scale a channel: of the matrix, which is smaller than what it gives."""
    return F.linear(x, scale.gamma[:, None] * layer.weight, scale.gamma * layer.bias)


class WholeLateHalf(nn.Module):
    """In the place of `LateHalf` while it learns: blocks of its own, as the encoder's to begin with."""

    def __init__(self, preset: GuidedDepth, given: int = 2):
        super().__init__()
        self.preset = preset
        self.first = preset.hooks[1] + 1
        self.hooks = tuple(hook - self.first for hook in preset.hooks[-given:])
        self.blocks = nn.ModuleList(
            SkippingBlock(preset.encoder_dim, preset.encoder_heads)
            for _ in range(self.first, preset.encoder_depth)
        )
        self.norm = nn.LayerNorm(preset.encoder_dim, NORM_EPS)

    def each(self) -> list[Block]:
        """Its blocks."""
        return [cast(Block, block) for block in self.blocks]

    def forward(self, early: Tensor, vit: PlainViT) -> tuple[Tensor, ...]:
        """As `LateHalf`; of `vit` nothing is read."""
        return tuple(patch_tokens(self.norm(x)) for x in through(self.blocks, early, self.hooks))


def make_whole(network: GuidedDepthNet) -> None:
    """Give a network whole blocks in both late halves, for as long as they learn."""
    for name in HALVES:
        setattr(network, name, whole(getattr(network, name), network.encoder.vit))


def make_cut(network: GuidedDepthNet, pictures: Sequence[Tensor] = ()) -> None:
    """Cut both late halves of a network to the rank of its preset, by what these read of `pictures`
    (1, 1, 3, H, W) in [0, 1], where there are any."""
    for name in HALVES:
        learned = getattr(network, name)
        seen = moments(learned, network, pictures) if pictures else None
        setattr(network, name, cut(learned, network.encoder.vit, learned.preset, seen))


Seen = list[list[Tensor]]
"""Of every block, second moments (n, n) float64 of what each of its four matrices reads."""


@torch.no_grad()
def moments(learned: WholeLateHalf, network: GuidedDepthNet, pictures: Sequence[Tensor]) -> Seen:
    """What the matrices of whole blocks read of some pictures, summed over tokens."""
    found: Seen = [[] for _ in learned.each()]
    device = next(learned.parameters()).device
    learned.eval()
    for picture in pictures:
        _, x = network.encoder(picture.to(device))
        for block, sums in zip(learned.each(), found, strict=True):
            read = block.norm1(x)
            values = attend(block.attn.qkv(read), block.attn.heads)
            x = x + block.ls1(block.attn.proj(values))
            wide = block.norm2(x)
            hidden = F.gelu(block.mlp.fc1(wide))
            x = x + block.ls2(block.mlp.fc2(hidden))
            own = [t.flatten(0, -2).double() for t in (read, values, wide, hidden)]
            own = [t.T @ t for t in own]
            sums[:] = [a + b for a, b in zip(sums, own, strict=True)] if sums else own
    return found


@torch.no_grad()
def whole(late: LateHalf, vit: PlainViT) -> WholeLateHalf:
    """The same half as whole blocks; every block starts as the encoder's plus its correction."""
    answer = WholeLateHalf(late.preset, len(late.hooks))
    answer.norm.load_state_dict(late.norm.state_dict())
    for own, (block, base) in zip(answer.each(), late.pairs(vit), strict=True):
        take_own(own, block)
        for (correction, layer), (_, learned) in zip(block.pairs(base), block.pairs(own), strict=True):
            learned.weight.copy_(correction.matrix(layer))
            learned.bias.copy_(correction.bias)
    return answer


@torch.no_grad()
def soften(learned: WholeLateHalf, vit: PlainViT, share: float = KEPT) -> None:
    """Take back 1 - share of what was learned, in place: what a few hundred photos taught holds a little
    better in other rooms (model card).

    Source: Wortsman et al. 2022 (WiSE-FT).
    """
    pairs = zip((*learned.each(), learned.norm), (*vit.blocks[learned.first :], vit.norm), strict=True)
    for own, base in pairs:
        for value, start in zip(own.parameters(), base.parameters(), strict=True):
            value.lerp_(start, 1 - share)


@torch.no_grad()
def cut(learned: WholeLateHalf, vit: PlainViT, preset: GuidedDepth, seen: Seen | None = None) -> LateHalf:
    """The half whose matrices differ from the encoder's by one of `preset.late_rank`, nearest in what they
    answer to what they read (`moments`), or nearest themselves where that is not known.

    Nearest answers keep twice as much: of .346 of the 37 classes whole blocks have, rank 52 keeps .342
    instead of .338 (MEASURED.md).

    Source: Eckart and Young 1936 (singular values); Yuan et al. 2023 (ASVD), Wang et al. 2024 (SVD-LLM): of
    the matrix times a root of the moments.
    """
    answer = LateHalf(preset, len(learned.hooks))
    answer.norm.load_state_dict(learned.norm.state_dict())
    for depth, (own, (block, base)) in enumerate(zip(learned.each(), answer.pairs(vit), strict=True)):
        take_own(block, own)
        pairs = zip(block.pairs(base), block.pairs(own), strict=True)
        for place, ((correction, layer), (_, new)) in enumerate(pairs):
            change = (new.weight - layer.weight).double()
            if seen is None:
                up, down = leading(change, preset.late_rank)
            else:
                up, down = nearest_answers(change, seen[depth][place], preset.late_rank)
            correction.up.copy_(up)
            correction.down.copy_(down)
            correction.bias.copy_(new.bias)
    return answer


def nearest_answers(change: Tensor, moments: Tensor, rank: int) -> tuple[Tensor, Tensor]:
    """The product (m, rank) (rank, n) whose answers lie nearest to a matrix's (m, n), over inputs of second
    moments (n, n); all float64.

    With moments R R^T the mean error of the answers is the norm of (change - product) R.
    """
    scale = moments.diagonal().mean()
    even = 1e-3 * torch.eye(len(moments), dtype=moments.dtype, device=moments.device)
    root = torch.linalg.cholesky(moments / scale + even)  # what is never read counts a thousandth
    up, down = leading(change @ root, rank)
    return up, torch.linalg.solve_triangular(root, down, upper=False, left=False)


def leading(change: Tensor, rank: int) -> tuple[Tensor, Tensor]:
    """The nearest matrix of a rank to one (m, n) in float64, as a product (m, rank) (rank, n) of two of equal
    weight. Off by 1e-8 of the largest singular value, below which its square drowns in rounding.

    Source: singular values of a matrix are the roots of its Gram matrix's eigenvalues, which take a third of
    the time.
    """
    if len(change) < change.shape[1]:
        up, down = leading(change.T, rank)
        return down.T, up.T
    v = torch.linalg.eigh(change.T @ change)[1][:, -rank:]  # (n, rank), the largest last
    up = change @ v  # columns of length s
    root = up.norm(dim=0).sqrt()
    return up / root.clamp_min(1e-150), root[:, None] * v.T
