"""How splats stand by their shapes alone: their normals, and whether they stand on their head.

Two signs, +y being down. What was predicted from photos lies in one cone ahead of the first camera, so what
lies in one behind the origin was turned half around x or y. Else photos are taken from above the ground and
see little of ceilings: a scene whose level surfaces are nearly all at its top is upside down.
"""

import math

import numpy as np
from jaxtyping import Float

from langflash_core.geometry.quaternions import quats_to_matrices
from langflash_core.scene.bare import in_one_cone
from langflash_core.scene.thin import covered_areas
from langflash_core.types import Gaussians

_FLAT = 0.5  # of a Gaussian's second axis, at most its third: it has a normal
_LEVEL = math.cos(math.radians(30))
_SEEN = 0.1  # opacity from which a Gaussian says where the scene is
_MOST = 20_000  # Gaussians looked at: opening takes a fiftieth longer
_END = 0.2  # of the height, at its bottom and at its top
_TIMES = 4.0  # so much more level surface at the top than at the bottom
_SHARE = 0.1  # of all surface, at least, that is level and at the top


def normals_of(gaussians: Gaussians) -> Float[np.ndarray, "N 3"]:
    """The shortest axis of each Gaussian; 0 of those that are not flat."""
    scales = gaussians.scales.double().numpy()
    ordered = np.sort(scales, 1)
    axes = quats_to_matrices(gaussians.quats.double()).numpy()
    normals = np.take_along_axis(axes, scales.argmin(1)[:, None, None], 2)[:, :, 0]
    flat = ordered[:, 0] <= _FLAT * ordered[:, 1]
    return np.where(flat[:, None], np.nan_to_num(normals), 0.0)


def on_its_head(gaussians: Gaussians) -> bool:
    """Whether both ends of plain splats, N >= 1, seem to be exchanged, +y being down; no is no proof."""
    step = max(1, len(gaussians) // _MOST)
    some = gaussians.map(lambda values: values[::step].detach().cpu())
    seen = some.map(lambda values: values[some.opacities >= _SEEN])
    if not len(seen):
        return False
    if in_one_cone(-seen.means.double()):
        return True
    return _level_at_the_top(seen)


def _level_at_the_top(seen: Gaussians) -> bool:
    heights, areas = -seen.means[:, 1].double().numpy(), covered_areas(seen)
    low, high = np.quantile(heights, (0.02, 0.98))
    level = areas * (np.abs(normals_of(seen)[:, 1]) >= _LEVEL)
    end = _END * (high - low)
    bottom, top = level[heights <= low + end].sum(), level[heights >= high - end].sum()
    return bool(high > low and top > _TIMES * bottom and top >= _SHARE * areas.sum())
