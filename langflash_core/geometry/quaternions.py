"""Unit quaternions, wxyz. q and -q are the same rotation."""

import torch
from jaxtyping import Float
from torch import Tensor
from torch.nn.functional import normalize


def unit_quats(quats: Float[Tensor, "*n 4"], eps: float = 1e-12) -> Float[Tensor, "*n 4"]:
    """Unit quaternions (..., 4) of any finite ones; where no entry exceeds `eps`, the identity.

    Divided by the largest entry first: squares of float32 overflow above 1e19.
    """
    largest = quats.abs().amax(-1, keepdim=True)
    identity = torch.zeros_like(quats)
    identity[..., 0] = 1
    return torch.where(largest > eps, normalize(quats / largest.clamp_min(eps), dim=-1), identity)


def quats_to_matrices(quats: Float[Tensor, "*n 4"], eps: float = 1e-12) -> Float[Tensor, "*n 3 3"]:
    """Rotation matrices of quaternions that need not be unit.

    Args:
        quats: (..., 4) wxyz, any norm; see `unit_quats` for those near 0.

    Returns:
        (..., 3, 3) rotation matrices.

    Source: standard formula; twin scipy.spatial.transform.Rotation in the tests.
    """
    w, x, y, z = unit_quats(quats, eps).unbind(-1)
    rows = (
        1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
        2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
        2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y),
    )  # fmt: skip
    return torch.stack(rows, dim=-1).unflatten(-1, (3, 3))


def matrices_to_quats(matrices: Float[Tensor, "*n 3 3"]) -> Float[Tensor, "*n 4"]:
    """Quaternions wxyz with w >= 0 of rotation matrices (..., 3, 3).

    The four candidate forms differ in their divisor; the largest divisor is the stable one.
    Source: Shepperd, "Quaternion from rotation matrix", 1978.
    """
    m = matrices
    xx, yy, zz = m[..., 0, 0], m[..., 1, 1], m[..., 2, 2]
    diagonal = torch.stack((xx + yy + zz, xx - yy - zz, yy - xx - zz, zz - xx - yy), -1)
    a, b, c = (m[..., 2, 1] - m[..., 1, 2], m[..., 0, 2] - m[..., 2, 0], m[..., 1, 0] - m[..., 0, 1])
    d, e, f = (m[..., 1, 0] + m[..., 0, 1], m[..., 0, 2] + m[..., 2, 0], m[..., 2, 1] + m[..., 1, 2])
    one = 1 + diagonal
    candidates = torch.stack(
        (
            torch.stack((one[..., 0], a, b, c), -1),
            torch.stack((a, one[..., 1], d, e), -1),
            torch.stack((b, d, one[..., 2], f), -1),
            torch.stack((c, e, f, one[..., 3]), -1),
        ),
        -2,
    )
    best = diagonal.argmax(-1)[..., None, None].expand(*diagonal.shape[:-1], 1, 4)
    quats = normalize(candidates.gather(-2, best).squeeze(-2), dim=-1)
    return torch.where(quats[..., :1] < 0, -quats, quats)


def multiply_quats(left: Float[Tensor, "... 4"], right: Float[Tensor, "... 4"]) -> Float[Tensor, "... 4"]:
    """Hamilton product (..., 4): the rotation `right` first, then `left`."""
    a, b, c, d = left.unbind(-1)
    e, f, g, h = right.unbind(-1)
    return torch.stack(
        (
            a * e - b * f - c * g - d * h,
            a * f + b * e + c * h - d * g,
            a * g - b * h + c * e + d * f,
            a * h + b * g - c * f + d * e,
        ),
        -1,
    )
