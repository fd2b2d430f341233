"""Point sprites in place of quads: the same fragments out of one vertex, 30 % quicker on a processor."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Literal

import moderngl
import numpy as np

from ..shapes import PLACE_FLOATS, SHAPE_FLOATS, Quads

_SLACK = 0.02  # deviations, of quad.vert
_MARGIN = 128.0  # pixels around the image where a sprite's centre may be


@dataclass(frozen=True)
class Footprints:
    """values: (n, 8) float32, place and shape as project.vert has them, in draw order."""

    values: np.ndarray

    def reaches(self) -> tuple[np.ndarray, np.ndarray]:
        """Half the sides (n,) of the boxes, pixels."""
        l11, l21, l22, radius = self.values[:, 4:].T
        with np.errstate(over="ignore", invalid="ignore"):
            radius = radius + np.float32(_SLACK)
            return radius * l11, radius * np.sqrt(l21 * l21 + l22 * l22)

    def boxes(self) -> np.ndarray:
        """(4, n) float32 x0, y0, x1, y1, pixels."""
        x, y = self.values[:, :2].T
        wide, tall = self.reaches()
        with np.errstate(over="ignore", invalid="ignore"):
            return np.stack((x - wide, y - tall, x + wide, y + tall))


class Sprites(Quads):
    """Sprites, where none that reaches the image is too large for one, else quads.

    `footprints`: of the Gaussians that were projected last; None before they are.
    """

    def __init__(self, ctx: moderngl.Context):
        super().__init__(ctx)
        self.footprints: Footprints | None = None
        self.small = False
        self._largest = min(2 * _MARGIN, ctx.info["GL_POINT_SIZE_RANGE"][1])
        self._widest_view = min(ctx.info["GL_MAX_VIEWPORT_DIMS"])

    @property
    def defines(self) -> dict[str, float]:
        return {"MARGIN": _MARGIN} if self.small else super().defines

    @property
    def each(self) -> Literal["/i", "/v"]:
        return "/v" if self.small else super().each

    def forget(self) -> None:
        self.footprints = None

    def measure(self, places: moderngl.Buffer, count: int, size: tuple[int, int]) -> None:
        """Read the footprints back; whether all that reach the image are small enough for sprites, and the
        image with its margin for a viewport."""
        read = np.frombuffer(places.read(4 * PLACE_FLOATS * count), np.float32).reshape(-1, PLACE_FLOATS)
        self.footprints = Footprints(read[:, :SHAPE_FLOATS])
        small = 2 * np.maximum(*self.footprints.reaches()) < self._largest
        if not small.all():  # what is broken compares as beside the image
            x0, y0, x1, y1 = self.footprints.boxes()
            small = small[(x1 > 0) & (y1 > 0) & (x0 < size[0]) & (y0 < size[1])]
        self.small = bool(small.all()) and max(size) + 2 * _MARGIN <= self._widest_view

    def render(self, vao: moderngl.VertexArray, count: int, first: int = 0) -> None:
        if self.small:
            with _as_sprites(self.ctx, int(_MARGIN)):
                vao.render(moderngl.POINTS, vertices=count, first=first)
        else:
            super().render(vao, count, first)


@contextmanager
def _as_sprites(ctx: moderngl.Context, margin: int) -> Iterator[None]:
    """Draw points as large as their shader says into the framebuffer in use, within `drawing`.

    The viewport is `margin` pixels wider on every side: points are left out with their centres.
    """
    framebuffer = ctx.fbo
    x, y, width, height = before = framebuffer.viewport
    framebuffer.viewport = (x - margin, y - margin, width + 2 * margin, height + 2 * margin)
    ctx.enable(moderngl.PROGRAM_POINT_SIZE)
    try:
        yield
    finally:
        ctx.disable(moderngl.PROGRAM_POINT_SIZE)
        framebuffer.viewport = before
