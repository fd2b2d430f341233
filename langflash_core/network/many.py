"""Many photos in bounded memory: of more than a few the network looks at some at a time.

Few photos are one group and take the same way as ever, to the same bits. Of many, what has to stay of each
photo (language features, the map that masks are read from, weights) is held in half precision.
"""

from collections.abc import Callable, Sequence

import torch
from torch import Tensor

from langflash_core.memory import give_back

FEW = 8
"""Photos that are looked at together, and of which each reads all others."""


def groups_of(count: int) -> list[slice]:
    """Places of `count` photos, at most `FEW` of them at a time; nothing of none."""
    number = -(-count // FEW)
    bounds = [count * k // number for k in range(number + 1)] if count else []
    return [slice(first, last) for first, last in zip(bounds[:-1], bounds[1:], strict=True)]


def in_groups(work: Callable[..., Tensor], *of_views: Tensor, dim: int = 0) -> Tensor:
    """What `work` makes of all views, which are dimension `dim` of what it reads and gives, group by group."""
    groups = groups_of(of_views[0].shape[dim])
    if len(groups) < 2:
        return work(*of_views)
    parts = []
    for some in groups:
        own = (values.narrow(dim, some.start, some.stop - some.start) for values in of_views)
        parts.append(work(*own))
    return together(parts, dim)


def together(parts: Sequence[Tensor], dim: int = 0) -> Tensor:
    """Parts of all views in one; a single one as it is. What made them goes back to the system."""
    if len(parts) == 1:
        return parts[0]
    whole = torch.cat(list(parts), dim)
    give_back()
    return whole


def held(values: Tensor, count: int) -> Tensor:
    """What stays of `count` photos: of many in half precision."""
    return values if count <= FEW else values.half()
