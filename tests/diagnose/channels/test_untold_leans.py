"""Scale factors and leans that no turn tells: their products are those of an instrument all the same."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from planner.diagnose.dwells_to_diagnosis import diagnose
from planner.nouns.array import Array
from planner.nouns.dwell_table import DwellTable
from planner.spec.sensor_alone import sensor_spec_from_bytes

SPEC = b"""
planner: 1
name: a cheap gyro
unit:
  service_life: 500 h
  noise: {gyro: 2 deg/sqrt(h)}
  gyro:
    bias: {systematic: 20 deg/s, run_to_run: 0.02 deg/s}
    scale_factor: {systematic: 5 %}
    misalignment: {systematic: 1.5 deg}
effects: [bias, bias_temperature, scale_factor, scale_factor_temperature, misalignment]
"""
EARTH_DPS = 15.041067 / 3600.0
SLANTING = np.array([[1.0, 1.0, 0.0], [0.0, 1.0, 1.0]]) / np.sqrt(2.0)


def two_slanting_axes(seed: int, power_ons: int = 6) -> DwellTable:
    """Ramps over 100 K: faces in every second power-on, in the others turns about two axes both ways."""
    rng = np.random.default_rng([seed, 41])
    lean = np.eye(3) + np.radians(rng.uniform(0.5, 1.5, (3, 3)) * rng.choice([-1.0, 1.0], (3, 3)))
    np.fill_diagonal(lean, 1.0)
    slope = rng.uniform(1.5e-4, 2.5e-4, 3) * rng.choice([-1.0, 1.0], 3)
    parts: list[tuple[Array, ...]] = []
    for k in range(power_ons):
        n = 60 if k % 2 else 12
        minutes = np.linspace(1.0, 50.0, n)
        T = -30.0 + 2.0 * minutes if k % 4 < 2 else 70.0 - 2.0 * minutes
        if k % 2:
            up = SLANTING[np.arange(n) % 2]
            turn = up * (np.repeat([70.0, -70.0, 210.0, -210.0], 2)[np.arange(n) % 8])[:, None]
        else:
            up = np.vstack([np.eye(3), -np.eye(3)])[np.arange(n) % 6]
            turn = np.zeros((n, 3))
        parts.append((np.full(n, k + 1), minutes * 60.0, T, up, turn + 0.8 * EARTH_DPS * up))
    run, time_on, T, up, rate = (np.concatenate(x) for x in zip(*parts, strict=True))
    gyro = (1.0 + 0.02 + slope * (T[:, None] - 20.0)) * (rate @ lean.T) + rng.uniform(-10.0, 10.0, 3)
    gyro += 0.02 * rng.normal(size=(power_ons + 1, 3))[run] + 1e-2 * rng.normal(size=gyro.shape)
    return DwellTable(
        unit=np.full(len(T), "U"), run=run, day=run.astype(float), time_on=time_on,
        duration=np.full(len(T), 11.0), temperature_degc=T,
        temperature_rate=np.where((run - 1) % 4 < 2, 2.0, -2.0) / 60.0,
        ref_rate=np.radians(rate), ref_acc=9.80665 * up, gyro=np.radians(gyro), acc=None,
    )  # fmt: skip


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.further("seed", [3, 4])
def test_turns_about_two_slanting_axes_hide_nothing(seed: int) -> None:
    """One combination of the three rates is told by the Earth's alone; it made all products none."""
    found = diagnose(two_slanting_axes(seed), sensor_spec_from_bytes(SPEC, Path("cheap.yaml")).spec)
    assert not found.effects
    assert not found.unknown
