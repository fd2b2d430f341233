"""Neighbours of a photo: those that see the same from another side, those that see its points, all."""

import math

import torch
from torch import Tensor

from langflash_core.geometry.cameras import intrinsics_from_fov, rays
from langflash_core.rig.neighbours import Neighbours, everyone, neighbours, source_views
from langflash_core.rig.rig import Rig
from langflash_core.rig.settings import CHOICE

WIDTH, HEIGHT, WALL = 84, 63, 3.0


def sources_of(logs: Tensor, viewmats: Tensor, Ks: Tensor, count: int = CHOICE.sources) -> Neighbours:
    return source_views(Rig.of_logs(logs, viewmats, Ks), "angle", count)


def ring(degrees: list[float]) -> tuple[Tensor, Tensor, Tensor]:
    """Log depths, viewmats and Ks of cameras on a ring around a point of a wall at z = 3, that look at it."""
    K = intrinsics_from_fov(60, WIDTH, HEIGHT)
    logs, viewmats = [], []
    for angle in torch.tensor(degrees).deg2rad():
        turn = torch.tensor(
            [[angle.cos(), 0, -angle.sin()], [0, 1, 0], [angle.sin(), 0, angle.cos()]]
        )  # world to camera
        middle = torch.tensor([0.0, 0.0, WALL])
        eye = middle - WALL * turn[2]
        viewmat = torch.eye(4)
        viewmat[:3, :3], viewmat[:3, 3] = turn, -turn @ eye
        slope = rays(K, WIDTH, HEIGHT) @ turn[:, 2]
        logs.append(((WALL - eye[2]) / slope).log())
        viewmats.append(viewmat)
    return torch.stack(logs), torch.stack(viewmats), K.expand(len(degrees), 3, 3)


def test_two_views_have_each_other_whatever_they_see():
    logs, viewmats, Ks = ring([0.0, 0.0])
    assert [list(of) for of in sources_of(logs, viewmats, Ks)] == [[1], [0]]


def test_the_nearest_photo_is_not_the_best_source():
    """One degree away depth moves nothing; a photo from ten degrees is worth more."""
    near = sources_of(*ring([0.0, 1.0, 10.0]), count=1)
    assert list(near[0]) == [2]


def test_a_photo_from_the_other_side_of_the_room_is_none():
    logs, viewmats, Ks = ring([0.0, 10.0, 10.0])
    flipped = viewmats.clone()
    flipped[2, :3, :3] = torch.diag(torch.tensor([-1.0, 1.0, -1.0]))  # looks away from the wall
    flipped[2, :3, 3] = 0
    assert list(sources_of(logs, flipped, Ks)[0]) == [1]


def test_source_views_lie_on_both_sides():
    """Six photos to the right and one to the left: the left is chosen before the right ones run out."""
    near = sources_of(*ring([0.0, 9.0, 10.0, 11.0, 12.0, 13.0, -10.0]), count=2)
    logs, viewmats, Ks = ring([0.0, 9.0, 10.0, 11.0, 12.0, 13.0, -10.0])
    assert len(near[0]) == 2 and 0 not in near[0]
    assert all(len(of) <= CHOICE.sources and len(set(of)) == len(of) for of in sources_of(logs, viewmats, Ks))


def test_source_views_do_not_stand_together():
    """Four almost in one place and one beside them that is worth less: the second is not of the four."""
    logs, viewmats, Ks = ring([0.0, 9.0, 9.2, 9.4, 9.6, 16.0])
    near = sources_of(logs, viewmats, Ks, count=2)[0]
    assert near[0] in (1, 2, 3, 4) and near[1] == 5


def test_one_surface_before_another_is_not_the_same():
    """A photo whose map has something else at the place is no source view for it."""
    logs, viewmats, Ks = ring([0.0, 10.0, 12.0])
    logs[2] -= math.log(2)  # it sees something at half the distance
    assert list(sources_of(logs, viewmats, Ks)[0]) == [1]


def test_photos_from_one_place_say_nothing():
    logs, viewmats, Ks = ring([0.0, 0.0, 0.0])
    assert sources_of(logs, viewmats, Ks) == [[], [], []]


def test_what_is_no_number_chooses_nobody_wrong():
    logs, viewmats, Ks = ring([0.0, 8.0, 10.0])
    logs[1] = torch.nan
    near = sources_of(logs, viewmats, Ks)
    assert list(near[0]) == [2] and list(near[1]) == []


def test_by_sight_those_are_asked_that_have_the_points_before_them():
    """All of few; of more than are asked those alone that see some of the wall, evenly over all of them."""
    logs, viewmats, Ks = ring([0.0, 2.0, 4.0, 6.0, 8.0])
    viewmats[3, :3, :3] = torch.diag(torch.tensor([-1.0, 1.0, -1.0])) @ viewmats[3, :3, :3]
    rig = Rig.of_logs(logs, viewmats, Ks)
    assert neighbours(rig, 0, "sight") == [1, 2, 3, 4]
    assert neighbours(rig, 0, "sight", 3) == [1, 2, 4]
    assert neighbours(rig, 0, "sight", 1) == [2]
    assert neighbours(rig, 2, "all") == list(everyone(5)[2]) == [0, 1, 3, 4]
