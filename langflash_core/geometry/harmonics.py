"""Real spherical harmonics as used by 3D Gaussian splatting: colour = 0.5 + sum_b Y_b(d) c_b."""

import torch
from jaxtyping import Float
from torch import Tensor

SH_C0 = 0.28209479177387814
_C1 = 0.4886025119029199
_C2 = (1.0925484305920792, -1.0925484305920792, 0.31539156525252005, -1.0925484305920792, 0.5462742152960396)
_C3 = (
    -0.5900435899266435, 2.890611442640554, -0.4570457994644658, 0.3731763325901154,
    -0.4570457994644658, 1.445305721320277, -0.5900435899266435,
)  # fmt: skip
MAX_SHOWN_DEGREE = 3


def colour_to_sh(colours: Float[Tensor, "*n 3"]) -> Float[Tensor, "*n 3"]:
    """Degree-0 coefficient (..., 3) of a colour in [0, 1]."""
    return (colours - 0.5) / SH_C0


def sh_basis(directions: Float[Tensor, "*n 3"], degree: int) -> Float[Tensor, "*n S"]:
    """Y_b(d), (..., (degree + 1)^2), for unit directions (..., 3), degree 0 to 3.

    Source: Kerbl et al. 2023, the constants and signs of the reference implementation.
    """
    x, y, z = directions.unbind(-1)
    xx, yy, zz = x * x, y * y, z * z
    bases = [torch.full_like(x, SH_C0)]
    if degree >= 1:
        bases += [-_C1 * y, _C1 * z, -_C1 * x]
    if degree >= 2:
        bases += [
            _C2[0] * x * y, _C2[1] * y * z, _C2[2] * (2 * zz - xx - yy), _C2[3] * x * z, _C2[4] * (xx - yy),
        ]  # fmt: skip
    if degree >= 3:
        bases += [
            _C3[0] * y * (3 * xx - yy), _C3[1] * x * y * z, _C3[2] * y * (4 * zz - xx - yy),
            _C3[3] * z * (2 * zz - 3 * xx - 3 * yy), _C3[4] * x * (4 * zz - xx - yy),
            _C3[5] * z * (xx - yy), _C3[6] * x * (xx - 3 * yy),
        ]  # fmt: skip
    return torch.stack(bases, -1)


def sh_to_colour(sh: Float[Tensor, "N S 3"], directions: Float[Tensor, "N 3"]) -> Float[Tensor, "N 3"]:
    """Colours (N, 3), clamped at 0, of sh (N, S, 3) seen along unit directions (N, 3).

    Directions point from the camera to the Gaussian. Degrees above 3 are kept in files but
    not shown, as in the field's renderers.
    """
    return sh_to_signal(sh, directions).clamp_min(0)


def sh_to_signal(sh: Float[Tensor, "N S 3"], directions: Float[Tensor, "N 3"]) -> Float[Tensor, "N 3"]:
    """As `sh_to_colour`, not clamped."""
    degree = min(int(sh.shape[-2] ** 0.5) - 1, MAX_SHOWN_DEGREE)
    basis = sh_basis(directions, degree)
    return 0.5 + torch.einsum("nb,nbc->nc", basis, sh[:, : basis.shape[-1]])
