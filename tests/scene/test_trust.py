"""How far a picture can be trusted: all of it where a photo was taken, less and less aside."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import torch

from langflash_core.errors import InputError
from langflash_core.geometry.cameras import invert_rigid
from langflash_core.scene.settings import TRUST
from langflash_core.scene.trust import fade_untrusted, trust
from langflash_core.splat import render
from langflash_core.types import Camera, Scene
from tests.splat.scenes import cloud


@pytest.fixture
def scene() -> Scene:
    """Of two photos, the second half a unit to the right."""
    made = cloud(400, 5, dtype=torch.float32)
    second = made.viewmats[0].clone()
    second[0, 3] -= 0.5
    return replace(
        made,
        viewmats=torch.stack((made.viewmats[0], second)),
        Ks=made.Ks[:1].repeat(2, 1, 1),
        photos=(),
        view_ids=torch.zeros(len(made.gaussians), dtype=torch.int64),
    )


def aside(degrees: float) -> torch.Tensor:
    angle = torch.tensor(degrees).deg2rad()
    return torch.stack((angle.sin(), torch.zeros(()), -angle.cos()))


def test_trust_falls_with_the_angle_to_the_nearest_photo():
    point, eyes = torch.zeros(1, 3), aside(0.0)[None]
    values = [float(trust(point, 2 * aside(d), eyes)) for d in (0, 29, 31, 45, 60, 74, 76, 120, 180)]
    assert values[:2] == [1, 1] and values[-3:] == [0, 0, 0]
    assert all(near > far for near, far in pairwise(values[1:7]))
    # Its slow twin: smoothstep of cosines, from the angle itself.
    low, high = np.cos(np.radians([TRUST.none, TRUST.full]))
    share = (np.cos(np.radians(45)) - low) / (high - low)
    assert values[3] == pytest.approx(share**2 * (3 - 2 * share), abs=1e-6)
    both = torch.stack((aside(0.0), aside(60.0)))
    assert float(trust(point, aside(50.0), both)) == 1  # ten degrees from the second


@pytest.mark.parametrize("view", [0, 1])
def test_from_a_photos_own_place_a_frame_is_equal_bit_by_bit(scene: Scene, view: int):
    frame = render(scene, scene.camera(view))
    same = fade_untrusted(frame, scene.camera(view), scene)
    for name in ("rgb", "alphas", "depths", "weight_maps"):
        assert torch.equal(getattr(same, name), getattr(frame, name))


def test_far_aside_a_frame_is_empty(scene: Scene):
    own = scene.camera(0)
    middle = scene.gaussians.means.mean(0)
    pose = torch.eye(4)
    pose[:3, :3] = torch.tensor([[0.0, 0, -1], [0, 1, 0], [1, 0, 0]])  # from the right, looking left
    pose[:3, 3] = middle + torch.tensor([6.0, 0, 0])
    camera = Camera(invert_rigid(pose), own.K, own.width, own.height)
    frame = render(scene, camera)
    gone = fade_untrusted(frame, camera, scene)
    assert frame.alphas.max() > 0.5
    assert gone.alphas.sum() < 0.1 * frame.alphas.sum()
    for values in (gone.rgb, gone.alphas, gone.depths, gone.weight_maps):
        assert values is not None and torch.isfinite(values).all()


def test_nobody_knows_the_photos_of_a_splat_file(scene: Scene):
    frame = render(scene, scene.camera(0))
    with pytest.raises(InputError, match="leave --fade out"):
        fade_untrusted(frame, scene.camera(0), replace(scene, view_ids=None))
