"""Whether splats stand on their head, by their shapes alone.

Two signs, +y being down. What was predicted from photos lies in one cone ahead of the first camera, so what
lies in one behind the origin was turned half around x or y. Else photos are taken from above the ground and
see little of ceilings: a scene whose level surfaces are nearly all at its top is upside down.
"""

import numpy as np

from langflash_core.geometry.surfels import covered_areas, normals_of
from langflash_core.scene.bare import in_one_cone
from langflash_core.scene.settings import STANDING
from langflash_core.types import Gaussians


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
