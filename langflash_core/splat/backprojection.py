"""Per-pixel values carried back to the Gaussians that show them: closed form, nothing is trained.

With c_ip = T_i(p) alpha_i(p), the weight of Gaussian i at pixel p, and a value m(p) per pixel of several
views, the w_i that minimise

    sum over views and p of c_ip |w_i - m(p)|^2    are    w_i = sum c_ip m(p) / sum c_ip.

It is the least-squares fit of the splatted image sum_i c_ip w_i to m(p) with the normal equations lumped
onto their diagonal; where a pixel shows one surface, both agree. Values that are shares (>= 0, sum 1)
stay so.
"""

import torch
from jaxtyping import Float
from torch import Tensor

from langflash_core.types import Camera, Gaussians

from .projection import ALPHA_MIN, NEAR, Footprints, project
from .reference import _alphas, _pairs, _rectangles, _transmittances

_PAIRS_AT_ONCE = 1 << 17  # times K floats of memory: 33 MB for K = 64


@torch.no_grad()
def backproject(
    gaussians: Gaussians,
    camera: Camera,
    values: Float[Tensor, "H W K"],
    trust: Float[Tensor, "H W"] | None = None,
    near: float = NEAR,
) -> tuple[Float[Tensor, "N K"], Float[Tensor, " N"]]:
    """Sums of one view; add up those of several views, then divide.

    Args:
        gaussians: N of them; those with values that are not finite get 0.
        values: (H, W, K), of the camera's size. trust: (H, W) >= 0, what a pixel counts; None: 1.

    Returns:
        sum_p c_ip trust(p) m(p), (N, K), and sum_p c_ip trust(p), (N,), float32.

    Raises:
        ValueError: values or trust are not of the camera's size.
    """
    size = (camera.height, camera.width)
    for name, given in (("values", values.shape[:2]), ("trust", size if trust is None else trust.shape)):
        if tuple(given) != size:
            raise ValueError(f"{name}: expected {size}, received {tuple(given)}")
    count = torch.ones_like(values[..., 0]) if trust is None else trust.to(values)
    # The last column sums the weights themselves.
    flat = torch.cat((values * count[..., None], count[..., None]), -1).flatten(0, 1).float()
    sums = flat.new_zeros(len(gaussians), flat.shape[1])
    footprints = project(gaussians, camera, near)
    for _, rows, clipped in _rectangles(footprints, (0, 0, camera.width, camera.height)):
        _add(sums, flat, footprints, rows, clipped, camera.width)
    return sums[:, :-1], sums[:, -1]


def _add(
    sums: Tensor, flat: Tensor, footprints: Footprints, reaching: Tensor, clipped: Tensor, width: int
) -> None:
    """Add the pixels of one rectangle to sums (N, K + 1) in place; flat (H W, K + 1)."""
    boxes, xs, ys = _pairs(clipped)
    rows = reaching[boxes]
    alphas = _alphas(footprints, rows, xs, ys)
    kept = alphas >= ALPHA_MIN
    places, order = (ys * width + xs)[kept].sort(stable=True)  # pairs came nearest first
    rows, alphas = rows[kept][order], alphas[kept][order]
    shares = (_transmittances(alphas, places) * alphas).to(sums)
    ids = footprints.ids[rows]
    for first in range(0, len(ids), _PAIRS_AT_ONCE):
        some = slice(first, first + _PAIRS_AT_ONCE)
        sums.index_add_(0, ids[some], shares[some, None] * flat[places[some]])
