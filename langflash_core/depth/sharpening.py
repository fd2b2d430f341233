"""Edges of depth where the photo has them: two candidate depths a pixel and a choice between them.

The maps of the sweep are four times coarser than the photo and go smoothly from a thing to the wall
behind it; every pixel of that slope would become a Gaussian in mid-air. Around a pixel the depths
are parted in two at their middle, where what is flat counts and what slopes hardly does. If the two
parts lie further apart than a slanted plane would have them, the pixel belongs to one of them, to
the one whose colours it has, and takes its depth: never a mean of both.

Sizes: V views, H W pixels. Depths are log z.

Source: own derivation; the choice by colour is that of joint bilateral upsampling (Kopf et al. 2007), with
the mode instead of the mean (Min et al. 2012).
"""

import math
from dataclasses import dataclass

import torch
from jaxtyping import Float
from torch import Tensor
from torch.nn import functional as F

from langflash_core.rig.settings import SHARPENING, Sharpening


@dataclass(frozen=True)
class _Parts:
    """Near (first) and far part (second) around every pixel (2, V, H, W): weight, mean, mean square."""

    weights: Tensor
    means: Tensor
    squares: Tensor

    @property
    def spreads(self) -> Tensor:
        return (self.squares - self.means**2).clamp_min(0).sqrt()


def sharpen_depths(
    log_depths: Float[Tensor, "V H W"], images: Float[Tensor, "V 3 H W"], settings: Sharpening = SHARPENING
) -> Float[Tensor, "V H W"]:
    """Log depths (V, H, W) whose edges are where those of the images (V, 3, H, W) in [0, 1] are.

    Where no two depths can be told apart nothing changes.
    """
    places = _places(settings=settings)
    margin = (settings.reach,) * 4
    depths = F.pad(log_depths[:, None], margin, mode="replicate")
    flat = F.pad(_flatness(log_depths, settings=settings)[:, None], margin, mode="replicate")
    middle = (_farthest(depths, settings=settings) - _farthest(-depths, settings=settings))[:, 0] / 2
    first = _part_depths(depths, flat, middle, places, settings=settings)
    middle = first.means.mean(0)
    colours = _colours(images, settings=settings)
    blurred = F.pad(F.avg_pool2d(F.pad(colours, (1,) * 4, mode="replicate"), 3, 1), margin, mode="replicate")
    plain, alike = (
        _part_depths(depths, flat, middle, places, settings=settings),
        _part_depths(depths, flat, middle, places, colours, blurred, settings=settings),
    )
    gap = plain.means[1] - plain.means[0]
    within = ((plain.weights * plain.spreads**2).sum(0) / plain.weights.sum(0)).sqrt()
    two = (
        (gap > settings.least_gap)
        & (gap > settings.parted * within)
        & (plain.weights.amin(0) > settings.least_flat)
    )
    belongs = (alike.weights + settings.floor * plain.weights).log() - plain.weights.log()
    vote = (
        belongs[1]
        - belongs[0]
        + settings.where * ((log_depths - middle) / gap.clamp_min(1e-6) * 2).clamp(-1, 1)
    )
    vote = F.avg_pool2d(F.pad(vote[:, None], (1,) * 4, mode="replicate"), 3, 1)[:, 0]
    return torch.where(two, _take_part(log_depths, vote > 0, plain, alike, settings=settings), log_depths)


def _farthest(depths: Tensor, settings: Sharpening = SHARPENING) -> Tensor:
    """Largest value within `Sharpening.reach` rows and columns, (V, 1, H, W) of padded maps."""
    side = 2 * settings.reach + 1
    return F.max_pool2d(F.max_pool2d(depths, (side, 1), 1), (1, side), 1)


def _take_part(
    log_depths: Tensor, far: Tensor, plain: _Parts, alike: _Parts, settings: Sharpening = SHARPENING
) -> Tensor:
    """The depth of the part that a pixel belongs to; its own where that lies within the part."""
    chosen = [
        torch.where(far, of[1], of[0]) for of in (plain.means, plain.spreads, alike.means, alike.weights)
    ]
    mean, spread, own, known = chosen
    target = torch.where(known > settings.floor, own, mean)
    reach = 2 * spread + 0.01
    return torch.where((log_depths - mean).abs() <= reach, log_depths, target)


def _places(settings: Sharpening = SHARPENING) -> list[tuple[int, int]]:
    """(row, column) on rings, each turned against the one before, and the pixel itself."""
    found = [(0, 0)]
    for turn, (radius, count) in enumerate(settings.rings):
        angles = [2 * math.pi * (i + 0.5 * (turn % 2)) / count for i in range(count)]
        found += [(round(radius * math.sin(a)), round(radius * math.cos(a))) for a in angles]
    return found


def _flatness(log_depths: Tensor, settings: Sharpening = SHARPENING) -> Tensor:
    """(V, H, W) in (0, 1]: 1 where depth does not change, 1/2 at a slope of `Sharpening.flat` a pixel."""
    wide = F.pad(log_depths[:, None], (1,) * 4, mode="replicate")[:, 0]
    across, down = wide[:, 1:-1, 2:] - wide[:, 1:-1, :-2], wide[:, 2:, 1:-1] - wide[:, :-2, 1:-1]
    return 1 / (1 + (across**2 + down**2) / (2 * settings.flat) ** 2)


def _colours(images: Tensor, settings: Sharpening = SHARPENING) -> Tensor:
    """(V, 4, H, W): light, and how each colour differs from it."""
    light = images.mean(1, keepdim=True)
    return torch.cat((light, settings.chroma * (images - light)), 1)


def _part_depths(
    depths: Tensor,
    flat: Tensor,
    middle: Tensor,
    places: list[tuple[int, int]],
    colours: Tensor | None = None,
    blurred: Tensor | None = None,
    settings: Sharpening = SHARPENING,
) -> _Parts:
    """What lies nearer and farther than the middle; with colours, what also looks like the pixel."""
    height, width = middle.shape[-2:]
    sums = middle.new_zeros(3, 2, *middle.shape)
    for row, column in places:
        rows, columns = (
            slice(settings.reach + row, settings.reach + row + height),
            slice(settings.reach + column, settings.reach + column + width),
        )
        weight = flat[:, 0, rows, columns] * math.exp(-(row**2 + column**2) / (2 * settings.nearby**2))
        if colours is not None and blurred is not None:
            around = blurred[:, :, rows, columns]
            differs = torch.zeros_like(weight)
            for theirs, own in zip(around.unbind(1), colours.unbind(1), strict=True):
                differs += (theirs - own) ** 2
            weight = weight * torch.exp(
                (differs * (-0.5 / settings.colour**2)).clamp_min(settings.least_exponent)
            )
        depth = depths[:, 0, rows, columns]
        nearer = torch.where(depth < middle, weight, torch.zeros_like(weight))
        for part, share in enumerate((nearer, weight - nearer)):
            sums[0, part] += share
            sums[1, part] += share * depth
            sums[2, part] += share * depth * depth
    weights = sums[0] + 1e-6
    means = (sums[1] + 1e-6 * middle) / weights
    return _Parts(weights, means, (sums[2] + 1e-6 * middle**2) / weights)
