"""Weight maps cell by cell, as software OpenGL draws them, against whole ones: the same to the bit."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from app.gl import cells as cells_module
from app.gl.cells import Cell, cells_of, chosen_layers, together
from app.gl.layout import ATOMS_A_LAYER, LAYERS_A_PASS, num_layers
from langflash_core.graphics import draws_in_software
from langflash_core.types import Scene
from tests.app.gl.test_gl_sprites import Quads, drawn
from tests.splat.scenes import camera, cloud


@pytest.fixture
def software(gl):
    if not draws_in_software(gl):
        pytest.skip("a graphics card draws whole maps")


def local(num_atoms: int, twice: bool = False) -> Scene:
    """A scene whose atoms lie in columns of the picture; `twice`: ids that a Gaussian names twice."""
    scene = cloud(600, num_atoms)
    x, _, z = scene.gaussians.means.unbind(-1)
    first = ((x / z / 1.4 + 0.5).clamp(0, 0.999) * num_atoms).long()
    ids = (first[:, None] + torch.arange(4)) % num_atoms
    if twice:
        ids[:, 3] = ids[:, 0]
    return replace(scene, semantics=replace(scene.semantics, weight_ids=ids))


@pytest.mark.parametrize(("num_atoms", "twice"), [(1, True), (7, False), (25, True), (70, False)])
def test_cells_hold_what_whole_maps_hold(gl, software, num_atoms, twice):
    scene, view = local(num_atoms, twice), camera(200, 150, 170.0)
    mine, true = drawn(gl, scene, view)[0][3], drawn(gl, scene, view, Quads)[0][3]
    assert float(true.max()) > 0.5
    assert torch.equal(mine, true)


def test_cells_are_drawn_as_quads_where_a_splat_is_too_large(gl, software):
    scene = local(30)
    scales = scene.gaussians.scales.clone()
    scales[0] = 1e3
    scene = replace(scene, gaussians=replace(scene.gaussians, scales=scales))
    view = camera(200, 150, 170.0)
    mine, true = drawn(gl, scene, view), drawn(gl, scene, view, Quads)
    assert not mine[2] and torch.equal(mine[0][3], true[0][3])


def test_maps_are_drawn_whole_where_too_many_splats_reach_too_many_cells(gl, software, monkeypatch):
    scene, view = local(30), camera(200, 150, 170.0)
    boxes = np.tile(np.array([[0.0], [0.0], [130.0], [100.0]], np.float32), 200)
    everywhere = Placed(boxes, np.ones((200, 9), bool))
    monkeypatch.setattr(cells_module, "MOST_PAIRS", 5 * 4 * 200)
    assert len(cells_of(everywhere, (130, 100), side=32) or ()) == 5 * 4  # pyright: ignore[reportArgumentType]
    monkeypatch.setattr(cells_module, "MOST_PAIRS", 5 * 4 * 200 - 1)
    assert cells_of(everywhere, (130, 100), side=32) is None  # pyright: ignore[reportArgumentType]
    monkeypatch.setattr(cells_module, "MOST_PAIRS", 0)
    mine, true = drawn(gl, scene, view)[0][3], drawn(gl, scene, view, Quads)[0][3]
    assert torch.equal(mine, true)


class Placed:
    """Splats that know their boxes (4, n) and their atoms (n, K)."""

    def __init__(self, boxes: np.ndarray, carried: np.ndarray):
        self._boxes, self._carried = boxes, carried

    def boxes(self):
        return self._boxes

    def atoms_of(self, places, starts):
        return np.logical_or.reduceat(self._carried[places], starts, axis=0)


def test_cells_find_every_splat_that_reaches_them():
    draw = np.random.default_rng(0)
    low = draw.uniform(-40, 140, (2, 200))
    boxes = np.concatenate((low, low + draw.uniform(0, 50, (2, 200)))).astype(np.float32)
    boxes[:, 0], boxes[:, 1] = np.nan, np.inf  # broken, and beside every image
    carried = draw.random((200, 9)) < 0.05
    reached = cells_of(Placed(boxes, carried), (130, 100), side=32)  # pyright: ignore[reportArgumentType]
    assert reached is not None
    found = {cell.box: cell for cell in reached}
    for left in range(0, 130, 32):
        for top in range(0, 100, 32):
            box = (left, top, min(32, 130 - left), min(32, 100 - top))
            x0, y0, x1, y1 = boxes
            reach = (x0 < left + box[2]) & (x1 > left) & (y0 < top + box[3]) & (y1 > top)
            assert set(np.flatnonzero(reach)) <= set(found[box].places.tolist())
            assert (np.diff(found[box].places) > 0).all()  # in draw order
            assert np.array_equal(found[box].atoms, carried[found[box].places].any(0))


def test_layers_of_a_cell_hold_its_atoms_once():
    draw = np.random.default_rng(1)
    none = np.zeros(0, np.int64)
    cells = [Cell((0, 0, 64, 64), none, draw.random(100) < share) for share in (0.02, 0.2, 0.6, 1.0)]
    atoms = together(cells)
    assert sorted(atoms.tolist()) == list(range(100))
    capacity = -(-num_layers(100) // LAYERS_A_PASS) * LAYERS_A_PASS
    for cell in cells:
        passes = chosen_layers(cell, atoms, capacity)
        layers = [layer for chosen in passes for layer in chosen]
        assert len(layers) == len(set(layers)) and max(layers) < capacity
        assert all(len(chosen) <= LAYERS_A_PASS and len(chosen) % 2 == 0 for chosen in passes)
        held = [atom for layer in layers for atom in atoms[ATOMS_A_LAYER * layer :][:ATOMS_A_LAYER]]
        assert set(np.flatnonzero(cell.atoms)) <= set(held)


def test_no_cells_have_no_atoms():
    assert len(together([])) == 0
