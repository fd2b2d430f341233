"""What one photo shows and the others do not: somebody who walks through, a screen whose picture changes,
what a mirror shows.

Each of the other photos says what a photo should show: its points, in its colours, are carried there. A cell
is contradicted where two others and more foresee one colour at one depth, not before what the photo sees, and
the photo shows another colour; and not where half as many others see what it sees. They must look at the
place where the photo has its surface, or through it: a near thing that they do not have before them they
cannot deny. Colours are compared with all that lies within `_AROUND` cells, both ways, so that poses and
depths which are a pixel or two off say nothing. Small and loose parts are no regions; a region then goes on
through what the others see through, and a little further, over blurred borders and what a thing shades.

A thing whose depth is wrong is foreseen at the wrong place, too. So a region is left out only if hardly any
of those others shows it somewhere along its rays. What is left out was foreseen by others: nothing stays
uncovered.

Sizes: V views, U others, H W pixels of the grid, h w cells of `_CELL` x `_CELL` pixels.

Source: own derivation; change against what other pictures foresee: Palazzolo and Stachniss 2018, "Fast
image-based geometric change detection given a 3D model".
"""

import math
from dataclasses import dataclass

import cv2
import numpy as np
import torch
from jaxtyping import Bool
from torch import Tensor
from torch.nn import functional as F

from langflash_core.rig.neighbours import neighbours
from langflash_core.rig.projected import Projected, project_points
from langflash_core.rig.rig import Rig
from langflash_core.surface.settings import TRANSIENTS

_CELL, _WINDOW, _AROUND = TRANSIENTS.cell, TRANSIENTS.window, TRANSIENTS.around
_VOTES, _THROUGH, _ALIKE = TRANSIENTS.votes, TRANSIENTS.through, TRANSIENTS.alike
_SQUARE = np.ones((3, 3), bool)
_DEPTHS = (*(k / 20 for k in range(-12, 13)), 0.8, 1.1, 1.6, 2.5)
"""Log depths, by which a region is moved: what is seen through a window or in a mirror is far."""


def transient_masks(rig: Rig) -> Bool[Tensor, "V H W"]:
    """Pixels of each photo that the others contradict.

    Args:
        rig: with photos in one light, whose places are known; depths are finite.

    Returns:
        Nothing of fewer than `TRANSIENTS.least` photos, and nothing of what fewer than two others foresee.
    """
    found = torch.zeros_like(rig.depths, dtype=torch.bool)
    if len(rig) < TRANSIENTS.least or min(rig.size) < _CELL * _WINDOW:
        return found
    looks = [_Look.of(rig, view) for view in range(len(rig))]
    for view, own in enumerate(looks):
        others = [looks[other] for other in neighbours(rig, view, "sight", TRANSIENTS.asked)]
        if len(others) < _VOTES:
            continue
        said = _Foreseen.together([other.foreseen(own) for other in others])
        faced = torch.stack([other.faces(own) for other in others])
        contradicted, through = _contradicted_cells(own, said, faced)
        seeds = [seed for seed in _seeds(contradicted) if not _elsewhere(seed, own, others, faced)]
        if seeds:
            found[view] = _at_size(_grow_mask(torch.stack(seeds).any(0), through | contradicted), found[view])
    return found


