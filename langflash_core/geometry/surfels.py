"""Flat elements of a surface: what spans them, the ellipse that two spans make, and where depth jumps.

Sizes: ... any leading sizes, H W pixels.
"""

import numpy as np
import torch
from jaxtyping import Bool, Float
from torch import Tensor
from torch.nn import functional as F

from langflash_core.geometry.quaternions import quats_to_matrices
from langflash_core.geometry.settings import SURFELS
from langflash_core.types import Gaussians


def spans(
    pos_c: Float[Tensor, "*n H W 3"], footprint: Float[Tensor, "*n H W"]
) -> tuple[Float[Tensor, "*n H W 3"], Float[Tensor, "*n H W 3"]]:
    """Tangents (..., H, W, 3) of points (..., H, W, 3) from a pixel to the next, along columns and rows.

    The shorter of the forward and backward differences: the nearer side of a jump of depth.

    Args:
        footprint: (..., H, W), what a pixel covers at its depth, in the points' unit.
    """
    return _difference(pos_c, -2, footprint), _difference(pos_c, -3, footprint)


def _difference(pos_c: Tensor, dim: int, footprint: Tensor) -> Tensor:
    steps = pos_c.diff(dim=dim)
    before = torch.cat((steps.narrow(dim, 0, 1), steps), dim) if steps.shape[dim] else torch.zeros_like(pos_c)
    after = torch.cat((steps, steps.narrow(dim, -1, 1)), dim) if steps.shape[dim] else before
    shorter = torch.where((before.norm(dim=-1) < after.norm(dim=-1))[..., None], before, after)
    longest = shorter.norm(dim=-1, keepdim=True).clamp_min(1e-12)
    return shorter * (SURFELS.stretch * footprint[..., None] / longest).clamp_max(1)


def ellipses(
    span_u: Float[Tensor, "*n 3"], span_v: Float[Tensor, "*n 3"]
) -> tuple[Float[Tensor, "*n 3 3"], Float[Tensor, "*n 2"]]:
    """The ellipse whose covariance is t_u t_u^T + t_v t_v^T; its 2 x 2 eigenproblem is closed-form.

    Args:
        span_u, span_v: (..., 3).

    Returns:
        Rotations (..., 3, 3) whose columns are the longer axis, the shorter one and the normal, and standard
        deviations (..., 2) along the first two. Spans that are parallel, or 0, have any normal across them.

    Source: own derivation; twin: numpy eigh in tests/geometry.
    """
    first = _direction(torch.where((span_u == 0).all(-1, keepdim=True), span_v, span_u))
    normal = _normal(first, F.normalize(span_v, dim=-1))
    second = torch.linalg.cross(normal, first)
    # In the (first, second) plane t_u = (a, 0), t_v = (b, c).
    a, b, c = span_u.norm(dim=-1), (span_v * first).sum(-1), (span_v * second).sum(-1)
    mean, half = (a * a + b * b + c * c) / 2, (a * a + b * b - c * c) / 2
    radius = torch.hypot(half, b * c)
    angle = 0.5 * torch.atan2(b * c, half)
    cosine, sine = angle.cos()[..., None], angle.sin()[..., None]
    axes = torch.stack((cosine * first + sine * second, cosine * second - sine * first, normal), -1)
    return axes, torch.stack((mean + radius, (mean - radius).clamp_min(0)), -1).sqrt()


def _direction(span: Tensor) -> Tensor:
    """Unit vectors (..., 3); of 0, the x axis."""
    x_axis = torch.eye(3).to(span)[0]
    return F.normalize(torch.where((span == 0).all(-1, keepdim=True), x_axis, span), dim=-1)


def _normal(first: Tensor, other: Tensor) -> Tensor:
    """Unit vectors (..., 3) across two unit vectors; across the first where both are parallel as far as their
    rounding tells."""
    normal = torch.linalg.cross(first, other)
    parallel = normal.norm(dim=-1, keepdim=True) < torch.finfo(first.dtype).eps ** 0.5
    least = F.one_hot(first.abs().argmin(-1), 3).to(first)
    return F.normalize(torch.where(parallel, torch.linalg.cross(first, least), normal), dim=-1)


def steps_along(
    log_depths: Float[Tensor, "*n H W"], dim: int
) -> tuple[Float[Tensor, "*n H W"], Float[Tensor, "*n H W"]]:
    """From a pixel to the next along an axis, and to the one before it, (..., H, W); 0 at the border."""
    steps = log_depths.diff(dim=dim)
    none = torch.zeros_like(log_depths.narrow(dim, 0, 1))
    return torch.cat((steps, none), dim), torch.cat((none, -steps), dim)


def towards_nearer(log_depths: Float[Tensor, "*n H W"], jump: float) -> Float[Tensor, "*n H W 2"]:
    """(..., H, W, 2) of -1, 0, 1 along columns and rows: where the nearer side of a jump is from a pixel of
    the farther one; 0 where it is on both sides.

    Args:
        log_depths: (..., H, W). jump: of log depth from a pixel to the next.
    """
    signs = []
    for dim in (-1, -2):
        after, before = steps_along(log_depths, dim)
        signs.append((after < -jump).to(log_depths) - (before < -jump).to(log_depths))
    return torch.stack(signs, -1)


def finite_rows(values: Float[Tensor, "N d"]) -> Bool[Tensor, " N"]:
    """Rows (N, d) without NaN and infinity, on the CPU."""
    return torch.isfinite(values.detach().cpu()).all(-1)


def covered_areas(gaussians: Gaussians) -> Float[np.ndarray, " N"]:
    """Opacity times the product of the two longest axes (N,) float64; 0 where a value is not finite."""
    axes = gaussians.scales.detach().cpu().double().abs().sort(-1).values
    areas = gaussians.opacities.detach().cpu().double() * axes[:, 1] * axes[:, 2]
    finite = finite_rows(gaussians.means) & finite_rows(gaussians.quats) & torch.isfinite(areas)
    return torch.where(finite, areas, 0.0).numpy()


def normals_of(gaussians: Gaussians) -> Float[np.ndarray, "N 3"]:
    """The shortest axis of each Gaussian; 0 of those that are not flat."""
    scales = gaussians.scales.double().numpy()
    ordered = np.sort(scales, 1)
    axes = quats_to_matrices(gaussians.quats.double()).numpy()
    normals = np.take_along_axis(axes, scales.argmin(1)[:, None, None], 2)[:, :, 0]
    flat = ordered[:, 0] <= SURFELS.flat * ordered[:, 1]
    return np.where(flat[:, None], np.nan_to_num(normals), 0.0)
