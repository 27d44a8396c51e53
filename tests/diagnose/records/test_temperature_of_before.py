"""A thermometer that is read one record late, in power-ons that soak at one temperature after another."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.dwells_to_diagnosis import diagnose
from planner.diagnose.records.temperature_of_before import temperature_of_before
from planner.nouns.dwell_table import DwellTable
from tests.diagnose.hall import chamber, days, hidden, read
from tests.specs import shipped

SPEC = shipped("small_uav").spec


def _late(table: DwellTable) -> DwellTable:
    first = np.append(True, np.diff(table.run) > 0)
    t = np.where(first, table.temperature_degc, np.roll(table.temperature_degc, 1))
    return replace(table, temperature_degc=t)


@pytest.mark.parametrize("seed", [71])
@pytest.mark.further("seed", [72, 73, 74])
def test_it_is_the_thermometer_and_no_lag_of_the_sensors(seed: int) -> None:
    """Thermal lags of up to four channels were claimed, and curves over the time since power-on."""
    table = read(chamber(seed), seed)
    found = diagnose(_late(table), SPEC)
    assert [s.hypothesis for s in found.reference_suspects] == ["thermometer_lag"]
    assert not found.effects
    assert not found.unknown


@pytest.mark.parametrize("seed", [75, 76, 77])
def test_readings_in_time_are_left_as_they_are(seed: int) -> None:
    assert temperature_of_before(read(chamber(seed), seed)) is None
    assert temperature_of_before(_late(read(days(seed), seed))) is None  # a soak a power-on: no record tells


@pytest.mark.parametrize("seed", [78, 79])
def test_what_one_channel_lags_is_that_channels(seed: int) -> None:
    """By a record, as if it alone were read at the temperature of the one before."""
    table = read(chamber(seed), seed)
    lag = _late(table).temperature_degc - table.temperature_degc
    assert temperature_of_before(hidden(table, "gyro", 1, 1e-3 * lag)) is None


@pytest.mark.parametrize("seed", [81, 82])
def test_rows_that_do_not_stay_tell_nothing_of_it(seed: int) -> None:
    """All records are put right by those that tell: the first ones of each soak."""
    right = read(chamber(seed), seed)
    table = _late(right)
    whole, some = temperature_of_before(table), temperature_of_before(table, table.run > 2)
    assert whole is not None
    assert some is not None
    np.testing.assert_array_equal(whole.table.temperature_degc, some.table.temperature_degc)
    assert some.strength < whole.strength
    assert temperature_of_before(table, table.temperature_degc == right.temperature_degc) is None
