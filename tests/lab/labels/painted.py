"""A painted clip whose truth is known: a textured wall that moves along, two things on it, and a third one
that comes in late; and proposers and encoders that know the truth.
"""

from collections.abc import Sequence

import cv2
import numpy as np
import torch
from torch import Tensor

from langflash_core.lab.labels.clips import Clip
from langflash_core.lab.labels.protocols import Proposals

HEIGHT, WIDTH, FRAMES, STEP = 96, 128, 12, 5
_THINGS = {2: (20, 20, 30, 34), 3: (50, 66, 26, 40), 4: (24, 150, 40, 30)}  # top, left, height, width
ENTERS = 8
"""The frame in which half of thing 4 is in sight for the first time."""


def _world() -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(3)
    width = WIDTH + STEP * FRAMES
    image = cv2.resize(rng.integers(60, 200, (24, width // 4, 3), dtype=np.uint8), (width, HEIGHT))
    ids = np.ones((HEIGHT, width), np.uint16)
    for id, (top, left, height, wide) in _THINGS.items():
        look = cv2.resize(rng.integers(0, 255, (8, 8, 3), dtype=np.uint8), (wide, height))
        image[top : top + height, left : left + wide] = look
        ids[top : top + height, left : left + wide] = id
    return image, ids


def painted_clip() -> tuple[Clip, np.ndarray]:
    """The clip and its true ids (T, H, W): 1 the wall, 2 and 3 in sight, 4 late."""
    image, ids = _world()
    frames = [np.ascontiguousarray(image[:, STEP * t : STEP * t + WIDTH]) for t in range(FRAMES)]
    true = np.stack([ids[:, STEP * t : STEP * t + WIDTH] for t in range(FRAMES)])
    return Clip("painted", tuple(f"{t:03d}" for t in range(FRAMES)), frames.__getitem__), true


class Knowing:
    """Proposes what is truly there, with what real proposers add: repetitions, parts and crumbs."""

    def __init__(self, clip: Clip, true: np.ndarray) -> None:
        self._frames = [clip.read(t) for t in range(len(clip))]
        self._true = true

    def propose(self, image: np.ndarray, where: np.ndarray | None = None) -> Proposals:
        frame = next(t for t, seen in enumerate(self._frames) if np.array_equal(seen, image))
        masks, scores = [], []
        for id in np.unique(self._true[frame]):
            whole = self._true[frame] == id
            if where is not None and not (whole & where).any():
                continue
            part, crumb = whole.copy(), np.zeros_like(whole)
            part[:, : int(np.median(np.flatnonzero(whole.any(0))))] = False
            crumb[0, 0] = True
            masks += [whole, whole, part & (whole.mean() < 0.3), crumb]
            scores += [0.95, 0.9, 0.97, 0.99]
        return Proposals(np.array(masks), np.array(scores))


class Counting:
    """Embeds a mask as the mean colour of its pixels, plainly."""

    space, dimension = "minilm", 3

    def embed(self, image: np.ndarray, masks: np.ndarray) -> Tensor:
        means = [image[mask].mean(0) for mask in masks]
        return torch.nn.functional.normalize(torch.tensor(np.array(means)).float(), dim=-1)

    def texts(self, phrases: Sequence[str]) -> Tensor:
        return torch.nn.functional.normalize(torch.ones(len(phrases), 3), dim=-1)
