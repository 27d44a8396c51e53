"""Some twenty power-ons: noise is judged under what they can carry, and is known well enough to test by."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.channels.prepared import prepared
from planner.diagnose.search.sensor import SensorFound, diagnose_sensor
from planner.dwells.table_rows import rows_of
from planner.nouns.dwell_table import DwellTable
from tests.diagnose.labs.unit import campaign, noise_of
from tests.diagnose.worlds import DECLARED

POWER_ONS = 21


def few(seed: int) -> DwellTable:
    """Evenly chosen power-ons of the gyros of a campaign without a centrifuge."""
    table, _ = campaign(seed, centrifuge=False)
    runs = np.unique(table.run)
    kept = runs[np.unique(np.linspace(0, len(runs) - 1, POWER_ONS).round().astype(int))]
    return rows_of(replace(table, acc=None), np.isin(table.run, kept))


def claims(s: SensorFound) -> list[tuple[str, tuple[int, ...]]]:
    return [s.found.pool.blocks[b].key for b in s.found.all]


@pytest.mark.parametrize("seed", [96004, 96005])
@pytest.mark.further("seed", [96006])
def test_a_bias_that_settles_within_half_a_minute_is_seen(seed: int) -> None:
    """At 7 to 10 sigma nothing was said: by a few degrees of freedom nothing is significant."""
    table = few(seed)
    assert table.gyro is not None
    gyro, axis = table.gyro.copy(), seed % 3
    gyro[:, axis] += np.radians(6.0 * noise_of(seed, "gyro").white) * np.exp(-table.time_on / 30.0)
    found = diagnose_sensor(prepared(replace(table, gyro=gyro)), "gyro", DECLARED, 1)
    assert {name for name, _ in claims(found)} <= {"settling", "warm_up", "drift_curve", "time_on"}
    assert {axes for _, axes in claims(found)} == {(axis,)}


@pytest.mark.parametrize("seed", [96011, 96012, 96013, 96014])
def test_a_clean_one_claims_nothing(seed: int) -> None:
    assert claims(diagnose_sensor(prepared(few(seed)), "gyro", DECLARED, 1)) == []
