"""Which photos go together: each with those of its highest scores, and all connected."""

import numpy as np

from langflash_core.rig.pairs import best, bridges, scores_of, strongest


def drawn(count: int = 20) -> np.ndarray:
    """Symmetric scores of two halves that nothing connects but 3 and 14, weakly."""
    scores = np.random.default_rng(0).integers(2, 100, (count, count)).astype(float)
    scores[: count // 2, count // 2 :] = -np.inf
    scores[3, 14] = 1
    scores = np.where(np.tri(count, k=0, dtype=bool), -np.inf, scores)
    return np.maximum(scores, scores.T)


def test_each_photo_has_its_best_and_all_are_connected():
    scores = drawn()
    found = strongest(scores, 5)
    assert (3, 14) in found and len(found) == len(set(found)) <= 20 * 5 and all(i < j for i, j in found)
    for view, others in enumerate(best(scores, 5)):
        assert others == sorted(range(20), key=lambda other: (-scores[view, other], other))[:5]
        assert all((min(view, other), max(view, other)) in found for other in others)
    none = {pair for pair in found if pair != (3, 14)}
    allowed = {(view, other) for view, others in enumerate(best(scores, 5)) for other in others}
    assert all(pair in allowed or pair[::-1] in allowed for pair in none)  # nothing but a bridge is added
    assert [scores[pair] for pair in found] == sorted((scores[pair] for pair in found), reverse=True)


def test_a_tree_alone():
    tree = strongest(drawn())
    assert len(tree) == 19 and (3, 14) in tree
    part = list(range(20))
    for i, j in tree:
        assert part[i] != part[j]
        part = [part[i] if own == part[j] else own for own in part]
    assert len(set(part)) == 1


def test_scores_of_0_connect_but_are_no_ones_best():
    assert strongest(scores_of(2, {(0, 1): 0}), 4) == [(0, 1)]
    assert strongest(scores_of(3, {(0, 1): 5, (1, 2): 5, (0, 2): 0}), 4) == [(0, 1), (1, 2)]
    assert strongest(scores_of(3, {}), 4) == strongest(np.zeros((0, 0)), 4) == []
    assert best(scores_of(3, {(0, 2): 1}), 2) == [[2], [], [0]]


def test_the_best_of_what_lies_between_two_parts_is_a_bridge():
    counts = {(0, 1): 90, (1, 2): 80, (3, 4): 70, (0, 3): 5, (2, 3): 9, (0, 2): 30}
    assert bridges(scores_of(5, counts), {(0, 1), (1, 2), (3, 4)}) == [(2, 3)]
