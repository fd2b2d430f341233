"""What one photo sees through cannot be there. V views, H W pixels."""

import torch
from jaxtyping import Bool, Float
from torch import Tensor
from torch.nn import functional as F

from langflash_core.rig.neighbours import witnesses
from langflash_core.rig.rig import Rig
from langflash_core.surface.settings import CONSISTENCY


def seen_through(
    rig: Rig, points: Float[Tensor, "V HW 3"] | None = None, tolerance: float = CONSISTENCY.tolerance
) -> Bool[Tensor, "V H W"]:
    """(V, H, W) bool: what stands in free space of a photo which knows its depth better.

    What a pixel of view v shows is projected into every other view u. If it lies in front of u's surface
    by more than `tolerance` there, one of the two depths is wrong: the less confident one loses;
    of equals the later view. So never both sides of a conflict vanish.

    Args:
        rig: with confidences. points: of each pixel, in the world; None: what depths say.

    Source: free-space rule of depth-map fusion (Merrell et al. 2007).
    """
    assert rig.confidences is not None, "whoever asks knows them"
    blocked = torch.zeros_like(rig.depths, dtype=torch.bool).flatten(1)
    limits, trusts = (1 - tolerance) * rig.depths.flatten(1), rig.confidences.flatten(1)
    for view in range(len(rig)):
        own = rig.points(view) if points is None else points[view].T
        for other in witnesses(rig, view, own):
            there = rig.project(own, other)
            theirs = there.looked_up(trusts[other])
            outvoted = (theirs > trusts[view]) if other > view else (theirs >= trusts[view])
            blocked[view] |= there.inside & (there.z < there.looked_up(limits[other])) & outvoted
    return blocked.view_as(rig.depths)


def outvoted_pixels(rig: Rig) -> Bool[Tensor, "V H W"]:
    """(V, H, W) bool: what lies beside a jump of depth, where two other photos and more see through it, and
    more than see it as their surface.

    Where depth jumps, a photo's map has values from between, which lie on no surface: skirts. Other photos
    look through them from aside. Away from jumps nothing is outvoted: where a near thing's depth is hard,
    most photos may have it too far, and they would vote down the one that has it right.
    """
    depths = rig.depths
    through, same = torch.zeros(2, *depths.flatten(1).shape, dtype=torch.int16)
    nearest = -F.max_pool2d(-depths[:, None], 3, 1, 1)[:, 0].flatten(1)
    farthest = F.max_pool2d(depths[:, None], 3, 1, 1)[:, 0].flatten(1)
    for view in range(len(rig)):
        own = rig.points(view)
        for other in witnesses(rig, view, own):
            there = rig.project(own, other)
            before = there.z < (1 - CONSISTENCY.skirt) * there.looked_up(nearest[other])
            behind = there.z > (1 + CONSISTENCY.skirt) * there.looked_up(farthest[other])
            through[view] += there.inside & before
            same[view] += there.inside & ~before & ~behind
    seen = ((through >= CONSISTENCY.votes) & (through > same)).view_as(depths)
    logs = rig.log_depths[:, None]
    side = CONSISTENCY.around
    steps = F.max_pool2d(logs, side, 1, side // 2) + F.max_pool2d(-logs, side, 1, side // 2)
    return seen & (steps[:, 0] > CONSISTENCY.jump)
