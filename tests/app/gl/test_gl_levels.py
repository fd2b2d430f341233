"""Levels of detail: a share of the Gaussians, drawn as the thinned scene is."""

import pytest
import torch

from app.gl import paints
from langflash_core.scene.thin import thin, thin_with_rows
from langflash_core.splat import render
from tests.app.gl.questions import full_relevance, question
from tests.splat.scenes import camera, cloud, maps_of


@pytest.fixture
def scene():
    return cloud(800, 5, dtype=torch.float32)


def test_a_level_is_the_thinned_scene(renderer, scene):
    compiled = question(scene)
    renderer.set_scene(scene)
    renderer.ask(compiled)
    renderer.draw(camera(), share=0.25)
    coarse = render(thin(scene, 0.25), camera())
    assert (renderer.frame().rgb - coarse.rgb).abs().max() <= 0.01  # float16, some tens of layers
    error = (renderer.relevance() - full_relevance(scene, compiled, maps_of(coarse))).abs()
    assert error.mean() <= 1e-3  # one step of float16, as in the hard cases


def test_back_to_all_gaussians(renderer, scene):
    renderer.set_scene(scene)
    renderer.ask(question(scene))
    renderer.draw(camera())
    before, relevance = renderer.frame(), renderer.relevance()
    renderer.draw(camera(), fast=True, share=0.25)
    assert not torch.equal(renderer.frame().rgb, before.rgb)
    assert not torch.equal(renderer.relevance(), relevance)
    renderer.draw(camera())
    assert torch.equal(renderer.frame().rgb, before.rgb) and torch.equal(renderer.relevance(), relevance)


def test_pictures_follow_the_level_and_the_scene(renderer, scene):
    """The same camera and size: another level, another scene are other pictures."""
    renderer.set_scene(scene)
    shown = []
    for share in (1.0, 0.25, 1.0):
        renderer.draw(camera(), share=share)
        shown.append((renderer.rgb_texture.read(), paints.depth(renderer).read()))
    assert shown[0] == shown[2]
    assert shown[0][0] != shown[1][0] and shown[0][1] != shown[1][1]
    renderer.set_scene(cloud(50, 5, dtype=torch.float32))
    renderer.draw(camera())
    assert renderer.rgb_texture.read() not in [rgb for rgb, _ in shown]


def test_a_level_is_made_once(renderer, scene, monkeypatch):
    made = []
    monkeypatch.setattr(
        "app.gl.scene.thin_with_rows", lambda *given: made.append(given) or thin_with_rows(*given)
    )
    renderer.set_scene(scene)
    for share in (0.25, 1.0, 0.25, 1.0, 0.25):
        renderer.draw(camera(), share=share)
    assert len(made) == 1
    renderer.set_scene(cloud(50, 2))
    renderer.draw(camera(), share=0.25)
    assert len(made) == 2
