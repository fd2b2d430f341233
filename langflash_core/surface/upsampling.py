"""Depth of the network's grid at the photo's size: guided by the photo, cut at edges, never blended across.

Where a cell and its neighbours are one surface, inverse depth is interpolated (of a plane, that is exact).
Where depth jumps or falls steeply, a pixel takes the depth of one cell, the one whose colour it has,
continued by that cell's own slope.

Sizes: H W cells of the grid, h w pixels of the photo.

Source: own; the choice by colour is that of joint bilateral upsampling (Kopf et al. 2007), with the best
cell instead of the mean.
"""

from dataclasses import dataclass

import torch
from jaxtyping import Float, Int
from torch import Tensor
from torch.nn import functional as F

from langflash_core.surface.settings import UPSAMPLING


@dataclass(frozen=True)
class Upsampled:
    """log_depths (h, w); cells (h, w) int64, row by row, the cell of the grid that each pixel belongs to;
    slopes (H, W), log depth from a cell to the next along its steepest way, of the nearer side of a jump."""

    log_depths: Float[Tensor, "h w"]
    cells: Int[Tensor, "h w"]
    slopes: Float[Tensor, "H W"]


def upsample_depths(
    log_depths: Float[Tensor, "H W"], image: Float[Tensor, "3 H W"], photo: Float[Tensor, "3 h w"]
) -> Upsampled:
    """Log depths (H, W) at the size of the photo.

    Args:
        image: (3, H, W) in [0, 1]. photo: (3, h, w), the same crop, h >= H and w >= W.
    """
    height, width = photo.shape[-2:]
    inverse = (-log_depths).exp()
    steps = _shorter(inverse, 1), _shorter(inverse, 0)
    across, down = (torch.where(step.abs() > UPSAMPLING.steepest * inverse, 0.0, step) for step in steps)
    rows = _cells_along(height, log_depths.shape[0])
    columns = _cells_along(width, log_depths.shape[1])
    cells = rows[:, None] * log_depths.shape[1] + columns
    smooth = F.interpolate(inverse[None, None], size=(height, width), mode="bilinear")[0, 0]
    smooth += down[rows][:, columns] * _past(height, log_depths.shape[0])[:, None]
    smooth += across[rows][:, columns] * _past(width, log_depths.shape[1])
    y, x = _broken(log_depths, (across.abs() + down.abs()) / inverse)[rows][:, columns].nonzero(as_tuple=True)
    if len(y):
        chosen, values = _choose_cells(inverse, across, down, image, photo, (y, x), (rows[y], columns[x]))
        smooth[y, x], cells[y, x] = values, chosen
    return Upsampled(-smooth.clamp_min(1e-9).log(), cells, torch.hypot(*steps) / inverse)


def _middles(pixels: int, cells: int) -> Tensor:
    """Of pixels, in cells."""
    return (torch.arange(pixels) + 0.5) * cells / pixels


def _cells_along(pixels: int, cells: int) -> Tensor:
    return _middles(pixels, cells).floor().long().clamp(0, cells - 1)


def _past(pixels: int, cells: int) -> Tensor:
    """Cells that pixels lie beyond the middles of the first cell and the last."""
    middles = _middles(pixels, cells)
    return middles - middles.clamp(0.5, cells - 0.5)


def _shorter(values: Tensor, dim: int) -> Tensor:
    """The smaller of the steps to the next cell and from the one before."""
    steps = values.diff(dim=dim)
    if not steps.shape[dim]:
        return torch.zeros_like(values)
    after = torch.cat((steps, steps.narrow(dim, -1, 1)), dim)
    before = torch.cat((steps.narrow(dim, 0, 1), steps), dim)
    return torch.where(after.abs() < before.abs(), after, before)


def _broken(log_depths: Tensor, slope: Tensor) -> Tensor:
    """(H, W) bool: the cell and its eight neighbours are more than one surface, or the way between two."""
    wide = F.pad(log_depths[None, None], (1,) * 4, mode="replicate")
    span = F.max_pool2d(wide, 3, 1) + F.max_pool2d(-wide, 3, 1)
    return (span[0, 0] > UPSAMPLING.jump + 3 * slope) | (slope > UPSAMPLING.steep)


def _choose_cells(
    inverse: Tensor,
    across: Tensor,
    down: Tensor,
    image: Tensor,
    photo: Tensor,
    pixels: tuple[Tensor, Tensor],
    own: tuple[Tensor, Tensor],
) -> tuple[Tensor, Tensor]:
    """Cell and inverse depth (n,) of pixels at (rows, columns) whose own cells are at (rows, columns)."""
    height, width = inverse.shape
    y = (pixels[0] + 0.5) * height / photo.shape[-2]
    x = (pixels[1] + 0.5) * width / photo.shape[-1]
    colours, grid = photo[:, pixels[0], pixels[1]], image.flatten(1)
    steep = ((across.square() + down.square()) / (inverse * UPSAMPLING.steep).square()).flatten()
    best, cells, values = torch.full_like(y, torch.inf), torch.zeros_like(own[0]), torch.zeros_like(y)
    for row in (own[0] - 1, own[0], own[0] + 1):
        for column in (own[1] - 1, own[1], own[1] + 1):
            at_row, at_column = row.clamp(0, height - 1), column.clamp(0, width - 1)
            cell = at_row * width + at_column
            to_y, to_x = y - at_row - 0.5, x - at_column - 0.5
            differs = (grid[:, cell] - colours).square().sum(0) / (6 * UPSAMPLING.colour**2)
            cost = differs + (to_y**2 + to_x**2) / (2 * UPSAMPLING.reach**2) + steep[cell]
            there = inverse.flatten()[cell]
            value = there + across.flatten()[cell] * to_x + down.flatten()[cell] * to_y
            value = value.clamp(there * (1 - UPSAMPLING.farthest), there * (1 + UPSAMPLING.farthest))
            better = cost < best
            best = torch.where(better, cost, best)
            cells, values = torch.where(better, cell, cells), torch.where(better, value, values)
    return cells, values
