"""Dense language features L(x): a light DPT on the encoder's own tokens, per view."""

from torch import Tensor, nn
from torch.nn import functional as F

from langflash_core.network.encoders.shared import Tokens
from langflash_core.network.layers.dpt import DPT
from langflash_core.network.presets import GuidedDepth


class LanguageHead(nn.Module):
    """Encoder tokens -> unit vectors of the language space at four times the token grid."""

    def __init__(self, preset: GuidedDepth):
        super().__init__()
        feature = preset.language_feature
        e = preset.encoder_dim
        self.dpt = DPT((e, e, 2 * e, 2 * e), preset.dpt_dims, feature)
        self.mix = nn.Conv2d(feature, 2 * feature, 3, padding=1)
        self.out = nn.Conv2d(2 * feature, preset.language_dim, 1)

    def forward(self, tokens: Tokens) -> Tensor:
        """L(x), (B, V, C, 4h, 4w), unit channel norm."""
        path = F.avg_pool2d(self.dpt(tokens.named_maps()).path_1, 2)
        features = self.out(F.gelu(self.mix(path))).float()
        return F.normalize(features, dim=1).unflatten(0, tokens.shape)
