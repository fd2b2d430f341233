"""How well names end where things end, at the size of the photo.

Who labels a photo leaves bands of some pixels between things without a label. Up to `GAP` pixels they are
filled with the nearest label, so that the border lies in their middle. A border pixel has a 4-neighbour of
another label; next to what nobody labelled there is none.

Maps are whole numbers (H, W): a found one names every pixel (-1: no answer), in a true one `UNKNOWN` was
not labelled, and `OTHER` is something that is not judged, whose border is one all the same.
"""

import math

import cv2
import numpy as np
from jaxtyping import Bool, Float32, Integer

UNKNOWN, OTHER = -1, -2
TOLERANCE = 4.0
"""Pixels by which a border may be off."""
NEAR = 8.0
"""Pixels up to which one is near a border."""
GAP = 6.0


def border_f1(
    found: Integer[np.ndarray, "H W"], truth: Integer[np.ndarray, "H W"], tolerance: float = TOLERANCE
) -> float:
    """F1 in [0, 1] of the borders between names, whatever the names; NaN where the truth has none.

    Precision: the share of found border pixels within `tolerance` pixels of a true border, of those on a
    judged name that is known as far as the tolerance reaches. Recall: of true ones, within it of a found one.

    Source: the boundary F1 of Martin, Fowlkes, Malik, PAMI 2004, with distances instead of an assignment,
    as Csurka, Larlus, Perronnin, BMVC 2013, have it.
    """
    real = filled(truth)
    true_borders = borders(real)
    if not true_borders.any():
        return math.nan
    own = _changes(found)
    judged = own & (real >= 0) & (_distance(real == UNKNOWN) > tolerance)
    precision = float((_distance(true_borders)[judged] <= tolerance).mean()) if judged.any() else 0.0
    recall = float((_distance(own)[true_borders] <= tolerance).mean())
    return 2 * precision * recall / (precision + recall) if precision + recall else 0.0


def right_near_borders(
    found: Integer[np.ndarray, "H W"], truth: Integer[np.ndarray, "H W"], near: float = NEAR
) -> tuple[float, float]:
    """Shares in [0, 1] of judged pixels that are named right: within `near` pixels of a true border, and
    elsewhere; NaN where there are none. Filled bands are not judged.

    Source: the trimap accuracy of Kohli, Ladicky, Torr, IJCV 2009.
    """
    judged = truth >= 0
    close = _distance(borders(filled(truth))) <= near
    right = found == truth
    parts = (judged & close, judged & ~close)
    inside, outside = (float(right[part].mean()) if part.any() else math.nan for part in parts)
    return inside, outside


def borders(labels: Integer[np.ndarray, "H W"]) -> Bool[np.ndarray, "H W"]:
    """Pixels with a 4-neighbour of another label, both known; on both sides of every border."""
    return _changes(labels, labels != UNKNOWN)


def _changes(
    labels: Integer[np.ndarray, "H W"], known: Bool[np.ndarray, "H W"] | None = None
) -> Bool[np.ndarray, "H W"]:
    """Pixels with a 4-neighbour of another label, both known; None: all are, also a found -1."""
    found = np.zeros(labels.shape, dtype=bool)
    known = np.ones(labels.shape, dtype=bool) if known is None else known
    for here, there in ((np.s_[1:], np.s_[:-1]), (np.s_[:, 1:], np.s_[:, :-1])):
        differ = (labels[here] != labels[there]) & known[here] & known[there]
        found[here] |= differ
        found[there] |= differ
    return found


def filled(labels: Integer[np.ndarray, "H W"], gap: float = GAP) -> Integer[np.ndarray, "H W"]:
    """Labels where there are none but one is within `gap` pixels: the nearest one's."""
    unknown = labels == UNKNOWN
    if unknown.all() or not unknown.any():
        return labels
    distances, sources = cv2.distanceTransformWithLabels(
        unknown.astype(np.uint8), cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL
    )
    label_of = np.zeros(int(sources.max()) + 1, dtype=labels.dtype)
    label_of[sources[~unknown]] = labels[~unknown]
    return np.where(unknown & (distances <= gap), label_of[sources], labels)


def _distance(pixels: Bool[np.ndarray, "H W"]) -> Float32[np.ndarray, "H W"]:
    """Pixels to the nearest of these, infinite where there are none."""
    if not pixels.any():
        return np.full(pixels.shape, np.inf, dtype=np.float32)
    return cv2.distanceTransform((~pixels).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE).astype(
        np.float32
    )
