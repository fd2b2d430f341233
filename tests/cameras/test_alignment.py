"""Corrections of a depth map by sparse points, against scipy and on planted errors."""

import numpy as np
import pytest
from scipy.optimize import minimize

from langflash_core.cameras.alignment import _PRIOR_SIGMAS, NO_CORRECTION, fit_correction
from langflash_core.rig.settings import STRAIGHTENING


def _points(seed: int, n: int = 120, outliers: float = 0.0):
    """A map that is tilted, scaled and flattened; targets are exact but for outliers."""
    rng = np.random.default_rng(seed)
    x = rng.uniform(-0.5, 0.5, (n, 2))
    priors = np.log(rng.uniform(1, 5, n))
    targets = priors + 0.2 + 0.3 * x[:, 0] - 0.1 * x[:, 1] + 0.15 * (priors - priors.mean())
    wrong = rng.random(n) < outliers
    targets[wrong] += rng.normal(0, 1.5, wrong.sum())
    return x, priors, targets, np.full(n, 0.02)


@pytest.mark.parametrize("outliers", [0.0, 0.25])
def test_a_smooth_error_is_taken_out(outliers):
    x, priors, targets, sigmas = _points(0, outliers=outliers)
    clean = _points(0)[2]
    left = priors + fit_correction(x, priors, targets, sigmas).at(x, priors) - clean
    # 120 points count as 50: against slopes expected at 0.05 the fit goes the share that 50 var(x) / 0.08^2
    # has of itself and 1 / 0.05^2, 62 %. Outliers lose their pull beyond 2 sigma; they are a quarter.
    planted = clean - priors
    kept = np.abs(left - left.mean()).max() / np.abs(planted - planted.mean()).max()
    assert kept < (0.45 if outliers == 0 else 0.55)
    assert abs(left.mean()) < (0.01 if outliers == 0 else 0.03)  # the scale is free


def test_the_optimum_is_that_of_scipy():
    x, priors, targets, sigmas = _points(1, outliers=0.2)
    design = np.column_stack((np.ones(len(x)), x, priors - priors.mean()))
    total = np.hypot(sigmas, STRAIGHTENING.prior_error)

    def cost(b):
        residuals = (targets - priors - design @ b) / total
        share = STRAIGHTENING.independent / len(x)
        return share * 2 * np.log1p((residuals / 2) ** 2).sum() + 0.5 * ((b / _PRIOR_SIGMAS) ** 2).sum()

    own = fit_correction(x, priors, targets, sigmas).coefficients
    twin = minimize(cost, np.zeros(4), method="BFGS", options={"gtol": 1e-10}).x
    assert own == pytest.approx(twin, abs=1e-3)  # fifteen reweightings converge linearly


def test_nothing_known_changes_nothing():
    assert fit_correction(np.zeros((0, 2)), np.zeros(0), np.zeros(0), np.zeros(0)) is NO_CORRECTION
    assert NO_CORRECTION.at(np.ones((3, 4, 2)), np.ones((3, 4))).max() == 0


def test_few_points_hardly_tilt_the_map():
    """Points in one corner say little about the other: the prior keeps the correction bounded."""
    x = np.full((12, 2), 0.45) + np.random.default_rng(0).normal(0, 0.005, (12, 2))
    correction = fit_correction(x, np.full(12, 1.0), np.full(12, 1.3), np.full(12, 0.05))
    here, there = correction.at(np.array([[0.45, 0.45], [-0.45, -0.45]]), np.array([1.0, 1.0]))
    assert here == pytest.approx(0.3, abs=0.02)
    assert 0 < there < 0.3


def test_a_correction_never_exceeds_a_factor_of_e():
    correction = fit_correction(np.zeros((50, 2)), np.zeros(50), np.full(50, 9.0), np.full(50, 0.01))
    assert correction.at(np.zeros((1, 2)), np.zeros(1))[0] <= 1.0
