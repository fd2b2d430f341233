"""What two other networks say of parts, added to their names in the language space.

They see photos with other eyes (`encoders.others`), so that they err elsewhere. One layer reads their maps
and learned alone what they mean (`lab/training/second.py`): log odds of words are inner products with texts,
as those of L(x) are. Their sum is that of both together, as far as they err independently (Bayes). They know
photos and are lost in rendered rooms, which look like nothing they learned from: another layer tells the two
apart, and they are heard as far as a scene looks like photos.

Sizes: V views, K parts, h w a map's own size, F channels of the maps, C of the language space.
"""

import math
from collections.abc import Iterable

from jaxtyping import Float
from torch import Tensor, nn
from torch.nn import functional as F

from langflash_core.network.encoders.others import CHANNELS, OtherEyes
from langflash_core.network.presets import GuidedDepth
from langflash_core.network.semantics.settings import OPINION


class SecondHead(nn.Module):
    """Maps of `OtherEyes` -> unit vectors of the language space, and how much they look like photos. Zeros:
    it has learned nothing and is not asked."""

    def __init__(self, preset: GuidedDepth):
        super().__init__()
        self.words = nn.Linear(CHANNELS, preset.language_dim)
        self.photo = nn.Linear(CHANNELS, 1)
        for value in self.parameters():
            nn.init.zeros_(value)

    def begin(self) -> None:
        """Words as a layer begins to learn, so that no vector is zero; nothing is known of photos."""
        self.words.reset_parameters()
        nn.init.zeros_(self.photo.weight)
        nn.init.zeros_(self.photo.bias)

    def forward(self, maps: Float[Tensor, "... F"]) -> Float[Tensor, "... C"]:
        return F.normalize(self.words(maps), dim=-1)

    def photo_odds(self, maps: Float[Tensor, "... F"]) -> Float[Tensor, "..."]:
        """Log odds that pixels are a photo's, not a rendered room's."""
        return OPINION.steepness * self.photo(maps)[..., 0]

    @property
    def silent(self) -> bool:
        """Whether it has learned nothing."""
        return not bool(self.words.weight.any())


def looked_at(
    others: OtherEyes,
    head: SecondHead,
    pictures: Iterable[Float[Tensor, "1 3 _ _"]],
    weights: Float[Tensor, "V K h w"],
) -> Float[Tensor, "K C"]:
    """Means over every part of what the other networks say, times how surely these are photos: length 0 to
    1, (K, C).

    View by view: a processor's caches hold one.

    Args:
        pictures: of all views, in [0, 1], any size. weights: w_k(x) of one scene, (V, K, h, w), any size.
    """
    total = weights.new_zeros(weights.shape[1], head.words.out_features)
    odds = weights.new_zeros(())
    size = (weights.shape[-2], weights.shape[-1])
    for picture, own in zip(pictures, weights, strict=True):
        maps = F.interpolate(others(picture), size, mode="bilinear", align_corners=False)[0].flatten(1).T
        total = total + own.flatten(1) @ head(maps)
        odds = odds + head.photo_odds(maps).mean() / len(weights)
    means = total / (weights.sum((0, 2, 3))[:, None] + 1e-6)
    return (OPINION.together * odds + math.log(OPINION.photos)).sigmoid() * means


def both(first: Float[Tensor, "K C"], second: Float[Tensor, "K C"]) -> Float[Tensor, "K C"]:
    """Atoms (K, C) of unit norm: what both say. second: of `looked_at`."""
    return F.normalize(first + OPINION.counts * second, dim=-1)
