"""What a thermometer strays about the course of a unit that warms itself is noise, of rates on an arm too."""

from __future__ import annotations

import numpy as np
import pytest

from planner.diagnose.hypotheses.channels import channel
from planner.diagnose.hypotheses.read_temperature import about_course, strays_of, with_read_temperature
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions

RUNS, ROWS, NOISE_K, PER_KELVIN = 12, 12, 0.04, 6e-5
STARTS = np.arange(0, RUNS * ROWS, ROWS)
TIME_ON = np.tile(130.0 + 100.0 * np.arange(ROWS), RUNS)
DECLARED = ("bias", "scale_factor", "scale_factor_temperature")


def _course(seed: int) -> tuple[Array, Array]:
    """(n,) K that a unit has after it was switched on, in chambers of another temperature each, and noise."""
    rng = np.random.default_rng(seed)
    rooms = np.repeat(np.linspace(-40.0, 60.0, RUNS) + rng.normal(size=RUNS), ROWS)
    return rooms + 3.0 * (1.0 - np.exp(-TIME_ON / 900.0)), NOISE_K * rng.normal(size=len(rooms))


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_noise_about_a_smooth_course_is_told_from_it(seed: int) -> None:
    true, noise = _course(seed)
    still = np.zeros(len(true))
    assert np.abs(about_course(true, still, TIME_ON, STARTS)).max() < 0.5 * NOISE_K  # a cubic at most
    assert np.corrcoef(about_course(true + noise, still, TIME_ON, STARTS), noise)[0, 1] > 0.75


def test_on_a_ramp_and_beside_a_jump_nothing_strays() -> None:
    true, noise = _course(5)
    assert not about_course(true + noise, np.full(len(true), 0.02), TIME_ON, STARTS).any()
    jumps = true + 20.0 * (np.arange(len(true)) % 4 // 2)  # two records at a point
    assert not about_course(jumps, np.zeros(len(true)), TIME_ON, STARTS).any()


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_what_it_makes_of_a_steep_scale_factor_is_taken_off(seed: int) -> None:
    """0.04 K of 60 ppm/K at 600 deg/s are ten sigma of 0.5 deg/h; so much is left of it by straight fits."""
    true, noise = _course(seed)
    u = np.radians(np.tile(np.linspace(150.0, 650.0, ROWS), RUNS))
    conditions = Conditions(
        rate=u[:, None] * np.eye(3)[0],
        specific_force=np.tile([9.8, 0.0, 0.0], (len(u), 1)),
        temperature_degc=true + noise,
        temperature_rate=np.zeros(len(u)),
        time_on=TIME_ON,
        day=np.repeat(np.arange(float(RUNS)), ROWS),
    )
    c = channel("gyro", 0, conditions, u * (1.0 + PER_KELVIN * (true - 20.0)), DECLARED)
    wide = with_read_temperature(c, strays_of(c.model.conditions, STARTS))
    before, after = (x.r - x.J @ np.linalg.lstsq(x.J, x.r, rcond=1e-10)[0] for x in (c, wide))
    assert np.std(after) < 0.7 * np.std(before)
