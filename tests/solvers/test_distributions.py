"""Quantiles and tails against scipy.stats, which takes half a second to import."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from planner.solvers.distributions import (
    binomial_interval,
    chi_square_quantile,
    chi_square_tail,
    normal_quantile,
    student_quantile,
    student_tail,
)

P = np.array([1e-9, 0.025, 0.3, 0.5, 0.84134, 0.975, 1.0 - 1e-7])
FREEDOM = np.array([0.4, 1.0, 2.0, 7.5, 60.0, 4e5])


def test_they_are_those_of_scipy_stats():
    p, nu = P[:, None], FREEDOM[None, :]
    assert normal_quantile(P) == pytest.approx(stats.norm.ppf(P), rel=1e-12)
    assert student_quantile(p, nu) == pytest.approx(stats.t.ppf(p, nu), rel=1e-8, abs=1e-12)
    assert chi_square_quantile(p, nu) == pytest.approx(stats.chi2.ppf(p, nu), rel=1e-9)
    assert student_tail(p * 10, nu) == pytest.approx(stats.t.sf(p * 10, nu), rel=1e-9)
    x = np.array([0.01, 1.0, 30.0, 500.0])[:, None]
    assert chi_square_tail(x, nu) == pytest.approx(stats.chi2.sf(x, nu), rel=1e-9, abs=1e-300)


def test_at_infinite_freedom_student_is_normal_and_without_any_there_is_none():
    assert student_quantile(0.975, np.inf) == pytest.approx(stats.norm.ppf(0.975), rel=1e-12)
    assert np.isnan(student_quantile(0.975, -1.0))
    assert np.isnan(chi_square_quantile(0.5, 0.0))


@pytest.mark.parametrize(("hits", "of"), [(0, 10), (10, 10), (3, 10), (9499, 10_000)])
def test_the_interval_of_a_share_is_the_exact_one(hits, of):
    exact = stats.binomtest(hits, of).proportion_ci(0.95, "exact")
    assert binomial_interval(hits, of, 0.025) == pytest.approx((exact.low, exact.high), rel=1e-9)
