"""What drifts by less than the spec lets wander within a power-on, in records that do not wander."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from planner.diagnose.dwells_to_diagnosis import diagnose
from planner.nouns.diagnosis import UnitDiagnosis
from planner.nouns.dwell_table import DwellTable
from planner.spec.sensor_alone import sensor_spec_from_bytes
from tests.diagnose.hall import Noise, days, hidden, read
from tests.specs import shipped

SPEC = shipped("small_uav").spec  # whose accelerometers wander by 0.5 mg within a power-on
QUIET = Noise(1e-5, 6e-4)
SIZE = 4e-5  # g in 1000 s, four times the noise of a record


def diagnosed(seed: int, within: float, size: float) -> UnitDiagnosis:
    """Of nine power-ons at seven temperatures: they tell no spread, and the calibration takes the spec's."""
    hall = days(seed, 9)
    hall = replace(hall, temperature=hall.temperature % 0.5 + 18.0 * (hall.run % 7) - 50.0)
    table = read(hall, seed, acc=replace(QUIET, within=within))
    table = hidden(table, "accelerometer", seed % 3, size * hall.time_on / 1000.0)
    return diagnose(replace(table, gyro=None), SPEC)


@pytest.mark.parametrize("seed", [97101, 97102])
@pytest.mark.further("seed", [97104])
def test_a_drift_that_the_records_tell_keeps_its_name(seed: int) -> None:
    """Refused at 15 sigma: the fit counts the budget as noise of every record, "each interval holds zero"."""
    found = diagnosed(seed, 0.0, SIZE)
    (effect,) = found.effects
    assert (effect.effect, effect.channels) == ("drift", (f"accelerometer_{'xyz'[seed % 3]}",))
    (term,) = effect.terms
    assert term.low < 9.80665 * SIZE / 1000.0 < term.high
    assert any("more drift within a power-on" in note for note in found.notes)


@pytest.mark.parametrize("seed", [97111, 97112])
def test_records_that_wander_name_no_drift(seed: int) -> None:
    assert not diagnosed(seed, 1e-4, 0.0).effects


@pytest.mark.parametrize("seed", [97121, 97122])
@pytest.mark.further("seed", [97123, 97124])
def test_an_arm_that_the_records_tell_keeps_its_name(seed: int) -> None:
    """On three channels at once, in power-ons of more records than a dozen: "each interval holds zero"."""
    found = diagnose(_centrifuge(seed), sensor_spec_from_bytes(ON_AN_ARM, Path("arm.yaml")).spec)
    (effect,) = found.effects
    assert effect.effect == "arm_length"
    (term,) = effect.terms
    assert term.low < LONGER < term.high


LONGER = 4e-5  # of its length
ON_AN_ARM = b"""
planner: 1
name: accelerometers that may wander, and do not
unit:
  service_life: 500 h
  noise: {accelerometer: 200 micro-g/sqrt(Hz)}
  accelerometer:
    bias: {systematic: 80 mg, run_to_run: 5 mg, in_run: 1.5 mg}
    scale_factor: {systematic: 5 %}
    misalignment: {systematic: 1.5 deg}
effects: [bias, bias_temperature, scale_factor, scale_factor_temperature, misalignment]
"""


def _centrifuge(seed: int, power_ons: int = 12) -> DwellTable:
    """Rests around three axes, then loads of 5 to 30 g along every axis either way, twice. Plain NumPy."""
    rng = np.random.default_rng([seed, 61])
    along = np.vstack([np.eye(3), -np.eye(3)])
    angles = np.radians(30.0 * np.arange(12))
    rests = [np.cos(a) * along[i] + np.sin(a) * along[(i + 1) % 3] for i in range(3) for a in angles]
    loads = [(g, along[i], np.eye(3)[(i + 1) % 3]) for i in range(6) for g in (5.0, 13.0, 21.0, 30.0)]
    steps = [(r, np.zeros(3), np.zeros(3), 100.0) for r in rests]
    steps += [(up, g * r, up * np.sqrt(g * 9.80665 / 1.5), 30.0) for g, r, up in loads for _ in range(2)]
    m = len(steps)
    up, load, turn = (np.tile(np.array([s[k] for s in steps]), (power_ons, 1)) for k in range(3))
    run = np.repeat(np.arange(power_ons) + 1, m)
    duration = np.tile([s[3] for s in steps], power_ons)
    T = np.repeat(np.linspace(-30.0, 60.0, 6)[np.arange(power_ons) % 6], m) + 0.05 * rng.normal(size=len(run))
    lean = np.eye(3) + np.radians(rng.uniform(-1.0, 1.0, (3, 3))) * (1.0 - np.eye(3))
    felt = up + (1.0 + LONGER) * load
    acc = (1.02 + 1e-5 * T[:, None]) * (felt @ lean.T) + 1e-4 * T[:, None]
    acc += 3e-3 * rng.normal(size=(power_ons + 1, 3))[run]
    white = np.hypot(4e-4 / np.sqrt(duration), 3e-6 * np.linalg.norm(felt, axis=1))
    acc += white[:, None] * rng.normal(size=acc.shape)
    return DwellTable(
        unit=np.full(len(run), "U"), run=run, day=run.astype(float),
        time_on=np.tile(30.0 + 120.0 * np.arange(m), power_ons), duration=duration, temperature_degc=T,
        temperature_rate=np.zeros(len(run)), ref_rate=turn, ref_acc=9.80665 * (up + load), gyro=None,
        acc=9.80665 * acc,
    )  # fmt: skip
