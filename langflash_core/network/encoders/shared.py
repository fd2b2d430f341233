"""The shared image encoder: pictures in, tokens of four blocks out. Run once, read by all heads."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import torch
from jaxtyping import Float
from torch import Tensor, nn

from langflash_core.base.many import together
from langflash_core.network.encoders.plain import PlainViT, patch_tokens
from langflash_core.network.presets import GuidedDepth

_MEAN = (0.485, 0.456, 0.406)
_STD = (0.229, 0.224, 0.225)


@dataclass(frozen=True)
class Tokens:
    """Encoder tokens of V views: four hooks (B, V, h*w, C), after the final norm; grid (h, w).

    named: the last two hooks once more, from the half that names of real photos taught; () without one.
    deep: the last hook once more, from the half that their depth taught; () without one.
    grouped: the hooks once more, from the encoder that the grouping was trained on; () where it is this one.
    """

    hooks: tuple[Float[Tensor, "B V _ _"], ...]
    grid: tuple[int, int]
    named: tuple[Float[Tensor, "B V _ _"], ...] = ()
    deep: tuple[Float[Tensor, "B V _ _"], ...] = ()
    grouped: tuple[Float[Tensor, "B V _ _"], ...] = ()

    @property
    def shape(self) -> tuple[int, int]:
        """(B, V)."""
        return self.hooks[0].shape[0], self.hooks[0].shape[1]

    def maps(self, index: int) -> Float[Tensor, "n C h w"]:
        """Hook `index` as feature maps (B*V, C, h, w)."""
        return tokens_to_maps(self.hooks[index].flatten(0, 1), self.grid)

    def taught_maps(self) -> Float[Tensor, "n C h w"]:
        """What the classifier of real photos reads, (B*V, 3C, h, w): the last early hook and those of the
        half that their names taught."""
        deep = (tokens_to_maps(t.flatten(0, 1), self.grid) for t in self.named)
        return torch.cat((self.maps(1), *deep), 1)

    def each(self, change: Callable[[Tensor], Tensor]) -> "Tokens":
        """Every hook (B, V, h*w, C) changed alike."""
        hooks, named, deep, grouped = (tuple(map(change, kind)) for kind in self._kinds)
        return Tokens(hooks, self.grid, named, deep, grouped)

    @property
    def _kinds(self) -> tuple[tuple[Float[Tensor, "B V _ _"], ...], ...]:
        return self.hooks, self.named, self.deep, self.grouped

    @staticmethod
    def beside(parts: Sequence["Tokens"]) -> "Tokens":
        """Those of several groups of views, one after the other."""
        if len(parts) == 1:
            return parts[0]
        count = sum(part.shape[1] for part in parts)
        hooks, named, deep, grouped = (
            tuple(together(same, count, 1) for same in zip(*kind, strict=True))
            for kind in zip(*(part._kinds for part in parts), strict=True)
        )
        return Tokens(hooks, parts[0].grid, named, deep, grouped)

    def for_grouping(self) -> "Tokens":
        """Those that the grouping reads."""
        return Tokens(self.grouped or self.hooks, self.grid)

    def scene(self, index: int) -> "Tokens":
        """Those of one scene of the batch, B = 1."""
        return self.each(lambda hook: hook[index : index + 1])

    def views(self, keep: Sequence[int]) -> "Tokens":
        """Those of some views."""
        chosen = torch.tensor(list(keep), device=self.hooks[0].device)
        return self.each(lambda hook: hook[:, chosen])


def tokens_to_maps(tokens: Float[Tensor, "n _ C"], grid: tuple[int, int]) -> Float[Tensor, "n C h w"]:
    """(n, h*w, C) -> (n, C, h, w)."""
    return tokens.transpose(1, 2).unflatten(2, grid)


class Encoder(nn.Module):
    """A plain ViT, frozen: sides are multiples of the patch, any aspect ratio."""

    def __init__(self, preset: GuidedDepth):
        super().__init__()
        self.patch = preset.patch
        self.hook_blocks = preset.hooks
        self.vit = PlainViT(preset)
        self.requires_grad_(False).eval()

    def train(self, mode: bool = True) -> "Encoder":
        """Stays in evaluation mode: the encoder is frozen."""
        return super().train(False)

    @torch.no_grad()
    def forward(self, images: Float[Tensor, "B V 3 H W"]) -> tuple[Tokens, Float[Tensor, "n _ C"]]:
        """Tokens of images (B, V, 3, H, W) in [0, 1], and what `LateHalf` reads, (B*V, 1 + h*w, C).

        Raises:
            ValueError: a side is no multiple of the patch.
        """
        if images.shape[-2] % self.patch or images.shape[-1] % self.patch:
            sides = tuple(images.shape[-2:])
            raise ValueError(f"images: expected sides that are multiples of {self.patch}, received {sides}")
        mean, std = (images.new_tensor(values)[:, None, None] for values in (_MEAN, _STD))
        flat = (images.flatten(0, 1) - mean) / std
        states = self.vit.states(flat, self.hook_blocks)
        hooks = tuple(unflatten_views(patch_tokens(self.vit.norm(x)), images) for x in states)
        grid = (images.shape[-2] // self.patch, images.shape[-1] // self.patch)
        return Tokens(hooks, grid), states[1]


def unflatten_views(
    tokens: Float[Tensor, "n ..."], images: Float[Tensor, "B V _ H W"]
) -> Float[Tensor, "B V ..."]:
    """Tokens (B*V, ...) of images (B, V, 3, H, W), as (B, V, ...)."""
    return tokens.unflatten(0, images.shape[:2])
