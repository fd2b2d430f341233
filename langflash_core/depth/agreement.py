"""One surface where several photos see one: depth maps are bent and blended until they agree.

What a sweep leaves is a slow difference between the maps of two photos, some percent of depth: two
sheets, a halftone where their Gaussians interleave. Every map is carried into those of its neighbours. A
smooth correction of log depth for each, bilinear between a few knots, takes out what differs slowly
(one robust least squares over all maps at once), and where they then agree to within `Agreement.same`
both take the mean, weighted by what each expects of its errors.

Sizes: V views, H W pixels, S knots a side, P pixels that are compared.
"""

from dataclasses import dataclass

import torch
from jaxtyping import Bool, Float
from torch import Tensor
from torch.nn import functional as F

from langflash_core.geometry.cameras import pixel_grid
from langflash_core.rig.neighbours import Neighbours, everyone
from langflash_core.rig.rig import Rig
from langflash_core.rig.settings import AGREEMENT, Agreement


def agreed(rig: Rig, neighbours: Neighbours | None = None, settings: Agreement = AGREEMENT) -> Rig:
    """Depths that agree where they show one surface; the expected errors stay.

    One view, or views that share nothing, come back as they are.

    Args:
        rig: with confidences. neighbours: of each view those that it is compared with; None: all others.

    Source: own derivation; the blend is that of depth-map fusion (Merrell et al. 2007).
    """
    if len(rig) < 2:
        return rig
    near = neighbours or everyone(len(rig))
    straight = rig.with_logs(straightened(rig, near, settings=settings))
    return straight.with_logs(blended(straight, near, settings=settings))


@dataclass(frozen=True)
class Carried:
    """Pixels of one map as another photo sees them.

    log_depths: (P,) their log z there. places: (P, 2), -1 to 1 over that picture. inside: (P,) in view.
    """

    log_depths: Float[Tensor, " P"]
    places: Float[Tensor, "P 2"]
    inside: Bool[Tensor, " P"]


def carried(rig: Rig, view: int, other: int, points: Float[Tensor, "3 P"]) -> Carried:
    """Points (3, P) in the frame of `view`'s camera, seen from `other`."""
    there = rig.reproject(view, other, points)
    places = torch.stack([along.clamp(-4, 4) for along in there.scaled], -1)
    return Carried(there.z.clamp_min(1e-4).log(), places, there.inside)


def sampled(maps: Float[Tensor, "H W"], places: Float[Tensor, "P 2"]) -> Float[Tensor, " P"]:
    """Bilinear values of a map (H, W) at places (P, 2) of -1 to 1."""
    return F.grid_sample(maps[None, None], places[None, None], padding_mode="border", align_corners=False)[
        0, 0, 0
    ]


