"""Which two of several photos make the best scene: much in common, seen from different places.

A fundamental matrix tells how much two photos share; what no homography explains is parallax. A
pure rotation or a single plane leaves none.
"""

from collections.abc import Callable, Sequence
from itertools import combinations

import cv2
import numpy as np
from jaxtyping import UInt8

from langflash_core.cameras.matching import at_side, detect, match_descriptors
from langflash_core.rig.settings import FILM_PAIR


def choose_pair(
    greys: Sequence[UInt8[np.ndarray, "_ _"]], check: Callable[[], None] = lambda: None
) -> tuple[int, int] | None:
    """Places of the best two of `greys`, each (H, W) uint8; None where no two match.

    `check` is called before each photo and each pair; what it raises ends the work.
    """
    features = []
    for grey in greys:
        check()
        features.append(detect(at_side(grey, FILM_PAIR.side), FILM_PAIR.features))
    best, chosen = 0.0, None
    for i, j in combinations(range(len(greys)), 2):
        check()
        worth = _worth(*features[i], *features[j])
        if worth > best:
            best, chosen = worth, (i, j)
    return chosen


def _worth(
    pos_i: np.ndarray, descriptors_i: np.ndarray, pos_j: np.ndarray, descriptors_j: np.ndarray
) -> float:
    """Agreeing matches, fewer where they show no parallax. pos: (n, 2) pixels."""
    pairs = match_descriptors(descriptors_i, descriptors_j)
    if len(pairs) < FILM_PAIR.fewest:
        return 0.0
    x_i, x_j = pos_i[pairs[:, 0]], pos_j[pairs[:, 1]]
    _, agree = cv2.findFundamentalMat(x_i, x_j, cv2.USAC_MAGSAC, FILM_PAIR.tolerance, 0.999)
    if agree is None or int(agree.sum()) < FILM_PAIR.fewest:
        return 0.0
    keep = agree.ravel().astype(bool)
    x_i, x_j = x_i[keep], x_j[keep]
    plane, _ = cv2.findHomography(x_i, x_j, cv2.USAC_MAGSAC, FILM_PAIR.tolerance)
    if plane is None:
        return float(keep.sum())
    moved = cv2.perspectiveTransform(x_i[:, None], plane)[:, 0]
    parallax = float(np.percentile(np.linalg.norm(moved - x_j, axis=1), 75)) / FILM_PAIR.side
    return float(keep.sum()) * max(min(parallax / FILM_PAIR.enough, 1.0), FILM_PAIR.least)
