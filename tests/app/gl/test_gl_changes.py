"""Gaussians moved and recoloured without uploading the scene again, against the scene with them moved."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from app.gl import SplatRenderer
from langflash_core.scene.changed import apply_changes
from langflash_core.scene.changes import Change, Moved, Recoloured, turn_about
from langflash_core.scene.mask import Mask
from langflash_core.scene.thin import thin_with_rows
from langflash_core.splat import render
from langflash_core.types import Scene
from tests.app.gl.questions import psnr
from tests.splat.scenes import camera, cloud, maps_of

COUNT = 1500


@pytest.fixture
def scene() -> Scene:
    made = cloud(COUNT, num_atoms=8, degree=2, dtype=torch.float32)
    made.gaussians.means[7] = float("nan")  # a dropped row: changes must not slip by one
    return made


def some_changes() -> tuple[Change, ...]:
    rows = [Mask.of(np.random.default_rng(seed).random(COUNT) < 0.5) for seed in range(2)]
    turn = turn_about((0.3, 1.0, 0.2), 50.0)
    return (
        Moved.about(rows[0], (0.0, 0.0, 2.0), turn, 1.2, (0.1, 0.0, -0.1)),
        Recoloured.tint(rows[1], (0.9, 0.2, 0.1), 0.7, 0.5),
    )


def moved(scene: Scene) -> Scene:
    return replace(scene, gaussians=apply_changes(scene.gaussians, some_changes()))


def test_a_changed_scene_is_drawn_as_if_it_had_come_so(renderer: SplatRenderer, scene: Scene) -> None:
    seen = camera(96, 80, 80.0)
    renderer.set_scene(scene)
    renderer.draw(seen, weight_maps=True)
    before = renderer.frame(weight_maps=True)
    renderer.change(some_changes())
    renderer.draw(seen, weight_maps=True)
    frame, expected = renderer.frame(weight_maps=True), render(moved(scene), seen)
    # float16 targets: see test_gl_against_reference.
    assert psnr(frame.rgb, expected.rgb) >= 50 and psnr(frame.alphas, expected.alphas) >= 50
    assert (maps_of(frame) - maps_of(expected)).abs().mean() < 2e-3
    assert psnr(frame.rgb, before.rgb) < 30
    renderer.change(())
    renderer.draw(seen, weight_maps=True)
    assert torch.equal(renderer.frame(weight_maps=True).rgb, before.rgb)


def test_changes_reach_thinned_levels_before_and_after_they_are_made(
    renderer: SplatRenderer, scene: Scene
) -> None:
    seen, share = camera(96, 80, 80.0), 0.5
    thinned, rows = thin_with_rows(scene, share)
    wanted = replace(
        thinned, gaussians=apply_changes(thinned.gaussians, some_changes(), torch.from_numpy(rows))
    )
    expected = render(wanted, seen, weight_maps=False).rgb
    for made_first in (True, False):
        renderer.set_scene(replace(scene))  # another object: a new upload
        if made_first:
            renderer.draw(seen, share=share)
        renderer.change(some_changes())
        renderer.draw(seen, share=share)
        assert psnr(renderer.frame().rgb, expected) >= 50


def test_without_a_scene_there_is_nothing_to_change(renderer: SplatRenderer) -> None:
    with pytest.raises(ValueError, match="set_scene before"):
        renderer.change(())
