"""Batches that other processes draw while a step computes: a graphics card waits for no photo.

What a step sees follows from the seed and its number alone, whoever draws it and however many do, so a run
that was interrupted goes on with the batch that it would have seen.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import torch
from torch.utils.data import DataLoader, IterableDataset, get_worker_info

_APART = 7_919
"""Between the seeds of two steps."""
_WAITING = 3
"""Batches that every process has ready."""

Sized = Callable[[torch.Generator], tuple[int, int]]
"""Draws how many scenes a batch has, and how many views of each."""


class _Steps(IterableDataset):
    """Batches from one step on; of n processes the k-th draws every n-th."""

    def __init__(self, drawn: Any, sized: Sized, seed: int, first: int):
        self.drawn, self.sized, self.seed, self.first = drawn, sized, seed, first

    def __iter__(self) -> Iterator[Any]:
        info = get_worker_info()
        number, workers = (0, 1) if info is None else (info.id, info.num_workers)
        step = self.first + number
        while True:
            yield batch_of(self.drawn, self.sized, self.seed, step)
            step += workers


def batch_of(drawn: Any, sized: Sized, seed: int, step: int) -> Any:
    """The batch of one step, from 1."""
    seek = getattr(drawn, "seek", None)
    if seek is not None:  # of sets whose steps differ
        seek(step)
    generator = torch.Generator().manual_seed(seed + _APART * step)
    return drawn.draw(*sized(generator), generator)


@dataclass
class DrawnAhead:
    """In the place of a set: the same kinds of batches, drawn by `workers` processes."""

    drawn: Any
    workers: int
    seed: int
    sized: Sized
    _next: int = 1
    _batches: Iterator[Any] | None = None

    def __len__(self) -> int:
        return len(self.drawn)

    def seek(self, step: int) -> None:
        """What is drawn next is for this step, from 1."""
        if step != self._next:
            self._next, self._batches = step, None

    def draw(self, count: int, views: int, generator: torch.Generator) -> Any:
        """The batch of the step that is next, of the size that its own seed says: nothing given is read."""
        if self._batches is None:
            steps = _Steps(self.drawn, self.sized, self.seed, self._next)
            self._batches = iter(
                DataLoader(steps, batch_size=None, num_workers=self.workers, prefetch_factor=_WAITING)
            )
        self._next += 1
        return next(self._batches)
