"""The covariance matrices of Gaussians, which the product never forms."""

from torch import Tensor

from langflash_core.geometry.quaternions import quats_to_matrices


def covariances(quats: Tensor, scales: Tensor) -> Tensor:
    """Covariance matrices R diag(s^2) R^T, (..., 3, 3), symmetric positive semi-definite."""
    half = quats_to_matrices(quats) * scales[..., None, :]
    return half @ half.transpose(-1, -2)
