"""Refinement on a painted wall: photos are computed from the paint, not drawn from Gaussians."""

from dataclasses import replace

import pytest
import torch
from torch import Tensor

from langflash_core.errors import InputError
from langflash_core.geometry.cameras import invert_rigid, project, rays, transform
from langflash_core.geometry.harmonics import SH_C0
from langflash_core.splat import render
from langflash_core.splat.refine import RATES, Budget, _fit, _moved, psnr, refine
from langflash_core.types import Gaussians, Scene, Semantics

WIDTH, HEIGHT, FOCAL = 32, 24, 29.0
K = torch.tensor([[FOCAL, 0, WIDTH / 2], [0, FOCAL, HEIGHT / 2], [0, 0, 1]])


def _paint(points: Tensor) -> Tensor:
    """Colours (..., 3) in [0, 1] of places on the wall."""
    x, y = points[..., 0], points[..., 1]
    return 0.5 + 0.4 * torch.stack(((7 * x).sin(), (9 * y + 3 * x).sin(), (5 * x * y + 6 * y).cos()), -1)


def _on_the_wall(viewmat: Tensor) -> Tensor:
    """Where the pixels (H, W) of a camera see the wall z = 1, (H, W, 3) world."""
    pose = invert_rigid(viewmat)
    directions = rays(K, WIDTH, HEIGHT) @ pose[:3, :3].T
    return pose[:3, 3] + directions * ((1 - pose[2, 3]) / directions[..., 2:])


def _twisted(viewmats: Tensor, twists: list[list[float]]) -> Tensor:
    return _moved(viewmats, torch.tensor(twists))


TRUE = _twisted(
    torch.eye(4).repeat(3, 1, 1), [[0.0] * 6, [0, 0.1, 0, -0.1, 0, 0], [0, 0.2, 0, -0.2, 0.02, 0]]
)
WRONG = _twisted(TRUE, [[0.0] * 6, [0.006, 0, 0.004, 0, 0.01, 0], [0, 0.008, 0, 0.01, 0, 0]])


def _wall(noise: float = 0.1, placed: Tensor = WRONG) -> tuple[Scene, Tensor]:
    """What a network might hand over: poses half a degree off, colours off by a tenth; and the photos.

    `placed`: the poses from which the Gaussians were put on the wall.
    """
    torch.manual_seed(0)
    photos = torch.stack([_paint(_on_the_wall(v)) for v in TRUE]).movedim(-1, 1)
    means, colours = [], []
    for true, wrong in zip(TRUE, placed, strict=True):
        seen = _on_the_wall(true).reshape(-1, 3)
        pos_c = seen @ true[:3, :3].T + true[:3, 3]
        pose = invert_rigid(wrong)
        means.append(pos_c @ pose[:3, :3].T + pose[:3, 3])
        colours.append(_paint(seen))
    means, colours = torch.cat(means), torch.cat(colours)
    colours = colours + noise * torch.randn(colours.shape)
    count = len(means)
    gaussians = Gaussians(
        means=means,
        quats=torch.tensor([1.0, 0, 0, 0]).repeat(count, 1),
        scales=torch.full((count, 3), 0.6 / FOCAL),
        opacities=torch.full((count,), 0.8),
        sh=((colours - 0.5) / SH_C0)[:, None],
    )
    words = Semantics(
        torch.zeros(count, 0, dtype=torch.long), torch.zeros(count, 0), torch.zeros(0, 4), "minilm"
    )
    view_ids = torch.arange(3).repeat_interleave(WIDTH * HEIGHT)
    scene = Scene(gaussians, words, WRONG, K.repeat(3, 1, 1), (WIDTH, HEIGHT), view_ids=view_ids)
    return scene, photos


