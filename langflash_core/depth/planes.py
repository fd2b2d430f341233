"""Surfaces that are flat as far as anybody can tell are flat: ripples of depth go, things on a wall stay.

A depth map of tokens ripples by a percent or two, at the tokens' distance. From the photo's own place nobody
sees it; from aside floors and walls are waves. A plane is linear in inverse depth, 1 / z = m . (x, y, 1), so
around every pixel planes are fitted to windows of several sizes, from box sums alone. A pixel takes the plane
of the largest window that its plane explains to within a share of what the map expects of its errors. A
window with a step, a bend or a thing in it has none: there a smaller one speaks, or the map as it was.

Sizes: V views, H W pixels. Depths are log z.

Source: own derivation; the largest window whose fit is within the noise is that of Lepski 1990 and of local
polynomial regression (Katkovnik et al. 2006).
"""

import torch
from jaxtyping import Float
from torch import Tensor
from torch.nn import functional as F

from langflash_core.rig.settings import FLATTENING, Flattening

WITHOUT_DOUBLES = ("mps",)
"""Devices that have no float64: there the processor fits."""


def flatten_ripples(
    log_depths: Float[Tensor, "V H W"], log_errors: Float[Tensor, "V H W"], settings: Flattening = FLATTENING
) -> Float[Tensor, "V H W"]:
    """Log depths (V, H, W) without ripples; `log_errors` (V, H, W), what is expected of them, stays."""
    size = (log_depths.shape[-2], log_depths.shape[-1])
    inverse, errors = _halve_size((-log_depths).exp()), _halve_size(log_errors.exp())
    inverse = inverse / inverse.mean((2, 3), keepdim=True)
    ripples = (settings.share * errors).clamp(*settings.range)
    flat = inverse
    for radius in settings.radii:
        fit, squares = fitted_planes(inverse, radius)
        off = (fit / inverse - 1) / (settings.farthest * ripples)
        explained = ((1 - squares / ripples**2).clamp_min(0) * (1 - off**2).clamp_min(0)).sqrt()
        flat = flat + (2 * explained).clamp(max=1) * (fit - flat)
    change = (inverse / flat).log().to(log_depths)
    return log_depths + F.interpolate(change, size, mode="bilinear", align_corners=False)[:, 0]


def fitted_planes(
    inverse: Float[Tensor, "V C h w"], radius: int
) -> tuple[Float[Tensor, "V 1 h w"], Float[Tensor, "V 1 h w"]]:
    """The plane of least squares in a window around every pixel, (V, 1, h, w): its value there, and the mean
    square of what it leaves, relative to the window's mean.

    Windows end at the border. They are rectangles, in which x and y do not covary.
    """
    height, width = inverse.shape[-2:]
    x, y = (
        torch.arange(n, dtype=inverse.dtype, device=inverse.device) - (n - 1) / 2 for n in (width, height)
    )
    x, y = x.expand(1, 1, height, width), y[:, None].expand(1, 1, height, width)
    mean, mean_x, mean_y = _mean(inverse, radius), _mean(x, radius), _mean(y, radius)
    spread_x, spread_y = _mean(x * x, radius) - mean_x**2, _mean(y * y, radius) - mean_y**2
    slope_x = (_mean(inverse * x, radius) - mean * mean_x) / spread_x.clamp_min(1e-9)
    slope_y = (_mean(inverse * y, radius) - mean * mean_y) / spread_y.clamp_min(1e-9)
    left = _mean(inverse**2, radius) - mean**2 - slope_x**2 * spread_x - slope_y**2 * spread_y
    return mean + slope_x * (x - mean_x) + slope_y * (y - mean_y), left.clamp_min(0) / mean**2


def _halve_size(maps: Tensor) -> Tensor:
    """(V, H, W) -> (V, 1, h, w), float64, means of two by two: ripples are slower, and sums eat digits."""
    own = maps.cpu() if maps.device.type in WITHOUT_DOUBLES else maps
    return F.avg_pool2d(own[:, None].double(), 2, ceil_mode=True)


def _mean(maps: Tensor, radius: int) -> Tensor:
    """Of what a window holds, (n, 1, h, w)."""
    side = 2 * radius + 1
    rows = F.avg_pool2d(maps, (1, side), 1, (0, radius), count_include_pad=False)
    return F.avg_pool2d(rows, (side, 1), 1, (radius, 0), count_include_pad=False)
