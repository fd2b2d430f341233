"""Which Gaussians a camera may see, found without looking at each of them.

Gaussians stand in packs of neighbours in space. A footprint touches a picture only where its mean lies
within four planes through the camera, moved out by what the footprint reaches, and in front of it: a half
extent in pixels is at most r (f sqrt(1 + t^2) s / z + sqrt(e)) for the largest scale s, the steepest
direction t of the Jacobian and the dilation e, and times z that is linear. Planes are tried on the ball
around each pack first, then on the Gaussians of what is left: a superset of what `project` keeps, at the cost
of what is seen and not of what there is.

Sizes: N Gaussians, P packs of `_PACK`. Frames: world, and the camera's. Twin: `project` of all,
tests/splat/test_frustum.py.
"""

import math
from dataclasses import dataclass

import torch
from jaxtyping import Float, Int
from torch import Tensor

from langflash_core.geometry.cameras import transform
from langflash_core.splat.projection import ALPHA_MIN, DILATION, NEAR, TAN_MARGIN, finite_rows
from langflash_core.types import Camera, Gaussians

_PACK = 256
_BITS = 10  # of a place along an axis, by which neighbours are found
_SLACK = 1.0  # pixels: what `Footprints.boxes` grants, and as much for rounding


@dataclass(frozen=True)
class Packs:
    """rows: (N',) of the Gaussians that can be drawn, pack after pack; means (N', 3) and largest scales (N',)
    of these; centres (P, 3), radii (P,) and largest scales (P,) of packs. radius: deviations to where the
    most opaque one ends."""

    rows: Int[Tensor, " n"]
    means: Float[Tensor, "n 3"]
    scales: Float[Tensor, " n"]
    centres: Float[Tensor, "P 3"]
    radii: Float[Tensor, " P"]
    largest: Float[Tensor, " P"]
    radius: float

    @staticmethod
    def of(gaussians: Gaussians) -> "Packs":
        rows = finite_rows(gaussians).nonzero().squeeze(-1)
        rows = rows[_curve(gaussians.means[rows]).argsort(stable=True)]
        means, scales = gaussians.means[rows], gaussians.scales[rows].amax(1)
        missing = -len(rows) % _PACK
        last = torch.arange(len(rows) + missing, device=rows.device).clamp(max=max(len(rows) - 1, 0))
        last = last[: 0 if len(rows) == 0 else None].view(-1, _PACK)  # the last pack is filled with its last
        packs = means[last]  # (P, _PACK, 3)
        centres = (packs.amin(1) + packs.amax(1)) / 2
        radii = (packs - centres[:, None]).norm(dim=-1).amax(1)
        opaque = float(gaussians.opacities[rows].max()) if len(rows) else 1.0
        radius = math.sqrt(2 * math.log(max(opaque / ALPHA_MIN, 1.0)))
        return Packs(rows, means, scales, centres, radii, scales[last].amax(1), radius)

    def before(self, camera: Camera) -> Int[Tensor, " n"]:
        """Rows of the Gaussians that may touch the picture, in ascending order."""
        if camera.orthographic:
            return self.rows.sort().values
        planes, offsets, outs = (v.to(self.means) for v in _planes(camera, self.radius))
        reach = self.largest[:, None] * outs + self.radii[:, None]
        near = (self.centres @ planes.T + offsets + reach >= 0).all(1).nonzero().squeeze(-1)
        some = (near[:, None] * _PACK + torch.arange(_PACK, device=near.device)).flatten()
        some = some[some < len(self.rows)]
        seen = self.means[some] @ planes.T + offsets + self.scales[some, None] * outs >= 0
        return self.rows[some[seen.all(1)]].sort().values


def reaches(
    gaussians: Gaussians, camera: Camera, least: float
) -> tuple[Float[Tensor, "n 2"], Float[Tensor, "n 2"]]:
    """Where Gaussians before a camera lie, and how far at most their footprints go from there along both
    axes, in pixels: nothing that takes the size of a covariance is computed.

    Args:
        least: alpha below which nothing of them counts.
    """
    K, viewmat = camera.K.to(gaussians.means), camera.viewmat.to(gaussians.means)
    pos_c = transform(viewmat, gaussians.means)
    ahead = torch.ones_like(pos_c[:, 2:]) if camera.orthographic else pos_c[:, 2:].clamp_min(NEAR)
    focal, principal = K.diagonal()[:2], K[:2, 2]
    size = torch.tensor([camera.width, camera.height]).to(focal)
    steepest = torch.maximum(principal, size - principal) / focal + TAN_MARGIN * 0.5 * size / focal
    radii = (2 * (gaussians.opacities / least).clamp_min(1).log()).sqrt()[:, None]
    grown = gaussians.scales.amax(1, keepdim=True) / ahead
    reach = radii * (grown * focal * (1 + steepest.square()).sqrt() + math.sqrt(DILATION)) + _SLACK
    return pos_c[:, :2] / ahead * focal + principal, reach


def _curve(means: Tensor) -> Tensor:
    """Places (N,) along a curve that stays among neighbours (Morton's), of points (N, 3)."""
    if len(means) == 0:
        return torch.zeros(0, dtype=torch.int64, device=means.device)
    low, high = means.amin(0), means.amax(0)
    cells = (1 << _BITS) * ((means - low) / (high - low).clamp_min(1e-12))
    cells = cells.long().clamp(0, (1 << _BITS) - 1)
    place = torch.zeros_like(cells[:, 0])
    for bit in range(_BITS):
        for axis in range(3):
            place |= ((cells[:, axis] >> bit) & 1) << (3 * bit + axis)
    return place


def _planes(camera: Camera, radius: float) -> tuple[Tensor, Tensor, Tensor]:
    """Five planes: normals (5, 3) of unit length and offsets (5,) in the world, and how far (5,) each lies
    outside for a scale of 1; inside is >= 0. float64."""
    K, viewmat = camera.K.double(), camera.viewmat.double()
    normals, outs = [[0.0, 0.0, 1.0]], [0.0]
    for axis, side in enumerate((camera.width, camera.height)):
        focal, principal = float(K[axis, axis]), float(K[axis, 2])
        margin = TAN_MARGIN * 0.5 * side / focal
        steepest = max(principal, side - principal) / focal + margin
        reach = radius * focal * math.sqrt(1 + steepest * steepest)
        slack = _SLACK + radius * math.sqrt(DILATION)
        for sign, room in ((1.0, principal + slack), (-1.0, side - principal + slack)):
            normal = [0.0, 0.0, room]
            normal[axis] = sign * focal
            length = math.hypot(focal, room)
            normals.append([value / length for value in normal])
            outs.append(reach / length)
    planes = torch.tensor(normals, dtype=torch.float64)
    offsets = planes @ viewmat[:3, 3]
    offsets[0] -= NEAR * 0.999  # z itself is compared in `project`, in its own rounding
    return planes @ viewmat[:3, :3], offsets, torch.tensor(outs, dtype=torch.float64)
