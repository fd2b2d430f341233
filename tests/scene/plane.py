"""A textured wall seen by several cameras: a prediction whose truth is known."""

import torch
from torch.nn.functional import normalize

from langflash_core.geometry.cameras import intrinsics_from_fov, invert_rigid, transform, unproject
from langflash_core.geometry.harmonics import colour_to_sh
from langflash_core.types import Gaussians, Prediction, Views
from tests.splat.scenes import unturned

NUM_ATOMS, CHANNELS = 6, 32


def poses(num_views: int, step: float = 0.2) -> torch.Tensor:
    """Cameras side by side, each turned a little towards the wall's middle."""
    viewmats = torch.eye(4).repeat(num_views, 1, 1)
    for view in range(1, num_views):
        angle = torch.tensor(-0.05 * view)
        viewmats[view, 0, 0] = viewmats[view, 2, 2] = angle.cos()
        viewmats[view, 0, 2], viewmats[view, 2, 0] = angle.sin(), -angle.sin()
        centre = torch.tensor([step * view, 0.03 * view, 0.0])
        viewmats[view, :3, 3] = -viewmats[view, :3, :3] @ centre
    return viewmats


def told(
    gaussians: Gaussians,
    weights: torch.Tensor,
    viewmats: torch.Tensor,
    depths: torch.Tensor,
    generator: torch.Generator,
) -> Prediction:
    """What a network would say that has drawn its dictionary."""
    return Prediction(
        gaussians=gaussians,
        weights=weights,
        dictionary=normalize(torch.randn(NUM_ATOMS, CHANNELS, generator=generator), dim=-1),
        space="minilm",
        viewmats=viewmats,
        depths=depths,
        confidences=torch.full(depths.shape, 0.9),
        warnings=("a note of the network",),
        timings={"encoder": 0.25},
    )


def wall_prediction(
    num_views: int = 2,
    width: int = 56,
    height: int = 42,
    *,
    noise: float = 0.0,
    wall: float = 3.0,
    seed: int = 0,
) -> tuple[Prediction, Views]:
    """Gaussians on the wall z = `wall`, one per pixel; `noise` moves depths by that share."""
    generator = torch.Generator().manual_seed(seed)
    K = intrinsics_from_fov(60, width, height)
    viewmats = poses(num_views)
    cameras = invert_rigid(viewmats)
    unit_rays = unproject(torch.ones(num_views, height, width), K.expand(num_views, 3, 3))
    slopes = (unit_rays @ cameras[:, None, 2, :3, None]).squeeze(-1)  # world z per unit of depth
    depths = (wall - cameras[:, 2, 3])[:, None, None] / slopes
    depths = depths * (1 + noise * torch.randn(depths.shape, generator=generator))
    means = transform(cameras, (unit_rays * depths[..., None]).flatten(1, 2)).flatten(0, 1)
    x, y = means[:, 0], means[:, 1]
    colours = torch.stack(((x * 1.5).sin(), (y * 2).cos(), (x + y).sin()), -1) * 0.3 + 0.5
    logits = torch.stack([(x * (k + 1)).sin() * 4 + (y * (5 - k)).cos() * 3 for k in range(NUM_ATOMS)], -1)
    weights = logits.softmax(-1).view(num_views, height, width, NUM_ATOMS).permute(0, 3, 1, 2)
    footprints = (depths / K[0, 0]).flatten()
    scales = footprints[:, None] * torch.tensor([0.6, 0.6, 0.1])
    gaussians = unturned(means, scales, sh=colour_to_sh(colours)[:, None])
    prediction = told(gaussians, weights.contiguous(), viewmats, depths, generator)
    images = colours.view(num_views, height, width, 3).permute(0, 3, 1, 2).contiguous()
    names = tuple(f"{view}.jpg" for view in range(num_views))
    photos = tuple(bytes([255, 216, view]) for view in range(num_views))
    return prediction, Views(images, K.repeat(num_views, 1, 1), names, photos, ("a note of triage",))
