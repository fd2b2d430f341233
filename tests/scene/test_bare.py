"""Scenes without photos: the view that is chosen shows them, whatever floats around."""

import pytest
import torch

from langflash_core.errors import PromptError
from langflash_core.geometry.cameras import transform
from langflash_core.language.spaces import language_space
from langflash_core.scene.bare import bare_scene
from langflash_core.scene.checks import check_scene
from langflash_core.scene.file import load, save
from langflash_core.scene.report import describe
from tests.geometry.twins import seen_at
from tests.splat.scenes import unturned


def ball(count: int = 3000, seed: int = 0) -> torch.Tensor:
    return torch.randn(count, 3, generator=torch.Generator().manual_seed(seed))


def shown(scene, means: torch.Tensor) -> float:
    """Share of points in front of the scene's camera and inside its picture."""
    camera = scene.camera(0)
    pos_c = transform(camera.viewmat, means)
    pixels = seen_at(pos_c, camera.K)
    size = torch.tensor([camera.width, camera.height])
    return float((((pixels >= 0) & (pixels < size)).all(-1) & (pos_c[:, 2] > 0)).double().mean())


@pytest.mark.parametrize("scale", [0.1, 1.0, 1000.0])
@pytest.mark.parametrize("centre", [(0.0, 0.0, 0.0), (30.0, -20.0, 5.0)])
def test_a_cloud_is_framed(scale, centre):
    means = scale * (ball() * torch.tensor([1.0, 0.5, 0.8]) + torch.tensor(centre))
    scene = bare_scene(unturned(means, 0.01), "a.ply")
    check_scene(scene)
    assert shown(scene, means) > 0.97  # 2.5 median deviations are 1.7 standard ones, and a fifth more
    distance = float(transform(scene.viewmats[0], means).median(0).values[2])
    assert distance < 8 * scale  # and it fills the picture: five standard deviations of the largest side


def test_floaters_do_not_push_the_camera_away():
    means = ball()
    floaters = 200 * ball(900, seed=1)  # a quarter of all
    alone = bare_scene(unturned(means, 0.01), "a.ply")
    with_floaters = bare_scene(unturned(torch.cat((means, floaters)), 0.01), "a.ply")
    assert shown(with_floaters, means) > 0.97
    far = [float(scene.viewmats[0, :3, 3].norm()) for scene in (alone, with_floaters)]
    assert far[1] < 2 * far[0]


def test_what_lies_ahead_of_the_origin_is_seen_from_there():
    means = ball() * torch.tensor([0.3, 0.2, 0.1]) + torch.tensor([0.0, 0.0, 1.5])
    scene = bare_scene(unturned(means, 0.01), "a.ply")
    assert torch.equal(scene.viewmats[0], torch.eye(4))
    assert shown(scene, means) > 0.93  # 97 % along each side


@pytest.mark.parametrize("count", [1, 2, 3])
def test_a_few_gaussians_are_framed(count):
    means = ball(count) - 2
    scene = bare_scene(unturned(means, 0.01), "a.ply")
    check_scene(scene)
    assert shown(scene, means) == 1


def test_it_is_a_scene_like_others(tmp_path):
    scene = bare_scene(unturned(ball(50), 0.01), "a.ply", ("Something to know.",))
    save(scene, tmp_path / "a.langflash")
    again = load(tmp_path / "a.langflash")
    assert torch.equal(again.gaussians.means, scene.gaussians.means)
    assert again.record == scene.record
    described = describe(again)
    assert described["atoms"] == 0 and described["source"] == "a.ply" and described["photos"] == []


def test_it_answers_no_phrase_and_says_so():
    with pytest.raises(PromptError, match=r"langflash lift FILE -o SCENE\.langflash") as caught:
        language_space(bare_scene(unturned(ball(5), 0.01), "a.ply").semantics.space)
    assert "\n" not in str(caught.value)
