"""Numbers as results have them: rounded, and how far two masks agree."""

import math

from torch import Tensor


def rounded(values: dict[str, float]) -> dict[str, float | None]:
    """Four digits; what could not be measured is null, because JSON has no NaN."""
    return {k: None if math.isnan(v) else round(v, 4) for k, v in values.items()}


def mask_iou(found: Tensor, truth: Tensor) -> float:
    """Intersection over union of two bool masks of one shape; 0 where both are empty."""
    union = float((found | truth).sum())
    return float((found & truth).sum()) / union if union else 0.0
