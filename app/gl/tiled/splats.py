"""One scene's Gaussians drawn tile by tile: the pictures of `SplatBuffers`, by compute shaders."""

from collections.abc import Iterator
from functools import cached_property

import moderngl
import numpy as np

from langflash_core.base.graphics import Programs, set_uniforms
from langflash_core.types import Camera, Scene

from ..buffers import Brought
from ..carried import bytes_of
from ..layout import ATOMS_A_LAYER, LAYERS_A_PASS
from ..ordering import FEW
from ..shapes import MakeShapes, Quads
from ..splats import Drawable, SplatBuffers
from ..targets import drawing
from .lists import HIDDEN, TILE, TileLists

STOP = 2**-24
"""Transmittance below which a pixel is full: what lies behind changes no float32 alpha any more."""


class TiledSplats(SplatBuffers):
    """As `SplatBuffers`, of a context of OpenGL 4.3. What the card cannot list (`lists.MOST_PAIRS`) is drawn
    as quads, from an order that is found here."""

    def __init__(
        self,
        ctx: moderngl.Context,
        programs: Programs,
        scene: Scene | Drawable,
        shapes: MakeShapes = Quads,
    ):
        super().__init__(ctx, programs, scene, shapes)
        beside = max(bytes_of(LAYERS_A_PASS), 8 * self.carried.bits.shape[1])
        self._lists = TileLists(ctx, programs, self._vertices, self.num_gaussians, beside)
        self._own_numbers = Brought(ctx)  # row by row
        self._exact = True  # what is drawn next, or was last
        self._tiled = True

    @property
    def order(self) -> np.ndarray:
        return self._lists.rows()[::-1] if self._tiled else super().order

    @property
    def num_chosen(self) -> int:
        return self._lists.num_seen if self._tiled else super().num_chosen

    @property
    def depth_range(self) -> tuple[float, float]:
        if self._tiled and self.num_chosen:
            margin = self.num_chosen // 50
            self._ordering.depth_range = (
                self._lists.depth(margin),
                self._lists.depth(self.num_chosen - 1 - margin),
            )
        return self._ordering.depth_range

    # --- what to draw -----------------------------------------------------------------------

    def mark(self, shown: np.ndarray, tints: np.ndarray) -> bool:
        return super().mark(shown, np.where(shown, tints, HIDDEN))

    def sort(self, camera: Camera) -> None:
        self._exact = True

    def found(self, camera: Camera) -> bool:
        return True

    def follow(self, camera: Camera) -> bool:
        """As `sort`; of more Gaussians than are ordered in no time those that are a millionth of their depth
        apart may lie in either order."""
        self._exact = self.num_gaussians <= FEW
        return self._exact

    def active_atoms(self) -> np.ndarray:
        if not self._tiled:
            return super().active_atoms()
        if not (self.carried.num_atoms and self.num_chosen):
            return np.zeros(0, np.int64)
        found = self._lists.atoms(self._atom_words).view(np.uint8)
        return np.flatnonzero(np.unpackbits(found, bitorder="little"))

    @cached_property
    def _atom_words(self) -> np.ndarray:
        return self.carried.bits.astype("<u8").view("<u4")

    def compile(self, camera: Camera) -> Iterator[None]:
        yield from self._lists.compile(self._projection(camera)[0])

    def project(self, camera: Camera) -> None:
        """Footprints, colours, order and lists of tiles, on the card."""
        self.shapes.forget()
        self._tiled = not self.num_gaussians or self._lists.find(
            camera, self._projection(camera), self._exact
        )
        if not self._tiled:
            super().sort(camera)
            super().project(camera)

    # --- pictures ---------------------------------------------------------------------------

    def splat(
        self, into: moderngl.Framebuffer, numbers: np.ndarray | None = None, depth: bool = True
    ) -> None:
        if not self._tiled:
            super().splat(into, numbers, depth)
            return
        into.clear()
        carried, num_layers = None, 0
        if numbers is not None and self.num_chosen:
            num_layers = numbers.shape[1] // ATOMS_A_LAYER
            carried = self._own_numbers.of(numbers)
        self._fill(into, {"COLOUR": 1} if depth else {"COLOUR": 1, "ALONE": 1}, carried, num_layers)

    def splat_weights(
        self, atoms: np.ndarray, first: int, num_layers: int, into: moderngl.Framebuffer
    ) -> None:
        if not self._tiled:
            super().splat_weights(atoms, first, num_layers, into)
            return
        out = self._expanded.at_least(bytes_of(num_layers) * self.num_gaussians)
        self._transform(self._textures.ready(atoms, first, num_layers), [], out, ordered=False)
        self._fill(into, {}, out, num_layers)

    def _fill(
        self,
        into: moderngl.Framebuffer,
        defines: dict[str, float],
        weights: moderngl.Buffer | None,
        num_layers: int,
    ) -> None:
        """Every pixel of the picture out of its tile's list."""
        if not self.num_chosen:
            return
        layers = {"LAYERS": num_layers} if num_layers else {}
        given = {"TILE": TILE, "STOP": STOP, **layers, **defines}
        program = self._programs.get("screen.vert", "tiled/splat.frag", given)
        set_uniforms(program, image_size=tuple(float(side) for side in self._lists.size))
        key = ("screen", program.glo)
        if key not in self._vaos:
            self._vaos[key] = self._ctx.vertex_array(program, [])
        self._lists.bind()
        if weights is not None:
            weights.bind_to_storage_buffer(3)
        with drawing(into):
            self._vaos[key].render(moderngl.TRIANGLES, vertices=3)
        self._ctx.memory_barrier()  # what comes next writes where these fragments read

    def release(self) -> None:
        self._lists.release()
        self._own_numbers.release()
        super().release()
