"""What projected Gaussians are drawn as: quads here, where OpenGL runs on the processor sprites
(processor/sprites.py)."""

from collections.abc import Callable
from typing import Literal

import moderngl

SHAPE_FLOATS = 8  # that project.vert writes: place (4), shape (4)
PLACE_FLOATS = SHAPE_FLOATS + 3  # and colour


class Quads:
    """Four corners each, instanced: the shapes of the Gaussians that one `SplatBuffers` projected last.

    Subclasses draw others.
    """

    def __init__(self, ctx: moderngl.Context):
        self.ctx = ctx

    @property
    def defines(self) -> dict[str, float]:
        """What quad.vert is compiled with to draw them."""
        return {}

    @property
    def each(self) -> Literal["/i", "/v"]:
        """What a vertex array's formats end in: an instance or a vertex a Gaussian."""
        return "/i"

    def forget(self) -> None:
        """Others were chosen, and not projected yet."""

    def measure(self, places: moderngl.Buffer, count: int, size: tuple[int, int]) -> None:
        """Look at what was projected: `count` times `PLACE_FLOATS`, for a picture of `size` pixels."""

    def render(self, vao: moderngl.VertexArray, count: int, first: int = 0) -> None:
        """Draw `count` of them; `first`: of one vertex each alone."""
        assert first == 0
        vao.render(moderngl.TRIANGLE_STRIP, vertices=4, instances=count)


MakeShapes = Callable[[moderngl.Context], Quads]
