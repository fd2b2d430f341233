"""Sequences whose items are made when they are asked for."""

from collections.abc import Callable, Sequence
from typing import TypeVar

T = TypeVar("T")


class Lazy(Sequence[T]):
    """`count` items that `make` makes, anew whenever one is asked for; of up to `held` each is made once."""

    def __init__(self, make: Callable[[int], T], count: int, held: int = 0):
        self._make, self._count = make, count
        self._known: dict[int, T] | None = {} if count <= held else None

    def __len__(self) -> int:
        return self._count

    def __getitem__(self, index: int) -> T:
        if not 0 <= index < self._count:
            raise IndexError(index)
        if self._known is None:
            return self._make(index)
        if index not in self._known:
            self._known[index] = self._make(index)
        return self._known[index]
