"""Every coefficient within its interval as often as the interval says, on units whose truth is known.

A sample; the shares over 600 campaigns are held to 95 % ± 2 by benchmarks/study_coverage.py.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import binom

from planner.calibrate.fit_to_calibration import coefficients_of
from planner.protocols import Sensor
from planner.simulate.campaign import Settings, prepared, simulate
from tests.calibrate import world
from tests.calibrate.truths import QUIET_RUNS, coverage, fitted
from tests.simulate.benches import campaign_of

CAMPAIGNS = 84
BY_CHANCE = 1e-4  # that so few hold the truth, for one coefficient of some thirty


@pytest.mark.parametrize("noise", [world.Noise(), QUIET_RUNS], ids=["run-to-run", "no run-to-run"])
def test_intervals_hold_the_truth_of_units_from_plain_numpy(noise: world.Noise) -> None:
    found = coverage(CAMPAIGNS, noise)
    assert {len(hits) for hits in found.values()} == {CAMPAIGNS}
    for key, hits in found.items():
        assert sum(hits) >= binom.ppf(BY_CHANCE, CAMPAIGNS, 0.95), (key, np.mean(hits))
    assert_holds_95_percent(np.mean(list(found.values()), axis=0))


def test_intervals_hold_the_truth_of_units_from_the_simulator() -> None:
    """The same with everything that the spec says of a unit: curves, drift, storage; the chamber strays."""
    spec, plan = campaign_of(3, 3, "close_the_loop.yaml")
    unit = prepared(spec)
    settings = Settings()
    hits = []
    for seed in range(CAMPAIGNS // 3):
        table, truth = simulate(plan, unit, seed, settings=settings)
        sensor: Sensor = ("gyro", "accelerometer")[seed % 2]
        fit = fitted(table, sensor, seed // 2 % 3, spec, spec.effects)
        for c in coefficients_of(fit, spec):
            degc = 20.0 if c.temperature_degc is None else c.temperature_degc
            hits.append(c.low <= truth.at(c.error, c.term, degc) <= c.high)
    assert len(hits) == 4 * CAMPAIGNS // 3
    assert_holds_95_percent(np.reshape(hits, (-1, 4)).mean(axis=1))


def assert_holds_95_percent(shares: np.ndarray) -> None:
    """Shares (n,) of campaigns, independent of each other: their mean within three of its standard errors."""
    assert abs(np.mean(shares) - 0.95) < 3.0 * np.std(shares, ddof=1) / np.sqrt(len(shares))
