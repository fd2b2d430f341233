"""Scenes of layers, blended as langflash_core/splat/compose.py has it: at rest, moving, beside the window."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import torch
from torch.nn.functional import interpolate

from app.bench.cases import in_float64
from app.gl import SplatRenderer, paints
from app.gl.hardware import CARD, PROCESSOR, hardware_of
from app.gl.layered import KEPT, MOVING, LayeredLevel, half
from app.gl.processor.cell_maps import CellMaps
from app.gl.processor.still import draw_still
from app.gl.scene import Thinned
from app.gl.weights import WeightMaps
from langflash_core.base.graphics import draws_in_software
from langflash_core.base.records import Record
from langflash_core.errors import Cancelled
from langflash_core.geometry.cameras import invert_rigid
from langflash_core.geometry.harmonics import colour_to_sh
from langflash_core.geometry.nearness import Nearness
from langflash_core.scene.changed import apply_changes
from langflash_core.scene.changes import Moved, Recoloured
from langflash_core.scene.mask import Mask
from langflash_core.scene.thin import thin_with_rows
from langflash_core.splat import compose, reference
from langflash_core.splat.projection import ALPHA_MIN
from langflash_core.types import Camera, Frame, Scene, Semantics
from tests.app.gl.questions import full_relevance, psnr, question
from tests.app.gl.test_gl_fast import STEP, twin
from tests.splat.scenes import camera, cloud, maps_of, turned

# As in test_gl_against_reference.py, which says why: layers are drawn as there, a blend is a mean of them.
# What a layer counts comes of float32 depths: an error of 1e-6 changes a support by 1e-6 / DEPTH at most.
PSNR = {"float16": 50.0, "float32": 80.0}
WEIGHT_ERROR = {"float16": 2e-3, "float32": 2e-5}
RELEVANCE_ERROR = {"float16": 2e-3, "float32": 1e-4}
NUM_VIEWS = [1, 2, 3, 6]


def layered(num_views: int, count: int = 400, num_atoms: int = 30, unowned: int = 40) -> Scene:
    """A layer before each of some photos in a row, and some Gaussians that no photo made; a gap in the second
    layer. Surfaces of a wall: layers agree where they overlap, but for a few far before it."""
    parts, poses, views = [], [], []
    for view in range(num_views):
        more = unowned if view == 0 else 0
        made = cloud(count + more, num_atoms, size=0.08, seed=view, dtype=torch.float32)
        pose = turned(0.04 * view, (-0.12 * view, 0.0, 0.0))
        means = made.gaussians.means.double()
        wall = 2 + 0.1 * means[:, 2:] + 0.02 * view
        near = torch.arange(len(means))[:, None] % 10 == 0
        means = torch.where(near, means, means * wall / means[:, 2:])
        back = invert_rigid(pose)
        means = means @ back[:3, :3].T + back[:3, 3]
        parts.append(replace(made, gaussians=replace(made.gaussians, means=means.float())))
        poses.append(pose)
        ids = torch.full((len(means),), view)
        ids[count:] = -1
        views.append(ids)
    ids = torch.cat(views)
    first = parts[0]
    fields = ("means", "quats", "scales", "opacities", "sh")
    gaussians = type(first.gaussians)(*(torch.cat([getattr(p.gaussians, f) for p in parts]) for f in fields))
    semantics = Semantics(
        torch.cat([p.semantics.weight_ids for p in parts]),
        torch.cat([p.semantics.weight_values for p in parts]),
        first.semantics.dictionary,
        "test",
    )
    gap = (ids == 1) & (gaussians.means[:, 0] > 0.3)
    scene = Scene(
        gaussians,
        semantics,
        torch.stack(poses).float(),
        first.Ks.float().expand(num_views, 3, 3),
        first.view_size,
        view_ids=ids,
        record=Record(layered=True),
    )
    return scene.rows(~gap)


def between(num_views: int) -> Camera:
    """Between the photos, off their row."""
    middle = (num_views - 1) / 2 + 0.2
    return camera(96, 80, 80.0, turned(0.04 * middle, (-0.12 * middle, 0.03, 0.05)))


def views_of(scene: Scene) -> torch.Tensor:
    """Which photo made each Gaussian."""
    assert scene.view_ids is not None
    return scene.view_ids


@pytest.fixture
def quick(gl, precision):
    """Moves as a processor does, wherever this runs."""
    made = SplatRenderer(gl, precision, hardware=replace(hardware_of(gl), blends_all=False))
    yield made
    made.release()


@pytest.mark.parametrize("num_views", NUM_VIEWS)
def test_a_picture_is_blended_as_the_reference_has_it(show, precision, num_views):
    scene, seen = layered(num_views), between(num_views)
    expected = compose.render(in_float64(scene), seen, background=(0.2, 0.4, 0.9))
    fused = reference.render(in_float64(scene), seen, background=(0.2, 0.4, 0.9))
    assert num_views == 1 or psnr(fused.rgb, expected.rgb) < 35, "blending must be another picture"
    renderer = show(scene, precision)
    renderer.draw(seen, background=(0.2, 0.4, 0.9))
    frame = renderer.frame(weight_maps=True)
    assert expected.alphas.mean() > 0.5
    assert psnr(frame.rgb, expected.rgb) >= PSNR[precision]
    assert psnr(frame.alphas, expected.alphas) >= PSNR[precision]
    solid = expected.alphas > 0.5
    assert ((frame.depths - expected.depths).abs()[solid] / expected.depths[solid]).mean() <= 1e-5
    assert (maps_of(frame) - maps_of(expected)).abs().mean() <= WEIGHT_ERROR[precision]
    # Weights of a Gaussian are in sum 1, and stay so when blended; K errors add up.
    assert (maps_of(frame).sum(-1) - expected.alphas).abs().mean() <= 10 * WEIGHT_ERROR[precision]


def test_maps_drawn_in_cells_are_those_drawn_whole(gl, show, precision):
    """To the bit: in other cells every weight of an atom is 0. A layer beside the picture, too."""
    if not draws_in_software(gl):
        pytest.skip("a graphics card draws whole maps")
    scene = layered(3)
    shift = torch.tensor([50.0, 0.0, 0.0]) * (views_of(scene) == 2)[:, None]
    beside = replace(scene, gaussians=replace(scene.gaussians, means=scene.gaussians.means + shift))
    for each in (scene, beside.rows(views_of(scene) >= 0)):
        drawn = []
        for maps in (CellMaps, WeightMaps):
            renderer = show(each, precision, hardware=replace(PROCESSOR, maps=maps))
            renderer.draw(between(3))
            drawn.append(maps_of(renderer.frame(weight_maps=True)))
        assert torch.equal(*drawn) and drawn[0].amax((0, 1)).min() > 0


@pytest.mark.parametrize("num_views", NUM_VIEWS)
@pytest.mark.usefixtures("queries")
def test_relevance_of_the_blend_is_the_references(show, precision, num_views):
    scene, seen = layered(num_views), between(num_views)
    expected = maps_of(compose.render(in_float64(scene), seen))
    renderer = show(scene, precision)
    renderer.draw(seen)
    for mode in ("relevancy", "cosine"):
        compiled = question(scene, 5, mode)
        renderer.ask(compiled)
        error = (renderer.relevance() - full_relevance(scene, compiled, expected)).abs()
        assert error.mean() <= RELEVANCE_ERROR[precision]


def test_what_layers_count_is_in_sum_one_or_more_where_anything_shows(renderer):
    scene, seen = layered(3), between(3)
    renderer.set_scene(scene)
    renderer.draw(seen)
    blend = renderer.canvas.view((96, 80))._blend
    shares = np.frombuffer(blend.shares.read(), np.float32).reshape(80, 96, 4)
    drawn = [np.frombuffer(layer.depth.read(), np.float32).reshape(80, 96, 2) for layer in blend._layers]
    alphas = np.stack([each[..., 1] for each in drawn], -1)
    covered = (alphas > 0).any(-1)
    assert covered.any() and not shares[~covered].any() and not shares[..., 3].any()
    # four quotients in float32
    assert (shares.sum(-1)[covered] - 1).min() >= -1e-6
    assert ((shares[..., :3] * alphas).sum(-1) - alphas.max(-1)).max() <= 1e-6
    assert shares.min() >= 0 and all(np.ptp(shares[..., i]) > 0.5 for i in range(3))


def test_a_new_phrase_at_rest_draws_no_splat(renderer):
    scene, seen = layered(6), between(6)
    renderer.set_scene(scene)
    renderer.ask(question(scene, 1))
    renderer.draw(seen)
    renderer.relevance()
    passes = dict(renderer.passes)
    assert passes["colour"] == 4 and passes["blend"] == 1
    assert passes["weights"] == 8  # thirty atoms are two passes of each
    renderer.ask(question(scene, 3, seed=7))
    renderer.draw(seen)
    renderer.relevance()
    renderer.heat_texture(2)
    renderer.label_texture()
    renderer.picture().atoms()
    renderer.picture().features()
    kinds = ("colour", "weights", "blend", "pack")
    assert [renderer.passes[kind] for kind in kinds[:3]] == [passes[kind] for kind in kinds[:3]]


@pytest.mark.parametrize("num_views", [2, 6])
def test_marks_hide_and_tint_in_every_layer(renderer, num_views):
    """Also in layers that come into view after them."""
    scene, seen = layered(num_views), between(num_views)
    shown = np.random.default_rng(0).random(len(scene.gaussians)) < 0.6
    none = np.zeros(len(shown), np.uint8)
    renderer.set_scene(scene)
    renderer.draw(replace(seen, viewmat=scene.viewmats[0].double()))
    renderer.mark(shown, none)
    renderer.draw(seen)
    frame = renderer.frame(weight_maps=True)
    expected = compose.render(in_float64(scene.rows(torch.from_numpy(shown))), seen)
    # Other Gaussians tell another median distance, by some percent: what layers count changes as much.
    assert psnr(frame.rgb, expected.rgb) >= 45 and psnr(frame.alphas, expected.alphas) >= 45
    renderer.mark(np.ones(len(shown), bool), none)
    renderer.draw(seen)
    plain, weights = renderer.frame(weight_maps=True), renderer.passes["weights"]
    renderer.mark(np.ones(len(shown), bool), none + 1)
    renderer.draw(seen)
    blue = renderer.frame(weight_maps=True)
    assert torch.equal(blue.alphas, plain.alphas) and torch.equal(maps_of(blue), maps_of(plain))
    assert renderer.passes["weights"] == weights, "a tint draws no weight maps"
    assert float((blue.rgb[..., 2] - blue.rgb[..., 0]).mean()) > 0.1


def test_changes_reach_every_layer(show):
    """Also those that come into view after them."""
    scene, seen = layered(6), between(6)
    chosen = torch.arange(len(scene.gaussians)) % 3 == 0
    changes = (
        Moved(Mask.of(chosen.numpy()), offset=(0.3, 0.1, 0.2)),
        Recoloured.tint(Mask.of(~chosen.numpy()), (1.0, 0.0, 0.0), 0.5, 0.5),
    )
    expected = compose.render(
        in_float64(replace(scene, gaussians=apply_changes(scene.gaussians, changes))), seen
    )
    renderer = show(scene, "float32")
    renderer.draw(replace(seen, viewmat=scene.viewmats[0].double()))
    renderer.change(changes)
    renderer.draw(seen)
    assert psnr(renderer.frame().rgb, expected.rgb) >= PSNR["float32"]
    renderer.change(())
    renderer.draw(seen)
    assert psnr(renderer.frame().rgb, compose.render(in_float64(scene), seen).rgb) >= PSNR["float32"]


def test_pictures_are_continuous_where_another_layer_comes_in(show):
    """Steps of a walk along six photos: where the nearest four change, by no more than elsewhere."""
    scene = layered(6)
    nearness = Nearness.of(scene)
    places = np.linspace(1.2, 3.8, 105)
    seen = [camera(48, 40, 40.0, turned(0.04 * p, (-0.12 * p, 0.02, 0.03))) for p in places]
    renderer = show(scene, "float32")
    pictures = []
    for each in seen:
        renderer.draw(each, weight_maps=False)
        pictures.append(renderer.frame().rgb.double().numpy())
    steps = np.abs(np.diff(pictures, axis=0)).mean((1, 2, 3))
    chosen = [frozenset(nearness.chosen(each).views) for each in seen]
    changes = np.array([one != other for one, other in pairwise(chosen)])
    assert 2 <= changes.sum() < len(changes) / 4
    assert steps[changes].max() <= 1.5 * np.median(steps[~changes])


def enlarged(frame: Frame, size: tuple[int, int]) -> Frame:
    """A picture (width, height) of one in half the sides: sums are interpolated, depths their quotient."""
    width, height = size

    def twice(maps: torch.Tensor) -> torch.Tensor:
        flat = maps.movedim(-1, 0)[None]
        return interpolate(flat, scale_factor=2, mode="bilinear")[0, :, :height, :width].movedim(0, -1)

    alphas = twice(frame.alphas[..., None])[..., 0]
    sums = twice((frame.alphas * frame.depths)[..., None])[..., 0]
    depths = torch.where(alphas >= ALPHA_MIN, sums / alphas.clamp_min(ALPHA_MIN), 0.0)
    maps = None if frame.weight_maps is None else twice(frame.weight_maps)
    return Frame(twice(frame.rgb), alphas, depths, maps)


def moving_twin(scene: Scene, seen: Camera, weight_maps: bool = False) -> Frame:
    """What moves on a processor: the two nearest layers blended, the farther in half the size."""
    chosen = Nearness.of(scene).chosen(seen, MOVING)
    layers = [scene.layer(view) for view in chosen.views]
    first = reference.render(layers[0], seen, weight_maps=weight_maps)
    if len(layers) == 1:
        return first
    second = reference.render(layers[1], half(seen), weight_maps=weight_maps)
    return compose.blend_layers([first, enlarged(second, (seen.width, seen.height))], chosen.weights)


def walls(num_views: int) -> Scene:
    """A closed layer before each photo in a row: a striped wall that each puts a little elsewhere, in another
    light."""
    scene = layered(num_views, count=40 * 30, unowned=0)
    y, x = (t.flatten() for t in torch.meshgrid(torch.linspace(-1.2, 1.2, 30), torch.linspace(-1.6, 1.6, 40),
                                                indexing="ij"))  # fmt: skip
    ids = torch.arange(num_views).repeat_interleave(len(x))
    across = x.repeat(num_views) + 0.12 * ids
    means = torch.stack((across, y.repeat(num_views), 2 + 0.03 * (ids % 2)), 1)
    stripes = 0.5 + 0.3 * torch.sin(9 * across) + 0.03 * (ids % 3)
    count = len(ids)
    gaussians = replace(
        scene.gaussians.rows(torch.zeros(count, dtype=torch.int64)),
        means=means,
        scales=torch.full((count, 3), 0.06),
        opacities=torch.full((count,), 0.99),
        sh=colour_to_sh(stripes[:, None].expand(-1, 3))[:, None],
    )
    poses = torch.stack([turned(0.0, (-0.12 * view, 0.0, 0.0)) for view in range(num_views)]).float()
    scene = scene.rows(torch.zeros(count, dtype=torch.int64))
    return replace(scene, gaussians=gaussians, view_ids=ids, viewmats=poses)


def test_no_picture_jumps_on_a_walk(gl, show):
    """From the first of six photos to the last, moving: where another layer becomes the nearest, or comes in,
    no step is larger than what a walk at rest moves, by as much as those vary among themselves."""
    scene = walls(6)
    places = np.linspace(0.0, 5.0, 101)
    seen = [camera(64, 48, 50.0, turned(0.0, (-0.12 * p, 0.0, 0.0))) for p in places]
    renderer = show(scene, "float32", hardware=replace(hardware_of(gl), blends_all=False))
    steps = {}
    for moving in (True, False):
        pictures = []
        for each in seen:
            renderer.draw(each, weight_maps=False, moving=moving)
            pictures.append(renderer.frame().rgb.double().numpy())
        steps[moving] = np.abs(np.diff(pictures, axis=0)).mean((1, 2, 3))
    nearness = Nearness.of(scene)
    nearest = [nearness.chosen(each, MOVING).views[0] for each in seen]
    assert sum(one != other for one, other in pairwise(nearest)) == 5
    assert steps[True].max() / np.median(steps[True]) <= 1.2 * steps[False].max() / np.median(steps[False])


def test_layers_are_made_one_a_call(renderer):
    """Those that a picture needs, and none that is needed is given back for another."""
    scene = layered(12, count=60)
    renderer.set_scene(scene)
    level = renderer._scene.whole
    calls = 0
    for view in (0, 3, 6, 9, 2):
        chosen = set(Nearness.of(scene).chosen(scene.camera(view)).views)
        missing = len(chosen - set(level._layers))
        made, ready = set(level._layers), False
        while not ready:
            ready = renderer.upload(scene.camera(view))
            assert len(set(level._layers) - made) <= 1
            made, calls = set(level._layers), calls + 1
        assert chosen <= made and len(made) <= KEPT
        assert calls >= missing
        calls, layers = 0, dict(level._layers)
        renderer.draw(scene.camera(view), weight_maps=False)
        assert level._layers == layers, "the picture makes none itself"


@pytest.mark.parametrize("num_views", NUM_VIEWS)
@pytest.mark.parametrize("size", [(96, 80), (95, 79)], ids=["even", "odd"])
@pytest.mark.parametrize("how", ["fast", "a share", "moving"])
def test_a_moving_picture_is_blended_of_two(quick, precision, num_views, size, how):
    scene, seen = layered(num_views), between(num_views).with_size(*size)
    share = 0.999 if how == "a share" else 1.0
    quick.set_scene(scene)
    quick.draw(seen, fast=how == "fast", share=share, moving=how == "moving", weight_maps=False)
    moving, blended = quick.frame(), num_views > 1
    assert quick.passes["colour"] == 1 + blended and quick.passes["blend"] == blended
    expected = moving_twin(in_float64(thin_with_rows(scene, share)[0]), seen)
    assert psnr(moving.rgb, expected.rgb) >= PSNR[precision]
    assert psnr(moving.alphas, expected.alphas) >= PSNR[precision]
    quick.draw(seen, weight_maps=False)
    assert not blended or psnr(quick.frame().rgb, moving.rgb) < 40, "at rest it is another picture"


def test_numbers_of_a_moving_picture_are_exact_where_all_mean_the_same(gl, show):
    scene, seen = layered(3), between(3)
    ids = torch.full_like(scene.semantics.weight_ids, 2)
    scene = replace(scene, semantics=replace(scene.semantics, weight_ids=ids))
    compiled = question(scene, 2)
    renderer = show(scene, "float32", hardware=replace(hardware_of(gl), blends_all=False), asked=compiled)
    renderer.draw(seen, fast=True)
    renderer.carry()
    fast = renderer.relevance()
    assert renderer.passes["colour"] == 2 and renderer.passes["weights"] == 0
    renderer.draw(seen)
    exact = renderer.relevance()
    both = (fast > 0).all(0) & (exact > 0).all(0)
    assert both.float().mean() > 0.5
    assert (fast - exact)[:, both].abs().max() <= 1e-5  # float32 and a sigmoid


@pytest.mark.parametrize("num_views", NUM_VIEWS)
def test_on_a_card_a_moving_picture_is_blended_too(show, precision, num_views):
    """Its numbers by the same shares: the sum of W g over that of W |f|, both of the reference's blend."""
    scene, seen = layered(num_views), between(num_views)
    compiled = question(scene, 4)
    renderer = show(scene, precision, hardware=CARD, asked=compiled)
    renderer.draw(seen, fast=True)
    layers = len(Nearness.of(scene).chosen(seen).views)
    assert renderer.passes["colour"] == layers and not renderer.passes["weights"]
    error = (renderer.relevance() - twin(scene, compiled, seen)).abs()
    # As in test_gl_fast.py: a step or two are lost in the mean, here also where layers are added.
    assert error.mean() <= 4 * STEP[precision] + 1e-6
    expected = compose.render(in_float64(scene), seen)
    assert psnr(renderer.frame().rgb, expected.rgb) >= PSNR[precision]
    renderer.draw(seen)
    assert renderer.passes["colour"] == layers, "the colours are those at rest"
    maps = renderer.frame(weight_maps=True).weight_maps
    assert maps is not None and (maps - maps_of(expected)).abs().mean() <= WEIGHT_ERROR[precision]


