"""Three power-ons of hundreds of records each, in which the sensor wanders as far as the spec lets it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from planner.diagnose.dwells_to_diagnosis import diagnose
from planner.diagnose.vetoes.in_stretches import Stretches
from planner.nouns.array import Array
from planner.nouns.diagnosis import UnitDiagnosis
from planner.nouns.dwell_table import DwellTable
from planner.spec.sensor_alone import sensor_spec_from_bytes

SPEC = b"""
planner: 1
name: accelerometers that wander
unit:
  service_life: 500 h
  noise: {accelerometer: 50 micro-g/sqrt(Hz)}
  accelerometer:
    bias: {systematic: 80 mg, run_to_run: 5 mg, in_run: 1.5 mg}
    scale_factor: {systematic: 5 %}
    misalignment: {systematic: 1.5 deg}
effects: [bias, bias_temperature, scale_factor, misalignment]
"""
POWER_ONS, STEPS = 3, 72  # of six faces each: 432 records of a power-on


def diagnosed(seed: int, drift: float = 0.0) -> UnitDiagnosis:
    """drift: mg per hour of y"""
    rng = np.random.default_rng([seed, 43])
    n = 6 * STEPS
    time_on = 30.0 + 28.0 * np.arange(n) + 1800.0 * (np.arange(n) // 72)
    level = np.array([20.0, -20.0, 50.0, 0.0, 35.0, -5.0])
    T = np.concatenate([np.repeat(np.roll(level, k), n // 6) for k in range(POWER_ONS)])
    run, t = np.repeat(np.arange(POWER_ONS) + 1, n), np.tile(time_on, POWER_ONS)
    up = np.vstack([np.eye(3), -np.eye(3)])[np.arange(len(t)) % 6]
    wander = np.concatenate([_wander(time_on, rng) for _ in range(POWER_ONS)])
    acc = up * 1.01 + rng.uniform(-0.05, 0.05, 3) + 5e-3 * rng.normal(size=(POWER_ONS + 1, 3))[run]
    acc += 1.2e-3 * wander + 1.2e-5 * rng.normal(size=acc.shape)
    acc[:, 1] += 1e-3 * drift * t / 3600.0
    table = DwellTable(
        unit=np.full(len(t), "U"), run=run, day=run.astype(float), time_on=t, duration=np.full(len(t), 20.0),
        temperature_degc=T + 0.05 * rng.normal(size=len(t)), temperature_rate=np.zeros(len(t)),
        ref_rate=np.zeros((len(t), 3)), ref_acc=9.80665 * up, gyro=None, acc=9.80665 * acc,
    )  # fmt: skip
    return diagnose(table, sensor_spec_from_bytes(SPEC, Path("wanders.yaml")).spec)


def _wander(t: Array, rng: np.random.Generator) -> Array:
    """(n, 3) of one sigma and 600 s, from record to record."""
    kept = np.append(0.0, np.exp(-np.diff(t) / 600.0))
    x, now = np.empty((len(t), 3)), np.zeros(3)
    for i, k in enumerate(kept):
        now = k * now + np.sqrt(1.0 - k**2) * rng.normal(size=3)
        x[i] = now
    return x


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.further("seed", [3, 4])
def test_what_wanders_as_the_spec_lets_it_goes_with_no_time(seed: int) -> None:
    """Of more than a thousand records it was not asked: "something that varies with the time" on channels."""
    found = diagnosed(seed)
    assert not found.unknown
    assert not found.effects


@pytest.mark.parametrize("seed", [1, 2])
def test_a_drift_that_no_wander_makes_is_still_told(seed: int) -> None:
    found = diagnosed(seed, drift=8.0)
    told = {e.channels for e in found.effects} | {u.channels for u in found.unknown}
    assert ("accelerometer_y",) in told


def test_stretches_keep_white_noise_white_and_slow_columns_whole() -> None:
    starts, n = np.array([0, 7, 30]), 50
    s = Stretches.of(starts, n, 4)
    A = s.white(np.eye(n))
    assert np.allclose(A @ A.T, np.eye(len(s.firsts)))
    assert np.array_equal(s.firsts[s.starts], starts)
    levels = np.repeat(np.eye(3), np.diff(np.append(starts, n)), axis=0)
    assert np.allclose(A.T @ (A @ levels), levels)
    assert np.allclose(s.over_rows(s.means(levels[:, 1])[:, None])[:, 0], levels[:, 1])
