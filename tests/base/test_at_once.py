"""Steps of photos side by side: in order, each alone, and nothing left running behind whoever stops."""

import threading
import time
from collections.abc import Iterator

import pytest
import torch

from langflash_core.base.at_once import at_once
from langflash_core.errors import Cancelled
from tests.torch_threads import torch_threads


@pytest.fixture(params=[1, 2, 3])
def threads(request) -> Iterator[int]:
    with torch_threads(request.param):
        yield request.param


def late_first(number: int) -> int:
    time.sleep(0.02 if number == 0 else 0.0)
    return number * number


def test_in_order_whoever_is_done_first(threads: int) -> None:
    assert list(at_once(late_first, iter(range(7)))) == [n * n for n in range(7)]
    assert list(at_once(late_first, [])) == []


def test_as_many_as_torch_has_threads_each_alone(threads: int) -> None:
    """And without gradients, where whoever asked has none; afterwards torch has all of its threads again."""
    meet = threading.Barrier(threads)

    def step(_: int) -> tuple[int, bool]:
        meet.wait(10)
        return torch.get_num_threads(), torch.is_grad_enabled()

    with torch.no_grad():
        assert list(at_once(step, range(2 * threads))) == [(1, False)] * (2 * threads)
    assert set(at_once(lambda _: torch.is_grad_enabled(), range(3))) == {True}
    assert torch.get_num_threads() == threads


def test_the_next_are_asked_for_here_and_not_before_there_is_room(threads: int) -> None:
    asked: list[tuple[int, bool]] = []

    def turns() -> Iterator[int]:
        for number in range(9):
            asked.append((number, threading.current_thread() is threading.main_thread()))
            yield number

    for taken, _ in enumerate(at_once(late_first, turns())):
        assert len(asked) <= taken + threads and all(here for _, here in asked)


def test_an_error_or_a_stop_leaves_nothing_running(threads: int) -> None:
    running = []

    def step(number: int) -> int:
        running.append(number)
        time.sleep(0.01)
        if number == 3:
            raise ValueError("three")
        running.remove(number)
        return number

    with pytest.raises(ValueError, match="three"):
        list(at_once(step, range(20)))
    assert running == [3] and torch.get_num_threads() == threads

    def turns() -> Iterator[int]:
        yield from range(4, 8)
        raise Cancelled("enough")

    with pytest.raises(Cancelled):
        list(at_once(step, turns()))
    assert running == [3] and torch.get_num_threads() == threads
