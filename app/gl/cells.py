"""Cells of a picture and the atoms that are seen in each: weight maps where OpenGL runs on the processor.

There a pass costs by the layers it blends into, and few of a scene's atoms are in any one part of a picture:
of 40 some 14 in a cell of 64 x 64 pixels. Each cell is drawn by itself, by the splats that reach it, into
the layers that hold its atoms; atoms that are seen together share a layer. In the other layers of a
cell every weight is 0, so the maps are the same to the bit.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from langflash_core.splat.tiles import num_touched, tiles_touched

from .layout import ATOMS_A_LAYER, LAYERS_A_PASS, num_layers
from .splats import SplatBuffers

SIDE = 64  # pixels, a tile of llvmpipe
MOST_PAIRS = 1 << 24  # of splats and cells; sorting so many takes half a GB
_FARTHEST = 1e9  # keeps the largest footprints inside int64


@dataclass(frozen=True)
class Cell:
    """box: x, y, width, height in pixels. places: in draw order, of the splats that reach it, ascending.
    atoms: (K,) bool, which they carry."""

    box: tuple[int, int, int, int]
    places: np.ndarray = field(repr=False)
    atoms: np.ndarray = field(repr=False)


def cells_of(splats: SplatBuffers, size: tuple[int, int], side: int = SIDE) -> list[Cell] | None:
    """Cells of a picture (width, height) that measured splats reach; None where so many reach so many that
    each is better drawn once."""
    boxes = np.nan_to_num(splats.boxes()).clip(-_FARTHEST, _FARTHEST)
    boxes = np.concatenate((np.floor(boxes[:2]), np.ceil(boxes[2:]))).astype(np.int64)
    if num_touched(boxes.T, *size, side) > MOST_PAIRS:
        return None
    places, cells, (columns, _) = tiles_touched(boxes.T, *size, side)
    if not len(cells):
        return []
    order = np.argsort(cells, kind="stable")
    places, cells = places[order], cells[order]
    starts = np.flatnonzero(np.diff(cells, prepend=-1))
    atoms = splats.atoms_of(places, starts)
    corners = [(side * int(n % columns), side * int(n // columns)) for n in cells[starts]]
    return [
        Cell((x, y, min(side, size[0] - x), min(side, size[1] - y)), run, carried)
        for (x, y), run, carried in zip(corners, np.split(places, starts[1:]), atoms, strict=True)
    ]


def together(cells: Sequence[Cell]) -> np.ndarray:
    """Atoms (Ka,) that are in any cell, layer by layer; those that are in the same cells share one."""
    if not cells:
        return np.zeros(0, np.int64)
    where = np.stack([cell.atoms for cell in cells], 1)  # (K, cells)
    counts = where.sum(1)
    left = np.flatnonzero(counts)
    order: list[int] = []
    covered = np.zeros(len(cells), bool)
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


def chosen_layers(cell: Cell, atoms: np.ndarray, capacity: int) -> list[list[int]]:
    """Layers that hold atoms of a cell, at most a pass at a time, an even number so that few programs do.

    Args:
        atoms: as `together` orders them. capacity: layers there are, an even number.
    """
    carried = np.zeros(ATOMS_A_LAYER * num_layers(len(atoms)), bool)
    carried[: len(atoms)] = cell.atoms[atoms]
    needed = np.flatnonzero(carried.reshape(-1, ATOMS_A_LAYER).any(1)).tolist()
    if len(needed) % 2:
        needed.append(next(layer for layer in range(capacity) if layer not in needed))
    return [needed[first : first + LAYERS_A_PASS] for first in range(0, len(needed), LAYERS_A_PASS)]