def test_a_held_out_view_and_the_poses_come_closer():
    scene, photos = _wall()
    told: list[float] = []
    found = refine(scene, photos, Budget(seconds=600, steps=50), lambda _, fraction: told.append(fraction))
    assert found.kept and found.view == 1 and found.steps == (25, 25)
    # Seen: 23.0 to 29.1 dB held out and 24.7 to 32.5 dB in the photos.
    assert found.held_out[1] > found.held_out[0] + 2
    assert found.photos[1] > found.photos[0] + 4
    assert torch.equal(found.scene.viewmats[0], torch.eye(4))  # the world stays where it is
    norms = found.scene.gaussians.quats.norm(dim=-1)
    torch.testing.assert_close(norms, torch.ones_like(norms))
    assert not any(value.requires_grad for value in vars(found.scene.gaussians).values())
    assert found.scene.semantics is scene.semantics
    assert told == sorted(told) and told[0] < 0.01 and 0.9 < told[-1] < 1


def _pixels_off(viewmats: Tensor) -> float:
    """Mean distance of where wrong cameras see the wall from where the true ones see it."""
    points = torch.stack([_on_the_wall(v).reshape(-1, 3) for v in TRUE])
    seen = [project(transform(poses, points), K) for poses in (viewmats, TRUE)]
    return float((seen[0] - seen[1])[1:].norm(dim=-1).mean())


def test_poses_come_closer(monkeypatch):
    """Only cameras move: pictures drawn from the true ones are met again where they were taken."""
    for name in RATES:
        monkeypatch.setitem(RATES, name, 2e-3 if name == "twists" else 0.0)
    scene, _ = _wall(noise=0.0, placed=TRUE)
    there = replace(scene, viewmats=TRUE)
    photos = torch.stack([render(there, there.camera(v)).rgb for v in range(3)]).movedim(-1, 1)
    far = _twisted(TRUE, [[0.0] * 6, [0.012, 0, 0.008, 0, 0.02, 0], [0, 0.016, 0, 0.02, 0, 0]])
    found, steps = _fit(replace(scene, viewmats=far), photos, range(3), Budget(600, 60), lambda *_: None)
    assert steps == 60 and torch.equal(found.gaussians.means, scene.gaussians.means)
    assert _pixels_off(found.viewmats) < 0.8 * _pixels_off(far)


def test_what_does_not_help_is_not_kept():
    """Photos of something else around an honest held-out one: fitting them moves away from it."""
    scene, photos = _wall()
    misleading = torch.rand(photos.shape)
    misleading[1] = photos[1]
    found = refine(scene, misleading, Budget(seconds=600, steps=12))
    assert not found.kept and found.scene is scene
    assert found.held_out[1] <= found.held_out[0]
    assert found.photos[0] == found.photos[1] and found.steps[1] == 0


def test_the_clock_ends_it():
    scene, photos = _wall()
    assert refine(scene, photos, Budget(seconds=1e-6)).steps == (0, 0)


def test_what_cannot_be_judged_is_said():
    scene, photos = _wall()
    one = replace(scene, viewmats=scene.viewmats[:1], Ks=scene.Ks[:1], view_ids=None)
    with pytest.raises(InputError, match="at least two"):
        refine(one, photos[:1], Budget(1))
    behind = scene.viewmats.clone()
    behind[1, 2, 3] = -50
    with pytest.raises(InputError, match="overlap too little"):
        refine(replace(scene, viewmats=behind), photos, Budget(1))
    with pytest.raises(ValueError, match="view_ids: expected the view that made each"):
        refine(replace(scene, view_ids=None), photos, Budget(1))
    with pytest.raises(ValueError, match="photos: expected 3"):
        refine(scene, photos[:2], Budget(1))


def test_psnr_counts_what_is_shown():
    photo = torch.zeros(3, 2, 2)
    rgb = torch.zeros(2, 2, 3)
    rgb[0, 0] = 0.1
    assert psnr(rgb, photo, torch.tensor([[True, False], [False, False]])) == pytest.approx(20, abs=1e-4)
    assert psnr(rgb, photo, torch.tensor([[False, True], [True, True]])) == 100
