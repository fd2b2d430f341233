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


def told(ahead: DrawnAhead, steps: int, first: int = 1) -> list[tuple[int, torch.Tensor]]:
    found = []
    for step in range(first, first + steps):
        ahead.seek(step)
        found.append(ahead.draw(3, 2, torch.Generator()))
    return found


@pytest.mark.parametrize("workers", [1, 2])
def test_who_draws_and_how_many_do_changes_nothing(workers):
    expected = [batch_of(Numbers(), 3, 2, 5, step) for step in range(1, 8)]
    found = told(DrawnAhead(Numbers(), workers, 5), 7)
    assert [step for step, _ in found] == list(range(1, 8))
    assert all(torch.equal(a, b) for (_, a), (_, b) in zip(found, expected, strict=True))
    assert not torch.equal(found[0][1], found[1][1])
    other = told(DrawnAhead(Numbers(), workers, 6), 1)
    assert not torch.equal(other[0][1], found[0][1])


def test_a_run_goes_on_with_the_batch_that_it_would_have_seen():
    whole = told(DrawnAhead(Numbers(), 2, 0), 6)
    again = told(DrawnAhead(Numbers(), 2, 0), 3, first=4)
    assert [step for step, _ in again] == [4, 5, 6]
    assert all(torch.equal(a, b) for (_, a), (_, b) in zip(whole[3:], again, strict=True))
