"""Flat elements of a surface: what spans them, the ellipse that two spans make, and where depth jumps.

Sizes: ... any leading sizes, H W pixels.
"""

import torch
from jaxtyping import Float
from torch import Tensor
from torch.nn import functional as F

STRETCH = 5.0  # a surface seen edge-on is not stretched further than this many footprints


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
    return shorter * (STRETCH * footprint[..., None] / longest).clamp_max(1)


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
