"""Every coefficient within its interval as often as the interval says, on units whose truth is known."""

from __future__ import annotations

import numpy as np
import pytest

from planner.learn.fit_to_calibration import coefficients_of
from planner.protocols import Sensor
from planner.simulate.campaign import Settings, prepared, simulate
from tests.learn import world
from tests.learn.truths import QUIET_RUNS, coverage, fitted
from tests.simulate.benches import campaign_of

CAMPAIGNS = 504


@pytest.mark.parametrize("noise", [world.Noise(), QUIET_RUNS], ids=["run-to-run", "no run-to-run"])
def test_intervals_hold_the_truth_of_units_from_plain_numpy(noise: world.Noise) -> None:
    """95 % ± 2 in all; a single coefficient's share has a spread of 1 % itself over 504 campaigns: ± 3."""
    found = coverage(CAMPAIGNS, noise)
    assert {len(hits) for hits in found.values()} == {CAMPAIGNS}
    for key, hits in found.items():
        assert 0.92 <= np.mean(hits) <= 0.98, (key, np.mean(hits))
    assert 0.93 <= np.mean([np.mean(hits) for hits in found.values()]) <= 0.97


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
    assert 0.93 <= np.mean(hits) <= 0.97
