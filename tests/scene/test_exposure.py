"""The light of a place: each photo's at its own place, mixtures between, the scene's far away."""

import math
from dataclasses import replace

import numpy as np
import pytest
import torch

from app.cli.lab.shared import colour_only
from langflash_core import pipeline
from langflash_core.export.png import to_8bit
from langflash_core.geometry.cameras import invert_rigid
from langflash_core.language.spaces import language_space
from langflash_core.scene.exposure import lit_camera, median_distance
from langflash_core.scene.settings import EXPOSURE
from langflash_core.splat import render
from langflash_core.splat.projection import view_colours
from langflash_core.types import Camera, Scene
from langflash_core.writing.cameras import chosen_camera
from langflash_core.writing.films import picture
from langflash_core.writing.renderers import TorchRenderer
from tests.app.window.scenes import PHRASES, room
from tests.splat.scenes import camera, cloud, parallel, turned

GAINS = [[1.3, 1.2, 1.25], [0.7, 0.8, 0.75], [1.0, 1.1, 0.9]]
OFFSETS = [[0.05, 0.04, 0.06], [-0.07, -0.06, -0.05], [0.0, 0.01, -0.02]]
LIGHT = {"gains": GAINS, "offsets": OFFSETS}
PLACES = (turned(0.0, (0.0, 0.0, 0.0)), turned(0.3, (0.4, 0.0, 0.1)), turned(-0.2, (-0.5, 0.1, 0.0)))
EXACT = 1e-6
"""Float32 keeps 6e-8 of a gain; at a photo's place the others count 1e-8 / .05 together."""


def lit_scene(light: dict | None = None, scale: float = 1.0) -> Scene:
    """A cloud seen by three photos."""
    scene = cloud(300, num_atoms=3, degree=1, dtype=torch.float32)
    viewmats = torch.stack(PLACES).float()
    viewmats[:, :3, 3] *= scale
    gaussians = replace(scene.gaussians, means=scene.gaussians.means * scale)
    Ks = scene.Ks[:1].repeat(3, 1, 1)
    return replace(scene, gaussians=gaussians, viewmats=viewmats, Ks=Ks).with_record(light=light or LIGHT)


def twin(scene: Scene, viewmat: torch.Tensor) -> np.ndarray:
    """As the formula reads, photo after photo, angles by arccos."""
    here, total, logs, offsets = invert_rigid(viewmat.double()), 1 / EXPOSURE.far**2, np.zeros(3), np.zeros(3)
    for view, own in enumerate(scene.viewmats.double()):
        place = invert_rigid(own)
        cosine = float(place[:3, 2] @ here[:3, 2])
        way = float((place[:3, 3] - here[:3, 3]).norm()) / median_distance(scene)
        weight = 1 / (math.acos(max(-1.0, min(1.0, cosine))) ** 2 + way**2)
        total += weight
        logs += weight * np.log(GAINS[view])
        offsets += weight * np.array(OFFSETS[view])
    return np.stack((np.exp(logs / total), offsets / total))


@pytest.mark.parametrize("view", range(3))
def test_at_a_photos_place_it_is_that_photos(view):
    scene = lit_scene()
    found = lit_camera(scene, scene.camera(view)).light
    assert found is not None
    assert (found - torch.tensor([GAINS[view], OFFSETS[view]])).abs().max() < EXACT


@pytest.mark.parametrize("scale", [1.0, 7.0])
def test_elsewhere_it_is_as_the_formula_has_it_in_any_unit(scale):
    scene = lit_scene(scale=scale)
    for angle, place in ((0.1, (0.1, 0.0, 0.0)), (1.0, (0.5, 0.5, -0.5)), (-0.1, (-0.2, 0.05, 0.0))):
        viewmat = turned(angle, place).float()
        viewmat[:3, 3] *= scale
        seen = lit_camera(scene, Camera(viewmat, scene.Ks[0], 40, 30))
        assert seen.light is not None
        assert np.abs(seen.light.numpy() - twin(scene, viewmat)).max() < EXACT


