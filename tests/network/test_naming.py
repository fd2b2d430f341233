"""Names from looks and places: what is measured of a part, and that hard scenes give finite atoms."""

import math

import pytest
import torch
from torch import Tensor
from torch.nn import functional as F

from langflash_core.geometry.cameras import unproject
from langflash_core.network import MINI
from langflash_core.network.encoders.shared import Tokens
from langflash_core.network.semantics.naming import PartNamer, describe, places, upright
from langflash_core.network.semantics.settings import PART_NAMING

SIDE = 64
KS = torch.tensor([[60.0, 0, SIDE / 2], [0, 60.0, SIDE / 2], [0, 0, 1]])[None]


def tilted_floor(degrees: float, height: float = 1.5) -> tuple[Tensor, Tensor]:
    """Depths (1, H, W) of a floor `height` below a camera pitched down by `degrees`, and up in its frame."""
    pitch = math.radians(degrees)
    up = torch.tensor([0.0, -math.cos(pitch), -math.sin(pitch)])
    rays = unproject(torch.ones(1, SIDE, SIDE), KS)
    fall = -(rays @ up)
    return torch.where(fall > 0.15, height / fall.clamp_min(1e-6), 0.0), up


@pytest.mark.parametrize("degrees", [0.0, 12.0, 35.0])
def test_up_is_found_from_the_floor(degrees):
    depths, up = tilted_floor(degrees)
    found = upright(unproject(depths, KS)[0], depths[0] > 0)
    # Normals of a plane are exact but for float32 differences of far points: .5 degrees.
    assert math.degrees(math.acos(min(1.0, float(found @ up)))) < 0.5


def test_up_is_the_cameras_own_where_nothing_is_level():
    wall = torch.full((1, SIDE, SIDE), 3.0)
    assert upright(unproject(wall, KS)[0], wall[0] > 0).tolist() == [0.0, -1.0, 0.0]
    assert upright(torch.zeros(SIDE, SIDE, 3), torch.zeros(SIDE, SIDE, dtype=torch.bool)).tolist() == [
        0,
        -1,
        0,
    ]


def test_places_are_metres_over_the_floor():
    depths, up = tilted_floor(20.0)
    axes = torch.stack((torch.tensor([1.0, 0, 0]), up, torch.linalg.cross(torch.tensor([1.0, 0, 0]), -up)))
    board = torch.zeros(1, SIDE, SIDE, dtype=torch.bool)
    board[:, 20:40, 24:44] = True  # an upright board 2 m ahead of the camera, across the room
    rays = unproject(torch.ones(1, SIDE, SIDE), KS) @ axes.T
    depths = torch.where(board, 2.0 / rays[..., 2], depths)
    weights = torch.stack((board, ~board), 1).float()
    found = places(weights, depths, torch.eye(4)[None], KS)
    points = (unproject(depths, KS) @ axes.T)[board]
    low, high = points.amin(0), points.amax(0)
    assert found.shape == (2, PART_NAMING.place)
    # 3 % are cut off on each side, so lengths lose about 6 %; heights shift by as much.
    assert float(found[0, 0].exp()) == pytest.approx(float(high[0] - low[0]), rel=0.1)
    assert float(found[0, 1].exp()) == pytest.approx(float(high[1] - low[1]), rel=0.1)
    assert float(found[0, 3]) == pytest.approx(float(low[1]) + 1.5, abs=0.05)
    assert float(found[0, 4]) == pytest.approx(float(high[1]) + 1.5, abs=0.05)
    assert float(found[0, 6]) == pytest.approx(2.0, abs=0.01)
    assert float(found[0, 7].exp()) == pytest.approx(400 / SIDE**2, rel=1e-4)
    assert float(found[0, 8]) == 0
    assert float(found[1, 3]) == pytest.approx(0, abs=0.03)
    assert float(found[1, 8]) > 0


def test_a_second_view_of_the_same_part_changes_nothing_but_its_share():
    depths, _ = tilted_floor(20.0)
    weights = torch.ones(1, 1, SIDE, SIDE)
    one = places(weights, depths, torch.eye(4)[None], KS)
    two = places(
        weights.repeat(2, 1, 1, 1), depths.repeat(2, 1, 1), torch.eye(4).repeat(2, 1, 1), KS.repeat(2, 1, 1)
    )
    torch.testing.assert_close(one, two, atol=1e-3, rtol=1e-3)  # quantiles between other neighbours


def test_pixels_of_nobody_count_for_nobody():
    depths, _ = tilted_floor(20.0)
    weights = torch.zeros(1, 2, SIDE, SIDE)
    weights[0, 0, 40:50, 20:30] = 1
    weights[0, 1, 50:60, 20:30] = 1
    found = places(weights, depths, torch.eye(4)[None], KS)
    assert float(found[0, 7].exp()) == pytest.approx(100 / SIDE**2, rel=1e-4)  # float32
    assert float(found[0, 8]) == 0


@pytest.mark.parametrize("bad", [0.0, math.nan, math.inf])
def test_unknown_depths_say_nothing(bad):
    weights = torch.rand(2, 3, SIDE, SIDE)
    found = places(
        weights, torch.full((2, SIDE, SIDE), bad), torch.eye(4).repeat(2, 1, 1), KS.repeat(2, 1, 1)
    )
    assert torch.equal(found, torch.zeros(3, PART_NAMING.place))
    assert places(
        weights[:, :0], torch.ones(2, SIDE, SIDE), torch.eye(4).repeat(2, 1, 1), KS.repeat(2, 1, 1)
    ).shape == (0, PART_NAMING.place)


def test_looks_are_means_of_the_parts_own_patches():
    hooks, named = (tuple(torch.randn(1, 2, 16, 384) for _ in range(count)) for count in (4, 2))
    tokens = Tokens(hooks, (4, 4), named)
    weights = torch.zeros(2, 2, 8, 8)
    weights[0, 0, :2, :2] = 1  # one patch
    weights[:, 1] = 1
    looks = describe(weights, tokens)
    first = torch.cat([hook[0, 0, 0] for hook in (*hooks[2:], *named)])
    every = torch.cat([hook[0].mean((0, 1)) for hook in (*hooks[2:], *named)])
    torch.testing.assert_close(looks[0], first, atol=1e-4, rtol=1e-4)  # eps 1e-6 of a weight of 1/1
    torch.testing.assert_close(looks[1], every, atol=1e-4, rtol=1e-4)


def test_a_new_namer_changes_nothing_and_parts_may_come_in_any_order():
    torch.manual_seed(0)
    namer = PartNamer(MINI)
    atoms = F.normalize(torch.randn(5, 384), dim=-1)
    looks, where = torch.randn(5, PART_NAMING.deep * 384), torch.randn(5, PART_NAMING.place)
    torch.testing.assert_close(namer(atoms, looks, where), atoms)
    torch.nn.init.normal_(namer.out.weight, std=0.02)
    order = torch.tensor([3, 0, 4, 1, 2])
    named = namer(atoms, looks, where)
    torch.testing.assert_close(
        namer(atoms[order], looks[order], where[order]), named[order], atol=1e-5, rtol=1e-5
    )
    torch.testing.assert_close(named.norm(dim=-1), torch.ones(5))
    assert namer(atoms[:0], looks[:0], where[:0]).shape == (0, 384)
