"""Where was the camera that sees these points at these pixels? One view, H x W points.

A point map tells every pixel's place in the first camera's frame; with the intrinsics known that
is more than enough to place the view's own camera (PnP). Source: Lepetit et al. 2009 for the
problem, SQPnP (Terzakis and Lourakis 2020) for its solution, as OpenCV has them.
"""

from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

from langflash_core.cameras.placing import place_camera
from langflash_core.geometry.cameras import pixel_grid
from langflash_core.network.settings import RESECTION
from langflash_core.rig.projected import project_points


@dataclass(frozen=True)
class Resection:
    """viewmat (4, 4); share of the sampled points that agree with it, in [0, 1]."""

    viewmat: Float[np.ndarray, "4 4"]
    share: float

    @property
    def is_trusted(self) -> bool:
        return self.share >= RESECTION.min_share


def resect(points: Float[Tensor, "3 H W"], K: Float[Tensor, "3 3"]) -> Resection:
    """The pose from which points (3, H, W) are seen at their own pixels; deterministic.

    Args:
        points: world, any unit. K: (3, 3) pixels.
    """
    height, width = points.shape[-2:]
    step = max(1, int((height * width / RESECTION.points) ** 0.5))
    grid = pixel_grid(width, height, like=points)[::step, ::step].reshape(-1, 2)
    sample = points[:, ::step, ::step].flatten(1).T
    usable = torch.isfinite(sample).all(1)
    pos_w, pixels = sample[usable].double().cpu().numpy(), grid[usable].double().cpu().numpy()
    tolerance = RESECTION.tolerance * max(height, width) / 256
    found = place_camera(pos_w, pixels, K.double().cpu().numpy(), tolerance)
    return Resection(np.eye(4), 0.0) if found is None else Resection(found.viewmat, float(found.agree.mean()))


def depths_and_confidences(
    points: Float[Tensor, "V 3 H W"], viewmats: Float[Tensor, "V 4 4"], Ks: Float[Tensor, "V 3 3"]
) -> tuple[Float[Tensor, "V H W"], Float[Tensor, "V H W"]]:
    """z > 0 of every point in its own view, and how well it falls on its own pixel, in [0, 1].

    Args:
        points: (V, 3, H, W) world. viewmats: (V, 4, 4). Ks: (V, 3, 3), pixels.

    Returns:
        depths and confidences, (V, H, W): 1 / (1 + error / 3 px), 0 behind the camera.
    """
    height, width = size = points.shape[2], points.shape[3]
    there = project_points(points.flatten(2), viewmats, Ks, size)
    z = there.z.unflatten(1, size)
    errors = torch.stack((there.x, there.y), -1).unflatten(1, size) - pixel_grid(width, height, like=points)
    trust = 1 / (1 + errors.norm(dim=-1) / (RESECTION.half_trust * max(height, width) / 256))
    ahead = (z > 0) & torch.isfinite(trust)
    floor = RESECTION.nearest * z[ahead].median() if bool(ahead.any()) else z.new_tensor(RESECTION.nearest)
    return torch.where(ahead, z, floor).clamp_min(floor), torch.where(ahead, trust, 0.0)
