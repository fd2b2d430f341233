"""The pictures that answer and those that say what to trust, against float64 arithmetic on the reference."""

import dataclasses
from itertools import pairwise

import numpy as np
import pytest
import torch

from app.gl import SplatRenderer, paints
from app.gl.colours import feature_axes
from app.gl.paints import PAINTS, Wanted
from app.gl.photos import MOST_PHOTOS, SAME, WORST, spread
from langflash_core.base import pictures
from langflash_core.base.colormaps import HeatColours, colour_bar
from langflash_core.base.formats import COLOUR_MAPS
from langflash_core.base.pictures import COUNT_COLOURS
from langflash_core.splat import render
from langflash_core.types import Scene
from tests.app.gl.questions import full_relevance, question
from tests.splat.scenes import camera, cloud, maps_of, scene_of, splats, turned

BACKGROUND = (0.0, 0.5, 1.0)
THRESHOLDS = np.array([0.45, 0.5, 0.55])
COLOURS = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
STEP = 0.51 / 255  # eight bits: half a step
GREY = np.array([0.299, 0.587, 0.114])


def pixels(texture) -> np.ndarray:
    """(H, W, 3) in [0, 1], top row first."""
    return np.frombuffer(texture.read(), np.uint8).reshape(texture.height, texture.width, 4)[..., :3] / 255


@pytest.fixture
def exact(gl):
    """Float32 targets: what differs from the reference is the pass under test."""
    made = SplatRenderer(gl, "float32")
    yield made
    made.release()


@pytest.fixture
def truth() -> Scene:
    return cloud(1500, 12)


@pytest.fixture
def asked(exact, truth):
    exact.set_scene(cloud(1500, 12, dtype=torch.float32))
    exact.draw(camera(), background=BACKGROUND)
    exact.ask(question(truth, 3))
    return exact


def reference(scene: Scene):
    """The frame in float64, and relevance (3, H, W) the long way."""
    frame = render(scene, camera(), background=BACKGROUND)
    return frame, full_relevance(scene, question(scene, 3), maps_of(frame)).numpy()


def clear_of(edges: np.ndarray) -> np.ndarray:
    """Pixels whose distance (...) to a decision is beyond float32 rounding of a relevance (1e-5)."""
    return np.abs(edges).min(0) > 1e-4


@pytest.mark.parametrize("style", ["flat", "isolate", "hide", "dim"])
def test_masks_are_what_passes_its_own_threshold(asked, truth, style):
    frame, relevance = reference(truth)
    passes = (relevance >= THRESHOLDS[:, None, None]) & (frame.alphas.numpy() >= 0.5)
    best = np.where(passes, relevance, -1).argmax(0)
    shown = passes.max(0)
    rgb = frame.rgb.numpy().clip(0, 1)
    back = np.broadcast_to(BACKGROUND, rgb.shape)
    dimmed = 0.3 * (0.3 * rgb + 0.7 * (rgb @ GREY)[..., None])
    yes, no = {
        "flat": (COLOURS[best], back),
        "isolate": (rgb, back),
        "hide": (back, rgb),
        "dim": (rgb, dimmed),
    }[style]
    expected = np.where(shown[..., None], yes, no)
    sure = clear_of(relevance - THRESHOLDS[:, None, None]) & (np.abs(frame.alphas.numpy() - 0.5) > 1e-4)
    picture = pixels(paints.masks(asked, style, COLOURS, THRESHOLDS))
    assert shown.any() and not shown.all() and sure.mean() > 0.95
    np.testing.assert_allclose(picture[sure], expected[sure], atol=STEP)


@pytest.mark.parametrize("count", [1, 2, 3])
def test_the_margin_is_best_less_second_best_or_less_the_threshold(asked, truth, count):
    frame, relevance = reference(truth)
    query = question(truth, 3)
    asked.ask(dataclasses.replace(query, prompts=query.prompts[:count], texts=query.texts[:count]))
    values = np.sort(relevance[:count], axis=0)
    margin = values[-1] - (values[-2] if count > 1 else 0.45)
    expected = ((margin + 0.3) / 0.8).clip(0, 1)
    covered = frame.alphas.numpy() >= 0.5
    picture = pixels(paints.margin(asked, 0.45, (-0.3, 0.5), "grey", over_rgb=False))[..., 0]
    np.testing.assert_allclose(picture, np.where(covered, expected, 0), atol=STEP)
    assert np.ptp(margin[covered]) > 0.05


