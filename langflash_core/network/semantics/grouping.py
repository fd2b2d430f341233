"""Semantic grouping: N learned queries read all views and become K <= N masks.

B batch, V views, N queries, d channels. Source: the paper's grouping decoder, after DETR
(Carion et al. 2020) and Mask2Former (Cheng et al. 2022).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import cast

import torch
from jaxtyping import Float, Int
from torch import Tensor, nn
from torch.nn import functional as F

from langflash_core.network.encoders.shared import Tokens, tokens_to_maps
from langflash_core.network.layers.attention import MLP, QueryBlock
from langflash_core.network.layers.dpt import DPT
from langflash_core.network.layers.draws import draw_normal
from langflash_core.network.presets import Preset
from langflash_core.network.prior import resize


@dataclass(frozen=True)
class Groups:
    """mask_logits (B, V, N, h, w) at the scratch head's size; existence_logits (B, N)."""

    mask_logits: Float[Tensor, "B V N h w"]
    existence_logits: Float[Tensor, "B N"]


def sinusoid(length: int, dim: int, *, like: Float[Tensor, "..."], start: int = 0) -> Float[Tensor, "n C"]:
    """1-D code (length, dim) of the running position from `start` on. Source: Vaswani et al. 2017."""
    rates = 10_000.0 ** (-torch.arange(0, dim, 2, device=like.device, dtype=torch.float32) / dim)
    places = torch.arange(start, start + length, device=like.device, dtype=torch.float32)
    angles = places[:, None] * rates
    return torch.stack((angles.sin(), angles.cos()), -1).flatten(1).to(like.dtype)


class ScratchHead(nn.Module):
    """DPT over shallow encoder tokens and Siamese tokens, with the RGB shortcut.

    Gives the memories that the queries read (path_4, path_3, path_2) and the finest map
    that masks are read from.
    """

    def __init__(self, preset: Preset):
        super().__init__()
        e, d, f = preset.encoder_dim, preset.decoder_dim, preset.dpt_feature
        self.dpt = DPT((e, e, d, d), preset.dpt_dims, f)
        self.shortcut = nn.Conv2d(3, f, 7, padding=3)
        self.mix = nn.Conv2d(f, f, 3, padding=1)

    def forward(
        self,
        tokens: Tokens,
        siamese: tuple[Float[Tensor, "B V n C"], Float[Tensor, "B V n C"]],
        images: Float[Tensor, "B V 3 H W"],
    ) -> tuple[tuple[Float[Tensor, "_ _ _ _"], ...], Float[Tensor, "_ _ h w"]]:
        """Memories (B*V, f, s*h, s*w) for s = 1, 2, 4, and the finest map (B*V, f, 8h, 8w)."""
        deep = tuple(tokens_to_maps(t.flatten(0, 1), tokens.grid) for t in siamese)
        paths = self.dpt((tokens.maps(0), tokens.maps(1), *deep))
        pictures = resize(images.flatten(0, 1), paths.path_1.shape[-2:]) * 2 - 1
        finest = self.mix(F.relu(paths.path_1 + self.shortcut(pictures)))
        return (paths.path_4, paths.path_3, paths.path_2), finest


