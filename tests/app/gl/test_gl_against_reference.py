"""OpenGL against the float64 reference on ordinary scenes: pictures, weight maps, relevance."""

import dataclasses
import math

import pytest
import torch

from app.gl.layout import ATOMS_A_LAYER, ATOMS_A_PASS
from langflash_core.language.relevance import relevance_maps
from langflash_core.splat import render
from tests.app.gl.questions import draw, full_relevance, psnr, question
from tests.splat.scenes import camera, cloud, maps_of, parallel, turned

# float16 keeps 11 bits, 5e-4 of a value, and back-to-front blending rounds once a layer while
# later layers shrink earlier errors: about 60 dB. float32 is limited by the few pixels where
# rounding moves an alpha across 1/255: about 100 dB.
PSNR = {"float16": 50.0, "float32": 80.0}
# Mean. A software rasteriser may truncate where a graphics card rounds: up to 2^-10 of the value.
WEIGHT_ERROR = {"float16": 2e-3, "float32": 2e-5}
RELEVANCE_ERROR = {"float16": 2e-3, "float32": 1e-4}  # mean; ten times the slope of the sigmoid / 4


pytestmark = pytest.mark.usefixtures("queries")


def assert_agrees(frame, expected, precision):
    assert psnr(frame.rgb, expected.rgb) >= PSNR[precision]
    assert psnr(frame.alphas, expected.alphas) >= PSNR[precision]
    assert all(torch.isfinite(m).all() for m in (frame.rgb, frame.alphas, frame.depths, maps_of(frame)))
    solid = expected.alphas > 0.5
    if solid.any():
        relative = (frame.depths - expected.depths).abs()[solid] / expected.depths[solid]
        assert relative.mean() <= 1e-5  # both sums are float32 at either precision


@pytest.mark.parametrize("degree", [0, 1, 2, 3, 4])
def test_colour_depth_and_transmittance(gl, precision, degree):
    scene = cloud(2000, degree=degree, dtype=torch.float32)
    seen = camera(96, 80, 80.0, turned(0.15, (0.1, 0.0, 0.1)))
    frame = draw(gl, precision, scene, seen, background=(0.2, 0.4, 0.9))
    expected = render(scene, seen, background=(0.2, 0.4, 0.9))
    assert expected.alphas.mean() > 0.5, "the scene must cover something"
    assert_agrees(frame, expected, precision)


def test_colours_in_the_light_of_a_place(show, precision):
    """Another light is another picture, though nothing else of the camera changes."""
    scene = cloud(1000, degree=1, dtype=torch.float32)
    plain = camera(96, 80, 80.0, turned(0.15, (0.1, 0.0, 0.1)))
    renderer = show(scene, precision)
    for light in (None, torch.tensor([[1.4, 1.2, 0.8], [0.2, -0.1, -0.3]]), None):
        seen = dataclasses.replace(plain, light=light)
        renderer.draw(seen)
        assert_agrees(renderer.frame(weight_maps=True), render(scene, seen), precision)


@pytest.mark.parametrize("degree", [0, 3])
def test_parallel_rays(gl, precision, degree):
    scene = cloud(2000, num_atoms=5, degree=degree, dtype=torch.float32)
    seen = parallel(camera(96, 80, 80.0, turned(0.15, (0.1, 0.0, 0.1))))
    frame, expected = draw(gl, precision, scene, seen), render(scene, seen)
    assert expected.alphas.mean() > 0.5, "the scene must cover something"
    assert_agrees(frame, expected, precision)
    assert (maps_of(frame) - maps_of(expected)).abs().mean() <= WEIGHT_ERROR[precision]


def test_parallel_rays_are_another_picture_of_the_same_place(show):
    scene, pinhole = cloud(500, dtype=torch.float32), camera(64, 48, 50.0)
    flat = dataclasses.replace(pinhole, orthographic=True)
    renderer = show(scene, "float32")
    renderer.draw(pinhole)
    first = renderer.frame().rgb
    renderer.draw(flat)
    second = renderer.frame().rgb
    assert psnr(second, render(scene, flat).rgb) >= PSNR["float32"]
    assert psnr(second, first) < 20


