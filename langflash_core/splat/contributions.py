"""Which Gaussians some pixels show: how much each adds to them, at most.

    c_i = max over the pixels p of T_i(p) alpha_i(p),

the weight that compositing gives Gaussian i at the pixel where it counts most. What hides behind
a surface has T near 0 there and adds nothing, wherever its mean lies. With `through`, T is left
out: then everything that covers a pixel counts, hidden or not.
"""

import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor

from langflash_core.types import Camera, Gaussians

from .projection import ALPHA_MIN, NEAR, Footprints, project
from .reference import _alphas, _pairs, _rectangles, _transmittances


def contributions(
    gaussians: Gaussians,
    camera: Camera,
    pixels: Bool[Tensor, "H W"],
    *,
    through: bool = False,
    near: float = NEAR,
) -> Float[Tensor, " N"]:
    """Largest contribution of every Gaussian to a set of pixels.

    Exact in the dtype given, transmittances always in float64; only the pixels' own rectangle is
    worked on, so a brush costs little in a large view.

    Args:
        gaussians: N of them; those with values that are not finite contribute 0.
        pixels: (H, W) bool, of the camera's size.
        through: leave out the transmittance.

    Returns:
        (N,) in [0, 0.99].

    Raises:
        ValueError: the pixels are not of the camera's size.
    """
    if tuple(pixels.shape) != (camera.height, camera.width):
        expected = (camera.height, camera.width)
        raise ValueError(f"pixels: expected {expected}, received {tuple(pixels.shape)}")
    result = gaussians.means.new_zeros(len(gaussians))
    asked = pixels.nonzero()
    if not len(asked):
        return result
    (y0, x0), (y1, x1) = asked.amin(0).tolist(), (asked.amax(0) + 1).tolist()
    with torch.no_grad():
        footprints = project(gaussians, camera, near)
        wanted = lambda box: bool(pixels[box[1] : box[3], box[0] : box[2]].any())  # noqa: E731
        for _, rows, clipped in _rectangles(footprints, (x0, y0, x1, y1), wanted):
            _raise_to(result, footprints, rows, clipped, pixels, through)
    return result


def composition(footprints: Footprints, x: int, y: int) -> tuple[Int[Tensor, " n"], Float[Tensor, " n"]]:
    """What one pixel is made of: rows (n,) of the Gaussians projected, nearest first, and T alpha (n,).

    A weight map at the pixel is W_k = sum_i T_i alpha_i w_ik. `project` takes most of the time and
    serves every pixel of a view.
    """
    x0, y0, x1, y1 = footprints.boxes().unbind(-1)
    near = ((x0 <= x) & (x < x1) & (y0 <= y) & (y < y1)).nonzero().squeeze(-1)
    alphas = _alphas(footprints, near, torch.full_like(near, x), torch.full_like(near, y))
    near, alphas = near[alphas >= ALPHA_MIN], alphas[alphas >= ALPHA_MIN]
    return footprints.ids[near], _transmittances(alphas, torch.zeros_like(near)) * alphas


def _raise_to(
    result: Tensor, footprints: Footprints, reaching: Tensor, clipped: Tensor, pixels: Tensor, through: bool
) -> None:
    """Raise `result` (N,) in place to the contributions inside one rectangle."""
    boxes, xs, ys = _pairs(clipped)
    asked = pixels[ys, xs]
    rows, xs, ys = reaching[boxes[asked]], xs[asked], ys[asked]
    alphas = _alphas(footprints, rows, xs, ys)
    kept = alphas >= ALPHA_MIN
    rows, alphas, places = rows[kept], alphas[kept], (ys * pixels.shape[1] + xs)[kept]
    if not through:
        places, order = places.sort(stable=True)  # pairs came nearest first: ties keep depth order
        rows, alphas = rows[order], alphas[order]
        alphas = _transmittances(alphas, places) * alphas
    result.scatter_reduce_(0, footprints.ids[rows], alphas.to(result), "amax")
