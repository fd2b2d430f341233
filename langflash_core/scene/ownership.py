"""Which photo covers which surface: where several see one, the one that sees it finest, and nothing
twice.

Photos come from the middle outwards: the first that sees a surface has it, and each later one takes it over
where it sees it finer by `_FINER` than who has it. Those that lead (`geometry.vantage`) come first, and the
others begin nothing: what they show where no leader shows the same is mostly their own error. They take over
and fill gaps. So all pixels that show one surface find the same photo, however many photos there are, and it
is one that the others lie around: what its depth errs by moves little in their pictures. What stands before a
surface that another photo knows better is given up as well (`consistency.seen_through`).

Of more than `_ALL` photos, who has what is decided at every eighth cell of a row and of a column first; a
photo's cells are then compared with those photos alone that had one of them at some time. A surface that many
saw passes through few hands, so the work grows with the photos and not with their square.

Sizes: V views, H W cells of the grid, n cells that are tried, B blocks of cells.
"""

from dataclasses import dataclass

import torch
from jaxtyping import Bool, Float
from torch import Tensor
from torch.nn import functional as F

from langflash_core.geometry.cameras import invert_rigid, pictured, unproject
from langflash_core.geometry.surfels import spans
from langflash_core.geometry.vantage import from_the_middle, leading

BEHIND, BEFORE = 0.12, 0.12
"""Log depth: how far behind and before another photo's surface a pixel still shows the same one."""
_ABOUT = 0.2  # relative depth by which what covers a cell may lie behind it
_ALL = 8  # photos, up to which all are compared with all
_TRIED = 8  # cells of a row and of a column, of which one is tried; and the side of a block
_BORDER = 2  # cells, at the border of a photo that leads, that take nothing over
_FINER = 2.0  # area that a pixel of the earlier photo covers over that of a later one which takes it over


def owned(
    depths: Float[Tensor, "V H W"],
    viewmats: Float[Tensor, "V 4 4"],
    Ks: Float[Tensor, "V 3 3"],
    known: Bool[Tensor, "V H W"] | None = None,
) -> Bool[Tensor, "V H W"]:
    """(V, H, W) bool: the cells of each photo that it covers itself.

    Args:
        depths: (V, H, W) > 0. viewmats: (V, 4, 4). Ks: (V, 3, 3), pixels of the depth maps.
        known: (V, H, W) bool, the cells that may cover anything; None: all.
    """
    known = torch.ones_like(depths, dtype=torch.bool) if known is None else known
    if len(depths) == 1:
        return known
    first = leading(depths, viewmats)
    order = sorted(from_the_middle(depths, viewmats), key=lambda view: view not in first)
    keep, takers = torch.zeros_like(known), _takers(known, first)
    logs, focals = depths.log().flatten(1), Ks[:, 0, 0]
    for view in range(len(depths)):
        points, normals = _surface(depths[view], viewmats[view], Ks[view])
        finest, mine = torch.full_like(points[0], torch.inf), torch.zeros_like(points[0], dtype=torch.bool)
        others = order
        if len(depths) > _ALL:
            tried = _tried(depths.shape[1:])
            some = points[:, tried], normals[:, tried]
            others = _holders(view, *some, viewmats, Ks, focals, logs, takers, order, first)
        for other in others:
            area = _covered_area(points, normals, viewmats[other], focals[other])
            takes = _takes(area, finest, other in first)
            if other != view:
                takes &= _same(points, viewmats[other], Ks[other], logs[other], takers[other])
            finest = torch.where(takes, area, finest)
            mine = takes if other == view else mine & ~takes
        keep[view] = mine.view_as(keep[view])
    return filled(depths, viewmats, Ks, _closed(keep) & known, known)


def _takers(known: Tensor, first: list[int]) -> Tensor:
    """(V, H, W) bool: the cells by which a photo takes something over. Of more than two photos not those at
    the border of one that leads: a depth that is a little off has another photo's cells there which it does
    not show, and a crack opens between both, seen from aside."""
    if len(known) <= 2:
        return known
    inner, takers = torch.zeros_like(known[0]), known.clone()
    inner[_BORDER:-_BORDER, _BORDER:-_BORDER] = True
    takers[first] = known[first] & inner
    return takers


