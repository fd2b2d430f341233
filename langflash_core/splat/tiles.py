"""The rasteriser for processors: the same sums as the reference, in float32, tile by tile.

A picture is cut into tiles of 8 x 8 pixels. A tile's Gaussians are composited front to back, `TILES.block` at
a time and many tiles at once: per block the alphas (B, n, 64), their transmittances by n products, and one
matrix product with the features. A tile is done when no pixel of it lets more than `TILES.stop` of the light
pass, which bounds what is left out: |F - F_reference| <= STOP max |f|, beside float32's rounding. Every step
    is a
call into torch on a few hundred kilobytes, so it runs beside other threads of Python and can be stopped
between two of them.

Twin: `reference.rasterize`, tests/splat/test_tiles.py. Source: own; tiles and stop as in Kerbl et al. 2023.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float, Int, Num
from torch import Tensor

from langflash_core.errors import Cancelled
from langflash_core.splat.settings import TILES
from langflash_core.types import Camera

from .projection import ALPHA_MAX, ALPHA_MIN, Footprints

_PIXELS = TILES.tile * TILES.tile
_BELOW_MIN = float(np.nextafter(np.float32(ALPHA_MIN), np.float32(0)))


def rasterize_tiles(
    footprints: Footprints,
    features: Sequence[Float[Tensor, "N _"]],
    camera: Camera,
    threads: int = 1,
    stopping: Callable[[], bool] = lambda: False,
) -> tuple[list[Float[Tensor, "H W _"]], Float[Tensor, "H W"]]:
    """Composite features front to back, as `reference.rasterize` does, without gradients.

    Args:
        footprints: of N Gaussians as the camera sees them, better float64.
        features: (N, F) each, finite, composited as they are, in float32.
        camera: size of the image.
        threads: that share the tiles.
        stopping: asked every few milliseconds, whether nobody wants the picture any more.

    Returns:
        maps (H, W, F) = sum_i T_i alpha_i f_i over black, each in the dtype of its features, and alphas
        (H, W) = 1 - T, float32.

    Raises:
        ValueError: features differ in number.
        Cancelled: `stopping` said so.
    """
    counts = {some.shape[0] for some in features}
    if len(counts) != 1:
        raise ValueError(f"features: expected as many rows of each, received {sorted(counts)}")
    with torch.no_grad():
        lists = _tile_lists(footprints, camera.width, camera.height)
        table = _Table.of(footprints, [some.detach().cpu() for some in features])
        columns, rows = lists.grid
        shapes = [(some.shape[1], some.dtype) for some in features] + [(1, torch.float32)]
        images = [torch.zeros(rows * columns, _PIXELS, wide, dtype=dtype) for wide, dtype in shapes]

    def fill(tiles: Tensor) -> None:
        if stopping():
            raise Cancelled("the picture is no longer wanted")
        with torch.no_grad():
            _composite(table, lists, tiles, images)

    shares = lists.tiles.split(TILES.tiles_at_once)
    # Each of our threads computes alone: those of torch's own pool would wait for each other at every call.
    before = torch.get_num_threads()
    try:
        with ThreadPoolExecutor(max(1, threads), initializer=lambda: torch.set_num_threads(1)) as pool:
            for _ in pool.map(fill, shares):
                pass
    finally:
        torch.set_num_threads(before)  # it is also what threads begin with that first compute after this
    *maps, alphas = (_merge_tiles(image, lists.grid)[: camera.height, : camera.width] for image in images)
    return maps, alphas[..., 0]


def _merge_tiles(image: Tensor, grid: tuple[int, int]) -> Tensor:
    """(tiles, 64, F) to (H, W, F), whole tiles."""
    columns, rows = grid
    image = image.view(rows, columns, TILES.tile, TILES.tile, -1).permute(0, 2, 1, 3, 4)
    return image.reshape(rows * TILES.tile, columns * TILES.tile, -1)


@dataclass(frozen=True)
class _Lists:
    """Which Gaussians reach which tile: `members`, nearest first, of tile t from `starts[t]` on,
    `counts[t]` of them. tiles: those with members, the longest first. grid: columns and rows."""

    members: Tensor
    starts: Tensor
    counts: Tensor
    tiles: Tensor
    grid: tuple[int, int]


def tiles_touched(
    boxes: Num[np.ndarray, "n 4"], width: int, height: int, side: int = TILES.tile
) -> tuple[Int[np.ndarray, " pairs"], Int[np.ndarray, " pairs"], tuple[int, int]]:
    """Every pair of a box and a tile of side x side pixels of an image that it touches.

    Args:
        boxes: (n, 4) integers x0, y0, x1, y1, pixels, the last ones outside.

    Returns:
        Row of the box and number of the tile of each pair, in the order of the boxes; how many columns and
        rows of tiles there are.
    """
    columns, rows = -(-width // side), -(-height // side)
    left, top, wide, tall = _spans(boxes, width, height, side)
    pairs = wide * tall
    members = np.repeat(np.arange(len(pairs), dtype=np.int32), pairs)
    local = np.arange(len(members)) - np.repeat(np.cumsum(pairs) - pairs, pairs)
    across = wide[members]
    return (
        members,
        (top[members] + local // across) * columns + left[members] + local % across,
        (columns, rows),
    )


def num_touched(boxes: Num[np.ndarray, "n 4"], width: int, height: int, side: int) -> int:
    """How many pairs `tiles_touched` returns."""
    _, _, wide, tall = _spans(boxes, width, height, side)
    return int((wide * tall).sum())


def _spans(boxes: np.ndarray, width: int, height: int, side: int) -> tuple[np.ndarray, ...]:
    """First column and row of the tiles that boxes touch, and how many columns and rows, (n,) each."""
    x0, y0, x1, y1 = boxes.T
    left, top = np.clip(x0, 0, width) // side, np.clip(y0, 0, height) // side
    wide = np.maximum(-(-np.clip(x1, 0, width) // side) - left, 0)
    tall = np.maximum(-(-np.clip(y1, 0, height) // side) - top, 0)
    return left, top, wide, tall


def _tile_lists(footprints: Footprints, width: int, height: int) -> _Lists:
    members, tile, (columns, rows) = tiles_touched(footprints.boxes().numpy(), width, height)
    small = np.uint16 if columns * rows <= 1 << 16 else np.uint32  # sixteen bits are sorted by counting
    order = np.argsort(tile.astype(small), kind="stable")  # pairs came nearest first, and stay so
    counts = np.bincount(tile, minlength=columns * rows)
    longest = np.argsort(-counts, kind="stable")[: np.count_nonzero(counts)]
    starts = np.cumsum(counts) - counts
    return _Lists(
        torch.from_numpy(members[order].astype(np.int64)),
        torch.from_numpy(starts),
        torch.from_numpy(counts),
        torch.from_numpy(longest),
        (columns, rows),
    )


@dataclass(frozen=True)
class _Table:
    """What is composited, nearest first; the last row is a Gaussian that nobody sees.

    shapes: (n + 1, 6) centre, 1 / l11, l21, 1 / l22, opacity. features: (n + 1, F + 1), the last one 1.
    """

    shapes: Tensor
    features: Tensor

    @staticmethod
    def of(footprints: Footprints, features: Sequence[Tensor]) -> "_Table":
        l11, l21, l22 = footprints.roots.unbind(-1)
        parts = (footprints.centres, (1 / l11)[:, None], l21[:, None], (1 / l22)[:, None])
        shapes = torch.cat((*parts, footprints.opacities[:, None]), -1).float()
        shapes = torch.cat((shapes, shapes.new_zeros(1, shapes.shape[1])))
        carried = torch.zeros(len(shapes), sum(some.shape[1] for some in features) + 1)
        first = 0
        for some in features:  # one table in all, whatever their dtype
            carried[:-1, first : first + some.shape[1]] = some[footprints.ids]
            first += some.shape[1]
        carried[:-1, -1] = 1.0
        return _Table(shapes, carried)


def _composite(table: _Table, lists: _Lists, tiles: Tensor, images: list[Tensor]) -> None:
    """Fill some tiles of the images (tiles, 64, F)."""
    columns = lists.grid[0]
    offsets = torch.arange(TILES.tile, dtype=torch.float32) + 0.5
    xs = (tiles % columns * TILES.tile)[:, None] + offsets.repeat(TILES.tile)  # (B, 64)
    ys = (tiles // columns * TILES.tile)[:, None] + offsets.repeat_interleave(TILES.tile)
    starts, counts = lists.starts[tiles], lists.counts[tiles]
    passing = torch.ones(len(tiles), _PIXELS)
    sums = torch.zeros(len(tiles), _PIXELS, table.features.shape[1])
    nobody = len(table.shapes) - 1
    first = 0
    while len(tiles):
        place = torch.arange(first, first + TILES.block)
        index = _gather_rows(lists.members, (starts[:, None] + place).clamp_max_(len(lists.members) - 1))
        index.masked_fill_(place >= counts[:, None], nobody)
        weights = _alphas(_gather_rows(table.shapes, index), xs, ys)
        for i in range(TILES.block):
            passing.sub_(weights[:, i].mul_(passing))  # T alpha; T (1 - alpha) = T - T alpha
        sums.baddbmm_(weights.transpose(1, 2), _gather_rows(table.features, index))
        first += TILES.block
        going = (counts > first) & (passing.amax(1) > TILES.stop)
        if int(going.sum()) <= TILES.worth_packing * len(tiles):
            done = ~going
            _scatter_tiles(images, tiles[done], sums[done])
            tiles, xs, ys, starts, counts = (v[going] for v in (tiles, xs, ys, starts, counts))
            passing, sums = passing[going], sums[going]


def _gather_rows(values: Tensor, index: Tensor) -> Tensor:
    """`values[index]` of an index (B, n), which `index_select` finds in half the time."""
    return values.index_select(0, index.flatten()).unflatten(0, index.shape)


def _scatter_tiles(images: list[Tensor], tiles: Tensor, sums: Tensor) -> None:
    first = 0
    for image in images:
        wide = image.shape[-1]
        image[tiles] = sums[..., first : first + wide].to(image.dtype)
        first += wide


def _alphas(shapes: Tensor, xs: Tensor, ys: Tensor) -> Tensor:
    """alpha (B, n, 64) of Gaussians (B, n, 6) at the pixels (B, 64) of their tiles, 0 below 1/255.

    Columns and rows of a tile are not told apart: sums over 8 x 8 of 8 numbers each, with loops as short as
    that, take twice as long.
    """
    x, y, inverse_x, shear, inverse_y, opacity = shapes.unsqueeze(-1).unbind(2)  # (B, n, 1)
    u = (xs[:, None] - x).mul_(inverse_x)  # (B, n, 64)
    v = (ys[:, None] - y).mul_(inverse_y)
    v.sub_(u * (shear * inverse_y))
    power = v.square_().add_(u.square_()).mul_(-0.5)
    alphas = power.exp_().mul_(opacity).clamp_max_(ALPHA_MAX)
    return torch.threshold_(alphas, _BELOW_MIN, 0.0)
