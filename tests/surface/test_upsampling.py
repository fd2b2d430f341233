"""Depth at the photo's size: exact on planes, one side or the other at edges, by the photo's colours."""

import math

import numpy as np
import pytest
import torch
from torch import Tensor

from langflash_core.surface.upsampling import upsample_depths

SIZES = [((9, 12), (27, 36)), ((9, 12), (9, 12)), ((7, 10), (17, 24)), ((6, 5), (12, 15)), ((8, 8), (19, 8))]
FLOAT32 = 1e-5  # log depth: some tens of float32 roundings of numbers about 1


def inverse_plane(size: tuple[int, int], of: tuple[int, int], slopes: tuple[float, float]) -> Tensor:
    """1 / z of a plane at `size` pixels of a grid `of` cells: linear in the picture, .5 in its middle, with
    slopes (across, down) a cell."""
    y = (torch.arange(size[0]).double() + 0.5) * of[0] / size[0] - of[0] / 2
    x = (torch.arange(size[1]).double() + 0.5) * of[1] / size[1] - of[1] / 2
    return 0.5 + slopes[0] * x + slopes[1] * y[:, None]


def two_sides(columns: Tensor, edge: float, near: float = 1.0, far: float = 2.0) -> Tensor:
    return torch.where(columns < edge, near, far)


@pytest.mark.parametrize(("grid", "size"), SIZES)
@pytest.mark.parametrize("slopes", [(0.0, 0.0), (0.01, 0.0), (-0.004, 0.02), (0.01, 0.01)])
def test_a_plane_is_exact(grid, size, slopes):
    """To its outermost pixels, whatever the ratio: inverse depth is linear in the picture."""
    depth = upsample_depths(
        -inverse_plane(grid, grid, slopes).log().float(), torch.rand(3, *grid), torch.rand(3, *size)
    )
    expected = -inverse_plane(size, grid, slopes).log()
    assert depth.log_depths.shape == depth.cells.shape == size and depth.slopes.shape == grid
    assert float((depth.log_depths - expected).abs().max()) < FLOAT32
    inverse = inverse_plane(grid, grid, slopes)
    assert torch.allclose(depth.slopes.double(), math.hypot(*slopes) / inverse, atol=FLOAT32)


@pytest.mark.parametrize("ratio", [1, 2, 3])
@pytest.mark.parametrize("edge", [1, 2, 5, 11])
def test_at_an_edge_every_pixel_has_the_depth_of_the_side_whose_colour_it_has(ratio, edge):
    """The photo's edge lies a pixel beside the cells'; the first and the last cell are edges like others."""
    grid, size = (6, 12), (6 * ratio, 12 * ratio)
    moved = edge * ratio + (1 if ratio > 1 else 0)
    columns, pixels = torch.arange(12).expand(*grid), torch.arange(size[1]).expand(*size)
    image = two_sides(columns, edge, 0.2, 0.8).expand(3, *grid)
    photo = two_sides(pixels, moved, 0.2, 0.8).expand(3, *size)
    depth = upsample_depths(two_sides(columns, edge).log(), image, photo)
    assert torch.allclose(depth.log_depths, two_sides(pixels, moved).log(), atol=FLOAT32)
    assert torch.equal(depth.cells % 12 < edge, pixels < moved)


@pytest.mark.parametrize("grid", [(1, 1), (1, 5), (5, 1), (2, 2)])
def test_a_cell_a_row_a_column(grid):
    size = (3 * grid[0], 2 * grid[1])
    depth = upsample_depths(torch.full(grid, 0.3), torch.rand(3, *grid), torch.rand(3, *size))
    assert torch.allclose(depth.log_depths, torch.full(size, 0.3), atol=FLOAT32)
    assert torch.equal(depth.slopes, torch.zeros(grid))
    assert int(depth.cells.min()) == 0 and int(depth.cells.max()) == grid[0] * grid[1] - 1


def step(inverse: np.ndarray, row: int, column: int, dim: int) -> float:
    """The smaller of the steps to the neighbours along a dimension; 0 for more than a fifth: a jump."""
    steps = []
    for sign in (1, -1):
        other = [row, column]
        other[dim] += sign
        if 0 <= other[dim] < inverse.shape[dim]:
            steps.append(sign * (inverse[other[0], other[1]] - inverse[row, column]))
    smaller = min(steps, key=abs, default=0.0)
    return smaller if abs(smaller) <= 0.2 * inverse[row, column] else 0.0


def plain_chosen(logs: np.ndarray, image: np.ndarray, photo: np.ndarray, y: int, x: int) -> tuple[int, float]:
    """Cell and inverse depth of one pixel beside a jump: of the nine cells around the one it lies in, the
    one that is likest in colour and nearest, standard deviations .06 of a channel and .6 cells, and falls
    least steeply, 4 % a cell."""
    inverse, (height, width) = np.exp(-logs), logs.shape
    at_y, at_x = (y + 0.5) * height / photo.shape[1], (x + 0.5) * width / photo.shape[2]
    best, found = math.inf, (0, 0.0)
    for row in range(max(int(at_y) - 1, 0), min(int(at_y) + 2, height)):
        for column in range(max(int(at_x) - 1, 0), min(int(at_x) + 2, width)):
            to_y, to_x = at_y - row - 0.5, at_x - column - 0.5
            cost = ((image[:, row, column] - photo[:, y, x]) ** 2).sum() / 3 / (2 * 0.06**2)
            cost += (to_y**2 + to_x**2) / (2 * 0.6**2)
            across, down = step(inverse, row, column, 1), step(inverse, row, column, 0)
            cost += (across**2 + down**2) / (0.04 * inverse[row, column]) ** 2
            if cost < best:
                there = inverse[row, column]
                value = there + across * to_x + down * to_y
                best, found = cost, (row * width + column, min(max(value, 0.9 * there), 1.1 * there))
    return found


@pytest.mark.parametrize(("grid", "size"), [((8, 10), (24, 30)), ((8, 10), (11, 23)), ((8, 10), (8, 10))])
def test_it_agrees_with_its_twin_pixel_by_pixel(grid, size):
    """Patches of 2 x 2 cells, so that each pixel is near a jump and chooses. Float32 against float64: 1e-5
    of log depth; no two costs are as near as their rounding."""
    torch.manual_seed(2)
    patches = (torch.arange(grid[0])[:, None] + 1) // 2 + (torch.arange(grid[1]) + 1) // 2
    logs = patches % 3 + 0.1 * torch.rand(grid)
    image, photo = torch.rand(3, *grid), torch.rand(3, *size)
    depth = upsample_depths(logs, image, photo)
    arrays = [values.double().numpy() for values in (logs, image, photo)]
    for y in range(size[0]):
        for x in range(size[1]):
            cell, inverse = plain_chosen(arrays[0], arrays[1], arrays[2], y, x)
            assert int(depth.cells[y, x]) == cell
            assert float(depth.log_depths[y, x]) == pytest.approx(-math.log(inverse), abs=FLOAT32)
