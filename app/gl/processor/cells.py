"""Cells of a picture and the atoms that are seen in each: weight maps where OpenGL runs on the processor.

There a pass costs by the layers it blends into, and few of a scene's atoms are in any one part of a picture:
of 40 some 10 in a cell of 32 x 32 pixels. Each cell is drawn by the splats that reach it alone, and what it
holds goes to the layers of its atoms; atoms that are seen together share a layer. In the other layers of a
cell every weight is 0, so the maps are the same to the bit.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np

from langflash_core.splat.tiles import num_touched, tiles_touched

from ..layout import ATOMS_A_LAYER, LAYERS_A_PASS

SIDE = 32  # pixels; half a tile of llvmpipe
MOST_PAIRS = 1 << 24  # of splats and cells; sorting so many takes half a GB
_FARTHEST = 1e9  # keeps the largest footprints inside int64


@dataclass(frozen=True)
class Cells:
    """boxes: (n, 4) x, y, width, height, pixels. places: in draw order, of the splats that reach each cell,
    ascending. atoms: (n, K) bool, which these carry."""

    boxes: np.ndarray
    places: list[np.ndarray] = field(repr=False)
    atoms: np.ndarray = field(repr=False)


@dataclass(frozen=True)
class Batch:
    """Cells that are drawn into as many layers. cells: (b,) numbers. layers: (b, L), where what each one
    holds belongs."""

    cells: np.ndarray
    layers: np.ndarray

    def slots(self, atoms: np.ndarray, num_atoms: int) -> np.ndarray:
        """(b, K): place of each atom in the layers of each cell, 3 L for none.

        Args:
            atoms: as `together` orders them.
        """
        count = self.layers.shape[1]
        table = np.full((int(self.layers.max()) + 1, ATOMS_A_LAYER), num_atoms)
        flat = table.ravel()
        flat[: len(atoms)] = atoms[: len(flat)]
        slots = np.full((len(self.cells), num_atoms + 1), ATOMS_A_LAYER * count)
        held = table[self.layers].reshape(len(self.cells), -1)
        np.put_along_axis(slots, held, np.arange(ATOMS_A_LAYER * count)[None], axis=1)
        return slots[:, :num_atoms]


AtomsOf = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""(runs, K) bool of splats at places (m,) of the draw order and where each run of them starts."""


def cells_of(boxes: np.ndarray, atoms_of: AtomsOf, size: tuple[int, int], side: int = SIDE) -> Cells | None:
    """Cells of a picture (width, height) that splats reach; None where so many reach so many that each is
    better drawn once.

    Args:
        boxes: (4, n) x0, y0, x1, y1 of splats in draw order, pixels. atoms_of: which atoms they carry.
    """
    boxes = np.nan_to_num(boxes).clip(-_FARTHEST, _FARTHEST)
    boxes = np.concatenate((np.floor(boxes[:2]), np.ceil(boxes[2:]))).astype(np.int64)
    if num_touched(boxes.T, *size, side) > MOST_PAIRS:
        return None
    places, cells, (columns, _) = tiles_touched(boxes.T, *size, side)
    if not len(cells):
        return Cells(np.zeros((0, 4), np.int64), [], np.zeros((0, 0), bool))
    few = int(cells.max()) < 1 << 16
    order = np.argsort(cells.astype(np.uint16) if few else cells, kind="stable")  # of so many NumPy counts
    places, cells = places[order], cells[order]
    starts = np.flatnonzero(np.diff(cells, prepend=-1))
    low = side * np.stack((cells[starts] % columns, cells[starts] // columns), 1)
    found = np.concatenate((low, np.minimum(side, np.array(size) - low)), 1)
    return Cells(found, np.split(places, starts[1:]), atoms_of(places, starts))


def together(carried: np.ndarray) -> np.ndarray:
    """Atoms (Ka,) that are in any cell, layer by layer; those that are in the same cells share one.

    Args:
        carried: (n, K) bool, atoms of cells.
    """
    where = carried.T
    counts = where.sum(1)
    left = np.flatnonzero(counts)
    order: list[int] = []
    covered = np.zeros(len(carried), bool)
    while len(left):
        fresh = len(order) % ATOMS_A_LAYER == 0
        if fresh:  # a layer begins with the widest that is left
            best = int(np.argmax(counts[left]))
        else:  # and goes on with what adds the fewest cells for those it shares
            best = int(np.argmax(2 * (where[left] & covered).sum(1) - counts[left]))
        covered = where[left[best]] if fresh else covered | where[left[best]]
        order.append(int(left[best]))
        left = np.delete(left, best)
    return np.array(order, np.int64)


def batches(carried: np.ndarray, atoms: np.ndarray, capacity: int) -> Iterator[Batch]:
    """Each cell's layers, at most a pass at a time, an even number so that few programs do.

    Args:
        carried: as above. atoms: as `together` orders them. capacity: layers there are, whole passes.
    """
    held = np.zeros((len(carried), ATOMS_A_LAYER * capacity), bool)
    held[:, : len(atoms)] = carried[:, atoms]
    needed = held.reshape(len(carried), capacity, ATOMS_A_LAYER).any(2)
    mine_first = np.argsort(~needed, axis=1, kind="stable")
    count = 2 * -(-needed.sum(1) // 2)
    for first in range(0, capacity, LAYERS_A_PASS):
        for width in range(LAYERS_A_PASS, 0, -2):
            cells = np.flatnonzero(np.clip(count - first, 0, LAYERS_A_PASS) == width)
            if len(cells):
                yield Batch(cells, mine_first[cells, first : first + width])