def test_numbers_are_made_once_a_layer(quick, monkeypatch):
    from app.gl import question as asked

    made = []
    real = asked.splat_numbers
    monkeypatch.setattr(asked, "splat_numbers", lambda *given: made.append(given) or real(*given))
    scene = layered(2)
    quick.set_scene(scene)
    quick.ask(question(scene, 2))
    for step in range(4):
        quick.draw(camera(96, 80, 80.0, turned(0.01 * step, (-0.02 * step, 0.0, 0.0))), fast=True)
        quick.relevance()
    assert len(made) == 2


@pytest.mark.parametrize("size", [(96, 80), (95, 79)], ids=["even", "odd"])
def test_more_phrases_than_fit_are_asked_of_what_moves(gl, show, size):
    """Weight maps blended of two layers."""
    scene, seen = layered(3), between(3).with_size(*size)
    compiled = question(scene, 40)
    renderer = show(scene, "float32", hardware=replace(hardware_of(gl), blends_all=False), asked=compiled)
    renderer.draw(seen, fast=True)
    maps = maps_of(moving_twin(in_float64(scene), seen, weight_maps=True))
    error = (renderer.relevance() - full_relevance(scene, compiled, maps)).abs()
    assert error.mean() <= RELEVANCE_ERROR["float32"]


