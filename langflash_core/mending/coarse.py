"""A part of a scene as blocks: what it was cannot be told from them.

Space is parted into cubes of side b. All Gaussians of the part in one cube become one block: the mean of
their places, of their colours and of their weights over atoms, each by the opacity times area that carries
it, then rounded: places to b / 8, colours to 16 levels. Harmonics go. A block lies as the part does on the
whole within three cubes around it, so a screen stays flat while nothing finer than a cube is left of a face.
It is drawn by flat tiles, b / 6 apart, where it had members: of its one colour (pixels), or of colours that
run from block to block (blurred). Both are made of nothing but the means, and of an outline in steps of b /
6.

Sizes: N Gaussians of the part, B blocks.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import torch
from scipy.spatial import KDTree
from torch import Tensor
from torch.nn.functional import normalize

from langflash_core.geometry.harmonics import SH_C0, colour_to_sh
from langflash_core.geometry.quaternions import matrices_to_quats
from langflash_core.geometry.surfels import covered_areas
from langflash_core.mending.settings import COARSENING
from langflash_core.scene.weights import renormalise, sparse_weights
from langflash_core.types import Gaussians, Scene, Semantics


@dataclass(frozen=True)
class _Blocks:
    """means, colours (B, 3); axes (B, 3, 3), columns: right, down and normal; side: of all."""

    means: Tensor
    colours: Tensor
    axes: Tensor
    side: float


def coarsen(part: Scene, side: float, *, squares: bool) -> Scene:
    """The part of a scene as blocks of a side, scene units.

    Args:
        part: N >= 1 Gaussians; those that are not finite or show nothing are left out.
        squares: as pixels; else blurred.

    Returns:
        A scene of its own: all of level 0, without harmonics, surely there.

    Raises:
        ValueError: the side is not above 0.
    """
    if not side > 0:
        raise ValueError(f"side: expected a length above 0, received {side}")
    areas = torch.from_numpy(covered_areas(part.gaussians))
    part, areas = part.rows(areas > 0), areas[areas > 0]
    places = np.floor(part.gaussians.means.double().numpy() / side).astype(np.int64)
    cells, cube = np.unique(places, axis=0, return_inverse=True)
    cube = cube.reshape(-1)
    mean = _means_by(torch.from_numpy(cube), areas, len(cells))
    blocks = _blocks(part.gaussians, mean, cells, side)
    places, of = _tiles(blocks, part.gaussians.means.double(), torch.from_numpy(cube))
    colours = blocks.colours[of] if squares else _run_together(blocks, places, of)
    views, sure = part.view_ids, part.confidences
    return replace(
        part,
        gaussians=_flat(blocks, places, of, colours),
        semantics=_semantics(part, areas, cube, len(cells), of),
        view_ids=None if views is None else _a_view(part, cube, len(cells))[of],
        levels=None if part.levels is None else torch.zeros(len(of), dtype=torch.uint8),
        confidences=None if sure is None else quantise_colours(mean(sure[:, None])[of, 0]).float(),
    )


def quantise_colours(colours: Tensor) -> Tensor:
    """Colours in [0, 1], each channel one of `COARSENING.levels`."""
    return (colours.clamp(0, 1) * (COARSENING.levels - 1)).round() / (COARSENING.levels - 1)


def _means_by(cube: Tensor, areas: Tensor, count: int) -> Callable[[Tensor], Tensor]:
    """What takes (N, n) to their means (B, n) by area."""
    totals = torch.zeros(count, dtype=torch.float64).index_add(0, cube, areas)

    def mean(values: Tensor) -> Tensor:
        sums = torch.zeros(count, values.shape[1], dtype=torch.float64)
        return sums.index_add(0, cube, values.double() * areas[:, None]) / totals[:, None]

    return mean


def _blocks(
    gaussians: Gaussians, mean: Callable[[Tensor], Tensor], cells: np.ndarray, side: float
) -> _Blocks:
    step = side / COARSENING.places
    means = ((mean(gaussians.means) / step).floor() + 0.5) * step
    colours = quantise_colours(mean(0.5 + SH_C0 * gaussians.sh[:, 0]))
    return _Blocks(means, colours, _axes(means, cells), side)


def _axes(means: Tensor, cells: np.ndarray) -> Tensor:
    """How blocks lie: the plane through those in the 3 x 3 x 3 cubes around each."""
    numbers = {tuple(cell): number for number, cell in enumerate(cells.tolist())}
    around = [(x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1)]
    normals = torch.zeros_like(means)
    for number, (x, y, z) in enumerate(cells.tolist()):
        near = [numbers[at] for dx, dy, dz in around if (at := (x + dx, y + dy, z + dz)) in numbers]
        apart = means[near] - means[near].mean(0)
        normals[number] = torch.linalg.eigh(apart.T @ apart).eigenvectors[:, 0]
    down = torch.tensor([0.0, 1.0, 0.0], dtype=means.dtype).expand_as(normals)
    level = (normals * down).sum(1).abs() > 0.9
    down = torch.where(level[:, None], torch.tensor([0.0, 0.0, 1.0], dtype=means.dtype), down)
    right = normalize(torch.linalg.cross(down, normals), dim=-1)
    return torch.stack((right, torch.linalg.cross(normals, right), normals), -1)


def _tiles(blocks: _Blocks, members: Tensor, cube: Tensor) -> tuple[Tensor, Tensor]:
    """Places (n, 3) of tiles on the blocks' planes, a sixth of a block apart, where members (N, 3) of theirs
    lie over them; and the block (n,) of each."""
    pitch = blocks.side / COARSENING.tiles
    apart = torch.einsum("nij,ni->nj", blocks.axes[cube], members - blocks.means[cube])
    sites = torch.cat((cube[:, None], (apart[:, :2] / pitch).round().long()), 1).unique(dim=0)
    of, along = sites[:, 0], sites[:, 1:].double() * pitch
    return blocks.means[of] + torch.einsum("nij,nj->ni", blocks.axes[of][..., :2], along), of


def _run_together(blocks: _Blocks, places: Tensor, of: Tensor) -> Tensor:
    """Colours (n, 3) at places, of the blocks around each, by a bell as wide as a block."""
    near = min(COARSENING.around, len(blocks.means))
    distances, which = KDTree(blocks.means.numpy()).query(places.numpy(), k=near)
    distances, which = np.reshape(distances, (len(of), near)), np.reshape(which, (len(of), near))
    bells = np.exp(-2 * (distances / blocks.side) ** 2) + 1e-12
    return torch.from_numpy((bells[..., None] * blocks.colours.numpy()[which]).sum(1) / bells.sum(1)[:, None])


def _flat(blocks: _Blocks, places: Tensor, of: Tensor, colours: Tensor) -> Gaussians:
    pitch = blocks.side / COARSENING.tiles
    scales = pitch * torch.tensor([COARSENING.cover, COARSENING.cover, COARSENING.thin * COARSENING.cover])
    return Gaussians(
        means=places.float(),
        quats=matrices_to_quats(blocks.axes)[of].float(),
        scales=scales.repeat(len(of), 1),
        opacities=torch.full((len(of),), COARSENING.opacity),
        sh=colour_to_sh(colours)[:, None].float(),
    )


def _semantics(part: Scene, areas: Tensor, cube: np.ndarray, num_blocks: int, of: Tensor) -> Semantics:
    """Of each block the strongest of its members' mean weights, in `COARSENING.levels`."""
    semantics = part.semantics
    most = semantics.weight_ids.shape[1]
    if not semantics.num_atoms or not most:
        return semantics.rows(torch.zeros_like(of))
    count = semantics.num_atoms
    flat = torch.from_numpy(cube)[:, None] * count + semantics.weight_ids
    carried = (semantics.weight_values.double() * areas[:, None]).flatten()
    sums = torch.zeros(num_blocks * count, dtype=torch.float64).index_add(0, flat.flatten(), carried)
    ids, values = sparse_weights(sums.view(num_blocks, count).float(), most)
    values = renormalise((values * (COARSENING.levels - 1)).round())
    return replace(semantics, weight_ids=ids[of], weight_values=values[of])


def _a_view(part: Scene, cube: np.ndarray, count: int) -> Tensor:
    """(B,) a view that made a member of each block; of layers none, so that all of them have it."""
    views = torch.full((count,), -1, dtype=torch.int64)
    if part.layered:
        return views
    assert part.view_ids is not None
    return views.scatter_reduce(0, torch.from_numpy(cube), part.view_ids.cpu(), "amax")
