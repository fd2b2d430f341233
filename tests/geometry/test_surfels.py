"""Ellipses of two spans against numpy's eigh, spans against loops: planes, jumps, single rows, nothing."""

import itertools

import numpy as np
import pytest
import torch

from langflash_core.geometry.cameras import rays, unproject
from langflash_core.geometry.quaternions import matrices_to_quats, quats_to_matrices
from langflash_core.geometry.settings import SURFELS
from langflash_core.geometry.surfels import ellipses, spans

K = torch.tensor([[40.0, 0, 16], [0, 44.0, 12], [0, 0, 1]], dtype=torch.float64)
EXACT = 1e-12  # float64, a dozen operations on numbers of about 1


def _pairs(count: int = 200, dtype: torch.dtype = torch.float64) -> tuple[torch.Tensor, torch.Tensor]:
    """Spans of lengths from 1/20 to 20 in any direction."""
    g = torch.Generator().manual_seed(0)
    u, v = torch.randn(2, count, 3, generator=g, dtype=torch.float64)
    sizes = torch.exp(torch.randn(2, count, 1, generator=g, dtype=torch.float64))
    return (u * sizes[0]).to(dtype), (v * sizes[1]).to(dtype)


def _covariance(axes: torch.Tensor, deviations: torch.Tensor) -> torch.Tensor:
    flat = axes[..., :2] * deviations[..., None, :]
    return flat @ flat.transpose(-1, -2)


def _outer(u: torch.Tensor, v: torch.Tensor) -> torch.Tensor:
    return u[..., :, None] * u[..., None, :] + v[..., :, None] * v[..., None, :]


def _is_rotation(axes: torch.Tensor, within: float) -> None:
    eye = torch.eye(3).to(axes)
    assert (axes.transpose(-1, -2) @ axes - eye).abs().max() < within
    assert (torch.linalg.det(axes) - 1).abs().max() < within


def test_ellipses_are_those_of_eigh():
    u, v = _pairs()
    axes, deviations = ellipses(u, v)
    _is_rotation(axes, 1e-10)  # the normal of spans at angle a is known to 1e-16 / sin(a), a > 1e-3 here
    for turn, sizes, one, other in zip(axes.numpy(), deviations.numpy(), u.numpy(), v.numpy(), strict=True):
        values, vectors = np.linalg.eigh(np.outer(one, one) + np.outer(other, other))
        assert sizes[0] >= sizes[1]
        # Eigenvalues to eps times the largest, from both sides.
        assert np.square(sizes) == pytest.approx(values[:0:-1], abs=1e-14 * values[2])
        # A vector turns by eps times the largest over its gap to the next eigenvalue.
        gaps = values[2] - values[1], min(values[2] - values[1], values[1] - values[0]), values[1] - values[0]
        for column, gap in enumerate(gaps):
            aligned = abs(turn[:, column] @ vectors[:, 2 - column])
            assert aligned == pytest.approx(1, abs=max(1e-12, (1e-14 * values[2] / gap) ** 2))


def test_the_normal_is_on_the_side_of_the_cross_product():
    u, v = _pairs()
    axes, _ = ellipses(u, v)
    assert ((torch.linalg.cross(u, v) * axes[..., 2]).sum(-1) > 0).all()


def test_float32_has_the_covariance_of_its_spans():
    """Sums of a few products of float32: 1e-6 of the largest."""
    u, v = _pairs(dtype=torch.float32)
    axes, deviations = ellipses(u, v)
    assert axes.dtype == deviations.dtype == torch.float32
    expected = _outer(u.double(), v.double())
    largest = expected.diagonal(dim1=-2, dim2=-1).sum(-1)[:, None, None]
    assert ((_covariance(axes.double(), deviations.double()) - expected).abs() / largest).max() < 2e-6


@pytest.mark.parametrize("size", [1e-9, 1e-4, 1e6])
def test_the_unit_of_length_does_not_matter(size):
    """Elements of fine photos of near things are small. float32 knows eigenvalues to 1e-7 of the largest, so
    the shorter axis to 3e-4 of the longer one."""
    u, v = _pairs(dtype=torch.float32)
    _, deviations = ellipses(u, v)
    axes, scaled = ellipses(u * size, v * size)
    off = (scaled / size - deviations).abs() / deviations[:, :1]
    assert off[:, 0].max() < 1e-6 and off[:, 1].max() < 1e-3
    _is_rotation(axes, 1e-4)  # 1e-7 over the sine of the narrowest pair, of 200 about 1/200


