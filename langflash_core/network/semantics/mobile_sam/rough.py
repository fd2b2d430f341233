"""A rough mask as a prompt: its middle, its box, and which answer is the thing that it meant. H W pixels."""

import cv2
import numpy as np
from jaxtyping import Bool, Float64

_BORDER = 0.06  # of the frame: nearer to its edge, a thing may go on there


def middle(mask: Bool[np.ndarray, "H W"]) -> tuple[float, float]:
    """The pixel (x, y) that lies deepest inside."""
    deep = cv2.distanceTransform(np.pad(mask, 1).astype(np.uint8), cv2.DIST_L2, 3)
    y, x = np.unravel_index(int(deep.argmax()), deep.shape)
    return float(x) - 0.5, float(y) - 0.5


def box(mask: Bool[np.ndarray, "H W"]) -> tuple[float, float, float, float]:
    """Left, top, right, bottom, up to the frame's edge where the mask comes near it."""
    height, width = mask.shape
    rows, columns = np.flatnonzero(mask.any(1)), np.flatnonzero(mask.any(0))
    margin = _BORDER * max(mask.shape)
    left, top, right, bottom = columns[0], rows[0], columns[-1] + 1, rows[-1] + 1
    return (
        0.0 if left < margin else float(left),
        0.0 if top < margin else float(top),
        float(width) if right > width - margin else float(right),
        float(height) if bottom > height - margin else float(bottom),
    )


def agreement(
    found: Bool[np.ndarray, "n k H W"], rough: Bool[np.ndarray, "n H W"], known: Bool[np.ndarray, "H W"]
) -> Float64[np.ndarray, "n k"]:
    """IoU of found masks with rough ones, on known pixels."""
    both = (found & rough[:, None] & known).sum((2, 3))
    either = ((found | rough[:, None]) & known).sum((2, 3))
    return both / np.maximum(either, 1)
