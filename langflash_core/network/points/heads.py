"""Heads of the point-map geometry: where every pixel's point lies, and what its Gaussian looks like.

n pictures, H W pixels, S spherical-harmonic bases. Source of both heads and of all activations:
Ye et al. 2025 (NoPoSplat); the exponential point map: Wang et al. 2024 (DUSt3R).
"""

import torch
from jaxtyping import Float
from torch import Tensor, nn
from torch.nn import functional as F

from langflash_core.geometry.quaternions import unit_quats
from langflash_core.network.encoders.vit import centre_images
from langflash_core.network.layers.dpt import DPT, double
from langflash_core.network.presets import PointMaps
from langflash_core.network.settings import POINT_HEADS
from langflash_core.types import Gaussians

Levels = tuple[Tensor, Tensor, Tensor, Tensor]


def _dpt(preset: PointMaps) -> DPT:
    e, d = preset.encoder_dim, preset.decoder_dim
    return DPT((e, d, d, d), preset.dpt_dims, preset.dpt_feature, align_corners=True)


class PointHead(nn.Module):
    """Levels (n, C_i, h, w) -> points (n, 3, H, W) in the first camera's frame."""

    def __init__(self, preset: PointMaps):
        super().__init__()
        f = preset.dpt_feature
        self.dpt = _dpt(preset)
        self.narrow = nn.Conv2d(f, f // 2, 3, padding=1)
        self.mix = nn.Conv2d(f // 2, f // 2, 3, padding=1)
        self.out = nn.Conv2d(f // 2, 3, 1)

    def forward(self, levels: Levels) -> Float[Tensor, "n 3 H W"]:
        wide = double(self.narrow(self.dpt(levels).path_1), align_corners=True)
        return exponential_points(self.out(F.relu(self.mix(wide))))


def exponential_points(raw: Float[Tensor, "n 3 *pixels"]) -> Float[Tensor, "n 3 *pixels"]:
    """v / |v| (e^|v| - 1) along dim 1: far points need no large numbers, 0 stays 0."""
    length = raw.norm(dim=1, keepdim=True)
    return raw / length.clamp_min(1e-8) * torch.expm1(length)


class ParameterHead(nn.Module):
    """Levels and the pictures themselves -> raw Gaussian parameters (n, 8 + 3 S, H, W).

    The picture joins at full size, so that colours need not pass through patches.
    """

    def __init__(self, preset: PointMaps):
        super().__init__()
        f = preset.dpt_feature
        self.dpt = _dpt(preset)
        self.shortcut = nn.Conv2d(3, f, 7, padding=3)
        self.mix = nn.Conv2d(f, f, 3, padding=1, bias=False)
        self.out = nn.Conv2d(f, 8 + 3 * (preset.sh_degree + 1) ** 2, 1)

    def forward(self, levels: Levels, images: Float[Tensor, "n 3 H W"]) -> Float[Tensor, "n R H W"]:
        wide = double(self.dpt(levels).path_1, align_corners=True)
        return self.out(F.relu(self.mix(wide + F.relu(self.shortcut(centre_images(images))))))


class PerView(nn.ModuleList):
    """Two heads of one kind: one for view 0, one for every other view."""

    def forward(
        self, levels: Levels, images: Float[Tensor, "B V 3 H W"], *, with_images: bool = False
    ) -> Float[Tensor, "B V ..."]:
        """Levels (B*V, C_i, h, w), images (B, V, 3, H, W) -> (B, V, ...) of the heads' answers."""
        batch, num_views = images.shape[:2]
        answers = []
        for view in range(num_views):
            own = tuple(level.unflatten(0, (batch, num_views))[:, view] for level in levels)
            head = self[min(view, 1)]
            answers.append(head(own, images[:, view]) if with_images else head(own))
        return torch.stack(answers, 1)


def activate_gaussians(raw: Float[Tensor, "V R H W"], points: Float[Tensor, "V 3 H W"]) -> Gaussians:
    """Gaussians of one scene, N = V*H*W in the order (v h w).

    Channels: opacity, three scales, quaternion xyzw, harmonics colour by colour.

    Args:
        raw: (V, 8 + 3 S, H, W). points: (V, 3, H, W).
    """
    raw = raw.movedim(1, -1).flatten(0, 2).float()  # (N, 8 + 3 S)
    scales = (POINT_HEADS.scale_step * F.softplus(raw[:, 1:4])).clamp_max(POINT_HEADS.max_scale)
    sh = raw[:, 8:].unflatten(1, (3, -1)).transpose(1, 2)  # (N, S, 3)
    return Gaussians(
        means=points.movedim(1, -1).flatten(0, 2).float(),
        quats=unit_quats(raw[:, [7, 4, 5, 6]]),
        scales=scales,
        opacities=raw[:, 0].sigmoid(),
        sh=sh * _damping(sh.shape[1]).to(sh)[:, None],
    )


def _damping(bases: int) -> Tensor:
    """(S,): 1 for degree 0, then 0.1 * 0.25^degree."""
    degrees = torch.arange(bases).float().sqrt().floor()
    return torch.where(degrees == 0, 1.0, POINT_HEADS.first_degree * POINT_HEADS.degree_step**degrees)
