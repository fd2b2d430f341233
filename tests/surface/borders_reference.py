"""Slow twins of `surface.borders`: lines as dense systems, places one by one, all in float64. The bilateral
filter is the library's own."""

import numpy as np
import torch
from torch import Tensor

from langflash_core.surface.borders import BorderRule, denoise


def plain_smoothed(weights: np.ndarray, image: np.ndarray, rule: BorderRule) -> np.ndarray:
    """Weights (K, H, W) >= 0 after the rounds of rows and columns; image (3, H, W)."""
    values = weights.astype(np.float64)
    values = values**rule.sharpness / (values**rule.sharpness).sum(0)
    picture = denoise(image, rule.noise).astype(np.float64)
    _, height, width = picture.shape
    down = np.linalg.norm(picture[:, 1:] - picture[:, :-1], axis=0)
    across = np.linalg.norm(picture[:, :, 1:] - picture[:, :, :-1], axis=0)
    steps = np.concatenate((down.ravel(), across.ravel()))
    sigma = max(rule.edge * steps.mean(), 1e-6) if len(steps) else 1.0
    for turn in range(rule.rounds):
        reach = rule.reach * 1.5 * 4.0 ** (rule.rounds - 1 - turn) / (4.0**rule.rounds - 1)
        for row in range(height):
            system = _system(reach * np.exp(-across[row] / sigma))
            values[:, row] = np.linalg.solve(system, values[:, row].T).T
        for column in range(width):
            system = _system(reach * np.exp(-down[:, column] / sigma))
            values[:, :, column] = np.linalg.solve(system, values[:, :, column].T).T
    return values


def _system(couplings: np.ndarray) -> np.ndarray:
    """I + the Laplacian of a line."""
    system = np.eye(len(couplings) + 1)
    for i, coupling in enumerate(couplings):
        system[i, i] += coupling
        system[i + 1, i + 1] += coupling
        system[i, i + 1] -= coupling
        system[i + 1, i] -= coupling
    return system


def plain_read(grid: np.ndarray, image: Tensor, photo: Tensor, row: int, column: int, colour: float):
    """Weights (K,) of the grid (H, W, K) at one pixel of the photo."""
    height, width, _ = grid.shape
    y = min(max((row + 0.5) * height / photo.shape[1] - 0.5, 0), height - 1)
    x = min(max((column + 0.5) * width / photo.shape[2] - 0.5, 0), width - 1)
    own, total, shares = photo[:, row, column].double().numpy(), 0.0, 0.0
    for i in {int(y), min(int(y) + 1, height - 1)}:
        for j in {int(x), min(int(x) + 1, width - 1)}:
            apart = np.square(image[:, i, j].double().numpy() - own).sum()
            share = (1 - abs(y - i)) * (1 - abs(x - j)) * (np.exp(-apart / (2 * colour**2)) + 1e-6)
            total, shares = total + share * grid[i, j], shares + share
    return total / shares


def picture(height: int, width: int, seed: int = 3) -> Tensor:
    """A photo (3, height, width): two colours that meet at a slope, and noise."""
    rows, columns = torch.meshgrid(torch.arange(height), torch.arange(width), indexing="ij")
    side = (columns / width > 0.35 + 0.2 * rows / height).float()
    noise = torch.rand(3, height, width, generator=torch.Generator().manual_seed(seed))
    return (0.3 + 0.4 * side + 0.05 * noise).clamp(0, 1)
