"""Other ways to make groups: of points alone, of truth, and as many as one asks for.

Notation: V views, K groups, H W pixels, X = V H W of them, S directions of the features.
"""

import heapq
import warnings
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Bool, Float, Int
from scipy.cluster.vq import kmeans2
from torch import Tensor
from torch.nn import functional as F

from langflash_core.network.prior import resize
from langflash_core.network.semantics.splitting import condense_features

EVERY = 4
"""Of the points, a side, that clusters are found on; every point then joins its nearest centre."""
NORMAL, COLOUR = 0.7, 0.5
"""Weights of a unit normal and of colours (in deviations) beside places (in deviations)."""


def point_groups(
    points: Float[Tensor, "V H W 3"], colours: Float[Tensor, "V H W 3"], count: int
) -> Float[Tensor, "V K H W"]:
    """Hard groups of 3D points by place, normal and colour: k-means, no network and no picture's tokens.

    Stands for grouping on points, as a PointTransformer does it; it is not trained, so it says what
    geometry and colour alone know of things, and no more.

    Args:
        points: world, of all pixels. count: groups asked for.
    """
    across = F.pad(points[:, :, 1:] - points[:, :, :-1], (0, 0, 0, 1))
    down = F.pad(points[:, 1:] - points[:, :-1], (0, 0, 0, 0, 0, 1))
    normals = F.normalize(torch.linalg.cross(across, down), dim=-1)
    flat = points.flatten(0, 2)
    spread = flat.std(0).mean().clamp_min(1e-6)
    parts = (
        (points - flat.mean(0)) / spread,
        NORMAL * normals,
        COLOUR * colours / colours.std().clamp_min(1e-3),
    )
    known = torch.cat(parts, -1).double().nan_to_num()
    some = known[:, ::EVERY, ::EVERY].flatten(0, 2).numpy()
    start = some[np.linspace(0, len(some) - 1, min(count, len(some))).astype(int)]  # evenly over the photos
    with warnings.catch_warnings(action="ignore", category=UserWarning):  # a cluster may end up empty
        centres, _ = kmeans2(some, start, iter=12, minit="matrix")
    nearest = torch.cdist(known.flatten(0, 2).float(), torch.from_numpy(centres).float()).argmin(1)
    groups = F.one_hot(nearest, len(centres)).float()
    return groups.unflatten(0, points.shape[:3]).permute(0, 3, 1, 2).contiguous()


def true_names(
    weights: Float[Tensor, "V K H W"], classes: Int[Tensor, "V H W"], count: int
) -> Int[Tensor, " K"]:
    """The class (0 to count - 1) that most of a group's weight lies on; 0 where it lies on none.

    Args:
        classes: of every pixel, -1 where nothing is known.
    """
    known = classes.flatten() >= 0
    by_pixel = weights.permute(0, 2, 3, 1).flatten(0, 2)[known]
    mass = by_pixel.new_zeros(count, weights.shape[1]).index_add(0, classes.flatten()[known], by_pixel)
    return mass.argmax(0)


def regrouped(
    weights: Float[Tensor, "V K H W"], features: Float[Tensor, "1 V C h w"], count: int
) -> Float[Tensor, "V J H W"]:
    """The same groups, merged or cut until there are `count` of them: the study of K without training.

    Fewer: the two whose union loses least (Ward's criterion on language features) become one, again and
    again. More: the group that scatters most along one direction is cut there at its mean, again and again
    (Boley 1998); the soft weight of a pixel goes to the half on its side.

    Args:
        weights: sum to 1 over K. features: L(x), unit norm.
    """
    known = resize(condense_features(features[0]), (weights.shape[-2], weights.shape[-1]))  # (V, S, H, W)
    pixels = known.permute(0, 2, 3, 1).flatten(0, 2)
    table = weights.permute(0, 2, 3, 1).flatten(0, 2)  # (X, K)
    table = _merged(table, pixels, count) if table.shape[1] >= count else _cut(table, pixels, count)
    return table.unflatten(0, (weights.shape[0], *weights.shape[-2:])).permute(0, 3, 1, 2).contiguous()


def _merged(table: Tensor, pixels: Tensor, count: int) -> Tensor:
    mass = table.sum(0).double().clamp_min(1e-9)
    means = (table.T @ pixels).double() / mass[:, None]
    owner = torch.arange(len(mass))
    alive = torch.ones(len(mass), dtype=torch.bool)
    for _ in range(len(mass) - max(count, 1)):
        loss = torch.cdist(means, means) ** 2 * mass * mass[:, None] / (mass + mass[:, None])
        loss[~alive] = torch.inf
        loss[:, ~alive] = torch.inf
        loss.fill_diagonal_(torch.inf)
        first, second = divmod(int(loss.argmin()), len(mass))
        total = mass[first] + mass[second]
        means[first] = (mass[first] * means[first] + mass[second] * means[second]) / total
        mass[first] = total
        alive[second] = False
        owner[owner == second] = first
    kept = owner.unique()
    places = torch.searchsorted(kept, owner)
    return table.new_zeros(len(table), len(kept)).index_add(1, places, table)


@dataclass(frozen=True)
class _Part:
    """Pixels that are mostly this group's, all pixels on its side of every cut, and the group it is of."""

    members: Int[Tensor, " n"]
    side: Bool[Tensor, " X"]
    source: int


def _cut(table: Tensor, pixels: Tensor, count: int) -> Tensor:
    whose = table.argmax(1)
    everywhere = torch.ones(len(table), dtype=torch.bool)
    parts = [_Part((whose == k).nonzero()[:, 0], everywhere, k) for k in range(table.shape[1])]
    queue = [_scattered(pixels, part, number) for number, part in enumerate(parts)]
    heapq.heapify(queue)
    done, number = [], len(parts)
    while len(queue) + len(done) < count and queue:
        scatter, _, part, mean, direction = heapq.heappop(queue)
        beyond = (pixels - mean) @ direction > 0
        halves = [
            _Part(part.members[beyond[part.members] == far], part.side & (beyond == far), part.source)
            for far in (False, True)
        ]
        if scatter >= 0 or min(len(half.members) for half in halves) == 0:
            done.append(part)
            continue
        for half in halves:
            heapq.heappush(queue, _scattered(pixels, half, number))
            number += 1
    found = [*done, *(entry[2] for entry in queue)]
    return torch.stack([table[:, part.source] * part.side for part in found], 1)


def _scattered(pixels: Tensor, part: _Part, number: int) -> tuple[float, int, _Part, Tensor, Tensor]:
    """Negative scatter along the direction of the most, a number that breaks ties, and the cut's place."""
    own = pixels[part.members].double()
    if len(own) < 2:
        return 0.0, number, part, pixels.new_zeros(pixels.shape[1]), pixels.new_zeros(pixels.shape[1])
    mean = own.mean(0)
    values, directions = np.linalg.eigh(((own - mean).T @ (own - mean)).numpy())
    direction = torch.from_numpy(directions[:, -1]).to(pixels)
    return -float(values[-1]), number, part, mean.to(pixels), direction
