"""Pictures of single layers of a scene, and the one that is blended of them: langflash_core/splat/compose.py
on the graphics card."""

import moderngl
import numpy as np

from langflash_core.splat.compose import DEPTH, NEAREST
from langflash_core.splat.projection import ALPHA_MIN

from .colour import draw_colour
from .level import Prepared
from .painter import Painter
from .targets import ADDED, ColourTarget, LayerTarget

assert NEAREST == 4  # as many as blend.frag reads, and numbers of a texel


class Blend:
    """Owns a picture of each layer, of one size, and `shares`: what each counts in each pixel, of the picture
    that was drawn last. Made when the first layered scene is drawn."""

    def __init__(self, painter: Painter, into: ColourTarget, dtype: str):
        """into: what the blended picture goes to."""
        size = into.colour.size
        self._painter = painter
        self._into = into
        self._dtype = dtype
        self._layers: list[ColourTarget] = []
        self.shares = painter.ctx.texture(size, 4, dtype="f4")
        self.shares.filter = (moderngl.NEAREST, moderngl.NEAREST)
        self._target = painter.ctx.framebuffer([into.colour, into.depth, self.shares])

    def draw(self, level: Prepared) -> None:
        """Colour, depth and shares of a level's parts by their weights."""
        assert level.weights is not None
        while len(self._layers) < len(level.parts):
            self._layers.append(ColourTarget(self._painter.ctx, self._into.colour.size, self._dtype))
        textures: dict[str, moderngl.Texture] = {}
        for place, part in enumerate(level.parts):
            layer = self._layers[place]
            draw_colour(self._painter.programs, [part.splats], layer.framebuffer)
            textures |= {f"colour_{place}": layer.colour, f"depth_{place}": layer.depth}
        weights = tuple(float(w) for w in np.pad(level.weights, (0, NEAREST - len(level.weights))))
        defines = {"LAYERS": len(level.parts), "DEPTH": DEPTH, "ALPHA_MIN": ALPHA_MIN}
        self._painter.fill(self._target, "blend.frag", textures, {"weights": weights}, defines)
        self._painter.passes["blend"] += 1

    def forget(self) -> None:
        """Give the pictures of single layers back; what each counts stays."""
        for layer in self._layers:
            layer.release()
        self._layers.clear()

    def release(self) -> None:
        """Give every texture back."""
        self.forget()
        self._target.release()
        self.shares.release()


def add_maps(
    painter: Painter,
    own: LayerTarget,
    first: int,
    count: int,
    shares: moderngl.Texture,
    part: int,
    into: moderngl.Framebuffer,
) -> None:
    """Add `count` layers of one part's maps, from `first` on, times what it counts, to as many others."""
    textures, uniforms = {"maps": own.array, "shares": shares}, {"part": part, "first_layer": first}
    painter.fill(into, "blend_maps.frag", textures, uniforms, {"LAYERS": count}, blend=ADDED)
