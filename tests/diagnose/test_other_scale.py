"""Readings in another unit of measurement than their heading says: in one power-on, or in all."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.other_scale import other_scales
from planner.diagnose.records import screened
from planner.errors import InputError
from planner.nouns.dwell_table import DwellTable
from tests.diagnose.labs.unit import campaign


def scaled(table: DwellTable, sensor: str, factor: float, run: int | None = None) -> DwellTable:
    """The table with a sensor's readings times a factor, in one power-on or in all."""
    name = "gyro" if sensor == "gyro" else "acc"
    of = np.where((table.run == run) | (run is None), factor, 1.0)
    return replace(table, **{name: getattr(table, name) * of[:, None]})


def a_run_of(table: DwellTable, seed: int) -> int:
    """A power-on in which the unit turns."""
    turns = np.linalg.norm(table.ref_rate, axis=1) > np.radians(3.0)
    return int(np.random.default_rng(seed).choice(np.unique(table.run[turns])))


@pytest.mark.parametrize(
    ("sensor", "factor", "said"),
    [
        ("gyro", np.pi / 180.0, "in rad/s"),
        ("accelerometer", 9.80665, "in m/s²"),
        ("accelerometer", 0.5, "0.5"),
    ],
)
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_one_power_on_in_another_unit_is_said_and_left_out(
    seed: int, sensor: str, factor: float, said: str
) -> None:
    table, _ = campaign(seed)
    run = a_run_of(table, seed)
    seen = screened(scaled(table, sensor, factor, run))
    (suspect,) = seen.suspects
    assert (suspect.hypothesis, suspect.value) == ("mixed_units", run)
    assert said in suspect.check
    assert np.array_equal(seen.kept, table.run != run)
    assert {r.run for r in seen.left_out} == {run}


@pytest.mark.parametrize(("sensor", "factor"), [("gyro", 180.0 / np.pi), ("accelerometer", 1e3)])
def test_a_table_in_another_unit_is_refused(sensor: str, factor: float) -> None:
    table, _ = campaign(4)
    with pytest.raises(InputError, match="times their reference, as if"):
        screened(scaled(table, sensor, factor))


@pytest.mark.parametrize("factor", [0.7, 1.0, 1.4])
def test_a_gain_that_all_power_ons_have_is_the_sensors_own(factor: float) -> None:
    table, _ = campaign(5)
    assert other_scales(scaled(table, "gyro", factor)) == []


@pytest.mark.parametrize("seed", [6, 7])
def test_kelvin_under_degc_is_said(seed: int) -> None:
    table, _ = campaign(seed)
    run = a_run_of(table, seed)
    kelvin = np.where(table.run == run, 273.15, 0.0)
    seen = screened(replace(table, temperature_degc=table.temperature_degc + kelvin))
    (suspect,) = seen.suspects
    assert (suspect.hypothesis, suspect.value) == ("mixed_units", run)
    assert "as if in kelvin" in suspect.check
    assert np.array_equal(seen.kept, table.run != run)
    with pytest.raises(InputError, match="as if in kelvin"):
        screened(replace(table, temperature_degc=table.temperature_degc + 273.15))