X, Y, SLANTED = (1.0, 0.0, 0.0), (0.0, 2.0, 0.0), (0.3, -0.2, 0.9)
ZERO = (0.0, 0.0, 0.0)


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
@pytest.mark.parametrize(
    ("one", "other"),
    [
        *((v, tuple(ratio * x for x in v)) for v, ratio in itertools.product((X, Y, SLANTED), (1.0, -3.0))),
        *((v, ZERO) for v in (X, Y, SLANTED)),
        *((ZERO, v) for v in (X, Y, SLANTED)),
        (ZERO, ZERO),
        (X, (1.0, 1e-6, 0.0)),  # parallel to float32, not to float64
    ],
)
def test_spans_that_make_no_plane_make_a_line_or_a_point(one, other, dtype):
    """A rotation all the same, and the right covariance; what is across is known to the root of eps."""
    u, v = torch.tensor(one, dtype=dtype), torch.tensor(other, dtype=dtype)
    axes, deviations = ellipses(u, v)
    within = 4 * torch.finfo(dtype).eps ** 0.5
    _is_rotation(axes, within)
    torch.testing.assert_close(_covariance(axes, deviations), _outer(u, v), rtol=0, atol=within)
    assert deviations[1] < max(within, 1e-6) * max(1.0, float(deviations[0]))
    torch.testing.assert_close(quats_to_matrices(matrices_to_quats(axes)), axes, rtol=0, atol=within)


def test_equal_spans_across_each_other_make_a_circle():
    """Both eigenvalues are equal, so any axes within the plane will do."""
    axes, deviations = ellipses(torch.tensor([0.0, 0.0, 3.0]), torch.tensor([0.0, 3.0, 0.0]))
    assert deviations.tolist() == [3.0, 3.0]
    _is_rotation(axes, 1e-6)
    assert abs(float(axes[0, 2])) == 1


def test_gradients_of_ellipses():
    u, v = (w.requires_grad_() for w in _pairs(5))

    def covariances(one, other):
        return _covariance(*ellipses(one, other))

    # gradcheck's own tolerances: float64 central differences of step 1e-6.
    assert torch.autograd.gradcheck(covariances, (u, v))


def test_gradients_stay_finite_where_spans_make_no_plane():
    """Backwards through a point, a line and a pair of parallels."""
    u = torch.tensor([ZERO, X, X, ZERO], dtype=torch.float64, requires_grad=True)
    v = torch.tensor([Y, ZERO, X, ZERO], dtype=torch.float64, requires_grad=True)
    axes, _ = ellipses(u, v)
    axes.sum().backward()
    for spanning in (u, v):
        assert spanning.grad is not None and torch.isfinite(spanning.grad).all()


def test_no_ellipses():
    axes, deviations = ellipses(torch.zeros(0, 3), torch.zeros(0, 3))
    assert axes.shape == (0, 3, 3) and deviations.shape == (0, 2)


def _surface(depths: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    return unproject(depths, K), depths / K[0, 0]


def _plane(tilt: float, width: int = 32, height: int = 24) -> torch.Tensor:
    """Depths of the plane z = 2 + tilt x."""
    return 2 / (1 - tilt * rays(K, width, height)[..., 0])


def _twin(pos: np.ndarray, footprint: np.ndarray, row: int, column: int, step: tuple[int, int]) -> np.ndarray:
    """One span, the shorter of those that there are."""
    height, width = footprint.shape
    found = []
    for sign in (1, -1):
        r, c = row + sign * step[0], column + sign * step[1]
        if 0 <= r < height and 0 <= c < width:
            found.append(sign * (pos[r, c] - pos[row, column]))
    if not found:
        return np.zeros(3)
    span = min(found, key=np.linalg.norm)
    return span * min(1.0, SURFELS.stretch * footprint[row, column] / np.linalg.norm(span))


@pytest.mark.parametrize("size", [(24, 32), (1, 7), (7, 1), (2, 2), (1, 1)])
def test_spans_are_those_of_a_loop(size):
    depths = 1 + torch.rand(2, *size, generator=torch.Generator().manual_seed(0), dtype=torch.float64)
    pos, footprint = _surface(depths)
    found = spans(pos, footprint)
    assert all(span.shape == (2, *size, 3) for span in found)
    for view, row, column in np.ndindex(2, *size):
        for span, step in zip(found, ((0, 1), (1, 0)), strict=True):
            expected = _twin(pos[view].numpy(), footprint[view].numpy(), row, column, step)
            assert span[view, row, column].numpy() == pytest.approx(expected, abs=EXACT)


def test_points_that_coincide_have_no_span():
    same = torch.ones(3, 4, 3)
    for span in spans(same, torch.ones(3, 4)):
        assert (span == 0).all()


def test_an_infinite_point_leaves_its_neighbours_finite():
    """Off the axis, where no coordinate is 0 times infinity."""
    depths = _plane(0.0)
    depths[5, 7] = torch.inf
    pos, footprint = _surface(depths)
    around = torch.ones(24, 32, dtype=torch.bool)
    around[5, 7] = False
    for span in spans(pos, footprint):
        assert torch.isfinite(span[around]).all()
