"""Levels of six or seven power-ons are held against the budget of their spread, though no search has it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.dwells_to_diagnosis import diagnose
from planner.nouns.diagnosis import UnitDiagnosis
from tests.diagnose.hall import read
from tests.diagnose.records.test_off_power_on import few, spec


def drawn(seed: int, power_ons: int, times: float) -> UnitDiagnosis:
    """Biases of each power-on, so many times the run_to_run of the spec at 20 degC."""
    table, rng = read(few(seed, power_ons), seed), np.random.default_rng([seed, power_ons, 5])
    assert table.gyro is not None
    assert table.acc is not None
    draws = times * rng.normal(size=(2, power_ons, 3))[:, table.run - 1]
    gyro, acc = table.gyro + np.radians(2e-3) * draws[0], table.acc + 9.8e-3 * draws[1]
    return diagnose(replace(table, gyro=gyro, acc=acc), spec())


@pytest.mark.parametrize(("seed", "power_ons"), [(1, 6), (2, 7)])
@pytest.mark.further(("seed", "power_ons"), [(s, 6 + s % 2) for s in range(3, 11)])
def test_levels_of_seven_times_the_budget_exceed_it(seed: int, power_ons: int) -> None:
    """The diagnosis had been clean, and said nothing of them."""
    found = drawn(seed, power_ons, 7.0)
    over = {b.error for b in found.budget_exceeded if b.part == "run_to_run"}
    assert {"gyro.bias", "accelerometer.bias"} <= over
    assert not found.effects


@pytest.mark.parametrize(("seed", "power_ons"), [(1, 6), (2, 7)])
@pytest.mark.further(("seed", "power_ons"), [(s, 6 + s % 2) for s in range(3, 11)])
def test_levels_within_the_budget_do_not(seed: int, power_ons: int) -> None:
    assert not [b for b in drawn(seed, power_ons, 1.0).budget_exceeded if b.error.endswith(".bias")]
