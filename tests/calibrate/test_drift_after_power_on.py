"""The drift after power-on is a table over time (K 2.1, tables 2.15, 2.18)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator

from planner.calibrate.correction import corrected
from planner.calibrate.dwells_to_fit import calibrate
from planner.calibrate.fit_options import FitOptions
from planner.nouns.dwell_table import DwellTable
from tests.calibrate.truths import any_spec

DEG = np.pi / 180.0
# K table 2.18, calibration: mean bias in deg/s at these seconds after power-on
SECONDS = np.array([0.0, 2.0, 5.0, 30.0, 60.0, 120.0, 300.0, 600.0, 1200.0, 2400.0, 3600.0])
MEAN_DPS = np.array([-28.0, 4.503, 8.682, 12.0, 11.0, 9.816, 7.947, 2.079, -5.225, -7.624, -7.828]) * 1e-3
DRIFT = 0.0029  # deg/s, one sigma from power-on to power-on: K table 2.15 at 30 s


def power_ons(seed: int, runs: int) -> DwellTable:
    """A unit at rest for an hour in each power-on, records where K has them and between; levels are drawn."""
    rng = np.random.default_rng([seed, 2018])
    at = np.array(
        [2.0, 6.0, 10.0, 20.0, 30.0, 60.0, 120.0, 200.0, 300.0, 600.0, 900.0, 1200.0, 2400.0, 3600.0]
    )
    n = runs * len(at)
    run, time = np.repeat(np.arange(runs), len(at)), np.tile(at, runs)
    face = run % 6
    force = np.where(face < 3, 1.0, -1.0)[:, None] * np.eye(3)[face % 3]
    mean = np.interp(time, SECONDS[1:], MEAN_DPS[1:])
    gyro = mean[:, None] * np.array([1.0, -0.5, 0.3]) + DRIFT * rng.normal(size=(runs, 3))[run]
    gyro += 2e-4 * rng.normal(size=(n, 3))
    return DwellTable(
        unit=np.full(n, "u1"),
        run=run,
        day=0.1 * run,
        time_on=time,
        duration=np.full(n, 2.0),
        temperature_degc=np.full(n, 20.0),
        temperature_rate=np.zeros(n),
        ref_rate=np.zeros((n, 3)),
        ref_acc=9.80665 * force,
        gyro=DEG * gyro,
        acc=9.80665 * (force + 1e-4 * rng.normal(size=(n, 3))),
    )


@pytest.mark.parametrize("seed", [1])
@pytest.mark.further("seed", [2])
def test_the_table_over_time_follows_k_s_hour_and_one_exponential_does_not(seed: int) -> None:
    data, fresh = power_ons(seed, 12), power_ons(seed + 50, 12)
    left = {}
    for method in ("drift_table", "bias_and_warm_up"):
        (found,) = calibrate(data, any_spec(), FitOptions(method))
        fixed = corrected(fresh, {s.sensor: s.tables for s in found.sensors})
        assert fixed.gyro is not None
        by_run = fixed.gyro.reshape(12, -1, 3) / DEG
        left[method] = float(np.sqrt(np.mean((by_run - by_run.mean(axis=1, keepdims=True)) ** 2)))
    assert fresh.gyro is not None
    raw = fresh.gyro.reshape(12, -1, 3) / DEG
    before = float(np.sqrt(np.mean((raw - raw.mean(axis=1, keepdims=True)) ** 2)))
    assert left["drift_table"] < 4e-4  # of .0046 deg/s; the noise alone is 2e-4
    assert left["drift_table"] < before / 10.0
    assert left["bias_and_warm_up"] > 1.5 * left["drift_table"]


TEMPERATURES = np.linspace(-60.0, 80.0, 8)
NODES_S = np.array([0.0, 10.0, 30.0, 60.0, 120.0, 300.0, 600.0, 1200.0, 2400.0, 3600.0])


def at_eight_temperatures(seed: int, table: np.ndarray) -> DwellTable:
    """Two power-ons of an hour at every temperature, gyros drift by table (8, 10); levels are drawn."""
    plain = power_ons(seed, 16)
    warm = TEMPERATURES[plain.run % 8]
    rng = np.random.default_rng([seed, 8])
    drift = RegularGridInterpolator((TEMPERATURES, NODES_S), table)(np.column_stack([warm, plain.time_on]))
    gyro = drift[:, None] * np.array([1.0, -0.5, 0.3]) + DRIFT * rng.normal(size=(16, 3))[plain.run]
    return replace(plain, temperature_degc=warm, gyro=DEG * (gyro + 2e-4 * rng.normal(size=gyro.shape)))


def test_k_s_table_over_eight_temperatures_and_times_is_found_and_a_line_over_temperature_is_not_it() -> None:
    """Rows as K figure 4.7 has them: no two alike, of either sign."""
    table = 0.01 * np.cumsum(np.random.default_rng(47).normal(size=(8, 10)), axis=1)
    table -= table[:, :1]
    data, fresh = at_eight_temperatures(1, table), at_eight_temperatures(2, table)
    left = {}
    for method in ("drift_table", "drift_table_over_temperature"):
        (found,) = calibrate(data, any_spec(), FitOptions(method))
        fixed = corrected(fresh, {s.sensor: s.tables for s in found.sensors})
        assert fixed.gyro is not None
        by_run = fixed.gyro.reshape(16, -1, 3) / DEG
        left[method] = float(np.sqrt(np.mean((by_run - by_run.mean(axis=1, keepdims=True)) ** 2)))
    assert left["drift_table_over_temperature"] < 4e-4  # the noise alone is 2e-4, and as much of the fit's
    assert left["drift_table"] > 20.0 * left["drift_table_over_temperature"]
