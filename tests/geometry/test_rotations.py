"""Rotations in numpy against scipy's, which knows nothing of ours."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from langflash_core.geometry import rotations

EXACT = 1e-12  # a few operations in float64


def scipy_of(quat: rotations.Quaternion) -> Rotation:
    w, x, y, z = quat
    return Rotation.from_quat([x, y, z, w])


def some() -> list[Rotation]:
    """Random ones, and half turns, where the real part is nothing and another branch is taken."""
    halves = [Rotation.from_rotvec(math.pi * axis) for axis in (*np.eye(3), np.array([0.6, 0.0, 0.8]))]
    return [*Rotation.random(20, rng=np.random.default_rng(3)), *halves, Rotation.identity()]


@pytest.mark.parametrize("turn", some())
def test_matrix_and_quaternion_are_those_of_scipy_and_each_others_inverse(turn: Rotation) -> None:
    quat = rotations.quaternion(turn.as_matrix())
    np.testing.assert_allclose(rotations.matrix(quat), turn.as_matrix(), atol=EXACT)
    np.testing.assert_allclose(scipy_of(quat).as_matrix(), turn.as_matrix(), atol=EXACT)
    assert quat[0] >= 0 and math.hypot(*quat) == pytest.approx(1, abs=EXACT)


@pytest.mark.parametrize("turn", some())
def test_about_an_axis_of_any_length(turn: Rotation) -> None:
    vector = turn.as_rotvec()
    angle = float(np.linalg.norm(vector))
    axis = vector if angle else np.array([0.0, 0.0, 2.0])
    np.testing.assert_allclose(rotations.about(3.0 * axis, angle), turn.as_matrix(), atol=EXACT)


def test_slerp_is_that_of_scipy_where_the_arc_is_long() -> None:
    ends = [turn for turn in some() if math.pi / 3 < turn.magnitude() < 0.99 * math.pi]
    assert len(ends) > 5
    for end in ends:
        found = rotations.slerp((1, 0, 0, 0), rotations.quaternion(end.as_matrix()), 0.3)
        exact = Slerp([0, 1], Rotation.concatenate([Rotation.identity(), end]))(0.3)
        np.testing.assert_allclose(scipy_of(found).as_matrix(), exact.as_matrix(), atol=1e-9)
