"""How much is drawn, from what it costs."""

import math

import pytest

from app.window.governor import (
    COARSER_SIZES,
    FULL_AFTER,
    LARGE_SCENE,
    MIDDLING_SCENE,
    MOVING_SECONDS,
    SETTLE_AFTER,
    SIZES,
    SIZES_OF_MIDDLING_SCENES,
    Governor,
    Kind,
    Plan,
)


def settled(
    governor: Governor, kind: Kind, seconds_full: float, fixed: float = 0.0
) -> tuple[Governor, list[Plan]]:
    """Thirty moving pictures on a machine with this cost of a full one, of which `fixed` per Gaussian."""
    plans = []
    for _ in range(30):
        plan = governor.moving(kind)
        plans.append(plan)
        pixels = (seconds_full - fixed) * plan.scale**2 * (plan.kind.value / kind.value)
        governor = governor.learn(plan, pixels + fixed * plan.share)
    return governor, plans


def test_a_fast_machine_draws_everything_in_full() -> None:
    governor, plans = settled(Governor(), Kind.FAST, 0.004)
    assert plans[-1] == Plan(Kind.MAPS)  # exact while it moves
    assert governor.resting(Kind.FAST, SETTLE_AFTER) == Plan(Kind.MAPS)


@pytest.mark.parametrize("kind", [Kind.COLOUR, Kind.FAST])
def test_a_slow_machine_moves_within_the_budget_and_stays_there(kind) -> None:
    _, plans = settled(Governor(), kind, 0.4)
    last = plans[-1]
    assert last.kind is kind and last.scale < 1.0 and last.share == 1.0
    assert 0.4 * last.scale**2 <= MOVING_SECONDS
    assert len(set(plans[5:])) == 1  # no flicker between two sizes


def test_a_rung_that_takes_too_long_is_tried_once() -> None:
    """Of .3 s a picture of .35 takes 37 ms and one of a half 75: it has to be tried to be known."""
    governor = Governor(rungs={Kind.COLOUR: 3})
    _, plans = settled(governor, Kind.COLOUR, 0.3)
    assert [plan.scale for plan in plans] == [0.35, 0.5] + 28 * [0.35]
    _, plans = settled(governor, Kind.COLOUR, 0.2)
    assert plans[-1].scale == 0.5, "50 ms are taken where 24 were enough to go on"


def test_large_scenes_that_cost_by_the_gaussian_are_thinned() -> None:
    """A second for the Gaussians alone: smaller pictures do not help, fewer Gaussians do."""
    _, plans = settled(Governor(5 * LARGE_SCENE, shares=(0.25, 0.0625)), Kind.COLOUR, 1.2, fixed=1.0)
    assert plans[-1].share < 1 and 0.2 * plans[-1].scale ** 2 + plans[-1].share <= 1.8 * MOVING_SECONDS
    _, plans = settled(Governor(LARGE_SCENE - 1), Kind.COLOUR, 1.2, fixed=1.0)
    assert plans[-1].share == 1.0  # small ones never


def test_it_climbs_again_when_there_is_time() -> None:
    governor, _ = settled(Governor(), Kind.COLOUR, 1.0)
    assert governor.moving(Kind.COLOUR).scale == SIZES[-1][0]
    _, plans = settled(governor, Kind.COLOUR, 0.01)
    assert plans[-1] == Plan(Kind.COLOUR)


def test_relevance_moves_in_the_fast_mode_and_rests_exactly() -> None:
    governor = Governor().learn(Plan(Kind.MAPS), 1.2, moving=False)
    assert governor.moving(Kind.FAST).kind is Kind.FAST
    assert governor.resting(Kind.FAST, FULL_AFTER) == Plan(Kind.MAPS)


def test_atoms_move_as_small_maps_or_give_way_to_colour() -> None:
    slow = Governor().learn(Plan(Kind.MAPS), 0.5, moving=False)
    assert slow.moving(Kind.MAPS).kind is Kind.MAPS and slow.moving(Kind.MAPS).scale < 0.5
    slower = Governor().learn(Plan(Kind.MAPS), 8.0, moving=False)
    assert slower.moving(Kind.MAPS).kind is Kind.COLOUR
    assert slower.resting(Kind.MAPS, FULL_AFTER) == Plan(Kind.MAPS)


def test_a_slow_picture_settles_small_before_full() -> None:
    governor = Governor().learn(Plan(Kind.MAPS), 1.2, moving=False)
    small = governor.resting(Kind.MAPS, SETTLE_AFTER)
    assert small is not None and small.scale < 1.0 and small.kind is Kind.MAPS
    assert governor.resting(Kind.MAPS, 0.0) is None


def test_what_was_never_drawn_is_expected_to_cost_more_than_colour() -> None:
    slow = Governor().learn(Plan(Kind.COLOUR), 0.4)
    assert slow.moving(Kind.FAST).kind is Kind.FAST  # the first keystroke of a phrase does not freeze
    assert 1.5 * 0.4 * slow.moving(Kind.FAST).scale ** 2 <= MOVING_SECONDS
    fast = Governor().learn(Plan(Kind.COLOUR), 0.004)
    assert fast.moving(Kind.FAST) == Plan(Kind.MAPS)


def test_on_a_slow_machine_nothing_measured_is_no_reason_to_draw_maps() -> None:
    """Where fewer Gaussians are made before the first picture, no full one is ever measured."""
    governor = Governor(MIDDLING_SCENE, slow=True, shares=(0.5, 0.25))
    governor = governor.learn(governor.moving(Kind.COLOUR), 0.05)
    assert not governor.full_seconds
    assert governor.moving(Kind.FAST).kind is Kind.FAST


