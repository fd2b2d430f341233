"""What registration is made of: what a photo tells of a shift, depth from a match, the smooth correction."""

import math

import numpy as np
import pytest
import torch
from scipy.optimize import least_squares
from torch import Tensor

from langflash_core.depth.registration import _Known, _Matches, _triangulate_matches, smooth
from langflash_core.rig.settings import REGISTRATION
from tests.depth.test_registration import poses


def stripes(angle: float) -> np.ndarray:
    """(60, 60) uint8 grey that changes along that direction only, angle from the rows."""
    y, x = np.mgrid[:60, :60]
    along = math.cos(angle) * x + math.sin(angle) * y
    return (128 + 100 * np.sin(along / 3)).round().astype(np.uint8)


def along(known: _Known, angle: float) -> np.ndarray:
    """What is known of a shift of one pixel that way."""
    return known.square(math.cos(angle), math.sin(angle))


@pytest.mark.parametrize("angle", [0.0, 0.5, math.pi / 2, 2.5])
def test_along_a_line_nothing_is_known_and_across_it_all(angle):
    """Squared gradients of at least 300 a pixel: across, 1 less 2 / 300. Along, those of rounded grey values,
    under a hundredth; at 45 degrees the half of a shift that goes across."""
    known = _Known.of(stripes(angle))
    inner = (slice(8, -8), slice(8, -8))
    assert along(known, angle)[inner].min() > 0.99
    assert along(known, angle + math.pi / 2)[inner].max() < 0.01 / REGISTRATION.texture
    half = along(known, angle + math.pi / 4)[inner]
    assert half.min() > 0.49 and half.max() < 0.51


