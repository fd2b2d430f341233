"""Straight edges of a photo. H W pixels; the centre of the top-left pixel is (0.5, 0.5)."""

import cv2
import numpy as np
from jaxtyping import Float, UInt8

SHORTEST = 0.03  # of the longer side: shorter ones are texture


def line_segments(grey: UInt8[np.ndarray, "H W"]) -> Float[np.ndarray, "n 4"]:
    """Ends (x0, y0, x1, y1) of the straight edges of a photo, in pixels; none shorter than `SHORTEST`.

    Source: LSD, von Gioi et al. 2010, as OpenCV has it.
    """
    found = cv2.createLineSegmentDetector().detect(np.ascontiguousarray(grey))[0]
    if found is None:
        return np.zeros((0, 4))
    ends = found.reshape(-1, 4).astype(float) + 0.5  # of OpenCV, the first pixel's centre is (0, 0)
    lengths = np.hypot(ends[:, 2] - ends[:, 0], ends[:, 3] - ends[:, 1])
    return ends[lengths >= SHORTEST * max(grey.shape)]
