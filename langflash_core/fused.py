"""One surface of a scene of layers: what formats of plain splats, surfaces, inventory and plan need, which
know no layers. Of several layers that show a surface one keeps it; the scene itself loses nothing.

Each layer is drawn from its own photo's place, and of these depth maps it is decided as for photos that share
one surface from the start (`scene.ownership`): a Gaussian goes where its cell belongs to another photo, or is
seen through.
"""

import numpy as np
import torch
from jaxtyping import Bool, Float, Integer
from scipy.spatial import KDTree
from torch import Tensor

from langflash_core.geometry.cameras import invert_rigid, pictured
from langflash_core.scene.detailed import covering
from langflash_core.splat.compose import DEPTH
from langflash_core.splat.projection import drawable_rows, project, view_depths
from langflash_core.splat.tiles import rasterize_tiles
from langflash_core.types import Scene

_SHOWN = 0.5  # alpha from which a cell shows the layer


def fused(scene: Scene) -> Scene:
    """The scene as one surface; as it is where it has no layers."""
    if not scene.layered:
        return scene
    return scene.rows(fused_rows(scene)).with_record(layered=False)


@torch.no_grad()
def fused_rows(scene: Scene) -> Bool[Tensor, " N"]:
    """Which Gaussians of a scene of layers make one surface; all that no photo made are among them."""
    assert scene.view_ids is not None
    depths, alphas = _own_depths(scene)
    keep = covering(depths, scene.viewmats.float(), scene.Ks.float(), alphas >= _SHOWN, alphas)
    width, height = scene.view_size
    rows = scene.view_ids < 0
    for view in range(scene.num_views):
        own = (scene.view_ids == view).nonzero().squeeze(1)
        points = scene.gaussians.means[own].float().T.contiguous()
        x, y, _ = pictured(scene.viewmats[view].float(), scene.Ks[view].float(), points)
        column = x.nan_to_num(0).floor().long().clamp(0, width - 1)
        line = y.nan_to_num(0).floor().long().clamp(0, height - 1)
        rows[own] = keep[view][line, column]
    return rows


def told_in_layers(
    scene: Scene,
    surface: Bool[Tensor, " N"],
    numbers: Integer[np.ndarray, " N"],
    asked: Bool[np.ndarray, " N"],
    unknown: int,
) -> Integer[np.ndarray, " N"]:
    """What is known of the Gaussians of one surface, told of those that show it in other layers: each has the
    number of the nearest one of the surface, up to `compose.DEPTH` of its distance from its photo, within
    which layers show the same.

    Args:
        surface: `fused_rows`. numbers: of the surface's Gaussians; the others' are not looked at.
        asked: which are told, and which may tell.

    Returns:
        `numbers` of the surface that are asked; `unknown` of what is not asked, or not near.
    """
    assert scene.view_ids is not None
    of_surface = surface.cpu().numpy()
    means = scene.gaussians.means.detach().cpu().double()
    finite = asked & torch.isfinite(means).all(1).numpy()
    tell, ask = np.flatnonzero(finite & of_surface), np.flatnonzero(finite & ~of_surface)
    found = np.where(asked & of_surface, numbers, unknown)
    if len(tell) and len(ask):
        eyes = invert_rigid(scene.viewmats.detach().cpu().double())[:, :3, 3]
        away = (means[ask] - eyes[scene.view_ids.cpu()[ask]]).norm(dim=1).numpy()
        far, which = KDTree(means[tell].numpy()).query(means[ask].numpy())
        near = far <= DEPTH * away
        found[ask[near]] = numbers[tell[np.asarray(which)[near]]]
    return found


def _own_depths(scene: Scene) -> tuple[Float[Tensor, "V H W"], Float[Tensor, "V H W"]]:
    """Depth and alpha of each layer from its own photo's place; where it shows nothing, 1 and 0."""
    depths, alphas = [], []
    for view in range(scene.num_views):
        layer, camera = scene.layer(view), scene.camera(view)
        layer = layer.rows(drawable_rows(layer))
        feature = view_depths(layer.gaussians, camera).float()[:, None]
        (sums,), alpha = rasterize_tiles(project(layer.gaussians, camera), [feature], camera)
        there = alpha >= _SHOWN
        depths.append(torch.where(there, sums[..., 0] / alpha.clamp_min(_SHOWN), 1.0))
        alphas.append(torch.where(there, alpha, 0.0))
    return torch.stack(depths), torch.stack(alphas)
