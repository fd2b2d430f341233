"""Relations between boxes whose places are known: right, up and away of the eye, metres."""

import numpy as np
import pytest

from langflash_core.language.things import Thing, beside_others, gap, is_related

_RNG = np.random.default_rng(0)
_FIRST = iter(range(0, 10**9, 10**4))


def box(right: tuple, up: tuple, away: tuple, count: int = 2000) -> Thing:
    """Points all over the sides of a box."""
    low, high = np.array([right, up, away], float).T
    points = _RNG.uniform(low, high, (count, 3))
    side, end = _RNG.integers(0, 3, count), _RNG.integers(0, 2, count)
    points[np.arange(count), side] = np.where(end, high[side], low[side])
    start = next(_FIRST)
    return Thing(np.arange(start, start + count), points)


FLOOR = box((-3, 3), (-1.5, -1.5), (0.5, 5))
WALL = box((-3, 3), (-1.5, 1.1), (5, 5))
CEILING = box((-3, 3), (1.1, 1.1), (0.5, 5))
TABLE = box((-0.7, 0.7), (-1.5, -0.75), (2.5, 3.3))
CUP = box((-0.05, 0.05), (-0.75, -0.65), (2.8, 2.9))
LAMP = box((-0.2, 0.2), (0.3, 0.6), (2.7, 3.1))
BOX = box((-0.3, 0.3), (-1.5, -1.2), (2.6, 3.0))
CHAIR = box((1.0, 1.45), (-1.5, -0.7), (2.6, 3.05))
FAR_CHAIR = box((-2.8, -2.35), (-1.5, -0.7), (4.2, 4.65))
PICTURE = box((-0.4, 0.4), (0, 0.6), (4.95, 4.98))
CABINET = box((-1, 1), (-1.5, -0.6), (4.5, 5))
SOFA = box((-2.5, -1.0), (-1.5, -0.7), (1.8, 2.6))
CUSHION = box((-2.4, -2.0), (-0.75, -0.4), (2.2, 2.5))
LADDER = box((-0.3, 0.3), (-1.5, 0.5), (4.7, 4.9))
SIDE = box((2, 2), (-1.5, 1.1), (0.5, 5))
WALLS = Thing(np.concatenate((SIDE.rows, WALL.rows)), np.concatenate((SIDE.places, WALL.places)))
WINDOW = box((2.99, 3), (-0.6, 0.8), (2.4, 3.4))
BY_WINDOW = box((2.4, 2.85), (-1.5, -0.65), (2.7, 3.15))
TRUE = [
    (BY_WINDOW, "beside", WINDOW),  # although its back ends below the sill
    (WALLS, "behind", LADDER),  # although its middle is nearer
    (LADDER, "in front of", WALLS),
    (CUP, "on", TABLE),
    (TABLE, "on", FLOOR),
    (CHAIR, "on", FLOOR),
    (PICTURE, "on", WALL),
    (CUSHION, "on", SOFA),
    (LAMP, "on", CEILING),
    (LAMP, "above", TABLE),
    (PICTURE, "above", CABINET),
    (BOX, "under", TABLE),
    (FLOOR, "under", TABLE),
    (CHAIR, "beside", TABLE),
    (BOX, "in front of", WALL),
    (WALL, "behind", TABLE),
    (SOFA, "left of", TABLE),
    (CHAIR, "right of", TABLE),
    (TABLE, "with", CUP),
    (SOFA, "with", CUSHION),
    (BOX, "in", TABLE),
    (PICTURE, "behind", LAMP),
    (FAR_CHAIR, "left of", PICTURE),
]
FALSE = [
    (TABLE, "on", CUP),
    (LAMP, "on", TABLE),
    (CHAIR, "on", WALL),
    (TABLE, "on", WALL),
    (PICTURE, "on", FLOOR),
    (CUP, "on", FLOOR),
    (CHAIR, "on", TABLE),
    (TABLE, "above", LAMP),
    (CHAIR, "above", TABLE),
    (CHAIR, "under", TABLE),
    (LAMP, "under", TABLE),
    (CUP, "under", TABLE),
    (FAR_CHAIR, "beside", TABLE),
    (LAMP, "beside", TABLE),
    (CUP, "beside", TABLE),
    (TABLE, "beside", FLOOR),
    (WALL, "in front of", TABLE),
    (CHAIR, "in front of", TABLE),
    (SOFA, "behind", CHAIR),
    (CHAIR, "left of", TABLE),
    (SOFA, "right of", TABLE),
    (CHAIR, "with", CUP),
    (CHAIR, "in", TABLE),
    (TABLE, "on", CEILING),
]


