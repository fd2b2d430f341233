"""Semantic grouping as LangFlash's authors released it: one more refinement of masks per layer.

The queries of `grouping.SemanticGrouping` with three differences that fix the shape of the published
weights: two scratch heads (one for view 0, one for all others) on the decoder's tokens, at the
picture's full size; attention without biases; and mask logits that add up over the layers.

B batch, V views, N queries, f channels of the mask map. Source: the paper, and its public demo.
"""

import torch
from jaxtyping import Float, Shaped
from torch import Tensor, nn
from torch.nn import functional as F

from langflash_core.network.encoders.shared import Tokens
from langflash_core.network.encoders.vit import centre_images
from langflash_core.network.layers.attention import MLP, QueryBlock
from langflash_core.network.layers.dpt import DPT, double
from langflash_core.network.layers.draws import draw_normal
from langflash_core.network.presets import MaskFilter, PointMaps
from langflash_core.network.semantics.grouping import Groups, sinusoid


class FullSizeScratch(nn.Module):
    """DPT over encoder and decoder tokens with the RGB shortcut at full size, for one view."""

    def __init__(self, preset: PointMaps):
        super().__init__()
        e, d, f = preset.encoder_dim, preset.decoder_dim, preset.dpt_feature
        self.dpt = DPT((e, d, d, d), preset.dpt_dims, f, align_corners=True)
        self.shortcut = nn.Conv2d(3, f, 7, padding=3)

    def forward(
        self,
        levels: tuple[
            Float[Tensor, "n _ _ _"],
            Float[Tensor, "n _ _ _"],
            Float[Tensor, "n _ _ _"],
            Float[Tensor, "n _ _ _"],
        ],
        images: Float[Tensor, "n 3 H W"],
    ) -> tuple[Float[Tensor, "n _ _ _"], ...]:
        """path_4, path_3, path_2 (n, f, s*h, s*w) for s = 1, 2, 4, and the mask map (n, f, H, W)."""
        paths = self.dpt(levels)
        finest = double(paths.path_1, align_corners=True) + F.relu(self.shortcut(centre_images(images)))
        return paths.path_4, paths.path_3, paths.path_2, finest


class ScratchPair(nn.ModuleList):
    """The scratch head of view 0 and that of all other views."""

    def __init__(self, preset: PointMaps):
        super().__init__([FullSizeScratch(preset), FullSizeScratch(preset)])

    def forward(
        self, tokens: Tokens, images: Float[Tensor, "B V 3 H W"]
    ) -> tuple[tuple[Float[Tensor, "n _ _ _"], ...], Float[Tensor, "n _ _ _"]]:
        """Memories (B*V, f, s*h, s*w), and the mask map (B*V, f, H, W)."""
        views = []
        for view in range(tokens.shape[1]):
            own = Tokens(tuple(hook[:, view : view + 1] for hook in tokens.hooks), tokens.grid)
            levels = (own.maps(0), own.maps(1), own.maps(2), own.maps(3))
            views.append(self[min(view, 1)](levels, images[:, view]))
        path_4, path_3, path_2, finest = (
            torch.stack(maps, 1).flatten(0, 1) for maps in zip(*views, strict=True)
        )
        return (path_4, path_3, path_2), finest


class ResidualGrouping(nn.Module):
    """Queries -> masks over all views and a predicted IoU each.

    With e_l the mask embedding after layer l and M the mask map, the published masks are
    m_l = m_(l-1) + e_l . M. The map is the same in all layers, so m_l = (e_1 + ... + e_l) . M.
    """

    def __init__(self, preset: PointMaps):
        super().__init__()
        dim, depth = preset.grouping_dim, preset.grouping_layers
        if dim != preset.dpt_feature:
            raise ValueError(f"grouping_dim: expected the dpt_feature, {preset.dpt_feature}, received {dim}")
        self.patterns = nn.Parameter(draw_normal(preset.num_queries, dim))
        self.positions = nn.Parameter(draw_normal(preset.num_queries, dim))
        self.layers = nn.ModuleList(QueryBlock(dim, preset.grouping_heads, bias=False) for _ in range(depth))
        self.scores = nn.ModuleList(MLP(dim, dim, 1) for _ in range(depth))
        self.mask_mlp = MLP(dim, dim, preset.dpt_feature)

    def forward(
        self, memories: tuple[Float[Tensor, "n _ _ _"], ...], finest: Float[Tensor, "n _ _ _"], num_views: int
    ) -> tuple[Groups, ...]:
        """Groups after every layer while training, else after the last alone.

        Layers read the scales coarse to fine in order, two layers each for six.
        """
        batch = finest.shape[0] // num_views
        maps = finest.unflatten(0, (batch, num_views))
        queries = self.patterns.expand(batch, -1, -1)
        embedding = torch.zeros_like(queries)
        answers = []
        for depth, (layer, score) in enumerate(zip(self.layers, self.scores, strict=True)):
            memory = memories[depth * len(memories) // len(self.layers)]
            memory = memory.flatten(2).transpose(1, 2).unflatten(0, (batch, num_views)).flatten(1, 2)
            code = sinusoid(memory.shape[1], memory.shape[2], like=memory)
            queries = layer(queries, memory, self.positions, code)
            embedding = embedding + self.mask_mlp(queries)
            if self.training or depth + 1 == len(self.layers):
                logits = torch.einsum("bnf,bvfhw->bvnhw", embedding.to(maps), maps)
                answers.append(Groups(logits.float(), score(queries)[..., 0].float()))
        return tuple(answers)


def filter_queries(groups: Groups, rule: MaskFilter) -> Shaped[Tensor, " K"]:
    """Indices (K,) of the queries of one scene (B = 1) whose masks are groups, best first.

    A mask is where the logit is above 0, over all views. It needs a predicted IoU, a stability
    (share of it that stays when cut `offset` higher, of what it is when cut lower), an area, and
    no better mask that covers nearly the same.

    Source: Kirillov et al. 2023 (SAM), with the values of the public demo (`MaskFilter`).
    """
    logits = groups.mask_logits[0].transpose(0, 1).flatten(1)  # (N, V*h*w)
    scores = groups.existence_logits[0].sigmoid()
    high, low = (logits > rule.offset).sum(1), (logits > -rule.offset).sum(1)
    stability = high / low.clamp_min(1)
    areas = (logits > 0).sum(1)
    good = (scores >= rule.min_score) & (stability >= rule.min_stability) & (areas >= rule.min_area)
    ids = good.nonzero()[:, 0]
    ids = ids[scores[ids].argsort(descending=True, stable=True)]
    return ids[_apart(logits[ids] > 0, rule.max_overlap)]


def _apart(masks: Tensor, max_overlap: float) -> Tensor:
    """Rows (K,) of masks (n, P) bool, best first, none overlapping an earlier kept one too much."""
    flat = masks.float()
    shared = flat @ flat.T
    areas = flat.sum(1)
    close = (shared / (areas[:, None] + areas - shared).clamp_min(1) > max_overlap).tolist()
    kept: list[int] = []
    for row in range(len(flat)):
        if not any(close[row][other] for other in kept):
            kept.append(row)
    return torch.tensor(kept, dtype=torch.long, device=masks.device)
