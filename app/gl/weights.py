"""Weight maps W_k(p) of the atoms in view: drawn in passes of `layout.ATOMS_A_PASS`,
on a processor cell by cell (processor/cell_maps.py), read back on request."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import reduce

import moderngl
import numpy as np

from .blend import add_maps
from .layered import Prepared
from .layout import ATOMS_A_LAYER, ATOMS_A_PASS, LAYERS_A_PASS, num_layers
from .painter import Painter
from .splats import SplatBuffers
from .targets import NUMPY_TYPES, Layers, LayerTarget

_ROWS_AT_ONCE = 8  # of pixels, to be read: a megabyte or two, which stay in a core's cache


@dataclass(frozen=True)
class Maps:
    """Weight maps of one view: `atoms` (Ka,) in view, three a layer of `layers`, which is none of
    theirs where Ka is 0; `version` names their content."""

    layers: LayerTarget
    atoms: np.ndarray
    version: int

    @property
    def array(self) -> moderngl.TextureArray:
        return self.layers.array

    @property
    def num_layers(self) -> int:
        """Layers that hold atoms; the array may have more."""
        return num_layers(len(self.atoms))

    def read(self, num_atoms: int) -> np.ndarray:
        """(H, W, K) float32; 0 for atoms out of view."""
        width, height, count = self.array.size
        maps = np.zeros((height, width, num_atoms), np.float32)
        if not len(self.atoms):
            return maps
        texels = np.frombuffer(self.array.read(), NUMPY_TYPES[self.array.dtype])
        layers = texels.reshape(count, height, width, 4)[: self.num_layers, ..., :ATOMS_A_LAYER]
        for first in range(0, height, _ROWS_AT_ONCE):
            some = slice(first, first + _ROWS_AT_ONCE)
            flat = np.moveaxis(layers[:, some], 0, 2).reshape(-1, width, ATOMS_A_LAYER * self.num_layers)
            maps[some][..., self.atoms] = flat[..., : len(self.atoms)]
        return maps

    def pixel(self, x: int, y: int, num_atoms: int) -> np.ndarray:
        """(K,) float32 of one pixel; 0 for atoms out of view."""
        weights = np.zeros(num_atoms, np.float32)
        for first in range(0, self.num_layers, LAYERS_A_PASS):
            texels = self.layers.texel(first, min(LAYERS_A_PASS, self.num_layers - first), x, y)
            atoms = self.atoms[ATOMS_A_LAYER * first :][: ATOMS_A_LAYER * len(texels)]
            weights[atoms] = texels[:, :ATOMS_A_LAYER].reshape(-1)[: len(atoms)]
        return weights


class WeightMaps:
    """Owns the layers; draws the maps once for each order of a level. Subclasses may `draw` otherwise."""

    def __init__(self, painter: Painter, size: tuple[int, int], dtype: str):
        self.painter = painter
        self.size = size
        self.layers = Layers(painter.ctx, size, dtype)
        self._maps: Maps | None = None
        self._own = Layers(painter.ctx, size, dtype)  # of one part of a level that is blended

    def shows(self, level: Prepared) -> bool:
        """Whether the maps are those of the level as it stands."""
        return self._maps is not None and self._maps.version == level.order_key

    def of(self, level: Prepared, shares: moderngl.Texture | None = None) -> Maps:
        """The maps of the level as it stands, drawn unless they are there.

        Args:
            shares: of a level that is blended, what each part counts in each pixel.
        """
        if self._maps is None or self._maps.version != level.order_key:
            self._maps = self.draw(level, shares)
        return self._maps

    def draw(self, level: Prepared, shares: moderngl.Texture | None) -> Maps:
        """Of the atoms in view, in passes of `layout.ATOMS_A_PASS`."""
        atoms = reduce(np.union1d, [part.splats.active_atoms() for part in level.parts])
        whole_passes = -(-len(atoms) // ATOMS_A_PASS) * LAYERS_A_PASS
        layers = self.layers.at_least(max(1, whole_passes))
        for first in range(0, len(atoms), ATOMS_A_PASS):
            count = num_layers(min(ATOMS_A_PASS, len(atoms) - first))
            target = layers.layers(first // ATOMS_A_LAYER, count)
            target.clear()
            if shares is None:
                self._draw(level.parts[0].splats, target, atoms, first, count)
            else:
                self._add(level, shares, target, atoms, first, count)
        return Maps(layers, atoms, level.order_key)

    def _add(
        self,
        level: Prepared,
        shares: moderngl.Texture,
        target: moderngl.Framebuffer,
        atoms: np.ndarray,
        first: int,
        count: int,
    ) -> None:
        """One pass of each part, and what it counts of that."""
        own = self._own.at_least(LAYERS_A_PASS)
        for place, part in enumerate(level.parts):
            alone = own.layers(0, count)
            alone.clear()
            self._draw(part.splats, alone, atoms, first, count)
            add_maps(self.painter, own, 0, count, shares, place, target, level.halved)

    def _draw(
        self, splats: SplatBuffers, target: moderngl.Framebuffer, atoms: np.ndarray, first: int, count: int
    ) -> None:
        """One pass, of `count` layers of the atoms from place `first` on, over what is there."""
        if not splats.num_chosen:
            return
        splats.splat_weights(atoms, first, count, target)
        self.painter.passes["weights"] += 1

    def release(self) -> None:
        """Give the layers back; whoever asks for maps draws them anew."""
        self.layers.release()
        self._own.release()
        self._maps = None


MakeMaps = Callable[[Painter, tuple[int, int], str], WeightMaps]
"""For pictures of (width, height) pixels, of a type of textures."""
