"""What one photo shows and the others do not: somebody who walks through, a screen whose picture changes,
what a mirror shows.

Each of the other photos says what a photo should show: its points, in its colours, are carried there. A cell
is contradicted where two others and more foresee one colour at one depth, not before what the photo sees, and
the photo shows another colour; and not where half as many others see what it sees. Colours are compared with
all that lies within `_AROUND` cells, both ways, so that poses and depths which are a pixel or two off say
nothing. Small and loose parts are no regions; a region then goes on through what the others see through, and
a little further, over blurred borders and into what a thing shades.

A thing whose depth is wrong is foreseen at the wrong place, too. So a region is left out only if most others
show it nowhere along its rays. What is left out was foreseen by others, so
nothing is left uncovered.

Sizes: V views, U others, H W pixels of the grid, h w cells of `_CELL` x `_CELL` pixels.

Source: own derivation; change against what other pictures foresee: Palazzolo and Stachniss 2018, "Fast
image-based geometric change detection given a 3D model".
"""

import math
from dataclasses import dataclass

import numpy as np
import scipy.ndimage
import torch
from jaxtyping import Bool, Float
from torch import Tensor
from torch.nn import functional as F

from langflash_core.geometry.cameras import invert_rigid, pictured, unproject
from langflash_core.scene.consistency import witnesses

LEAST = 3
"""Photos, from which on two may contradict one."""
_CELL = 2  # pixels a side
_AROUND = 3  # cells a side of the window in which colours may lie
_OTHER = 0.1  # sRGB, beyond all colours around, from which it is another colour
_ALIKE = 0.1  # sRGB and log depth, within which others foresee one thing
_THROUGH = 0.12  # log depth by which a surface lies behind another
_VOTES = 2
_WINDOW, _FULL = 5, 0.6  # cells a side, and the share of them that is contradicted inside a region
_SMALLEST = 0.004  # of a photo
_FARTHEST = 24  # cells, by which a region may go on
_MARGIN = 2  # cells beyond its border
_NEAR, _LIKE = 3, 0.06  # pixels a side of the window, and sRGB, within which a pixel is found again
_FOUND = 0.5  # of a region's pixels, at one depth
_IN_VIEW = 0.3  # of a region, that another photo must have before it to say anything
_LEAST_DEPTH = 1e-6  # unit of the depths
_SQUARE = np.ones((3, 3), bool)
_DEPTHS = (*(k / 20 for k in range(-12, 13)), 0.8, 1.1, 1.6, 2.5)
"""Log depths, by which a region is moved: what is seen through a window or in a mirror is far."""


def strangers(
    images: Float[Tensor, "V 3 H W"],
    depths: Float[Tensor, "V H W"],
    viewmats: Float[Tensor, "V 4 4"],
    Ks: Float[Tensor, "V 3 3"],
) -> Bool[Tensor, "V H W"]:
    """Pixels of each photo that the others contradict.

    Args:
        images: in [0, 1], in one light. depths: z > 0, finite. viewmats: of photos whose place is known. Ks:
            pixels.

    Returns:
        Nothing of fewer than `LEAST` photos, and nothing of what fewer than two others foresee.
    """
    found = torch.zeros_like(depths, dtype=torch.bool)
    if len(images) < LEAST or min(depths.shape[1:]) < _CELL * _WINDOW:
        return found
    looks = [_Look.of(*own) for own in zip(images, depths, viewmats, Ks, strict=True)]
    for view, own in enumerate(looks):
        some = witnesses(view, own.points.T, viewmats, Ks, (depths.shape[1], depths.shape[2]))
        if len(some) < _VOTES:
            continue
        seen = [looks[other].foreseen(viewmats[view], Ks[view], own.depth.shape) for other in some]
        contradicted, through = _contradicted(own, _Foreseen.together(seen))
        seeds = [
            seed for seed in _seeds(contradicted) if not _elsewhere(seed, view, some, looks, viewmats, Ks)
        ]
        if seeds:
            region = _grown(np.any(seeds, axis=0), (through | contradicted).cpu().numpy())
            found[view] = _at_size(torch.from_numpy(region).to(found.device), found[view])
    return found


