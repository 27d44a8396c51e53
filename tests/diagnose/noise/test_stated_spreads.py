"""A spread that few power-ons tell: by their rows and by the spec's budget, each for what it is worth."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import polygamma

from planner.diagnose.noise.channel_noise import ChannelNoise, without_zeros
from planner.diagnose.noise.spread_law import SpreadLaw
from planner.diagnose.noise.stated_spreads import WITHIN, by_both, with_stated
from planner.diagnose.noise.whitened import log_p
from planner.solvers.random_effects import RandomEffects, covariance
from planner.solvers.reml import reml_and_information
from planner.solvers.restricted_likelihood import Sample
from tests.specs import shipped

BUDGETS = shipped("small_uav").spec.unit.gyro
STATED = 2e-5  # of a gyro's scale factor there, from power-on to power-on
ROWS, WHITE = 6, 1e-5
SCALE = "run_to_run_scale_factor"


def _noise(spread: float, runs: int, rng: np.random.Generator) -> ChannelNoise:
    """Power-ons of six rates up to 4 rad/s, each with a scale factor of its own, as REML tells it."""
    n, starts = ROWS * runs, ROWS * np.arange(runs)
    u = np.tile(np.linspace(-4.0, 4.0, ROWS), runs)
    y = np.repeat(spread * rng.normal(size=runs), ROWS) * u + WHITE * rng.normal(size=n)
    effects = RandomEffects(starts, np.ones((1, n)), u[None, :])
    sample = Sample(y, u[:, None] / np.linalg.norm(u), effects, True)
    found, _ = reml_and_information([sample], None, 1e-4)
    (v,) = without_zeros([found])
    fixed = np.empty((n, 0))
    return ChannelNoise(covariance(effects, v.theta), v, ("white", SCALE), fixed, starts, sample)


def _spread(noise: ChannelNoise) -> float:
    return float(np.sqrt(noise.variances.theta[1]))


def test_a_budget_that_is_right_makes_a_spread_of_four_power_ons_better_known() -> None:
    """By rows alone it is off by half of itself and more in a sixth of all; by both in a twenty-fourth."""
    rng = np.random.default_rng(5)
    rows = [_noise(STATED, 4, rng) for _ in range(120)]
    alone = np.array([abs(np.log(_spread(n) / STATED)) for n in rows])
    both = np.array([abs(np.log(_spread(with_stated(n, BUDGETS)) / STATED)) for n in rows])
    assert np.mean(alone > np.log(2.0)) > 3.0 * np.mean(both > np.log(2.0))
    assert both.max() < alone.max()


@pytest.mark.parametrize("seed", range(1, 5))
def test_what_whitens_has_the_spread_that_is_said(seed: int) -> None:
    noise = _noise(STATED, 5, np.random.default_rng(seed))
    both = with_stated(noise, BUDGETS)
    again = covariance(noise.sample.effects, both.variances.theta)
    assert np.allclose(both.whiten(np.eye(30)), again.whiten(np.eye(30)))
    assert both.variances.theta[0] == noise.variances.theta[0]
    assert both.by_rows is noise  # what a spread is held against its budget by


@pytest.mark.parametrize("times", [0.1, 1.0, 10.0])
def test_many_power_ons_say_what_their_spread_is_whatever_the_budget(times: float) -> None:
    """A budget ten times too large or too small moves it by less than its standard error."""
    noise = _noise(times * STATED, 120, np.random.default_rng(2))
    moved = with_stated(noise, BUDGETS).variances.theta[1] - noise.variances.theta[1]
    assert abs(moved) < np.sqrt(noise.variances.error[1, 1])


def test_a_unit_far_out_of_its_budget_is_not_taken_for_one_within() -> None:
    """Ten times its budget by a dozen power-ons: it stays nearly that."""
    noise = _noise(10.0 * STATED, 12, np.random.default_rng(3))
    assert _spread(with_stated(noise, BUDGETS)) > 0.8 * _spread(noise)


def test_where_rows_say_nothing_a_budget_is_all_there_is_and_where_they_say_all_it_is_nothing() -> None:
    """Right within a factor of two of its sigma, a budget is worth 1.8 degrees of freedom."""
    theta, sigma = by_both(SpreadLaw(1.0, 1e-9, 0.0), 1.0)
    assert theta == pytest.approx(1.0, rel=0.01)
    assert polygamma(1, (theta / sigma) ** 2) == pytest.approx(WITHIN**2, rel=0.01)
    theta, sigma = by_both(SpreadLaw(1.0, 150.0, 0.0), 4.0)
    assert theta == pytest.approx(1.0, rel=0.05)
    assert sigma == pytest.approx(np.sqrt(2.0 / 150.0), rel=0.1)


@pytest.mark.parametrize("freedom", [1.5, 3.0, 6.0, 12.0])
def test_a_budget_that_agrees_makes_a_spread_better_known(freedom: float) -> None:
    """By the mean and the variance of θ three degrees with a budget were one: a tail made both."""
    theta, sigma = by_both(SpreadLaw(1.0, freedom, 0.0), 1.0)
    assert 2.0 * (theta / sigma) ** 2 > freedom


@pytest.mark.parametrize("freedom", [1.0, 2.0, 4.0])
def test_a_coefficient_of_nothing_is_no_surer_than_its_chance(freedom: float) -> None:
    """Spreads as budgets say, within a factor of two: what is as sure as one in a hundred is hardly rarer.

    It was none of four thousand, and names of fifteen sigma were no surer than chance.
    """
    rng = np.random.default_rng(int(10 * freedom))
    times, p = 4000, []
    for true in np.exp(WITHIN * rng.normal(size=times)):
        told = true * rng.chisquare(freedom) / freedom
        theta, sigma = by_both(SpreadLaw(told, freedom, 0.0), 1.0)
        p.append(log_p(true * rng.chisquare(1.0), 1, 2.0 * (theta / sigma) ** 2, 1.0 * theta))
    sure = np.mean(np.array(p) < np.log(0.01))
    assert 0.001 < sure < 0.012


def test_without_a_budget_it_is_as_the_rows_say() -> None:
    noise = _noise(STATED, 5, np.random.default_rng(4))
    assert with_stated(noise, {}) is noise
