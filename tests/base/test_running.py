"""Work under way: what is told, what is timed, where it stops."""

import pytest

from langflash_core.base.running import Run, evenly, time_left
from langflash_core.errors import Cancelled

BEGINS = {"read": 0.0, "think": 0.2, "write": 0.8, "check": 0.8}


def test_stages_are_told_in_their_place_and_timed():
    told: list[tuple[str, float]] = []
    run = Run(BEGINS, lambda *what: told.append(what))
    for name in BEGINS:
        with run.stage(name):
            pass
    assert told == list(BEGINS.items()) and list(run.timings) == list(BEGINS)
    before = run.timings["think"]
    with run.stage("think"):
        pass
    assert run.timings["think"] > before >= 0 and len(run.timings) == 4


def test_steps_of_a_stage_are_a_part_of_the_whole():
    told: list[tuple[str, float]] = []
    run = Run(BEGINS, lambda *what: told.append(what))
    for name in ("think", "write"):
        run.within(name)("step", 0.5)
    assert told == [("step", pytest.approx(0.5)), ("step", pytest.approx(0.9))]
    Run(BEGINS).within("think")("nobody listens", 0.5)


def test_a_run_stops_before_the_next_stage():
    stopped = False
    run = Run(evenly(("one", "two")), None, lambda: stopped)
    with run.stage("one"):
        stopped = True
    with pytest.raises(Cancelled, match="nothing was written"), run.stage("two"):
        raise AssertionError("the stage began")
    assert list(run.timings) == ["one"]


def test_a_run_stops_before_the_next_step_of_a_stage():
    stopped = False
    step = Run(BEGINS, None, lambda: stopped).within("think")
    step("first", 0.0)
    stopped = True
    with pytest.raises(Cancelled, match="nothing was written"):
        step("second", 0.5)


def test_stages_that_take_equally_long():
    assert evenly(("a", "b", "c", "d")) == {"a": 0.0, "b": 0.25, "c": 0.5, "d": 0.75}


def test_items_are_told_with_their_number_and_stop_the_run():
    told: list[tuple[str, float]] = []
    run = Run(BEGINS, lambda *what: told.append(what), lambda: len(told) == 2)
    seen = []
    with pytest.raises(Cancelled):
        for item in run.counted("think", "photo", "abc", 0.5):
            seen.append(item)
    assert seen == ["a", "b"]
    assert told == [("think: photo 1 of 3", pytest.approx(0.5)), ("think: photo 2 of 3", pytest.approx(0.6))]


def test_what_is_left_is_told_once_it_can_be():
    assert time_left(1.0, 0.5) == time_left(60.0, 0.01) == time_left(60.0, 0.0) == time_left(60.0, 1.0) == ""
    assert time_left(30.0, 0.75) == "about 10 s left" and time_left(300.0, 0.5) == "about 5 min left"


def test_steps_are_made_where_nothing_is_kept():
    assert Run(BEGINS).kept("step", lambda: {"a": 1}) == {"a": 1}
