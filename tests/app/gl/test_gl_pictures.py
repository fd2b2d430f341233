"""Heat-maps, labels, atoms, depth: what a person sees."""

import dataclasses

import numpy as np
import pytest
import torch

from app.gl import SplatRenderer, paints
from langflash_core.export.png import glow_share
from langflash_core.scene.gaps import fill_gaps
from langflash_core.scene.trust import fade_untrusted
from langflash_core.types import LUMA, Scene
from tests.app.gl.questions import question
from tests.splat.scenes import camera, cloud, maps_of, parallel, scene_of, splats

pytestmark = pytest.mark.usefixtures("queries")


def pixels(texture) -> np.ndarray:
    """(H, W, 4) in [0, 1], top row first."""
    return np.frombuffer(texture.read(), np.uint8).reshape(texture.height, texture.width, 4) / 255


@pytest.fixture
def asked(renderer):
    scene = cloud(1500, 12, dtype=torch.float32)
    renderer.set_scene(scene)
    renderer.draw(camera(), background=(0.0, 0.5, 1.0))
    renderer.ask(question(scene, 5))
    return renderer


def photographed(asked: SplatRenderer) -> Scene:
    """The scene, of which it is known that the first photo made it."""
    scene = dataclasses.replace(
        cloud(1500, 12, dtype=torch.float32), view_ids=torch.zeros(1500, dtype=torch.int64)
    )
    asked.set_scene(scene)
    return scene


def test_rgb_is_the_frame(asked):
    shown = pixels(asked.rgb_texture)
    # Eight bits: half a step.
    np.testing.assert_allclose(shown[..., :3], asked.frame().rgb.clamp(0, 1).numpy(), atol=0.51 / 255)
    assert (shown[..., 3] == 1).all()


def test_top_of_the_image_is_the_first_row(renderer):
    renderer.set_scene(scene_of(splats([(0.0, -0.7, 2.0)], 0.1, dtype=torch.float32)))  # up is -y
    renderer.draw(camera())
    shown = pixels(renderer.rgb_texture)[..., 0]
    assert shown[:20].sum() > 1 and shown[20:].sum() == 0


def test_grey_heat_is_relevance(asked):
    frame, relevance = asked.frame(), asked.relevance()
    heat = pixels(asked.heat_texture(2, "grey", threshold=0.3, over_rgb=False, span=(0.3, 0.8)))
    values = relevance[2].numpy()
    expected = np.where(values >= 0.3, np.clip((values - 0.3) / 0.5, 0, 1), 0)
    covered = frame.alphas.numpy() >= 0.5
    assert covered.any() and not covered.all()
    np.testing.assert_allclose(heat[..., 0], np.where(covered, expected, 0), atol=0.51 / 255)


def test_heat_over_the_photo_shows_only_what_passes(asked):
    nothing = pixels(asked.heat_texture(0, threshold=1.0))
    everything = pixels(asked.heat_texture(0, threshold=0.0, span=(0.0, 1.0)))
    assert np.ptp(nothing[..., :3], axis=-1).max() < np.ptp(everything[..., :3], axis=-1).max()
    assert not np.array_equal(nothing, everything)


def test_heat_covers_what_is_dark_and_lets_what_is_bright_through(asked):
    """The same colours as in files, where the whole photo is found."""
    frame = asked.frame()
    covered = (frame.alphas >= 0.5).numpy()
    under = (1 - frame.alphas)[..., None] * torch.tensor(
        [0.0, 0.5, 1.0]
    )  # the background, which is not in it
    rgb = (frame.rgb - under).clamp(0, 1)
    grey = (rgb * torch.tensor(LUMA)).sum(-1, keepdim=True)
    shades = torch.from_numpy(
        pixels(asked.heat_texture(0, threshold=0.0, over_rgb=False, span=(0.0, 1.0)))
    ).float()
    shown = pixels(asked.heat_texture(0, threshold=0.0, span=(0.0, 1.0)))
    expected = torch.lerp(rgb, shades[..., :3], glow_share(grey)).numpy()
    # Three roundings to eight bits, of which those of colours and brightness count at most once each.
    np.testing.assert_allclose(shown[covered][:, :3], expected[covered], atol=2 / 255)


def test_labels_are_the_argmax_or_none(asked):
    relevance, frame = asked.relevance(), asked.frame()
    limit = float(relevance.amax(0).median())
    best = torch.where((relevance.amax(0) >= limit) & (frame.alphas >= 0.5), relevance.argmax(0), -1)
    labels = asked.labels(threshold=limit)
    assert torch.equal(labels, best) and (labels == -1).any() and (labels >= 0).any()
    colours = np.eye(5, 3, dtype=np.float32)
    shown = pixels(asked.label_texture(colours, limit))
    first = (labels == 0).numpy()
    rgb = frame.rgb.clamp(0, 1).numpy()
    expected = 0.4 * rgb + 0.6 * np.array([1.0, 0.0, 0.0])
    # Labels lie over the premultiplied colour; the background adds nothing there.
    under = (1 - frame.alphas.numpy())[..., None] * np.array([0.0, 0.5, 1.0]) * 0.4
    np.testing.assert_allclose(shown[first][:, :3], (expected - under)[first], atol=2 / 255)


