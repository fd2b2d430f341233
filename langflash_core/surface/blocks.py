"""Which squares of a photo become one element each: a quadtree, fine where the photo has detail.

A square is parted in four where that brings the photo's colours nearer by enough, where depth jumps
inside it, and where its middle is off the plane of its corners; so flat walls are covered by few elements
and edges by one a pixel. What all photos may spend together is shared out by what a parting gains: the
largest gains first.

Sizes: h w pixels of the photo, padded to multiples of `LARGEST`; level l has squares of 2^l pixels.

Source: own; pruned trees by marginal gain as in Chou, Lookabaugh, Gray 1989 (BFOS), one step a node.
"""

from dataclasses import dataclass

import torch
from jaxtyping import Bool, Float, Int, Shaped
from torch import Tensor
from torch.nn import functional as F

from langflash_core.surface.settings import BLOCKS, UPSAMPLING

LEVELS = 4
LARGEST = 2**LEVELS
"""Pixels, side of the largest squares."""
_COSTS = (3, 4, *[3] * (LEVELS - 2))
"""Leaves that a parting adds, by level from the finest: one more goes beneath a square of 4 x 4 pixels, and
another where it is torn."""


@dataclass(frozen=True)
class Tree:
    """gains: of parting each square of level l, at place l - 1, (rows, columns), and of its largest child
    where that is larger; endless where it must be parted, 0 where nobody needs it. wanted: (rows, columns)
    bool of level l at place l: somebody needs the square. torn: squares of 4 x 4 pixels that show two
    surfaces, each of which goes on beneath (`elements.ground`)."""

    gains: tuple[Float[Tensor, "_ _"], ...]
    wanted: tuple[Bool[Tensor, "_ _"], ...]
    torn: Bool[Tensor, "_ _"]
    size: tuple[int, int]


@dataclass(frozen=True)
class Squares:
    """n squares of one size: their left and top edges, pixels; how long their sides are."""

    left: Int[Tensor, " n"]
    top: Int[Tensor, " n"]
    side: int

    def __len__(self) -> int:
        return len(self.left)


def grow_tree(
    photo: Float[Tensor, "3 h w"],
    log_depths: Float[Tensor, "h w"],
    clear: Float[Tensor, "h w"],
    wanted: Bool[Tensor, "h w"],
    finest: int = 1,
) -> Tree:
    """The whole tree of one photo.

    Args:
        photo: (3, h, w) in [0, 1]. log_depths: (h, w). clear: (h, w) of `clearances`. wanted: (h, w) bool,
            what is to be covered.
        finest: pixels, side of the smallest squares, a power of two.
    """
    size = (photo.shape[-2], photo.shape[-1])
    colours, depths = pad_to_blocks(photo), pad_to_blocks(log_depths[None])[0]
    needed = pad_to_blocks(wanted[None].float())[0]
    needed[size[0] :], needed[:, size[1] :] = 0, 0
    jumps = (depths.diff(dim=1).abs() > UPSAMPLING.jump, depths.diff(dim=0).abs() > UPSAMPLING.jump)
    near = -pad_to_blocks(clear.clamp(max=4 * LARGEST)[None])
    squares, errors = colours.square().sum(0), torch.zeros_like(depths)
    gains: list[Tensor] = []
    wanteds = [needed > 0]
    for level in range(1, LEVELS + 1):
        side = 2**level
        colours, squares, needed = _fours(colours), _fours(squares[None])[0], _fours(needed[None])[0]
        finer, errors = errors, (squares - colours.square().sum(0) / side**2).clamp_min(0)
        gain = (errors - _fours(finer[None])[0]) / 3
        near = F.max_pool2d(near[None], 2)[0]
        must = (
            (-near[0] < BLOCKS.clear[side >= 4] * side)
            | _jumping(jumps, level)
            | (_is_bent(depths, side) if level > 1 else gain < 0)
        )
        if side > 4:
            must |= (needed > 0) & (needed < side**2)
        gain = torch.where(must, torch.inf, gain)
        if gains:
            gain = torch.maximum(gain, F.max_pool2d(gains[-1][None], 2)[0])
        if side <= finest:
            gain = torch.zeros_like(gain)
        gains.append(torch.where(needed > 0, gain, 0.0))
        wanteds.append(needed > 0)
    span = F.max_pool2d(depths[None], 4)[0] + F.max_pool2d(-depths[None], 4)[0]
    return Tree(tuple(gains), tuple(wanteds), span > UPSAMPLING.jump, size)


