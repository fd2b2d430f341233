"""How sure a number is: percentile bootstrap over scenes, of any numbers that are made from scenes.

Source: Efron and Tibshirani 1993, An Introduction to the Bootstrap, chapter 13.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import TypeVar

import numpy as np

Item = TypeVar("Item")
DRAWS = 1000
LEVEL = 0.95


def bootstrap(
    items: Sequence[Item],
    measure: Callable[[Sequence[Item]], Mapping[str, float]],
    *,
    draws: int = DRAWS,
    level: float = LEVEL,
    seed: int = 0,
) -> dict[str, tuple[float, float]]:
    """Where each number lies in `level` of all draws of as many scenes, with replacement.

    Whole scenes are drawn, because pixels and phrases of one scene are alike; numbers that are no means,
    as mIoU over all pixels, are made anew from each draw.

    Args:
        items: one per scene. measure: numbers by name from scenes; NaN where nothing can be measured.

    Returns:
        (low, high) by name; NaN, NaN where fewer than two scenes, or no draw, gave a number.

    Raises:
        ValueError: `draws` below 1, or `level` outside (0, 1).
    """
    if draws < 1 or not 0 < level < 1:
        raise ValueError(f"draws, level: expected at least 1 and in (0, 1), received {draws}, {level}")
    names = list(measure(items)) if items else []
    if len(items) < 2:
        return dict.fromkeys(names, (math.nan, math.nan))
    generator = np.random.default_rng(seed)
    rows = []
    for _ in range(draws):
        chosen = generator.integers(len(items), size=len(items))
        drawn = measure([items[i] for i in chosen])
        rows.append([drawn.get(name, math.nan) for name in names])
    return dict(zip(names, _percentiles(np.array(rows, dtype=np.float64), level), strict=True))


def _percentiles(rows: np.ndarray, level: float) -> list[tuple[float, float]]:
    """(low, high) of every column (draws, names), NaN left out."""
    tail = 50 * (1 - level)
    found = []
    for column in rows.T:
        known = column[~np.isnan(column)]
        low, high = np.percentile(known, [tail, 100 - tail]) if len(known) else (math.nan, math.nan)
        found.append((float(low), float(high)))
    return found
