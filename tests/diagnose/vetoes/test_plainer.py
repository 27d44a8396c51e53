"""A coefficient that is drawn anew at every power-on is no table, and a table is no coefficient."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.dwells_to_diagnosis import diagnose
from planner.nouns.dwell_table import DwellTable
from tests.diagnose.labs.unit import campaign
from tests.specs import shipped

SPEC = shipped("small_uav").spec


def ramped(seed: int, factor: np.ndarray, table: DwellTable) -> DwellTable:
    """The gyros alone, x with 0.1 deg/s per K/min times a factor (n,) of each row."""
    assert table.gyro is not None
    gyro = table.gyro.copy()
    gyro[:, 0] += np.radians(0.1) * factor * table.temperature_rate * 60.0
    return replace(table, gyro=gyro, acc=None)


def named(table: DwellTable) -> set[str]:
    found = diagnose(table, SPEC)
    assert not found.unknown
    return {e.effect for e in found.effects}


@pytest.mark.parametrize("seed", [70015])
@pytest.mark.further("seed", [70002])
def test_a_coefficient_that_scatters_is_one_coefficient(seed: int) -> None:
    table, _ = campaign(seed)
    runs, place = np.unique(table.run, return_inverse=True)
    factor = 1.0 + 0.03 * np.random.default_rng(seed).normal(size=len(runs))
    assert named(ramped(seed, factor[place], table)) == {"temperature_rate"}


@pytest.mark.parametrize("seed", [70012])
@pytest.mark.further("seed", [70002])
def test_a_table_stays_one(seed: int) -> None:
    """A slope that goes from 0.7 to 1.3 of its middle over the temperatures, the same in every power-on."""
    table, _ = campaign(seed)
    bent = ramped(seed, 1.0 + 0.3 * table.temperature_degc / 60.0, table)
    assert named(bent) == {"temperature_rate_table"}
