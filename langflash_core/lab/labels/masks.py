"""Rules for masks: which are the same, which are parts of others, and how they become one map of ids.

Sizes: N masks of one frame, H W pixels.
"""

import cv2
import numpy as np
from jaxtyping import Bool, Float, UInt16

from langflash_core.lab.labels.protocols import Proposals

_SIDE = 128
"""Masks are compared at about so many pixels a side; below that, thin things change their share."""


def shared(
    left: Bool[np.ndarray, "N H W"], right: Bool[np.ndarray, "M H W"]
) -> tuple[Float[np.ndarray, "N M"], Float[np.ndarray, "N M"]]:
    """IoU of each pair, and the share of each left mask that lies in each right one, in [0, 1]."""
    a, b = (_coarse(masks) for masks in (left, right))
    both = a @ b.T
    own, other = a.sum(1)[:, None], b.sum(1)[None]
    return both / np.maximum(own + other - both, 1e-9), both / np.maximum(own, 1e-9)


def _coarse(masks: Bool[np.ndarray, "N H W"]) -> Float[np.ndarray, "N P"]:
    step = max(1, round(max(masks.shape[1:]) / _SIDE))
    small = masks[:, step // 2 :: step, step // 2 :: step]
    return small.reshape(len(masks), small.shape[1] * small.shape[2]).astype(np.float32)


def without_repeats(proposals: Proposals, same: float = 0.7) -> Proposals:
    """Best first, each that is no repetition of a better one (non-maximum suppression).

    Args:
        same: IoU from which two masks are one.
    """
    ranked = proposals.rows(np.argsort(-proposals.scores, kind="stable"))
    alike = shared(ranked.masks, ranked.masks)[0] >= same
    kept: list[int] = []
    for n in range(len(ranked)):
        if not alike[n, kept].any():
            kept.append(n)
    return ranked.rows(np.array(kept, dtype=int))


def without_parts(proposals: Proposals, inside: float = 0.85, whole: float = 0.4) -> Proposals:
    """Without masks that are parts of larger ones: objects are wanted, not their pieces.

    Args:
        inside: share of a mask that lies in a larger one. whole: larger masks than this share of the frame
            (walls, floors) have no parts but neighbours seen through holes.
    """
    areas = proposals.masks.mean((1, 2))
    _, within = shared(proposals.masks, proposals.masks)
    larger = (areas[None] > 1.2 * areas[:, None]) & (areas[None] <= whole)
    return proposals.rows(~((within >= inside) & larger).any(1))


def cleaned(mask: Bool[np.ndarray, "H W"], share: float = 0.1) -> Bool[np.ndarray, "H W"]:
    """Without islands smaller than a share of the largest, nor holes smaller than a share of the mask."""
    for value in (True, False):
        count, parts, stats, _ = cv2.connectedComponentsWithStats((mask == value).astype(np.uint8))
        areas = stats[1:, cv2.CC_STAT_AREA]
        if count < 3 and value:
            continue
        limit = share * (areas.max(initial=0) if value else mask.sum())
        small = np.flatnonzero(areas < limit) + 1
        mask = np.where(np.isin(parts, small), not value, mask)
    return mask


def painted(
    masks: Bool[np.ndarray, "N H W"], numbers: np.ndarray, size: tuple[int, int]
) -> UInt16[np.ndarray, "H W"]:
    """One map of ids: larger masks first, so that what lies on a thing shows.

    Args:
        numbers: (N,) the id of each mask. size: (H, W).
    """
    ids = np.zeros(size, np.uint16)
    for n in np.argsort(-masks.sum((1, 2)), kind="stable"):
        ids[masks[n]] = numbers[n]
    return ids


def split_ids(ids: UInt16[np.ndarray, "H W"]) -> tuple[np.ndarray, Bool[np.ndarray, "N H W"]]:
    """Numbers (N,) that a map holds, without 0, and their masks."""
    numbers = np.unique(ids)
    numbers = numbers[numbers > 0]
    return numbers, ids[None] == numbers[:, None, None]


def without_gaps(ids: UInt16[np.ndarray, "H W"], width: int = 5) -> UInt16[np.ndarray, "H W"]:
    """Seams of nobody's pixels, narrower than so many, given to whom is nearest."""
    nobody = (ids == 0).astype(np.uint8)
    if nobody.all() or not nobody.any():
        return ids
    wide = cv2.morphologyEx(nobody, cv2.MORPH_OPEN, np.ones((width, width), np.uint8))
    seam = (nobody > 0) & (wide == 0)
    _, nearest = cv2.distanceTransformWithLabels(nobody, cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL)
    owners = np.zeros(int(nearest.max()) + 1, ids.dtype)
    owners[nearest[nobody == 0]] = ids[nobody == 0]
    return np.where(seam, owners[nearest], ids)