@pytest.mark.parametrize("num_atoms", [0, 1, 23, 24, 25, 130])
@pytest.mark.parametrize("kept", [1, 8])
def test_weight_maps_and_relevance(show, precision, num_atoms, kept):
    scene = cloud(1500, num_atoms, kept, dtype=torch.float32)
    seen = camera(64, 48, 50.0)
    expected = render(scene, seen)
    renderer = show(scene, precision)
    renderer.draw(seen)
    assert renderer.passes["weights"] == math.ceil(num_atoms / ATOMS_A_PASS)
    maps = maps_of(renderer.frame(weight_maps=True))
    assert maps is not None and maps.shape == (48, 64, num_atoms)
    if num_atoms:
        assert (maps - maps_of(expected)).abs().mean() <= WEIGHT_ERROR[precision]
        assert (maps.sum(-1) - expected.alphas).abs().mean() <= 10 * WEIGHT_ERROR[precision]  # adds K errors
    for mode in ("relevancy", "cosine"):
        compiled = question(scene, 5, mode)
        renderer.ask(compiled)
        relevance = renderer.relevance()
        truth = full_relevance(scene, compiled, maps_of(expected))
        assert relevance.shape == (5, 48, 64)
        assert (relevance - truth).abs().mean() <= RELEVANCE_ERROR[precision]
        twin = relevance_maps(maps.double(), compiled)
        # The same maps in sixteen bits: half a step of 8e-6 on each of K shares turns a mixed vector by up to
        # 8e-6 sqrt(K) / |w R|, here some 3e-5, times temperature / 4; on average a tenth of that.
        assert (relevance - twin).abs().max() <= 2e-4
        assert (relevance - twin).abs().mean() <= 2e-5


def test_the_atoms_a_pass_are_one_number(show, monkeypatch):
    """Another number of layers draws the same maps in more passes: nothing else counts them."""
    scene, seen = cloud(600, 50, 8, dtype=torch.float32), camera()
    drawn = []
    for layers, passes in ((8, 3), (3, 6)):
        for module in ("app.gl.weights", "app.gl.processor.cell_maps"):
            monkeypatch.setattr(f"{module}.LAYERS_A_PASS", layers)
            monkeypatch.setattr(f"{module}.ATOMS_A_PASS", ATOMS_A_LAYER * layers)
        renderer = show(scene)
        renderer.draw(seen)
        assert renderer.passes["weights"] == passes
        renderer.ask(question(scene, 5))
        drawn.append((maps_of(renderer.frame(weight_maps=True)), renderer.relevance()))
    assert torch.equal(drawn[0][0], drawn[1][0]) and torch.equal(drawn[0][1], drawn[1][1])


@pytest.mark.parametrize("num_prompts", [1, 4, 16, 17])
@pytest.mark.parametrize("num_negatives", [1, 4, 7])
def test_any_number_of_phrases(show, num_prompts, num_negatives):
    scene = cloud(500, 24, dtype=torch.float32)
    seen = camera()
    renderer = show(scene, "float32")
    renderer.draw(seen)
    compiled = question(scene, num_prompts, num_negatives=num_negatives)
    renderer.ask(compiled)
    truth = full_relevance(scene, compiled, maps_of(render(scene, seen)))
    assert (renderer.relevance() - truth).abs().mean() <= RELEVANCE_ERROR["float32"]


def test_only_atoms_in_view_are_drawn(show):
    scene = cloud(300, 130, dtype=torch.float32)
    ids = scene.semantics.weight_ids % 5 + 100  # five of 130
    scene = dataclasses.replace(scene, semantics=dataclasses.replace(scene.semantics, weight_ids=ids))
    renderer = show(scene)
    renderer.draw(camera())
    assert renderer.passes["weights"] == 1
    maps = maps_of(renderer.frame(weight_maps=True))
    assert maps[..., :100].abs().max() == 0 and maps[..., 100:105].amax((0, 1)).min() > 0


def test_splitting_and_permuting_atoms_changes_no_relevance(renderer):
    scene = cloud(800, 6, dtype=torch.float32)
    semantics = scene.semantics
    order = torch.tensor([3, 0, 5, 1, 4, 2])
    halves = semantics.weight_values / 2
    variants = [
        semantics,
        dataclasses.replace(
            semantics,
            weight_ids=order.argsort()[semantics.weight_ids],
            dictionary=semantics.dictionary[order],
        ),
        dataclasses.replace(
            semantics,
            weight_ids=torch.cat((semantics.weight_ids, semantics.weight_ids + 6), 1),
            weight_values=torch.cat((halves, halves), 1),
            dictionary=semantics.dictionary.repeat(2, 1),
        ),
    ]
    g = torch.Generator().manual_seed(4)
    phrases = torch.nn.functional.normalize(torch.randn(7, 16, generator=g, dtype=torch.float64), dim=-1)
    relevances = []
    for variant in variants:
        changed = dataclasses.replace(scene, semantics=variant)
        compiled = question(changed, 3)
        basis = torch.linalg.pinv(compiled.factor) @ variant.dictionary.double()  # Q, up to a null space
        compiled = dataclasses.replace(
            compiled, prompts=phrases[:3] @ basis.T, negatives=phrases[3:] @ basis.T
        )
        renderer.set_scene(changed)
        renderer.draw(camera())
        renderer.ask(compiled)
        relevances.append(renderer.relevance())
    # Halved weights round alike in floating point; permuted ones add up in another order.
    assert (relevances[1] - relevances[0]).abs().max() <= 2e-5
    assert (relevances[2] - relevances[0]).abs().max() <= 2e-5