@dataclass(frozen=True)
class _Look:
    """A photo of `size` = (H, W).

    points: (3, H*W) world. colours: (9, H*W), red, green, blue, and their least and most within `_AROUND`
    cells. near: (6, H*W), least and most within `_NEAR` pixels. depth (h, w), colour, least, most (3, h, w)
    of its cells.
    """

    size: tuple[int, int]
    points: Tensor
    colours: Tensor
    near: Tensor
    depth: Tensor
    colour: Tensor
    least: Tensor
    most: Tensor

    @staticmethod
    def of(image: Tensor, depths: Tensor, viewmat: Tensor, K: Tensor) -> "_Look":
        pose, (height, width) = invert_rigid(viewmat), depths.shape
        points = pose[:3, :3] @ unproject(depths, K).flatten(0, 1).T + pose[:3, 3:]
        around, near = _range(image, _AROUND * _CELL - 1), _range(image, _NEAR)
        inside = (slice(None), slice(height // _CELL * _CELL), slice(width // _CELL * _CELL))
        cells = [
            -F.max_pool2d(-depths[None][inside], _CELL)[0],
            F.avg_pool2d(image[inside], _CELL),
            -F.max_pool2d(-around[:3][inside], _CELL),
            F.max_pool2d(around[3:][inside], _CELL),
        ]
        colours = torch.cat((image, around)).flatten(1)
        return _Look((height, width), points, colours, near.flatten(1), *cells)

    def pixels(self, cells: np.ndarray) -> Tensor:
        """A pixel of each of some cells (h, w) bool, as numbers (n,)."""
        rows, columns = np.nonzero(cells)
        places = (rows * _CELL + _CELL // 2) * self.size[1] + columns * _CELL + _CELL // 2
        return torch.from_numpy(places).to(self.points.device)

    def shown(self, points: Tensor, colours: Tensor, viewmat: Tensor, K: Tensor) -> float:
        """The share of points (3, n) in the world, of those in view, that this photo shows in these colours
        (3, n); NaN where few are in view."""
        x, y, z = pictured(viewmat, K, points)
        inside = (z > _LEAST_DEPTH) & (x >= 0) & (y >= 0) & (x < self.size[1]) & (y < self.size[0])
        if float(inside.float().mean()) < _IN_VIEW:
            return math.nan
        range_there = self.near[:, y[inside].long() * self.size[1] + x[inside].long()]
        off = _beyond(colours[:, inside], range_there[:3], range_there[3:]).amax(0)
        return float((off < _LIKE).float().mean())

    def foreseen(self, viewmat: Tensor, K: Tensor, size: torch.Size) -> "_Foreseen":
        """What this photo says that another one shows in cells of that size (h, w)."""
        height, width = size
        x, y, z = pictured(viewmat, K, self.points)
        x, y = x / _CELL, y / _CELL
        inside = (z > _LEAST_DEPTH) & (x >= 0) & (y >= 0) & (x < width) & (y < height)
        some = inside.nonzero()[:, 0]
        places, z = y[some].long() * width + x[some].long(), z[some]
        nearest = z.new_full((height * width,), torch.inf).scatter_reduce(0, places, z, "amin")
        front = z < (1 + _ALIKE) * nearest[places]
        some, places = some[front], places[front]
        sums = z.new_zeros(9, height * width).index_add_(1, places, self.colours[:, some])
        means = sums / torch.bincount(places, minlength=height * width).clamp_min(1)
        return _Foreseen(nearest.view(size), *means.view(3, 3, height, width))


def _range(image: Tensor, side: int) -> Tensor:
    """Least and most (6, H, W) of an image (3, H, W) within a window of an odd side."""
    return torch.cat([sign * F.max_pool2d(sign * image, side, 1, side // 2) for sign in (-1, 1)])


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


def _contradicted(own: _Look, said: _Foreseen) -> tuple[Tensor, Tensor]:
    """(h, w) bool: cells where others foresee another colour; and those that they see through."""
    told = torch.isfinite(said.depth)
    gap = said.depth.log() - own.depth.log()  # > 0: they see something behind
    outside = torch.maximum(
        _beyond(said.colour, own.least, own.most).amax(1), _beyond(own.colour, said.least, said.most).amax(1)
    )  # (U, h, w)
    other = told & (gap > -_THROUGH) & (outside > _OTHER)
    one = other & _as_most(other, said)
    votes, same = one.sum(0), (told & (outside <= _OTHER) & (gap.abs() < _THROUGH)).sum(0)
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


def _seeds(contradicted: Tensor) -> list[np.ndarray]:
    """Regions (h, w) bool of what is contradicted as a whole."""
    full = F.avg_pool2d(contradicted[None, None].float(), _WINDOW, 1, _WINDOW // 2)[0, 0] > _FULL
    inside = _wider(full, _WINDOW // 2) & contradicted
    numbers, count = scipy.ndimage.label(inside.cpu().numpy(), _SQUARE)
    sizes = np.bincount(numbers.ravel(), minlength=count + 1)
    return [numbers == k for k in range(1, count + 1) if sizes[k] >= _SMALLEST * numbers.size]


def _elsewhere(
    seed: np.ndarray, view: int, others: list[int], looks: list[_Look], viewmats: Tensor, Ks: Tensor
) -> bool:
    """Whether half of the other photos that can show a region (h, w) do so somewhere along its rays."""
    centre = invert_rigid(viewmats[view])[:3, 3:]
    pixels = looks[view].pixels(seed)
    rays, colours = looks[view].points[:, pixels] - centre, looks[view].colours[:3, pixels]
    shares = [
        [
            looks[other].shown(centre + math.exp(change) * rays, colours, viewmats[other], Ks[other])
            for change in _DEPTHS
        ]
        for other in others
    ]
    most = np.fmax.reduce(np.array(shares), axis=1)  # NaN of those that never have it before them
    return bool(np.nanmedian(most) >= _FOUND) if np.isfinite(most).any() else False


def _grown(seeds: np.ndarray, may: np.ndarray) -> np.ndarray:
    """(h, w) bool: seeds, what goes on from there, holes and a margin."""
    grown = scipy.ndimage.binary_dilation(seeds, _SQUARE, _FARTHEST, may | seeds)
    closed = scipy.ndimage.binary_closing(np.pad(grown, _WINDOW), _SQUARE, 2)[
        _WINDOW:-_WINDOW, _WINDOW:-_WINDOW
    ]
    return scipy.ndimage.binary_dilation(scipy.ndimage.binary_fill_holes(closed), _SQUARE, _MARGIN)


def _wider(mask: Tensor, cells: int) -> Tensor:
    return F.max_pool2d(mask[None, None].float(), 2 * cells + 1, 1, cells)[0, 0] > 0


def _at_size(cells: Tensor, like: Tensor) -> Tensor:
    """Cells (h, w) as pixels (H, W); the last row and column go on where a side is no whole number of
    cells."""
    pixels = cells.repeat_interleave(_CELL, 0).repeat_interleave(_CELL, 1)
    missing = (like.shape[0] - pixels.shape[0], like.shape[1] - pixels.shape[1])
    return F.pad(pixels[None, None].float(), (0, missing[1], 0, missing[0]), mode="replicate")[0, 0] > 0
