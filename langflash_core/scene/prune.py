"""Model only what a scene needs: drop what cannot be seen, merge what is there twice.

Four cuts, in this order: Gaussians fainter than 1/255; Gaussians that two photos predicted for
the same piece of surface; weights below 1/255; atoms that no Gaussian carries.

Two Gaussians of different views are duplicates when their means are closer than one pixel of
either view covers at their depth (the footprint z / f) and their colours agree. Each may absorb
one Gaussian of each other view at most, so a finely seen surface stays finely covered.
"""

import time
from dataclasses import dataclass

import torch
from torch import Tensor

from langflash_core.geometry.cameras import project, transform
from langflash_core.geometry.harmonics import SH_C0
from langflash_core.scene.assemble import renormalised
from langflash_core.scene.fields import stored_bytes
from langflash_core.types import Gaussians, Scene, Semantics

CUT = 1 / 255  # the smallest step of an 8-bit picture
_MAX_OPACITY = 0.9999  # log(1 - o) stays finite
_CHUNK = 65_536  # merged Gaussians whose dense weights are held at once


@dataclass(frozen=True)
class _Sight:
    """What matching needs of every Gaussian: its own view, pixel footprint, and colour."""

    means: Tensor  # (N, 3)
    opacities: Tensor  # (N,)
    views: Tensor  # (N,)
    footprints: Tensor  # (N,) scene units per pixel in its own view
    colours: Tensor  # (N, 3)


def prune(scene: Scene, *, merge_radius: float = 1.0, colour_tolerance: float = 0.1) -> Scene:
    """The scene without what no picture of it needs; its order of views is kept.

    Args:
        scene: with `gaussians_per_view` in its metadata, or nothing is merged.
        merge_radius: in pixel footprints. colour_tolerance: largest difference of a channel.

    Returns:
        Scene with `metadata["pruning"]`: counts and bytes before and after, seconds.

    Source: the linear compositing of the scene's colours and weights; two coincident layers
    o1, o2 composite to opacity 1 - (1 - o1)(1 - o2).
    """
    start = time.perf_counter()
    views = _view_ids(scene)
    bright = scene.gaussians.opacities >= CUT
    gaussians, ids, values = _rows(scene, bright)
    views = views[bright]
    parents = _parents(_sight(gaussians, views, scene), scene, merge_radius, colour_tolerance)
    gaussians, ids, values = _merged(gaussians, ids, values, parents, scene.semantics.num_atoms)
    survivors = parents == torch.arange(len(parents), device=parents.device)
    semantics = _sparser(ids, values, scene.semantics)
    small = Scene(
        gaussians, semantics, scene.viewmats, scene.Ks, scene.view_size, scene.photos, scene.metadata
    )
    report: dict[str, float] = {
        "gaussians_before": len(scene.gaussians),
        "faint": int((~bright).sum()),
        "merged": int((~survivors).sum()),
        "gaussians_after": len(gaussians),
        "atoms_before": scene.semantics.num_atoms,
        "atoms_after": semantics.num_atoms,
        "weights_before": int((scene.semantics.weight_values > 0).sum()),
        "weights_after": int((semantics.weight_values > 0).sum()),
        "bytes_before": stored_bytes(scene),
        "bytes_after": stored_bytes(small),
    }
    changes: dict = {"pruning": report}
    if "gaussians_per_view" in scene.metadata:
        counts = torch.bincount(views[survivors], minlength=scene.num_views)
        changes["gaussians_per_view"] = counts.tolist()
    report["seconds"] = time.perf_counter() - start
    changes["timings"] = {**scene.metadata.get("timings", {}), "pruning": report["seconds"]}
    return small.with_metadata(**changes)


def _view_ids(scene: Scene) -> Tensor:
    """(N,) index of the view each Gaussian was predicted from; all 0 where that is unknown."""
    device = scene.gaussians.means.device
    counts = scene.metadata.get("gaussians_per_view")
    if not counts or sum(counts) != len(scene.gaussians) or len(counts) != scene.num_views:
        return torch.zeros(len(scene.gaussians), dtype=torch.long, device=device)
    return torch.arange(len(counts), device=device).repeat_interleave(torch.tensor(counts, device=device))


