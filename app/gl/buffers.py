"""Buffers on the card that numbers go to."""

import moderngl
import numpy as np


def buffer_of(ctx: moderngl.Context, values: np.ndarray) -> moderngl.Buffer:
    """One that holds an array; of an empty one it has room for a number, since OpenGL has none of no size."""
    return ctx.buffer(np.ascontiguousarray(values) if values.size else bytes(4))


class Brought:
    """A buffer of the array that was brought last, which is not brought again."""

    def __init__(self, ctx: moderngl.Context):
        self._buffer = Growing(ctx)
        self._values: np.ndarray | None = None

    def of(self, values: np.ndarray) -> moderngl.Buffer:
        """The buffer, with what this array holds; whoever gives it changes nothing in it."""
        buffer = self._buffer.at_least(values.nbytes)
        if values is not self._values:
            buffer.write(np.ascontiguousarray(values))
            self._values = values
        return buffer

    def release(self) -> None:
        self._buffer.release()
        self._values = None


class Growing:
    """A buffer made when first needed, and larger when more is."""

    def __init__(self, ctx: moderngl.Context):
        self._ctx = ctx
        self._made: moderngl.Buffer | None = None

    def at_least(self, size: int) -> moderngl.Buffer:
        """One of `size` bytes or more, always the same object; what it held is lost where it grows."""
        if self._made is None:
            self._made = self._ctx.buffer(reserve=size)
        elif self._made.size < size:
            self._made.orphan(size)
        return self._made

    def release(self) -> None:
        if self._made is not None:
            self._made.release()
        self._made = None
