"""Which of many photos are matched: those that show the same, and those given one after another."""

from itertools import combinations

import numpy as np

from langflash_core.cameras.retrieval import likeness
from langflash_core.rig.pairs import Pair
from langflash_core.rig.pairs import likely_pairs as pairs_of
from langflash_core.rig.settings import CHOICE

ALL = CHOICE.all_matched


def likely_pairs(photos: list[np.ndarray]) -> list[Pair]:
    return pairs_of(len(photos), lambda: likeness(photos))


def _unit(rows: np.ndarray) -> np.ndarray:
    return (rows / np.linalg.norm(rows, axis=1, keepdims=True)).astype(np.float32)


def _rooms(num_rooms: int, each: int, seed: int = 0) -> list[np.ndarray]:
    """Photos of several rooms in turn: photo v shows room v % num_rooms, each other things of it."""
    rng = np.random.default_rng(seed)
    things = [np.abs(rng.normal(size=(150, 128))) ** 3 for _ in range(num_rooms)]
    photos = []
    for v in range(num_rooms * each):
        seen = things[v % num_rooms][rng.choice(150, 90, replace=False)]
        photos.append(_unit(np.abs(seen + rng.normal(0, 0.1, seen.shape))))
    return photos


def test_of_a_few_every_pair_is_matched():
    photos = _rooms(2, ALL // 2)
    assert likely_pairs(photos) == list(combinations(range(ALL), 2))
    assert likely_pairs([]) == [] and likely_pairs(photos[:1]) == []


def test_photos_of_one_room_find_each_other():
    photos = _rooms(8, 7)
    found = set(likely_pairs(photos))
    same = {(i, j) for i, j in combinations(range(56), 2) if (j - i) % 8 == 0}
    assert len(same - found) < 0.05 * len(same)
    assert {(i, i + 1) for i in range(55)} <= found


def test_pairs_grow_with_photos_and_not_with_their_square():
    many = likely_pairs(_rooms(5, 32))
    assert len(many) <= 11 * 160  # eight alike and three neighbours, of 79 for each of all pairs
    assert many == likely_pairs(_rooms(5, 32)) and many == sorted(set(many)) and all(i < j for i, j in many)


def test_photos_of_nothing_are_matched_with_their_neighbours():
    photos = [np.zeros((0, 128), np.float32)] * 20
    assert {(i, i + 1) for i in range(19)} <= set(likely_pairs(photos))
    photos[3] = _rooms(1, 1)[0]
    assert len(likely_pairs(photos)) > 0