def filled(
    depths: Float[Tensor, "V H W"],
    viewmats: Float[Tensor, "V 4 4"],
    Ks: Float[Tensor, "V 3 3"],
    keep: Bool[Tensor, "V H W"],
    known: Bool[Tensor, "V H W"],
    anything: Bool[Tensor, "V H W"] | None = None,
) -> Bool[Tensor, "V H W"]:
    """(V, H, W) bool: what is kept, and what that leaves uncovered, of the first photo that knows it: each
    one's cells count as kept for those after it, so that many photos do not all fill one gap.

    Args:
        depths, viewmats, Ks, anything: as `covered`. keep, known: (V, H, W) bool, as `owned`.
    """
    bare, found = known & ~covered(depths, viewmats, Ks, keep, anything), keep.clone()
    before = depths.new_zeros(3, 0)
    for view in from_the_middle(depths, viewmats):
        if not bool(bare[view].any()):
            continue
        points, _ = _surface(depths[view], viewmats[view], Ks[view])
        own = bare[view] & ~_hit(before, viewmats[view], Ks[view], (1 + _ABOUT) * depths[view])
        found[view] |= own
        before = torch.cat((before, points[:, own.flatten()]), 1)
    return found


def covered(
    depths: Float[Tensor, "V H W"],
    viewmats: Float[Tensor, "V 4 4"],
    Ks: Float[Tensor, "V 3 3"],
    keep: Bool[Tensor, "V H W"],
    anything: Bool[Tensor, "V H W"] | None = None,
) -> Bool[Tensor, "V H W"]:
    """(V, H, W) bool: cells of each photo in which, or beside which, what is kept lies at about their depth
    or before it.

    Args:
        depths, viewmats, Ks: as `owned`. keep: (V, H, W) bool. anything: (V, H, W) bool, cells that what lies
            at any depth covers.
    """
    height, width = depths.shape[1:]
    order = _block_by_block(height, width)
    points = [
        _surface(*of)[0][:, order[kept.flatten()[order]]]
        for *of, kept in zip(depths, viewmats, Ks, keep, strict=True)
    ]
    everything, found = _Blocks.of(torch.cat(points, 1)), []
    farthest = (1 + _ABOUT) * depths
    if anything is not None:
        farthest = torch.where(anything, torch.inf, farthest)
    for limit, viewmat, K in zip(farthest, viewmats, Ks, strict=True):
        found.append(_hit(everything.before(viewmat, K, (height, width)), viewmat, K, limit))
    return torch.stack(found)


def _hit(points: Tensor, viewmat: Tensor, K: Tensor, farthest: Tensor) -> Tensor:
    """(H, W) bool: cells in which, or beside which, one of the points (3, m) lies before `farthest`."""
    height, width = farthest.shape
    x, y, z = pictured(viewmat, K, points)
    inside = (z > 0) & (x >= 0) & (x < width) & (y >= 0) & (y < height)
    hit = torch.zeros(height * width)
    place, z = (y.floor() * width + x.floor())[inside].long(), z[inside]
    hit[place[z < farthest.flatten()[place]]] = 1
    return F.max_pool2d(hit.view(1, 1, height, width), 3, 1, 1)[0, 0] > 0


@dataclass(frozen=True)
class _Blocks:
    """Points (3, B, _TRIED^2), one behind the other, the last ones filled up; centres (B, 3) and radii (B,)
    of balls around each block."""

    points: Tensor
    centres: Tensor
    radii: Tensor

    @staticmethod
    def of(points: Tensor) -> "_Blocks":
        if points.shape[1] == 0:
            return _Blocks(points[:, :, None], points.T, points[0])
        missing = -points.shape[1] % _TRIED**2
        blocks = torch.cat((points, points[:, -1:].expand(-1, missing)), 1).unflatten(1, (-1, _TRIED**2))
        centres = (blocks.amin(2) + blocks.amax(2)) / 2
        return _Blocks(blocks, centres.T, (blocks - centres[:, :, None]).norm(dim=0).amax(1))

    def before(self, viewmat: Tensor, K: Tensor, size: tuple[int, int]) -> Tensor:
        """(3, m) of the blocks that a picture of `size` = (H, W) may show: those beside it cost no more."""
        (right, down), (fx, fy) = K[:2, 2], (K[0, 0], K[1, 1])
        sides = ((fx, 0, right), (-fx, 0, size[1] - right), (0, fy, down), (0, -fy, size[0] - down))
        planes = F.normalize(K.new_tensor([[*map(float, side)] for side in sides]), dim=1)
        inside = self.centres @ (planes @ viewmat[:3, :3]).T + planes @ viewmat[:3, 3]
        seen = (inside >= -1.001 * self.radii[:, None] - 1e-4).all(1)
        return self.points[:, seen].flatten(1)


def _block_by_block(height: int, width: int) -> Tensor:
    """Numbers of all cells of a grid, those of a block one after the other."""
    rows, columns = torch.arange(height)[:, None], torch.arange(width)
    block = rows // _TRIED * -(-width // _TRIED) + columns // _TRIED
    return block.flatten().argsort(stable=True)


