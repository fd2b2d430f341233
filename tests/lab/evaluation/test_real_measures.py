"""How much of a photo a picture shows: the photo, its negative, fog, other light."""

import math

import numpy as np
import pytest
import torch

from langflash_core.errors import InputError
from langflash_core.lab.evaluation.sharp_measures import fog, in_its_light, likeness, structure


@pytest.fixture
def photo() -> torch.Tensor:
    """(40, 60, 3), bands and noise."""
    torch.manual_seed(3)
    bands = 0.4 + 0.2 * torch.sin(torch.arange(60.0) / 3)
    return (bands[None, :, None] + 0.05 * torch.randn(40, 60, 3)).clamp(0, 1)


def test_the_photo_itself_is_whole(photo):
    found = likeness(photo, photo)
    assert found["structure"] == pytest.approx(1, abs=1e-9) and found["fog"] == 0 and found["psnr"] > 90


def test_structure_is_the_correlation_of_differences(photo):
    drawn = photo.flip(0)
    grey = [p.double().numpy() @ np.array([0.299, 0.587, 0.114]) for p in (drawn, photo)]
    ours, theirs = (np.diff(g, axis=1).ravel() for g in grey)
    assert structure(drawn, photo) == pytest.approx(np.corrcoef(ours, theirs)[0, 1], abs=1e-5)  # float32 grey
    assert structure(1 - photo, photo) == pytest.approx(-1, abs=1e-6)


def test_another_light_costs_nothing(photo):
    darker = 0.4 * photo * torch.tensor([1, 0.8, 0.6]) + 0.1
    assert torch.allclose(in_its_light(darker, photo), photo, atol=1e-5)
    found = likeness(darker, photo)
    assert found["fog"] == 0 and found["structure"] > 0.99


def test_a_flat_wall_is_no_fog():
    wall = torch.full((20, 20, 3), 0.5)
    assert math.isnan(fog(wall, wall)) and math.isnan(structure(wall, wall))


def test_fog_against_numpy(photo):
    drawn = 0.5 + 0.24 * (photo - 0.5)
    drawn[:20] = photo[:20]
    grey = [p.double().numpy() @ np.array([0.299, 0.587, 0.114]) for p in (drawn, photo)]
    made, truth = (np.lib.stride_tricks.sliding_window_view(g, (7, 7)).reshape(-1, 49).std(1) for g in grey)
    counted = truth >= 4 / 255
    assert fog(drawn, photo) == pytest.approx((made < truth / 4)[counted].mean(), abs=2e-3)  # float32 at .25


def test_pictures_of_two_sizes_and_no_numbers_are_refused(photo, unchecked):
    with pytest.raises(InputError, match="size"):
        structure(photo[:, :-1], photo)
    with pytest.raises(InputError, match="finite"):
        fog(photo * torch.nan, photo)
