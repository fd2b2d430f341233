"""Weights end at the photo's borders, stay shares of one, and agree with their slow twin."""

import numpy as np
import pytest
import torch
from torch import Tensor
from torch.nn import functional as F

from langflash_core.surface.borders import BorderRule, refined_weights
from tests.surface.borders_reference import picture, plain_read, plain_smoothed


def blobs(groups: int, height: int, width: int, seed: int = 5) -> Tensor:
    """Weights (groups, height, width) of nobody's making."""
    drawn = torch.randn(groups, height, width, generator=torch.Generator().manual_seed(seed))
    return (2 * drawn).softmax(0)


def whole(weights: Tensor) -> bool:
    """Shares of one along dim 0."""
    return bool((weights >= 0).all()) and bool(torch.allclose(weights.sum(0), torch.ones(()), atol=1e-5))


@pytest.mark.parametrize("size", [(20, 27), (1, 9), (9, 1), (1, 1), (2, 2)])
def test_it_agrees_with_dense_systems_read_pixel_by_pixel(size):
    """Float32 against float64. All sums are of numbers >= 0, so errors do not grow with lambda: a few
    roundings of 6e-8 each; 3e-7 was seen at 252 x 196."""
    height, width = size
    photo = picture(2 * height, 3 * width)
    image = F.interpolate(photo[None], size, mode="area")[0]
    weights = blobs(5, *size)
    refined = refined_weights(weights, image, photo)
    expected = plain_smoothed(weights.numpy(), image.numpy(), refined.rule).transpose(1, 2, 0)
    assert np.allclose(refined.grid.numpy(), expected, atol=1e-6)
    dense = refined.dense()
    for row in range(0, 2 * height, 3):
        for column in range(0, 3 * width, 5):
            read = plain_read(expected, image, photo, row, column, refined.rule.colour)
            assert np.allclose(dense[:, row, column].numpy(), read, atol=5e-6)


def test_a_blob_goes_to_the_edge_that_it_missed():
    """The group's border lies 4 pixels from the colours'; read at the photo's size it lies on them."""
    photo = torch.full((3, 96, 120), 0.2)
    photo[:, :, 63:] = 0.7
    image = F.interpolate(photo[None], (32, 40), mode="area")[0]
    side = torch.sigmoid((torch.arange(40) - 24.5) / 2).expand(32, 40)
    dense = refined_weights(torch.stack((1 - side, side)), image, photo).dense()
    assert (dense[0, :, :63] > 0.5).all() and (dense[1, :, 63:] > 0.5).all()


def test_weights_stay_shares_of_one():
    photo = picture(60, 90)
    image = F.interpolate(photo[None], (20, 30), mode="area")[0]
    refined = refined_weights(blobs(45, 20, 30), image, photo)
    assert whole(refined.dense())
    rows, columns = torch.tensor([0, 59, 30, 30]), torch.tensor([0, 89, 10, 10])
    assert torch.equal(refined.at(rows, columns), refined.dense()[:, rows, columns].T)
    assert refined.at(rows[:0], columns[:0]).shape == (0, 45)


@pytest.mark.parametrize("groups", [0, 1])
def test_none_and_one(groups):
    photo = picture(20, 30)
    refined = refined_weights(torch.ones(groups, 10, 15), photo[:, ::2, ::2], photo)
    assert refined.dense().shape == (groups, 20, 30)
    assert torch.allclose(refined.dense(), torch.ones(groups, 20, 30), atol=1e-6)


def test_a_photo_of_the_grids_own_size_is_read_as_it_is():
    photo = picture(20, 30)
    refined = refined_weights(blobs(4, 20, 30), photo, photo)
    assert torch.allclose(refined.dense(), refined.grid.permute(2, 0, 1), atol=1e-6)


def test_a_photo_smaller_than_the_grid_is_read_where_it_lies():
    photo = picture(20, 30)
    small = F.interpolate(photo[None], (7, 9), mode="area")[0]
    assert whole(refined_weights(blobs(4, 20, 30), photo, small).dense())


def test_a_photo_of_one_colour_has_no_edges_to_stop_at():
    """Weights become one mean, nearly, whatever the colour: nothing is divided by the contrast."""
    photo = torch.full((3, 20, 30), 0.4)
    weights = blobs(3, 10, 15)
    dense = refined_weights(weights, photo[:, ::2, ::2], photo, BorderRule(sharpness=1.0)).dense()
    assert whole(dense)
    assert torch.allclose(dense, weights.mean((1, 2))[:, None, None].expand_as(dense), atol=0.05)


def test_numbers_that_are_none_do_not_spread():
    weights, photo = blobs(3, 10, 15), picture(20, 30)
    weights[:, 2, 3] = torch.nan
    weights[0, 5, 5] = torch.inf
    weights[:, 7, 7] = 0.0
    photo[:, 4, 4] = torch.nan
    image = photo[:, ::2, ::2].clone()
    assert whole(refined_weights(weights, image, photo).dense())


def test_sharp_answers_do_not_depend_on_who_is_named_first():
    weights, photo = blobs(6, 10, 15), picture(20, 30)
    order = torch.tensor([3, 1, 5, 0, 2, 4])
    forth = refined_weights(weights, photo[:, ::2, ::2], photo).dense()
    back = refined_weights(weights[order], photo[:, ::2, ::2], photo).dense()
    assert torch.allclose(forth[order], back, atol=1e-6)
