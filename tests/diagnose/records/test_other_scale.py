"""Readings in another unit of measurement than their heading says: in one power-on, or in all."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.records.not_as_said import screened
from planner.diagnose.records.other_scale import other_scales
from planner.errors import InputError
from planner.nouns.dwell_table import DwellTable
from tests.diagnose.hall import axes_apart, read
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


# ---------------------------------------------------------------- gyros at rest


def _faces(seed: int) -> tuple[DwellTable, int]:
    """A campaign whose rests have power-ons of their own, and one of these."""
    table = read(axes_apart(seed), seed)
    rests = np.linalg.norm(table.ref_rate, axis=1) < np.radians(0.1)
    return table, int(np.random.default_rng(seed).choice(np.unique(table.run[rests])))


@pytest.mark.parametrize(
    ("factor", "said"), [(np.pi / 180.0, "in rad/s"), (180.0 / np.pi, "converted twice")]
)
@pytest.mark.parametrize("seed", [11, 12, 13, 14])
def test_gyros_at_rest_in_another_unit_are_said_by_the_rate_of_the_earth(
    seed: int, factor: float, said: str
) -> None:
    """A bias is no multiple of a reference: it was an azimuth, or an in-run instability beyond its budget."""
    table, run = _faces(seed)
    assert not other_scales(table)
    (one,) = other_scales(scaled(table, "gyro", factor, run))
    assert (one.run, one.sensor) == (run, "gyro")
    assert said in one.guess
    assert np.array_equal(one.rows, table.run == run)


@pytest.mark.parametrize("seed", [11, 12, 13, 14])
def test_a_power_on_that_is_quiet_or_whose_axes_stand_still_is_in_no_other_unit(seed: int) -> None:
    """A fiftieth of the noise with the whole rate of the Earth; a level of zero with the usual noise."""
    table, run = _faces(seed)
    mine = (table.run == run)[:, None]
    mean = table.gyro[mine[:, 0]].mean(axis=0)
    quiet = np.where(mine, mean + (table.ref_rate - table.ref_rate[mine[:, 0]].mean(axis=0)), table.gyro)
    assert not other_scales(replace(table, gyro=quiet + 1e-7 * mine))
    assert not other_scales(replace(table, gyro=np.where(mine, table.gyro - mean, table.gyro)))
