"""Squares of a photo: each wanted pixel once, fine where the photo has detail, as many as were asked for."""

from dataclasses import dataclass

import numpy as np
import pytest
import torch
from torch import Tensor

from langflash_core.surface.blocks import LARGEST, LEVELS, Squares, Tree, grow_tree, leaves, threshold
from langflash_core.surface.clearance import clearances
from langflash_core.surface.settings import UPSAMPLING

EVERYTHING = -1.0  # a threshold below all gains
LEAST = 4e-5  # gain below which nobody parts anything


def noise(height: int, width: int, seed: int = 0) -> Tensor:
    """A photo with detail in some places only."""
    generator = torch.Generator().manual_seed(seed)
    patches = torch.rand(1, height, width, generator=generator)
    strength = (torch.arange(width) / width) ** 3
    return (0.5 + strength * (patches - 0.5)).expand(3, height, width).contiguous()


def all_wanted(photo: Tensor) -> Tensor:
    return torch.ones(photo.shape[-2:], dtype=torch.bool)


def flat(photo: Tensor) -> Tensor:
    return torch.zeros(photo.shape[-2:])


def endless(photo: Tensor) -> Tensor:
    """Surfaces without an end."""
    return torch.full(photo.shape[-2:], torch.inf)


def covered(found: list[Squares], size: tuple[int, int]) -> Tensor:
    """(h, w): how many squares lie on each pixel."""
    counts = torch.zeros(size, dtype=torch.int64)
    for squares in found:
        for left, top in zip(squares.left.tolist(), squares.top.tolist(), strict=True):
            counts[top : top + squares.side, left : left + squares.side] += 1
    return counts


def count(found: list[Squares]) -> int:
    return sum(len(squares) for squares in found)


