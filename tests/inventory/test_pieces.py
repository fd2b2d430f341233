"""Pieces are joined where one name does for both, and nowhere else."""

import numpy as np
import pytest

from langflash_core.inventory.pieces import KINDS, STRUCTURE, Pieces, kinds_of, parts_of_room
from langflash_core.inventory.settings import PRESENCE
from langflash_core.language.vocabulary import OWN
from langflash_core.segments import photo_shares
from tests.boxroom import box_room

NAMES = list(OWN)
THINGS, ROOM = 0.25, 0.1


def cosines(**named: float) -> np.ndarray:
    found = np.full(len(NAMES), 0.05)
    for name, value in named.items():
        found[NAMES.index(name)] = value
    return found


def touched(count: int, pairs: dict[tuple[int, int], float]) -> list[dict[int, float]]:
    near: list[dict[int, float]] = [{} for _ in range(count)]
    for (a, b), contact in pairs.items():
        near[a][b] = near[b][a] = contact
    return near


def test_a_desk_that_looks_like_two_things_is_one_and_the_book_on_it_another():
    means = np.stack(
        [cosines(table=0.65, desk=0.5), cosines(desk=0.6, table=0.5), cosines(book=0.6), cosines(wall=0.7)]
    )
    near = touched(4, {(0, 1): 40, (0, 2): 30, (1, 3): 30, (0, 3): 9})
    pieces = Pieces(np.array([0.06, 0.03, 0.01, 0.3]), means, near)
    # (.06 (.65 - .6) + .03 (.6 - .5) + ...) / .03: the mean is "table" .6 against .65 and .6 alone.
    assert pieces.price(0, 1) == pytest.approx((0.06 * 0.65 + 0.03 * 0.6 - 0.09 * 0.6) / 0.03)
    assert pieces.joined(THINGS, ROOM).tolist() == [0, 0, 2, 3]
    assert NAMES[pieces.means[0].argmax()] == "table" and pieces.masses[0] == pytest.approx(0.09)


def test_what_hardly_touches_stays_apart_and_what_looks_like_nothing_goes_to_the_wall():
    chairs = np.stack(
        [cosines(chair=0.7), cosines(chair=0.6), cosines(wall=0.6), cosines(lamp=0.2, wall=0.15)]
    )
    near = touched(4, {(0, 1): 1, (0, 2): 20, (1, 2): 20, (2, 3): 5})
    assert Pieces(np.full(4, 0.1), chairs, near).joined(THINGS, ROOM).tolist() == [0, 1, 2, 2]


@pytest.mark.parametrize("seed", range(6))
def test_joining_is_that_of_the_slow_way(seed):
    rng = np.random.default_rng(seed)
    count = 9
    means = 0.7 * rng.random((count, len(NAMES))) ** 3
    means[:3] += cosines(wall=0.5)
    masses = rng.uniform(0.001, 0.1, count)
    pairs = {(a, b): float(rng.integers(1, 50)) for a in range(count) for b in range(a) if rng.random() < 0.5}
    found = Pieces(masses, means, touched(count, pairs)).joined(THINGS, ROOM)
    groups = slow_way(masses, means, pairs)
    assert {frozenset(np.flatnonzero(found == k)) for k in found} == groups


def slow_way(masses, means, pairs) -> set[frozenset]:
    """Every pair of groups anew at every step, from their members."""
    groups = [frozenset([k]) for k in range(len(masses))]
    while True:
        options = []
        for a in range(len(groups)):
            for b in range(a):
                price, limit = offer(groups, groups[a], groups[b], masses, means, pairs)
                if price <= limit:
                    options.append((price, a, b))
        if not options:
            return set(groups)
        _, a, b = min(options)
        groups = [g for k, g in enumerate(groups) if k not in (a, b)] + [groups[a] | groups[b]]


def offer(groups, one, other, masses, means, pairs) -> tuple[float, float]:
    def mean(group) -> np.ndarray:
        rows = sorted(group)
        return masses[rows] @ means[rows] / masses[rows].sum()

    def contact(a, b) -> float:
        return sum(c for (i, j), c in pairs.items() if (i in a and j in b) or (j in a and i in b))

    borders = [sum(contact(g, rest) for rest in groups if rest != g) for g in (one, other)]
    touch = contact(one, other)
    if not touch or touch < PRESENCE.contact * min(borders):
        return 1.0, 0.0
    a, b, both = mean(one), mean(other), mean(one | other)
    first, second = masses[sorted(one)].sum(), masses[sorted(other)].sum()
    price = (first * a.max() + second * b.max() - (first + second) * both.max()) / min(first, second)
    none = sum(NAMES[each.argmax()] in STRUCTURE for each in (a, b))
    return price, (THINGS, ROOM, -1.0)[none]


def test_a_room_has_walls_among_its_parts_and_a_scene_of_nothing_has_none():
    room = box_room()
    parts = parts_of_room(room, photo_shares(room).sum(0).double().numpy())
    assert {"wall", "floor", "ceiling", "chair", "table", "door"} == set(parts.kinds)
    assert len(parts.numbers) == len(room.gaussians) and parts.kinds.count("chair") == 2
    assert min(parts.cosines) > parts.present
    nothing = parts_of_room(room, np.zeros(len(room.gaussians)))
    assert nothing.kinds == () and (nothing.numbers == -1).all()


def test_kinds_are_numbers_for_words_of_millions_hold_up_the_window():
    scene = box_room()
    kinds = kinds_of(scene)
    assert kinds.dtype.kind == "i" and kinds.shape == (len(scene.gaussians),)
    assert "wall" in {KINDS[kind] for kind in np.unique(kinds)}
