"""The camera that a picture was taken with, fitted to the picture: photometric Gauss-Newton.

Papers on novel views without poses fit each target's pose to its picture before PSNR (NoPoSplat does), so
that a pose that is a little wrong is not counted as a wrong picture. Here a drawn pixel p of colour r(p) and
depth z(p) is a point X = z K^-1 p of the camera; with a small motion exp(x) of the camera the photo I should
show it at pi(exp(x) X). Gauss-Newton, with Huber's weights, on I(pi(exp(x) X)) - r; then the scene is drawn
again from the moved camera. The photo is blurred less from round to round.

Sizes: H W pixels, P of them drawn. Everything in float64.
"""

from collections.abc import Callable
from dataclasses import replace

import torch
from jaxtyping import Bool, Float
from torch import Tensor
from torch.nn import functional as F

from langflash_core.geometry.cameras import unproject
from langflash_core.language.settings import ANSWERING
from langflash_core.types import Camera, Frame

BLURS = (4.0, 2.0, 1.0)
"""Pixels, one round each."""
STEPS = 8
HUBER = 0.05
"""Difference of colour from which a pixel pulls no harder."""
LEAST = 200
"""Pixels without which six numbers are not asked for."""


def aligned_camera(draw: Callable[[Camera], Frame], camera: Camera, photo: Float[Tensor, "H W 3"]) -> Camera:
    """A camera near the one given, from which the scene looks more like the photo.

    Args:
        draw: gives colours, depths and alphas from a camera. photo: [0, 1], of the camera's size.

    Returns:
        Of the cameras that were tried, the one given among them, that of the least mean squared difference.

    Source: Gauss-Newton on the intensity difference of a depth map, as Steinbruecker et al. 2011.
    """
    photo = photo.double().cpu()
    best, least, here = camera, float("inf"), camera
    for blur in (*BLURS, None):
        frame = draw(here)
        shown = frame.rgb.double().cpu()
        difference = float((shown.clamp(0, 1) - photo).square().mean())
        if difference < least:
            best, least = here, difference
        if blur is None:
            break
        motion = _fitted(shown, frame, here.K.double().cpu(), photo, blur)
        here = replace(here, viewmat=(motion @ here.viewmat.double().cpu()).to(here.viewmat))
    return best


def _fitted(shown: Tensor, frame: Frame, K: Tensor, photo: Tensor, blur: float) -> Tensor:
    """The motion (4, 4) of the camera that brings what is drawn to the photo; the identity where too little
    is drawn."""
    drawn = (frame.alphas.cpu() >= ANSWERING.covered_alpha) & (frame.depths.cpu() > 0)
    motion = torch.eye(4, dtype=torch.float64)
    points = unproject(frame.depths.double().cpu(), K)[drawn]
    colours, blurred = _blurred(shown, blur)[drawn], _blurred(photo, blur)
    for _ in range(STEPS):
        residuals, jacobian, inside = residuals_of(motion, points, colours, K, blurred)
        if int(inside.sum()) < LEAST:
            return torch.eye(4, dtype=torch.float64)
        residuals, jacobian = residuals[inside].flatten(), jacobian[inside].flatten(0, 1)
        weights = (HUBER / residuals.abs().clamp_min(1e-12)).clamp_max(1.0)
        weighted = jacobian * weights[:, None]
        normal = weighted.T @ jacobian
        step = torch.linalg.solve(
            normal + 1e-6 * normal.trace() * torch.eye(6).double(), weighted.T @ -residuals
        )
        motion = moved(step) @ motion
        if float(step.abs().max()) < 1e-6:
            break
    return motion


def residuals_of(
    motion: Float[Tensor, "4 4"],
    points: Float[Tensor, "P 3"],
    colours: Float[Tensor, "P 3"],
    K: Float[Tensor, "3 3"],
    photo: Float[Tensor, "H W 3"],
) -> tuple[Float[Tensor, "P 3"], Float[Tensor, "P 3 6"], Bool[Tensor, " P"]]:
    """I(pi(M X)) - r, its derivative by a further motion (turn, shift) of the camera, and which points fall
    inside the photo."""
    x, y, z = (points @ motion[:3, :3].T + motion[:3, 3]).unbind(-1)
    ahead = z.clamp_min(1e-6)
    u, v = K[0, 0] * x / ahead + K[0, 2], K[1, 1] * y / ahead + K[1, 2]
    values, across, down, inside = sampled(photo, u, v)
    none = torch.zeros_like(x)
    u_by = torch.stack((K[0, 0] / ahead, none, -K[0, 0] * x / ahead**2), -1)  # by the moved point (P, 3)
    v_by = torch.stack((none, K[1, 1] / ahead, -K[1, 1] * y / ahead**2), -1)
    by_point = across[..., None] * u_by[:, None] + down[..., None] * v_by[:, None]  # (P, 3, 3)
    turned = torch.stack(
        (none, z, -y, -z, none, x, y, -x, none), -1
    ).unflatten(-1, (3, 3))  # d(w x X) / dw = -[X]  # fmt: skip
    jacobian = torch.cat((by_point @ turned, by_point), -1)
    return values - colours, jacobian, inside & (z > 1e-6)


def sampled(
    photo: Float[Tensor, "H W 3"], u: Float[Tensor, " P"], v: Float[Tensor, " P"]
) -> tuple[Float[Tensor, "P 3"], Float[Tensor, "P 3"], Float[Tensor, "P 3"], Bool[Tensor, " P"]]:
    """Bilinear colours at places (pixel centres at .5), their exact slopes across and down, and which places
    have four pixels around them."""
    height, width = photo.shape[:2]
    column, row = u - 0.5, v - 0.5
    inside = (column >= 0) & (row >= 0) & (column < width - 1) & (row < height - 1)
    left = column.detach().floor().clamp(0, width - 2).long()
    top = row.detach().floor().clamp(0, height - 2).long()
    a, b = (column - left)[:, None], (row - top)[:, None]
    first, second = photo[top, left], photo[top, left + 1]
    third, fourth = photo[top + 1, left], photo[top + 1, left + 1]
    across = (1 - b) * (second - first) + b * (fourth - third)
    down = (1 - a) * (third - first) + a * (fourth - second)
    upper, lower = torch.lerp(first, second, a), torch.lerp(third, fourth, a)
    return torch.lerp(upper, lower, b), across, down, inside


def moved(step: Float[Tensor, " 6"]) -> Float[Tensor, "4 4"]:
    """exp of a turn and a shift."""
    x, y, z = step[:3]
    none = torch.zeros_like(x)
    turn = torch.stack((none, -z, y, z, none, -x, -y, x, none)).unflatten(0, (3, 3))
    algebra = torch.cat((torch.cat((turn, step[3:, None]), 1), step.new_zeros(1, 4)))
    return torch.linalg.matrix_exp(algebra)


def _blurred(picture: Tensor, sigma: float) -> Tensor:
    """(H, W, 3) under a Gaussian window, edges repeated."""
    radius = round(2.5 * sigma)
    steps = torch.arange(-radius, radius + 1, dtype=picture.dtype)
    line = torch.exp(-(steps**2) / (2 * sigma**2))
    line = line / line.sum()
    maps = F.pad(picture.permute(2, 0, 1)[:, None], (radius,) * 4, mode="replicate")
    maps = F.conv2d(F.conv2d(maps, line[None, None, :, None]), line[None, None, None, :])
    return maps[:, 0].permute(1, 2, 0)
