"""Key points of several photos and which of each pair correspond. Imports no torch: photos are matched
while torch is still being imported."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from langflash_core.network.stereo.matching import detect, match_descriptors
from langflash_core.network.stereo.retrieval import likely_pairs

WORKING_SIDE = 768  # pixels of the longer side at which photos are matched
_MANY_VIEWS = 4  # beyond this, fewer features keep the pairs affordable
_FEATURES = {True: 1500, False: 4000}  # of many views, of few
_last: dict[tuple[bytes, ...], "KeyPoints"] = {}


@dataclass(frozen=True)
class KeyPoints:
    """positions: per view (n, 2), pixels of the photo scaled to `WORKING_SIDE`. pairs: per pair of
    views i < j that may show the same, rows of both (m, 2) that correspond."""

    positions: tuple[np.ndarray, ...]
    pairs: dict[tuple[int, int], np.ndarray]


def match_sources(sources: tuple[bytes, ...], check: Callable[[], None] = lambda: None) -> KeyPoints:
    """`match_photos` of pictures as JPEG bytes; the last answer is remembered."""
    points = _last.get(sources)
    if points is None:
        points = match_photos([decoded(source) for source in sources], check)
        _last.clear()
        _last[sources] = points
    return points


def match_photos(greys: Sequence[np.ndarray], check: Callable[[], None] = lambda: None) -> KeyPoints:
    """Key points of photos (h, w) uint8 of one shape, and what corresponds; deterministic.

    `check` is called before each photo and each pair; what it raises ends the work.
    """
    limit = _FEATURES[len(greys) > _MANY_VIEWS]
    positions, descriptors = [], []
    for grey in greys:
        check()
        own_positions, own_descriptors = detect(_working_size(grey), limit)
        positions.append(own_positions)
        descriptors.append(own_descriptors)
    pairs = {}
    for i, j in likely_pairs(descriptors):
        check()
        pairs[i, j] = match_descriptors(descriptors[i], descriptors[j])
    return KeyPoints(tuple(positions), pairs)


def decoded(source: bytes) -> np.ndarray:
    """A picture (h, w) uint8, grey, of JPEG bytes."""
    grey = cv2.imdecode(np.frombuffer(source, np.uint8), cv2.IMREAD_GRAYSCALE)
    assert grey is not None, "sources are JPEG bytes that images/ wrote"
    return grey


def _working_size(grey: np.ndarray) -> np.ndarray:
    """Small pictures are enlarged: SIFT needs pixels to find more than a handful of points."""
    ratio = WORKING_SIDE / max(grey.shape)
    if ratio == 1:
        return grey
    method = cv2.INTER_CUBIC if ratio > 1 else cv2.INTER_AREA
    return cv2.resize(grey, None, fx=ratio, fy=ratio, interpolation=method)