def test_at_rest_after_moving_is_as_before(quick):
    scene, seen = layered(6), between(6)
    quick.set_scene(scene)
    quick.ask(question(scene, 2))
    quick.draw(seen)
    before, relevance = quick.frame(weight_maps=True), quick.relevance()
    quick.draw(replace(seen, viewmat=scene.viewmats[0].double()), fast=True)
    quick.draw(seen, fast=True, share=0.5)
    assert not torch.equal(quick.frame().rgb, before.rgb)
    quick.draw(seen)
    after = quick.frame(weight_maps=True)
    assert torch.equal(after.rgb, before.rgb) and torch.equal(maps_of(after), maps_of(before))
    assert torch.equal(quick.relevance(), relevance)


def test_pictures_for_films_are_those_on_show(renderer):
    scene, seen = layered(6), between(6)
    renderer.set_scene(scene)
    film = renderer.colours(seen).astype(int)
    renderer.draw(seen)
    shown = np.frombuffer(renderer.rgb_texture.read(), np.uint8).reshape(80, 96, 4)[..., :3].astype(int)
    assert np.abs(film - shown).max() <= 1  # of two roundings
    first = renderer.frame().rgb
    renderer.colours(replace(seen, viewmat=scene.viewmats[0].double()))
    renderer.draw(seen)
    assert torch.equal(renderer.frame().rgb, first), "what a film drew between is not taken for this picture"
    relevant = compose.render(in_float64(scene), seen)
    assert (maps_of(renderer.frame(weight_maps=True)) - maps_of(relevant)).abs().mean() <= 2e-3


