"""One surface of a scene of layers: what formats of plain splats, surfaces, inventory and plan need, which
know no layers. Of several layers that show a surface one keeps it; the scene itself loses nothing.

Each layer is drawn from its own photo's place, and of these depth maps it is decided which photo covers which
surface (`scene.ownership`): a Gaussian goes where its cell belongs to another photo, or is seen through.
"""

import torch
from jaxtyping import Bool, Float
from torch import Tensor

from langflash_core.geometry.cameras import invert_rigid, pictured, unproject
from langflash_core.scene.consistency import outvoted, seen_through
from langflash_core.scene.ownership import filled, owned
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


def covering(
    depths: Float[Tensor, "V H W"],
    viewmats: Float[Tensor, "V 4 4"],
    Ks: Float[Tensor, "V 3 3"],
    usable: Bool[Tensor, "V H W"],
    trusts: Float[Tensor, "V H W"],
) -> Bool[Tensor, "V H W"]:
    """(V, H, W) bool: the cells that each photo covers itself where all make one surface.

    Args:
        depths: (V, H, W) > 0. usable: where they show something. trusts: how sure they are, in [0, 1].
    """
    poses = invert_rigid(viewmats)
    pos_c = unproject(depths, Ks).flatten(1, 2)
    points = pos_c @ poses[:, :3, :3].transpose(1, 2) + poses[:, None, :3, 3]
    through = seen_through(points.flatten(0, 1), viewmats, Ks, depths, trusts).view_as(usable)
    between = outvoted(points, viewmats, Ks, depths)
    keep = owned(depths, viewmats, Ks, usable & ~through & ~between)
    return filled(depths, viewmats, Ks, keep, usable, between)
