"""Following without SAM 2: ids are carried along the motion between frames, then a refiner makes their
borders good again, so that errors do not add up.

Sizes: H W pixels, M objects in the current frame.
"""

import numpy as np
from jaxtyping import UInt16

from langflash_core.lab.labels.clips import Clip
from langflash_core.lab.labels.masks import cleaned, painted, split_ids
from langflash_core.lab.labels.motion import Motion, moved
from langflash_core.lab.labels.protocols import Following, MaskRefiner

_BELIEVED = 0.6  # IoU with what was carried from which a refined mask takes its place
_WIDE = (
    0.1  # share of the frame from which a thing is a background: what comes into sight is not taken for more
)
# of it until it has been looked at
_GONE = 16  # pixels below which a thing is out of sight


class MotionPropagator:
    """Carries objects by a motion; refiner None: borders stay as they were carried."""

    def __init__(self, motion: Motion, refiner: MaskRefiner | None = None) -> None:
        self._motion, self._refiner = motion, refiner

    def follow(self, clip: Clip) -> Following:
        """Begin at the clip's first frame, without objects."""
        return _MotionFollowing(clip, self._motion, self._refiner)


class _MotionFollowing:
    def __init__(self, clip: Clip, motion: Motion, refiner: MaskRefiner | None) -> None:
        self._clip, self._motion, self._refiner = clip, motion, refiner
        self._image = clip.read(0)
        self._ids = np.zeros(self._image.shape[:2], np.uint16)

    def add(self, frame: int, ids: UInt16[np.ndarray, "H W"]) -> None:
        """Where nobody is yet."""
        self._ids = np.where(self._ids > 0, self._ids, ids)

    def to(self, frame: int) -> UInt16[np.ndarray, "H W"]:
        """Carried by one step, and made good."""
        image = self._clip.read(frame)
        if frame == 0:
            return self._ids
        carried, known = moved(self._ids, self._motion(self._clip, frame, image, self._image))
        self._image, self._ids = image, self._refined(image, carried, known)
        return self._ids

    def _refined(self, image: np.ndarray, carried: np.ndarray, known: np.ndarray) -> np.ndarray:
        numbers, masks = split_ids(carried)
        if self._refiner is None or len(numbers) == 0:
            return carried
        large = masks.sum((1, 2)) >= _GONE
        numbers, masks = numbers[large], masks[large]
        found = self._refiner.refine(image, masks, known)
        good = found.scores >= _BELIEVED
        wide = masks.mean((1, 2)) >= _WIDE
        refined = found.masks & (known | ~wide[:, None, None])
        best = np.where(good[:, None, None], refined, masks)
        return painted(
            np.array([cleaned(mask) for mask in best]).reshape(masks.shape), numbers, carried.shape
        )
