"""Batches that other processes draw: the same whoever draws them; an interrupted run goes on with its own."""

from dataclasses import dataclass

import pytest
import torch

from langflash_core.lab.training.ahead import DrawnAhead, batch_of


@dataclass
class Numbers:
    """Draws numbers, and says of which step they are."""

    step: int = 1

    def __len__(self) -> int:
        return 7

    def seek(self, step: int) -> None:
        self.step = step

    def draw(self, count: int, views: int, generator: torch.Generator) -> tuple[int, torch.Tensor]:
        return self.step, torch.rand(count, views, generator=generator)


def three_of_two(generator: torch.Generator) -> tuple[int, int]:
    return 3, 2


def told(ahead: DrawnAhead, steps: int, first: int = 1) -> list[tuple[int, torch.Tensor]]:
    found = []
    for step in range(first, first + steps):
        ahead.seek(step)
        found.append(ahead.draw(3, 2, torch.Generator()))
    return found


@pytest.mark.parametrize("workers", [1, 2])
def test_who_draws_and_how_many_do_changes_nothing(workers):
    expected = [batch_of(Numbers(), three_of_two, 5, step) for step in range(1, 8)]
    found = told(DrawnAhead(Numbers(), workers, 5, three_of_two), 7)
    assert [step for step, _ in found] == list(range(1, 8))
    assert all(torch.equal(a, b) for (_, a), (_, b) in zip(found, expected, strict=True))
    assert not torch.equal(found[0][1], found[1][1])
    other = told(DrawnAhead(Numbers(), workers, 6, three_of_two), 1)
    assert not torch.equal(other[0][1], found[0][1])


def test_a_run_goes_on_with_the_batch_that_it_would_have_seen():
    whole = told(DrawnAhead(Numbers(), 2, 0, three_of_two), 6)
    again = told(DrawnAhead(Numbers(), 2, 0, three_of_two), 3, first=4)
    assert [step for step, _ in again] == [4, 5, 6]
    assert all(torch.equal(a, b) for (_, a), (_, b) in zip(whole[3:], again, strict=True))


def test_sizes_that_change_from_step_to_step_start_no_process_anew():
    def sized(generator: torch.Generator) -> tuple[int, int]:
        return 1, 2 + int(torch.randint(2, (1,), generator=generator))

    ahead = DrawnAhead(Numbers(), 2, 3, sized)
    first = ahead.draw(1, 2, torch.Generator())
    running = ahead._batches
    found = [first, *(ahead.draw(1, 3, torch.Generator()) for _ in range(7))]
    assert {numbers.shape[1] for _, numbers in found} == {2, 3}
    assert [step for step, _ in found] == list(range(1, 9))
    assert ahead._batches is running
