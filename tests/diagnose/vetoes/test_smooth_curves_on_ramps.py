"""A plain unit with smooth curves over temperature, on ramps between which its tables have nodes of 10 K."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from planner.diagnose.dwells_to_diagnosis import diagnose
from planner.nouns.array import Array
from planner.nouns.diagnosis import UnitDiagnosis
from planner.nouns.dwell_table import DwellTable
from planner.spec.sensor_alone import sensor_spec_from_bytes

SPEC = b"""
planner: 1
name: accelerometers with curves
unit:
  service_life: 500 h
  noise: {accelerometer: 200 micro-g/sqrt(Hz)}
  accelerometer:
    bias:
      systematic: 80 mg
      run_to_run: 5 mg
      temperature_residual: {1: 24 mg, 3: 6.4 mg, 5: 2.4 mg, 9: 1.2 mg}
    scale_factor: {systematic: 5 %, temperature_residual: {1: 2 %, 3: 0.5 %, 5: 0.2 %, 9: 0.1 %}}
effects: [bias, bias_temperature, scale_factor, scale_factor_temperature]
"""
RAMPS = 12


def diagnosed(seed: int, changes: float = 0.0, spread: float = 3.0) -> UnitDiagnosis:
    """changes: mg per K/min, of accelerometer y; spread: mg from power-on to power-on"""
    rng = np.random.default_rng([seed, 59])
    rows: list[tuple[Array, ...]] = []
    for k in range(RAMPS):
        speed = rng.uniform(0.8, 3.0) / 60.0
        time_on = np.arange(60.0, 88.0 / speed, 130.0)
        T = 0.5 + (-1.0) ** k * (speed * time_on - 44.0)
        rows.append((np.full(len(T), k + 1), time_on, T, np.full(len(T), (-1.0) ** k * speed)))
    run, time_on, T, rate = (np.concatenate(x) for x in zip(*rows, strict=True))
    up = np.vstack([np.eye(3), -np.eye(3)])[np.arange(len(T)) % 6]
    x = (T[:, None] - 20.0) / 60.0

    def curves(size: float) -> Array:
        a = rng.normal(size=(3, 3)) * [[0.6], [0.4], [0.2]]
        return size * (a[0] * x**2 + a[1] * x**3 + a[2] * np.cos(3.0 * x))

    acc = (1.03 + curves(0.01)) * up + curves(12e-3) + 1e-3 * spread * rng.normal(size=(RAMPS + 1, 3))[run]
    acc += 1e-5 * rng.normal(size=acc.shape)
    acc[:, 1] += 1e-3 * changes * 60.0 * rate
    table = DwellTable(
        unit=np.full(len(T), "U"), run=run.astype(int), day=run.astype(float), time_on=time_on,
        duration=np.full(len(T), 120.0), temperature_degc=T, temperature_rate=rate,
        ref_rate=np.zeros((len(T), 3)), ref_acc=9.80665 * up, gyro=None, acc=9.80665 * acc,
    )  # fmt: skip
    return diagnose(table, sensor_spec_from_bytes(SPEC, Path("curves.yaml")).spec)


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.further("seed", [4, 5])
def test_what_their_tables_miss_as_the_spec_says_is_no_finding(seed: int) -> None:
    """Something "that varies with the temperature", or a drift that does, on channels that have nothing."""
    found = diagnosed(seed)
    assert not found.unknown
    assert not found.effects


@pytest.mark.parametrize("seed", [1, 2])
def test_what_goes_with_the_ramps_both_ways_is_still_named(seed: int) -> None:
    found = diagnosed(seed, changes=0.2, spread=0.05)
    assert [(e.effect, e.channels) for e in found.effects] == [("temperature_rate", ("accelerometer_y",))]
    assert not found.unknown
