"""Weight maps drawn cell by cell of the picture, each with its own atoms alone (cells.py)."""

from collections.abc import Iterator, Sequence
from functools import partial

import moderngl
import numpy as np

from langflash_core.base.graphics import set_uniforms

from ..blend import add_maps
from ..buffers import Growing
from ..carried import bytes_of
from ..layered import Prepared
from ..layout import ATOMS_A_LAYER, ATOMS_A_PASS, LAYERS_A_PASS, num_layers
from ..painter import Painter
from ..splats import SplatBuffers
from ..targets import PREMULTIPLIED, Layers, LayerTarget, drawing
from ..weights import Maps, WeightMaps
from .cells import Batch, Cells, batches, cells_of, together
from .sprites import Sprites

_SPLATS_AT_ONCE = 1 << 17  # of cells: 13 MB of weights


class CellMaps(WeightMaps):
    """As `WeightMaps`; whole where there are no sprites, or splats and cells make too many pairs."""

    def __init__(self, painter: Painter, size: tuple[int, int], dtype: str):
        super().__init__(painter, size, dtype)
        self._cells = Layers(painter.ctx, size, dtype)
        self._stream = Stream(painter.ctx)

    def draw(self, level: Prepared, shares: moderngl.Texture | None) -> Maps:
        found = [self._cells_of(part.splats) for part in level.parts]
        cells = [each for each in found if each is not None]
        if len(cells) < len(found):
            return super().draw(level, shares)
        reached = [each.atoms for each in cells if len(each.boxes)] or [cells[0].atoms]
        atoms = together(np.concatenate(reached))
        layers = self.layers.at_least(max(1, -(-len(atoms) // ATOMS_A_PASS) * LAYERS_A_PASS))
        if shares is None:
            self._draw_in(layers, cells[0], level.parts[0].splats, atoms)
        else:
            _clear(layers, atoms)
            own = self._own.exactly(layers.num_layers)
            for place, part in enumerate(level.parts):
                self._draw_in(own, cells[place], part.splats, atoms)
                for first in _passes(atoms):
                    into = layers.layers(first, LAYERS_A_PASS)
                    add_maps(self.painter, own, first, LAYERS_A_PASS, shares, place, into, level.halved)
        return Maps(layers, atoms, level.order_key)

    def _cells_of(self, splats: SplatBuffers) -> Cells | None:
        """The cells that splats reach; None where they are better drawn whole."""
        sprites = splats.shapes
        if not isinstance(sprites, Sprites) or sprites.footprints is None:
            return None
        return cells_of(sprites.footprints.boxes(), partial(_atoms_of, splats), self.size)

    def _draw_in(self, layers: LayerTarget, cells: Cells, splats: SplatBuffers, atoms: np.ndarray) -> None:
        """Cells that need as many layers are drawn beside each other, into the first ones of an array for
        that, and go from there to their atoms' layers: a framebuffer for each cell leaves all processors but
        one without work."""
        _clear(layers, atoms)
        for batch in batches(cells.atoms, atoms, layers.num_layers) if len(cells.boxes) else ():
            self._draw_batch(splats, cells, batch, batch.slots(atoms, cells.atoms.shape[1]))
            boxes = cells.boxes[batch.cells].tolist()
            for place, chosen in enumerate(batch.layers.T.tolist()):
                self._cells.at_least(1).copy(place, layers, zip(boxes, chosen, strict=True))
        self.painter.passes["weights"] += len(_passes(atoms))

    def _draw_batch(self, splats: SplatBuffers, cells: Cells, batch: Batch, slots: np.ndarray) -> None:
        sprites = splats.shapes
        assert isinstance(sprites, Sprites)
        count = batch.layers.shape[1]
        program = self.painter.programs.get("quad.vert", "weights.frag", {"LAYERS": count, **sprites.defines})
        set_uniforms(program, image_size=tuple(float(n) for n in self.size))
        target = self._cells.at_least(count).layers(0, count)
        target.clear()
        with drawing(target, PREMULTIPLIED):
            places = [cells.places[cell] for cell in batch.cells]
            self._stream.draw(splats, sprites, program, cells.boxes[batch.cells], places, slots, count)
        target.scissor = (0, 0, *self.size)

    def release(self) -> None:
        self._stream.release()
        self._cells.release()
        super().release()


class Stream:
    """Owns what goes to the card anew for each cell: footprints and dense weights of its splats."""

    def __init__(self, ctx: moderngl.Context):
        self._ctx = ctx
        self._footprints = Growing(ctx)
        self._weights = Growing(ctx)
        self._vaos: dict[tuple, moderngl.VertexArray] = {}

    def draw(
        self,
        splats: SplatBuffers,
        sprites: Sprites,
        program: moderngl.Program,
        boxes: np.ndarray,
        places: Sequence[np.ndarray],
        slots: np.ndarray,
        num_layers: int,
    ) -> None:
        """Weights into the framebuffer in use, in each cell of those at its places of the order, within its
        box. Its scissor is the last cell's afterwards.

        Args:
            boxes: (b, 4) x, y, width, height, pixels. places: of each cell, ascending.
            slots: (b, K), place of each atom in the layers of each cell, 3 `num_layers` for none.
        """
        vao = self._vao(program, sprites.each, num_layers)
        counts = [len(each) for each in places]
        for first, last in _uploads(counts, sprites.small):
            chosen, some = np.concatenate(places[first:last]), counts[first:last]
            width = ATOMS_A_LAYER * num_layers
            dense = splats.carried.dense(splats.order[chosen], some, slots[first:last], width)
            assert sprites.footprints is not None
            shapes = sprites.footprints.values[chosen]
            for buffer, stream in ((self._footprints, shapes), (self._weights, dense)):
                buffer.at_least(stream.nbytes).write(stream)
            at = 0
            for box, count in zip(boxes[first:last].tolist(), some, strict=True):
                self._ctx.fbo.scissor = tuple(box)
                sprites.render(vao, count, at)
                at += count

    def _vao(self, program: moderngl.Program, each: str, num_layers: int) -> moderngl.VertexArray:
        key = (program.glo, each)
        if key not in self._vaos:
            content = [
                (self._footprints.at_least(1), f"4f 4f{each}", "in_place", "in_shape"),
                (self._weights.at_least(1), f"{bytes_of(num_layers) // 4}f 4x{each}", "in_weights"),
            ]
            self._vaos[key] = self._ctx.vertex_array(program, content)
        return self._vaos[key]

    def release(self) -> None:
        """Give the buffers back; what is drawn next makes them anew."""
        for vao in self._vaos.values():
            vao.release()
        self._vaos.clear()
        self._weights.release()
        self._footprints.release()


def _passes(atoms: np.ndarray) -> range:
    """The first layer of each pass of so many atoms."""
    return range(0, num_layers(len(atoms)), LAYERS_A_PASS)


def _clear(layers: LayerTarget, atoms: np.ndarray) -> None:
    for first in _passes(atoms):
        layers.layers(first, LAYERS_A_PASS).clear()


def _atoms_of(splats: SplatBuffers, places: np.ndarray, starts: np.ndarray) -> np.ndarray:
    return splats.carried.atoms_of(splats.order[places], starts)


def _uploads(counts: Sequence[int], several: bool) -> Iterator[tuple[int, int]]:
    """Cells to draw out of one upload: of several, or from the first one on."""
    first, total = 0, 0
    for cell, count in enumerate(counts):
        if cell > first and (not several or total + count > _SPLATS_AT_ONCE):
            yield first, cell
            first, total = cell, 0
        total += count
    if counts:
        yield first, len(counts)
