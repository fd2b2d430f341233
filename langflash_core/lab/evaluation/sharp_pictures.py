"""Close-ups of what a photo and scenes show of the same place, to judge sharpness by eye. H W pixels."""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float, UInt8
from torch import Tensor
from torch.nn import functional as F

from langflash_core.lab.evaluation.sharp_measures import fine, grey_of
from langflash_core.lab.evaluation.sights import Sight, photo_picture

TIMES = 3
"""A close-up shows a third of the picture's width and height, each pixel as 3 x 3."""


def busiest_corner(photo: Float[Tensor, "H W 3"], height: int, width: int) -> tuple[int, int]:
    """(top, left) of the window of that size, at least 3 x 3 pixels, with the most fine detail."""
    energy = fine(grey_of(photo)).square()[None, None]
    means = F.avg_pool2d(energy, (height - 2, width - 2), stride=1)[0, 0]
    place = int(means.argmax())
    return place // means.shape[1], place % means.shape[1]


def closeups(pictures: Mapping[str, Tensor], times: int = TIMES) -> dict[str, UInt8[np.ndarray, "H W 3"]]:
    """The same window of every picture, where the first one has the most detail, each pixel `times` wide.

    Args:
        pictures: (H, W, 3) in [0, 1] by title, of one size, the photo first.
    """
    photo = next(iter(pictures.values()))
    height, width = (max(3, side // TIMES) for side in photo.shape[:2])
    top, left = busiest_corner(photo, height, width)
    return {
        title: photo_picture(rgb[top : top + height, left : left + width])
        .repeat(times, axis=0)
        .repeat(times, axis=1)
        for title, rgb in pictures.items()
    }


def sharp_sight(name: str, pictures: Mapping[str, Tensor], row: Mapping, way: str) -> Sight:
    """A subject for a report: close-ups, with the numbers of one way from the photos' own places."""
    found = row["columns"][way]["photos"]
    numbers = {key: found[key] for key in ("psnr", "lpips", "detail", "opaque") if found.get(key) is not None}
    return Sight(name, name, closeups(pictures, 1), numbers, numbers.get("psnr", 0.0))
