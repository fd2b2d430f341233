"""Pictures drawn beside the window are those that the renderer draws."""

import gc
from dataclasses import replace

import moderngl
import numpy as np
import pytest
import torch

from app.gl import SplatRenderer, paints
from app.gl.canvas import Canvas
from app.gl.processor import still
from app.gl.processor.still import StillMaps, draw_still
from app.gl.warming import SIDE, warm_layers, warm_up
from langflash_core.base.records import Record
from langflash_core.language.relevance import relevance_maps
from langflash_core.splat import render
from tests.app.gl.questions import full_relevance, psnr, question
from tests.splat.scenes import camera, cloud, maps_of, turned

COUNT = 1500
SEEN = camera(96, 80, 80.0, turned(0.15, (0.1, 0.0, 0.1)))
STEP = 2  # of 255: float16 against float16, drawn in another order, and the rounding of RGBA8


@pytest.fixture
def scene():
    made = cloud(COUNT, num_atoms=30, dtype=torch.float32)
    made.gaussians.means[7] = float("nan")
    return made


def pixels(texture) -> np.ndarray:
    return np.frombuffer(texture.read(), np.uint8).reshape(80, 96, 4).astype(int)


def test_a_still_picture_agrees_with_the_reference(scene) -> None:
    still = draw_still(scene, SEEN, threads=2)
    expected = render(scene, SEEN)
    # Colours and weights are kept as float16: see test_gl_against_reference.
    assert psnr(still.frame.rgb, expected.rgb) >= 60
    assert still.maps is not None
    assert (still.maps.weights.double() - maps_of(expected)).abs().mean() < 2e-4
    solid = expected.alphas > 0.5
    assert ((still.frame.depths - expected.depths).abs()[solid] / expected.depths[solid]).mean() <= 1e-4
    asked = question(scene, 3)
    answered = torch.from_numpy(still.maps.relevance(asked)).double()
    assert (answered - full_relevance(scene, asked, maps_of(expected).double())).abs().mean() < 2e-3


@pytest.mark.parametrize("what", ["rgb", "heat", "label", "atom", "feature", "depth", "weight"])
def test_a_renderer_shows_it_as_its_own(show, scene, what: str) -> None:
    renderer = show(scene, asked=question(scene, 2))

    def shown() -> np.ndarray:
        paint = {
            "rgb": lambda: renderer.rgb_texture,
            "heat": renderer.heat_texture,
            "label": renderer.label_texture,
            "atom": renderer.picture().atoms,
            "feature": renderer.picture().features,
            "depth": lambda: paints.depth(renderer),
            "weight": lambda: renderer.picture().weight(3, "turbo"),
        }[what]
        return pixels(paint())

    renderer.draw(SEEN)
    own = shown()
    passes = renderer.passes["weights"], renderer.passes["colour"]
    renderer.bring(draw_still(scene, SEEN))
    brought = shown()
    assert (renderer.passes["weights"], renderer.passes["colour"]) == passes  # no splat is drawn for it
    different = abs(own - brought).max(-1)
    # A threshold, or the depth's range, that a pixel lies just beside: few pixels differ by more.
    # What lies just beside the image counts for OpenGL's range of depths, and moves its colours a little.
    assert np.mean(different > (8 if what == "depth" else STEP)) < 0.02


