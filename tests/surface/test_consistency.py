"""Free space: what a photo sees through goes, and never both sides of a conflict."""

import itertools

import torch

from langflash_core.geometry.cameras import invert_rigid, transform, unproject
from langflash_core.rig.rig import Rig
from langflash_core.surface.consistency import outvoted_pixels, seen_through
from langflash_core.surface.settings import CONSISTENCY
from tests.geometry.twins import seen_at

K = torch.tensor([[30.0, 0, 16], [0, 30.0, 12], [0, 0, 1]])


def test_one_view_and_points_behind_are_left_alone():
    depths = torch.full((1, 24, 32), 2.0)
    assert not seen_through(Rig(torch.eye(4)[None], K[None], depths, torch.ones(1, 24, 32))).any()
    turned = torch.eye(4).repeat(2, 1, 1)
    turned[1, :3, :3] = torch.diag(torch.tensor([-1.0, 1.0, -1.0]))
    both = torch.full((2, 24, 32), 2.0)
    assert not seen_through(Rig(turned, K.expand(2, 3, 3), both, torch.ones(2, 24, 32))).any()


def test_numbers_that_are_not_finite_do_not_raise():
    depths = torch.full((2, 24, 32), 2.0)
    depths[1] = torch.nan
    viewmats = torch.eye(4).repeat(2, 1, 1)
    assert not seen_through(Rig(viewmats, K.expand(2, 3, 3), depths, torch.ones(2, 24, 32))).any()


def test_several_views_equal_their_twin():
    """Against every point in every view by the plain functions; in float64 none changes sides."""
    torch.manual_seed(0)
    viewmats = torch.eye(4, dtype=torch.float64).repeat(4, 1, 1)
    viewmats[1:, :3, 3] = torch.randn(3, 3, dtype=torch.float64) * 0.3
    Ks = K.double().expand(4, 3, 3)
    depths = torch.rand(4, 24, 32, dtype=torch.float64) * 3 + 0.5
    confidences = torch.randint(0, 3, (4, 24, 32)).double() / 2
    points = unproject(depths, Ks).flatten(1, 2)
    means = [transform(invert_rigid(m), p) for m, p in zip(viewmats, points, strict=True)]
    expected = torch.zeros(4, 24 * 32, dtype=torch.bool)
    for view, other in itertools.permutations(range(4), 2):
        pos_c = transform(viewmats[other], means[view])
        for i, ((x, y), z) in enumerate(
            zip(seen_at(pos_c, Ks[other]).tolist(), pos_c[:, 2].tolist(), strict=True)
        ):
            if z <= 0 or not (0 <= x < 32 and 0 <= y < 24):
                continue
            theirs, own = confidences[other, int(y), int(x)], confidences[view].flatten()[i]
            outvoted = theirs > own or (theirs == own and other < view)
            expected[view, i] |= bool(
                z < (1 - CONSISTENCY.tolerance) * depths[other, int(y), int(x)] and outvoted
            )
    blocked = seen_through(Rig(viewmats, Ks, depths, confidences))
    assert expected.any() and torch.equal(blocked.flatten(1), expected)


def _three_views(depths: torch.Tensor) -> torch.Tensor:
    """`outvoted_pixels` of three cameras side by side with these depths (3, 24, 32)."""
    viewmats = torch.eye(4).repeat(3, 1, 1)
    viewmats[1, 0, 3], viewmats[2, 0, 3] = -0.2, 0.2
    return outvoted_pixels(Rig(viewmats, K.expand(3, 3, 3), depths))


def test_a_skirt_that_two_others_see_through_goes():
    depths = torch.full((3, 24, 32), 2.0)
    depths[0, :, 15:17] = 1.5  # between a thing and the wall: nobody else has it
    found = _three_views(depths)
    assert found[0, 4:20, 15:17].all()
    found[0, :, 15:17] = False
    assert not found.any()


def test_a_thing_that_another_photo_has_as_well_stays():
    depths = torch.full((3, 24, 32), 2.0)
    depths[0, :, 12:20] = 1.5
    shift = 0.2 * 30 / 1.5  # pixels, of what stands at 1.5
    depths[1, :, 12 - int(shift) : 20 - int(shift)] = 1.5
    assert not _three_views(depths)[0].any()


def test_far_from_jumps_nothing_is_outvoted():
    """Two photos that have a near thing too far do not vote down the one that has it right."""
    depths = torch.full((3, 24, 32), 2.0)
    depths[0] = 1.5
    assert not _three_views(depths).any()


def test_two_photos_cannot_outvote():
    depths = torch.full((2, 24, 32), 2.0)
    depths[0, :, 15:17] = 1.5
    assert not outvoted_pixels(Rig(torch.eye(4).repeat(2, 1, 1), K.expand(2, 3, 3), depths)).any()
