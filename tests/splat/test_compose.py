"""Views of scenes of layers: which layers, with which weights, and what their blend keeps."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
import torch

from langflash_core.geometry.nearness import FLOOR, Nearness
from langflash_core.splat import compose, reference
from langflash_core.types import Camera, Frame, Gaussians, Record, Scene, Semantics
from tests.splat.scenes import unturned

SIZE = 8


def wall(depth: float, colour: float, atom: int) -> tuple[Gaussians, Semantics]:
    """A closed grey wall across the whole view, of one atom."""
    steps = torch.linspace(-1.2, 1.2, 13)
    along = torch.linspace(-1.2, 3.8, 26)
    y, x = torch.meshgrid(steps, along, indexing="ij")
    means = torch.stack((x, y, torch.ones_like(x)), -1).reshape(-1, 3) * depth
    count = len(means)
    sh = torch.full((count, 1, 3), (colour - 0.5) / 0.28209479177387814)
    gaussians = unturned(means, 0.16 * depth, 0.95, sh)
    ids = torch.full((count, 1), atom)
    return gaussians, Semantics(ids, torch.ones(count, 1), torch.eye(4), "minilm")


def moved(along: float, turn: float = 0.0) -> torch.Tensor:
    """(4, 4), world to a camera that stands so far along x, turned about y."""
    viewmat = torch.eye(4, dtype=torch.float64)
    c, s = math.cos(turn), math.sin(turn)
    viewmat[:3, :3] = torch.tensor([[c, 0, -s], [0, 1, 0], [s, 0, c]])
    viewmat[:3, 3] = -viewmat[:3, :3] @ torch.tensor([along, 0, 0], dtype=torch.float64)
    return viewmat.float()


def layered(walls: list[tuple[float, float, int]], places: list[float]) -> Scene:
    """A layer a photo; all look along z."""
    parts = [wall(*each) for each in walls]
    names = ("means", "quats", "scales", "opacities", "sh")
    gaussians = Gaussians(*(torch.cat([getattr(g, name) for g, _ in parts]) for name in names))
    ids, values = (torch.cat([getattr(s, n) for _, s in parts]) for n in ("weight_ids", "weight_values"))
    K = torch.tensor([[SIZE / 2, 0, SIZE / 2], [0, SIZE / 2, SIZE / 2], [0, 0, 1.0]])
    return Scene(
        gaussians,
        Semantics(ids, values, parts[0][1].dictionary, "minilm"),
        torch.stack([moved(place) for place in places]),
        K.repeat(len(places), 1, 1),
        (SIZE, SIZE),
        view_ids=torch.arange(len(parts)).repeat_interleave(torch.tensor([len(g) for g, _ in parts])),
        record=Record(layered=True),
    )


def camera_at(scene: Scene, along: float, turn: float = 0.0) -> Camera:
    return replace(scene.camera(0), viewmat=moved(along, turn))


def frame(colour: float, alpha: float, depth: float) -> Frame:
    ones = torch.ones(2, 3)
    return Frame(colour * alpha * torch.ones(2, 3, 3), alpha * ones, depth * ones, None)


def test_a_scene_without_layers_is_drawn_by_the_reference_alone():
    scene = layered([(2, 0.3, 0), (2, 0.7, 1)], [0, 0.5]).with_record(layered=False)
    camera = camera_at(scene, 0.1)
    ours, theirs = compose.render(scene, camera), reference.render(scene, camera)
    assert ours.weight_maps is not None and theirs.weight_maps is not None
    assert torch.equal(ours.rgb, theirs.rgb) and torch.equal(ours.weight_maps, theirs.weight_maps)


def test_at_a_photos_place_its_own_layer_shows():
    scene = layered([(2, 0.2, 0), (2, 0.8, 1)], [0, 1.0])
    own, other = (compose.render(scene, camera_at(scene, at)).rgb.mean() for at in (0.0, 1.0))
    # the other layer counts (.05 / (.05 + 1 / 2.7))^2 of the two, .015 of .6; walls let 2 % of the light pass
    assert abs(float(own) - 0.2) < 0.03 and abs(float(other) - 0.8) < 0.03


def test_half_way_between_two_photos_agreeing_layers_are_blended_alike():
    scene = layered([(2, 0.2, 0), (2, 0.8, 1)], [0, 1.0])
    middle = compose.render(scene, camera_at(scene, 0.5))
    assert torch.allclose(middle.rgb, torch.full_like(middle.rgb, 0.5), atol=0.02)  # alphas of walls: .98


def test_the_best_supported_depth_shows_and_no_second_one():
    frames = [frame(0.2, 1, 2.0), frame(0.2, 1, 2.02), frame(0.9, 1, 1.0)]
    blend = compose.blend_layers(frames, np.full(3, 1 / 3))
    # support of the third is 1 beside 2: (1 / 2)^4 of the weight of either other one
    expected = (2 * 0.2 + 0.9 / 16) / (2 + 1 / 16)
    assert torch.allclose(blend.rgb, torch.full_like(blend.rgb, expected), atol=0.005)


def test_a_hole_is_filled_by_the_next_layer():
    blend = compose.blend_layers([frame(0.2, 0, 0), frame(0.9, 1, 3)], np.array([0.9, 0.1]))
    assert torch.allclose(blend.rgb, torch.full_like(blend.rgb, 0.9)) and torch.allclose(
        blend.depths, torch.full_like(blend.depths, 3.0)
    )


@pytest.mark.parametrize("weight", [0.015, 0.4])
@pytest.mark.parametrize("alpha", [0.05, 0.5, 0.8, 0.95])
def test_where_a_layer_ends_before_an_opaque_one_no_light_passes(alpha, weight):
    """An edge of the nearer photo's layer: its alpha falls to 0 over a pixel, before a wall as bright."""
    near, far = frame(0.6, alpha, 3.0), frame(0.6, 1, 3.0)
    blend = compose.blend_layers([near, far], np.array([1 - weight, weight]))
    assert torch.allclose(blend.alphas, torch.ones(2, 3)) and torch.allclose(blend.rgb, torch.tensor(0.6))


