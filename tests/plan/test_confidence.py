"""Repeats from confidence intervals (K 2.5.2, eq. 27)."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from planner.plan.confidence import half_width, needed_repeats, quantile

KINDS = ("normal", "student")


def test_published_quantiles():
    n = np.array([2, 30])
    # K prints 2.96 for 99 %; the two-sided normal values are 2.576 and, for 95 %, 1.960
    assert quantile(0.99, "normal", n) == pytest.approx([2.5758293] * 2, abs=1e-6)
    assert quantile(0.95, "normal", n) == pytest.approx([1.9599640] * 2, abs=1e-6)
    # Student, standard tables: 12.706 at one degree of freedom, 2.045 at 29
    assert quantile(0.95, "student", n) == pytest.approx([12.7062, 2.04523], abs=1e-4)


def test_published_repeats():
    # K table 4.2 follows 1.96: sigma 0.002 deg/s, half-width 0.001 deg/s at 95 % -> 16 by the formula
    assert needed_repeats(0.95, "normal", 0.002, 0.001, 100) == 16
    assert needed_repeats(0.95, "student", 0.002, 0.001, 100) == 18  # 2.1098·0.002/√18 = 0.000995


def test_one_repeat_has_no_spread_of_its_own():
    assert half_width(0.95, "student", 1.0, [1])[0] == np.inf
    assert needed_repeats(0.95, "student", 1.0, 1e9, 10) == 2
    assert needed_repeats(0.95, "normal", 1.0, 2.0, 10) == 1


@settings(deadline=None, max_examples=80)
@given(st.floats(0.5, 0.999), st.sampled_from(KINDS), st.floats(1e-6, 10))
def test_more_repeats_never_widen_the_interval(confidence, kind, spread):
    widths = half_width(confidence, kind, spread, range(2, 200))
    assert np.all(np.diff(widths) < 0)


@settings(deadline=None, max_examples=80)
@given(st.floats(0.5, 0.999), st.sampled_from(KINDS), st.floats(1e-3, 10), st.floats(0.05, 5))
def test_the_fixed_point_is_the_smallest_number_that_suffices(confidence, kind, spread, share):
    allowed = spread * share
    n = needed_repeats(confidence, kind, spread, allowed, 3000)
    if n is None:
        assert half_width(confidence, kind, spread, [3000])[0] > allowed
        return
    assert half_width(confidence, kind, spread, [n])[0] <= allowed
    if n > 1:
        assert half_width(confidence, kind, spread, [n - 1])[0] > allowed


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("n", [3, 8])
def test_students_interval_covers_as_often_as_it_says(seed, n):
    rng = np.random.default_rng(seed)
    draws = rng.normal(size=(20_000, n))
    # planned with the true sigma, judged with the sample's: that is what Student's quantile is for
    reach = stats.t.ppf(0.975, n - 1) * draws.std(axis=1, ddof=1) / np.sqrt(n)
    covered = np.mean(np.abs(draws.mean(axis=1)) <= reach)
    assert covered == pytest.approx(0.95, abs=4 * np.sqrt(0.95 * 0.05 / 20_000))  # four standard errors


def test_confidence_widens_the_interval():
    assert half_width(0.99, "student", 1.0, [5])[0] > half_width(0.95, "student", 1.0, [5])[0]
