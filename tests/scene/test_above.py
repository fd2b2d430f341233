"""Scenes from above."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from langflash_core.base.records import World
from langflash_core.geometry import rotations
from langflash_core.scene.above import drawn_from_above, seen_from_above
from langflash_core.scene.world import transform_scene
from langflash_core.types import Scene
from tests.app.window.scenes import room


def walked(count: int = 5) -> Scene:
    """The room of a wall, a floor and a red block, from a row of cameras to the right."""
    scene = room(torch.eye(3))
    viewmats = torch.eye(4).repeat(count, 1, 1)
    viewmats[:, 0, 3] = -0.2 * torch.arange(count)
    return replace(scene, viewmats=viewmats, Ks=scene.Ks[:1].repeat(count, 1, 1), photos=())


def test_the_map_of_level_cameras_is_as_by_hand() -> None:
    above = seen_from_above(walked())
    assert np.allclose(above.axes, np.eye(3))
    assert np.allclose(above.ways, (0, -1))  # ahead is up on the map
    assert np.allclose(np.diff(above.eyes[:, 0]) * above.size[0], 0.2)
    assert np.allclose(above.eyes[:, 1], above.eyes[0, 1])
    block, wall = above.places(np.array([(-0.15, 0.1, 0.85), (0.0, 0.0, 1.3)]))
    assert wall[1] < block[1] < above.eyes[0, 1]
    assert ((above.eyes > 0) & (above.eyes < 1)).all()


def test_a_scene_that_is_turned_has_the_same_map() -> None:
    """The frame of a scene does not matter where its cameras are level, or where a world says what is up."""
    scene = walked()
    turn = rotations.matrix((0.8, 0.2, 0.4, np.sqrt(1 - 0.84)))
    turned = transform_scene(scene, turn, np.array([1.0, 2.0, 3.0]), 2.0)
    first, second = seen_from_above(scene), seen_from_above(turned)
    assert np.allclose(first.eyes, second.eyes, atol=1e-5) and np.allclose(first.ways, second.ways, atol=1e-5)
    rolled = transform_scene(scene, rotations.matrix((np.cos(0.3), 0.0, 0.0, np.sin(0.3))), np.zeros(3), 1.0)
    world = World((np.cos(0.3), 0.0, 0.0, -np.sin(0.3)), (0.0, 0.0, 0.0))
    third = seen_from_above(rolled.with_record(world=world))
    assert np.allclose(first.eyes, third.eyes, atol=1e-5)


@pytest.mark.parametrize("way", [(0.0, 1.0, 0.0), (0.0, -1.0, 0.0)])
def test_a_photo_straight_down_or_up_has_no_way_and_hurts_nothing(way) -> None:
    scene = walked(1)
    viewmat = torch.eye(4)
    viewmat[:3, :3] = torch.tensor([(1.0, 0, 0), (0, 0, -way[1]), way])
    above = seen_from_above(
        replace(scene, viewmats=viewmat[None]).with_record(world=World((1.0, 0, 0, 0), (0, 0, 0)))
    )
    assert np.allclose(above.ways, 0)


def test_things_have_their_colours_and_what_is_above_the_eyes_is_left_out() -> None:
    scene = walked()
    above = seen_from_above(scene)
    drawn = drawn_from_above(scene, above)
    assert max(drawn.shape[:2]) == 256 and drawn.dtype == np.uint8

    def at(point: tuple[float, float, float], picture: np.ndarray) -> np.ndarray:
        (x, y) = above.places(np.array([point]))[0] * picture.shape[1::-1]
        return picture[int(y), int(x)].astype(int)

    red, brown = at((-0.15, 0.1, 0.65), drawn), at((0.9, 0.4, 0.7), drawn)
    assert red[0] > 1.5 * red[1] and brown[0] < 1.5 * brown[1] and brown.max() > 60
    ceiling = replace(scene.gaussians, means=scene.gaussians.means * torch.tensor([1.0, -1.0, 1.0]))
    shut = replace(scene, gaussians=ceiling)
    assert at((0.9, 0.4, 0.7), drawn_from_above(shut, above)).max() < 30  # the floor is a ceiling now


def test_nothing_and_one_make_a_map() -> None:
    scene = walked(1)
    for some in (scene.rows(torch.arange(0)), scene.rows(torch.arange(1))):
        above = seen_from_above(some)
        assert np.isfinite(above.eyes).all()
        assert drawn_from_above(some, above).shape[2] == 3
