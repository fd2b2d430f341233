"""Sets of a scene's Gaussians, a bit each: of ten million none takes a frame's thread more than a millisecond
but `of` and `rows`, which have a byte for each."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from jaxtyping import Bool


@dataclass(frozen=True)
class Mask:
    """A set of rows 0 to count - 1. bits: one each, lowest first, the last byte filled with 0."""

    count: int
    bits: bytes = field(repr=False)

    @staticmethod
    def none(count: int) -> "Mask":
        """The empty set."""
        return Mask(count, bytes(-(-count // 8)))

    @staticmethod
    def of(rows: Bool[np.ndarray, " N"]) -> "Mask":
        """The rows that are true in a boolean (count,)."""
        return Mask(len(rows), np.packbits(np.asarray(rows, bool), bitorder="little").tobytes())

    @staticmethod
    def full(count: int) -> "Mask":
        """Every row."""
        return Mask.first(count, count)

    @staticmethod
    def first(count: int, some: int) -> "Mask":
        """The first `some` rows of `count`; all where that is more."""
        whole, rest = divmod(min(max(some, 0), count), 8)
        bits = b"\xff" * whole + bytes([(1 << rest) - 1] * (rest > 0))
        return Mask(count, bits.ljust(-(-count // 8), b"\0"))

    def of_count(self, count: int) -> "Mask":
        """The same rows of more or fewer; rows that there are no longer are left out."""
        if count == self.count:
            return self
        rows = np.zeros(count, bool)
        kept = self.rows()[:count]
        rows[: len(kept)] = kept
        return Mask.of(rows)

    def rows(self) -> Bool[np.ndarray, " N"]:
        """Boolean (count,)."""
        packed = np.frombuffer(self.bits, np.uint8)
        return np.unpackbits(packed, count=self.count, bitorder="little").view(bool)

    def __len__(self) -> int:
        """How many rows are in the set."""
        return self._size

    @cached_property
    def _size(self) -> int:
        """Frames ask again and again."""
        return int(np.bitwise_count(np.frombuffer(self.bits, np.uint8)).sum())

    def __or__(self, other: "Mask") -> "Mask":
        return self._with(np.bitwise_or, other)

    def __and__(self, other: "Mask") -> "Mask":
        return self._with(np.bitwise_and, other)

    def __xor__(self, other: "Mask") -> "Mask":
        return self._with(np.bitwise_xor, other)

    def __sub__(self, other: "Mask") -> "Mask":
        return self._with(lambda ours, theirs: ours & ~theirs, other)

    def _with(self, combine: Callable[[np.ndarray, np.ndarray], np.ndarray], other: "Mask") -> "Mask":
        if other.count != self.count:
            raise ValueError(f"mask: expected {self.count} rows, received {other.count}")
        ours, theirs = np.frombuffer(self.bits, np.uint8), np.frombuffer(other.bits, np.uint8)
        return Mask(self.count, combine(ours, theirs).tobytes())
