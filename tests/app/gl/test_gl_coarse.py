"""The coarse level of a scene that knows its levels: to the bit what those Gaussians are as a scene alone."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
import torch

from app.gl import SplatRenderer, moving_renderer
from app.gl.scene import Thinned
from langflash_core.scene.changed import apply_changes
from langflash_core.scene.changes import Change, Moved, Recoloured, turn_about
from langflash_core.scene.mask import Mask
from langflash_core.scene.thin import coarse_share, thin_with_rows
from langflash_core.types import Camera, Scene
from tests.app.gl.questions import question
from tests.splat.scenes import camera, cloud

COUNT = 1500


@pytest.fixture
def scene() -> Scene:
    """A fifth coarse, in no order; photos are known."""
    made = cloud(COUNT, num_atoms=8, degree=1, dtype=torch.float32)
    made.gaussians.means[7] = float("nan")  # a dropped row: nothing must slip by one
    levels = torch.from_numpy(np.random.default_rng(1).random(COUNT) > 0.2).to(torch.uint8)
    levels[7] = 0
    return replace(made, view_ids=torch.zeros(COUNT, dtype=torch.int64), levels=levels)


def rows_of(scene: Scene) -> torch.Tensor:
    assert scene.levels is not None
    return (scene.levels == 0).nonzero()[:, 0]


def aside() -> Camera:
    """Whence a part fades and there are gaps."""
    viewmat = camera(96, 80, 80.0).viewmat.clone()
    viewmat[0, 3] -= 1.5
    return replace(camera(96, 80, 80.0), viewmat=viewmat)


@pytest.fixture
def pair(gl, scene) -> Iterator[tuple[SplatRenderer, SplatRenderer]]:
    """Renderers of the scene, and of its coarse Gaussians alone."""
    whole, alone = moving_renderer(gl), moving_renderer(gl)
    whole.set_scene(scene, coarse_share(scene))
    alone.set_scene(scene.rows(rows_of(scene)))
    yield whole, alone
    whole.release()
    alone.release()


def test_colours_depth_and_answers_are_theirs(pair, scene):
    for renderer, share in zip(pair, (coarse_share(scene), 1.0), strict=True):
        renderer.ask(question(scene, 2))
        renderer.draw(aside(), share=share)
    (first, second) = (renderer.frame(weight_maps=True) for renderer in pair)
    assert torch.equal(first.rgb, second.rgb) and torch.equal(first.depths, second.depths)
    assert first.weight_maps is not None and second.weight_maps is not None
    assert torch.equal(first.weight_maps, second.weight_maps) and bool(first.alphas.any())
    assert torch.equal(pair[0].relevance(), pair[1].relevance())
    assert {*pair[0]._scene._levels} == {coarse_share(scene)}, "no others were uploaded"
    pair[0].draw(aside())
    assert not torch.equal(pair[0].frame().rgb, second.rgb), "and all of them are another picture"


def test_the_fast_mode_is_theirs_also_when_it_is_prepared(pair, scene):
    for renderer, share in zip(pair, (coarse_share(scene), 1.0), strict=True):
        renderer.ask(question(scene, 3))
        renderer.carry(share)
        renderer.draw(aside(), fast=True, share=share)
    assert torch.equal(pair[0].relevance(), pair[1].relevance())
    assert pair[0].heat_texture(1).read() == pair[1].heat_texture(1).read()


def test_fading_and_filled_gaps_are_theirs(pair, scene):
    shown = []
    for renderer, share in zip(pair, (coarse_share(scene), 1.0), strict=True):
        renderer.draw(aside(), share=share)
        plain, faded = renderer.rgb_texture.read(), renderer.faded_texture().read()
        renderer.fill(True)
        shown.append((plain, faded, renderer.rgb_texture.read(), renderer.faded_texture().read()))
    assert shown[0] == shown[1] and len(set(shown[0])) == 4


@pytest.mark.parametrize("before", [True, False], ids=["drawn first", "marked first"])
def test_marks_reach_them(pair, scene, before):
    share, rows = coarse_share(scene), rows_of(scene).numpy()
    random = np.random.default_rng(3)
    shown, tints = random.random(COUNT) < 0.6, random.integers(0, 3, COUNT).astype(np.uint8)
    if before:
        pair[0].draw(aside(), share=share)
    pair[0].mark(shown, tints)
    pair[1].mark(shown[rows], tints[rows])
    pair[0].draw(aside(), share=share)
    pair[1].draw(aside())
    assert torch.equal(pair[0].frame().rgb, pair[1].frame().rgb)
    pair[0].mark(np.zeros(COUNT, bool), tints)
    pair[0].draw(aside(), share=share)
    assert not pair[0].frame().alphas.any()


def test_a_gesture_and_its_undoing_reach_them(pair, scene):
    rows, share = rows_of(scene), coarse_share(scene)
    random = np.random.default_rng(4)
    moved, tinted = (Mask.of(random.random(COUNT) < 0.5) for _ in range(2))
    turn = turn_about((0.3, 1.0, 0.2), 50.0)
    changes: tuple[Change, ...] = (
        Moved.about(moved, (0.0, 0.0, 2.0), turn, 1.2, (0.1, 0.0, -0.1)),
        Recoloured.tint(tinted, (0.9, 0.2, 0.1), 0.7, 0.5),
    )
    pair[0].draw(aside(), share=share)
    before = pair[0].frame().rgb
    pair[0].change(changes)
    pair[0].draw(aside(), share=share)
    alone = scene.rows(rows)
    pair[1].set_scene(replace(alone, gaussians=apply_changes(alone.gaussians, changes, rows)))
    pair[1].draw(aside())
    # Turned coefficients are made of float64 either way; places are the very same numbers.
    assert torch.equal(pair[0].frame().rgb, pair[1].frame().rgb)
    assert not torch.equal(pair[0].frame().rgb, before)
    pair[0].change(())
    pair[0].draw(aside(), share=share)
    assert torch.equal(pair[0].frame().rgb, before)


@pytest.mark.parametrize("share", [0.1, 0.5])
def test_fewer_of_them_and_some_detail_follow_marks_and_changes(pair, scene, share):
    thinned, rows = thin_with_rows(scene, share)
    shown = np.random.default_rng(3).random(COUNT) < 0.6
    changes = (
        Moved(Mask.of(~shown), offset=(0.1, 0.0, 0.0)),
        Moved(Mask.full(COUNT), offset=(0.0, 0.1, 0.0)),
    )
    pair[0].give_level(scene, share, Thinned(thinned, rows))
    pair[0].mark(shown, np.zeros(COUNT, np.uint8))
    pair[0].change(changes)
    pair[0].draw(aside(), share=share)
    moved = apply_changes(thinned.gaussians, changes, torch.from_numpy(rows))
    pair[1].set_scene(replace(thinned, gaussians=moved))
    pair[1].mark(shown[rows], np.zeros(len(rows), np.uint8))
    pair[1].draw(aside())
    assert torch.equal(pair[0].frame().rgb, pair[1].frame().rgb)
