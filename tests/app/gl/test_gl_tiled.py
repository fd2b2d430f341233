"""Splats drawn tile by tile beside the quads: what lists of tiles hold, where they end, what changes them.
The hard cases and the ordinary ones are in test_gl_hard_cases.py and test_gl_against_reference.py."""

from dataclasses import replace

import moderngl
import numpy as np
import pytest
import torch

from app.gl import SplatRenderer
from app.gl.painter import Painter
from app.gl.splats import SplatBuffers
from app.gl.tiled import lists
from app.gl.tiled.lists import TileLists
from app.gl.tiled.splats import TiledSplats
from langflash_core.base.graphics import COMPUTE
from langflash_core.scene.changes import Recoloured
from langflash_core.scene.mask import Mask
from langflash_core.splat import render
from langflash_core.types import Scene
from tests.app.gl.questions import question
from tests.app.gl.test_gl_hard_cases import ALPHA, STEP, agree, largest, within
from tests.app.gl.test_gl_layers import between, layered
from tests.splat.scenes import camera, cloud, maps_of, scene_of, splats, turned

BOTH = 2 * (2 * ALPHA + 4 * STEP["float32"])
"""Between two pictures that each keep the limits of test_gl_hard_cases.py, of a few layers a pixel."""


@pytest.fixture(autouse=True)
def _computes(gl):
    if gl.version_code < COMPUTE:
        pytest.skip("OpenGL 4.3 is not here")


@pytest.fixture
def pair(show):
    """`pair(scene, ...)`: a renderer of quads and one of tiles."""
    return lambda scene, **how: [
        show(scene, "float32", splats=make, **how) for make in (SplatBuffers, TiledSplats)
    ]


def equal(quads: SplatRenderer, tiles: SplatRenderer) -> None:
    """The pictures on show, in every number."""
    left, right = (each.frame(weight_maps=True) for each in (quads, tiles))
    assert left.alphas.max() > 0.5
    within("alphas", largest(left.alphas, right.alphas), BOTH)
    within("colours", largest(left.rgb, right.rgb), BOTH * max(1.0, float(left.rgb.max())))
    within("maps", largest(maps_of(left), maps_of(right)), BOTH)
    solid = left.alphas > 0.1
    relative = (left.depths - right.depths)[solid].abs() / left.depths[solid]
    within("depths", relative.max(), 2e-5)


def tiles_of(gl, scene: Scene) -> TiledSplats:
    painter = Painter(gl)
    return TiledSplats(gl, painter.programs, scene)


@pytest.mark.parametrize("count", [1, 700, 5000])
def test_order_and_pairs_are_the_processors(gl, count):
    """Of depths that differ by a bit of float64, equal ones and ones out of view; blocks are 2048 long."""
    scene, seen = cloud(count, 0, dtype=torch.float32), camera(75, 61, 40.0, turned(0.3, (0.0, 0.1, 0.2)))
    scene.gaussians.means[1::7] = scene.gaussians.means[::7][: len(scene.gaussians.means[1::7])]
    scene.gaussians.means[2::9, 2] *= -1
    tiled, quads = tiles_of(gl, scene), SplatBuffers(gl, Painter(gl).programs, scene)
    tiled.project(seen)
    quads.sort(seen)
    seen_there = {*tiled.order.tolist()}  # the processor's are some more
    order = [row for row in quads.order.tolist() if row in seen_there]
    assert tiled.order.tolist() == order and len(order) == tiled.num_chosen > 0.3 * count
    assert {*range(count)} - {*order} or count == 1, "some are out of view"
    pairs = np.frombuffer(tiled._lists._pairs[0].at_least(1).read(8 * tiled._lists.num_pairs), np.uint32)
    tiles, rows = pairs.reshape(-1, 2).T.astype(np.int64)
    places = np.empty(count, np.int64)
    places[order[::-1]] = np.arange(len(order))
    assert (np.diff(tiles * count + places[rows]) > 0).all(), "by tile, then by depth, each once"
    for owned in (tiled, quads):
        owned.release()


def test_one_splat_over_all_tiles_and_small_ones_before_and_behind(show):
    gaussians = splats(
        [(0.0, 0.0, 2.0), (0.3, 0.2, 1.0), (-0.4, 0.1, 3.0)], [50.0, 0.02, 0.1], 0.6, dtype=torch.float32
    )
    seen = camera(131, 77, 60.0)
    renderer = show(scene_of(gaussians), "float32", splats=TiledSplats)
    renderer.draw(seen)
    agree(renderer.frame(True), render(scene_of(gaussians), seen), "float32")


