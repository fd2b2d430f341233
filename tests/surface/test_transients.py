"""What one photo shows and the others do not: rooms whose truth is known, seen from five places."""

import math
from dataclasses import dataclass

import pytest
import torch
from torch import Tensor

from langflash_core.geometry.cameras import intrinsics_from_fov, invert_rigid, rays, transform, unproject
from langflash_core.rig.rig import Rig
from langflash_core.surface.transients import _CELL, _Look, transient_masks
from tests.geometry.twins import seen_at

WIDTH, HEIGHT = 96, 72
WALL = 3.0
SOMEBODY = (1.8, -0.3, 0.1, -0.5, 0.9)
"""z, left, right, top and bottom in the world."""
SCREEN = (WALL, -0.5, 0.3, -0.4, 0.3)


@dataclass(frozen=True)
class Seen:
    images: Tensor
    depths: Tensor
    viewmats: Tensor
    Ks: Tensor
    things: Tensor  # (V, H, W) bool

    def rig(self) -> Rig:
        return Rig(self.viewmats, self.Ks, self.depths, photos=self.images)

    def found(self) -> Tensor:
        return transient_masks(self.rig())


def room(thing: tuple[float, ...], shown: tuple[bool, ...], kinds: tuple[int, ...] | None = None) -> Seen:
    """A wall of soft stripes, and a thing before it in some photos, of a look of its own in each."""
    views = len(shown)
    viewmats = torch.eye(4).repeat(views, 1, 1)
    viewmats[:, 0, 3] = torch.linspace(0.3, -0.3, views)
    K = intrinsics_from_fov(60, WIDTH, HEIGHT)
    images, depths, things = [], [], []
    for view, (there, viewmat) in enumerate(zip(shown, viewmats, strict=True)):
        pose, ahead = invert_rigid(viewmat), rays(K, WIDTH, HEIGHT)
        x, y, _ = transform(pose, ahead * WALL).unbind(-1)
        wall = torch.stack((0.6 + 0.2 * (3 * x).sin(), 0.5 + 0.2 * (4 * y).cos(), 0.5 + 0 * x))
        z, left, right, top, bottom = thing
        x, y, _ = transform(pose, ahead * z).unbind(-1)
        inside = (x > left) & (x < right) & (y > top) & (y < bottom) & there
        hue = 0.1 + 0.15 * (0 if kinds is None else kinds[view])
        look = torch.stack((hue + 0.1 * (9 * x).sin(), 0.2 + 0.1 * (9 * y).sin(), 0.2 + 0 * x))
        images.append(torch.where(inside, look, wall).clamp(0, 1))
        depths.append(torch.where(inside, z, WALL))
        things.append(inside)
    return Seen(
        torch.stack(images), torch.stack(depths), viewmats, K.repeat(views, 1, 1), torch.stack(things)
    )


def only(view: int, count: int = 5) -> tuple[bool, ...]:
    return tuple(v == view for v in range(count))


@pytest.mark.parametrize("count", [3, 5, 12])
@pytest.mark.parametrize("thing", [SOMEBODY, SCREEN])
def test_what_one_photo_shows_is_left_out_of_it_alone(thing, count):
    seen = room(thing, only(1, count))
    found = seen.found()
    assert not found[[v for v in range(count) if v != 1]].any()
    there = seen.things[1]
    assert float(found[1][there].float().mean()) > 0.97
    # Beyond the thing: a margin of two cells, and one for cells that it fills in part.
    beyond = torch.nn.functional.max_pool2d(there[None, None].float(), 8 * _CELL + 1, 1, 4 * _CELL)[0, 0] > 0
    assert not (found[1] & ~beyond).any()


def test_what_all_photos_show_stays():
    assert not room(SOMEBODY, (True,) * 5).found().any()
    assert not room(SOMEBODY, (False,) * 5).found().any()


def test_two_photos_cannot_tell_who_is_right():
    assert not room(SOMEBODY, (True, False)).found().any()
    assert not room(SOMEBODY, (True,)).found().any()


