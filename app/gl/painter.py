"""What lives as long as the context: programs, and full-screen passes with them."""

from collections import Counter
from collections.abc import Mapping

import moderngl
import numpy as np

from langflash_core.base.graphics import Programs, set_uniforms

from .layout import DEFINES
from .shapes import MakeShapes, Quads
from .targets import SUM, drawing

Uniforms = Mapping[str, float | tuple | np.ndarray]
Textures = Mapping[str, moderngl.Texture | moderngl.TextureArray]


class Painter:
    """Owns the programs of `shaders/splat/` on one context; `passes` counts what was drawn with them."""

    def __init__(
        self, ctx: moderngl.Context, shapes: MakeShapes = Quads, defines: Mapping[str, float] | None = None
    ):
        """shapes: what Gaussians are drawn as. defines: of all programs, beside those of layout.py."""
        self.ctx = ctx
        self.shapes = shapes
        self.programs = Programs(ctx, "splat", {**DEFINES, **(defines or {})})
        self.passes: Counter[str] = Counter()
        self._screens: dict[int, moderngl.VertexArray] = {}

    def fill(
        self,
        into: moderngl.Framebuffer,
        fragment: str,
        textures: Textures,
        uniforms: Uniforms | None = None,
        defines: Mapping[str, float] | None = None,
        blend: tuple[int, int] | None = None,
        equation: tuple[int, int] = SUM,
    ) -> None:
        """Draw a full-screen triangle by a fragment shader that reads `textures` by their names."""
        program = self.programs.get("screen.vert", fragment, defines)
        for unit, texture in enumerate(textures.values()):
            texture.use(unit)
        set_uniforms(program, **{name: unit for unit, name in enumerate(textures)}, **(uniforms or {}))
        if program.glo not in self._screens:
            self._screens[program.glo] = self.ctx.vertex_array(program, [])
        with drawing(into, blend, equation):
            self._screens[program.glo].render(moderngl.TRIANGLES, vertices=3)

    def release(self) -> None:
        """Give the programs back; what is drawn next compiles them again."""
        for screen in self._screens.values():
            screen.release()
        self._screens.clear()
        self.programs.release()
