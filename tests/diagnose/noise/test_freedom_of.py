"""How well the variance of contrasts over several channels is known."""

from __future__ import annotations

import numpy as np
import pytest

from planner.diagnose.noise.channel_noise import ChannelNoise
from planner.diagnose.noise.shares import freedom_of
from planner.nouns.array import Array
from planner.solvers.random_effects import RandomEffects, covariance
from planner.solvers.reml import reml_and_information
from planner.solvers.restricted_likelihood import Sample

RUNS, ROWS = 13, 40


def noise(seed: int) -> ChannelNoise:
    """Power-ons with a level that is large beside their records' noise."""
    rng, n = np.random.default_rng(seed), RUNS * ROWS
    effects = RandomEffects(ROWS * np.arange(RUNS), np.ones((1, n)), np.ones((1, n)))
    y = np.repeat(3.0 * rng.normal(size=RUNS), ROWS) + rng.normal(size=n)
    sample = one_mean(y, effects)
    found, _ = reml_and_information([sample])
    v = covariance(effects, found.theta)
    return ChannelNoise(v, found, ("white", "run_to_run_bias"), np.empty((n, 0)), effects.starts, sample)


def one_mean(y: Array, effects: RandomEffects) -> Sample:
    return Sample(y, np.full((len(y), 1), 1.0 / np.sqrt(len(y))), effects, True)


def contrast(of: ChannelNoise, rows: Array) -> Array:
    """Of unit length, whitened."""
    c = of.whiten(rows[:, None])
    return np.asarray(c / np.linalg.norm(c))


def test_what_differs_between_power_ons_is_known_by_their_number() -> None:
    one = noise(1)
    late = np.arange(RUNS * ROWS) >= 6 * ROWS
    between = contrast(one, late - late.mean())
    within = contrast(one, np.tile(np.linspace(-1.0, 1.0, ROWS), RUNS))
    assert freedom_of([(one, between)]) == pytest.approx(RUNS - 1.0, rel=0.05)
    assert freedom_of([(one, within)]) == pytest.approx(RUNS * (ROWS - 1.0), rel=0.05)


def test_a_variance_in_common_is_known_no_better_for_three_channels() -> None:
    """Of their own each adds its degrees of freedom."""
    one = noise(1)
    late = np.arange(RUNS * ROWS) >= 6 * ROWS
    C = contrast(one, late - late.mean()) / np.sqrt(3.0)
    alone = freedom_of([(one, C * np.sqrt(3.0))])
    assert freedom_of([(one, C)] * 3) == pytest.approx(alone, rel=1e-4)
    others = [noise(seed) for seed in (2, 3, 4)]
    each = [(n, contrast(n, late - late.mean()) / np.sqrt(3.0)) for n in others]
    assert freedom_of(each) == pytest.approx(3.0 * (RUNS - 1.0), rel=0.05)