def threshold(trees: list[Tree], budget: int, least: float) -> float:
    """The gain above which squares are parted, at least `least`, so that all trees together have at most
    `budget` leaves, those beneath squares of four pixels that are parted among them; but what must be parted
    is parted."""
    left = budget - sum(int(tree.wanted[-1].sum()) for tree in trees)
    gains = torch.cat([gain.flatten() for tree in trees for gain in tree.gains])
    costs = torch.cat([torch.cat(_costs(tree)) for tree in trees])
    costs, gains = costs[gains > least], gains[gains > least]
    if int(costs.sum()) <= left:
        return least
    order = gains.argsort(descending=True)
    fitting = int((costs[order].cumsum(0) <= left).sum())
    return float(gains[order[fitting]])


def _costs(tree: Tree) -> list[Int[Tensor, " _"]]:
    """Leaves that parting each square adds, in the order of `gains`."""
    costs = [torch.full((gain.numel(),), cost) for cost, gain in zip(_COSTS, tree.gains, strict=True)]
    costs[1] += tree.torn.flatten()
    return costs


def leaves(tree: Tree, limit: float) -> tuple[list[Squares], Squares]:
    """The squares that are not parted, by level from the finest; and those of four pixels that are."""
    alive, found = tree.wanted[-1], []
    beneath = Squares(torch.zeros(0, dtype=torch.long), torch.zeros(0, dtype=torch.long), 4)
    for level in range(LEVELS, -1, -1):
        if level == 0:
            found.append(_squares(alive & tree.wanted[0], 0, tree.size))
            break
        parted = alive & ((tree.gains[level - 1] > limit) | tree.gains[level - 1].isinf())
        found.append(_squares(alive & ~parted, level, tree.size))
        if level == 2:
            beneath = _squares(parted, 2, tree.size)
        alive = parted.repeat_interleave(2, 0).repeat_interleave(2, 1) & tree.wanted[level - 1]
    return found[::-1], beneath


def pad_to_blocks(values: Shaped[Tensor, "C H W"]) -> Shaped[Tensor, "C h w"]:
    """(C, h, w) with its last row and column repeated up to multiples of `LARGEST`."""
    height, width = values.shape[-2:]
    return F.pad(values[None], (0, -width % LARGEST, 0, -height % LARGEST), mode="replicate")[0]


def _fours(values: Tensor) -> Tensor:
    """Sums of 2 x 2 of (C, rows, columns)."""
    return F.avg_pool2d(values[None], 2)[0] * 4


def _jumping(jumps: tuple[Tensor, Tensor], level: int) -> Tensor:
    """Squares of the level inside which depth jumps."""
    side = 2**level
    across, down = jumps[0].clone(), jumps[1].clone()
    across[:, side - 1 :: side], down[side - 1 :: side] = False, False
    inside = F.pad(across.float(), (0, 1)) + F.pad(down.float(), (0, 0, 0, 1))
    return F.max_pool2d(inside[None, None], side)[0, 0] > 0


def _is_bent(depths: Tensor, side: int) -> Tensor:
    """Squares whose middle is off the mean of their corners."""
    first, last, half = slice(0, None, side), slice(side - 1, None, side), slice(side // 2, None, side)
    corners = depths[first, first] + depths[first, last] + depths[last, first] + depths[last, last]
    return (corners / 4 - depths[half, half]).abs() > BLOCKS.bent


def _squares(chosen: Tensor, level: int, size: tuple[int, int]) -> Squares:
    top, left = (along * 2**level for along in chosen.nonzero(as_tuple=True))
    inside = (top < size[0]) & (left < size[1])
    return Squares(left[inside], top[inside], 2**level)
