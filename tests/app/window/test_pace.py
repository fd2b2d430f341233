"""How large pictures are drawn, from what they cost."""

import math

from app.window.pace import FULL_AFTER, MOVING_SECONDS, SCALES, SETTLE_AFTER, Pace, Plan


def settled(seconds_full: float, maps: bool) -> Pace:
    """A pace on a machine whose pictures cost exactly in proportion to their pixels."""
    pace = Pace()
    for _ in range(20):
        plan = pace.moving(maps)
        pace = pace.learn(plan, seconds_full * plan.scale**2)
    return pace


def test_a_fast_machine_draws_everything_in_full() -> None:
    pace = settled(0.004, maps=True)
    assert pace.moving(wants_maps=True) == Plan(1.0, maps=True)
    assert pace.resting(True, SETTLE_AFTER) == Plan(1.0, maps=True)


def test_a_slow_machine_moves_within_the_budget() -> None:
    pace = settled(0.4, maps=False)
    plan = pace.moving(wants_maps=False)
    assert plan.scale < 1.0 and 0.4 * plan.scale**2 <= MOVING_SECONDS


def test_maps_that_cannot_be_fast_give_way_to_colour_while_moving() -> None:
    pace = settled(8.0, maps=True)  # 0.5 s at the smallest scale
    assert not pace.moving(wants_maps=True).maps
    assert pace.resting(True, FULL_AFTER) == Plan(1.0, maps=True)


def test_a_slow_picture_settles_small_before_full() -> None:
    pace = Pace().learn(Plan(1.0, maps=True), 1.2)
    small = pace.resting(True, SETTLE_AFTER)
    assert small is not None and small.scale < 1.0 and small.maps
    assert pace.resting(True, 0.0) is None


def test_maps_that_were_never_drawn_are_expected_to_cost_more_than_colour() -> None:
    slow = Pace().learn(Plan(1.0, maps=False), 0.4)
    assert not slow.moving(wants_maps=True).maps  # the first keystroke of a phrase does not freeze
    fast = Pace().learn(Plan(1.0, maps=False), 0.004)
    assert fast.moving(wants_maps=True) == Plan(1.0, maps=True)


def test_rest_ends() -> None:
    pace = Pace()
    assert pace.next_rest(0.0) == SETTLE_AFTER
    assert pace.next_rest(SETTLE_AFTER) == FULL_AFTER - SETTLE_AFTER
    assert math.isinf(pace.next_rest(FULL_AFTER))


def test_an_unknown_machine_starts_in_the_middle() -> None:
    assert Pace().moving(False) == Plan(SCALES[2], maps=False)
