"""How much of the photos each Gaussian makes up: what weighs where elements are of many sizes.

    s_vi = sum over the pixels p of view v of T_i(p) alpha_i(p), over H W.

A Gaussian that covers 100 pixels counts as much as 100 that cover one each, and what hides behind others,
in every photo, counts nothing. Sizes: V photos, N Gaussians, H W pixels.
"""

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

from langflash_core.types import Scene

from .mixing import mixing
from .projection import project


@torch.no_grad()
def seen_shares(scene: Scene) -> Float[Tensor, "V N"]:
    """Shares (V, N) float32 of the photos' pixels, as the network saw them; rows sum to 1 at most."""
    shapes, count = scene.gaussians.map(lambda values: values.detach().cpu().float()), len(scene.gaussians)
    rows = []
    for view in range(scene.num_views):
        camera = scene.camera(view)
        shares = mixing(project(shapes, camera), camera, count)
        rows.append(np.asarray(shares.sum(0)).ravel() / (camera.width * camera.height))
    return torch.from_numpy(np.stack(rows)).float()
