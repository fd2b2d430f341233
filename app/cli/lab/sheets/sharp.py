"""A sheet of `lab eval sharp`: photo, scenes and the photo through the grid, whole and from near."""

from collections.abc import Mapping

import numpy as np
from PIL import Image
from torch import Tensor

from langflash_core.export.sheet import captioned
from langflash_core.lab.evaluation.sharp_pictures import TIMES, closeups
from langflash_core.lab.evaluation.sights import photo_picture

MOST = 12
"""So many of the first subjects are shown."""


class SharpSheet:
    """Collects bands, a subject each: pictures at 100 %, and a window of them at 300 %."""

    def __init__(self) -> None:
        self._bands: list[np.ndarray] = []

    def add(self, name: str, pictures: Mapping[str, Tensor]) -> None:
        """Pictures (H, W, 3) of one size by title, the photo first; from `MOST` subjects on nothing."""
        if len(self._bands) >= 2 * MOST:
            return
        whole = [captioned(photo_picture(rgb), f"{name}: {title}") for title, rgb in pictures.items()]
        near = [captioned(p, f"{title}, {100 * TIMES} %") for title, p in closeups(pictures).items()]
        self._bands += [np.concatenate(cells, axis=1) for cells in (whole, near)]

    def image(self) -> Image.Image:
        """All bands under each other."""
        assert self._bands, "at least one subject was judged"
        width = max(band.shape[1] for band in self._bands)
        padded = [np.pad(band, ((0, 0), (0, width - band.shape[1]), (0, 0))) for band in self._bands]
        return Image.fromarray(np.concatenate(padded))