def _rows(scene: Scene, keep: Tensor) -> tuple[Gaussians, Tensor, Tensor]:
    semantics = scene.semantics
    kept = scene.gaussians.map(lambda values: values[keep])
    return kept, semantics.weight_ids[keep], semantics.weight_values[keep]


def _sight(gaussians: Gaussians, views: Tensor, scene: Scene) -> _Sight:
    rotations, shifts = scene.viewmats[:, 2, :3], scene.viewmats[:, 2, 3]
    depths = (rotations[views] * gaussians.means).sum(-1) + shifts[views]
    focal = (scene.Ks[:, 0, 0] + scene.Ks[:, 1, 1]) / 2
    footprints = depths.clamp_min(0) / focal[views]
    return _Sight(gaussians.means, gaussians.opacities, views, footprints, gaussians.sh[:, 0] * SH_C0)


def _parents(sight: _Sight, scene: Scene, radius: float, colour_tolerance: float) -> Tensor:
    """(N,) the Gaussian of an earlier view that each one duplicates, or itself."""
    parents = torch.arange(len(sight.means), device=sight.means.device)
    pixel_maps: list[Tensor] = []
    for view in range(scene.num_views):
        rows = (sight.views == view).nonzero().squeeze(1)
        for earlier, pixel_map in enumerate(pixel_maps):
            candidates = _nearest(sight, rows, pixel_map, scene, earlier)
            children, found = _pairs(sight, rows, candidates, radius, colour_tolerance)
            parents[children] = found
            rows = rows[parents[rows] == rows]
        pixel_maps.append(_pixel_map(sight, rows, scene, view))
    return parents


def _pixels(points: Tensor, scene: Scene, view: int) -> Tensor:
    """(n, 2) pixels of world points in a view; far outside where they lie behind it."""
    pos_c = transform(scene.viewmats[view], points)
    pos_px = project(pos_c, scene.Ks[view])
    return torch.where(pos_c[:, 2:] > 0, pos_px, -1e6).clamp(-1e6, 1e6)


def _pixel_map(sight: _Sight, rows: Tensor, scene: Scene, view: int) -> Tensor:
    """(H + 2, W + 2) of the most opaque Gaussian per pixel, -1 where none; a border of -1."""
    width, height = scene.view_size
    column, line = (_pixels(sight.means[rows], scene, view).floor().long() + 1).unbind(-1)
    inside = (column >= 1) & (column <= width) & (line >= 1) & (line <= height)
    rows, places = rows[inside], (line * (width + 2) + column)[inside]
    chosen = _first_of_each(places, -sight.opacities[rows], (height + 2) * (width + 2))
    pixel_map = torch.full(((height + 2) * (width + 2),), -1, device=rows.device)
    pixel_map[places[chosen]] = rows[chosen]
    return pixel_map.view(height + 2, width + 2)


def _nearest(sight: _Sight, rows: Tensor, pixel_map: Tensor, scene: Scene, view: int) -> Tensor:
    """(n, 4) Gaussians of `view` in the four pixels around each row's place there, -1 for none."""
    height, width = pixel_map.shape
    corner = (_pixels(sight.means[rows], scene, view) + 0.5).floor().long()  # +1 border, -0.5 centre
    columns = torch.stack((corner[:, 0], corner[:, 0] + 1), -1).clamp(0, width - 1)
    lines = torch.stack((corner[:, 1], corner[:, 1] + 1), -1).clamp(0, height - 1)
    return pixel_map[lines[:, :, None], columns[:, None, :]].flatten(1)


def _pairs(
    sight: _Sight, rows: Tensor, candidates: Tensor, radius: float, colour_tolerance: float
) -> tuple[Tensor, Tensor]:
    """Children (c,) and their parents (c,), no parent twice."""
    there = candidates.clamp_min(0)
    distances = (sight.means[there] - sight.means[rows, None]).norm(dim=-1)
    reach = radius * torch.minimum(sight.footprints[there], sight.footprints[rows, None])
    colour_gap = (sight.colours[there] - sight.colours[rows, None]).abs().amax(-1)
    same = (candidates >= 0) & (distances < reach) & (colour_gap < colour_tolerance)
    distances, which = torch.where(same, distances, torch.inf).min(-1)
    matched = torch.isfinite(distances).nonzero().squeeze(1)
    found = there[matched, which[matched]]
    chosen = _first_of_each(found, distances[matched], len(sight.means))
    return rows[matched[chosen]], found[chosen]


