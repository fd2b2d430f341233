"""Predictions drawn on the processor, without a scene. N Gaussians, F features, H W pixels."""

from dataclasses import replace

import torch
from jaxtyping import Float
from torch import Tensor

from langflash_core.splat import view_colours
from langflash_core.splat.projection import ALPHA_MIN, project, view_depths
from langflash_core.splat.tiles import rasterize_tiles
from langflash_core.types import Camera, Frame, Gaussians, Prediction


def placed_gaussians(prediction: Prediction) -> Gaussians:
    """All Gaussians of a prediction; those of photos without a place are transparent, as a scene leaves such
    photos out."""
    opacities = prediction.gaussians.opacities.unflatten(0, (len(prediction.viewmats), -1)).clone()
    opacities[list(prediction.unplaced)] = 0
    return replace(prediction.gaussians, opacities=opacities.flatten())


@torch.no_grad()
def drawn_features(
    gaussians: Gaussians, features: Float[Tensor, "N F"], camera: Camera
) -> Float[Tensor, "H W F"]:
    """sum_i T_i alpha_i f_i, within the tiles' 1e-4 of the reference."""
    footprints = project(gaussians.map(torch.Tensor.double), camera)
    return rasterize_tiles(footprints, [features], camera)[0][0]


@torch.no_grad()
def drawn_frame(gaussians: Gaussians, camera: Camera) -> Frame:
    """Colours over black, alphas and depths."""
    layers = torch.cat((view_colours(gaussians, camera), view_depths(gaussians, camera)[:, None]), 1)
    footprints = project(gaussians.map(torch.Tensor.double), camera)
    (maps,), alphas = rasterize_tiles(footprints, [layers.float()], camera)
    depths = torch.where(alphas >= ALPHA_MIN, maps[..., 3] / alphas.clamp_min(ALPHA_MIN), 0.0)
    return Frame(maps[..., :3], alphas, depths, None)
