"""Squares of a photo become flat Gaussians on the surface that its depth map has there.

Two layers. The coarse one, of squares of four pixels and more, is closed by itself: what is flat needs
nothing else. Where squares were parted, the coarse layer goes on a little behind as a ground, one element
for each surface of a square, and the fine elements lie on it: they may be as small and as sharp as the
photo's detail, since what shines through between them has their own mean colour. Where depth jumps, the
farther surface goes on under the nearer one, so that no gap opens as soon as one looks from aside.

What passes a flat wall of elements of opacity .99 and deviation s, in spacings, at most, at any zoom:
.0013 for .85, and .155 and .0103 for .5 and .72, .0016 together. Half a step of 1/255 is .0020.

Sizes: H W cells of the grid, h w pixels of the photo, n elements.
"""

import math
from dataclasses import dataclass, fields, replace

import torch
from jaxtyping import Bool, Float, Int, Shaped, UInt8
from torch import Tensor

from langflash_core.geometry.cameras import invert_rigid, unproject
from langflash_core.geometry.harmonics import colour_to_sh
from langflash_core.geometry.pinhole import from_pixels
from langflash_core.geometry.quaternions import matrices_to_quats
from langflash_core.geometry.surfels import ellipses, spans, towards_nearer
from langflash_core.surface.blocks import Squares, pad_to_blocks
from langflash_core.surface.settings import COVERING, UPSAMPLING
from langflash_core.surface.upsampling import Upsampled
from langflash_core.types import Camera, Gaussians

COARSE, FINE = 0, 1


@dataclass(frozen=True)
class Elements:
    """n elements of one photo. x, y: (n,) pixels of the photo. roots: (n, 3) lower Cholesky factor
    (l11, l21, l22) of their covariance in the picture, pixels. log_depths (n,). cells (n,) of the grid, whose
    surface they lie on. pixels (n,) of the photo, row by row, whose meaning they have. colours (n, 3) in
    [0, 1]. levels (n,) uint8. sides (n,) pixels. hidden (n,) bool: behind others, in their own photo."""

    x: Float[Tensor, " n"]
    y: Float[Tensor, " n"]
    roots: Float[Tensor, "n 3"]
    log_depths: Float[Tensor, " n"]
    cells: Int[Tensor, " n"]
    pixels: Int[Tensor, " n"]
    colours: Float[Tensor, "n 3"]
    levels: UInt8[Tensor, " n"]
    sides: Float[Tensor, " n"]
    hidden: Bool[Tensor, " n"]

    def __len__(self) -> int:
        return len(self.x)

    def rows(self, keep: Shaped[Tensor, " n"]) -> "Elements":
        return Elements(*(getattr(self, f.name)[keep] for f in fields(self)))


def join_elements(parts: list[Elements]) -> Elements:
    """All of several."""
    return Elements(*(torch.cat([getattr(p, f.name) for p in parts]) for f in fields(Elements)))


def of_squares(squares: Squares, photo: Float[Tensor, "3 h w"], depth: Upsampled) -> Elements:
    """An element a square (all of one surface), in its middle."""
    side, (height, width) = squares.side, depth.log_depths.shape
    left, top = squares.left, squares.top
    right, bottom = (left + side).clamp(max=width), (top + side).clamp(max=height)
    x, y = (left + right) / 2, (top + bottom) / 2
    column, row = x.long().clamp(max=width - 1), y.long().clamp(max=height - 1)
    cover = side * (COVERING.fine_cover if side < 4 else COVERING.flat_cover)
    root = torch.full_like(x, cover)
    return Elements(
        x, y, torch.stack((root, torch.zeros_like(root), root), -1),
        _middle_depths(depth.log_depths, x, y), depth.cells[row, column], row * width + column,
        _means(photo, left, top, side),
        torch.full_like(column, FINE if side < 4 else COARSE, dtype=torch.uint8),
        torch.full_like(x, side), torch.zeros_like(column, dtype=torch.bool),
    )  # fmt: skip


