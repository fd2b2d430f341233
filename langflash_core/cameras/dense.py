"""Dense matches between two views from their local features: a second choice where key points fail.

Blank walls give SIFT little; descriptors learned on real photos still tell most cells apart, less
exactly (a cell is about 3 pixels). n matches; h x w cells.
"""

import numpy as np
from jaxtyping import Float

from langflash_core.cameras.matching import mutual
from langflash_core.rig.settings import MATCHING


def match_cells(
    left: Float[np.ndarray, "C h w"], right: Float[np.ndarray, "C h w"]
) -> tuple[Float[np.ndarray, "n 2"], Float[np.ndarray, "n 2"]]:
    """Cells that choose each other, in cell units with centres at +0.5: (n, 2) left, (n, 2) right.

    The right ones are moved to the peak of a parabola through the neighbouring cosines, at most
    half a cell. Cells on the border of the right picture stay where they are.

    Args:
        left, right: unit descriptors (C, h, w) of two pictures.
    """
    height, width = right.shape[1:]
    cosines = left.reshape(len(left), -1).T @ right.reshape(len(right), -1)
    rows, best = mutual(cosines)
    keep = cosines[rows, best] > MATCHING.min_cosine
    rows, best = rows[keep], best[keep]
    own = np.stack((rows % left.shape[2], rows // left.shape[2]), 1) + 0.5
    x, y = best % width, best // width
    inside = (x > 0) & (x < width - 1) & (y > 0) & (y < height - 1)
    middle = np.where(inside, best, width + 1)  # any cell with neighbours
    shifts = [
        _peak(cosines[rows, middle - step], cosines[rows, middle], cosines[rows, middle + step])
        for step in (1, width)
    ]
    return own, np.stack((x, y), 1) + 0.5 + np.where(inside[:, None], np.stack(shifts, 1), 0)


def _peak(before: np.ndarray, at: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Where the parabola through three values at -1, 0, 1 is highest, within half a step."""
    bend = before - 2 * at + after
    return np.clip(np.where(bend < -1e-6, 0.5 * (before - after) / np.minimum(bend, -1e-6), 0), -0.5, 0.5)