def _first_of_each(keys: Tensor, costs: Tensor, num_keys: int) -> Tensor:
    """Positions of the cheapest entry per key; ties go to the first entry."""
    order = torch.argsort(costs, stable=True)
    ranks = torch.empty_like(order)
    ranks[order] = torch.arange(len(order), device=order.device)
    best = torch.full((num_keys,), len(order), device=order.device)
    best = best.scatter_reduce(0, keys, ranks, "amin")
    return order[best[best < len(order)]]


def _merged(
    gaussians: Gaussians, ids: Tensor, values: Tensor, parents: Tensor, num_atoms: int
) -> tuple[Gaussians, Tensor, Tensor]:
    """Every group becomes one Gaussian in its parent's row.

    Places, colours, and weights are opacity-weighted means, the shape is the most opaque
    member's, and the opacity is what the layers composite to.
    """
    own = torch.arange(len(parents), device=parents.device)
    children = (parents != own).nonzero().squeeze(1)
    survivors = parents == own
    if len(children) == 0:
        return gaussians, ids, values
    heads, group = torch.unique(parents[children], return_inverse=True)  # (G,), (c,)
    members = torch.cat((heads, children))
    group = torch.cat((torch.arange(len(heads), device=group.device), group))
    opacities = gaussians.opacities[members]
    shares = opacities / _group_sum(opacities, group, len(heads))[group]
    winners = members[_first_of_each(group, -opacities, len(heads))]
    through = _group_sum(torch.log1p(-opacities.clamp_max(_MAX_OPACITY)), group, len(heads))

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
    if ids.shape[1]:
        head_ids, head_values = _blended_weights(
            ids[members], values[members] * shares[:, None], group, num_atoms
        )
        ids, values = ids.index_copy(0, heads, head_ids), values.index_copy(0, heads, head_values)
    return merged.map(lambda field: field[survivors]), ids[survivors], values[survivors]


def _group_sum(values: Tensor, group: Tensor, num_groups: int) -> Tensor:
    return values.new_zeros(num_groups, *values.shape[1:]).index_add(0, group, values)


def _blended_weights(ids: Tensor, values: Tensor, group: Tensor, num_atoms: int) -> tuple[Tensor, Tensor]:
    """Sum of the members' sparse weights per group, again the top m of them."""
    num_groups, top_m = int(group.max()) + 1, ids.shape[1]
    parts = []
    for first in range(0, num_groups, _CHUNK):
        count = min(_CHUNK, num_groups - first)
        here = (group >= first) & (group < first + count)
        flat = (group[here, None] - first) * num_atoms + ids[here]
        dense = values.new_zeros(count * num_atoms).index_add(0, flat.flatten(), values[here].flatten())
        parts.append(dense.view(count, num_atoms).topk(min(top_m, num_atoms), dim=-1))
    top_values = torch.cat([part.values for part in parts])
    return torch.cat([part.indices for part in parts]), renormalised(top_values)


def _sparser(ids: Tensor, values: Tensor, semantics: Semantics) -> Semantics:
    """Weights below 1/255 become 0, empty columns and unused atoms go, ids are renumbered."""
    values = renormalised(torch.where(values >= CUT, values, 0.0))
    values, order = values.sort(dim=-1, descending=True, stable=True)
    ids = ids.gather(1, order)
    kept_columns = int((values > 0).any(0).sum())
    ids, values = ids[:, :kept_columns], values[:, :kept_columns]
    used = torch.zeros(semantics.num_atoms, dtype=torch.bool, device=ids.device)
    used[ids[values > 0]] = True
    renumbered = (used.cumsum(0) - 1).clamp_min(0)
    ids = torch.where(values > 0, renumbered[ids] if kept_columns else ids, 0)
    return Semantics(ids, values, semantics.dictionary[used], semantics.space)
