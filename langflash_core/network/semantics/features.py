"""Dense language features L(x), per view, from two readers of the encoder's tokens.

One is a light DPT on the frozen half, which rendered rooms taught; the other, at half its resolution, was
the classifier from which the late half learned real photos. The last layer joins them.
"""

import torch
from jaxtyping import Float
from torch import Tensor, nn
from torch.nn import functional as F

from langflash_core.network.encoders.shared import Tokens
from langflash_core.network.layers.dpt import DPT, double
from langflash_core.network.presets import GuidedDepth


class TaughtReader(nn.Module):
    """Tokens of a half that real photos taught -> what can be told of each quarter of a patch."""

    def __init__(self, preset: GuidedDepth, hooks: int = 3):
        super().__init__()
        self.read = nn.Conv2d(hooks * preset.encoder_dim, preset.taught_feature, 1)
        self.mix = nn.Conv2d(preset.taught_feature, preset.taught_feature, 3, padding=1)

    def forward(self, maps: Float[Tensor, "n C h w"]) -> Float[Tensor, "n D _ _"]:
        """Maps of so many hooks (n, hooks * C, h, w), `Tokens.taught_maps` -> (n, F, 2h, 2w)."""
        return F.gelu(self.mix(double(F.gelu(self.read(maps)), align_corners=False)))


class LanguageHead(nn.Module):
    """Encoder tokens -> unit vectors of the language space at four times the token grid."""

    def __init__(self, preset: GuidedDepth):
        super().__init__()
        feature = preset.language_feature
        e = preset.encoder_dim
        self.dpt = DPT((e, e, e, e), preset.dpt_dims, feature)
        self.mix = nn.Conv2d(feature, 2 * feature, 3, padding=1)
        self.taught = TaughtReader(preset)
        self.out = nn.Conv2d(2 * feature + preset.taught_feature, preset.language_dim, 1)

    def hidden(self, tokens: Tokens) -> Float[Tensor, "n C h w"]:
        """What the last layer reads, (B*V, F, 4h, 4w)."""
        return torch.cat((self.own(tokens), self.of_photos(tokens)), 1)

    def own(self, tokens: Tokens) -> Float[Tensor, "n C h w"]:
        """What rendered rooms taught to tell, from the frozen half; (B*V, 2 * feature, 4h, 4w)."""
        levels = (tokens.maps(0), tokens.maps(1), tokens.maps(2), tokens.maps(3))
        return F.gelu(self.mix(F.avg_pool2d(self.dpt(levels).path_1, 2)))

    def of_photos(self, tokens: Tokens) -> Float[Tensor, "n C h w"]:
        """What photos taught to tell, (B*V, taught_feature, 4h, 4w)."""
        return double(self.taught(tokens.taught_maps()), align_corners=False)

    def forward(self, tokens: Tokens) -> Float[Tensor, "B V C h w"]:
        """L(x), (B, V, C, 4h, 4w), unit channel norm."""
        features = self.out(self.hidden(tokens)).float()
        return F.normalize(features, dim=1).unflatten(0, tokens.shape)