def straightened(rig: Rig, neighbours: Neighbours, settings: Agreement = AGREEMENT) -> Float[Tensor, "V H W"]:
    """Log depths (V, H, W) plus the smooth corrections under which they differ least.

    With r the log depth that the other map has less the one that is carried there, and hat functions
    h over the knots, the corrections c minimise sum rho(r + h(x') c_other - h(x) c_own) and what is
    expected of c: small, and alike at neighbouring knots.
    """
    num_views, (height, width) = len(rig), rig.size
    sparse = (slice(settings.step // 2, None, settings.step), slice(settings.step // 2, None, settings.step))
    grid = pixel_grid(width, height, like=rig.depths) / rig.depths.new_tensor([width, height]) * 2 - 1
    hats = knot_weights(grid.flatten(0, 1), settings=settings)  # (H W, S^2)
    own_hats = hats.unflatten(0, (height, width))[sparse].flatten(0, 1).double()
    prior = _expectation(hats.device, settings=settings)
    knots = prior.new_zeros(num_views, settings.knots**2)
    now = rig
    for _ in range(settings.iterations):
        points = [now.in_camera(view)[sparse].flatten(0, 1).T for view in range(num_views)]
        normal = torch.block_diag(*[prior] * num_views)
        right = -(knots @ prior).flatten()
        sums = _comparisons(now, points, own_hats, neighbours, settings=settings)
        knots = knots + torch.linalg.solve(normal + sums[0], right + sums[1]).view_as(knots)
        logs = rig.log_depths + (knots.to(hats) @ hats.T).view_as(rig.depths)
        now = rig.with_logs(logs)
    return now.log_depths


def _comparisons(
    rig: Rig, points: list[Tensor], own_hats: Tensor, neighbours: Neighbours, settings: Agreement = AGREEMENT
) -> tuple[Tensor, Tensor]:
    """Normal matrix (V S^2, V S^2) and right side (V S^2,) of all maps and their neighbours', float64."""
    num_views, width = len(rig), settings.knots**2
    normal = own_hats.new_zeros(num_views, width, num_views, width)
    right, count = own_hats.new_zeros(num_views, width), 0
    for a, others in enumerate(neighbours):
        for b in others:
            there = carried(rig, a, b, points[a])
            left = own_hats[there.inside]
            other = knot_weights(there.places[there.inside], settings=settings).double()
            gap = (sampled(rig.log_depths[b], there.places) - there.log_depths)[there.inside].double()
            weights = (1 + (gap / settings.scale) ** 2) ** -2 / settings.scale**2
            weighted, weighted_other = left * weights[:, None], other * weights[:, None]
            normal[a, :, a] += weighted.T @ left
            normal[b, :, b] += weighted_other.T @ other
            normal[a, :, b] -= weighted.T @ other
            normal[b, :, a] -= weighted_other.T @ left
            right[a] += weighted.T @ gap
            right[b] -= weighted_other.T @ gap
            count += len(gap)
    share = min(1.0, settings.independent * num_views / max(count, 1))
    return normal.flatten(2).flatten(0, 1) * share, right.flatten() * share


def knot_weights(places: Float[Tensor, "P 2"], settings: Agreement = AGREEMENT) -> Float[Tensor, "P _"]:
    """Hat functions (P, S^2) of the knots at places (P, 2) of -1 to 1; rows sum to 1."""
    knots = torch.linspace(-1, 1, settings.knots, dtype=places.dtype, device=places.device)
    hats = (1 - (places[..., None] - knots).abs() * ((settings.knots - 1) / 2)).clamp_min(0)  # (P, 2, S)
    return (hats[:, 1, :, None] * hats[:, 0, None, :]).flatten(1)


def _expectation(device: torch.device, settings: Agreement = AGREEMENT) -> Tensor:
    """Inverse covariance (S^2, S^2) of one map's knots, float64."""
    along = torch.eye(settings.knots, dtype=torch.float64, device=device).diff(dim=0)
    bend, one = along.T @ along, torch.eye(settings.knots, dtype=torch.float64, device=device)
    rough = torch.kron(bend, one) + torch.kron(one, bend)
    return (
        torch.eye(settings.knots**2, dtype=torch.float64, device=device) / settings.expected**2
        + rough / settings.bend**2
    )


def blended(rig: Rig, neighbours: Neighbours, settings: Agreement = AGREEMENT) -> Float[Tensor, "V H W"]:
    """Log depths (V, H, W): where others show the same surface, the mean of all, weighted by 1 / b^2."""
    blended_logs, log_errors = [], rig.log_errors
    for a, others in enumerate(neighbours):
        points = rig.in_camera(a).flatten(0, 1).T
        own = rig.log_depths[a].flatten()
        total = (-2 * log_errors[a]).exp().flatten()
        change = torch.zeros_like(own)
        for b in others:
            there = carried(rig, a, b, points)
            gap = sampled(rig.log_depths[b], there.places) - there.log_depths
            same = there.inside & (gap.abs() < settings.same)
            weight = (-2 * sampled(log_errors[b], there.places)).exp() * same
            change, total = change + weight * gap.nan_to_num(), total + weight
        blended_logs.append((own + change / total).view(rig.size))
    return torch.stack(blended_logs)
