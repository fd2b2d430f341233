"""What a second network says of parts, added to their names in the language space.

It sees photos with other eyes (`encoders.deeplab`), so that it errs elsewhere. One layer reads its maps and
learned alone what they mean (`lab/training/second.py`): log odds of words are inner products with texts, as
those of L(x) are. Their sum is that of both together, as far as they err independently (Bayes). The shipped
weights hold no such layer: photos gain by it, but rendered rooms and other words lose (MEASURED.md).

Sizes: V views, K parts, h w a map's own size, C channels of the language space.
"""

from jaxtyping import Float
from torch import Tensor, nn
from torch.nn import functional as F

from langflash_core.network.encoders.deeplab import CHANNELS, DeepLab
from langflash_core.network.presets import GuidedDepth

COUNTS = 1.0
"""What the second network counts beside an atom, whose length is 1; its own is as long as its pixels agree.
More names photos better still and rendered rooms worse (MEASURED.md)."""


class SecondHead(nn.Linear):
    """Maps of `DeepLab` -> unit vectors of the language space. Zeros: it has learned nothing and is not
    asked."""

    def __init__(self, preset: GuidedDepth):
        super().__init__(CHANNELS, preset.language_dim)
        nn.init.zeros_(self.weight)
        nn.init.zeros_(self.bias)

    def forward(self, input: Float[Tensor, "... 256"]) -> Float[Tensor, "... C"]:
        return F.normalize(super().forward(input), dim=-1)

    @property
    def silent(self) -> bool:
        """Whether it has learned nothing."""
        return not bool(self.weight.any())


def looked_at(
    deeplab: DeepLab,
    head: SecondHead,
    images: Float[Tensor, "V 3 H W"],
    weights: Float[Tensor, "V K h w"],
) -> Float[Tensor, "K C"]:
    """Means over every part of what the second network says, length 0 to 1, (K, C).

    View by view: a processor's caches hold one.

    Args:
        images: (V, 3, H, W) in [0, 1]. weights: w_k(x) of one scene, (V, K, h, w), any size.
    """
    total = weights.new_zeros(weights.shape[1], head.out_features)
    size = (weights.shape[-2], weights.shape[-1])
    for image, own in zip(images.split(1), weights, strict=True):
        maps = F.interpolate(deeplab(image), size, mode="bilinear", align_corners=False)[0]
        total = total + own.flatten(1) @ head(maps.flatten(1).T)
    return total / (weights.sum((0, 2, 3))[:, None] + 1e-6)


def both(first: Float[Tensor, "K C"], second: Float[Tensor, "K C"]) -> Float[Tensor, "K C"]:
    """Atoms (K, C) of unit norm: what both say. second: of `looked_at`."""
    return F.normalize(first + COUNTS * second, dim=-1)
