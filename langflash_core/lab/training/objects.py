"""Things over several views: what connected regions of one view are in the others, by their depths.

Data sets that name pixels do not always say which chair is which. Two regions of one name are one thing where
the pixels of one, brought into the other's view, lie on it at the depth that is seen there. Walls, floors and
ceilings are one thing each, whatever stands before them.

Sizes: V views, H W pixels.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from langflash_core.geometry.cameras import invert_rigid, unproject
from langflash_core.lab.photos import Name
from langflash_core.lab.photos.fitting import FittedPhoto
from langflash_core.lab.training.photos import WHOLE, regions
from langflash_core.lab.training.shards import NOTHING, Label

SHARE = 0.3
"""Of a region's pixels that another view shows, so many must lie on one thing to be it."""
AGREEMENT = 0.05
"""Relative difference of depths up to which two views see the same surface."""


@dataclass(frozen=True)
class Objects:
    """ids (V, H, W) uint8: the same number in all views is the same thing, 255 = nobody's; labels: of the
    numbers, () where nothing is named; vectors (M, C) of unit norm of the numbers, or None."""

    ids: Tensor
    labels: tuple[Label, ...]
    vectors: Tensor | None = None


def linked(views: Sequence[FittedPhoto], names: Mapping[int, Name], viewmats: Tensor) -> Objects:
    """Things of named views, those of earlier views first.

    Args:
        viewmats: (V, 4, 4), world to camera.
    """
    found = [regions(view.labels, dict(names)) for view in views]
    ids = torch.full((len(views), *views[0].labels.shape), NOTHING, dtype=torch.uint8)
    labels: list[Label] = []
    for v, (own, said) in enumerate(found):
        elsewhere = [_seen_from(views, ids, viewmats, v, u) for u in range(v)]
        for region, label in enumerate(said):
            mask = own == region
            number = _same(mask, label, labels, elsewhere)
            if number is None and len(labels) < NOTHING:
                number = len(labels)
                labels.append(label)
            if number is not None:
                ids[v][mask] = number
    return Objects(ids, tuple(labels))


def tracked(maps: Tensor, vectors: Tensor | None) -> Objects:
    """Things that somebody has followed from frame to frame already; the largest 255 at most of those seen.

    Args:
        maps: (V, H, W) int64, 0 = nobody. vectors: (M, C), row n of thing n + 1; where one is 0 nothing is
            known of the thing, and it is nobody's.
    """
    counts = torch.bincount(maps.flatten())
    counts[0] = 0
    if vectors is not None:
        counts[1:][vectors[: len(counts) - 1].norm(dim=1) == 0] = 0
    shown = counts.argsort(descending=True, stable=True)[: min(NOTHING, int((counts > 0).sum()))]
    rows = torch.full((len(counts),), NOTHING, dtype=torch.uint8)
    rows[shown] = torch.arange(len(shown), dtype=torch.uint8)
    labels = tuple(Label("object", "object") for _ in shown)
    return Objects(rows[maps], labels, None if vectors is None else vectors[shown - 1].float())


def _same(mask: Tensor, label: Label, labels: Sequence[Label], elsewhere: Sequence[Tensor]) -> int | None:
    """The number of the thing that a region is a view of, if an earlier view has it."""
    if label.group in WHOLE:
        return labels.index(label) if label in labels else None
    votes: Counter[int] = Counter()
    visible = 0
    for numbers in elsewhere:
        on = numbers[mask]
        visible += int((on >= 0).sum())
        votes.update(n for n in on[on >= 0].tolist() if n != NOTHING and labels[n] == label)
    number, count = votes.most_common(1)[0] if votes else (0, 0)
    return number if count > SHARE * visible else None


def _seen_from(views: Sequence[FittedPhoto], ids: Tensor, viewmats: Tensor, v: int, u: int) -> Tensor:
    """What view u says of each pixel of view v, (H, W) int64: a number, 255; -1 where u does not see it."""
    depths, K = views[v].depths, views[v].K.float()
    pos_c = unproject(depths[None], K[None])[0]  # (H, W, 3)
    moved = viewmats[u].float() @ invert_rigid(viewmats[v : v + 1].float())[0]
    pos_u = pos_c @ moved[:3, :3].T + moved[:3, 3]
    pixels = pos_u @ views[u].K.float().T
    height, width = depths.shape
    z = pos_u[..., 2]
    x, y = (torch.floor(pixels[..., axis] / z.clamp_min(1e-6)).long() for axis in (0, 1))
    inside = (depths > 0) & (z > 0) & (x >= 0) & (x < width) & (y >= 0) & (y < height)
    x, y = x.clamp(0, width - 1), y.clamp(0, height - 1)
    there = views[u].depths[y, x]
    inside &= (there > 0) & ((there - z).abs() < AGREEMENT * z)
    return torch.where(inside, ids[u][y, x].long(), -1)
