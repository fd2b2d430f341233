"""What projected Gaussians are drawn as: quads here, where OpenGL runs on the processor sprites
(processor/sprites.py)."""

from collections.abc import Callable
from typing import Literal, Protocol

import moderngl

SHAPE_FLOATS = 8  # that project.vert writes: place (4), shape (4)
PLACE_FLOATS = SHAPE_FLOATS + 3  # and colour


class Shapes(Protocol):
    """Of the Gaussians that one `SplatBuffers` projected last."""

    @property
    def defines(self) -> dict[str, float]:
        """What quad.vert is compiled with to draw them."""
        ...

    @property
    def each(self) -> Literal["/i", "/v"]:
        """What a vertex array's formats end in: an instance or a vertex a Gaussian."""
        ...

    def forget(self) -> None:
        """Others were chosen, and not projected yet."""
        ...

    def measure(self, places: moderngl.Buffer, count: int, size: tuple[int, int]) -> None:
        """Look at what was projected: `count` times `PLACE_FLOATS`, for a picture of `size` pixels."""
        ...

    def render(self, vao: moderngl.VertexArray, count: int, first: int = 0) -> None:
        """Draw `count` of them; `first`: of one vertex each alone."""
        ...


MakeShapes = Callable[[moderngl.Context], Shapes]


class Quads:
    """Four corners each, instanced."""

    def __init__(self, ctx: moderngl.Context):
        self.defines: dict[str, float] = {}
        self.each: Literal["/i", "/v"] = "/i"

    def forget(self) -> None:
        pass

    def measure(self, places: moderngl.Buffer, count: int, size: tuple[int, int]) -> None:
        pass

    def render(self, vao: moderngl.VertexArray, count: int, first: int = 0) -> None:
        assert first == 0
        vao.render(moderngl.TRIANGLE_STRIP, vertices=4, instances=count)