def test_the_few_give_way_to_the_many():
    found = room(SCREEN, (True, False, True, False, False, False)).found()
    assert found.flatten(1).any(1).tolist() == [True, False, True, False, False, False]


def test_a_thing_that_all_show_stays_where_one_has_its_depth_wrong():
    """The others foresee wall where one photo has the thing too near, but show the thing along its rays."""
    seen = room(SOMEBODY, (True,) * 5)
    seen.depths[2][seen.things[2]] *= 0.7
    assert not seen.found().any()


def test_a_pixel_s_shift_is_no_other_thing():
    seen = room(SOMEBODY, (True,) * 5)
    seen.images[2] = seen.images[2].roll((1, 1), (1, 2))
    assert not seen.found().any()


def test_somebody_with_no_depth_is_still_left_out_and_the_rest_stays():
    """The sweep may have drawn his depth to the wall's: colour alone tells."""
    seen = room(SOMEBODY, only(2))
    seen.depths[:] = WALL
    found = seen.found()
    assert float(found[2][seen.things[2]].float().mean()) > 0.9 and not found[[0, 1, 3, 4]].any()


@pytest.mark.parametrize("bad", [math.nan, math.inf, -1.0, 0.0])
def test_depths_that_are_no_numbers_say_nothing(bad):
    seen = room(SOMEBODY, only(2))
    seen.depths[:, :8] = bad
    found = seen.found()
    assert found[2].any() and not found[[0, 1, 3, 4]].any()
    seen.depths[:] = bad
    assert not seen.found().any()


def test_photos_that_see_nothing_in_common_say_nothing():
    seen = room(SOMEBODY, only(2))
    seen.viewmats[:, 0, 3] = torch.arange(5) * 100.0
    assert not seen.found().any()


def test_a_picture_of_one_pixel():
    ones = torch.ones(4, 1, 1)
    cameras = torch.eye(4).repeat(4, 1, 1), torch.eye(3).repeat(4, 1, 1)
    assert not transient_masks(Rig(*cameras, ones, photos=ones[:, None].expand(4, 3, 1, 1))).any()


def test_what_is_foreseen_is_what_a_plain_loop_finds():
    """float64; the same points and no sums but of a few colours: 1e-12 is rounding."""
    seen = room(SOMEBODY, (True, False))
    image, depths, viewmat, K = (v[0].double() for v in (seen.images, seen.depths, seen.viewmats, seen.Ks))
    image, depths = image[:, :24, :32], depths[:24, :32]
    other, size = seen.viewmats[1].double(), torch.Size((12, 16))
    both = torch.stack((viewmat, other)), K.expand(2, 3, 3), depths.expand(2, -1, -1)
    rig = Rig(*both, photos=image.expand(2, -1, -1, -1))
    said = _Look.of(rig, 0).foreseen(_Look.of(rig, 1))
    points = transform(other @ invert_rigid(viewmat), unproject(depths, K).flatten(0, 1))
    cells: dict[tuple[int, int], list[tuple[float, int]]] = {}
    for number, ((x, y), z) in enumerate(
        zip(seen_at(points, K).tolist(), points[:, 2].tolist(), strict=True)
    ):
        row, column = math.floor(y / _CELL), math.floor(x / _CELL)
        if z > 0 and 0 <= row < size[0] and 0 <= column < size[1]:
            cells.setdefault((row, column), []).append((z, number))
    assert 0 < len(cells) < size.numel()
    for row in range(size[0]):
        for column in range(size[1]):
            some = cells.get((row, column))
            if some is None:
                assert math.isinf(said.depth[row, column])
                continue
            nearest = min(z for z, _ in some)
            front = [number for z, number in some if z < 1.1 * nearest]
            colour = image.flatten(1)[:, front].mean(1)
            assert math.isclose(said.depth[row, column], nearest, rel_tol=1e-12)
            assert torch.allclose(said.colour[:, row, column], colour, rtol=0, atol=1e-12)
