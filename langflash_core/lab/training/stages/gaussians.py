"""Gaussians, by what they show of a view that was kept back."""

import torch
from torch import Tensor
from torch.nn import functional as F

from langflash_core.lab.training.batches import SceneBatch
from langflash_core.lab.training.losses import photometric_loss
from langflash_core.lab.training.stages.depth import scaled_prior
from langflash_core.lab.training.stages.stage import Loss, Words, chosen_views, guided, tokens_of
from langflash_core.network.gaussians import assemble_gaussians
from langflash_core.network.model import LangFlashNet
from langflash_core.network.prior import resize
from langflash_core.rig.rig import DepthMaps
from langflash_core.splat import rasterize, view_colours
from langflash_core.types import Camera

GAUSSIAN_STRIDE = 2
"""The Gaussian stage renders every second pixel; footprints are relative, so sizes carry over."""


def gaussians_stage(network: LangFlashNet, batch: SceneBatch, words: Words) -> Loss:
    """Photometric loss of the last view rendered from the Gaussians of the views before it."""
    totals, psnrs = [], []
    rendered = novel_views(network, batch)
    for picture, alphas, photo in rendered:
        totals.append(photometric_loss(picture, photo, torch.ones_like(alphas, dtype=torch.bool)))
        psnrs.append(float(-10 * torch.log10(F.mse_loss(picture.detach().clamp(0, 1), photo) + 1e-10)))
    total = torch.stack(totals).mean()
    return Loss(total, {"psnr": sum(psnrs) / len(psnrs)})


def novel_views(network: LangFlashNet, batch: SceneBatch) -> list[tuple[Tensor, Tensor, Tensor]]:
    """Per scene: the last view rendered from the others, its alphas, and the photo, at half size.

    A scene of two views renders view 1 from view 0 alone. Pixels that no Gaussian covers show the
    photo's mean colour, so that holes cost little and opacity is not pushed up to fill them.
    """
    network = guided(network)
    context = chosen_views(batch, range(batch.images.shape[1] - 1))
    with torch.no_grad():
        maps = network.refiner(
            context.images,
            tokens_of(network, context),
            network.local(context.images.flatten(0, 1)),
            scaled_prior(network, context),
            context.viewmats,
            context.Ks,
        )[-1]
        levels = network.levels(tokens_of(network, context), context.Ks)
    raw = network.gaussian_head(levels, context.images)
    size = (batch.size[0] // GAUSSIAN_STRIDE, batch.size[1] // GAUSSIAN_STRIDE)
    ratio = torch.tensor([1 / GAUSSIAN_STRIDE, 1 / GAUSSIAN_STRIDE, 1.0]).to(batch.Ks)[:, None]
    scenes = []
    for i in range(batch.images.shape[0]):
        small = DepthMaps(_shrink(maps.log_depths[i], size), _shrink(maps.log_errors[i], size))
        pictures = resize(context.images[i], size)
        gaussians = assemble_gaussians(
            resize(raw[i].float(), size), pictures, small, context.viewmats[i], context.Ks[i] * ratio
        )
        camera = Camera(batch.viewmats[i, -1], batch.Ks[i, -1] * ratio, size[1], size[0])
        photo = resize(batch.images[i, -1:], size)[0].permute(1, 2, 0)
        rgb, alphas = rasterize(gaussians, view_colours(gaussians, camera), camera)
        scenes.append((rgb + (1 - alphas[..., None]) * photo.mean((0, 1)), alphas, photo))
    return scenes


def _shrink(maps: Tensor, size: tuple[int, int]) -> Tensor:
    """(V, H, W) maps at a smaller size, by the nearest centre: averaged depths would invent surfaces."""
    return F.interpolate(maps[:, None], size=size, mode="nearest-exact")[:, 0]
