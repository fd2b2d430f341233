"""Many photos in bounded memory: of more than a few the network looks at some at a time.

Few photos are one group and take the same way as ever, to the same bits. Of many, what has to stay of each
photo (language features, the map that masks are read from, weights) is held in half precision.
"""

from collections.abc import Callable, Iterable
from itertools import pairwise

from jaxtyping import Shaped
from torch import Tensor

from langflash_core.base.memory import give_back

FEW = 8
"""Photos that are looked at together, and of which each reads all others."""


def groups_of(count: int) -> list[slice]:
    """Places of `count` photos, at most `FEW` of them at a time; nothing of none."""
    number = -(-count // FEW)
    bounds = [count * k // number for k in range(number + 1)] if count else []
    return [slice(first, last) for first, last in pairwise(bounds)]


def in_groups(work: Callable[..., Tensor], *of_views: Tensor, dim: int = 0) -> Shaped[Tensor, "..."]:
    """What `work` makes of all views, which are dimension `dim` of what it reads and gives, group by
    group."""
    count = of_views[0].shape[dim]
    groups = groups_of(count)
    if len(groups) < 2:
        return work(*of_views)
    parts = (
        work(*(values.narrow(dim, some.start, some.stop - some.start) for values in of_views))
        for some in groups
    )
    return together(parts, count, dim)


def together(parts: Iterable[Shaped[Tensor, "..."]], count: int, dim: int = 0) -> Shaped[Tensor, "..."]:
    """Parts of `count` views in one, each put there as it comes; a single one as it is.

    What made them goes back to the system.
    """
    whole, done = None, 0
    for part in parts:
        length = part.shape[dim]
        if length == count:
            return part
        if whole is None:
            whole = part.new_empty(*part.shape[:dim], count, *part.shape[dim + 1 :])
        whole.narrow(dim, done, length).copy_(part)
        done += length
        del part
        give_back()
    assert whole is not None and done == count, "the parts are those of all views"
    return whole


def in_half_precision(values: Shaped[Tensor, "*any"], count: int) -> Shaped[Tensor, "*any"]:
    """What stays of `count` photos: of many in half precision."""
    return values if count <= FEW else values.half()
