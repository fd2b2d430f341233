"""Which photo covers which surface: where several see one, the one that sees it finest, and nothing
twice.

Photos come in their order: the first that sees a surface has it, and each later one takes it over where
it sees it finer by `_FINER` than who has it. So all pixels that show one surface find the same photo, however
many photos there are. What stands before a surface that another photo knows better is given up as well
(`consistency.seen_through`).

Sizes: V views, H W cells of the grid.
"""

import torch
from torch import Tensor
from torch.nn import functional as F

from langflash_core.geometry.cameras import invert_rigid, pictured, unproject
from langflash_core.geometry.surfels import spans

BEHIND, BEFORE = 0.12, 0.12
"""Log depth: how far behind and before another photo's surface a pixel still shows the same one."""
_ABOUT = 0.2  # relative depth by which what covers a cell may lie behind it
_FINER = 2.0  # area that a pixel of the earlier photo covers over that of a later one which takes it over


def owned(depths: Tensor, viewmats: Tensor, Ks: Tensor, known: Tensor | None = None) -> Tensor:
    """(V, H, W) bool: the cells of each photo that it covers itself.

    Args:
        depths: (V, H, W) > 0. viewmats: (V, 4, 4). Ks: (V, 3, 3), pixels of the depth maps.
        known: (V, H, W) bool, the cells that may cover anything; None: all.
    """
    known = torch.ones_like(depths, dtype=torch.bool) if known is None else known
    if len(depths) == 1:
        return known
    keep = torch.zeros_like(known)
    logs = depths.log().flatten(1)
    for view in range(len(depths)):
        points, normals = _surface(depths[view], viewmats[view], Ks[view])
        finest, mine = torch.full_like(points[0], torch.inf), torch.zeros_like(points[0], dtype=torch.bool)
        for other in range(len(depths)):
            area = _covered_area(points, normals, viewmats[other], Ks[other])
            takes = _FINER * area < finest
            if other != view:
                takes &= _same(points, viewmats[other], Ks[other], logs[other], known[other])
            finest = torch.where(takes, area, finest)
            mine = takes if other == view else mine & ~takes
        keep[view] = mine.view_as(keep[view])
    keep = _closed(keep) & known
    return keep | (known & ~covered(depths, viewmats, Ks, keep))


def covered(
    depths: Tensor, viewmats: Tensor, Ks: Tensor, keep: Tensor, anything: Tensor | None = None
) -> Tensor:
    """(V, H, W) bool: cells of each photo in which, or beside which, what is kept lies at about their depth
    or before it.

    Args:
        depths, viewmats, Ks: as `owned`. keep: (V, H, W) bool. anything: (V, H, W) bool, cells that what lies
            at any depth covers.
    """
    height, width = depths.shape[1:]
    points = [
        _surface(*of)[0][:, kept.flatten()] for *of, kept in zip(depths, viewmats, Ks, keep, strict=True)
    ]
    everything, found = torch.cat(points, 1), []
    farthest = (1 + _ABOUT) * depths
    if anything is not None:
        farthest = torch.where(anything, torch.inf, farthest)
    for limit, viewmat, K in zip(farthest, viewmats, Ks, strict=True):
        x, y, z = pictured(viewmat, K, everything)
        inside = (z > 0) & (x >= 0) & (x < width) & (y >= 0) & (y < height)
        hit = torch.zeros(height * width)
        place, z = (y.floor() * width + x.floor())[inside].long(), z[inside]
        hit[place[z < limit.flatten()[place]]] = 1
        found.append(F.max_pool2d(hit.view(1, 1, height, width), 3, 1, 1)[0, 0] > 0)
    return torch.stack(found)


def _surface(depths: Tensor, viewmat: Tensor, K: Tensor) -> tuple[Tensor, Tensor]:
    """World points and unit normals (3, H*W)."""
    pos_c = unproject(depths, K)
    span_u, span_v = spans(pos_c, depths / K[0, 0])
    normals = F.normalize(torch.linalg.cross(span_u, span_v), dim=-1)
    pose = invert_rigid(viewmat)
    points = pose[:3, :3] @ pos_c.flatten(0, 1).T + pose[:3, 3:]
    return points, pose[:3, :3] @ normals.flatten(0, 1).T


def _covered_area(points: Tensor, normals: Tensor, viewmat: Tensor, K: Tensor) -> Tensor:
    """(n,) of the surface, that one pixel of a view covers; endless where it is seen edge-on."""
    towards = points - invert_rigid(viewmat)[:3, 3:]
    distances = towards.norm(dim=0).clamp_min(1e-9)
    cosines = (towards * normals).sum(0).abs() / distances
    return (distances / K[0, 0]) ** 2 / cosines.clamp_min(1e-3)


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