def test_what_a_picture_serves() -> None:
    assert Plan(Kind.MAPS).covers(Plan(Kind.FAST, 0.5, 0.25))
    assert Plan(Kind.FAST, 0.5).covers(Plan(Kind.COLOUR, 0.5))
    assert not Plan(Kind.FAST).covers(Plan(Kind.MAPS))
    assert not Plan(Kind.COLOUR, 1.0, 0.25).covers(Plan(Kind.COLOUR))
    assert not Plan(Kind.MAPS, 0.5).covers(Plan(Kind.COLOUR))


def test_rest_ends() -> None:
    governor = Governor()
    assert governor.next_rest(0.0) == SETTLE_AFTER
    assert governor.next_rest(SETTLE_AFTER) == FULL_AFTER - SETTLE_AFTER
    assert math.isinf(governor.next_rest(FULL_AFTER))


def test_an_unknown_machine_starts_in_the_middle() -> None:
    assert Governor().moving(Kind.COLOUR) == Plan(Kind.COLOUR, SIZES[2][0])


def test_thinner_levels_count_once_they_are_made() -> None:
    assert Governor(LARGE_SCENE).wants == (0.25, 0.0625) and Governor(MIDDLING_SCENE).wants == ()
    assert Governor(MIDDLING_SCENE, slow=True).wants == (0.5, 0.25)
    slow = Governor(MIDDLING_SCENE, slow=True)
    assert slow.ladder == SIZES == slow.with_share(0.5).ladder
    moved = slow.learn(Plan(Kind.COLOUR, 0.5), 0.06).with_share(0.5).with_share(0.25)
    assert moved.ladder == SIZES_OF_MIDDLING_SCENES and moved.moving(Kind.COLOUR).share == 1
    slower = moved.learn(moved.moving(Kind.COLOUR), 0.1).moving(Kind.COLOUR)
    assert (slower.scale, slower.share) == (0.35, 1.0), "fewer pixels come before fewer Gaussians"
    half = Governor(LARGE_SCENE).with_share(0.25)
    assert half.ladder == SIZES and half.with_share(0.0625).ladder != SIZES


def detailed(**known) -> Governor:
    """Of a scene of levels on a slow machine."""
    return Governor(3 * MIDDLING_SCENE, slow=True, coarse=0.25, **known)


def test_a_scene_with_levels_moves_coarse_until_some_detail_is_chosen() -> None:
    governor = detailed()
    assert governor.wants == (0.625, 0.4375) and governor.ladder == tuple((scale, 0.25) for scale, _ in SIZES)
    assert governor.moving(Kind.COLOUR) == Plan(Kind.COLOUR, SIZES[-1][0], 0.25), "the cheapest first"
    governor, plans = settled(governor, Kind.COLOUR, 0.4)
    assert {plan.share for plan in plans} == {0.25} and plans[-1].scale == 0.35
    made = governor.with_share(0.4375).with_share(0.625)
    assert [share for _, share in made.ladder] == [1, 1, 0.625, 0.625, 0.4375, 0.4375, 0.4375, 0.25]
    assert made.moving(Kind.COLOUR) == Plan(Kind.COLOUR, 0.25, 0.25), "none of them was measured"
    _, plans = settled(made, Kind.COLOUR, 0.1, fixed=0.04)
    assert plans[-1] == Plan(Kind.COLOUR, 0.75, 0.625) and len(set(plans[10:])) == 1


def test_who_has_time_moves_through_all_detail_and_never_in_exact_maps_of_less() -> None:
    governor, plans = settled(detailed(shares=(0.625, 0.4375)), Kind.FAST, 0.004)
    assert plans[-1] == Plan(Kind.FAST) and governor.resting(Kind.FAST, FULL_AFTER) == Plan(Kind.MAPS)
    assert not Plan(Kind.COLOUR, 1.0, 0.625).covers(Plan(Kind.COLOUR, 0.5)), "all of them are still to come"


def test_who_draws_everything_quickly_knows_no_levels() -> None:
    card = Governor(4 * MIDDLING_SCENE, coarse=0.2)
    assert card.share == 1 and card.ladder == SIZES and card.moving(Kind.COLOUR).share == 1
    small = Governor(MIDDLING_SCENE - 1, slow=True, coarse=0.2)
    assert small.share == 1 and small.ladder == SIZES


def test_many_coarse_gaussians_are_thinned_in_turn() -> None:
    """Of many photos, or with a splat file merged, all of whose Gaussians are coarse."""
    governor = Governor(10 * MIDDLING_SCENE, slow=True, coarse=0.25)
    assert governor.wants == (0.625, 0.4375, 0.125, 0.0625)
    for share in governor.wants:
        governor = governor.with_share(share)
    assert governor.ladder[-2:] == tuple((scale, 0.25 * share) for scale, share in COARSER_SIZES)


def test_a_million_without_levels_move_as_what_is_chosen_around_the_eye() -> None:
    """Of a quarter of them all over the scene, at the same cost, a picture had 2 dB less."""
    governor = Governor(1_000_000, slow=True)
    assert governor.huge and governor.waits and governor.share == 0.2
    assert governor.with_share(0.05).ladder[-2:] == ((0.25, 0.2), (0.25, 0.05))
    assert not Governor(1_000_000, slow=True, coarse=0.3).huge and not Governor(1_000_000, slow=False).huge