def test_what_is_blank_says_nothing_and_what_changes_both_ways_all():
    """Least on a crest of a wave, where 7 pixels hold a third of its mean squared gradient and less."""
    blank = _Known.of(np.full((40, 40), 77, np.uint8))
    both = _Known.of((stripes(0.0) // 2 + stripes(math.pi / 2) // 2).astype(np.uint8))
    for angle in np.linspace(0, math.pi, 7):
        assert along(blank, angle).max() < 1e-6
        assert along(both, angle)[8:-8, 8:-8].min() > 3 / 4


def test_what_is_known_is_a_function_of_the_tensor():
    """Of its eigenvalues, by numpy in float64. float32 knows them to 1e-7 of the larger one, up to 2e3, and
    the function is no steeper than 1 / TEXTURE."""
    rng = np.random.default_rng(0)
    gradients = 50 * rng.normal(size=(5, 7, 6, 2)) * rng.uniform(0.01, 1, (5, 7, 1, 2)) ** 2
    tensors = (gradients[..., :, None] * gradients[..., None, :]).mean(-3)
    energies, axes = np.linalg.eigh(tensors)
    energies = np.maximum(energies - REGISTRATION.flat, 0)
    sure = energies / (energies + REGISTRATION.texture)
    expected = np.einsum("hwik,hwk,hwjk->hwij", axes, sure, axes)
    known = _Known.of_tensor(*(tensors[..., i, j].astype(np.float32) for i, j in ((0, 0), (0, 1), (1, 1))))
    for own, (i, j) in ((known.xx, (0, 0)), (known.xy, (0, 1)), (known.yy, (1, 1))):
        np.testing.assert_allclose(own, expected[..., i, j], rtol=0, atol=1e-3)
    np.testing.assert_allclose(known.most, sure[..., 1], rtol=0, atol=1e-3)


@pytest.mark.parametrize("size", [(9, 11), (1, 6), (6, 1), (1, 1)])
def test_smooth_is_the_dense_solution(size):
    """In float64. CG stops at a residual of 1e-3 of the right side, and eigenvalues are at least 1 / s^2."""
    g = torch.Generator().manual_seed(0)
    height, width = size
    logs = 0.03 * torch.randn(size, generator=g)
    logs[:, width // 2 :] += 0.5
    weight = 300 * torch.rand(size, generator=g) ** 4
    target = weight * 0.05 * torch.randn(size, generator=g)
    guide = (100 + 4 * torch.randn(size, generator=g)).numpy()
    shown = guide.astype(np.float64).ravel()
    flat, own = logs.double().flatten().numpy(), 1 / (REGISTRATION.alike * REGISTRATION.expected**2)
    dense = np.diag(weight.double().flatten().numpy() + own)
    for r, c in np.ndindex(height, width):
        for beside in ((r + 1, c), (r, c + 1)):
            if beside[0] < height and beside[1] < width:
                i, j = r * width + c, beside[0] * width + beside[1]
                tie = REGISTRATION.stiff * math.exp(-(((flat[i] - flat[j]) / REGISTRATION.jump) ** 2))
                same = math.exp(-(((shown[i] - shown[j]) / REGISTRATION.edge) ** 2))
                tie *= REGISTRATION.across + (1 - REGISTRATION.across) * same
                dense[[i, j], [i, j]] += tie
                dense[[i, j], [j, i]] -= tie
    right = target.double().flatten().numpy()
    off = np.linalg.norm(
        smooth(target, weight, logs, guide).flatten().numpy() - np.linalg.solve(dense, right)
    )
    assert off <= 1e-3 * np.linalg.norm(right) / own + 1e-7


def test_smooth_of_nothing_is_nothing():
    nothing = torch.zeros(5, 7)
    assert torch.equal(smooth(nothing, nothing, torch.rand(5, 7), np.zeros((5, 7), np.float32)), nothing)


def test_smooth_does_not_cross_a_jump():
    """exp(-(0.4 / 0.03)^2) is 1e-77: the far side has no right side and no tie."""
    logs = torch.zeros(8, 10)
    logs[:, 5:] = 0.4
    weight = torch.zeros(8, 10)
    weight[:, :3] = 100
    found = smooth(0.05 * weight, weight, logs, np.full((8, 10), 77, np.float32))
    assert found[:, 5:].abs().max() < 1e-12
    assert found[:, 4].min() > 0.01, "what is not seen moves along"


def test_smooth_is_cut_at_an_edge_of_the_photo():
    """Three cells of weight 100 on both sides, of which one is off by .05, hold ends of 300; between them
    lie four ties of STIFF, and one of STIFF, or of ACROSS of it at an edge of 12 EDGE. So in a row, as in
    conductors, .002 fall off at that one, or .034."""
    weight, off, falls = torch.zeros(8, 10), torch.zeros(8, 10), []
    weight[:, :3] = weight[:, 7:] = 100
    off[:, :3] = 0.05
    for far, share in ((60, 1.0), (120, REGISTRATION.across)):
        guide = np.full((8, 10), 60, np.float32)
        guide[:, 5:] = far
        found = smooth(off * weight, weight, torch.zeros(8, 10), guide)
        falls.append(found[:, 4] - found[:, 5])
        tie = share * REGISTRATION.stiff
        expected = 0.05 / (2 / 300 + 4 / REGISTRATION.stiff + 1 / tie) / tie
        assert falls[-1].numpy() == pytest.approx(expected, rel=0.1)  # a row's ends are no single cells
    assert falls[0].max() < 0.003 and falls[1].min() > 0.03


def _geometry(noise: float) -> tuple[Tensor, Tensor, _Matches, Tensor]:
    """Log depths (6, 7), true ones, where these are in the neighbour but for noise (pixels), and its pose."""
    g = torch.Generator().manual_seed(0)
    logs = 0.7 + 0.1 * torch.randn(6, 7, generator=g, dtype=torch.float64)
    true = logs + 0.5 * torch.rand(6, 7, generator=g, dtype=torch.float64) - 0.25
    pose = torch.from_numpy(poses([(0.3, -0.1, 0.2)])[0])
    found = _projected(true, pose) + noise * torch.randn(2, 6, 7, generator=g, dtype=torch.float64)
    return logs, true, _at(found), pose


def _at(places: Tensor) -> _Matches:
    """Matches, all sure, at places (2, 6, 7), pixels."""
    x, y = places.float().numpy()
    return _Matches(x, y, np.ones((6, 7), np.float32))


ALL = _Known(*(np.full((6, 7), value, np.float32) for value in (1, 0, 1, 1)))  # is known of any shift
SMALL_K = torch.tensor([[8.0, 0, 3.5], [0, 8.0, 3.0], [0, 0, 1]])


def _rays() -> Tensor:
    ys, xs = torch.meshgrid(torch.arange(6) + 0.5, torch.arange(7) + 0.5, indexing="ij")
    K = SMALL_K.double()
    return torch.stack(((xs - K[0, 2]) / K[0, 0], (ys - K[1, 2]) / K[1, 1], torch.ones_like(xs)), -1).double()


def _projected(logs: Tensor, pose: Tensor) -> Tensor:
    """(2, 6, 7) pixels of the neighbour."""
    pos = (_rays() * logs.exp()[..., None]) @ pose[:3, :3].T + pose[:3, 3]
    K = SMALL_K.double()
    return torch.stack([pos[..., i] / pos[..., 2] * K[i, i] + K[i, 2] for i in (0, 1)])


@pytest.mark.parametrize("noise", [0.0, 0.05])
def test_triangulated_is_the_least_squares_of_each_pixel(noise):
    """scipy's in float64. float32: 1e-7 of rays of about 1 over parallaxes of about 1/30 at noise, 1e-5."""
    logs, true, matches, pose = _geometry(noise)
    change, _ = _triangulate_matches(logs.float(), matches, SMALL_K, SMALL_K, pose.float(), ALL)
    turned, shift, K = (_rays() @ pose[:3, :3].T).numpy(), pose[:3, 3].numpy(), SMALL_K.double().numpy()
    for r, c in np.ndindex(6, 7):
        q = [(float(m[r, c]) - K[i, 2]) / K[i, i] for i, m in enumerate((matches.x, matches.y))]

        def wrong(inverse, a=turned[r, c], q=q):
            return [q[i] * a[2] - a[i] - inverse[0] * (shift[i] - q[i] * shift[2]) for i in (0, 1)]

        best = least_squares(wrong, [0.5], xtol=1e-12, ftol=1e-12, gtol=1e-12).x[0]
        limit = REGISTRATION.farthest
        expected = (
            np.clip(-math.log(max(best, 1e-6)) - float(logs[r, c]), -limit, limit) if best > 1e-6 else 0
        )
        assert float(change[r, c]) == pytest.approx(expected, abs=1e-4)
    if noise == 0:
        assert (change.double() - (true - logs)).abs().max() < 1e-4


@pytest.mark.parametrize("turn", [0.0, 0.5, math.pi / 2])
def test_of_a_line_the_shift_across_it_tells_depth(turn):
    """Matches that slid along lines, of the view's picture, by pixels; the neighbour is turned in its plane.
    What slides says nothing: as with the matches before, to float32 (as above)."""
    logs, true, _, pose = _geometry(0.0)
    spin = torch.eye(4, dtype=torch.float64)
    spin[:2, :2] = torch.tensor([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
    pose = spin @ pose
    line = 0.3  # radians from the rows, in the view's picture
    slide = spin[:2, :2] @ torch.tensor([math.cos(line), math.sin(line)], dtype=torch.float64)
    by = torch.randn(6, 7, generator=torch.Generator().manual_seed(1), dtype=torch.float64)
    places = _projected(true, pose)
    across = (math.sin(line) ** 2, -math.sin(line) * math.cos(line), math.cos(line) ** 2, 1.0)
    known = _Known(*(np.full((6, 7), value, np.float32) for value in across))
    slid = _at(places + 0.2 * by * slide[:, None, None])
    change, _ = _triangulate_matches(logs.float(), slid, SMALL_K, SMALL_K, pose.float(), known)
    assert (change.double() - (true - logs)).abs().max() < 1e-3
    fooled, _ = _triangulate_matches(logs.float(), slid, SMALL_K, SMALL_K, pose.float(), ALL)
    assert (fooled.double() - (true - logs)).abs().max() > 0.05


def test_moves_are_the_differences_of_the_projection():
    """Central differences of 1e-5, float64: 1e-10. float32 knows a match, here of 10 pixels, to 1e-6."""
    logs, _, _, pose = _geometry(0.0)
    at = _at(_projected(logs, pose))
    _, found = _triangulate_matches(logs.float(), at, SMALL_K, SMALL_K, pose.float(), ALL)
    expected = (_projected(logs - 1e-5, pose) - _projected(logs + 1e-5, pose)) / 2e-5
    torch.testing.assert_close(found.double(), (expected**2).sum(0), rtol=2e-3, atol=1e-5)


def test_matches_that_no_depth_explains_say_nothing():
    """Behind the camera, without a baseline, and where the match is no number: 0 twice, and finite."""
    logs, _, matches, pose = _geometry(0.0)
    still = pose.clone()
    still[:3, 3] = 0
    behind, broken = _at(_projected(logs, pose)), _at(torch.full((2, 6, 7), torch.nan))
    reversed_pose = pose.clone()
    reversed_pose[:3, 3] *= -1
    for case, camera in ((matches, still), (broken, pose), (behind, reversed_pose)):
        change, moved = _triangulate_matches(logs.float(), case, SMALL_K, SMALL_K, camera.float(), ALL)
        assert (change == 0).all() and (moved == 0).all()
    for far in (_projected(torch.full_like(logs, 20.0), pose), torch.full((2, 6, 7), torch.inf)):
        found = _triangulate_matches(logs.float(), _at(far), SMALL_K, SMALL_K, pose.float(), ALL)
        assert all(values.isfinite().all() for values in found)