def test_atoms_have_one_colour_each(renderer):
    scene = cloud(1000, 3, kept=1, size=0.1, dtype=torch.float32)
    solid = dataclasses.replace(scene.gaussians, opacities=torch.ones(1000))
    scene = dataclasses.replace(scene, gaussians=solid)
    renderer.set_scene(scene)
    renderer.draw(camera())
    shown = pixels(renderer.picture().atoms())
    maps = maps_of(renderer.frame(weight_maps=True)).numpy()
    pure = [maps[..., k] > 0.97 for k in range(3)]
    means = np.stack([shown[mask][:, :3].mean(0) for mask in pure])
    assert all(mask.any() for mask in pure)
    assert min(np.abs(means[a] - means[b]).max() for a, b in ((0, 1), (0, 2), (1, 2))) > 0.2


def test_near_and_far_have_other_colours(renderer):
    gaussians = splats([(-0.4, 0.0, 1.5), (0.8, 0.0, 3.0)], [0.1, 0.2], 1.0, dtype=torch.float32)
    renderer.set_scene(scene_of(gaussians))
    renderer.draw(camera())
    shown = pixels(paints.depth(renderer, "grey"))[..., 0]
    assert shown[20, 13] > 0.95 and shown[20, 34] < 0.05 and shown[0, 0] == 0


def test_a_still_camera_costs_no_splat_pass(asked):
    def touched() -> tuple[int, int]:
        return asked.passes["colour"], asked.passes["weights"]

    asked.relevance()
    before = touched()
    assert before == (1, 1)
    scene = cloud(1500, 12, dtype=torch.float32)
    norms = asked.passes["norm"]
    for seed in range(3):
        asked.ask(question(scene, 2, seed=seed))
        asked.relevance()
        asked.heat_texture(1, "inferno", threshold=0.1 * seed)
        asked.label_texture()
        asked.draw(camera(), background=(float(seed), 0.0, 0.0))
    assert touched() == before and asked.passes["norm"] == norms
    shows, queries = asked.passes["show"], asked.passes["query"]
    asked.heat_texture(1, "inferno", threshold=0.2)
    asked.relevance()
    assert (asked.passes["show"], asked.passes["query"]) == (shows, queries)
    asked.draw(camera(focal=41.0))
    assert touched() == (2, 2)


def test_weight_maps_wait_until_they_are_needed(renderer):
    scene = cloud(300, 5, dtype=torch.float32)
    renderer.set_scene(scene)
    renderer.draw(camera(), weight_maps=False)
    assert renderer.passes["weights"] == 0
    renderer.ask(question(scene))
    renderer.relevance()
    assert renderer.passes["weights"] == 1


def test_what_is_missing_is_named(renderer):
    scene = cloud(10, 3, dtype=torch.float32)
    with pytest.raises(ValueError, match="set_scene"):
        renderer.draw(camera())
    renderer.set_scene(scene)
    with pytest.raises(ValueError, match="draw"):
        renderer.frame()
    renderer.draw(camera())
    with pytest.raises(ValueError, match="ask"):
        renderer.relevance()
    with pytest.raises(ValueError, match="expected 3 atoms, received 4"):
        renderer.ask(question(cloud(10, 4)))
    renderer.ask(question(scene, 2))
    with pytest.raises(ValueError, match="prompt: expected 0 to 1, received 2"):
        renderer.heat_texture(2)
    with pytest.raises(ValueError, match="colormap"):
        renderer.heat_texture(0, "jet")
    with pytest.raises(ValueError, match="1 x 1"):
        renderer.draw(dataclasses.replace(camera(), width=0))


@pytest.mark.parametrize(("aside", "flat"), [(0.0, False), (0.6, False), (1.6, False), (0.6, True)])
def test_faded_is_the_frame_fading_over_the_background(asked, aside, flat):
    scene = photographed(asked)
    shot, background = camera(), torch.tensor((0.0, 0.5, 1.0))
    viewmat = shot.viewmat.clone()
    viewmat[0, 3] -= aside * scene.gaussians.means[:, 2].mean()
    shot = dataclasses.replace(shot, viewmat=viewmat)
    if flat:
        shot = parallel(shot)
    asked.draw(shot)
    black = asked.frame()
    asked.draw(shot, background=(0.0, 0.5, 1.0))
    shown = pixels(asked.faded_texture())[..., :3]
    fading = fade_untrusted(black, shot, scene)
    expected = fading.rgb + (1 - fading.alphas[..., None]) * background
    # Eight bits: half a step, and the depth of a thin pixel is a quotient of two halves.
    np.testing.assert_allclose(shown, expected.clamp(0, 1).numpy(), atol=2.5 / 255)
    same = np.array_equal(shown, pixels(asked.rgb_texture)[..., :3])
    assert same if aside == 0 else not same


