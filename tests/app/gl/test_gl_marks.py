"""Gaussians left out and tinted without uploading the scene again; one pixel read by itself."""

import numpy as np
import pytest
import torch

from app.gl.splats import TINTS
from langflash_core.splat import render
from tests.app.gl.questions import psnr, question
from tests.splat.scenes import camera, cloud, maps_of, scene_of

COUNT = 1500


@pytest.fixture
def scene():
    made = cloud(COUNT, num_atoms=30, dtype=torch.float32)
    made.gaussians.means[7] = float("nan")  # a dropped row: marks must not slip by one
    return made


def no_tints() -> np.ndarray:
    return np.zeros(COUNT, np.uint8)


def test_what_is_not_shown_is_as_if_it_were_not_there(renderer, scene):
    shown = np.random.default_rng(0).random(COUNT) < 0.5
    renderer.set_scene(scene)
    seen = camera(96, 80, 80.0)
    renderer.draw(seen)
    renderer.mark(shown, no_tints())
    renderer.draw(seen)
    frame = renderer.frame(weight_maps=True)
    rows = torch.from_numpy(shown)
    left = scene_of(
        scene.gaussians.map(lambda v: v[rows]), scene.semantics.weight_ids[rows],
        scene.semantics.weight_values[rows], scene.semantics.dictionary,
    )  # fmt: skip
    expected = render(left, seen)
    # float16 targets: see test_gl_against_reference.
    assert psnr(frame.rgb, expected.rgb) >= 50 and psnr(frame.alphas, expected.alphas) >= 50
    assert (maps_of(frame) - maps_of(expected)).abs().mean() < 2e-3
    renderer.mark(np.ones(COUNT, bool), no_tints())
    renderer.draw(seen)
    assert psnr(renderer.frame().rgb, render(scene, seen, weight_maps=False).rgb) >= 50


def test_a_tint_changes_colours_and_draws_no_weight_maps(renderer, scene):
    renderer.set_scene(scene)
    seen = camera(96, 80, 80.0)
    renderer.draw(seen)
    renderer.ask(question(scene, 2))
    plain, before = renderer.frame(weight_maps=True), renderer.relevance()
    passes = dict(renderer.passes)
    renderer.mark(np.ones(COUNT, bool), np.ones(COUNT, np.uint8))
    renderer.draw(seen)
    blue = renderer.frame(weight_maps=True)
    assert renderer.passes["weights"] == passes["weights"]
    assert renderer.passes["colour"] == passes["colour"] + 1
    assert torch.equal(blue.alphas, plain.alphas) and torch.equal(maps_of(blue), maps_of(plain))
    assert torch.equal(renderer.relevance(), before)
    assert float((blue.rgb[..., 2] - blue.rgb[..., 0]).mean()) > 0.15 * TINTS[0][2]
    renderer.mark(np.ones(COUNT, bool), np.full(COUNT, 2, np.uint8))
    renderer.draw(seen)
    assert float((renderer.frame().rgb[..., 0] - renderer.frame().rgb[..., 2]).mean()) > 0.15
    renderer.mark(np.ones(COUNT, bool), no_tints())
    renderer.draw(seen)
    assert torch.equal(renderer.frame().rgb, plain.rgb)


def test_a_pixel_is_what_the_frame_holds_there(renderer, scene):
    renderer.set_scene(scene)
    seen = camera(61, 47, 60.0)
    renderer.draw(seen, weight_maps=False)
    assert renderer.pixel(3, 5)[2] is None
    renderer.draw(seen)
    frame = renderer.frame(weight_maps=True)
    for x, y in ((0, 0), (60, 0), (30, 20), (13, 46)):
        alpha, depth, weights = renderer.pixel(x, y)
        assert alpha == float(frame.alphas[y, x])
        assert depth == pytest.approx(float(frame.depths[y, x]), rel=1e-6)  # a float32 division there
        assert np.array_equal(weights, maps_of(frame)[y, x].numpy())
    assert maps_of(frame)[20, 30].any()


def test_marks_of_another_size_are_refused(renderer, scene):
    renderer.set_scene(scene)
    with pytest.raises(ValueError, match="mark: expected 1500 rows"):
        renderer.mark(np.ones(3, bool), np.zeros(3, np.uint8))


def test_nothing_shown_is_an_empty_picture(renderer, scene):
    renderer.set_scene(scene)
    renderer.mark(np.zeros(COUNT, bool), no_tints())
    renderer.draw(camera())
    assert not renderer.frame(weight_maps=True).alphas.any()
    assert renderer.pixel(4, 4)[2].sum() == 0
