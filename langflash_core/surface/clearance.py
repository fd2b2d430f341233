"""How far a surface goes on before it ends over a farther one. Elements near such an end must be small: what
hangs over it would lie before what is behind, at a depth where nothing is.

Sizes: h w pixels of the photo.
"""

import cv2
import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor
from torch.nn import functional as F

from langflash_core.surface.settings import UPSAMPLING


def clearances(log_depths: Float[Tensor, "h w"]) -> Float[Tensor, "h w"]:
    """(h, w) pixels from the middle of each to the nearest end of a surface, at least a half; endless where
    that is the end of a nearer one, behind which its own goes on.

    Args:
        log_depths: (h, w).
    """
    ends = _ends(log_depths)
    if not bool(ends.any()):
        return torch.full_like(log_depths, torch.inf)
    distances, labels = cv2.distanceTransformWithLabels(
        (~ends).numpy().astype(np.uint8), cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL
    )
    there = torch.from_numpy(labels)
    of_label = log_depths.new_zeros(int(there.max()) + 1)
    of_label[there[ends].long()] = log_depths[ends]
    behind = log_depths - of_label[there.long()] > UPSAMPLING.jump
    return torch.where(behind, torch.inf, torch.from_numpy(distances) + 0.5)


def _ends(log_depths: Tensor) -> Tensor:
    """(h, w) bool: the last pixels of a surface before a farther one."""
    wide = F.pad(log_depths[None, None], (1,) * 4, mode="replicate")[0, 0]
    beside = (wide[1:-1, 2:], wide[1:-1, :-2], wide[2:, 1:-1], wide[:-2, 1:-1])
    return torch.stack([other - log_depths > UPSAMPLING.jump for other in beside]).any(0)
