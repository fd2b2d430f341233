"""One surface of a scene of layers: what formats of plain splats, surfaces, inventory and plan need, which
know no layers. Of several layers that show a surface one keeps it; the scene itself loses nothing.

Each layer is drawn from its own photo's place, and of these depth maps it is decided which photo covers which
surface (`view_selection`): a Gaussian goes where its cell is another photo's, or is seen through. What
stays takes the colours that make the pictures of all layers again: solved for in each (`colours`), and
of these the mean, by what a Gaussian contributes to each. (Of nine photos of a film, frames between: solved
for in all pictures together 25.4 dB and .36 of their structure, the mean 25.9 and .42.)
"""

from dataclasses import replace

import numpy as np
import torch
from jaxtyping import Bool, Float, Integer
from scipy.spatial import KDTree
from torch import Tensor

from langflash_core.base.at_once import at_once
from langflash_core.geometry.cameras import invert_rigid
from langflash_core.geometry.harmonics import colour_to_sh, sh_to_colour
from langflash_core.rig.rig import Rig
from langflash_core.splat.compose import DEPTH
from langflash_core.splat.mixing import mixing
from langflash_core.splat.projection import project, view_depths
from langflash_core.surface.colours import Solved, solved_colours
from langflash_core.surface.consistency import outvoted_pixels, seen_through
from langflash_core.surface.settings import COLOURS
from langflash_core.surface.view_selection import fill_uncovered, select_views
from langflash_core.types import Camera, Scene


def fuse_layers(scene: Scene) -> Scene:
    """The scene as one surface; as it is where it has no layers."""
    if not scene.layered:
        return scene
    whole = scene.rows(fused_rows(scene)).with_record(layered=False)
    sh = torch.cat((colour_to_sh(_colours(scene, whole))[:, None], whole.gaussians.sh[:, 1:]), 1)
    return replace(whole, gaussians=replace(whole.gaussians, sh=sh))


@torch.no_grad()
def _colours(scene: Scene, whole: Scene) -> Float[Tensor, "n 3"]:
    """Of a scene's one surface."""
    start = sh_to_colour(whole.gaussians.sh, whole.gaussians.means)
    if len(start) == 0:
        return start
    ends = sh_to_colour(scene.gaussians.sh, scene.gaussians.means).nan_to_num(0.5)
    low, high = ends.amin(0), ends.amax(0).maximum(ends.amin(0) + COLOURS.step)
    size = tuple(scene.record.detail.get("photo_size", scene.view_size))

    def solved(view: int) -> Solved:
        layer, camera = scene.layer(view), scene.camera(view, *size)
        picture = (_picture(layer, camera) - low[:, None, None]) / (high - low)[:, None, None]
        return solved_colours(whole.gaussians, (start - low) / (high - low), camera, picture)

    sums, seen = torch.zeros_like(start), start.new_zeros(len(start), 1)
    assert scene.view_ids is not None
    for found in at_once(solved, scene.view_ids[scene.view_ids >= 0].unique().tolist()):
        sums += found.seen[:, None] * found.colours
        seen += found.seen[:, None]
    mean = low + (high - low) * sums / seen.clamp_min(COLOURS.seen)
    return torch.where(seen > COLOURS.seen, mean, start)


def _picture(layer: Scene, camera: Camera) -> Float[Tensor, "3 h w"]:
    """A layer from its photo's place; no number where it shows nothing."""
    colours, alpha = _draw_values(layer, camera, sh_to_colour(layer.gaussians.sh, layer.gaussians.means))
    return torch.where(alpha >= COLOURS.shown, colours, torch.nan)


def _draw_values(
    layer: Scene, camera: Camera, values: Float[Tensor, "n C"]
) -> tuple[Float[Tensor, "C h w"], Float[Tensor, "h w"]]:
    """Means of values of a layer's Gaussians in each pixel, and alpha."""
    matrix = mixing(project(layer.gaussians, camera), camera, len(layer.gaussians))
    light, sums = np.asarray(matrix.sum(1))[:, 0], matrix @ values.nan_to_num(0).float().numpy()
    means = torch.from_numpy(sums / np.maximum(light, COLOURS.shown)[:, None]).T
    size = (camera.height, camera.width)
    return means.reshape(-1, *size), torch.from_numpy(light).reshape(size)


@torch.no_grad()
def fused_rows(scene: Scene) -> Bool[Tensor, " N"]:
    """Which Gaussians of a scene of layers make one surface; all that no photo made are among them."""
    assert scene.view_ids is not None
    rows, (width, height) = scene.view_ids < 0, scene.view_size
    views = scene.view_ids[~rows].unique()  # the others have no layer, and say nothing of those that have one
    if not len(views):
        return rows
    depths, alphas = _own_depths(scene, views.tolist())
    rig = Rig(scene.viewmats[views].float(), scene.Ks[views].float(), depths, alphas)
    keep = covering(rig, alphas >= COLOURS.shown)
    for number, view in enumerate(views.tolist()):
        own = (scene.view_ids == view).nonzero().squeeze(1)
        there = rig.project(scene.gaussians.means[own].float().T.contiguous(), number)
        column = there.x.nan_to_num(0).floor().long().clamp(0, width - 1)
        line = there.y.nan_to_num(0).floor().long().clamp(0, height - 1)
        rows[own] = keep[number][line, column]
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


def _own_depths(scene: Scene, views: list[int]) -> tuple[Float[Tensor, "L H W"], Float[Tensor, "L H W"]]:
    """Depth and alpha of some layers from their own photos' places; where one shows nothing, 1 and 0."""

    def seen(view: int) -> tuple[Tensor, Tensor]:
        layer, camera = scene.layer(view), scene.camera(view)
        (depth,), alpha = _draw_values(layer, camera, view_depths(layer.gaussians, camera)[:, None])
        there = alpha >= COLOURS.shown
        return torch.where(there, depth, 1.0), torch.where(there, alpha, 0.0)

    depths, alphas = zip(*at_once(seen, views), strict=True)
    return torch.stack(depths), torch.stack(alphas)


def covering(rig: Rig, usable: Bool[Tensor, "V H W"]) -> Bool[Tensor, "V H W"]:
    """(V, H, W) bool: the cells that each photo covers itself where all make one surface.

    Args:
        rig: with confidences. usable: where depths show something.
    """
    through, between = seen_through(rig), outvoted_pixels(rig)
    return fill_uncovered(rig, select_views(rig, usable & ~through & ~between), usable, between)