@pytest.mark.parametrize("num_views", NUM_VIEWS)
def test_a_still_picture_agrees_with_the_reference(num_views):
    scene, seen = layered(num_views), between(num_views)
    still, expected = draw_still(scene, seen, threads=2), compose.render(in_float64(scene), seen)
    # As in processor/test_still.py: colours and weights are kept as float16.
    assert psnr(still.frame.rgb, expected.rgb) >= 60 and still.maps is not None
    assert (still.maps.weights.double() - maps_of(expected)).abs().mean() < 2e-4
    solid = expected.alphas > 0.5
    assert ((still.frame.depths - expected.depths).abs()[solid] / expected.depths[solid]).mean() <= 1e-4
    asked = question(scene, 3)
    answered = torch.from_numpy(still.maps.relevance(asked)).double()
    assert (answered - full_relevance(scene, asked, maps_of(expected))).abs().mean() < 2e-3


def test_a_still_picture_of_two_layers_is_blended_of_the_nearest():
    scene, seen = layered(6), between(6)
    still = draw_still(scene, seen, most=2)
    chosen = Nearness.of(scene).chosen(seen, 2)
    frames = [reference.render(in_float64(scene).layer(view), seen) for view in chosen.views]
    expected = compose.blend_layers(frames, chosen.weights)
    assert psnr(still.frame.rgb, expected.rgb) >= 60 and still.maps is not None  # as above
    assert (still.maps.weights.double() - maps_of(expected)).abs().mean() < 2e-4
    assert psnr(compose.render(in_float64(scene), seen).rgb, expected.rgb) < 40


