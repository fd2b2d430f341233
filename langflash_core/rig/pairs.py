"""Which photos go together, by a score of every two: how many matches they share, how alike they look, how
much one sees of the other. `rig.neighbours` chooses where depth is known.

A score is -inf for two that never go together. numpy alone: photos are matched before torch is there.

Sizes: V photos.
"""

from collections.abc import Callable, Collection, Mapping
from itertools import combinations

import numpy as np
from jaxtyping import Float

from langflash_core.rig.settings import CHOICE, Choice

Pair = tuple[int, int]
Scores = Float[np.ndarray, "V V"]


def scores_of(num_views: int, counts: Mapping[Pair, float]) -> Scores:
    """Those of pairs i < j, both ways."""
    scores = np.full((num_views, num_views), -np.inf)
    for (i, j), count in counts.items():
        scores[i, j] = scores[j, i] = count
    return scores


def best(scores: Scores, most: int) -> list[list[int]]:
    """Of each photo at most so many others, the best first, of equal ones the first."""
    order = np.argsort(-scores, axis=1, kind="stable")[:, :most].tolist()
    return [[other for other in row if scores[view, other] > -np.inf] for view, row in enumerate(order)]


def strongest(scores: Scores, most: int = 0) -> list[Pair]:
    """Pairs i < j, the best first: of each photo those of its `most` highest scores above 0, and what else it
    takes to connect all that scores of 0 and more connect. Of `most` 0 a maximum spanning tree (Kruskal).

    Args:
        scores: symmetric.
    """
    part, degrees, chosen = list(range(len(scores))), [0] * len(scores), []
    pairs = [(i, j) for i, j in combinations(range(len(scores)), 2) if scores[i, j] >= 0]
    for i, j in sorted(pairs, key=lambda pair: (-scores[pair], pair)):
        if part[i] != part[j] or (scores[i, j] > 0 and min(degrees[i], degrees[j]) < most):
            chosen.append((i, j))
            degrees[i], degrees[j] = degrees[i] + 1, degrees[j] + 1
            part = [part[i] if own == part[j] else own for own in part]
    return chosen


def bridges(scores: Scores, known: Collection[Pair]) -> list[Pair]:
    """Pairs i < j that could connect what the known ones leave apart: of a tree of those that score most."""
    scores, most = scores.copy(), 1 + scores.max(initial=0)
    for i, j in known:
        scores[i, j] = scores[j, i] = scores[i, j] + most
    return [pair for pair in strongest(scores) if pair not in known]


def likely_pairs(count: int, alike: Callable[[], Scores], settings: Choice = CHOICE) -> list[Pair]:
    """Pairs i < j of photos that may show the same, in order: all of a few; of many as many for each, those
    most alike and those that were given one after another.

    Args:
        alike: asked where there are many.
    """
    if count <= settings.all_matched:
        return list(combinations(range(count), 2))
    near = best(alike(), settings.alike)
    pairs = {(min(i, j), max(i, j)) for i, row in enumerate(near) for j in row}
    pairs |= {(i, j) for i in range(count) for j in range(i + 1, min(i + 1 + settings.next, count))}
    return sorted(pairs)
