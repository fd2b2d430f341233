"""Which photos stand for the others."""

import pytest
import torch
from torch import Tensor

from langflash_core.geometry.vantage import from_the_middle, leading


def row(places: list[float], turns: list[float] | None = None) -> tuple[Tensor, Tensor]:
    """Depths of 1, and viewmats of cameras along x, turned about y by radians."""
    viewmats = torch.eye(4).repeat(len(places), 1, 1)
    for viewmat, place, turn in zip(viewmats, places, turns or [0.0] * len(places), strict=True):
        sine, cosine = torch.tensor(turn).sin(), torch.tensor(turn).cos()
        viewmat[0, 0], viewmat[0, 2], viewmat[2, 0], viewmat[2, 2] = cosine, -sine, sine, cosine
        viewmat[:3, 3] = -viewmat[:3, 0] * place
    return torch.ones(len(places), 3, 4), viewmats


def test_photos_come_from_the_middle_outwards():
    """Of five in a row, of five turned on one spot, and of two; what is as far comes as it does."""
    apart = row([4.0, 3.0, 0.0, 1.0, 2.0])
    assert from_the_middle(*apart) == [4, 1, 3, 0, 2]
    assert from_the_middle(*row([0.0] * 3, [0.4, 0.0, 0.2]))[0] == 2
    assert from_the_middle(apart[0][:2], apart[1][:2]) == [0, 1]


def test_the_middle_of_each_cluster_leads():
    assert leading(*row([c + 0.01 * k for c in (0.0, 1.0, 2.0) for k in range(5)])) == [2, 7, 12]


@pytest.mark.parametrize("count", [6, 9, 20, 60])
def test_as_many_lead_as_the_place_takes_however_many_photos_there_are(count: int):
    assert len(leading(*row(torch.linspace(0, 1, count).tolist()))) in (2, 3)


def test_photos_that_turn_on_one_spot_are_far_from_each_other():
    assert leading(*row([0.0] * 10, [0.0] * 5 + [1.0] * 5)) == [0, 5]


def test_two_lead_both_and_of_many_that_are_far_a_quarter():
    assert leading(*row([0.0])) == [0] and leading(*row([0.0, 0.0])) == [0, 1]
    assert leading(*row([0.0] * 3)) == leading(*row([0.0] * 9)) == [0]
    assert leading(*row([2.0 * x for x in range(8)])) == [*range(8)]
    assert len(leading(*row([float(x) for x in range(9)]))) == 3
    assert len(leading(*row([float(x) for x in range(32)]))) == 8


def test_what_is_no_number_ends():
    depths, viewmats = row([0.0] * 12)
    assert len(leading(depths * torch.nan, viewmats)) == 3
