"""Depth, its refinement by other views, and point maps.

Sizes: B scenes, V views, H W pixels, h w the head's own size.
"""

from dataclasses import replace

import torch
from torch import Tensor

from langflash_core.geometry.cameras import invert_rigid, unproject
from langflash_core.lab.training.batches import SceneBatch
from langflash_core.lab.training.losses import depth_loss, error_loss, gradient_loss, log_residual, point_loss
from langflash_core.lab.training.stages.stage import Loss, Words, as_numbers, guided, pointed, tokens_of
from langflash_core.network.model import LangFlashNet
from langflash_core.rig.rig import DepthMaps


def depth_stage(network: LangFlashNet, batch: SceneBatch, words: Words) -> Loss:
    """Monocular log depth and its expected error, from the decoder and the depth head."""
    maps = guided(network).monocular_depth(tokens_of(network, batch), batch.Ks)
    logs, errors, truth = (t.flatten(0, 1).float() for t in (maps.log_depths, maps.log_errors, batch.depths))
    shape, slope = depth_loss(logs, truth), gradient_loss(logs, truth)
    error = error_loss(logs, errors, truth)
    return Loss(shape + slope + 0.05 * error, as_numbers(shape=shape, slope=slope, error=error))


def refine_stage(network: LangFlashNet, batch: SceneBatch, words: Words) -> Loss:
    """Plane-sweep refinement of the frozen prior, every pass of it, with the errors that poses will have."""
    network = guided(network)
    with torch.no_grad():
        prior = scaled_prior(network, batch)
        prior = replace(prior, log_depths=prior.log_depths + 0.05 * _noise(batch, (1, 1), words.generator))
        viewmats = perturbed_poses(batch.viewmats, words.generator, *_pose_noise(words.generator))
        local = network.local(batch.images.flatten(0, 1))
    passes = network.refiner(batch.images, tokens_of(network, batch), local, prior, viewmats, batch.Ks)
    truth = batch.depths.flatten(0, 1).float()
    total = truth.new_zeros(())
    for maps in passes:
        logs, errors = (t.flatten(0, 1).float() for t in (maps.log_depths, maps.log_errors))
        shape, slope = depth_loss(logs, truth, absolute=1.0), gradient_loss(logs, truth)
        error = error_loss(logs, errors, truth, shared_offset=False)
        total = total + (shape + slope + 0.05 * error) / len(passes)
    return Loss(total, as_numbers(shape=shape, slope=slope, error=error))


def scaled_prior(network: LangFlashNet, batch: SceneBatch) -> DepthMaps:
    """The frozen prior brought to the poses' unit per view: median of log z* - log z.

    At run time matches tie the two; here the truth stands in for them.
    """
    prior = guided(network).monocular_depth(tokens_of(network, batch), batch.Ks)
    residuals, valid = log_residual(prior.log_depths.float(), batch.depths)
    shift = (
        torch.where(valid, -residuals, torch.full_like(residuals, torch.nan)).flatten(2).nanmedian(-1).values
    )
    return DepthMaps(
        prior.log_depths.float() + shift.nan_to_num(0)[..., None, None], prior.log_errors.float()
    )


POSE_NOISE = ((0.2, 0.02, 0.6), (0.8, 0.08, 0.3), (4.0, 0.4, 0.1))
"""(degrees, share of the baseline, chance): how wrong poses are at run time; mostly little."""


def _pose_noise(generator: torch.Generator) -> tuple[float, float]:
    """Degrees and share for one batch."""
    chances = torch.tensor([chance for _, _, chance in POSE_NOISE])
    degrees, share, _ = POSE_NOISE[int(torch.multinomial(chances, 1, generator=generator))]
    return degrees, share


def perturbed_poses(viewmats: Tensor, generator: torch.Generator, degrees: float, share: float) -> Tensor:
    """Poses (B, V, 4, 4) with rotations off by about `degrees`, translations by `share` of their length."""
    shape = viewmats.shape[:2]
    turn = (
        torch.randn(*shape, 3, generator=generator).to(viewmats) * torch.deg2rad(torch.tensor(degrees)).item()
    )
    cross = torch.zeros(*shape, 3, 3).to(viewmats)
    cross[..., 0, 1], cross[..., 0, 2], cross[..., 1, 2] = -turn[..., 2], turn[..., 1], -turn[..., 0]
    rotation = torch.matrix_exp(cross - cross.transpose(-1, -2))
    shift = torch.randn(*shape, 3, generator=generator).to(viewmats)
    moved = viewmats.clone()
    moved[..., :3, :3] = rotation @ viewmats[..., :3, :3]
    lengths = viewmats[..., :3, 3].norm(dim=-1, keepdim=True)
    moved[..., :3, 3] = viewmats[..., :3, 3] + share * lengths * shift
    moved[:, 0] = viewmats[:, 0]
    return moved


def points_stage(network: LangFlashNet, batch: SceneBatch, words: Words) -> Loss:
    """Point maps of all views in view 0's frame; one unit of length per scene, as no photo tells more."""
    points = pointed(network).point_maps(tokens_of(network, batch), batch.images).float()
    poses = invert_rigid(batch.viewmats)
    pos_c = unproject(batch.depths, batch.Ks)
    truth = torch.einsum("bvij,bvhwj->bvhwi", poses[..., :3, :3], pos_c) + poses[..., None, None, :3, 3]
    loss = point_loss(points.movedim(2, -1), truth, batch.depths > 0)
    return Loss(loss, as_numbers(points=loss))


def _noise(batch: SceneBatch, size: tuple[int, int], generator: torch.Generator) -> Tensor:
    return torch.randn(*batch.images.shape[:2], *size, generator=generator).to(batch.images)
