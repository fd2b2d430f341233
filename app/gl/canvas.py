"""What renderers draw with and on: the programs of a context, and targets of the last two sizes,
weight maps of the last one alone."""

from typing import Literal

import moderngl

from langflash_core.base.graphics import OPENGL
from langflash_core.errors import GraphicsError

from .hardware import Hardware, hardware_of
from .painter import Painter
from .view import ViewTargets

Precision = Literal["float16", "float32"]
_KEPT = 2  # sizes
_DTYPES = {"float16": "f2", "float32": "f4"}


class Canvas:
    """Owns both. A renderer has one of its own, or shares one whose maker releases it after the renderers."""

    def __init__(
        self,
        ctx: moderngl.Context,
        precision: Precision = "float16",
        maps: Precision | None = None,
        hardware: Hardware | None = None,
    ):
        """
        Args:
            precision: of colour and weight maps; alphas, depth and relevance are always float32.
            maps: of weight maps, if another.
            hardware: whose ways of drawing to take; None: where the context draws.

        Raises:
            GraphicsError: the context is older than OpenGL 3.3.
            ValueError: another precision.
        """
        for each in (precision, maps or precision):
            if each not in _DTYPES:
                raise ValueError(f"precision: expected float16 or float32, received {each!r}")
        if ctx.version_code < OPENGL:
            raise GraphicsError(
                f"OpenGL {ctx.version_code / 100:.1f} is too old for splatting, 3.3 is needed; "
                "update the graphics driver"
            )
        self.hardware = hardware_of(ctx) if hardware is None else hardware
        self.painter = Painter(ctx, self.hardware.shapes, self.hardware.defines)
        self.precision = precision
        self._dtypes = _DTYPES[precision], _DTYPES[maps or precision]
        self._views: list[ViewTargets] = []  # the newest last

    def view(self, size: tuple[int, int]) -> ViewTargets:
        """The targets of (width, height) pixels.

        Those of the size before are kept, so that what they show can stay until the new ones are painted,
        without their weight maps, which take the most; older ones are given back.

        Raises:
            ValueError: the size has no pixels.
            GraphicsError: it is larger than the driver's textures.
        """
        found = next((view for view in self._views if view.size == size), None)
        if found is None:
            _check(size, self.painter.ctx.info["GL_MAX_TEXTURE_SIZE"])
            while len(self._views) >= _KEPT:
                self._views.pop(0).release()
            found = ViewTargets(self.painter, size, *self._dtypes, self.hardware.maps)
        else:
            self._views.remove(found)
        for other in self._views:
            other.forget_maps()
        self._views.append(found)
        return found

    def holds(self, view: ViewTargets) -> bool:
        """Whether these targets are still there to be read."""
        return view in self._views

    def forget(self) -> None:
        """Give all targets back, and no program; what is drawn next makes its own."""
        while self._views:
            self._views.pop().release()

    def release(self) -> None:
        """Give everything back; what is drawn next makes it anew."""
        self.forget()
        self.painter.release()


def _check(size: tuple[int, int], limit: int) -> None:
    if min(size) < 1:
        raise ValueError(f"camera: expected at least 1 x 1 pixels, received {size[0]} x {size[1]}")
    if max(size) > limit:
        raise GraphicsError(
            f"an image of {size[0]} x {size[1]} is larger than this driver's {limit} pixels a side; "
            "choose a smaller size"
        )
