"""How an estimated variance scatters: coverage where theory is exact, and level of what refuses one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.noise.channel_noise import ChannelNoise
from planner.diagnose.noise.spread_law import SpreadLaw, errors, refused, spread_law
from planner.nouns.array import Array
from planner.solvers.random_effects import RandomEffects, covariance
from planner.solvers.reml import reml_and_information
from planner.solvers.restricted_likelihood import Sample


def estimates(theta: float, runs: int, rows: int, rng: np.random.Generator, count: int) -> Array:
    """(count,) of a variance between groups beside a white one of 1, by analysis of variance."""
    level = np.sqrt(theta) * rng.normal(size=(count, runs, 1))
    y = level + rng.normal(size=(count, runs, rows))
    between = rows * np.var(y.mean(axis=2), axis=1, ddof=1)
    within = np.mean(np.var(y, axis=2, ddof=1), axis=1)
    return np.asarray((between - within) / rows)


def error_of(theta: float, runs: int, rows: int) -> float:
    """Of such an estimate: √(2 (θ + 1/m)² / (g − 1)), and what the white variance adds."""
    white = 2.0 / (runs * (rows - 1.0)) / rows**2
    return float(np.sqrt(2.0 * (theta + 1.0 / rows) ** 2 / (runs - 1.0) + white))


@pytest.mark.parametrize("theta", [0.0, 0.02, 0.1, 1.0])
def test_its_interval_holds_the_variance_as_often_as_it_says(theta: float) -> None:
    """Twelve power-ons of ten records, with variances of nothing up to ten times their noise."""
    found = estimates(theta, 12, 10, np.random.default_rng(11), 4000)
    low = high = 0
    for one in found[found > 0.0]:
        law = spread_law(float(one), error_of(one, 12, 10), error_of(0.5 * one, 12, 10))
        low += law.end(0.025) > theta
        high += law.end(0.975) < theta
    assert low / len(found) == pytest.approx(0.025, abs=0.01)
    assert high / len(found) < 0.035  # of one that is cut at zero none is too small


def test_without_a_shift_it_is_satterthwaite_s() -> None:
    law = spread_law(2.0, 0.5, 0.25)
    assert law.shift == pytest.approx(0.0, abs=1e-12)
    assert law.freedom == pytest.approx(2.0 * 2.0**2 / 0.5**2)
    flat = spread_law(2.0, 0.5, 0.5)  # an error that does not grow is one of a normal law
    assert flat.end(0.025) == pytest.approx(2.0 - 1.96 * 0.5, rel=0.01)
    assert flat.tail(2.0) == pytest.approx(0.5, abs=0.01)
    assert SpreadLaw(1.0, 10.0, 5.0).end(0.025) == 0.0


def noise(theta: float, rng: np.random.Generator) -> ChannelNoise:
    """Twelve power-ons of six records with a level, as REML tells it."""
    starts, n = 6 * np.arange(12), 72
    effects = RandomEffects(starts, np.ones((1, n)), np.ones((1, n)))
    y = np.repeat(np.sqrt(theta) * rng.normal(size=12), 6) + rng.normal(size=n)
    sample = Sample(y, np.full((n, 1), 1.0 / np.sqrt(n)), effects, True)
    found, _ = reml_and_information([sample])
    v = covariance(effects, found.theta)
    return ChannelNoise(v, found, ("white", "run_to_run_bias"), np.empty((n, 0)), starts, sample)


def test_a_variance_is_refused_as_rarely_as_it_says() -> None:
    rng = np.random.default_rng(5)
    every = [refused([noise(0.3, rng)], [1], 0.3) for _ in range(300)]
    assert np.mean(np.array(every) < 0.05) < 0.09  # small ones are refused as well: half a chi square each
    larger = [refused([noise(3.0, rng)], [1], 0.3) for _ in range(20)]
    assert np.mean(np.array(larger) < 0.01) > 0.8
    together = refused([noise(0.9, rng) for _ in range(6)], [1], 0.3)
    assert together < 0.05


def test_rows_that_leave_no_noise_refuse_nothing() -> None:
    one = noise(3.0, np.random.default_rng(3))
    full = replace(one, sample=Sample(one.sample.y, np.eye(72), one.sample.effects, True))
    assert refused([full], [1], 0.3) == 1.0


def test_errors_are_those_of_the_information() -> None:
    one = noise(1.0, np.random.default_rng(3))
    whole, half = errors(one, [1])
    level, white = one.variances.theta[1], one.variances.theta[0]
    for error, theta in ((whole, level), (half, level / 2.0)):
        told = 2.0 * (theta + white / 6.0) ** 2 / 11.0 + 2.0 * white**2 / 60.0 / 36.0
        assert error == pytest.approx(np.sqrt(told), rel=1e-3)
