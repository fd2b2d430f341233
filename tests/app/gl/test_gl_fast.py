"""The fast mode: what it splats against a float64 twin, what it costs, how it gives way to exact maps."""

from dataclasses import replace

import pytest
import torch

from app.gl.fast import MAX_PHRASES
from langflash_core.language.relevance import CompiledQuery
from langflash_core.language.settings import RELEVANCE
from langflash_core.splat import render
from langflash_core.types import Camera, Scene, Semantics
from tests.app.gl.questions import full_relevance, question
from tests.splat.scenes import camera, cloud, maps_of, turned

STEP = {"float16": 2**-10, "float32": 2**-22}
"""What one blend costs, as a share of the value: float16 as llvmpipe cuts it."""


def twin(scene: Scene, compiled: CompiledQuery, seen: Camera) -> torch.Tensor:
    """sum W g / sum W |f| in float64: the numbers travel as weights of a scene of their own."""
    weights = scene.semantics.dense_weights().double()
    features = weights @ compiled.factor
    dots = features @ compiled.prompts.T
    if compiled.mode == "relevancy":
        dots = dots - (features @ compiled.negatives.T).amax(1, keepdim=True)
    numbers = torch.cat((features.norm(dim=1, keepdim=True), dots), 1)  # (N, 1 + P)
    ids = torch.arange(numbers.shape[1]).expand(numbers.shape)
    carried = Semantics(ids, numbers, torch.eye(numbers.shape[1], 16, dtype=torch.float64), "test")
    sums = maps_of(render(replace(scene, semantics=carried), seen)).double()
    shares = sums[..., 1:] / sums[..., :1].clamp_min(RELEVANCE.empty_norm)
    values = torch.sigmoid(compiled.temperature * shares) if compiled.mode == "relevancy" else shares
    return torch.where(sums[..., :1] < RELEVANCE.empty_norm, 0.0, values).movedim(-1, 0)


@pytest.mark.parametrize("precision", ["float16", "float32"])
@pytest.mark.parametrize("mode", ["relevancy", "cosine"])
@pytest.mark.parametrize("num_prompts", [1, 2, 3, 5, MAX_PHRASES])
def test_numbers_are_splatted_as_the_twin_says(show, precision, mode, num_prompts):
    scene, seen = cloud(300, 6, size=0.06), camera()
    compiled = question(scene, num_prompts, mode)
    renderer = show(scene, precision, asked=compiled)
    renderer.draw(seen, fast=True)
    error = (renderer.relevance() - twin(scene, compiled, seen)).abs()
    solid = maps_of(render(scene, seen)).sum(-1) > 0.1
    # A handful of layers lose a step each, in the sum above and in the one below; temperature and slope: 2.5.
    assert error[:, solid].max() <= 2.5 * 8 * STEP[precision] + 1e-5
    assert error.mean() <= 2 * STEP[precision] + 1e-6


def test_colour_and_depth_are_those_of_the_exact_mode(renderer):
    scene, seen = cloud(200, 5), camera()
    renderer.set_scene(scene)
    renderer.draw(seen)
    exact = renderer.frame()
    renderer.ask(question(scene, 4))
    renderer.draw(camera(pose=turned(0.1, (0.0, 0.0, 0.0))), fast=True)
    renderer.draw(seen, fast=True)
    fast = renderer.frame()
    assert torch.equal(exact.rgb, fast.rgb) and torch.equal(exact.depths, fast.depths)


def test_gaussians_of_one_meaning_are_answered_exactly(show):
    """Where all Gaussians of a pixel say the same, the fast answer is the exact one."""
    scene = cloud(200, 4, 1, size=0.06)
    ids = torch.full_like(scene.semantics.weight_ids, 2)
    scene = replace(scene, semantics=replace(scene.semantics, weight_ids=ids))
    compiled = question(scene, 2)
    renderer = show(scene, "float32", asked=compiled)
    renderer.draw(camera(), fast=True)
    fast = renderer.relevance()
    expected = full_relevance(scene, compiled, maps_of(render(scene, camera())))
    assert (fast - expected).abs().max() <= 1e-5  # float32 and a sigmoid


def test_a_moving_camera_costs_one_splat_pass_a_picture(renderer):
    scene = cloud(100, 5)
    renderer.set_scene(scene)
    renderer.ask(question(scene, 3))
    for step in range(3):
        renderer.draw(camera(pose=turned(0.1 * step, (0.0, 0.0, 0.0))), fast=True)
        renderer.heat_texture(1)
        renderer.label_texture()
    assert renderer.passes["colour"] == 3 and renderer.passes["weights"] == 0


def test_at_rest_the_exact_maps_follow_and_stay(renderer):
    scene, seen = cloud(200, 5), camera()
    compiled = question(scene, 3)
    renderer.set_scene(scene)
    renderer.ask(compiled)
    renderer.draw(seen, fast=True)
    moving = renderer.heat_texture(0, threshold=0.0).read()
    renderer.draw(seen)
    assert renderer.passes["colour"] == 1  # the colours of the moving picture are kept
    exact, still = renderer.relevance(), renderer.heat_texture(0, threshold=0.0).read()
    renderer.draw(seen, fast=True)  # exact maps of this view are there: they answer
    assert torch.equal(renderer.relevance(), exact)
    assert renderer.heat_texture(0, threshold=0.0).read() == still != moving
    assert renderer.passes["colour"] == 1 and renderer.passes["weights"] == 1


def test_another_phrase_while_moving_is_splatted_anew(renderer):
    scene, seen = cloud(200, 5), camera()
    renderer.set_scene(scene)
    renderer.ask(question(scene, 1, seed=1))
    renderer.draw(seen, fast=True)
    first = renderer.relevance()
    renderer.ask(question(scene, 4, seed=2))
    second = renderer.relevance()
    assert second.shape[0] == 4 and not torch.equal(first[0], second[0])
    renderer.ask(None)
    renderer.draw(seen, fast=True)  # nothing asked: colour alone
    with pytest.raises(ValueError, match="received no query"):
        renderer.relevance()


def test_more_phrases_than_fit_are_answered_exactly(renderer):
    scene, seen = cloud(60, 5), camera()
    compiled = question(scene, MAX_PHRASES + 1)
    renderer.set_scene(scene)
    renderer.ask(compiled)
    renderer.draw(seen, fast=True)
    assert renderer.relevance().shape[0] == MAX_PHRASES + 1
    assert renderer.passes["weights"] == 1


def test_scenes_without_a_dictionary_or_without_anything_in_view(renderer):
    for scene in (cloud(50, 0), cloud(50, 5)):
        away = camera(pose=turned(3.14159, (0.0, 0.0, 0.0)))
        renderer.set_scene(scene)
        renderer.ask(question(scene, 2))
        renderer.draw(away, fast=True)
        assert renderer.relevance().abs().max() == 0