@pytest.mark.parametrize("full", [{"MOST_PAIRS": 100}, {"_MOST_GROUPS": 1}])
def test_what_there_is_no_room_for_is_drawn_as_quads(pair, monkeypatch, full):
    scene, seen = cloud(300, dtype=torch.float32), camera()
    quads, tiles = pair(scene, asked=question(scene))
    for each in (quads, tiles):
        each.draw(seen)
    equal(quads, tiles)
    for name, value in full.items():
        monkeypatch.setattr(lists, name, value)
    for each in (quads, tiles):
        each.forget()
        each.draw(seen)
    frames = [each.frame(True) for each in (quads, tiles)]
    assert torch.equal(frames[0].rgb, frames[1].rgb), "to the bit: they are the same quads"
    assert torch.equal(maps_of(frames[0]), maps_of(frames[1]))
    assert quads.depth_range == tiles.depth_range
    monkeypatch.undo()
    tiles.draw(camera(pose=turned(0.1, (0.0, 0.0, 0.0))))
    tiles.draw(seen)
    assert not torch.equal(tiles.frame(True).rgb, frames[0].rgb), "tiles again, where there is room"


def test_lists_take_what_is_told(gl):
    """In app/cli/drawn.py."""
    tiled = tiles_of(gl, cloud(3000, dtype=torch.float32))
    tiled.project(camera())
    found = tiled._lists
    assert sum(each.at_least(1).size for each in found._pairs) == 16 * found.num_pairs > 0
    listed = (found._made["splats"], *found._elements)
    assert sum(each.at_least(1).size for each in listed) == 80 * tiled.num_gaussians
    tiled.release()