def test_a_large_scene_is_projected_in_parts_to_the_same_picture(scene, monkeypatch) -> None:
    """Also where two of different parts lie equally deep: they keep their order."""
    means = scene.gaussians.means.clone()
    means[-40:] = means[:40]
    scene = replace(scene, gaussians=replace(scene.gaussians, means=means))
    whole = draw_still(scene, camera(64, 48))
    monkeypatch.setattr(still, "_AT_ONCE", len(means) // 3 + 1)
    parts = draw_still(scene, camera(64, 48))
    assert (whole.colour == parts.colour).all() and (whole.depth == parts.depth).all()
    assert whole.maps is not None and parts.maps is not None
    assert torch.equal(whole.maps.weights, parts.maps.weights) and whole.depth_range == parts.depth_range


def test_what_lies_beside_the_picture_is_not_looked_at(scene, monkeypatch) -> None:
    """Of ten million Gaussians a room's picture took as long as a picture of all."""
    gaussians, looked = scene.gaussians, []
    means = torch.cat((gaussians.means, gaussians.means + torch.tensor([50.0, 0.0, 0.0])))
    twice = scene.rows(torch.arange(len(means)) % len(gaussians))
    twice = replace(twice, gaussians=replace(twice.gaussians, means=means))
    real = still.drawable_rows

    def drawable_rows(some):
        looked.append(len(some.gaussians))
        return real(some)

    monkeypatch.setattr(still, "drawable_rows", drawable_rows)
    wanted, found = draw_still(scene, camera()), draw_still(twice, camera())
    assert np.array_equal(found.colour, wanted.colour) and np.array_equal(found.depth, wanted.depth)
    assert len(looked) == 2 and looked[0] == looked[1] <= len(gaussians)


def test_it_is_drawn_as_marked(show, scene) -> None:
    random = np.random.default_rng(0)
    marks = random.random(COUNT) < 0.7, random.integers(0, 3, COUNT).astype(np.uint8)
    renderer = show(scene)
    renderer.mark(*marks)
    renderer.draw(SEEN)
    own = renderer.frame()
    still = draw_still(scene, SEEN, marks=marks, weight_maps=False)
    assert still.maps is None and psnr(still.frame.rgb, own.rgb) >= 50


def test_pixels_of_it_can_be_read(show, scene) -> None:
    renderer = show(scene)
    still = draw_still(scene, SEEN)
    renderer.bring(still)
    alpha, depth, weights = renderer.pixel(40, 30)
    assert alpha == pytest.approx(float(still.frame.alphas[30, 40]), abs=1e-6)
    assert depth == pytest.approx(float(still.frame.depths[30, 40]), abs=1e-5)
    assert weights is not None and weights.sum() == pytest.approx(alpha, abs=5e-3)


def test_an_answer_is_computed_once(scene) -> None:
    maps = draw_still(scene, SEEN).maps
    assert maps is not None
    asked = question(scene, 1)
    assert not maps.answers(asked)
    first = maps.relevance(asked)
    assert maps.answers(asked) and maps.relevance(asked) is first


@pytest.mark.parametrize("mode", ["relevancy", "cosine"])
def test_answers_are_those_of_its_weights(scene, mode: str) -> None:
    """Two questions one after the other, the second with the norms of the first; empty pixels too."""
    drawn = draw_still(scene, SEEN).maps
    assert drawn is not None
    weights = drawn.weights.clone()
    weights[:10] = 0
    maps = StillMaps(weights)
    for number in (3, 1):
        asked = question(scene, number, mode)
        doubled = {name: getattr(asked, name).double() for name in ("factor", "prompts", "negatives")}
        expected = relevance_maps(weights, replace(asked, **doubled))
        found = torch.from_numpy(maps.relevance(asked)).double()
        assert found.shape == expected.shape and not found[:, :10].any()
        # Sums of 30 products in float32, of which the temperature makes ten times as much.
        assert (found - expected).abs().max() < 1e-5 and expected[:, 10:].std() > 1e-3


def buffers() -> int:
    """Of OpenGL, that nobody released."""
    made = [each for each in gc.get_objects() if type(each) is moderngl.Buffer]
    return sum(not isinstance(each.mglo, moderngl.InvalidObject) for each in made)


def test_a_scene_that_comes_before_all_shaders_leaves_nothing_of_the_warm_up(gl) -> None:
    canvas = Canvas(gl)
    before = buffers()
    warming = warm_up(canvas)
    for _ in range(3):
        next(warming)
    assert buffers() > before
    del warming
    canvas.release()
    assert buffers() == before and gl.error == "GL_NO_ERROR"


def test_shaders_are_compiled_ahead(gl, show, scene) -> None:
    """What comes first in a window finds its programs made: one at a time, a frame between two of them."""
    renderer = show(None)
    programs = renderer.canvas.painter.programs._made
    counts = [0]
    for _ in warm_up(renderer.canvas):
        counts.append(len(programs))
    before = set(programs)
    counts.append(len(before))
    assert max(np.diff(counts)) == 1
    made = cloud(50, degree=0, dtype=torch.float32)
    made = replace(made, view_ids=torch.zeros(50, dtype=torch.int64))
    renderer.fill(True)  # as the window does
    renderer.set_scene(made)
    renderer.draw(SEEN, weight_maps=False)
    _ = renderer.rgb_texture
    _ = renderer.faded_texture()
    view = renderer.canvas.view((SEEN.width, SEEN.height))
    fading, _ = view.display._pictures[("fading",)]
    assert fading.filter == view.colour.colour.filter  # else Mesa compiles what reads it once more
    renderer.ask(question(made, 1))
    renderer.draw(SEEN, weight_maps=False, fast=True)
    renderer.heat_texture()
    two = replace(made, viewmats=made.viewmats.expand(2, 4, 4), Ks=made.Ks.expand(2, 3, 3))
    two = replace(two, view_ids=torch.arange(50) % 2, record=Record(layered=True))
    renderer.set_scene(two)
    renderer.draw(SEEN, weight_maps=False, moving=True)
    renderer.draw(SEEN, weight_maps=False, fast=True)
    renderer.heat_texture()
    assert renderer.passes["blend"] >= 2
    assert set(programs) == before
    assert SIDE & (SIDE - 1)  # of textures with such sides Mesa compiles shaders of their own
    assert gl.error == "GL_NO_ERROR"


def test_what_blends_layers_is_compiled_ahead_alone(gl) -> None:
    """For a scene that comes before the rest: one program at a time; what is broken off leaves nothing."""
    renderer = SplatRenderer(gl)
    before, programs = buffers(), renderer.canvas.painter.programs._made
    counts = [0]
    for _ in warm_layers(renderer.canvas):
        counts.append(len(programs))
    assert max(np.diff([*counts, len(programs)])) == 1 and "blend.frag" in str(programs.keys())
    begun = warm_layers(renderer.canvas)
    next(begun)
    del begun
    renderer.release()
    assert buffers() == before and gl.error == "GL_NO_ERROR"


def test_weight_maps_of_one_size_are_kept(show, scene) -> None:
    renderer = show(scene)
    first, second = (scene.camera(0, *size) for size in ((64, 48), (48, 36)))
    before = renderer_maps(renderer, first)
    renderer.draw(second)
    assert [view.maps.layers._made is None for view in renderer.canvas._views] == [True, False]
    assert np.array_equal(renderer_maps(renderer, first), before)


def renderer_maps(renderer: SplatRenderer, camera) -> np.ndarray:
    renderer.draw(camera)
    maps = renderer.frame(weight_maps=True).weight_maps
    assert maps is not None
    return maps.numpy()


def test_what_is_on_show_stays_while_another_size_is_drawn(show, scene) -> None:
    """A window shows the picture before until the next one is painted."""
    renderer = show(scene)
    renderer.draw(SEEN, weight_maps=False)
    shown = renderer.rgb_texture
    before = pixels(shown)
    renderer.draw(SEEN.with_size(48, 40), weight_maps=False)
    assert np.array_equal(pixels(shown), before)
