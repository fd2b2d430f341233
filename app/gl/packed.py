"""Weight maps packed for reading: shares of the pixel's peak, its largest weight, in sixteen bits.

Eight atoms a texel: a phrase then reads a third as many texels, of a format that is quick to read. Half a
step, 8e-6 of the peak, moves a cosine by some 1e-5; float16 maps are 30 times coarser.
"""

from collections.abc import Iterator, Mapping

import moderngl
import numpy as np

from .layout import ATOMS_A_LAYER, ATOMS_A_TEXEL, ATOMS_PACKED
from .painter import Painter, Textures, Uniforms
from .targets import SUM, Layers
from .weights import Maps

_CAPACITIES = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 120)  # few, so that few programs are compiled
_UNIFORMS = 960  # of the 1,024 vec4s that drivers have
_MAX_COLUMNS = 16  # a pass
_STEPS = 65535
_HALVES = ATOMS_A_TEXEL // 4  # vec4s of a column for each texel


def layer_capacity(num_atoms: int) -> int:
    """Texels that so many atoms are given: a few sizes only.

    Raises:
        ValueError: more atoms than a shader's uniforms hold.
    """
    most = ATOMS_A_TEXEL * _CAPACITIES[-1]
    if num_atoms > most:
        raise ValueError(f"atoms in view: expected at most {most}, received {num_atoms}")
    return next(size for size in _CAPACITIES if num_atoms <= ATOMS_A_TEXEL * size)


def blocks(columns: np.ndarray) -> Iterator[tuple[int, int, np.ndarray]]:
    """Columns (Ka, n) in blocks that one pass of `PackedMaps.combine` takes, the last filled up with zeros.
    Column j is 0 before atom j, so its pass need not read the texels of those.

    Yields:
        Number of the block's first column; its first atom; the block (Ka - first atom, width), its width
        a power of two up to 16, as many as the uniforms hold.
    """
    together = _UNIFORMS // (_HALVES * layer_capacity(len(columns)))
    width = min(_MAX_COLUMNS, 1 << (together.bit_length() - 1))
    for start in range(0, columns.shape[1], width):
        first = start - start % ATOMS_A_TEXEL
        block = columns[first:, start : start + width]
        yield start, first, np.pad(block, ((0, 0), (0, width - block.shape[1])))


class PackedMaps:
    """Owns the packed maps of one size and their peaks; packs each version of the weight maps once."""

    def __init__(self, painter: Painter, size: tuple[int, int]):
        self.peaks = painter.ctx.texture(size, 1, dtype="f4")
        self._painter = painter
        self._target = painter.ctx.framebuffer([self.peaks])
        self._layers = Layers(painter.ctx, size, "u4")
        self._version = 0

    def combine(
        self,
        into: moderngl.Framebuffer,
        fragment: str,
        maps: Maps,
        columns: np.ndarray,
        first_atom: int = 0,
        textures: Textures | None = None,
        uniforms: Uniforms | None = None,
        defines: Mapping[str, float] | None = None,
        blend: tuple[int, int] | None = None,
        equation: tuple[int, int] = SUM,
    ) -> None:
        """Draw a shader that sums w_k a_k, as combine.glsl does, for columns a (Ka - first_atom, n).

        Args:
            first_atom: of the columns, a multiple of 8: atoms before it weigh nothing.
        """
        capacity = layer_capacity(len(columns))
        self._painter.fill(
            into,
            fragment,
            {"packed_maps": self._of(maps), "peaks": self.peaks, **(textures or {})},
            {
                "first_layer": first_atom // ATOMS_A_TEXEL,
                "columns": _packed_columns(columns, capacity),
                **(uniforms or {}),
            },
            {"LAYERS": capacity, "COLUMNS": columns.shape[1], **(defines or {})},
            blend,
            equation,
        )

    def _of(self, maps: Maps) -> moderngl.TextureArray:
        """The maps as shares of their peaks."""
        chunks = -(-len(maps.atoms) // ATOMS_PACKED)
        texels = ATOMS_PACKED // ATOMS_A_TEXEL
        needed = max(texels * chunks, layer_capacity(len(maps.atoms)))
        layers = self._layers.at_least(needed)
        if maps.version == self._version:
            return layers.array
        count = {"num_layers": maps.num_layers}
        self._painter.fill(self._target, "peak.frag", {"weight_maps": maps.array}, count)
        textures = {"weight_maps": maps.array, "peaks": self.peaks}
        for chunk in range(chunks):
            first = ATOMS_PACKED // ATOMS_A_LAYER * chunk
            into = layers.layers(texels * chunk, texels)
            self._painter.fill(into, "pack.frag", textures, {"first_layer": first, **count})
        self._painter.passes["pack"] += 1
        self._version = maps.version
        return layers.array

    def forget(self) -> None:
        """Pack anew for the next question."""
        self._version = 0
        self._layers.release()

    def release(self) -> None:
        self._layers.release()
        self._target.release()
        self.peaks.release()


def _packed_columns(columns: np.ndarray, capacity: int) -> np.ndarray:
    """(Ka, n) to the (2 * capacity * n, 4) floats of `columns` in combine.glsl."""
    filled = np.zeros((ATOMS_A_TEXEL * capacity, columns.shape[1]), np.float32)
    filled[: len(columns)] = columns / _STEPS
    return filled.reshape(_HALVES * capacity, 4, -1).transpose(0, 2, 1).reshape(-1, 4)