@pytest.mark.parametrize(("thing", "relation", "other"), TRUE)
def test_things_that_stand_so(thing: Thing, relation: str, other: Thing) -> None:
    assert is_related(thing, relation, [[other]])


@pytest.mark.parametrize(("thing", "relation", "other"), FALSE)
def test_things_that_do_not(thing: Thing, relation: str, other: Thing) -> None:
    assert not is_related(thing, relation, [[other]])


def test_between_is_between_two_things_or_two_of_a_kind() -> None:
    assert is_related(TABLE, "between", [[SOFA], [CHAIR]]) and is_related(TABLE, "between", [[SOFA, CHAIR]])
    assert not is_related(CHAIR, "between", [[SOFA], [TABLE]]) and not is_related(TABLE, "between", [[CHAIR]])
    assert not is_related(PICTURE, "between", [[SOFA], [CHAIR]])


def test_a_thing_is_not_related_to_itself_nor_to_nothing() -> None:
    assert not is_related(CHAIR, "beside", [[CHAIR]]) and not is_related(CHAIR, "on", [[]])
    assert is_related(CHAIR, "beside", [[CHAIR, TABLE]])


def test_what_covers_both_belongs_to_the_thing() -> None:
    """A wall's answer goes on over the picture that hangs there."""
    both = Thing(np.concatenate((WALL.rows, PICTURE.rows)), np.concatenate((WALL.places, PICTURE.places)))
    assert is_related(PICTURE, "on", [[both]])


def test_the_gap_is_the_distance_of_the_nearest_points() -> None:
    """Of 2,000 points on sides of 1 m2 the nearest is some 2 cm away."""
    assert gap(CHAIR, [TABLE]) == pytest.approx(0.3, abs=0.06)
    assert gap(CHAIR, [SOFA, TABLE]) == gap(CHAIR, [TABLE])


def test_one_point_is_a_thing() -> None:
    one = Thing(np.array([7]), np.array([[0.0, -0.74, 2.9]]))
    assert is_related(one, "on", [[TABLE]]) and not is_related(TABLE, "on", [[one]])


@pytest.mark.parametrize("thing", [LADDER, PICTURE])
def test_a_wall_is_behind_what_stands_or_hangs_at_it_though_it_answers_wall_too(thing: Thing) -> None:
    both = Thing(np.concatenate((WALL.rows, thing.rows)), np.concatenate((WALL.places, thing.places)))
    assert is_related(both, "behind", [[thing]]) and not is_related(TABLE, "behind", [[thing]])


def test_the_nearer_of_two_lamps_at_a_ceiling_is_the_upper_one() -> None:
    near, far = box((-0.2, 0.2), (0.9, 1.0), (1.5, 1.7)), box((-0.2, 0.2), (0.95, 1.05), (4, 4.2))
    assert near.elevation > far.elevation > TABLE.elevation > box((0, 1), (-1.5, -0.75), (1, 2)).elevation


def test_what_two_share_is_the_smaller_ones() -> None:
    """The answer to "cabinet under the counter" ends where the counter begins."""
    both = Thing(
        np.concatenate((CABINET.rows, CUP.rows[:500])), np.concatenate((CABINET.places, CUP.places[:500]))
    )
    small = Thing(CUP.rows[:500], CUP.places[:500])
    assert (beside_others(both, [[small]]).rows == CABINET.rows).all()
    assert beside_others(small, [[both]]) is small and beside_others(both, [[LAMP]]) is both
