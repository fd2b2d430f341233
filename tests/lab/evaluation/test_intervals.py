"""Bootstrap: intervals are as wide as theory says, the same every time, and honest about too little."""

import math

import numpy as np
import pytest

from langflash_core.lab.evaluation.intervals import bootstrap


def means(values) -> dict[str, float]:
    return {"mean": float(np.mean(values)), "largest": float(np.max(values))}


def test_the_interval_of_a_mean_is_that_of_the_normal_distribution():
    values = np.random.default_rng(3).normal(5, 2, 400).tolist()
    low, high = bootstrap(values, means, draws=2000)["mean"]
    error = float(np.std(values)) / math.sqrt(len(values))
    # 2,000 draws know the 2.5 % quantile to about .06 standard errors (1 sigma).
    assert low == pytest.approx(np.mean(values) - 1.96 * error, abs=0.2 * error)
    assert high == pytest.approx(np.mean(values) + 1.96 * error, abs=0.2 * error)


def test_most_intervals_hold_the_truth():
    held = 0
    for seed in range(100):
        values = np.random.default_rng(seed).exponential(1, 60).tolist()
        low, high = bootstrap(values, means, draws=300, seed=seed)["mean"]
        held += low <= 1 <= high
    assert held >= 85  # nominally 95; percentile intervals of skewed values are a little short


def test_one_scene_has_no_interval():
    assert all(math.isnan(side) for side in bootstrap([3.0], means)["mean"])
    assert bootstrap([], means) == {}


def test_what_is_rarely_measured_is_told_from_the_draws_that_have_it():
    def rare(values):
        known = [v for v in values if v > 0]
        return {"rare": float(np.mean(known)) if known else math.nan}

    low, high = bootstrap([0.0, 0.0, 3.0], rare)["rare"]
    assert low == high == 3
    with pytest.raises(ValueError, match="level"):
        bootstrap([1.0, 2.0], means, level=1.5)
