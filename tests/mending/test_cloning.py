"""The clone brush between a wall and a floor whose every Gaussian is known."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from langflash_core.errors import InputError
from langflash_core.geometry.quaternions import quats_to_matrices
from langflash_core.mending.cloning import Stroke, clone
from langflash_core.scene.joining import append_part
from langflash_core.types import Camera, Scene
from tests.app.window.scenes import room

WALL, FLOOR = slice(2500, 7400), slice(7400, 12_300)  # rows of the room; z = 1.3 and y = 0.4
SIZE = (224, 168)
FLAT = torch.tensor([1.0, 1.0, 0.1])  # of a sphere's scales: a disc across its z axis


@pytest.fixture(scope="module")
def scene() -> Scene:
    """The room with discs instead of balls: those of the wall face it, those of the floor look up."""
    made = room(torch.eye(3))
    quats = made.gaussians.quats.clone()
    quats[FLOOR] = torch.tensor([0.5**0.5, 0.5**0.5, 0.0, 0.0])  # z to -y
    gaussians = replace(made.gaussians, quats=quats, scales=made.gaussians.scales * FLAT)
    return replace(made, gaussians=gaussians, confidences=torch.full((len(gaussians),), 0.8))


def disc(x: float, y: float, radius: float) -> np.ndarray:
    rows, columns = np.mgrid[: SIZE[1], : SIZE[0]] + 0.5
    return np.hypot(columns - x, rows - y) <= radius


def stroke_on(scene: Scene, point: tuple[float, float, float], radius: float = 12.0) -> Stroke:
    """A dab of the brush where the first view shows a point."""
    camera = scene.camera(0)
    x, y, z = point
    at = (float(camera.K[0, 0] * x / z + camera.K[0, 2]), float(camera.K[1, 1] * y / z + camera.K[1, 2]))
    return Stroke(camera, disc(*at, radius), at, radius)


def every(scene: Scene) -> torch.Tensor:
    return torch.ones(len(scene.gaussians), dtype=torch.bool)


def test_the_wall_is_laid_on_the_floor_turned_by_their_normals(scene, draw):
    source, place = (0.6, -0.2, 1.3), (0.3, 0.4, 1.15)
    part, gone = clone(scene, every(scene), source, stroke_on(scene, place, 6.0), draw)
    means = part.gaussians.means.double().numpy()
    assert len(means) > 15 and abs(means[:, 1] - 0.4).max() < 1e-5
    # Slow twin: turned about x until the wall's normal -z is the floor's -y: (x, y, z) -> (x, z, -y).
    wall = scene.gaussians.means[WALL].double().numpy() - source
    laid = np.stack((wall[:, 0], wall[:, 2], -wall[:, 1]), 1) + place
    apart = np.linalg.norm(means[:, None] - laid[None], axis=-1)
    assert (
        apart.min(1).max() < 2e-4
    )  # the start is a pixel's ray, not the point itself: float32 of the camera
    which = apart.argmin(1) + WALL.start
    assert torch.equal(part.gaussians.sh, scene.gaussians.sh[which])
    assert torch.equal(part.semantics.weight_ids, scene.semantics.weight_ids[which])
    normals = quats_to_matrices(part.gaussians.quats.double())[:, :, 2]
    assert float(normals[:, 1].abs().min()) > 1 - 1e-9
    assert part.confidences is not None and not bool(part.confidences.any())
    assert gone[FLOOR].sum() > 15 and not gone[WALL].any()


def test_what_was_there_goes_and_the_picture_shows_the_copy(scene, draw):
    stroke = stroke_on(scene, (0.3, 0.4, 1.15))
    part, gone = clone(scene, every(scene), (0.6, -0.2, 1.3), stroke, draw)
    done = append_part(scene.rows(~gone), part)
    before, after = (draw(each, stroke.camera) for each in (scene, done))
    inner = torch.from_numpy(disc(*stroke.start, stroke.radius - 4))
    assert float((after.alphas[inner] > 0.9).float().mean()) > 0.98
    assert before.weight_maps is not None and after.weight_maps is not None
    assert float(before.weight_maps[inner].mean(0)[2]) > 0.9 < float(after.weight_maps[inner].mean(0)[1])
    far = torch.from_numpy(~disc(*stroke.start, stroke.radius + 16))  # 16 pixels: three deviations
    assert float((before.rgb - after.rgb)[far].abs().max()) < 2 / 255


def test_a_hole_is_closed_on_the_surface_around_it(scene, draw):
    stroke = stroke_on(scene, (0.5, -0.1, 1.3))
    hole = torch.from_numpy(stroke.holds(centres(scene, stroke.camera)))
    hole[: WALL.start] = False
    part, gone = clone(scene, ~hole, (-0.6, -0.3, 1.3), stroke, draw)
    assert float((part.gaussians.means[:, 2] - 1.3).abs().max()) < 1e-5
    assert not bool((gone & hole).any()) and len(part.gaussians) > 0.7 * int(hole.sum())


def centres(scene: Scene, camera: Camera) -> np.ndarray:
    points = scene.gaussians.means.double() @ camera.K.double().T
    return (points[:, :2] / points[:, 2:]).numpy()


def test_what_stands_before_the_surface_is_not_taken_along(scene, draw):
    """The block hangs before the wall: no copy of it where the wall behind it is the source."""
    seen = every(scene)
    seen[:2500:2] = False  # of the block enough is left to be in the way
    part, _ = clone(scene, seen, (-0.3, 0.1, 1.3), stroke_on(scene, (0.7, -0.1, 1.3)), draw)
    assert bool((part.semantics.weight_ids[:, 0] == 1).all())


def test_copies_keep_their_size_unless_they_are_to_fit(scene, draw):
    """The block's Gaussians lie .008 apart, the wall's 1.2 / 70."""
    args = scene, every(scene), (-0.15, 0.1, 0.65), stroke_on(scene, (0.6, -0.2, 1.3)), draw
    kept, fitted = clone(*args)[0], clone(*args, fit=True)[0]
    assert torch.allclose(kept.gaussians.scales, scene.gaussians.scales[:1])
    assert torch.allclose(fitted.gaussians.scales, 1.2 / 70 / 0.008 * scene.gaussians.scales[:1])
    assert len(kept.gaussians) > 3 * len(fitted.gaussians) > 0


def test_parallel_rays_and_opposite_surfaces(scene, draw):
    """From behind the wall its normal is the other one: it is turned around, not mirrored."""
    pixels = 120.0
    K = torch.tensor([[pixels, 0, SIZE[0] / 2], [0, pixels, SIZE[1] / 2], [0, 0, 1.0]])
    camera = Camera(torch.eye(4), K, *SIZE, orthographic=True)
    at = (0.5 * pixels + SIZE[0] / 2, -0.1 * pixels + SIZE[1] / 2)
    stroke = Stroke(camera, disc(*at, 9), at, 9.0)
    part, gone = clone(scene, every(scene), (-0.6, -0.3, 1.3), stroke, draw)
    assert float((part.gaussians.means[:, 2] - 1.3).abs().max()) < 1e-5
    assert abs(len(part.gaussians) - int(gone.sum())) < 0.4 * int(gone.sum())


def test_what_cannot_be_is_said(scene, draw):
    stroke = stroke_on(scene, (0.3, 0.4, 1.15))
    none = torch.zeros(len(scene.gaussians), dtype=torch.bool)
    with pytest.raises(InputError, match="no surface is seen"):
        clone(scene, none, (0.6, -0.2, 1.3), stroke, draw)
    nowhere = replace(stroke, pixels=np.zeros_like(stroke.pixels))
    with pytest.raises(InputError, match="no surface is seen"):
        clone(scene, every(scene), (0.6, -0.2, 1.3), nowhere, draw)
    with pytest.raises(InputError, match="choose another source"):
        clone(scene, every(scene), (0.0, -50.0, 1.3), stroke, draw)
    broken = replace(scene.gaussians, means=scene.gaussians.means.clone())
    broken.means[::3] = torch.nan
    part, gone = clone(replace(scene, gaussians=broken), every(scene), (0.6, -0.2, 1.3), stroke, draw)
    assert bool(part.gaussians.means.isfinite().all()) and not bool(gone[::3].any())


def test_in_layers_all_that_the_brush_shows_goes_and_every_layer_has_the_copies(scene, draw):
    count = len(scene.gaussians)
    twice = scene.rows(torch.arange(count).repeat(2))
    means = twice.gaussians.means.clone()
    means[count:] *= 1.05  # of the first photo's depths: beyond what one surface spans
    ids = torch.arange(2).repeat_interleave(count)
    layers = replace(twice, gaussians=replace(twice.gaussians, means=means), view_ids=ids)
    layers = layers.with_record(layered=True)
    place, source = (-0.2, -0.25, 1.3), (0.5, -0.25, 1.3)
    part, gone = clone(layers, every(layers), source, stroke_on(scene, place), draw)
    first, second = (gone[ids == view].sum() for view in range(2))
    assert min(first, second) > 0.7 * max(first, second)
    assert part.view_ids is not None and set(part.view_ids.tolist()) == {-1}
