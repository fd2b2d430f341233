"""Model only what a scene needs: drop what cannot be seen, merge what is there twice.

Four cuts, in this order: Gaussians fainter than 1/255; Gaussians that two photos predicted for
the same piece of surface; weights below 1/255; atoms that no Gaussian carries.

Two Gaussians of different views are duplicates when their means are closer than one pixel of
either view covers at their depth (the footprint z / f), their colours agree, and so do their levels. Each
may absorb one Gaussian of each other view at most, so a finely seen surface stays finely covered.
"""

import time
from dataclasses import dataclass, replace

import torch
from torch import Tensor

from langflash_core.geometry.harmonics import SH_C0
from langflash_core.rig.projected import project_points
from langflash_core.scene.weights import renormalise
from langflash_core.surface.settings import PRUNING
from langflash_core.types import Gaussians, Scene, Semantics


@dataclass(frozen=True)
class _Sight:
    """What matching needs of every Gaussian: its own view, pixel footprint, and colour."""

    means: Tensor  # (3, N)
    opacities: Tensor  # (N,)
    views: Tensor  # (N,)
    footprints: Tensor  # (N,) scene units per pixel in its own view
    colours: Tensor  # (N, 3)
    levels: Tensor | None  # (N,)


def prune(
    scene: Scene, *, merge: bool = True, merge_radius: float = 1.0, colour_tolerance: float = 0.1
) -> Scene:
    """The scene without what no picture of it needs; its order of views is kept.

    Args:
        scene: with `view_ids`, or nothing is merged.
        merge: whether Gaussians may be there twice. merge_radius: in pixel footprints. colour_tolerance:
            largest difference of a channel.

    Returns:
        Scene with `pruning` in its record: counts before and after.

    Source: the linear compositing of the scene's colours and weights; two coincident layers
    o1, o2 composite to opacity 1 - (1 - o1)(1 - o2).
    """
    start = time.perf_counter()
    bright = scene.rows(scene.gaussians.opacities >= PRUNING.cut)
    merged = bright
    if merge:
        merged = _merge_groups(bright, _parents(_sight(bright), bright, merge_radius, colour_tolerance))
    small = sparser(merged)
    report = {
        "gaussians_before": len(scene.gaussians),
        "faint": len(scene.gaussians) - len(bright.gaussians),
        "merged": len(bright.gaussians) - len(merged.gaussians),
        "gaussians_after": len(small.gaussians),
        "atoms_before": scene.semantics.num_atoms,
        "atoms_after": small.semantics.num_atoms,
        "weights_before": int((scene.semantics.weight_values > 0).sum()),
        "weights_after": int((small.semantics.weight_values > 0).sum()),
    }
    cost = scene.record.cost
    cost = replace(cost, timings={**cost.timings, "pruning": time.perf_counter() - start})
    return small.with_record(pruning=report, cost=cost)


def _sight(scene: Scene) -> _Sight:
    gaussians = scene.gaussians
    views = torch.zeros_like(gaussians.opacities, dtype=torch.int64)
    views = views if scene.view_ids is None else scene.view_ids.to(views.device)
    rotations, shifts = scene.viewmats[:, 2, :3], scene.viewmats[:, 2, 3]
    depths = (rotations[views] * gaussians.means).sum(-1) + shifts[views]
    focal = (scene.Ks[:, 0, 0] + scene.Ks[:, 1, 1]) / 2
    footprints = depths.clamp_min(0) / focal[views]
    means, colours = gaussians.means.T.contiguous(), gaussians.sh[:, 0] * SH_C0
    return _Sight(means, gaussians.opacities, views, footprints, colours, scene.levels)


def _parents(sight: _Sight, scene: Scene, radius: float, colour_tolerance: float) -> Tensor:
    """(N,) the Gaussian of an earlier view that each one duplicates, or itself."""
    parents = torch.arange(len(sight.views), device=sight.views.device)
    pixel_maps: list[Tensor] = []
    for view in range(scene.num_views):
        rows = (sight.views == view).nonzero().squeeze(1)
        for earlier, pixel_map in enumerate(pixel_maps):
            near, candidates = _nearest(sight, rows, pixel_map, scene, earlier)
            children, found = _pairs(sight, near, candidates, radius, colour_tolerance)
            parents[children] = found
            rows = rows[parents[rows] == rows]
        pixel_maps.append(_pixel_map(sight, rows, scene, view))
    return parents


