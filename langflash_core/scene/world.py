"""A scene in the frame and the unit of poses that were given, instead of its first camera's."""

from dataclasses import replace

import torch
from jaxtyping import Float
from torch import Tensor

from langflash_core.geometry.cameras import invert_rigid, transform
from langflash_core.geometry.turning import turned_quats, turned_sh
from langflash_core.types import Scene


def in_world(scene: Scene, viewmat: Float[Tensor, "4 4"], unit: float) -> Scene:
    """The scene with its first camera at `viewmat`.

    Args:
        viewmat: (4, 4), world to camera of view 0. unit: world units per scene unit.
    """
    pose = invert_rigid(viewmat.double().cpu())
    gaussians = scene.gaussians
    means = transform(pose, gaussians.means.double() * unit).float()
    quats = torch.nn.functional.normalize(turned_quats(gaussians.quats, pose[:3, :3]), dim=-1)
    sh = turned_sh(gaussians.sh, pose[:3, :3])
    moved = replace(gaussians, means=means, quats=quats, scales=gaussians.scales * unit, sh=sh)
    viewmats = scene.viewmats.double().clone()
    viewmats[:, :3, 3] *= unit
    return replace(scene, gaussians=moved, viewmats=(viewmats @ viewmat.double().cpu()).float())