def _middle_depths(log_depths: Tensor, x: Tensor, y: Tensor) -> Tensor:
    """(n,) log depths at middles of pixels or between them; of one pixel where the depths there jump."""
    rows, columns = ([(along - back).long() for back in (0.5, 0.0)] for along in (y, x))
    four = torch.stack([log_depths[row, column] for row in rows for column in columns])
    mean = -(-four).exp().mean(0).log()
    return torch.where(four.amax(0) - four.amin(0) > UPSAMPLING.jump, four[-1], mean)


def _means(photo: Tensor, left: Tensor, top: Tensor, side: int) -> Tensor:
    """(n, 3) mean colours of squares."""
    pooled = torch.nn.functional.avg_pool2d(pad_to_blocks(photo)[None], side)[0] if side > 1 else photo
    return pooled[:, top // side, left // side].T


def ground(squares: Squares, photo: Float[Tensor, "3 h w"], depth: Upsampled) -> Elements:
    """Under squares that were parted: an element of the nearer surface, and one of what is behind a jump."""
    rows, columns = (_of_squares(along, squares.side) for along in (squares.top, squares.left))
    height, width = depth.log_depths.shape
    inside = ((rows < height)[:, :, None] & (columns < width)[:, None]).flatten(1)
    rows, columns = rows[:, :, None].clamp(max=height - 1), columns[:, None].clamp(max=width - 1)
    depths = depth.log_depths[rows, columns].flatten(1)  # (n, 16)
    pixels, colours = (rows * width + columns).flatten(1), photo[:, rows, columns].flatten(2)
    low, high = depths.amin(1, keepdim=True), depths.amax(1, keepdim=True)
    near = (depths <= (low + high) / 2) | (high - low <= UPSAMPLING.jump)
    corner = torch.stack((squares.left, squares.top), -1)
    parts = (near & inside, ~near & inside)
    return join_elements([_ground_of(part, depths, pixels, colours, corner, depth.cells) for part in parts])


def _of_squares(first: Tensor, side: int) -> Tensor:
    return first[:, None] + torch.arange(side)


def _ground_of(
    part: Tensor, depths: Tensor, pixels: Tensor, colours: Tensor, corner: Tensor, cells: Tensor
) -> Elements:
    """Elements with mean and spread of some pixels (n, side^2) bool of squares, where there are any."""
    some, side = part.any(1), math.isqrt(part.shape[1])
    share = part[some].float() / part[some].sum(1, keepdim=True)
    along = torch.arange(side) + 0.5
    places = torch.stack((along.repeat(side), along.repeat_interleave(side)), -1)  # (side^2, 2)
    mean = share @ places
    off = places - mean[:, None]
    xx, xy, yy = ((share * off[..., i] * off[..., j]).sum(1) for i, j in ((0, 0), (0, 1), (1, 1)))
    l11 = (xx + COVERING.uniform**2).sqrt()
    l21 = xy / l11
    roots = torch.stack(
        (l11, l21, (yy + COVERING.uniform**2 - l21**2).clamp_min(COVERING.uniform**2).sqrt()), -1
    )
    nearest = (off.square().sum(-1) + torch.where(part[some], 0.0, torch.inf)).argmin(1, keepdim=True)
    pixel = pixels[some].gather(1, nearest)[:, 0]
    x, y = (corner[some] + mean).unbind(-1)
    return Elements(
        x, y, roots * (COVERING.ground_cover / COVERING.uniform), (share * depths[some]).sum(1),
        cells.flatten()[pixel], pixel, (colours[:, some] * share).sum(-1).T,
        torch.full((len(x),), COARSE, dtype=torch.uint8), torch.full_like(x, side),
        torch.ones(len(x), dtype=torch.bool),
    )  # fmt: skip


def drawn_in(elements: Elements, clear: Float[Tensor, "h w"]) -> Elements:
    """Those that reach over the end of their surface, `clear` (h, w) pixels away, drawn in: two deviations
    along rows and columns stay on it, of what is wider than a pixel."""
    l11, l21, l22 = elements.roots.unbind(-1)
    widest = torch.maximum(l11, torch.hypot(l21, l22))
    room = (clear.flatten()[elements.pixels] / 2).clamp_min(COVERING.narrowest)
    return replace(elements, roots=elements.roots * (room / widest).clamp(max=1)[:, None])


def under(log_depths: Float[Tensor, "h w"], image: Float[Tensor, "3 H W"], size: tuple[int, int]) -> Elements:
    """What goes on behind the edges of nearer things, an element a cell of the grid (H, W) before a jump.

    Args:
        image: (3, H, W). size: (h, w) of the photo.
    """
    signs = towards_nearer(log_depths, COVERING.step)
    row, column = (signs.abs().sum(-1) > 0).nonzero(as_tuple=True)
    towards = signs[row, column] / signs[row, column].norm(dim=-1, keepdim=True)
    cell = torch.tensor([size[1] / log_depths.shape[1], size[0] / log_depths.shape[0]])
    middle = torch.stack((column, row), -1) + 0.5
    x, y = ((middle + COVERING.under / 2 * towards) * cell).unbind(-1)
    wide = torch.full_like(x, COVERING.under / 2) * cell[0]
    pixel_x, pixel_y = (middle * cell).long().unbind(-1)
    return Elements(
        x, y, torch.stack((wide, torch.zeros_like(x), wide), -1), log_depths[row, column],
        row * log_depths.shape[1] + column, pixel_y * size[1] + pixel_x, image[:, row, column].T,
        torch.full((len(x),), COARSE, dtype=torch.uint8), wide * 2, torch.ones(len(x), dtype=torch.bool),
    )  # fmt: skip


def place_elements(
    elements: Elements,
    log_depths: Float[Tensor, "H W"],
    slopes: Float[Tensor, "H W"],
    camera: Camera,
    size: tuple[int, int],
) -> Gaussians:
    """Gaussians in the world of the camera, in the unit of its depths.

    Args:
        log_depths, slopes: (H, W), of the grid. camera: of the grid. size: (h, w) of the photo.
    """
    K, ratio = camera.with_size(size[1], size[0]).K, log_depths.shape[1] / size[1]
    span_u, span_v = _spans(log_depths, camera, size)
    cells = elements.cells
    behind = (COVERING.behind + COVERING.reach * ratio * slopes.flatten()[cells]).clamp(
        max=COVERING.farthest_behind
    )
    behind = torch.where(elements.hidden, behind, COVERING.coarse_behind * behind)
    logs = elements.log_depths + torch.where(elements.levels == COARSE, behind, 0.0)
    depths = logs.exp()
    scale = (depths / log_depths.flatten()[cells].exp())[:, None]
    span_u, span_v = span_u[cells] * scale, span_v[cells] * scale
    l11, l21, l22 = elements.roots[..., None].unbind(1)
    axes, deviations = ellipses(span_u * l11 + span_v * l21, span_v * l22)
    thin = COVERING.thin * elements.sides[:, None] * depths[:, None] / K[0, 0]
    across = from_pixels(torch.stack((elements.x, elements.y), -1), K)
    pos_c = torch.cat((across, torch.ones_like(depths)[:, None]), -1) * depths[:, None]
    pose = invert_rigid(camera.viewmat)
    return Gaussians(
        means=pos_c @ pose[:3, :3].T + pose[:3, 3],
        quats=matrices_to_quats(pose[:3, :3] @ axes),
        scales=torch.cat((torch.maximum(deviations, thin), thin), -1),
        opacities=torch.full_like(depths, COVERING.opacity),
        sh=colour_to_sh(elements.colours)[:, None],
    )


def _spans(log_depths: Tensor, camera: Camera, size: tuple[int, int]) -> tuple[Tensor, Tensor]:
    """From a pixel of the photo to the next (H*W, 3), of every cell of the grid."""
    depths = log_depths.exp()
    span_u, span_v = spans(unproject(depths, camera.K), depths / camera.K[0, 0])
    height, width = log_depths.shape
    return span_u.flatten(0, 1) * (width / size[1]), span_v.flatten(0, 1) * (height / size[0])