def counted(tree: Tree, limit: float) -> int:
    """Leaves, and those beneath, of torn squares two."""
    found, beneath = leaves(tree, limit)
    return count(found) + len(beneath) + int(tree.torn[beneath.top // 4, beneath.left // 4].sum())


def masks(height: int, width: int, seed: int) -> Tensor:
    """A half-plane with holes."""
    generator = torch.Generator().manual_seed(seed)
    slope = torch.randn(2, generator=generator)
    side = slope[0] * torch.arange(height)[:, None] + slope[1] * torch.arange(width)
    return (side > side.median()) & (torch.rand(height, width, generator=generator) > 0.02)


@pytest.mark.parametrize("size", [(48, 64), (47, 61), (5, 70), (16, 16), (17, 3), (1, 1), (33, 1)])
@pytest.mark.parametrize("limit", [EVERYTHING, LEAST, 0.02, torch.inf])
def test_the_squares_tile_the_photo(size, limit):
    photo = noise(*size)
    found, _ = leaves(grow_tree(photo, flat(photo), endless(photo), all_wanted(photo)), limit)
    assert [squares.side for squares in found] == [1, 2, 4, 8, 16]
    assert torch.equal(covered(found, size), torch.ones(size, dtype=torch.int64))
    for squares in found:  # each on the grid of its own size
        assert not (squares.left % squares.side).any() and not (squares.top % squares.side).any()


def test_nobody_wants_anything():
    photo = noise(40, 40)
    tree = grow_tree(photo, flat(photo), endless(photo), torch.zeros(40, 40, dtype=torch.bool))
    found, beneath = leaves(tree, EVERYTHING)
    assert count(found) == 0 and len(beneath) == 0
    assert threshold([tree], 100, LEAST) == LEAST


def test_the_budget_is_kept_and_more_buys_more():
    """A parting adds three or four, so up to three are left over, and squares that are parted for the
    sake of one inside gain the same, up to `LEVELS` of them: all or none."""
    trees = [
        grow_tree(photo, flat(photo), endless(photo), all_wanted(photo))
        for photo in (noise(64, 64, 1), noise(64, 64, 2))
    ]
    everything = 2 * (64 * 64 + 16 * 16)
    before = 0
    for budget in (0, 31, 32, 40, 100, 1000, 3333, everything, 10 * everything):
        limit = threshold(trees, budget, LEAST)
        made = sum(counted(tree, limit) for tree in trees)
        assert made <= max(budget, 32) and made >= before
        if budget <= 3333:
            assert made >= budget - 3 - 4 * (LEVELS - 1)
        before = made
    assert before > 0.7 * everything


def test_partings_that_must_be_come_out_of_the_budget_and_on_top_where_it_is_too_small():
    photo = noise(64, 64)
    depths = torch.zeros(64, 64)
    depths[:, 33:] = 1
    tree = grow_tree(photo, depths, endless(photo), all_wanted(photo))
    forced = counted(tree, torch.inf)
    # Along the edge four squares of each size from 16 on: 4 of 16, 8 of 8, 16 of 4, 32 of 2 are parted,
    # and 16 lie beneath, each of two surfaces.
    assert forced == 16 + 3 * (4 + 8 + 16 + 32) + 2 * 16
    for budget in (16, forced, forced + 300):
        made = counted(tree, threshold([tree], budget, LEAST))
        assert max(budget, forced) - 3 - 4 * (LEVELS - 1) <= made <= max(budget, forced)


@pytest.mark.parametrize("limit", [LEAST, 0.05, torch.inf])
def test_beneath_are_those_of_four_that_were_parted(limit):
    photo = noise(45, 61)
    found, beneath = leaves(grow_tree(photo, flat(photo), endless(photo), all_wanted(photo)), limit)
    assert torch.equal(covered(found[:2], (45, 61)), covered([beneath], (45, 61)))


@dataclass(frozen=True)
class Plain:
    """The tree as recursion over squares (left, top, side) of padded arrays, float64. size: of the photo."""

    photo: np.ndarray
    depths: np.ndarray
    clear: np.ndarray
    wanted: np.ndarray
    finest: int

    @staticmethod
    def of(photo: Tensor, depths: Tensor, clear: Tensor, wanted: Tensor, finest: int) -> "Plain":
        around = [(0, -side % LARGEST) for side in wanted.shape]
        return Plain(
            np.pad(photo.double().numpy(), [(0, 0), *around], mode="edge"),
            np.pad(depths.double().numpy(), around, mode="edge"),
            np.pad(clear.double().numpy(), around, mode="edge"),
            np.pad(wanted.numpy(), around),
            finest,
        )

    def error(self, left: int, top: int, side: int) -> float:
        inside = self.photo[:, top : top + side, left : left + side]
        return float(((inside - inside.mean((1, 2), keepdims=True)) ** 2).sum())

    def must(self, left: int, top: int, side: int) -> bool:
        depths = self.depths[top : top + side, left : left + side]
        if any((np.abs(np.diff(depths, axis=axis)) > UPSAMPLING.jump).any() for axis in (0, 1)):
            return True
        if self.clear[top : top + side, left : left + side].min() < (1.2 if side >= 4 else 0.5) * side:
            return True
        corners = depths[[0, 0, -1, -1], [0, -1, 0, -1]].mean()
        if side > 2 and abs(corners - depths[side // 2, side // 2]) > 0.01:
            return True
        return side > 4 and not self.wanted[top : top + side, left : left + side].all()

    def gain(self, left: int, top: int, side: int) -> float:
        if side <= self.finest or not self.wanted[top : top + side, left : left + side].any():
            return 0.0
        if self.must(left, top, side):
            return np.inf
        children = quarters(left, top, side)
        own = self.error(left, top, side) - sum(self.error(*child) for child in children)
        return max(own / 3, *(self.gain(*child) for child in children))

    def leaves(self, left: int, top: int, side: int, limit: float) -> list[tuple[int, int, int]]:
        if not self.wanted[top : top + side, left : left + side].any():
            return []
        gain = self.gain(left, top, side)
        if not (gain > limit or gain == np.inf):
            return [(left, top, side)]
        return [leaf for child in quarters(left, top, side) for leaf in self.leaves(*child, limit)]


def quarters(left: int, top: int, side: int) -> list[tuple[int, int, int]]:
    half = side // 2
    return [(left + x, top + y, half) for y in (0, half) for x in (0, half)]


@pytest.mark.parametrize("ends", [True, False])
@pytest.mark.parametrize("finest", [1, 2, 4])
@pytest.mark.parametrize("limit", [0.002, 0.02, np.inf])
def test_the_tree_agrees_with_recursion(finest, limit, ends):
    """Errors of float32 are within 1e-4 (sums of 768 numbers below 1); no gain is as near to the limits."""
    size = (30, 43)
    photo, wanted = noise(*size, 3), masks(*size, 5)
    rows = torch.arange(30.0)[:, None]
    depths = torch.where(torch.arange(43) > 27, 0.5, 0.002 * rows**1.5 + 0.5 * (rows > 20))
    clear = clearances(depths) if ends else endless(photo)
    found, _ = leaves(grow_tree(photo, depths, clear, wanted, finest), float(limit))
    plain = Plain.of(photo, depths, clear, wanted, finest)
    expected = [
        leaf
        for top in range(0, 32, LARGEST)
        for left in range(0, 48, LARGEST)
        for leaf in plain.leaves(left, top, LARGEST, limit)
        if leaf[0] < 43 and leaf[1] < 30
    ]
    made = [
        (left, top, squares.side)
        for squares in found
        for left, top in zip(squares.left.tolist(), squares.top.tolist(), strict=True)
    ]
    assert sorted(made) == sorted(expected)
    assert len({side for _, _, side in made}) >= 2
