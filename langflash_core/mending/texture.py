"""A hole in a flat picture, filled by what is around it: its colours run in from the edge, its texture is
copied from beside the hole.

Of all shifts of the hole onto known pixels the one is taken that fits best along the edge. What its edge
differs by from the true one is carried inwards as smoothly as colours are, and added: so no seam shows.
Source: own; the healing of Perez et al. 2003, "Poisson image editing", with the pull-push of `scene.gaps` as
the smooth interpolation.

Sizes: H W pixels.
"""

import cv2
import numpy as np
import torch
from jaxtyping import Bool, Float
from scipy import ndimage

from langflash_core.mending.settings import TEXTURE
from langflash_core.scene.gaps import fill_gaps


def heal(
    colours: Float[np.ndarray, "H W 3"], known: Bool[np.ndarray, "H W"], hole: Bool[np.ndarray, "H W"]
) -> Float[np.ndarray, "H W 3"]:
    """Colours with the hole filled; the rest as it was, and what is neither known nor hole as smooth as it.

    Args:
        colours: in [0, 1]; those that are not known are not looked at.
    """
    smooth = diffuse(colours, known)
    result = np.where(known[..., None], colours, smooth)
    shift = _best_shift(result, known, hole)
    if shift is None:
        return result
    copied = np.roll(result, shift, (0, 1))
    band = known & np.roll(known, shift, (0, 1)) & _around(hole)
    missing = diffuse(result - copied + 1, band) - 1  # above 0, as colours are
    result[hole] = np.clip(copied + missing, 0, 1)[hole]
    return result


def diffuse(values: Float[np.ndarray, "H W n"], known: Bool[np.ndarray, "H W"]) -> Float[np.ndarray, "H W n"]:
    """Values carried from where they are known to everywhere, smoothly; 0 where nothing is known at all."""
    if not known.any():
        return np.zeros_like(values)
    side = 1 << int(np.ceil(np.log2(max(known.shape))))  # as many steps as reach across
    square = np.zeros((2 * side, 2 * side, 4), np.float32)
    square[: known.shape[0], : known.shape[1], 3] = known
    square[: known.shape[0], : known.shape[1], :3] = np.where(known[..., None], values, 0)
    whole = torch.from_numpy(square)
    near, weight = (
        fill_gaps(each, whole[..., 3]).numpy()[: known.shape[0], : known.shape[1]]
        for each in (whole[..., :3], whole[..., 3:].expand(-1, -1, 3))
    )
    nearest = ndimage.distance_transform_edt(~known, return_distances=False, return_indices=True)
    fallback = values[tuple(np.asarray(nearest))]
    return np.where(weight > 0.5, near / np.maximum(weight, 1e-6), fallback)


def _around(hole: Bool[np.ndarray, "H W"]) -> Bool[np.ndarray, "H W"]:
    size = 2 * TEXTURE.band + 1
    wider = cv2.dilate(hole.astype(np.uint8), np.ones((size, size), np.uint8)) > 0
    return wider & ~hole


def _best_shift(
    colours: Float[np.ndarray, "H W 3"], known: Bool[np.ndarray, "H W"], hole: Bool[np.ndarray, "H W"]
) -> tuple[int, int] | None:
    """Rows and columns by which known pixels are moved onto the hole; None where none are enough."""
    rows, columns = np.nonzero(hole | (_around(hole) & known))
    band = _around(hole)[rows, columns]
    if not band.any():
        return None
    best, cost = None, np.inf
    height, width = hole.shape
    for down in np.unique(np.linspace(-height, height, 2 * TEXTURE.steps + 1).astype(int)):
        for right in np.unique(np.linspace(-width, width, 2 * TEXTURE.steps + 1).astype(int)):
            y, x = rows - down, columns - right
            inside = (y >= 0) & (y < height) & (x >= 0) & (x < width)
            if inside.mean() < TEXTURE.known:
                continue
            there = inside.copy()
            there[inside] = known[y[inside], x[inside]]
            if there.mean() < TEXTURE.known:
                continue
            fit = there & band
            apart = colours[rows[fit], columns[fit]] - colours[y[fit], x[fit]]
            here = float(apart.var(0).sum()) + 0.1 * float((apart.mean(0) ** 2).sum())
            if here < cost:
                best, cost = (int(down), int(right)), here
    return best