@pytest.mark.parametrize("atom", [0, 7, 11])
def test_a_weight_map_is_that_of_its_atom(asked, truth, atom):
    maps = maps_of(render(truth, camera())).numpy()
    picture = pixels(asked.picture().weight(atom, "grey"))[..., 0]
    np.testing.assert_allclose(picture, maps[..., atom].clip(0, 1), atol=STEP)
    assert picture.max() > 0.2


def test_an_atom_out_of_view_weighs_nothing(exact):
    scene = cloud(300, 4, dtype=torch.float32)
    ids = scene.semantics.weight_ids.clamp_max(2)
    exact.set_scene(
        dataclasses.replace(scene, semantics=dataclasses.replace(scene.semantics, weight_ids=ids))
    )
    exact.draw(camera())
    assert pixels(exact.picture().weight(2, "grey")).max() > 0
    assert pixels(exact.picture().weight(3, "grey")).max() == 0


def test_transmittance_is_what_passes(asked, truth):
    alphas = render(truth, camera()).alphas.numpy()
    wanted = Wanted((), (), 0, 0.0, 0, HeatColours("grey"))
    picture = PAINTS[pictures.TRANSMITTANCE](asked, wanted)
    np.testing.assert_allclose(pixels(picture)[..., 0], 1 - alphas, atol=STEP)


def test_every_picture_has_its_painter():
    assert set(PAINTS) == set(pictures.PICTURES)


def test_features_are_the_principal_axes_of_f(asked, truth):
    """The long way: F = W D in all channels, less the mean, onto axes of the covariance."""
    maps = maps_of(render(truth, camera())).numpy()
    semantics = truth.semantics
    atoms = semantics.dictionary.numpy()
    masses = (semantics.dense_weights() * truth.gaussians.opacities[:, None]).sum(0).numpy()
    shares = masses / masses.sum()
    mean = shares @ atoms
    covariance = (shares[:, None] * (atoms - mean)).T @ (atoms - mean)
    values, axes = np.linalg.eigh(covariance)
    total = maps.sum(-1)
    features = (maps @ atoms) / np.maximum(total, 1e-12)[..., None]
    expected = np.empty((*total.shape, 3))
    for place in range(3):
        along = (features - mean) @ axes[:, -1 - place]
        of_atoms = (atoms - mean) @ axes[:, -1 - place]
        sign = np.sign(of_atoms[np.abs(of_atoms).argmax()])
        expected[..., place] = 0.5 + sign * along / (4 * np.sqrt(values[-1 - place]))
    covered = total >= 2 / 255  # clear of the cut at 1 / 255
    picture = pixels(asked.picture().features())
    # Maps packed to 16 bits of the peak, as in all queries: 8e-6 of it, over the smallest deviation.
    np.testing.assert_allclose(picture[covered], expected.clip(0, 1)[covered], atol=STEP + 1e-3)
    assert (picture[total < 0.5 / 255] == 0).all() and np.ptp(picture[covered], axis=0).min() > 0.3


def test_features_of_one_atom_are_grey_and_of_none_black(exact):
    columns = feature_axes(np.ones((1, 8)), np.ones(1))
    assert (columns == [[0.5, 0.5, 0.5, 1.0]]).all()
    exact.set_scene(cloud(50, 0, dtype=torch.float32))
    exact.draw(camera())
    assert pixels(exact.picture().features()).max() == 0


def stereo(double: bool = True) -> Scene:
    """Two photos of a wall with a block before it: some of the wall is seen by one, some by none.

    Every photo made its own Gaussians, the second's 4 % too far away.
    """
    grid = [(x, y) for x in np.linspace(-1.2, 1.2, 49) for y in np.linspace(-1.0, 1.0, 41)]
    wall = [(x, y, 2.0) for x, y in grid]
    block = [(x / 4, y / 4, 1.4) for x, y in grid]
    first = wall + block
    second = [(x, y, 1.04 * z) for x, y, z in first]
    sizes = [0.04] * len(wall) + [0.012] * len(block)
    gaussians = splats(first + second, sizes * 2, 0.9, dtype=torch.float64 if double else torch.float32)
    base = scene_of(gaussians)
    poses = torch.stack((turned(0.0, (0.0, 0.0, 0.0)), turned(0.05, (-0.35, 0.0, 0.0))))
    return dataclasses.replace(
        base,
        viewmats=poses,
        Ks=base.Ks.expand(2, 3, 3).contiguous(),
        view_ids=torch.arange(2).repeat_interleave(len(first)),
    )


SEEN_FROM = camera(pose=turned(-0.1, (0.45, 0.1, 0.2)))


