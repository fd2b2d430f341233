"""Rotations against scipy, and the degenerate quaternions that files contain."""

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from langflash_core.geometry.quaternions import (
    matrices_to_quats,
    multiply_quats,
    quats_to_matrices,
    unit_quats,
)
from tests.geometry.spread import covariances


def _rotations(count: int = 300) -> tuple[torch.Tensor, torch.Tensor]:
    rotations = Rotation.random(count, rng=np.random.default_rng(0))
    quats = torch.from_numpy(rotations.as_quat(scalar_first=True))
    return quats, torch.from_numpy(rotations.as_matrix())


def test_matrices_equal_scipy():
    quats, matrices = _rotations()
    assert torch.allclose(quats_to_matrices(quats), matrices, atol=1e-14)


def test_scale_and_sign_do_not_matter():
    quats, matrices = _rotations()
    assert torch.allclose(quats_to_matrices(-3.7 * quats), matrices, atol=1e-14)


def test_a_zero_quaternion_is_the_identity():
    assert torch.equal(quats_to_matrices(torch.zeros(2, 4)), torch.eye(3).expand(2, 3, 3))
    assert torch.equal(unit_quats(torch.full((4,), 1e-13)), torch.tensor([1.0, 0.0, 0.0, 0.0]))


@pytest.mark.parametrize("size", [1e-11, 1e-3, 1.0, 1e20, 1e38])
def test_unit_quats_of_any_size(size):
    """Squares of float32 overflow above 1e19 and vanish below 1e-23."""
    quats = size * torch.tensor([[0.5, -0.5, 0.5, 0.5], [0.0, 0.0, 1.0, 0.0]])
    expected = torch.tensor([[0.5, -0.5, 0.5, 0.5], [0.0, 0.0, 1.0, 0.0]])
    torch.testing.assert_close(unit_quats(quats), expected, rtol=0, atol=1e-6)  # a few float32 ulps


@pytest.mark.parametrize("axis", [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0)])
@pytest.mark.parametrize("angle", [0.0, 1e-8, 3.14159265, 3.141592653589793])
def test_matrices_to_quats_holds_where_the_trace_vanishes(axis, angle):
    vector = torch.nn.functional.normalize(torch.tensor(axis, dtype=torch.float64), dim=0)
    matrix = torch.from_numpy(Rotation.from_rotvec(angle * vector.numpy()).as_matrix())
    quats = matrices_to_quats(matrix)
    assert torch.allclose(quats_to_matrices(quats), matrix, atol=1e-14)
    assert quats[0] >= 0


def test_round_trip_and_product():
    quats, matrices = _rotations()
    assert torch.allclose(quats_to_matrices(matrices_to_quats(matrices)), matrices, atol=1e-14)
    product = multiply_quats(quats[:100], quats[100:200])
    assert torch.allclose(quats_to_matrices(product), matrices[:100] @ matrices[100:200], atol=1e-14)


def test_covariances_have_the_scales_as_spectrum():
    quats, _ = _rotations(50)
    scales = torch.rand(50, 3, dtype=torch.float64) + 0.01
    spectrum = torch.linalg.eigvalsh(covariances(quats, scales))
    assert torch.allclose(spectrum, (scales**2).sort(-1).values, rtol=1e-10)


def test_gradients():
    quats = torch.randn(3, 4, dtype=torch.float64, requires_grad=True, generator=torch.manual_seed(0))
    assert torch.autograd.gradcheck(quats_to_matrices, quats)