def test_far_away_it_is_the_scenes_own():
    scene, viewmat = lit_scene(), torch.eye(4)
    viewmat[2, 3] = 1000 * median_distance(scene)
    found = lit_camera(scene, Camera(viewmat, scene.Ks[0], 40, 30)).light
    assert found is not None
    share = 3 * (EXPOSURE.far / 999) ** 2  # of all photos together, at most
    assert (found - torch.tensor([[1.0] * 3, [0.0] * 3])).abs().max() < share * 0.4


def test_photos_in_one_light_have_none():
    plain = lit_scene().with_record(light={})
    assert lit_camera(plain, plain.camera(1)).light is None
    assert lit_camera(plain, lit_camera(lit_scene(), plain.camera(1))).light is None  # nothing of another's


@pytest.mark.parametrize("degrees", [5, 90])
def test_how_the_camera_is_held_does_not_matter(degrees):
    """The window shows photos upright that were held aslant, and with parallel rays."""
    scene, angle = lit_scene(), math.radians(degrees)
    roll = torch.eye(4)
    roll[:2, :2] = torch.tensor([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    plain = scene.camera(1)
    for seen in (replace(plain, viewmat=roll @ plain.viewmat), parallel(plain)):
        found = lit_camera(scene, seen).light
        assert found is not None
        assert (found - torch.tensor([GAINS[1], OFFSETS[1]])).abs().max() < 10 * EXACT  # a float32 product


def test_gaussians_that_are_no_numbers_tell_no_distance():
    scene = lit_scene({"gains": GAINS[:1] * 3, "offsets": OFFSETS[:1] * 3})
    means = torch.full_like(scene.gaussians.means, torch.nan)
    scene = replace(scene, gaussians=replace(scene.gaussians, means=means))
    assert median_distance(scene) == 1
    found = lit_camera(scene, scene.camera(0)).light
    assert found is not None and torch.isfinite(found).all()


def test_a_camera_is_drawn_in_its_light_before_anything_is_clamped():
    """What is beyond white or below black in the scene's light is not in that of a photo."""
    scene = lit_scene()
    gaussians = replace(scene.gaussians, sh=scene.gaussians.sh * 3)
    seen, (gain, offset) = camera(40, 30, 30.0), torch.tensor([[1.6] * 3, [-0.3] * 3])
    light = torch.stack((gain, offset))
    plain, lit = (view_colours(gaussians, replace(seen, light=of)) for of in (None, light))
    assert (plain == 0).any() and (plain > 1).any()
    some = plain > 0
    assert torch.allclose(lit[some], ((plain - offset) / gain)[some], atol=1e-6)
    assert (lit[~some] > 0).any()


def test_whatever_people_see_is_drawn_in_the_light_of_its_place():
    """Answers, files' cameras, films, what the lab judges; not what a scene's camera is by itself."""
    plain = room(language_space("minilm").encode(PHRASES))
    light = {name: [rows[0]] * plain.num_views for name, rows in LIGHT.items()}
    scene = plain.with_record(light=light)
    expected = render(scene, lit_camera(scene, scene.camera(0)), weight_maps=False).rgb
    unlit = render(scene, scene.camera(0), weight_maps=False).rgb
    assert (expected - unlit).abs().max() > 0.05
    assert torch.equal(pipeline.query(scene, PHRASES[0], view=0).frame.rgb, expected)
    chosen = chosen_camera(0, None, None, False).of(scene)
    assert torch.equal(render(scene, chosen, weight_maps=False).rgb, expected)
    renderer = TorchRenderer()
    assert np.array_equal(picture(scene, scene.camera(0), renderer, None), to_8bit(expected))
    assert torch.equal(colour_only(renderer)(scene, scene.camera(0)).rgb, expected)
