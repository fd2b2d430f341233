"""One Gaussian per pixel: its place and shape from depth, the rest learned.

The footprint of a pixel on the surface is known once depth is: neighbouring points span it.
The head only corrects that footprint and decides opacity and colour.
"""

import torch
from jaxtyping import Float
from torch import Tensor, nn
from torch.nn import functional as F

from langflash_core.geometry.cameras import invert_rigid, unproject
from langflash_core.geometry.harmonics import colour_to_sh
from langflash_core.geometry.quaternions import matrices_to_quats
from langflash_core.geometry.surfels import ellipses, spans
from langflash_core.network.layers.dpt import DPT
from langflash_core.network.occlusion import drawn_back, extend_surfaces, over_edges
from langflash_core.network.presets import Preset
from langflash_core.network.prior import resize
from langflash_core.network.settings import ELEMENTS
from langflash_core.rig.rig import DepthMaps
from langflash_core.types import Gaussians

CHANNELS = 1 + 3 + 3  # opacity, three scales, colour


def footprints(
    depths: Float[Tensor, "*n H W"],
    Ks: Float[Tensor, "... 3 3"],
    edges: Float[Tensor, "*n H W 2"] | None = None,
) -> tuple[Float[Tensor, "... H W 3"], Float[Tensor, "... H W 3 3"], Float[Tensor, "... H W 3"]]:
    """Surface elements that cover one pixel each.

    With tangents t_u, t_v (differences of neighbouring points, the nearer side of a depth jump)
    the in-plane covariance is s^2 (t_u t_u^T + t_v t_v^T).

    Args:
        depths: (..., H, W), z > 0. Ks: (..., 3, 3) pixels.
        edges: (..., H, W, 2) of `over_edges`, from which elements are drawn back.

    Returns:
        Points (..., H, W, 3) in the camera frame, rotations (..., H, W, 3, 3) whose columns are
        the axes, scales (..., H, W, 3) > 0; the third axis is the surface normal.

    Source: own derivation; twin: numpy eigh in tests/network.
    """
    pos_c = unproject(depths, Ks)
    footprint = depths / Ks[..., 0, 0, None, None]  # one pixel at this depth, scene units
    tangent_u, tangent_v = spans(pos_c, footprint)
    if edges is not None:
        pos_c, tangent_u, tangent_v = drawn_back(pos_c, tangent_u, tangent_v, edges)
    axes, deviations = ellipses(tangent_u, tangent_v)
    in_plane = deviations * ELEMENTS.cover
    thin = (ELEMENTS.thin * footprint)[..., None]
    return pos_c, axes, torch.cat((torch.maximum(in_plane, thin), thin), -1)


class GaussianHead(nn.Module):
    """DPT with the RGB shortcut at half resolution -> raw parameters (B, V, 7, H, W)."""

    def __init__(self, preset: Preset):
        super().__init__()
        e, d, f = preset.encoder_dim, preset.decoder_dim, preset.dpt_feature
        self.patch = preset.patch
        self.dpt = DPT((e, e, d, d), preset.dpt_dims, f)
        self.shortcut = nn.Conv2d(3, f, 7, padding=3)
        last = nn.Conv2d(f, CHANNELS, 1)
        for parameter in last.parameters():
            nn.init.zeros_(parameter)  # starts as the plain footprint of each pixel
        self.head = nn.Sequential(nn.Conv2d(f, f, 3, padding=1), nn.ReLU(), last)

    def forward(
        self,
        maps: tuple[
            Float[Tensor, "n _ _ _"],
            Float[Tensor, "n _ _ _"],
            Float[Tensor, "n _ _ _"],
            Float[Tensor, "n _ _ _"],
        ],
        images: Float[Tensor, "B V 3 H W"],
    ) -> Tensor:
        """Raw parameters from level maps (B*V, C_i, h, w) and images (B, V, 3, H, W) in [0, 1]."""
        height, width = images.shape[-2:]
        half = (height // 2, width // 2)
        pictures = F.relu(self.shortcut(resize(images.flatten(0, 1), half) * 2 - 1))
        raw = self.head(resize(self.dpt(maps).path_1, half) + pictures)
        return resize(raw.float(), (height, width)).unflatten(0, images.shape[:2])


def assemble_gaussians(
    raw: Float[Tensor, "V 7 H W"],
    images: Float[Tensor, "V 3 H W"],
    depth_maps: DepthMaps,
    viewmats: Float[Tensor, "V 4 4"],
    Ks: Float[Tensor, "V 3 3"],
) -> Gaussians:
    """Gaussians of one scene, N = V*H*W in the order (v h w), world = view 0.

    Each is on its pixel's ray, but for those on both sides of a jump of depth (`occlusion`).

    Args:
        raw: (V, 7, H, W) of the head. images: (V, 3, H, W) in [0, 1].
        depth_maps: (V, H, W). viewmats: (V, 4, 4). Ks: (V, 3, 3) pixels.
    """
    edges = over_edges(depth_maps.log_depths)
    pos_c, axes, scales = footprints(depth_maps.depths, Ks, edges)
    pos_c, scales = extend_surfaces(pos_c, scales, depth_maps.log_depths, Ks)
    poses = invert_rigid(viewmats)
    means = torch.einsum("vij,vhwj->vhwi", poses[:, :3, :3], pos_c) + poses[:, None, None, :3, 3]
    quats = matrices_to_quats(poses[:, None, None, :3, :3] @ axes)
    raw = raw.movedim(1, -1)  # (V, H, W, 7)
    # Starts at opacity 0.88; a pixel whose depth is not trusted starts fainter.
    opacities = torch.sigmoid(raw[..., 0] + 2.0) * depth_maps.confidences.clamp(0.2, 1).sqrt()
    # Never below the footprint that closes the surface: seen from nearer than the photo, where the
    # renderer's dilation of 0.3 px no longer helps, smaller ones would leave gaps. Nor larger at a jump.
    larger = torch.tanh(raw[..., 1:4]).clamp_min(0) * (edges == 0).all(-1, keepdim=True)
    scales = scales * torch.exp(ELEMENTS.scale_range * larger)
    colours = images.movedim(1, -1) + ELEMENTS.colour_range * torch.tanh(raw[..., 4:])
    return Gaussians(
        means=means.reshape(-1, 3),
        quats=quats.reshape(-1, 4),
        scales=scales.reshape(-1, 3),
        opacities=opacities.reshape(-1),
        sh=colour_to_sh(colours).reshape(-1, 1, 3),
    )