def test_a_still_picture_is_the_renderers_marked(show):
    scene, seen = layered(3), between(3)
    random, count = np.random.default_rng(0), len(scene.gaussians)
    marks = random.random(count) < 0.7, random.integers(0, 3, count).astype(np.uint8)
    renderer = show(scene)
    renderer.mark(*marks)
    renderer.draw(seen)
    own, span = renderer.frame(weight_maps=True), renderer.depth_range
    still = draw_still(scene, seen, marks=marks)
    assert psnr(still.frame.rgb, own.rgb) >= 50 and still.maps is not None
    assert (still.maps.weights - maps_of(own)).abs().mean() < 2e-3
    assert still.depth_range == pytest.approx(span, rel=0.05)  # OpenGL counts what lies just beside the image


def test_a_still_picture_stops_between_layers():
    asked = []

    def stopping() -> bool:
        asked.append(None)
        return len(asked) > most

    scene, seen = layered(3), between(3)
    most = 10**9
    draw_still(scene, seen, stopping=stopping)
    most, before = len(asked) * 2 // 3, len(asked)
    asked.clear()
    with pytest.raises(Cancelled):
        draw_still(scene, seen, stopping=stopping)
    assert len(asked) == most + 1 < before


def test_a_thinned_level_keeps_every_layer_closed(renderer):
    """Each photo's place is covered by its own layer as before, though the layers lie in each other."""
    scene = layered(3, count=1200)
    levels = torch.arange(len(scene.gaussians)) % 4 == 3
    for known in (scene, replace(scene, levels=levels.to(torch.uint8))):
        share = 0.25 if known.levels is None else 0.8
        thinned, rows = thin_with_rows(known, share)
        assert thinned.view_ids is not None and torch.equal(thinned.view_ids, views_of(known)[rows])
        assert len(rows) <= np.ceil(share * len(known.gaussians))
        for view in range(3):
            full, left = (reference.render(s.layer(view), s.camera(view)) for s in (known, thinned))
            assert left.alphas.mean() >= 0.93 * full.alphas.mean()
        renderer.set_scene(known)
        renderer.give_level(known, share, Thinned(thinned, rows))
        renderer.draw(between(3), share=share, weight_maps=False)
        assert renderer.frame().alphas.mean() > 0.5


