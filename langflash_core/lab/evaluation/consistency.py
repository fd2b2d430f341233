"""Whether a scene is called the same from all sides: labels of one view carried to another and compared."""

import math

import numpy as np
from jaxtyping import Float, Integer

from langflash_core.lab.evaluation.side_measures import SAME
from langflash_core.lab.rooms.cameras import reproject


def label_consistency(
    labels: Integer[np.ndarray, "V H W"],
    depths: Float[np.ndarray, "V H W"],
    viewmats: Float[np.ndarray, "V 4 4"],
    Ks: Float[np.ndarray, "V 3 3"],
    tolerance: float = SAME,
) -> float:
    """Share of pixels whose surface another view sees and calls the same, over all ordered pairs of views.

    With true depths it judges the names alone; -1 is no label, and such pixels are left out.

    Args:
        depths: z, 0 where unknown, in the unit of `viewmats`.
    """
    same = seen = 0
    height, width = labels.shape[1:]
    for one in range(len(labels)):
        for other in range(len(labels)):
            if one == other:
                continue
            pair = [one, other]
            z, u, v, known = reproject(depths[one], viewmats[pair], Ks[pair])
            inside = known & (z > 0) & (u >= 0) & (v >= 0) & (u < width) & (v < height)
            rows, columns = np.where(inside, v, 0).astype(int), np.where(inside, u, 0).astype(int)
            there = depths[other][rows, columns]
            shared = inside & (there > 0) & (np.abs(there - z) <= tolerance * z)
            shared &= (labels[one] >= 0) & (labels[other][rows, columns] >= 0)
            same += int((labels[one] == labels[other][rows, columns])[shared].sum())
            seen += int(shared.sum())
    return same / seen if seen else math.nan
