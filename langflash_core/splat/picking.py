"""What a person points at: the Gaussians that some pixels show, and what one pixel is made of."""

import numpy as np
import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor

from langflash_core.types import Camera, Gaussians, Semantics

from .contributions import composition, contributions
from .projection import Footprints, project

SEEN = 0.05  # of a pixel's colour: a Gaussian that adds less anywhere in a region is not seen there


def seen_in(
    gaussians: Gaussians,
    visible: Bool[np.ndarray, " N"],
    camera: Camera,
    pixels: Bool[np.ndarray, "H W"],
    *,
    through: bool = False,
) -> Bool[np.ndarray, " N"]:
    """Gaussians that add at least `SEEN` to some of the pixels.

    Args:
        visible: (N,) bool, what takes part: the rest neither covers nor is found.
        pixels: (H, W) bool, of the camera's size.
        through: also what is hidden behind other things.

    Returns:
        (N,) bool.

    Raises:
        ValueError: the pixels are not of the camera's size.
    """
    rows, shown = _shown(gaussians, visible)
    shares = contributions(shown, camera, torch.from_numpy(pixels), through=through)
    found = np.zeros(len(visible), bool)
    found[rows[shares >= SEEN].numpy()] = True
    return found


def projected(
    gaussians: Gaussians, visible: Bool[np.ndarray, " N"], camera: Camera
) -> tuple[Int[Tensor, " n"], Footprints]:
    """Rows (n,) of what is visible, and their footprints in a view; for any number of `weights_at`."""
    rows, shown = _shown(gaussians, visible)
    return rows, project(shown, camera)


def weights_at(
    semantics: Semantics, rows: Int[Tensor, " n"], footprints: Footprints, x: int, y: int
) -> Float[Tensor, " K"]:
    """Weights (K,) float32 of a pixel, W_k = sum_i T_i alpha_i w_ik, composed exactly.

    Args:
        rows, footprints: as `projected` gives them.
    """
    here, shares = composition(footprints, x, y)
    weights = torch.zeros(semantics.num_atoms, dtype=torch.float64)
    ids, values = semantics.weight_ids[rows[here]], semantics.weight_values[rows[here]]
    weights.index_add_(0, ids.flatten(), (values * shares[:, None]).flatten())
    return weights.float()


def _shown(gaussians: Gaussians, visible: np.ndarray) -> tuple[Tensor, Gaussians]:
    rows = torch.from_numpy(np.flatnonzero(visible))
    return rows, gaussians.map(lambda values: values[rows].double())