def test_layers_are_kept_for_a_while_and_drawn_again_alike(renderer):
    scene = layered(12, count=60)
    renderer.set_scene(scene)
    renderer.draw(scene.camera(0))
    first = renderer.frame(weight_maps=True)
    for view in range(1, 12):
        renderer.draw(scene.camera(view), weight_maps=False)
    level = renderer._scene.whole
    assert isinstance(level, LayeredLevel) and len(level._layers) == KEPT < 12 and 0 not in level._layers
    renderer.draw(scene.camera(0))
    again = renderer.frame(weight_maps=True)
    assert torch.equal(again.rgb, first.rgb) and torch.equal(maps_of(again), maps_of(first))


def test_pictures_of_single_layers_of_one_size_are_kept(renderer):
    """What each counts stays: weight maps of the size before need no colours again."""
    scene, seen = layered(3), between(3)
    renderer.set_scene(scene)
    renderer.draw(seen)
    first, view = renderer.frame(weight_maps=True), renderer.canvas.view((96, 80))
    renderer.draw(seen.with_size(48, 40))
    assert not view._blend._layers
    renderer.draw(seen)
    again = renderer.frame(weight_maps=True)
    assert torch.equal(again.rgb, first.rgb) and torch.equal(maps_of(again), maps_of(first))


