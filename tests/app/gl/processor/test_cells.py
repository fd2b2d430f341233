"""Weight maps cell by cell, as software OpenGL draws them, against whole ones: the same to the bit."""

from collections import defaultdict
from dataclasses import replace

import numpy as np
import pytest
import torch

from app.gl.hardware import CARD
from app.gl.layout import ATOMS_A_LAYER, LAYERS_A_PASS, num_layers
from app.gl.processor import cell_maps as cell_maps_module
from app.gl.processor import cells as cells_module
from app.gl.processor.cells import AtomsOf, batches, cells_of, together
from app.gl.targets import LayerTarget, read
from langflash_core.base.graphics import draws_in_software
from langflash_core.types import Scene
from tests.app.gl.processor.test_sprites import drawn
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
    mine, true = drawn(gl, scene, view)[0][3], drawn(gl, scene, view, CARD)[0][3]
    assert float(true.max()) > 0.5
    assert torch.equal(mine, true)


def test_maps_are_drawn_whole_where_too_many_splats_reach_too_many_cells(gl, software, monkeypatch):
    scene, view = local(30), camera(200, 150, 170.0)
    boxes = np.tile(np.array([[0.0], [0.0], [130.0], [100.0]], np.float32), 200)
    everywhere = boxes, carrying(np.ones((200, 9), bool))
    monkeypatch.setattr(cells_module, "MOST_PAIRS", 5 * 4 * 200)
    reached = cells_of(*everywhere, (130, 100), side=32)
    assert reached is not None and len(reached.places) == 5 * 4
    monkeypatch.setattr(cells_module, "MOST_PAIRS", 5 * 4 * 200 - 1)
    assert cells_of(*everywhere, (130, 100), side=32) is None  # pyright: ignore[reportArgumentType]
    monkeypatch.setattr(cells_module, "MOST_PAIRS", 0)
    mine, true = drawn(gl, scene, view)[0][3], drawn(gl, scene, view, CARD)[0][3]
    assert torch.equal(mine, true)


def carrying(carried: np.ndarray) -> AtomsOf:
    """Of splats that carry atoms (n, K)."""
    return lambda places, starts: np.logical_or.reduceat(carried[places], starts, axis=0)


def test_cells_find_every_splat_that_reaches_them():
    draw = np.random.default_rng(0)
    low = draw.uniform(-40, 140, (2, 200))
    boxes = np.concatenate((low, low + draw.uniform(0, 50, (2, 200)))).astype(np.float32)
    boxes[:, 0], boxes[:, 1] = np.nan, np.inf  # broken, and beside every image
    carried = draw.random((200, 9)) < 0.05
    reached = cells_of(boxes, carrying(carried), (130, 100), side=32)
    assert reached is not None
    boxes_found = [tuple(box) for box in reached.boxes.tolist()]
    found = dict(zip(boxes_found, zip(reached.places, reached.atoms, strict=True), strict=True))
    assert len(found) == len(boxes_found)
    for left in range(0, 130, 32):
        for top in range(0, 100, 32):
            box = (left, top, min(32, 130 - left), min(32, 100 - top))
            x0, y0, x1, y1 = boxes
            reach = (x0 < left + box[2]) & (x1 > left) & (y0 < top + box[3]) & (y1 > top)
            places, atoms = found[box]
            assert set(np.flatnonzero(reach)) <= set(places.tolist())
            assert (np.diff(places) > 0).all()  # in draw order
            assert np.array_equal(atoms, carried[places].any(0))


@pytest.mark.parametrize("num_atoms", [1, 24, 100])
def test_layers_of_a_cell_hold_its_atoms_once(num_atoms):
    draw = np.random.default_rng(1)
    carried = draw.random((40, num_atoms)) < draw.random((40, 1))
    carried[0], carried[1] = True, False
    atoms = together(carried)
    assert sorted(atoms.tolist()) == list(range(num_atoms))
    capacity = -(-num_layers(num_atoms) // LAYERS_A_PASS) * LAYERS_A_PASS
    layers, held = defaultdict[int, list[int]](list), defaultdict[int, list[int]](list)
    for batch in batches(carried, atoms, capacity):
        count = batch.layers.shape[1]
        assert 0 < count <= LAYERS_A_PASS and count % 2 == 0
        slots = batch.slots(atoms, num_atoms)
        for cell, chosen, places in zip(batch.cells.tolist(), batch.layers.tolist(), slots, strict=True):
            layers[cell] += chosen
            inside = np.flatnonzero(places < ATOMS_A_LAYER * count)
            for atom in inside:  # where a map of these layers is looked for
                layer, channel = divmod(int(places[atom]), ATOMS_A_LAYER)
                assert atoms[ATOMS_A_LAYER * chosen[layer] + channel] == atom
            held[cell] += inside.tolist()
    assert sorted(layers) == np.flatnonzero(carried.any(1)).tolist()
    for cell, chosen in layers.items():
        assert len(chosen) == len(set(chosen)) and max(chosen) < capacity
        assert len(held[cell]) == len(set(held[cell])) and set(np.flatnonzero(carried[cell])) <= set(
            held[cell]
        )


def test_no_cells_have_no_atoms():
    assert len(together(np.zeros((0, 3), bool))) == 0


def test_cells_are_drawn_out_of_many_uploads(gl, software, monkeypatch):
    """As where a large scene's would take gigabytes."""
    scene, view = local(40), camera(200, 150, 170.0)
    at_once = drawn(gl, scene, view)[0][3]
    monkeypatch.setattr(cell_maps_module, "_SPLATS_AT_ONCE", 50)
    assert torch.equal(drawn(gl, scene, view)[0][3], at_once)


def test_what_lies_beside_a_copied_rectangle_stays(gl):
    """A layer's rectangle goes to the same place in another array's layers, and nowhere else."""
    source, target = (LayerTarget(gl, (20, 12), 2, "f2") for _ in range(2))
    try:
        numbers = np.arange(20 * 12 * 4, dtype=np.float16).reshape(12, 20, 4)
        source.array.write(np.stack((np.zeros_like(numbers), numbers)))
        target.array.write(np.full((2, 12, 20, 4), -1, np.float16))
        source.copy(1, target, [((3, 2, 8, 5), 0), ((16, 10, 4, 2), 1)])
        expected = np.full((2, 12, 20, 4), -1, np.float32)
        expected[0, 2:7, 3:11], expected[1, 10:, 16:] = numbers[2:7, 3:11], numbers[10:, 16:]
        assert np.array_equal(read(target.array).reshape(2, 12, 20, 4), expected)
    finally:
        source.release()
        target.release()
