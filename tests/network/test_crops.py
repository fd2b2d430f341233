"""Atoms from cut-outs: where the boxes lie, which photo is cut, what the tower is shown."""

import torch

from langflash_core.network.semantics.crops import crop_atoms, group_box
from langflash_core.network.semantics.settings import CROPS


def test_a_box_holds_its_group_with_a_margin_and_stays_square():
    weights = torch.zeros(100, 200)
    weights[40:60, 90:130] = 1
    weights[0, 0] = 5  # a stray pixel
    left, top, right, bottom = group_box(weights)
    width, height = (right - left) * 200, (bottom - top) * 100
    # 40 pixels wide; 2 % tails cut at most one column on each side, the margin adds 20 %.
    assert abs(width - height) < 1e-6 and 44 < width < 50
    assert abs((left + right) / 2 * 200 - 110) < 2 and abs((top + bottom) / 2 * 100 - 50) < 2


def test_boxes_stay_in_the_picture_and_never_vanish():
    corner = torch.zeros(64, 64)
    corner[0, 0] = 1
    left, top, right, bottom = group_box(corner)
    assert 0 == left == top < right <= 1 and bottom == right
    assert group_box(torch.zeros(64, 64))[2] == 1.0


def test_each_group_is_shown_from_the_photo_that_has_most_of_it():
    photos = [torch.zeros(3, 96, 96), torch.zeros(3, 48, 48)]  # of any size
    photos[0][0], photos[1][1] = 1, 1  # red, green
    weights = torch.zeros(2, 2, 48, 48)
    weights[0, 0, :20, :20] = 1
    weights[1, 0, :4, :4] = 1
    weights[1, 1, 20:, 20:] = 1
    shown = []

    def embed(pictures):
        shown.append(pictures)
        return pictures.mean((2, 3)) * 7

    atoms = crop_atoms(weights, photos, embed)
    assert shown[0].shape == (2, 3, CROPS.side, CROPS.side)
    torch.testing.assert_close(atoms, torch.tensor([[1.0, 0, 0], [0, 1, 0]]))
    assert crop_atoms(torch.zeros(2, 0, 8, 8), photos, embed).shape == (0, 3)
