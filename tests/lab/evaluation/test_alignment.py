"""The camera fitted to a picture: exact slopes, poses found again, and nothing made worse."""

from dataclasses import replace

import torch

from langflash_core.geometry.cameras import intrinsics_from_fov, rotation_angle_degrees
from langflash_core.geometry.harmonics import colour_to_sh
from langflash_core.lab.evaluation.alignment import aligned_camera, moved, residuals_of, sampled
from langflash_core.lab.training.measures import psnr
from langflash_core.splat import render
from langflash_core.types import Camera, Frame, Gaussians, Scene
from tests.splat.scenes import camera, scene_of

SIZE = 64


def wavy(height: int = SIZE, width: int = SIZE) -> torch.Tensor:
    """A smooth picture, float64."""
    y, x = torch.meshgrid(torch.arange(height).double(), torch.arange(width).double(), indexing="ij")
    waves = [torch.sin(0.31 * x + 0.2 * k) * torch.cos(0.23 * y - 0.4 * k) for k in range(3)]
    return 0.5 + 0.4 * torch.stack(waves, -1)


def wall_scene() -> tuple[Scene, Camera]:
    """A waving wall with a pattern, and who looks at it."""
    places = torch.linspace(-2, 2, 90)
    y, x = (m.flatten() for m in torch.meshgrid(places, places, indexing="ij"))
    means = torch.stack((x, y, 2.2 + 0.3 * torch.sin(2 * x) * torch.cos(1.7 * y)), -1)
    waves = [torch.sin(5 * x + k) * torch.cos(4 * y - 2 * k) for k in range(3)]
    colours = 0.5 + 0.4 * torch.stack(waves, -1)
    quats = torch.tensor([1.0, 0, 0, 0]).repeat(len(means), 1)
    scales, opacities = torch.full((len(means), 3), 0.03), torch.full((len(means),), 0.95)
    gaussians = Gaussians(means, quats, scales, opacities, colour_to_sh(colours[:, None]))
    return scene_of(gaussians.map(torch.Tensor.double)), camera(SIZE, SIZE, 50.0)


def test_slopes_are_those_of_autograd():
    generator = torch.Generator().manual_seed(0)
    points = torch.rand(40, 3, generator=generator, dtype=torch.float64) * torch.tensor([1.0, 1.0, 0.5])
    points = points + torch.tensor([-0.5, -0.5, 1.5])
    colours, K = (
        torch.rand(40, 3, generator=generator).double(),
        intrinsics_from_fov(60.0, SIZE, SIZE).double(),
    )
    motion = moved(torch.tensor([0.02, -0.01, 0.03, 0.01, 0.02, -0.02]).double())

    def residuals(step: torch.Tensor) -> torch.Tensor:
        return residuals_of(moved(step) @ motion, points, colours, K, wavy())[0]

    _, jacobian, inside = residuals_of(motion, points, colours, K, wavy())
    assert bool(inside.all())
    exact = torch.autograd.functional.jacobian(residuals, torch.zeros(6, dtype=torch.float64))
    assert torch.allclose(jacobian, exact, atol=1e-9)  # float64 rounding of slopes up to some tens


def test_samples_between_pixels_are_straight_lines():
    photo = wavy(5, 6)
    values, _, _, inside = sampled(
        photo, torch.tensor([1.5, 2.0, 9.0]).double(), torch.tensor([1.5, 1.5, 1.5]).double()
    )
    assert torch.equal(values[0], photo[1, 1])
    assert torch.allclose(values[1], (photo[1, 1] + photo[1, 2]) / 2)
    assert inside.tolist() == [True, True, False]


def test_a_pose_that_is_a_little_wrong_is_found_again():
    scene, right = wall_scene()

    def draw(camera: Camera) -> Frame:
        return render(scene, camera, weight_maps=False)

    photo = draw(right).rgb
    step = torch.tensor([0.012, -0.015, 0.01, 0.01, -0.012, 0.008]).double()
    wrong = replace(right, viewmat=moved(step) @ right.viewmat)
    found = aligned_camera(draw, wrong, photo)
    before, after = psnr(draw(wrong).rgb, photo), psnr(draw(found).rgb, photo)
    assert after > before + 6, (before, after)
    turn = rotation_angle_degrees(found.viewmat[:3, :3], right.viewmat[:3, :3])
    off = rotation_angle_degrees(wrong.viewmat[:3, :3], right.viewmat[:3, :3])
    assert float(turn) < float(off) / 3


def test_what_cannot_be_fitted_stays_where_it_is():
    scene, right = wall_scene()
    empty = Frame(torch.zeros(SIZE, SIZE, 3), torch.zeros(SIZE, SIZE), torch.zeros(SIZE, SIZE), None)
    assert aligned_camera(lambda camera: empty, right, wavy().float()) is right

    def draw(camera: Camera) -> Frame:
        return render(scene, camera, weight_maps=False)

    assert aligned_camera(draw, right, draw(right).rgb) is right  # nothing is better than exact
