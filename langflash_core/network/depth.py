"""Guided depth, learned parts: a monocular prior with confidence, and its plane-sweep refinement.

Depths are z in metres where the network knows no better scale; b is the expected absolute
error of log depth (the scale of a Laplace distribution).
"""

from dataclasses import dataclass

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from langflash_core.geometry.cameras import invert_rigid, rays
from langflash_core.network.dpt import DPT, ResidualUnit
from langflash_core.network.encoder import Tokens
from langflash_core.network.presets import Preset

_TYPICAL_LOG_DEPTH = 0.8  # log of 2.2 m: where an untrained head starts
_LOG_RANGE = (-4.0, 5.0)  # 2 cm to 150 m: exp never overflows
_LOG_ERROR_RANGE = (-5.0, 1.0)
_CONFIDENT_ERROR = 0.1  # relative depth error that counts as confidence 1/2


@dataclass(frozen=True)
class DepthMaps:
    """log_depths and log_errors (B, V, H, W): log z, and log b of its expected error."""

    log_depths: Tensor
    log_errors: Tensor

    @property
    def depths(self) -> Tensor:
        return self.log_depths.exp()

    @property
    def confidences(self) -> Tensor:
        """1 / (1 + b / 0.1), in (0, 1)."""
        return torch.sigmoid(torch.log(torch.tensor(_CONFIDENT_ERROR)) - self.log_errors)


def resize(maps: Tensor, size: tuple[int, int]) -> Tensor:
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

    def forward(self, maps: tuple[Tensor, Tensor, Tensor, Tensor], tokens: Tokens) -> DepthMaps:
        """Maps of the four levels (B*V, C_i, h, w) -> (B, V, H, W)."""
        raw = self.head(self.dpt(maps).path_1).float()
        size = (tokens.grid[0] * self.patch, tokens.grid[1] * self.patch)
        raw = resize(raw, size).unflatten(0, tokens.shape)
        log_depths = (raw[:, :, 0] + _TYPICAL_LOG_DEPTH).clamp(*_LOG_RANGE)
        return DepthMaps(log_depths, (raw[:, :, 1] - 1.5).clamp(*_LOG_ERROR_RANGE))


def sweep_correlation(
    features: Tensor, log_depths: Tensor, offsets: Tensor, viewmats: Tensor, Ks: Tensor
) -> tuple[Tensor, Tensor]:
    """Correlation of every view with the others over depth hypotheses.

    Args:
        features: (V, C, h, w), unit channel norm.
        log_depths: (V, h, w) prior; hypothesis j of a pixel is prior * exp(offsets[j]).
        offsets: (P,). viewmats: (V, 4, 4) of one common length unit. Ks: (V, 3, 3), pixels of
            the feature maps.

    Returns:
        Correlations (V, P, h, w), the mean cosine over the other views that see the point,
        and how many of them see it as a fraction (V, P, h, w).

    Source: plane sweep (Collins 1996) around a prior, as MVSplat does with given poses.
    """
    num_views, _, height, width = features.shape
    directions = rays(Ks, width, height)  # (V, h, w, 3)
    correlations, visibilities = [], []
    for view in range(num_views):
        depths = (log_depths[view] + offsets[:, None, None]).exp()  # (P, h, w)
        pos_c = directions[view] * depths[..., None]  # (P, h, w, 3)
        total = torch.zeros_like(depths)
        count = torch.zeros_like(depths)
        for other in range(num_views):
            if other == view:
                continue
            relative = viewmats[other] @ invert_rigid(viewmats[view])
            pos_o = pos_c @ relative[:3, :3].T + relative[:3, 3]
            warped, seen = _sample(features[other], pos_o, Ks[other])  # (P, C, h, w), (P, h, w)
            total = total + (warped * features[view]).sum(1) * seen
            count = count + seen
        correlations.append(total / count.clamp_min(1))
        visibilities.append(count / max(num_views - 1, 1))
    return torch.stack(correlations), torch.stack(visibilities)


