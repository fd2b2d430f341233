"""How far away is what a camera looks at."""

import numpy as np
from jaxtyping import Float

from langflash_core.geometry.pinhole import see

MIN_REACH = 0.02
"""Scene units; what is nearer is inside the lens."""
_ENOUGH = 200_000  # Gaussians that tell a median: of ten million and 80 photos all of them took half a minute


def median_reach(
    means: Float[np.ndarray, "N 3"],
    viewmat: Float[np.ndarray, "4 4"],
    K: Float[np.ndarray, "3 3"],
    size: tuple[int, int],
) -> float:
    """Median depth of what lies in the middle half of a view: the distance to orbit at.

    Args:
        means: (N, 3) world. viewmat: (4, 4) world to camera. K: (3, 3). size: (width, height).

    Returns:
        Depth in scene units; 1, the scene's own unit, when nothing is in front.
    """
    means = means[:: 1 + len(means) // _ENOUGH]
    x, y, z, inside = see(means, viewmat, K, size, MIN_REACH)
    middle = inside & (abs(x / size[0] - 0.5) < 0.25) & (abs(y / size[1] - 0.5) < 0.25)
    return float(np.median(z[middle])) if middle.any() else 1.0
