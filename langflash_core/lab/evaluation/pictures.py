"""How close a drawn picture is to the photo: SSIM as papers on novel views report it. PSNR is in
`training.measures`, the SSIM of the losses, under a box, in `training.losses`, LPIPS in `lpips`.

Pictures are (H, W, 3) in [0, 1].
"""

import torch
from torch import Tensor
from torch.nn import functional as F

from langflash_core.lab.training.losses import structural_similarity

SIGMA, RADIUS = 1.5, 5
"""Of the Gaussian window: 11 x 11 pixels."""


def ssim(rendered: Tensor, photo: Tensor) -> float:
    """Mean structural similarity with a Gaussian window; in [-1, 1], 1 for equal pictures.

    As scikit-image's `structural_similarity(gaussian_weights=True, sigma=1.5, use_sample_covariance=
    False, data_range=1)`, which leaves the window's radius out at the picture's edges.

    Raises:
        ValueError: the pictures differ in size, or are smaller than the window.

    Source: Wang, Bovik, Sheikh, Simoncelli 2004.
    """
    if rendered.shape != photo.shape or min(photo.shape[:2]) <= 2 * RADIUS:
        sizes = f"{tuple(rendered.shape)}, {tuple(photo.shape)}"
        raise ValueError(f"rendered, photo: expected one size above {2 * RADIUS} pixels, received {sizes}")
    first, second = (p.double().clamp(0, 1).permute(2, 0, 1)[:, None] for p in (rendered, photo))
    return float(structural_similarity(first, second, _smooth).mean())


def _smooth(maps: Tensor) -> Tensor:
    """(C, 1, H, W) under the window, (C, 1, H - 10, W - 10): only where the whole window fits."""
    steps = torch.arange(-RADIUS, RADIUS + 1, dtype=maps.dtype)
    line = torch.exp(-(steps**2) / (2 * SIGMA**2))
    line = line / line.sum()
    return F.conv2d(F.conv2d(maps, line[None, None, :, None]), line[None, None, None, :])
