"""A thermometer that stands still, or was not read, in one power-on or from one on."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from planner.diagnose.dwells_to_diagnosis import diagnose
from planner.diagnose.records.not_as_said import screened
from planner.diagnose.records.still_thermometer import still_thermometer
from planner.dwells.table_rows import rows_of
from planner.nouns.dwell_table import DwellTable
from tests.diagnose.hall import days, read
from tests.diagnose.labs.unit import campaign
from tests.specs import shipped


@cache
def whole(seed: int) -> DwellTable:
    return campaign(seed, centrifuge=False)[0]


@cache
def hall(seed: int, power_ons: int) -> DwellTable:
    """A thermometer that strays by 0.02 K."""
    table = read(days(seed, power_ons), seed)
    stray = 0.02 * np.random.default_rng([seed, 3]).normal(size=len(table))
    return replace(table, temperature_degc=np.round(table.temperature_degc + stray, 3))


def stood_still(table: DwellTable, mine: np.ndarray, degc: float) -> DwellTable:
    return replace(table, temperature_degc=np.where(mine, degc, table.temperature_degc))


@pytest.mark.parametrize("seed", range(93020, 93024))
def test_a_thermometer_that_stood_still_in_one_power_on_is_left_out(seed: int) -> None:
    table = whole(seed)
    run = int(np.unique(table.run)[3])
    still = stood_still(table, table.run == run, 21.0)
    assert still_thermometer(still) == (run,)
    seen = screened(still)
    assert [s.hypothesis for s in seen.suspects] == ["stuck_channel"]
    assert set(still.run[~seen.kept]) == {run}
    rounded = replace(still, temperature_degc=np.round(still.temperature_degc))
    assert still_thermometer(rounded) == ()


@pytest.mark.parametrize("power_ons", [5, 8])
def test_few_power_ons_say_it_too(power_ons: int) -> None:
    table = hall(31, power_ons)
    assert still_thermometer(table) == ()
    assert still_thermometer(stood_still(table, table.run == 2, 20.0)) == (2,)


@pytest.mark.parametrize("seed", [32, 33])
@pytest.mark.further("seed", [34, 35])
def test_a_thermometer_that_stands_still_from_a_power_on_on_is_no_error_of_sensors(seed: int) -> None:
    """It was a step of a bias, or what exceeds its budget, on every channel."""
    table = hall(seed, 10)
    found = diagnose(stood_still(table, table.run >= 6, 20.0), shipped("small_uav").spec)
    assert not found.effects
    assert not found.unknown
    assert not found.budget_exceeded
    (suspect,) = found.reference_suspects
    assert suspect.hypothesis == "stuck_channel"
    assert "the thermometer of runs 6 to 10" in suspect.check
    assert {r.run for r in found.rows_left_out} == set(range(6, 11))


def test_temperatures_that_were_not_read_at_all_are_no_fault() -> None:
    """Setpoints are written in every power-on, the hall's temperature of all turns that were taken in it."""
    table = hall(36, 12)
    by_run = {int(r): float(np.round(table.temperature_degc[table.run == r].mean())) for r in set(table.run)}
    written = np.array([by_run[int(r)] for r in table.run])
    assert still_thermometer(replace(table, temperature_degc=written)) == ()
    assert table.ref_rate is not None
    turns = np.linalg.norm(table.ref_rate, axis=1) > np.radians(1.0)
    apart = rows_of(table, np.where(table.run >= 8, turns, ~turns))  # rests first, then turns
    assert still_thermometer(stood_still(apart, apart.run >= 8, 20.0)) == ()


def test_a_value_that_came_back_is_no_fault() -> None:
    """Two power-ons that are apart: nothing stood still in between."""
    table = hall(37, 12)
    assert still_thermometer(stood_still(table, np.isin(table.run, [3, 9]), 20.0)) == ()
