"""Sprites, which software OpenGL draws in place of quads, against quads: the same to the bit."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from app.gl import SplatRenderer
from app.gl.hardware import CARD, Hardware
from app.gl.processor.sprites import Sprites
from langflash_core.base.graphics import draws_in_software
from tests.splat.scenes import camera, cloud


def drawn(gl, scene, view, hardware: Hardware | None = None):
    """Colour, depth and weight maps; the picture of films; whether sprites were drawn."""
    renderer = SplatRenderer(gl, "float32", hardware=hardware)
    renderer.set_scene(scene)
    renderer.draw(view)
    frame = renderer.frame(weight_maps=True)
    film = renderer.colours(view).copy()
    assert renderer._scene is not None and frame.weight_maps is not None
    shapes = renderer._scene.whole.parts[0].splats.shapes
    renderer.release()
    maps = frame.weight_maps
    return (frame.rgb, frame.alphas, frame.depths, maps), film, isinstance(shapes, Sprites) and shapes.small


@pytest.fixture
def software(gl):
    if not draws_in_software(gl):
        pytest.skip("a graphics card draws quads")


@pytest.mark.parametrize("widening", [0.3, 1.0, 3.0])
def test_sprites_draw_what_quads_draw(gl, software, widening):
    scene = cloud(400, 7)
    scene = replace(scene, gaussians=replace(scene.gaussians, scales=scene.gaussians.scales * widening))
    sprites, quads = drawn(gl, scene, camera()), drawn(gl, scene, camera(), CARD)
    assert sprites[2] and not quads[2]
    assert all(torch.equal(mine, true) for mine, true in zip(sprites[0], quads[0], strict=True))
    assert np.array_equal(sprites[1], quads[1])


def test_splats_too_large_for_sprites_are_drawn_as_quads(gl, software):
    scene = cloud(50, 4)
    scales = scene.gaussians.scales.clone()
    scales[0] = 1e3  # wider than any sprite may be
    scene = replace(scene, gaussians=replace(scene.gaussians, scales=scales))
    mine, true = drawn(gl, scene, camera()), drawn(gl, scene, camera(), CARD)
    assert not mine[2]
    assert all(torch.equal(a, b) for a, b in zip(mine[0], true[0], strict=True))


def test_pictures_as_large_as_a_viewport_are_drawn_as_quads(gl, software):
    scene, view = cloud(20, 1), camera(max(gl.info["GL_MAX_VIEWPORT_DIMS"]), 4, 20.0)
    mine, true = drawn(gl, scene, view), drawn(gl, scene, view, CARD)
    assert float(true[0][1].max()) > 0.5
    assert all(torch.equal(a, b) for a, b in zip(mine[0], true[0], strict=True))


@pytest.mark.parametrize("orthographic", [False, True])
def test_a_footprint_beyond_float32_is_no_sprite(gl, software, orthographic):
    scene = cloud(50, 4)
    means, scales = scene.gaussians.means.clone(), torch.full_like(scene.gaussians.scales, 1e-2)
    means[0], scales[0] = torch.tensor([0.0, 0.0, 2.0]), 1e12  # on the axis; its variance ends as inf / inf
    scene = replace(scene, gaussians=replace(scene.gaussians, means=means, scales=scales))
    view = camera(64, 48, 1e9)
    view = replace(view, orthographic=orthographic)
    mine, true = drawn(gl, scene, view), drawn(gl, scene, view, CARD)
    assert all(torch.equal(a, b) for a, b in zip(mine[0], true[0], strict=True))
