"""How a view shows a part of a scene, and what is left without it.

    matte(x) = sum_i T_i alpha_i b_i,

b_i = 1 where Gaussian i is of the part: the share of the pixel's light that comes from it.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import torch
from torch import Tensor

from langflash_core.geometry.harmonics import colour_to_sh
from langflash_core.mending.settings import PREVIEW
from langflash_core.scene.exposure import lit_camera
from langflash_core.scene.gaps import fill_gaps
from langflash_core.splat import drawable_rows, project, view_colours, view_depths
from langflash_core.splat.compose import blend_layers, layers_of
from langflash_core.splat.tiles import rasterize_tiles
from langflash_core.types import Camera, Frame, Record, Scene, Semantics

Render = Callable[..., Frame]  # (scene, camera, weight_maps=True)
Progress = Callable[[str, float], None]


def draw_scene(scene: Scene, camera: Camera, *, weight_maps: bool = True) -> Frame:
    """A frame by the rasteriser for processors, for those who have no other at hand. Twin: `splat.render`."""
    parts, weights = layers_of(scene, camera) if scene.layered else ([], np.ones(0))
    if not parts:
        return _draw_layer(scene, camera, weight_maps)
    return blend_layers([_draw_layer(part, camera, weight_maps) for part in parts], weights)


def _draw_layer(scene: Scene, camera: Camera, weight_maps: bool) -> Frame:
    """`draw_scene` of a scene of one layer."""
    rows = drawable_rows(scene)
    gaussians = scene.gaussians.map(lambda values: values.double()[rows])
    layers = torch.cat((view_colours(gaussians, camera), view_depths(gaussians, camera)[:, None]), 1)
    features = [layers.float()]
    if weight_maps:
        features.append(scene.semantics.dense_weights()[rows].float())
    maps, alphas = rasterize_tiles(project(gaussians, camera), features, camera)
    covered = alphas >= PREVIEW.least
    depths = torch.where(covered, maps[0][..., 3] / alphas.clamp_min(PREVIEW.least), 0.0)
    return Frame(maps[0][..., :3], alphas, depths, maps[1] if weight_maps else None)


def mattes(
    scene: Scene, part: Tensor, cameras: Sequence[Camera], render: Render
) -> list[tuple[Tensor, Tensor]]:
    """The part's matte (H, W) in each view, and the depths (H, W) of the whole scene there.

    Args:
        part: (N,) bool.
    """
    ids = torch.zeros(len(part), 1, dtype=torch.int64)
    one = Semantics(ids, part.cpu().float()[:, None], torch.ones(1, 1), scene.semantics.space)
    carrying = replace(scene, semantics=one, record=Record(layered=scene.record.layered))
    found = []
    for camera in cameras:
        frame = render(carrying, camera)
        assert frame.weight_maps is not None, "render draws weight maps unless told otherwise"
        found.append((frame.weight_maps[..., 0].cpu().clamp(0, 1), frame.depths.cpu()))
    return found


def redden(scene: Scene, rows: Tensor) -> Scene:
    """The scene with some Gaussians (N,) bool in red, still light and dark."""
    sh = scene.gaussians.sh.clone()
    sh[rows] *= 1 - PREVIEW.red
    sh[rows, 0] += PREVIEW.red * colour_to_sh(torch.tensor(PREVIEW.shade)).to(sh)
    return replace(scene, gaussians=replace(scene.gaussians, sh=sh))


def before_and_after(scene: Scene, rows: Tensor, after: Scene | None, render: Render) -> Tensor:
    """A picture (H, W, 3) in [0, 1]: a photo's view in each line, at the left what some Gaussians show in
    red, at the right the scene as it is to be; None: only the left."""
    columns = []
    for each in (redden(scene, rows), after):
        if each is None:
            continue
        frames = [
            render(each, lit_camera(each, each.camera(view)), weight_maps=False)
            for view in range(min(scene.num_views, PREVIEW.most_views))
        ]
        columns.append(torch.cat([fill_gaps(frame.rgb.cpu(), frame.alphas.cpu()) for frame in frames]))
    return torch.cat(columns, 1).clamp(0, 1)
