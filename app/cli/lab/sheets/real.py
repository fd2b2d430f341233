"""A sheet of `langflash lab eval real`: a column a frame, its photo, what the scene and fewer photos show."""

import numpy as np
from PIL import Image
from torch import Tensor

from langflash_core.export.png import to_8bit
from langflash_core.export.sheet import add_caption
from langflash_core.lab.evaluation.real import ALONE, BETWEEN, OWN, PHOTO, SCENE

MOST = 6
"""Frames of either kind that are shown, evenly from the first to the last."""


class Sheet:
    """Keeps the pictures of one scene as they are drawn."""

    def __init__(self) -> None:
        self._pictures: dict[tuple[str, str], dict[str, np.ndarray]] = {}

    def shown(self, kind: str, name: str, title: str, rgb: Tensor) -> None:
        """One more picture (H, W, 3) in [0, 1]."""
        self._pictures.setdefault((kind, name), {})[title] = to_8bit(rgb)

    def drawn(self) -> Image.Image:
        """Photos' own places first, then the frames that were held back."""
        columns = [self._column(key) for kind in (OWN, BETWEEN) for key in self._some(kind)]
        height = max(column.shape[0] for column in columns)
        return Image.fromarray(
            np.concatenate([np.pad(c, ((0, height - len(c)), (0, 0), (0, 0))) for c in columns], axis=1)
        )

    def _some(self, kind: str) -> list[tuple[str, str]]:
        keys = [key for key in self._pictures if key[0] == kind]
        count = min(MOST, len(keys))
        return [keys[(2 * k + 1) * len(keys) // (2 * count)] for k in range(count)]

    def _column(self, key: tuple[str, str]) -> np.ndarray:
        kind, name = key
        told = {
            PHOTO: name,
            SCENE: "the scene" if kind == OWN else "the scene, held back",
            ALONE: "this photo alone" if kind == OWN else "two photos alone",
        }
        found = self._pictures[key]
        return np.concatenate([add_caption(found[title], told[title]) for title in told if title in found])
