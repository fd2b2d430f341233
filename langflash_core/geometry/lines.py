"""Straight edges of a photo. H W pixels; the centre of the top-left pixel is (0.5, 0.5)."""

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from langflash_core.types import Camera

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


def edge_planes(
    grey: UInt8[np.ndarray, "H W"], camera: Camera
) -> tuple[Float[np.ndarray, "L 3"], Float[np.ndarray, " L"]]:
    """Unit normals, in the world, of the planes through the camera and a photo's straight edges; the edges'
    lengths, in longer sides of the photo."""
    ends = line_segments(grey)
    inverse = np.linalg.inv(camera.K.double().numpy())
    first, last = (
        np.concatenate((ends[:, at : at + 2], np.ones((len(ends), 1))), 1) @ inverse.T for at in (0, 2)
    )
    normals = np.cross(first, last)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    lengths = np.hypot(ends[:, 2] - ends[:, 0], ends[:, 3] - ends[:, 1]) / max(grey.shape)
    return normals @ camera.viewmat[:3, :3].double().numpy(), lengths
