"""A labelled photo at the size the network sees: picture, maps and intrinsics cut and scaled together.

A window is (left, top, right, bottom) in continuous pixels of the photo, as in `images.views`.
"""

from dataclasses import dataclass

import numpy as np
import torch
from PIL import Image
from torch import Tensor

from langflash_core.geometry.cameras import intrinsics_from_fov
from langflash_core.images.pictures import Box, centre_box, fitting_size
from langflash_core.images.settings import LENS_PRIOR
from langflash_core.images.views import cropped_intrinsics
from langflash_core.lab.photos.folder import LabelledPhoto

SMALLEST_WINDOW = 0.5
"""Share of a photo's area that a drawn window shows at least."""


@dataclass(frozen=True)
class FittedPhoto:
    """rgb (3, H, W) uint8; labels (H, W) int64, 0 = not labelled; depths (H, W) float32, 0 = unknown;
    K (3, 3); opinions (H, W) int64, -1 = none."""

    rgb: Tensor
    labels: Tensor
    depths: Tensor
    K: Tensor
    opinions: Tensor


def network_size(photo: LabelledPhoto, area: int, multiple: int) -> tuple[int, int]:
    """(width, height) at which the network sees a photo of this shape."""
    height, width = photo.image.shape[:2]
    return fitting_size(width, height, area, multiple)


def fitted(
    photo: LabelledPhoto, size: tuple[int, int], window: Box | None = None, mirrored: bool = False
) -> FittedPhoto:
    """One photo through a window at `size` (width, height); the centre where none is given.

    Maps take the nearest value; what is not known (no maps, no intrinsics) becomes 0 and a lens of 65
    degrees. mirrored: left and right change places, also in the intrinsics.
    """
    height, width = photo.image.shape[:2]
    left, top, right, bottom = centre_box(width, height, size) if window is None else window
    box = max(left, 0.0), max(top, 0.0), min(right, width), min(bottom, height)  # rounding may lead outside
    pixels = Image.fromarray(photo.image).resize(size, Image.Resampling.LANCZOS, box=box, reducing_gap=3.0)
    rgb = torch.from_numpy(np.array(pixels)).permute(2, 0, 1).contiguous()
    K = intrinsics_from_fov(LENS_PRIOR.assumed_fov, width, height) if photo.K is None else photo.K
    K = cropped_intrinsics(K, box, size)
    empty = np.zeros((height, width), dtype=np.float32)
    labels = seen_through(empty.astype(np.int64) if photo.labels is None else photo.labels, box, size)
    depths = seen_through(empty if photo.depths is None or not photo.metric else photo.depths, box, size)
    silent = torch.full((size[1], size[0]), -1)
    opinions = silent if photo.opinions is None else seen_through(photo.opinions, box, size)
    if mirrored:
        rgb, labels, depths, opinions = (map.flip(-1) for map in (rgb, labels, depths, opinions))
        K = K.clone()
        K[0, 2] = size[0] - K[0, 2]
    return FittedPhoto(rgb, labels, depths, K, opinions)


def drawn_window(photo: LabelledPhoto, size: tuple[int, int], seed: int) -> tuple[Box, bool]:
    """A random window of the shape of `size` inside a photo, and whether to mirror it; the same seed
    gives the same."""
    share, across, down, side = torch.rand(4, generator=torch.Generator().manual_seed(seed)).tolist()
    height, width = photo.image.shape[:2]
    left, top, right, bottom = centre_box(width, height, size)
    factor = (SMALLEST_WINDOW + (1 - SMALLEST_WINDOW) * share) ** 0.5
    wide, high = (right - left) * factor, (bottom - top) * factor
    x, y = across * (width - wide), down * (height - high)
    return (x, y, x + wide, y + high), side < 0.5


def seen_through(values: np.ndarray, box: Box, size: tuple[int, int]) -> Tensor:
    """A map (H, W) through a window at `size` (width, height): the value under each pixel's centre."""
    left, top, right, bottom = box
    columns = left + (np.arange(size[0]) + 0.5) * (right - left) / size[0]
    rows = top + (np.arange(size[1]) + 0.5) * (bottom - top) / size[1]
    x = np.floor(columns).astype(int).clip(0, values.shape[1] - 1)
    y = np.floor(rows).astype(int).clip(0, values.shape[0] - 1)
    return torch.from_numpy(np.ascontiguousarray(values[np.ix_(y, x)]))