class SemanticGrouping(nn.Module):
    """Queries -> masks over all views and an existence score each."""

    def __init__(self, preset: Preset):
        super().__init__()
        dim, f = preset.grouping_dim, preset.dpt_feature
        self.patterns = nn.Parameter(draw_normal(preset.num_queries, dim))
        self.positions = nn.Parameter(draw_normal(preset.num_queries, dim))
        self.memories = nn.ModuleList(nn.Conv2d(f, dim, 1) for _ in range(3))
        self.layers = nn.ModuleList(
            QueryBlock(dim, preset.grouping_heads) for _ in range(preset.grouping_layers)
        )
        self.norm = nn.LayerNorm(dim)
        self.mask_mlp = MLP(dim, dim, f)
        self.existence = nn.Linear(dim, 1)

    def forward(
        self, memories: tuple[Float[Tensor, "n _ _ _"], ...], finest: Float[Tensor, "n C h w"], num_views: int
    ) -> tuple[Groups, ...]:
        """Groups after every second layer (one per scale); the last entry is the answer.

        Layers read the scales coarse to fine in order; the first half of the layers at the
        coarsest, and so on (two layers each for six).
        """
        batch = finest.shape[0] // num_views
        queries = self.patterns.expand(batch, -1, -1)
        answers = []
        per_scale = len(self.layers) // len(memories)
        for scale, (project, maps) in enumerate(zip(self.memories, memories, strict=True)):
            memory = project(maps).flatten(2).transpose(1, 2).unflatten(0, (batch, num_views)).flatten(1, 2)
            code = sinusoid(memory.shape[1], memory.shape[2], like=memory)
            for layer in self.layers[scale * per_scale : (scale + 1) * per_scale]:
                queries = layer(queries, memory, self.positions, code)
            answers.append(self._read_groups(queries, finest.unflatten(0, (batch, num_views))))
        return tuple(answers)

    def of_many(self, memories: Sequence[tuple[Float[Tensor, "_ _ _ _"], ...]]) -> Float[Tensor, "1 N d"]:
        """What the queries (1, N, d) come to by the memories of one scene's views, group after group of them.

        But for rounding what `forward` reads its last masks from (`masks`); one group's keys are held at a
        time.
        """
        queries = self.patterns.expand(1, -1, -1)
        per_scale = len(self.layers) // len(self.memories)
        for number, layer in enumerate(self.layers):
            scale = number // per_scale
            codes = self._encode_memories(self.memories[scale], [maps[scale] for maps in memories])
            queries = cast(QueryBlock, layer).in_turn(queries, codes, self.positions)
        return queries

    @staticmethod
    def _encode_memories(project: nn.Module, groups: Sequence[Tensor]) -> Iterator[tuple[Tensor, Tensor]]:
        """Memories (1, m, d) of groups of maps (v, f, h, w), and the codes of their running positions."""
        start = 0
        for maps in groups:
            memory = project(maps).flatten(2).transpose(1, 2).flatten(0, 1)[None]
            yield memory, sinusoid(memory.shape[1], memory.shape[2], like=memory, start=start)
            start += memory.shape[1]

    def masks(self, queries: Float[Tensor, "1 N d"], finest: Float[Tensor, "n C h w"]) -> Groups:
        """What the queries (1, N, d) answer in some views, whose finest maps are (v, f, h, w)."""
        return self._read_groups(queries, finest[None])

    def _read_groups(self, queries: Tensor, finest: Tensor) -> Groups:
        x = self.norm(queries)
        logits = torch.einsum("bnf,bvfhw->bvnhw", self.mask_mlp(x), finest) / finest.shape[2] ** 0.5
        return Groups(logits.float(), self.existence(x)[..., 0].float())


def surviving(groups: Groups, tau_exist: float) -> Int[Tensor, " K"]:
    """Indices (K,) of the queries of one scene (B = 1) that exist and claim some pixel.

    Query n survives where e_n > tau_exist and max_x p_n(x) > tau_exist. Source: the paper, 3.2.
    """
    return surviving_of([groups.mask_logits[0].amax((0, 2, 3))], groups.existence_logits[0], tau_exist)


def surviving_of(
    strongest: Sequence[Float[Tensor, " n"]], existence: Float[Tensor, " n"], tau_exist: float
) -> Int[Tensor, " K"]:
    """`surviving` by the largest mask logits (N,) of each group of views and the existence logits (N,)."""
    highest = torch.sigmoid(torch.stack(list(strongest)).amax(0))
    return ((torch.sigmoid(existence) > tau_exist) & (highest > tau_exist)).nonzero()[:, 0]


def group_weights(
    groups: Groups, survivors: Int[Tensor, " K"], size: tuple[int, int]
) -> Float[Tensor, "V K H W"]:
    """w_k(x), (V, K, H, W): softmax over the survivors' logits of one scene, at pixel size."""
    logits = groups.mask_logits[0, :, survivors]
    if len(survivors) == 0:
        return logits.new_zeros(logits.shape[0], 0, *size)
    return resize(logits, size).softmax(1)