def test_an_opaque_layer_that_goes_changes_nothing_at_once():
    frames = [frame(0.2, 0.5, 3.0), frame(0.9, 1, 3.0)]
    alphas = [
        float(compose.blend_layers(frames, np.array([1 - w, w])).alphas[0, 0])
        for w in np.linspace(0, 0.004, 401)
    ]
    assert alphas[0] == 0.5 and alphas[-1] == pytest.approx(1)
    steps = np.diff(alphas)  # w A is about 2 w of all
    assert steps.min() >= -1e-6 and steps.max() <= 2.1e-5 / compose.CLOSES


def test_where_no_layer_shows_anything_nothing_is_shown():
    blend = compose.blend_layers([frame(0.2, 0, 0), frame(0.9, 0, 0)], np.array([0.5, 0.5]))
    assert not blend.rgb.any() and not blend.alphas.any() and not blend.depths.any()


def test_shares_are_in_sum_one_or_raised_to_what_a_layer_shows_and_never_no_numbers():
    torch.manual_seed(0)
    alphas = torch.rand(4, 5, 6) * (torch.rand(4, 5, 6) > 0.5)
    depths = torch.rand(4, 5, 6) * 10 ** torch.randint(-6, 6, (4, 5, 6)).float()
    b = compose.shares(alphas, depths, np.array([0.4, 0.3, 0.2, 0.1]))
    there = alphas.amax(0) > 0
    assert torch.isfinite(b).all() and (b >= 0).all()
    shown = (b * alphas).sum(0)
    assert (b.sum(0)[there] > 1 - 1e-5).all() and (shown <= alphas.amax(0) + 1e-5).all()
    assert (shown >= alphas.amax(0) - 0.01)[alphas.amax(0) > 0.1].all()  # nearly all count enough to close it


def test_weight_maps_are_blended_with_the_same_numbers():
    scene = layered([(2, 0.2, 0), (2, 0.8, 1)], [0, 1.0])
    got = compose.render(scene, camera_at(scene, 0.3))
    # each layer is of one atom and one grey, so W tells the grey: linear in the blend
    assert got.weight_maps is not None
    expected = 0.2 * got.weight_maps[..., 0] + 0.8 * got.weight_maps[..., 1]
    assert torch.allclose(got.rgb[..., 0], expected, atol=1e-5)  # float32
    assert torch.allclose(got.weight_maps.sum(-1), got.alphas, atol=1e-5)


def test_at_most_four_layers_count_and_a_layer_leaves_with_nothing():
    places = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]
    scene = layered([(2, 0.5, 0)] * 6, places)
    near = Nearness.of(scene)
    assert set(near.chosen(camera_at(scene, 0.1)).views) <= {0, 1, 2, 3}
    # as far from 0 as from 4: neither counts, so that they may change places
    assert set(near.chosen(camera_at(scene, 2.0)).views) == {1, 2, 3}
    before, after = (near.chosen(camera_at(scene, 2 + step)) for step in (-1e-4, 1e-4))
    for chosen in (before, after):
        left = [w for v, w in zip(chosen.views, chosen.weights, strict=True) if v in (0, 4)]
        assert all(w < 1e-3 for w in left)


def test_a_step_of_the_camera_is_a_step_of_the_picture_everywhere():
    walls = [(2 + 0.05 * k, 0.1 + 0.15 * k, 0) for k in range(6)]
    scene = layered(walls, [0.0, 0.9, 2.1, 3.0, 3.8, 5.0])
    rgb = [compose.render(scene, camera_at(scene, at)).rgb for at in np.arange(0.5, 4.5, 0.05)]
    steps = [float((a - b).abs().max()) for a, b in itertools.pairwise(rgb)]
    # weights of 1 / f^2 change by 2 / FLOOR of themselves a distance at a photo's place, where they are 1;
    # a step is .05 / 2 of a distance at most, and colours differ by .75
    assert max(steps) < 0.75 * 2 / FLOOR * 0.05 / 2


def test_one_photo_is_one_layer_and_turning_round_still_shows_it():
    scene = layered([(2, 0.2, 0)], [0.0])
    assert Nearness.of(scene).chosen(camera_at(scene, 0.0, math.pi)).views == (0,)


def test_what_no_photo_made_is_in_every_layer():
    scene = layered([(2, 0.2, 0), (2, 0.8, 1)], [0, 1.0])
    assert scene.view_ids is not None
    ids = scene.view_ids.clone()
    ids[:10] = -1
    both = replace(scene, view_ids=ids)
    assert len(both.layer(0).gaussians) + len(both.layer(1).gaussians) == len(ids) + 10


def test_a_layer_of_a_scene_that_does_not_know_its_photos_is_refused():
    scene = replace(layered([(2, 0.2, 0)], [0.0]), view_ids=None)
    assert not scene.layered
    with pytest.raises(ValueError, match="view_ids"):
        scene.layer(0)
