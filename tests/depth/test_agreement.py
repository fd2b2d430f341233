"""Maps of several photos that agree: against scipy, on planted differences, and on hard cases."""

import numpy as np
import pytest
import torch
from scipy.optimize import minimize

from langflash_core.depth import agreement
from langflash_core.depth.agreement import (
    blended,
    carried,
    knot_weights,
    straightened,
)
from langflash_core.geometry.cameras import rays, unproject
from langflash_core.rig.neighbours import everyone
from langflash_core.rig.rig import DepthMaps, Rig

HEIGHT, WIDTH = 48, 64
K = torch.tensor([[60.0, 0, 32], [0, 60.0, 24], [0, 0, 1]], dtype=torch.float64)
KS = K.expand(2, 3, 3)


def agreed(maps: DepthMaps, viewmats: torch.Tensor, Ks: torch.Tensor, *near) -> DepthMaps:
    found = agreement.agreed(Rig.of_logs(maps.log_depths, viewmats, Ks, maps.log_errors), *near)
    return DepthMaps(found.log_depths, found.log_errors)


def _wall(dtype: torch.dtype = torch.float64) -> tuple[torch.Tensor, torch.Tensor]:
    """Log depths (2, H, W) of a slanted wall n.x = 2 from two places, and their poses."""
    normal = torch.tensor([0.2, 0.1, 1.0], dtype=torch.float64)
    viewmats = torch.eye(4, dtype=torch.float64).repeat(2, 1, 1)
    viewmats[1, :3, 3] = torch.tensor([-0.3, 0.02, 0.05])
    directions = rays(K, WIDTH, HEIGHT)
    distances = 2.0 + (viewmats[:, :3, 3] @ normal)
    logs = (distances[:, None, None] / (directions @ normal)).log()
    return logs.to(dtype), viewmats.to(dtype)


def _gap(logs: torch.Tensor, viewmats: torch.Tensor) -> torch.Tensor:
    """How far view 0's points lie from view 1's surface, of log depth."""
    points = unproject(logs[0].exp(), K.to(logs)).flatten(0, 1).T
    there = carried(Rig.of_logs(logs, viewmats, KS.to(logs)), 0, 1, points)
    return (agreement.sampled(logs[1], there.places) - there.log_depths)[there.inside]


def test_maps_that_agree_stay():
    logs, viewmats = _wall()
    kept = agreed(DepthMaps(logs, torch.full_like(logs, -3.0)), viewmats, KS)
    # Bilinear log depth of a plane is off by its second difference, 2e-4 here, and at a picture's rim, which
    # goes on as its last pixel is, by up to half a pixel's slope times the other's share.
    assert (kept.log_depths - logs).abs().max() < 2e-3


def test_a_slow_difference_goes():
    logs, viewmats = _wall()
    x = torch.linspace(-1, 1, WIDTH, dtype=torch.float64)
    bent = torch.stack((logs[0] + 0.02 * x, logs[1] - 0.02 - 0.015 * x))
    before = _gap(bent, viewmats).abs().median()
    straight = straightened(Rig.of_logs(bent, viewmats, KS), everyone(2))
    assert _gap(straight, viewmats).abs().median() < 0.35 * before
    both = agreed(DepthMaps(bent, torch.full_like(logs, -3.0)), viewmats, KS)
    assert _gap(both.log_depths, viewmats).abs().median() < 0.05 * before


def test_the_surer_photo_counts_more():
    logs, viewmats = _wall()
    moved = torch.stack((logs[0], logs[1] + 0.03))
    errors = torch.stack((torch.full_like(logs[0], -4.0), torch.full_like(logs[1], -2.0)))
    mean = blended(Rig.of_logs(moved, viewmats, KS, errors), everyone(2))
    inside = (slice(8, -8), slice(24, -8))
    assert (mean[0] - logs[0])[inside].abs().max() < 0.002  # 1 / (1 + e^4) of .03
    assert (mean[1] - logs[1])[8:-8, 8:-24].abs().max() < 0.002


def test_what_hides_something_else_stays():
    """A thing that only one photo shows before the wall is no part of it."""
    logs, viewmats = _wall()
    thing = logs.clone()
    thing[0, 20:28, 30:40] -= 0.5
    kept = agreed(DepthMaps(thing, torch.full_like(logs, -3.0)), viewmats, KS).log_depths
    assert (kept[0, 20:28, 30:40] - thing[0, 20:28, 30:40]).abs().max() < 0.02


