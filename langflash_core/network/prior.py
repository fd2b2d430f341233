"""Guided depth, the monocular prior with its confidence (`refiner` brings the stereo).

Depths are z in metres where the network knows no better scale; b is the expected absolute
error of log depth (the scale of a Laplace distribution).
"""

from jaxtyping import Float
from torch import Tensor, nn
from torch.nn import functional as F

from langflash_core.network.encoders.shared import Tokens
from langflash_core.network.layers.dpt import DPT
from langflash_core.network.presets import Preset
from langflash_core.network.settings import PRIOR
from langflash_core.rig.rig import DepthMaps


def resize(maps: Float[Tensor, "n C _ _"], size: tuple[int, int]) -> Float[Tensor, "n C H W"]:
    """Bilinear (n, C, h, w) -> (n, C, *size), pixel centres aligned; averages when shrinking."""
    shrinking = maps.shape[-1] > size[1]
    if shrinking:
        maps = maps.float()  # a CPU has no antialiased resize in half precision
    return F.interpolate(maps, size=size, mode="bilinear", align_corners=False, antialias=shrinking)


class DepthHead(nn.Module):
    """DPT over shallow encoder tokens and decoder tokens -> monocular log depth and log error."""

    def __init__(self, preset: Preset):
        super().__init__()
        e, d = preset.encoder_dim, preset.decoder_dim
        self.patch = preset.patch
        self.dpt = DPT((e, e, d, d), preset.dpt_dims, preset.dpt_feature)
        self.head = nn.Sequential(
            nn.Conv2d(preset.dpt_feature, 32, 3, padding=1), nn.ReLU(), nn.Conv2d(32, 2, 1)
        )

    def forward(
        self,
        maps: tuple[
            Float[Tensor, "n _ _ _"],
            Float[Tensor, "n _ _ _"],
            Float[Tensor, "n _ _ _"],
            Float[Tensor, "n _ _ _"],
        ],
        tokens: Tokens,
    ) -> DepthMaps:
        """Maps of the four levels (B*V, C_i, h, w) -> (B, V, H, W)."""
        raw = self.head(self.dpt(maps).path_1).float()
        size = (tokens.grid[0] * self.patch, tokens.grid[1] * self.patch)
        raw = resize(raw, size).unflatten(0, tokens.shape)
        log_depths = (raw[:, :, 0] + PRIOR.typical_log_depth).clamp(*PRIOR.log_range)
        return DepthMaps(log_depths, (raw[:, :, 1] + PRIOR.typical_log_error).clamp(*PRIOR.log_error_range))
