"""How much of the photos each Gaussian makes up: what weighs where elements are of many sizes.

    s_vi = sum over the pixels p of view v of b_l(p) T_i(p) alpha_i(p), over H W,

T among the Gaussians of its own layer l, b what that layer counts in the picture (`compose.shares`), 1 where
there are no layers. A Gaussian that covers 100 pixels counts as much as 100 that cover one each, and what
hides behind others, in every photo, counts nothing. Sizes: V photos, N Gaussians, H W pixels.
"""

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

from langflash_core.geometry.nearness import Nearness
from langflash_core.types import Camera, Gaussians, Scene

from .compose import shares
from .mixing import mixing
from .projection import ALPHA_MIN, project, view_depths


@torch.no_grad()
def seen_shares(scene: Scene) -> Float[Tensor, "V N"]:
    """Shares (V, N) float32 of the photos' pixels, as the network saw them; rows sum to 1 at most."""
    shapes, count = scene.gaussians.map(lambda values: values.detach().cpu().float()), len(scene.gaussians)
    near = Nearness.of(scene) if scene.layered else None
    rows = []
    for view in range(scene.num_views):
        camera = scene.camera(view)
        if near is not None and near.views:
            rows.append(_of_layers(shapes, scene, camera, near))
            continue
        contributions = mixing(project(shapes, camera), camera, count)
        rows.append(np.asarray(contributions.sum(0)).ravel() / (camera.width * camera.height))
    return torch.from_numpy(np.stack(rows)).float()


def _of_layers(shapes: Gaussians, scene: Scene, camera: Camera, near: Nearness) -> Float[np.ndarray, " N"]:
    """One row of `seen_shares`, of a scene of layers."""
    assert scene.view_ids is not None
    chosen, ids = near.chosen(camera), scene.view_ids.cpu()
    layers, alphas, depths = [], [], []
    for view in chosen.views:
        rows = ((ids == view) | (ids < 0)).nonzero()[:, 0]
        layer = shapes.rows(rows)
        contributions = mixing(project(layer, camera), camera, len(rows))
        alpha = np.asarray(contributions.sum(1)).ravel()
        sums = contributions @ view_depths(layer, camera).nan_to_num(0, 0, 0).numpy()
        layers.append((rows.numpy(), contributions))
        alphas.append(torch.from_numpy(alpha))
        depths.append(torch.from_numpy(sums / np.maximum(alpha, ALPHA_MIN)))
    counts = shares(torch.stack(alphas)[:, None], torch.stack(depths)[:, None], chosen.weights)[:, 0]
    found = np.zeros(len(ids))
    for (rows, contributions), own in zip(layers, counts.numpy(), strict=True):
        found[rows] += contributions.T @ own
    return found / (camera.width * camera.height)