def _pixels(points: Tensor, scene: Scene, view: int) -> tuple[Tensor, Tensor]:
    """Columns and lines (n,) of world points (3, n) in a view; far outside where they lie behind it."""
    width, height = scene.view_size
    there = project_points(points, scene.viewmats[view], scene.Ks[view], (height, width))
    x, y = (torch.where(there.z > 0, along, -1e6).clamp(-1e6, 1e6) for along in (there.x, there.y))
    return x, y


def _pixel_map(sight: _Sight, rows: Tensor, scene: Scene, view: int) -> Tensor:
    """(H + 2, W + 2) of the most opaque Gaussian per pixel, -1 where none; a border of -1."""
    width, height = scene.view_size
    pixels = _pixels(sight.means.index_select(1, rows), scene, view)
    column, line = (along.floor().long() + 1 for along in pixels)
    inside = (column >= 1) & (column <= width) & (line >= 1) & (line <= height)
    rows, places = rows[inside], (line * (width + 2) + column)[inside]
    chosen = _first_of_each(places, -sight.opacities[rows], (height + 2) * (width + 2))
    pixel_map = torch.full(((height + 2) * (width + 2),), -1, device=rows.device)
    pixel_map[places[chosen]] = rows[chosen]
    return pixel_map.view(height + 2, width + 2)


def _nearest(
    sight: _Sight, rows: Tensor, pixel_map: Tensor, scene: Scene, view: int
) -> tuple[Tensor, Tensor]:
    """Those of the rows (n,) that have Gaussians of `view` in the four pixels around their place there, and
    these (n, 4), -1 for none."""
    height, width = pixel_map.shape
    pixels = _pixels(sight.means.index_select(1, rows), scene, view)
    column, line = ((along + 0.5).floor().long() for along in pixels)  # +1 border, -0.5 centre
    inside = (column >= 0) & (column < width - 1) & (line >= 0) & (line < height - 1)
    rows, first = rows[inside], (line * width + column)[inside]
    around = torch.tensor([0, 1, width, width + 1], device=rows.device)
    candidates = _gather_rows(pixel_map.flatten(), first[:, None] + around)
    some = candidates.amax(-1) >= 0
    return rows[some], candidates[some]


def _pairs(
    sight: _Sight, rows: Tensor, candidates: Tensor, radius: float, colour_tolerance: float
) -> tuple[Tensor, Tensor]:
    """Children (c,) and their parents (c,), no parent twice; colours are looked at where places agree."""
    there = candidates.clamp_min(0)
    x, y, z = (_gather_rows(along, there) - along.index_select(0, rows)[:, None] for along in sight.means)
    distances = (x * x + y * y + z * z).sqrt()
    reach = radius * torch.minimum(_gather_rows(sight.footprints, there), sight.footprints[rows, None])
    close = (candidates >= 0) & (distances < reach)
    some = close.any(-1)
    rows, there, close, distances = rows[some], there[some], close[some], distances[some]
    colour_gap = (sight.colours[there] - sight.colours[rows, None]).abs().amax(-1)
    same = close & (colour_gap < colour_tolerance)
    if sight.levels is not None:  # detail that took a coarse one in would open the coarse picture
        same &= sight.levels[there] == sight.levels[rows, None]
    distances, which = torch.where(same, distances, torch.inf).min(-1)
    matched = torch.isfinite(distances).nonzero().squeeze(1)
    found = there[matched, which[matched]]
    chosen = _first_of_each(found, distances[matched], len(sight.views))
    return rows[matched[chosen]], found[chosen]


def _gather_rows(values: Tensor, ids: Tensor) -> Tensor:
    """`values[ids]` of ids (n, m), which `index_select` finds in a third of the time."""
    return values.index_select(0, ids.flatten()).unflatten(0, ids.shape)


def _first_of_each(keys: Tensor, costs: Tensor, num_keys: int) -> Tensor:
    """Positions of the cheapest entry per key; ties go to the first entry."""
    order = torch.argsort(costs, stable=True)
    ranks = torch.empty_like(order)
    ranks[order] = torch.arange(len(order), device=order.device)
    best = torch.full((num_keys,), len(order), device=order.device)
    best = best.scatter_reduce(0, keys, ranks, "amin")
    return order[best[best < len(order)]]


