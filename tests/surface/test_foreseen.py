"""How much of a photo its neighbours foresee: a wall and a box whose truth is known."""

import math
from dataclasses import dataclass, replace

import numpy as np
import pytest
import torch
from torch import Tensor

from langflash_core.geometry.cameras import intrinsics_from_fov, invert_rigid, rays, transform, world_points
from langflash_core.geometry.rotations import matrix
from langflash_core.rig.rig import Rig
from langflash_core.scene.settings import DOUBTS
from langflash_core.surface.foreseen import CELL, Foresight, draw_points, foresight
from langflash_core.types import Camera

VIEWS, WIDTH, HEIGHT = 4, 120, 90


@dataclass(frozen=True)
class Seen:
    images: Tensor
    depths: Tensor
    viewmats: Tensor
    Ks: Tensor

    def found(self) -> Foresight:
        return foresight(Rig(self.viewmats, self.Ks, self.depths, photos=self.images))

    def turned(self, view: int, degrees: float) -> "Seen":
        """With one photo's pose turned about its own upright axis."""
        half = math.radians(degrees) / 2
        turn, viewmats = np.eye(4), self.viewmats.clone()
        turn[:3, :3] = matrix((math.cos(half), 0.0, math.sin(half), 0.0))
        viewmats[view] = torch.from_numpy(turn).float() @ viewmats[view]
        return replace(self, viewmats=viewmats)


@pytest.fixture
def seen() -> Seen:
    """A wall whose pattern repeats every six cells, and a box before it."""
    viewmats, K = torch.eye(4).repeat(VIEWS, 1, 1), intrinsics_from_fov(60, WIDTH, HEIGHT)
    viewmats[:, 0, 3] = torch.linspace(0.2, -0.2, VIEWS)
    images, depths = [], []
    for viewmat in viewmats:
        pose, ahead = invert_rigid(viewmat), rays(K, WIDTH, HEIGHT)
        x, y, _ = transform(pose, 2 * ahead).unbind(-1)
        box = (x.abs() < 0.3) & (y.abs() < 0.3)
        x, y, _ = transform(pose, ahead * torch.where(box, 2.0, 3.0)[..., None]).unbind(-1)
        grey = 0.5 + 0.2 * (12 * x).sin() + 0.2 * (12 * y).cos() - 0.1 * box
        images.append(grey.expand(3, -1, -1))
        depths.append(torch.where(box, 2.0, 3.0))
    return Seen(torch.stack(images), torch.stack(depths), viewmats, K.repeat(VIEWS, 1, 1))


def test_photos_that_meet_are_foreseen(seen):
    found = seen.found()
    assert all(share > 0.7 for share in found.covered)
    assert all(like is not None and like > 0.9 for like in found.alike)
    assert all(view != beside for view, beside in enumerate(found.nearest))


def test_a_photo_with_a_wrong_pose_does_not_meet_its_neighbours(seen):
    right, wrong = seen.found(), seen.turned(1, 2.0).found()  # 3.6 pixels: a cell and more
    assert right.alike[1] is not None and wrong.alike[1] is not None
    assert wrong.alike[1] < DOUBTS.torn < right.alike[1]


def test_a_photo_with_wrong_depth_is_foreseen_and_the_others_are_not(seen):
    """Its own layer is right at its own place, whatever its depth; others see it wrong."""
    depths = seen.depths.clone()
    depths[0] *= 0.6
    found, right = replace(seen, depths=depths).found(), seen.found()
    # What is left is how much each neighbour counts, which goes by the distance to what is seen.
    assert found.alike[0] == pytest.approx(right.alike[0], abs=0.05)
    assert found.alike[1] is not None and right.alike[1] is not None and found.alike[1] < right.alike[1]


def test_light_does_not_matter(seen):
    images = seen.images.clone()
    images[2] = 0.5 * images[2] + 0.1
    # Its neighbours' pictures hold none of it, so only the norms change, by rounding.
    assert replace(seen, images=images).found().alike[2] == pytest.approx(seen.found().alike[2], abs=1e-4)


def test_a_photo_that_looks_away_stands_alone(seen):
    found = seen.turned(3, 180.0).found()
    assert found.covered[3] == 0 < DOUBTS.alone and found.alike[3] is None


def test_two_photos_foresee_each_other(seen):
    two = Seen(*(getattr(seen, name)[:2] for name in ("images", "depths", "viewmats", "Ks")))
    assert two.found().nearest == (1, 0)


def test_what_is_no_number_is_left_out(seen):
    depths = seen.depths.clone()
    depths[1, :5] = torch.nan
    found = replace(seen, depths=depths).found()
    assert all(math.isfinite(share) for share in found.covered)
    assert all(like is not None and math.isfinite(like) for like in found.alike)


def test_nothing_to_compare_says_nothing(seen):
    flat = replace(seen, images=torch.full_like(seen.images, 0.5))
    assert flat.found().alike == (None,) * VIEWS


def test_points_fall_into_cells_as_one_by_one(seen):
    """Twin of `draw_points`: a loop over points."""
    camera = Camera(seen.viewmats[2], seen.Ks[2], seen.depths.shape[2], seen.depths.shape[1])
    points = world_points(seen.depths[:1], seen.viewmats[:1], seen.Ks[:1])[0]
    colours, depths = draw_points(points.T, seen.images[0].flatten(1), camera)
    cells: dict[tuple[int, int], list[tuple[float, Tensor]]] = {}
    pose = invert_rigid(camera.viewmat)
    for point, colour in zip(points, seen.images[0].flatten(1).T, strict=True):
        x, y, z = (pose[:3, :3].T @ (point - pose[:3, 3])).tolist()
        u, v, _ = (camera.K @ torch.tensor([x / z, y / z, 1.0])).tolist()
        if z > 0 and 0 <= u < CELL * depths.shape[1] and 0 <= v < CELL * depths.shape[0]:
            cells.setdefault((int(v // CELL), int(u // CELL)), []).append((z, colour))
    expected, near = torch.zeros_like(colours), torch.full_like(depths, torch.inf)
    for (row, column), inside in cells.items():
        nearest = min(z for z, _ in inside)
        front = torch.stack([colour for z, colour in inside if z < 1.1 * nearest])
        expected[:, row, column], near[row, column] = front.mean(0), nearest
    # float32 positions may put a point on the border of two cells into the other one: a tenth of a percent.
    wrong = ((colours - expected).abs().amax(0) > 1e-4) | ((depths - near).abs() > 1e-4)
    assert float(wrong.float().mean()) < 0.01


def test_what_is_stored_is_plain(seen):
    stored = seen.found().stored()
    assert set(stored) == {"covered", "alike", "nearest"} and all(len(v) == VIEWS for v in stored.values())
    assert all(isinstance(value, float) for value in (*stored["covered"], *stored["alike"]))
