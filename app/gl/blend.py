"""Pictures of single layers of a scene, and the one that is blended of them: langflash_core/splat/compose.py
on the graphics card."""

from collections.abc import Sequence

import moderngl
import numpy as np

from langflash_core.geometry.nearness import NEAREST
from langflash_core.splat.compose import CLOSES, DEPTH
from langflash_core.splat.projection import ALPHA_MIN

from .layered import Prepared
from .layout import ATOMS_A_LAYER
from .painter import Painter
from .targets import ADDED, ColourTarget, Layers, LayerTarget

assert NEAREST == 4  # as many as blend.frag reads, and numbers of a texel
_FEW = 2  # layers that have a program of their own, half as long


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
        self._numbers: list[Layers] = []  # that each layer's Gaussians carry
        self.shares = painter.ctx.texture(size, 4, dtype="f4")
        self.shares.filter = (moderngl.NEAREST, moderngl.NEAREST)
        self._target = painter.ctx.framebuffer([into.colour, into.depth, self.shares])

    def draw(
        self, level: Prepared, numbers: Sequence[np.ndarray] = (), into: LayerTarget | None = None
    ) -> None:
        """Colour, depth and shares of a level's parts by their weights.

        Args:
            numbers: of each part, (N, 3 L) that its Gaussians carry; blended alike into the L layers
                of `into`.
        """
        assert level.weights is not None
        for place, part in enumerate(level.parts):
            carried = numbers[place] if into is not None else None
            part.splats.splat(self._drawn_into(place, carried), carried)
        self._painter.passes["colour"] += len(level.parts)
        few = len(level.parts) <= _FEW
        textures: dict[str, moderngl.Texture] = {}
        for place in range(_FEW if few else NEAREST):  # one that is not there is the first, of weight 0
            layer = self._layers[place if place < len(level.parts) else 0]
            textures |= {f"colour_{place}": layer.colour, f"depth_{place}": layer.depth}
        weights = tuple(float(w) for w in np.pad(level.weights, (0, NEAREST - len(level.weights))))
        uniforms = {"weights": weights, "halved": level.halved}
        defines = {
            "LAYERS": _FEW if few else NEAREST,
            "DEPTH": DEPTH,
            "CLOSES": CLOSES,
            "ALPHA_MIN": ALPHA_MIN,
        }
        self._painter.fill(self._target, "blend.frag", textures, uniforms, defines)
        self._painter.passes["blend"] += 1
        if into is not None:
            self._add(level, into)

    def _drawn_into(self, place: int, numbers: np.ndarray | None) -> moderngl.Framebuffer:
        """What the layer at a place is drawn into, with so many numbers."""
        ctx, size = self._painter.ctx, self._into.colour.size
        while len(self._layers) <= place:
            self._layers.append(ColourTarget(ctx, size, self._dtype))
            self._numbers.append(Layers(ctx, size, self._dtype))
        layer = self._layers[place]
        if numbers is None:
            return layer.framebuffer
        count = numbers.shape[1] // ATOMS_A_LAYER
        return self._numbers[place].exactly(count).layers(0, count, beside=(layer.colour, layer.depth))

    def _add(self, level: Prepared, into: LayerTarget) -> None:
        """The numbers of each part times what it counts in each pixel."""
        count = into.num_layers
        target = into.layers(0, count)
        target.clear()
        for place in range(len(level.parts)):
            own = self._numbers[place].exactly(count)
            add_maps(self._painter, own, 0, count, self.shares, place, target, level.halved)

    def forget(self) -> None:
        """Give the pictures of single layers back; what each counts stays."""
        for owned in (*self._numbers, *self._layers):
            owned.release()
        self._numbers.clear()
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
    halved: bool,
) -> None:
    """Add `count` layers of one part's maps, from `first` on, times what it counts, to as many others.

    Args:
        halved: as `LayeredLevel` has it.
    """
    textures = {"maps": own.array, "shares": shares}
    uniforms = {"part": part, "first_layer": first, "halved": halved and part > 0}
    painter.fill(into, "blend_maps.frag", textures, uniforms, {"LAYERS": count}, blend=ADDED)