def _merge_groups(scene: Scene, parents: Tensor) -> Scene:
    """Every group becomes one Gaussian in its parent's row, of its level and its confidence.

    Places, colours, and weights are opacity-weighted means, the shape is the most opaque
    member's, and the opacity is what the layers composite to.
    """
    gaussians, semantics = scene.gaussians, scene.semantics
    survivors = parents == torch.arange(len(parents), device=parents.device)
    children = (~survivors).nonzero().squeeze(1)
    if len(children) == 0:
        return scene
    heads, group = torch.unique(parents[children], return_inverse=True)  # (G,), (c,)
    members = torch.cat((heads, children))
    group = torch.cat((torch.arange(len(heads), device=group.device), group))
    opacities = gaussians.opacities[members]
    shares = opacities / _group_sum(opacities, group, len(heads))[group]
    winners = members[_first_of_each(group, -opacities, len(heads))]
    through = _group_sum(torch.log1p(-opacities.clamp_max(PRUNING.max_opacity)), group, len(heads))

    def blended(field: Tensor) -> Tensor:
        share = shares.view(-1, *(1,) * (field.ndim - 1))
        return field.index_copy(0, heads, _group_sum(field[members] * share, group, len(heads)))

    merged = Gaussians(
        means=blended(gaussians.means),
        quats=gaussians.quats.index_copy(0, heads, gaussians.quats[winners]),
        scales=gaussians.scales.index_copy(0, heads, gaussians.scales[winners]),
        opacities=gaussians.opacities.index_copy(0, heads, -torch.expm1(through)),
        sh=blended(gaussians.sh),
    )
    if semantics.weight_ids.shape[1]:
        ids, values = _blended_weights(semantics.rows(members), shares, group)
        semantics = replace(
            semantics,
            weight_ids=semantics.weight_ids.index_copy(0, heads, ids),
            weight_values=semantics.weight_values.index_copy(0, heads, values),
        )
    return replace(scene, gaussians=merged, semantics=semantics).rows(survivors)


def _group_sum(values: Tensor, group: Tensor, num_groups: int) -> Tensor:
    return values.new_zeros(num_groups, *values.shape[1:]).index_add(0, group, values)


def _blended_weights(members: Semantics, shares: Tensor, group: Tensor) -> tuple[Tensor, Tensor]:
    """Sum of the members' sparse weights, times their shares, per group; again the top m of them."""
    ids, values, num_atoms = members.weight_ids, members.weight_values * shares[:, None], members.num_atoms
    num_groups, top_m = int(group.max()) + 1, ids.shape[1]
    parts = []
    for first in range(0, num_groups, PRUNING.chunk):
        count = min(PRUNING.chunk, num_groups - first)
        here = (group >= first) & (group < first + count)
        flat = (group[here, None] - first) * num_atoms + ids[here]
        dense = values.new_zeros(count * num_atoms).index_add(0, flat.flatten(), values[here].flatten())
        parts.append(dense.view(count, num_atoms).topk(min(top_m, num_atoms), dim=-1))
    top_values = torch.cat([part.values for part in parts])
    return torch.cat([part.indices for part in parts]), renormalise(top_values)


def sparser(scene: Scene) -> Scene:
    """Weights below 1/255 become 0, empty columns and unused atoms go, ids are renumbered."""
    semantics, ids, values = scene.semantics, scene.semantics.weight_ids, scene.semantics.weight_values
    values = renormalise(torch.where(values >= PRUNING.cut, values, 0.0))
    values, order = values.sort(dim=-1, descending=True, stable=True)
    ids = ids.gather(1, order)
    kept_columns = int((values > 0).any(0).sum())
    ids, values = ids[:, :kept_columns], values[:, :kept_columns]
    used = torch.zeros(semantics.num_atoms, dtype=torch.bool, device=ids.device)
    used[ids[values > 0]] = True
    renumbered = (used.cumsum(0) - 1).clamp_min(0)
    ids = torch.where(values > 0, renumbered[ids] if kept_columns else ids, 0)
    record = scene.record
    record = replace(
        record,
        atom_names={int(renumbered[k]): name for k, name in record.atom_names.items() if used[k]},
        atom_denials={int(renumbered[k]): said for k, said in record.atom_denials.items() if used[k]},
        silent_atoms=tuple(int(renumbered[k]) for k in record.silent_atoms if used[k]),
        lone_atoms=tuple(int(renumbered[k]) for k in record.lone_atoms if used[k]),
    )
    sparse = Semantics(ids, values, semantics.dictionary[used], semantics.space)
    return replace(scene, semantics=sparse, record=record)
