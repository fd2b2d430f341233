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
from jaxtyping import Bool
from torch import Tensor
from torch.nn import functional as F

from langflash_core.geometry.surfels import spans
from langflash_core.geometry.vantage import from_the_middle, leading
from langflash_core.rig.rig import Rig
from langflash_core.surface.settings import VIEW_SELECTION

_TRIED, _BORDER = VIEW_SELECTION.tried, VIEW_SELECTION.border
_FINER, _ALL = VIEW_SELECTION.finer, VIEW_SELECTION.all


def select_views(rig: Rig, known: Bool[Tensor, "V H W"] | None = None) -> Bool[Tensor, "V H W"]:
    """(V, H, W) bool: the cells of each photo that it covers itself.

    Args:
        known: (V, H, W) bool, the cells that may cover anything; None: all.
    """
    known = torch.ones_like(rig.depths, dtype=torch.bool) if known is None else known
    if len(rig) == 1:
        return known
    first = leading(rig.depths, rig.viewmats)
    order = sorted(from_the_middle(rig.depths, rig.viewmats), key=lambda view: view not in first)
    keep, takers = torch.zeros_like(known), _takers(known, first)
    for view in range(len(rig)):
        points, normals = _surface(rig, view)
        finest, mine = torch.full_like(points[0], torch.inf), torch.zeros_like(points[0], dtype=torch.bool)
        others = order
        if len(rig) > _ALL:
            tried = _tried_cells(rig.size)
            others = _holders(view, points[:, tried], normals[:, tried], rig, takers, order, first)
        for other in others:
            area = _covered_area(points, normals, rig, other)
            takes = _takes(area, finest, other in first)
            if other != view:
                takes &= _same(points, rig, other, takers[other])
            finest = torch.where(takes, area, finest)
            mine = takes if other == view else mine & ~takes
        keep[view] = mine.view_as(keep[view])
    return fill_uncovered(rig, _close_mask(keep) & known, known)


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


def fill_uncovered(
    rig: Rig,
    keep: Bool[Tensor, "V H W"],
    known: Bool[Tensor, "V H W"],
    anything: Bool[Tensor, "V H W"] | None = None,
) -> Bool[Tensor, "V H W"]:
    """(V, H, W) bool: what is kept, and what that leaves uncovered, of the first photo that knows it: each
    one's cells count as kept for those after it, so that many photos do not all fill one gap.

    Args:
        keep, known: (V, H, W) bool, as `select_views`. anything: as `find_covered`.
    """
    bare, found = known & ~find_covered(rig, keep, anything), keep.clone()
    before = rig.depths.new_zeros(3, 0)
    for view in from_the_middle(rig.depths, rig.viewmats):
        if not bool(bare[view].any()):
            continue
        own = bare[view] & ~_hit(before, rig, view, (1 + VIEW_SELECTION.about) * rig.depths[view])
        found[view] |= own
        before = torch.cat((before, rig.points(view)[:, own.flatten()]), 1)
    return found


def find_covered(
    rig: Rig, keep: Bool[Tensor, "V H W"], anything: Bool[Tensor, "V H W"] | None = None
) -> Bool[Tensor, "V H W"]:
    """(V, H, W) bool: cells of each photo in which, or beside which, what is kept lies at about their depth
    or before it.

    Args:
        keep: (V, H, W) bool. anything: (V, H, W) bool, cells that what lies at any depth covers.
    """
    order = _block_by_block(*rig.size)
    points = [rig.points(view)[:, order[kept.flatten()[order]]] for view, kept in enumerate(keep)]
    everything, found = _Blocks.of(torch.cat(points, 1)), []
    farthest = (1 + VIEW_SELECTION.about) * rig.depths
    if anything is not None:
        farthest = torch.where(anything, torch.inf, farthest)
    for view, limit in enumerate(farthest):
        some = everything.before(rig.viewmats[view], rig.Ks[view], rig.size)
        found.append(_hit(some, rig, view, limit))
    return torch.stack(found)


def _hit(points: Tensor, rig: Rig, view: int, farthest: Tensor) -> Tensor:
    """(H, W) bool: cells of a photo in which, or beside which, one of the points (3, m) lies before
    `farthest`."""
    there = rig.project(points, view)
    before = there.inside & (there.z < there.looked_up(farthest.flatten()))
    hit = torch.zeros(farthest.numel())
    hit[there.pixels[before]] = 1
    return F.max_pool2d(hit.view(1, 1, *rig.size), 3, 1, 1)[0, 0] > 0


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


def _tried_cells(size: tuple[int, int]) -> Tensor:
    """Numbers (n,) of the cells of a grid that are tried."""
    cells = torch.arange(size[0] * size[1]).view(size[0], size[1])
    first = [min(_TRIED // 2, side - 1) for side in size]
    return cells[first[0] :: _TRIED, first[1] :: _TRIED].flatten()


def _holders(
    view: int, points: Tensor, normals: Tensor, rig: Rig, known: Tensor, order: list[int], first: list[int]
) -> list[int]:
    """The photos, in their order (leaders first), that have one of some points (3, n) of a view at some time,
    and itself."""
    areas = _covered_area(points, normals, rig, slice(None))
    same = _same(points, rig, slice(None), known)
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


def _surface(rig: Rig, view: int) -> tuple[Tensor, Tensor]:
    """World points and unit normals (3, H*W)."""
    pos_c = rig.in_camera(view)
    span_u, span_v = spans(pos_c, rig.depths[view] / rig.Ks[view, 0, 0])
    normals = F.normalize(torch.linalg.cross(span_u, span_v), dim=-1)
    return rig.in_world(pos_c.flatten(0, 1).T, view), rig.poses[view, :3, :3] @ normals.flatten(0, 1).T


def _covered_area(points: Tensor, normals: Tensor, rig: Rig, views: int | slice) -> Tensor:
    """(..., n) of the surface, that one pixel of a photo covers, or of each of several; endless where it is
    seen edge-on."""
    towards = points - rig.poses[views, :3, 3:]
    distances = (towards * towards).sum(-2).sqrt().clamp_min(1e-9)  # `norm` over rows is ten times slower
    cosines = (towards * normals).sum(-2).abs() / distances
    return (distances / rig.Ks[views, 0, 0, None]) ** 2 / cosines.clamp_min(1e-3)


def _same(points: Tensor, rig: Rig, views: int | slice, known: Tensor) -> Tensor:
    """(..., n) bool: another photo sees these points as its surface, or each of several does.

    Args:
        known: (..., H, W) bool, of those photos.
    """
    there = rig.project(points, views)
    gap = there.z.clamp_min(1e-9).log() - there.looked_up(rig.log_depths[views].flatten(-2))
    near = (gap < VIEW_SELECTION.behind) & (gap > -VIEW_SELECTION.before)
    return there.inside & there.looked_up(known.flatten(-2)) & near


def _close_mask(keep: Tensor) -> Tensor:
    """Crumbs go, and what stays goes on by a cell on all sides, so that no seam opens."""
    some = F.avg_pool2d(keep[:, None].float(), 3, 1, 1, count_include_pad=False) > 0.5
    return F.max_pool2d(some.float(), 3, 1, 1)[:, 0] > 0
