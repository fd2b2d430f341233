"""Sets of a scene's Gaussians, a bit each."""

from dataclasses import dataclass, field

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
        return Mask.of(np.ones(count, bool))

    @staticmethod
    def first(count: int, some: int) -> "Mask":
        """The first `some` rows of `count`."""
        return Mask.of(np.arange(count) < some)

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
        return np.unpackbits(packed, count=self.count, bitorder="little").astype(bool)

    def __len__(self) -> int:
        """How many rows are in the set."""
        return int.from_bytes(self.bits, "little").bit_count()

    def __or__(self, other: "Mask") -> "Mask":
        return self._with(np.bitwise_or, other)

    def __and__(self, other: "Mask") -> "Mask":
        return self._with(np.bitwise_and, other)

    def __xor__(self, other: "Mask") -> "Mask":
        return self._with(np.bitwise_xor, other)

    def __sub__(self, other: "Mask") -> "Mask":
        return self & (other ^ Mask.full(self.count))

    def _with(self, combine: np.ufunc, other: "Mask") -> "Mask":
        if other.count != self.count:
            raise ValueError(f"mask: expected {self.count} rows, received {other.count}")
        ours, theirs = np.frombuffer(self.bits, np.uint8), np.frombuffer(other.bits, np.uint8)
        return Mask(self.count, combine(ours, theirs).tobytes())