def test_nothing_fades_where_nobody_knows_the_photos(asked):
    assert asked.faded_texture() is asked.rgb_texture


def from_aside():
    """Where much of the picture is empty."""
    viewmat = camera().viewmat.clone()
    viewmat[0, 3] -= 1.5
    return dataclasses.replace(camera(), viewmat=viewmat)


@pytest.mark.parametrize("fading", [False, True])
def test_gaps_are_filled_as_the_twin_does(asked, fading):
    scene = photographed(asked)
    shot, background = from_aside(), torch.tensor((0.0, 0.5, 1.0))
    asked.draw(shot)
    frame = asked.frame()
    asked.draw(shot, background=tuple(background.tolist()))
    empty = pixels(asked.faded_texture() if fading else asked.rgb_texture)[..., :3]
    asked.fill(True)
    shown = pixels(asked.faded_texture() if fading else asked.rgb_texture)[..., :3]
    under = frame.rgb
    if fading:  # the background stands in for what is not known, and is around gaps as well
        near = fade_untrusted(frame, shot, scene)
        under = near.rgb + (frame.alphas - near.alphas)[..., None] * background
    expected = fill_gaps(under, frame.alphas, background)
    # Eight bits: half a step; the coarser pictures have eleven bits, and linear filters eight.
    np.testing.assert_allclose(shown, expected.clamp(0, 1).numpy(), atol=2.5 / 255)
    assert np.abs(shown - empty).max() > 0.2  # there were gaps
    asked.fill(False)
    assert np.array_equal(pixels(asked.faded_texture() if fading else asked.rgb_texture)[..., :3], empty)


@pytest.mark.parametrize(("fade", "fill"), [(False, True), (True, False), (True, True)])
def test_pictures_one_after_the_other_fade_and_fill_as_on_show(asked, fade, fill):
    photographed(asked)
    colours = asked.colours(from_aside(), fade=fade, fill=fill)
    asked.draw(from_aside())
    asked.fill(fill)
    shown = pixels(asked.faded_texture() if fade else asked.rgb_texture)[..., :3]
    assert np.array_equal(colours, (255 * shown).round().astype(np.uint8))
    plain = asked.colours(from_aside())  # nothing of it is left
    assert (plain < colours).any() if fill else (plain > colours).any()


def test_filled_gaps_change_what_is_seen_and_nothing_that_is_known(asked):
    def looks() -> dict[str, np.ndarray]:
        colours, cuts = np.eye(5, 3, dtype=np.float32), np.full(5, 0.5, np.float32)
        return {
            "heat": pixels(asked.heat_texture(0)),
            "labels": pixels(asked.label_texture(colours)),
            "dim": pixels(paints.masks(asked, "dim", colours, cuts)),
        }

    asked.draw(from_aside())
    frame, relevance, labels, empty = asked.frame(True), asked.relevance(), asked.labels(), looks()
    asked.fill(True)
    after = asked.frame(True)
    assert torch.equal(frame.rgb, after.rgb) and torch.equal(frame.alphas, after.alphas)
    assert torch.equal(frame.weight_maps, after.weight_maps) and torch.equal(relevance, asked.relevance())
    assert torch.equal(labels, asked.labels())
    open_ = 1 - frame.alphas.numpy()[..., None]
    for name, picture in looks().items():
        change = np.abs(picture - empty[name])
        assert change[open_[..., 0] > 0.9].max() > 0.1, name
        assert (change <= open_ + 1.01 / 255).all(), name  # and no more than is open, but for rounding


def test_the_colours_alone_are_those_of_the_picture(asked):
    camera_ = camera()
    asked.draw(camera_)
    shown = (255 * pixels(asked.rgb_texture)[..., :3]).round().astype(int)
    # Eight bits: the driver and the shader may round a value halfway between two steps apart.
    assert np.abs(asked.colours(camera_) - shown).max() <= 1
    with pytest.raises(ValueError, match="expected draw"):
        asked.frame()


def test_what_adds_nothing_is_discarded_or_drawn_to_the_same_bits(gl, monkeypatch):
    scene = cloud(1500, 12, dtype=torch.float32)
    frames = []
    for software in (False, True):
        monkeypatch.setattr("app.gl.hardware.draws_in_software", lambda ctx, said=software: said)
        drawn = SplatRenderer(gl)
        drawn.set_scene(scene)
        drawn.draw(camera())
        frames.append(drawn.frame(weight_maps=True))
        drawn.release()
    discarded, added = frames
    for name in ("rgb", "alphas", "depths", "weight_maps"):
        assert torch.equal(getattr(discarded, name), getattr(added, name)), name