def test_hat_functions_are_linear_between_the_knots():
    torch.manual_seed(0)
    places = torch.rand(50, 2, dtype=torch.float64) * 2 - 1
    weights = knot_weights(places)
    knots = torch.linspace(-1, 1, 5, dtype=torch.float64)
    grid_y, grid_x = torch.meshgrid(knots, knots, indexing="ij")
    torch.testing.assert_close(weights.sum(1), torch.ones(50, dtype=torch.float64))
    torch.testing.assert_close(weights @ grid_x.flatten(), places[:, 0])
    torch.testing.assert_close(weights @ grid_y.flatten(), places[:, 1])


def test_the_least_squares_step_is_that_of_scipy():
    """One step from no correction, weights of the first residuals: a quadratic with one minimum."""
    logs, viewmats = _wall()
    bent = torch.stack((logs[0], logs[1] + 0.02))
    sparse = (slice(2, None, 4), slice(2, None, 4))
    rig = Rig.of_logs(bent, viewmats, KS)
    points = [unproject(own.exp(), K)[sparse].flatten(0, 1).T for own in bent]
    grid = torch.stack(torch.meshgrid(torch.arange(WIDTH), torch.arange(HEIGHT), indexing="xy"), -1) + 0.5
    places = (grid.double() / torch.tensor([WIDTH, HEIGHT]) * 2 - 1)[sparse].flatten(0, 1)
    own_hats = knot_weights(places)
    normal, right = agreement._comparisons(rig, points, own_hats, everyone(2))
    prior = agreement._expectation(bent.device)
    solved = torch.linalg.solve(normal + torch.block_diag(prior, prior), right).numpy()

    rows, gaps, weights = [], [], []
    for a, b in ((0, 1), (1, 0)):
        there = carried(rig, a, b, points[a])
        gap = (agreement.sampled(bent[b], there.places) - there.log_depths)[there.inside]
        pair = torch.zeros(len(gap), 2, 25, dtype=torch.float64)
        pair[:, a], pair[:, b] = own_hats[there.inside], -knot_weights(there.places[there.inside])
        rows.append(pair.flatten(1))
        gaps.append(gap)
        weights.append((1 + (gap / 0.04) ** 2) ** -2 / 0.04**2)
    design, gap, weight = (torch.cat(parts).numpy() for parts in (rows, gaps, weights))
    share = min(1.0, 400 / len(gap))
    inverse = torch.block_diag(prior, prior).numpy()

    def cost(c: np.ndarray) -> float:
        return 0.5 * share * (weight * (gap - design @ c) ** 2).sum() + 0.5 * c @ inverse @ c

    best = minimize(cost, np.zeros(50), method="BFGS", options={"gtol": 1e-9}).x
    assert solved == pytest.approx(best, abs=1e-5)  # BFGS with differences for a gradient


def test_maps_without_a_common_neighbour_stay_apart():
    logs, viewmats = _wall()
    three, places = logs[[0, 1, 1]] + 0.03 * torch.arange(3)[:, None, None], viewmats[[0, 1, 1]]
    errors, Ks = torch.full_like(three, -3.0), K.expand(3, 3, 3)
    kept = agreed(DepthMaps(three, errors), places, Ks, [[1], [0], []]).log_depths
    torch.testing.assert_close(kept[2], three[2])
    pair = agreed(DepthMaps(three[:2], errors[:2]), places[:2], Ks[:2]).log_depths
    # As many pixels are compared, but they count as 200 a view of three instead of two.
    assert (kept[:2] - pair).abs().max() < 2e-3


def test_hard_cases_stay_finite():
    """One photo, the same photo twice, nothing in common, sky, NaN-free everywhere."""
    logs, viewmats = _wall(torch.float32)
    errors = torch.full_like(logs, -2.0)
    one = agreed(DepthMaps(logs[:1], errors[:1]), viewmats[:1], KS[:1].float())
    assert torch.equal(one.log_depths, logs[:1])
    same = agreed(DepthMaps(logs[[0, 0]], errors), torch.eye(4).repeat(2, 1, 1), KS.float())
    assert (same.log_depths - logs[[0, 0]]).abs().max() < 1e-4
    behind = viewmats.clone()
    behind[1, :3, :3] = torch.diag(torch.tensor([-1.0, 1.0, -1.0]))
    apart = agreed(DepthMaps(logs, errors), behind, KS.float())
    torch.testing.assert_close(apart.log_depths, logs)
    sky = torch.where(torch.arange(WIDTH) > 30, 12.0, logs)
    assert torch.isfinite(agreed(DepthMaps(sky, errors), viewmats, KS.float()).log_depths).all()