@pytest.mark.parametrize("num_atoms", [0, 2000])
def test_buffers_are_no_larger_than_the_driver_lets_shaders_see(gl, num_atoms):
    """What a pass of weights takes, or the bits of many atoms; beyond that a shader reads zeros."""
    scene = cloud(300, num_atoms, dtype=torch.float32)
    a_gaussian = max(96, 8 * -(-num_atoms // 64))
    for limit, fits in ((300 * a_gaussian, True), (300 * a_gaussian - 1, False)):
        tiled = tiles_of(gl, scene)
        tiled._lists._most_bytes = limit
        assert tiled._lists.find(camera(), tiled._projection(camera()), exact=True) == fits
        tiled.release()


def test_pairs_are_counted_beyond_32_bits(gl):
    """2^16 + 1 splats over 2^16 tiles: the low word alone says 65,536, for which there is room."""
    count = (1 << 16) + 1
    gaussians = splats([(0.0, 0.0, 2.0)], 100.0, dtype=torch.float32).map(
        lambda v: v.repeat_interleave(count, 0)
    )
    tiled = tiles_of(gl, scene_of(gaussians))
    seen = camera(4096, 4096, 2000.0)
    assert not tiled._lists.find(seen, tiled._projection(seen), exact=True)
    assert tiled._lists.num_pairs == 0
    tiled.release()


def test_a_late_order_tells_depths_apart_to_a_millionth(pair, monkeypatch):
    monkeypatch.setattr("app.gl.tiled.splats.FEW", 0)
    scene, seen = cloud(2000, dtype=torch.float32), camera(96, 80, 80.0)
    quads, tiles = pair(scene)
    quads.draw(seen)
    tiles.draw(seen, late=True)
    assert not tiles.exact
    equal(quads, tiles)  # none of these are so near to each other
    tiles.draw(seen)
    assert tiles.exact
    apart = splats([(0.0, 0.0, 2.0 + 1e-6), (0.0, 0.0, 2.0)], 0.1, 0.9, [(1.0, 0, 0), (0, 1.0, 0)])
    scene = scene_of(apart.map(torch.Tensor.float))
    tiles.set_scene(scene)
    tiles.draw(camera())
    agree(tiles.frame(True), render(scene, camera()), "float32")


def test_marks_and_changes_reach_the_tiles(pair):
    scene = cloud(1500, 30, dtype=torch.float32)
    scene.gaussians.means[7] = float("nan")  # a dropped row: marks must not slip by one
    rng = np.random.default_rng(0)
    shown, tints = rng.random(1500) < 0.5, rng.integers(0, 3, 1500).astype(np.uint8)
    some = Mask.of(rng.random(1500) < 0.5)
    quads, tiles = pair(scene)
    for each in (quads, tiles):
        each.draw(camera())
        each.mark(shown, tints)
        each.draw(camera())
    equal(quads, tiles)
    for each in (quads, tiles):
        each.change((Recoloured.tint(some, (0.9, 0.2, 0.1), 0.7, 0.5),))
        each.draw(camera())
    equal(quads, tiles)


@pytest.mark.parametrize("how", [{}, {"moving": True}, {"fast": True}])
def test_layers_are_blended_of_tiles(gl, pair, how):
    """At rest four; moving on a processor two, the farther one in half the size."""
    scene, seen = layered(3), between(3)
    compiled = question(scene, 5)
    quads, tiles = pair(scene, asked=compiled)
    for each in (quads, tiles):
        each.draw(seen, **how)
    # What a layer counts comes of depths: an error of 1e-6 of one is a few times that of its share, more at
    # rims.
    assert (quads.relevance() - tiles.relevance()).abs().mean() <= 1e-5
    left, right = (each.frame(weight_maps=True) for each in (quads, tiles))
    assert (left.rgb - right.rgb).abs().mean() <= 1e-5 and (left.rgb - right.rgb).abs().max() <= 1e-2
    assert (maps_of(left) - maps_of(right)).abs().mean() <= 1e-5


def test_films_are_the_picture_on_show(show):
    scene, seen = cloud(800, 0, dtype=torch.float32), camera(50, 33, 40.0)
    quads, tiles = (show(scene, splats=make) for make in (SplatBuffers, TiledSplats))
    difference = quads.colours(seen).astype(int) - tiles.colours(seen)
    assert np.abs(difference).max() <= 1 + 255 * 8 * STEP["float16"] and quads.colours(seen).max() > 100


def test_another_way_to_draw_keeps_marks_and_the_picture_on_show(show):
    scene, seen = cloud(400, 8, dtype=torch.float32), camera()
    renderer = show(scene, "float32", splats=SplatBuffers)
    shown = np.arange(400) % 2 == 0
    renderer.mark(shown, np.zeros(400, np.uint8))
    renderer.draw(seen)
    before = renderer.frame()
    renderer.draw_with(TiledSplats)
    assert torch.equal(renderer.frame().rgb, before.rgb)
    renderer.draw(seen)
    after = renderer.frame()
    assert not torch.equal(after.rgb, before.rgb), "drawn anew"
    within("colours", largest(after.rgb, before.rgb), BOTH)


def test_a_moving_camera_brings_no_gaussian_to_the_card(show, monkeypatch):
    """Neither what they carry for a phrase, nor the atoms of each."""
    scene = cloud(4000, 8, dtype=torch.float32)
    renderer = show(scene, "float32", splats=TiledSplats, asked=question(scene))
    brought = []
    write = moderngl.Buffer.write
    monkeypatch.setattr(
        moderngl.Buffer,
        "write",
        lambda self, data, **how: (brought.append(len(data)), write(self, data, **how)),
    )
    for turn, most in ((0.0, 4000 * 12), (0.1, 0), (0.2, 0)):
        for fast in (True, False):
            renderer.draw(camera(pose=turned(turn, (0.0, 0.0, 0.0))), fast=fast)
        assert max(brought, default=0) <= most and (brought or not most)
        brought.clear()


def test_nothing_is_written_to_while_fragments_read_it(show, monkeypatch):
    """What writes buffers in shaders waits for nothing of itself: a barrier stands before it."""
    done = []

    def told(kind: type, name: str, what: str) -> None:
        own = getattr(kind, name)
        monkeypatch.setattr(kind, name, lambda *a, **k: (own(*a, **k), done.append(what))[0])

    told(moderngl.Context, "memory_barrier", "barrier")
    told(moderngl.ComputeShader, "run", "write")
    told(moderngl.VertexArray, "transform", "write")
    told(TileLists, "bind", "read")
    scene = cloud(300, 40, dtype=torch.float32)
    renderer = show(scene, splats=TiledSplats)
    for turn in (0.0, 0.1):
        renderer.draw(camera(pose=turned(turn, (0.0, 0.0, 0.0))))
    assert done.count("read") >= 6, "of two pictures the colours, and two passes of weights"
    reads = [place for place, what in enumerate(done) if what == "read"]
    assert all(done[place + 1 : place + 2] == ["barrier"] for place in reads)


def test_a_scene_without_gaussians_is_empty(show):
    scene = cloud(0, 3, dtype=torch.float32)
    renderer = show(replace(scene), splats=TiledSplats)
    renderer.draw(camera())
    assert renderer.frame(weight_maps=True).alphas.max() == 0