@dataclass(frozen=True)
class _Look:
    """A photo of a rig: image (3, H, W), points (3, H*W) in the world; and of its cells depth (h, w), the
    nearest in each, colour, and least and most (3, h, w) within `_AROUND` of them."""

    rig: Rig
    view: int
    image: Tensor
    points: Tensor
    depth: Tensor
    colour: Tensor
    least: Tensor
    most: Tensor

    @staticmethod
    def of(rig: Rig, view: int) -> "_Look":
        assert rig.photos is not None, "whoever seeks transients looks at them"
        (height, width), image = rig.size, rig.photos[view]
        whole = (slice(None), slice(height // _CELL * _CELL), slice(width // _CELL * _CELL))
        cut, side, reach = image[whole], _AROUND * _CELL, (_AROUND - 1) // 2 * _CELL
        least, most = (
            sign * F.max_pool2d(F.pad(sign * cut, (reach,) * 4, value=-torch.inf), side, _CELL)
            for sign in (-1, 1)
        )
        depth = -F.max_pool2d(-rig.depths[view][None][whole], _CELL)[0]
        return _Look(rig, view, image, rig.points(view), depth, F.avg_pool2d(cut, _CELL), least, most)

    @property
    def centre(self) -> Tensor:
        """(3, 1) world."""
        return self.rig.poses[self.view, :3, 3:]

    def pixels(self, cells: Tensor) -> Tensor:
        """Numbers (n,) of a pixel in each of some cells (h, w) bool."""
        rows, columns = cells.nonzero().T
        return (rows * _CELL + _CELL // 2) * self.image.shape[2] + columns * _CELL + _CELL // 2

    def before(self, points: Tensor) -> tuple[Tensor, Tensor, Projected]:
        """Rows and columns (n,) of the pixels where points (3, n) of the world are seen, in whole cells."""
        height, width = (_CELL * side for side in self.depth.shape)
        camera = self.rig.viewmats[self.view], self.rig.Ks[self.view]
        there = project_points(points, *camera, (height, width))
        return there.pixels // width, there.pixels % width, there

    def foreseen(self, other: "_Look") -> "_Foreseen":
        """What this photo says that another one shows."""
        rows, columns, there = other.before(self.points)
        (height, width), some = other.depth.shape, there.inside.nonzero()[:, 0]
        places, z = (rows // _CELL * width + columns // _CELL)[some], there.z[some]
        nearest = z.new_full((height * width,), torch.inf).scatter_reduce(0, places, z, "amin")
        front = z < (1 + _ALIKE) * nearest[places]
        some, places = some[front], places[front]
        at_row, at_column = (some // self.image.shape[2] // _CELL, some % self.image.shape[2] // _CELL)
        own = at_row.clamp(max=self.depth.shape[0] - 1), at_column.clamp(max=self.depth.shape[1] - 1)
        colours = torch.cat((self.image.flatten(1)[:, some], self.least[:, *own], self.most[:, *own]))
        sums = z.new_zeros(9, height * width).index_add_(1, places, colours)
        means = sums / torch.bincount(places, minlength=height * width).clamp_min(1)
        return _Foreseen(nearest.view(height, width), *means.view(3, 3, height, width))

    def faces(self, other: "_Look") -> Tensor:
        """(h, w) bool: cells of another photo whose surface this one sees or looks through."""
        every = other.pixels(torch.ones_like(other.depth, dtype=torch.bool))
        rows, columns, there = self.before(other.points[:, every])
        nearer = there.z < math.exp(_THROUGH) * self.depth[rows // _CELL, columns // _CELL]
        return (there.inside & nearer).view_as(other.depth)

    def shows(self, other: "_Look", pixels: Tensor) -> float:
        """The largest share of another photo's pixels (n,) that this one shows, wherever along their rays all
        of them lie; NaN where it has them nowhere before it."""
        rays, colours = other.points[:, pixels] - other.centre, other.image.flatten(1)[:, pixels]
        least, most = (
            sign * F.max_pool2d(sign * self.image, TRANSIENTS.near, 1, TRANSIENTS.near // 2).flatten(1)
            for sign in (-1, 1)
        )
        best = math.nan
        for change in _DEPTHS:
            rows, columns, there = self.before(other.centre + math.exp(change) * rays)
            inside = there.inside
            if float(inside.float().mean()) < TRANSIENTS.in_view:
                continue
            places = (rows * self.image.shape[2] + columns)[inside]
            off = _beyond(colours[:, inside], least[:, places], most[:, places]).amax(0)
            best = np.fmax(best, float((off < TRANSIENTS.like).float().mean()))
        return float(best)


@dataclass(frozen=True)
class _Foreseen:
    """What photos say of another's cells. depth: (*U, h, w), endless where they say nothing. colour, least,
    most: (*U, 3, h, w)."""

    depth: Tensor
    colour: Tensor
    least: Tensor
    most: Tensor

    @staticmethod
    def together(some: "list[_Foreseen]") -> "_Foreseen":
        names = ("depth", "colour", "least", "most")
        return _Foreseen(*(torch.stack([getattr(one, name) for one in some]) for name in names))


def _contradicted_cells(own: _Look, said: _Foreseen, faced: Tensor) -> tuple[Tensor, Tensor]:
    """(h, w) bool: cells where others foresee another colour; and those that they see through. faced: (U, h,
    w) bool, where they look."""
    told = torch.isfinite(said.depth) & faced
    gap = said.depth.log() - own.depth.log()  # > 0: they see something behind
    outside = torch.maximum(
        _beyond(said.colour, own.least, own.most).amax(1), _beyond(own.colour, said.least, said.most).amax(1)
    )  # (U, h, w)
    other = told & (gap > -_THROUGH) & (outside > TRANSIENTS.other)
    one = other & _as_most(other, said)
    votes, same = one.sum(0), (told & (outside <= TRANSIENTS.other) & (gap.abs() < _THROUGH)).sum(0)
    through = (told & (gap > _THROUGH)).sum(0)
    return (votes >= _VOTES) & (votes >= 2 * same), (through >= _VOTES) & (through > 2 * same)


def _beyond(colours: Tensor, least: Tensor, most: Tensor) -> Tensor:
    """By how much colours leave a range."""
    return torch.maximum(colours - most, least - colours).clamp_min(0)


def _as_most(other: Tensor, said: _Foreseen) -> Tensor:
    """(U, h, w) bool: whose colour and depth are about the median of all that contradict."""
    nothing = torch.where(other, 0.0, torch.nan)
    colour = (said.colour + nothing[:, None]).nanmedian(0).values
    depth = (said.depth.log() + nothing).nanmedian(0).values
    alike = (said.colour - colour).abs().amax(1) < _ALIKE
    return alike & ((said.depth.log() - depth).abs() < _ALIKE)


def _seeds(contradicted: Tensor) -> list[Tensor]:
    """Regions (h, w) bool of what is contradicted as a whole."""
    full = F.avg_pool2d(contradicted[None, None].float(), _WINDOW, 1, _WINDOW // 2)[0, 0] > TRANSIENTS.full
    inside = _wider(full, _WINDOW // 2) & contradicted
    count, numbers = cv2.connectedComponents(inside.cpu().numpy().astype(np.uint8))
    sizes = np.bincount(numbers.ravel(), minlength=count)
    large = [k for k in range(1, count) if sizes[k] >= TRANSIENTS.smallest * numbers.size]
    return [torch.from_numpy(numbers == k).to(contradicted.device) for k in large]


def _elsewhere(seed: Tensor, own: _Look, others: list[_Look], faced: Tensor) -> bool:
    """Whether two of the others that could deny a region (h, w), of few one, show it somewhere along its
    rays."""
    pixels = own.pixels(seed)
    asked = [
        other
        for other, cells in zip(others, faced, strict=True)
        if float(cells[seed].float().mean()) > TRANSIENTS.denies
    ]
    showing = sum(other.shows(own, pixels) >= TRANSIENTS.found for other in asked)
    return showing >= (_VOTES if len(asked) > TRANSIENTS.few else 1)


def _grow_mask(seeds: Tensor, may: Tensor) -> Tensor:
    """(h, w) bool: seeds, what goes on from there, holes and a margin."""
    import scipy.ndimage  # a tenth of what is imported for a scene, where few have transients

    grown = scipy.ndimage.binary_dilation(
        seeds.cpu().numpy(), _SQUARE, TRANSIENTS.farthest, (may | seeds).cpu().numpy()
    )
    closed = scipy.ndimage.binary_closing(np.pad(grown, _WINDOW), _SQUARE, 2)[
        _WINDOW:-_WINDOW, _WINDOW:-_WINDOW
    ]
    return _wider(
        torch.from_numpy(scipy.ndimage.binary_fill_holes(closed)).to(seeds.device), TRANSIENTS.margin
    )


def _wider(mask: Tensor, cells: int) -> Tensor:
    return F.max_pool2d(mask[None, None].float(), 2 * cells + 1, 1, cells)[0, 0] > 0


def _at_size(cells: Tensor, like: Tensor) -> Tensor:
    """Cells (h, w) as pixels (H, W); the last row and column go on where a side is no whole number of
    cells."""
    pixels = cells.repeat_interleave(_CELL, 0).repeat_interleave(_CELL, 1)
    missing = (like.shape[0] - pixels.shape[0], like.shape[1] - pixels.shape[1])
    return F.pad(pixels[None, None].float(), (0, missing[1], 0, missing[0]), mode="replicate")[0, 0] > 0
