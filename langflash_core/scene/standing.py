"""How splats stand by their shapes alone: their normals, and whether they stand on their head.

Two signs, +y being down. What was predicted from photos lies in one cone ahead of the first camera, so what
lies in one behind the origin was turned half around x or y. Else photos are taken from above the ground and
see little of ceilings: a scene whose level surfaces are nearly all at its top is upside down.
"""

import numpy as np
from jaxtyping import Float

from langflash_core.geometry.quaternions import quats_to_matrices
from langflash_core.scene.bare import in_one_cone
from langflash_core.scene.settings import STANDING
from langflash_core.scene.thin import covered_areas
from langflash_core.types import Gaussians


def normals_of(gaussians: Gaussians) -> Float[np.ndarray, "N 3"]:
    """The shortest axis of each Gaussian; 0 of those that are not flat."""
    scales = gaussians.scales.double().numpy()
    ordered = np.sort(scales, 1)
    axes = quats_to_matrices(gaussians.quats.double()).numpy()
    normals = np.take_along_axis(axes, scales.argmin(1)[:, None, None], 2)[:, :, 0]
    flat = ordered[:, 0] <= STANDING.flat * ordered[:, 1]
    return np.where(flat[:, None], np.nan_to_num(normals), 0.0)


def on_its_head(gaussians: Gaussians) -> bool:
    """Whether both ends of plain splats, N >= 1, seem to be exchanged, +y being down; no is no proof."""
    step = max(1, len(gaussians) // STANDING.most)
    some = gaussians.map(lambda values: values[::step].detach().cpu())
    seen = some.map(lambda values: values[some.opacities >= STANDING.seen])
    if not len(seen):
        return False
    if in_one_cone(-seen.means.double()):
        return True
    return _level_at_the_top(seen)


def _level_at_the_top(seen: Gaussians) -> bool:
    heights, areas = -seen.means[:, 1].double().numpy(), covered_areas(seen)
    low, high = np.quantile(heights, (0.02, 0.98))
    level = areas * (np.abs(normals_of(seen)[:, 1]) >= STANDING.level)
    end = STANDING.end * (high - low)
    bottom, top = level[heights <= low + end].sum(), level[heights >= high - end].sum()
    return bool(high > low and top > STANDING.times * bottom and top >= STANDING.share * areas.sum())