def _sample(features: Tensor, pos_c: Tensor, K: Tensor) -> tuple[Tensor, Tensor]:
    """Bilinear features at projected points (P, h, w, 3), and 1 where the point is in view."""
    height, width = features.shape[-2:]
    z = pos_c[..., 2]
    xy = pos_c[..., :2] / z.clamp_min(1e-4)[..., None] * K.diagonal()[:2] + K[:2, 2]
    ndc = (xy / xy.new_tensor([width, height]) * 2 - 1).clamp(-4, 4)
    seen = ((z > 1e-4) & (ndc.abs() <= 1).all(-1)).to(features.dtype)
    batch = features[None].expand(len(ndc), -1, -1, -1)
    return F.grid_sample(batch, ndc.to(features.dtype), align_corners=False), seen


class DepthRefiner(nn.Module):
    """A small network that reads the correlation volume and corrects the prior.

    The answer is a soft-argmax over the hypotheses, so it can never leave their range; with no
    other view (or none that sees a pixel) correlations are 0 and the prior speaks alone.
    """

    offsets: Tensor  # (P,) log-depth hypotheses around the prior

    def __init__(self, preset: Preset):
        super().__init__()
        feature, planes = preset.sweep_feature, preset.sweep_planes
        self.match_hook = preset.match_hook
        offsets = torch.linspace(-preset.sweep_range, preset.sweep_range, planes)
        self.register_buffer("offsets", offsets, persistent=False)
        self.image = nn.Sequential(
            nn.Conv2d(3, feature, 3, stride=2, padding=1),
            nn.ReLU(),
            nn.Conv2d(feature, feature, 3, padding=1),
        )
        self.tokens = nn.Conv2d(preset.encoder_dim, feature, 1)
        self.mix = nn.Conv2d(feature, feature, 3, padding=1)
        self.regularise = nn.Sequential(
            nn.Conv2d(2 * planes + feature + 2, 64, 3, padding=1),
            ResidualUnit(64),
            ResidualUnit(64),
            nn.ReLU(),
            nn.Conv2d(64, planes + 1, 3, padding=1),
        )
        self.sharpness = nn.Parameter(torch.tensor(10.0))

    def features(self, images: Tensor, tokens: Tokens) -> Tensor:
        """Matching features (B*V, C, 4h, 4w) of unit channel norm."""
        height, width = tokens.grid
        fine = self.image(resize(images.flatten(0, 1), (8 * height, 8 * width)) - 0.5)
        coarse = resize(self.tokens(tokens.maps(self.match_hook)), fine.shape[-2:])
        return F.normalize(self.mix(F.relu(fine + coarse)).float(), dim=1)

    def forward(
        self, images: Tensor, tokens: Tokens, prior: DepthMaps, viewmats: Tensor, Ks: Tensor
    ) -> DepthMaps:
        """Refined maps of the prior's size.

        Args:
            images: (B, V, 3, H, W). prior: (B, V, H, W), of the viewmats' length unit.
            viewmats: (B, V, 4, 4). Ks: (B, V, 3, 3), pixels of the images.
        """
        size = (prior.log_depths.shape[-2], prior.log_depths.shape[-1])
        features = self.features(images, tokens).unflatten(0, tokens.shape)
        height, width = features.shape[-2:]
        small = resize(torch.stack((prior.log_depths, prior.log_errors), 2).flatten(0, 1), (height, width))
        small = small.unflatten(0, tokens.shape)
        scale = torch.tensor([width / size[1], height / size[0], 1.0]).to(Ks)
        volumes = [
            torch.cat(sweep_correlation(f, s[:, 0], self.offsets, m, K), 1)
            for f, s, m, K in zip(features, small, viewmats, Ks * scale[:, None], strict=True)
        ]
        volume = torch.stack(volumes).flatten(0, 1)  # (B*V, 2P, h, w)
        planes = len(self.offsets)
        flat = small.flatten(0, 1)
        centred = (
            flat
            - torch.stack((flat[:, 0].mean((1, 2)), torch.full_like(flat[:, 0, 0, 0], -1.5)), 1)[
                ..., None, None
            ]
        )
        raw = self.regularise(torch.cat((volume, features.flatten(0, 1), centred), 1)).float()
        logits = raw[:, :planes] + self.sharpness * volume[:, :planes]
        shift = (logits.softmax(1) * self.offsets[:, None, None]).sum(1, keepdim=True)
        change = resize(torch.cat((shift, raw[:, planes:]), 1), size).unflatten(0, tokens.shape)
        log_errors = (prior.log_errors + change[:, :, 1]).clamp(*_LOG_ERROR_RANGE)
        return DepthMaps(prior.log_depths + change[:, :, 0], log_errors)
