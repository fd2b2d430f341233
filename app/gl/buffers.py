"""Buffers on the card that numbers go to."""

import moderngl
import numpy as np


def buffer_of(ctx: moderngl.Context, values: np.ndarray) -> moderngl.Buffer:
    """One that holds an array; of an empty one it has room for a number, since OpenGL has none of no size."""
    return ctx.buffer(np.ascontiguousarray(values) if values.size else bytes(4))


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