def test_a_photo_sees_its_own_layer(show):
    scene = layered(3)
    renderer = show(scene, "float32")
    renderer.draw(between(3))
    paints.trust(renderer, False)
    paints.trust(renderer, True)
    live = renderer._scene
    assert live is not None
    photos = live.photo_depths(False)
    assert photos is live.photo_depths(True)
    width, height, count = photos.texture.size
    drawn = np.frombuffer(photos.texture.read(), np.float32).reshape(count, height, width)
    for view in range(3):
        frame = reference.render(scene.layer(view), scene.camera(view), weight_maps=False)
        sure = np.abs(frame.alphas.numpy() - 0.5) > 1e-3
        np.testing.assert_allclose(
            drawn[view][sure], np.where(frame.alphas >= 0.5, frame.depths, 0)[sure], atol=1e-4
        )


@pytest.mark.parametrize("what", ["no owner", "nothing", "not finite", "one layer out of view"])
def test_layers_that_show_nothing(renderer, what):
    scene = layered(2, count=50)
    if what == "no owner":
        scene = replace(scene, view_ids=torch.full_like(views_of(scene), -1))
    elif what == "one layer out of view":
        means = scene.gaussians.means - 50 * (views_of(scene) == 1)[:, None]
        owned = views_of(scene) >= 0
        scene = replace(scene, gaussians=replace(scene.gaussians, means=means)).rows(owned)
    elif what == "nothing":
        scene = scene.rows(torch.zeros(len(scene.gaussians), dtype=torch.bool))
    else:
        means = torch.where((views_of(scene) == 0)[:, None], torch.nan, scene.gaussians.means)
        scene = replace(scene, gaussians=replace(scene.gaussians, means=means))
    seen = between(2)
    renderer.set_scene(scene)
    renderer.ask(question(scene, 2))
    renderer.draw(seen, fast=True)
    assert torch.isfinite(renderer.relevance()).all()
    renderer.draw(seen)
    frame, expected = renderer.frame(weight_maps=True), compose.render(in_float64(scene), seen)
    assert psnr(frame.rgb, expected.rgb) >= 50 and torch.isfinite(renderer.relevance()).all()
    assert psnr(draw_still(scene, seen).frame.rgb, expected.rgb) >= 50