def own_part(scene: Scene, view: int) -> Scene:
    half = len(scene.gaussians) // 2
    rows = slice(half * view, half * (view + 1))
    return scene_of(scene.gaussians.map(lambda v: v[rows]))


def ratios(scene: Scene, own: bool) -> tuple[np.ndarray, np.ndarray]:
    """depth_ratio of photos.glsl (V, H, W) by loops over pixels in float64, and what is covered."""
    frame = render(scene, SEEN_FROM, weight_maps=False)
    covered = frame.alphas.numpy() >= 0.5
    K, back = SEEN_FROM.K.numpy(), np.linalg.inv(SEEN_FROM.viewmat.numpy())
    found = np.zeros((2, *covered.shape))
    for view in range(2):
        photo = scene.camera(view)
        seen = render(own_part(scene, view) if own else scene, photo, weight_maps=False)
        depths = np.where(seen.alphas >= 0.5, seen.depths, 0).astype(float)
        for y, x in zip(*np.nonzero(covered), strict=True):
            z = float(frame.depths[y, x])
            place = np.array([(x + 0.5 - K[0, 2]) / K[0, 0] * z, (y + 0.5 - K[1, 2]) / K[1, 1] * z, z, 1.0])
            pos = photo.viewmat.numpy() @ back @ place
            column, row, _ = np.floor(photo.K.numpy() @ (pos[:3] / pos[2])).astype(int)
            inside = 0 <= row < depths.shape[0] and 0 <= column < depths.shape[1]
            if inside and depths[row, column] > 0:
                found[view, y, x] = pos[2] / depths[row, column]
    return found, covered


def test_coverage_counts_the_photos_that_saw_a_pixel(exact):
    found, covered = ratios(stereo(), own=False)
    count = (np.abs(found - 1) <= SAME).sum(0)
    exact.set_scene(stereo(double=False))
    exact.draw(SEEN_FROM)
    picture = pixels(paints.trust(exact, False))
    # Each count's colour lies far from the others', whatever the grey of the photo below it.
    nearest = np.argmin([np.ptp(picture - 0.7 * np.array(c), axis=-1) for c in COUNT_COLOURS], axis=0)
    assert {0, 1, 2} <= set(count[covered])
    # On the border of two texels, or with a ratio on the limit, float32 may choose the other side.
    assert (nearest == count)[covered].mean() > 0.98
    assert (picture[~covered] == 0).all()


def test_agreement_is_the_worst_ratio_of_two_photos_own_depths(exact):
    found, covered = ratios(stereo(), own=True)
    tells = (found > 0) & (found <= 1 + WORST)
    worst = np.where(tells, np.abs(found - 1), 0).max(0)
    both = covered & (tells.sum(0) == 2)
    exact.set_scene(stereo(double=False))
    exact.draw(SEEN_FROM)
    picture = pixels(paints.trust(exact, True))
    bar = colour_bar(COLOUR_MAPS[0])[0] / 255
    expected = bar[(worst / WORST * 255).round().clip(0, 255).astype(int)]
    shade = (picture - 0.7 * expected)[both]  # what is left is grey
    # Pixels at the block's edge fall on either side of it in float32.
    assert (np.ptp(shade, axis=-1) < 0.04).mean() > 0.95
    alone = picture[covered & (tells.sum(0) < 2)]
    assert len(alone) and (np.ptp(alone, axis=-1) < 0.01).mean() > 0.9
    assert both.any() and 0.02 < np.median(worst[both]) < 0.06  # the photos lie 4 % apart


def test_photo_depths_follow_the_scene_and_leave_it_alone(exact):
    scene = stereo(double=False)
    exact.set_scene(scene)
    exact.draw(SEEN_FROM)
    before = exact.frame().rgb
    paints.trust(exact, False)
    assert torch.equal(exact.frame().rgb, before) and exact.passes["colour"] == 1
    bare = dataclasses.replace(scene, view_ids=None)
    exact.set_scene(bare)
    exact.draw(SEEN_FROM)
    with pytest.raises(ValueError, match="view_ids"):
        paints.trust(exact, True)


def test_of_many_photos_some_are_asked_from_the_first_to_the_last():
    for count in (1, 2, MOST_PHOTOS):
        assert spread(count) == list(range(count))
    for count in (MOST_PHOTOS + 1, 128, 300):
        views = spread(count)
        assert len(set(views)) == MOST_PHOTOS and views[0] == 0 and views[-1] == count - 1
        gaps = [b - a for a, b in pairwise(views)]
        assert max(gaps) - min(gaps) <= 1