def _tried(size: torch.Size) -> Tensor:
    """Numbers (n,) of the cells of a grid that are tried."""
    cells = torch.arange(size[0] * size[1]).view(size[0], size[1])
    first = [min(_TRIED // 2, side - 1) for side in size]
    return cells[first[0] :: _TRIED, first[1] :: _TRIED].flatten()


def _holders(
    view: int,
    points: Tensor,
    normals: Tensor,
    viewmats: Tensor,
    Ks: Tensor,
    focals: Tensor,
    logs: Tensor,
    known: Tensor,
    order: list[int],
    first: list[int],
) -> list[int]:
    """The photos, in their order (leaders first), that have one of some points (3, n) of a view at some time,
    and itself."""
    height, width = known.shape[1:]
    centres = torch.stack([invert_rigid(own)[:3, 3] for own in viewmats])
    towards = points - centres[..., None]  # (V, 3, n)
    distances = (towards * towards).sum(1).sqrt().clamp_min(1e-9)
    cosines = (towards * normals).sum(1).abs() / distances
    areas = (distances / focals[:, None]) ** 2 / cosines.clamp_min(1e-3)
    pos_c = viewmats[:, :3, :3] @ points + viewmats[:, :3, 3:]
    ahead = pos_c[:, 2].clamp_min(1e-8)
    x, y = (pos_c[:, a] / ahead * Ks[:, a, a, None] + Ks[:, a, 2, None] for a in (0, 1))
    inside = (pos_c[:, 2] > 0) & (x >= 0) & (x < width) & (y >= 0) & (y < height)
    place = torch.where(inside, y.floor() * width + x.floor(), 0.0).long()
    gap = ahead.log() - logs.gather(1, place)
    same = inside & known.flatten(1).gather(1, place) & (gap < BEHIND) & (gap > -BEFORE)
    same[view] = True
    finest, held = torch.full_like(points[0], torch.inf), []
    for other in order:
        takes = same[other] & _takes(areas[other], finest, other in first)
        if other == view or bool(takes.any()):
            held.append(other)
            finest = torch.where(takes, areas[other], finest)
    return held


def _takes(area: Tensor, finest: Tensor, begins: bool) -> Tensor:
    """(n,) bool: what a photo sees fine enough to have it, from whom has it by now; endless: nobody."""
    takes = _FINER * area < finest
    return takes if begins else takes & torch.isfinite(finest)


def _surface(depths: Tensor, viewmat: Tensor, K: Tensor) -> tuple[Tensor, Tensor]:
    """World points and unit normals (3, H*W)."""
    pos_c = unproject(depths, K)
    span_u, span_v = spans(pos_c, depths / K[0, 0])
    normals = F.normalize(torch.linalg.cross(span_u, span_v), dim=-1)
    pose = invert_rigid(viewmat)
    points = pose[:3, :3] @ pos_c.flatten(0, 1).T + pose[:3, 3:]
    return points, pose[:3, :3] @ normals.flatten(0, 1).T


def _covered_area(points: Tensor, normals: Tensor, viewmat: Tensor, focal: Tensor) -> Tensor:
    """(n,) of the surface, that one pixel of a photo covers; endless where it is seen edge-on."""
    towards = points - invert_rigid(viewmat)[:3, 3:]
    distances = (towards * towards).sum(0).sqrt().clamp_min(1e-9)  # `norm` over rows is ten times slower
    cosines = (towards * normals).sum(0).abs() / distances
    return (distances / focal) ** 2 / cosines.clamp_min(1e-3)


def _same(points: Tensor, viewmat: Tensor, K: Tensor, log_depths: Tensor, known: Tensor) -> Tensor:
    """(n,) bool: another view sees these points as its surface."""
    height, width = known.shape
    x, y, z = pictured(viewmat, K, points)
    inside = (z > 0) & (x >= 0) & (x < width) & (y >= 0) & (y < height)
    place = torch.where(inside, y.floor() * width + x.floor(), 0.0).long()
    gap = z.clamp_min(1e-9).log() - log_depths.index_select(0, place)
    return inside & known.flatten()[place] & (gap < BEHIND) & (gap > -BEFORE)


def _closed(keep: Tensor) -> Tensor:
    """Crumbs go, and what stays goes on by a cell on all sides, so that no seam opens."""
    some = F.avg_pool2d(keep[:, None].float(), 3, 1, 1, count_include_pad=False) > 0.5
    return F.max_pool2d(some.float(), 3, 1, 1)[:, 0] > 0
