"""What a thermometer strays about the course of a unit that warms itself is noise, of rates on an arm too."""

from __future__ import annotations

import numpy as np
import pytest

from planner.diagnose.channels.channel import channel
from planner.diagnose.channels.prepared import prepared
from planner.diagnose.channels.read_temperature import about_course, strays_of, with_read_temperature
from planner.diagnose.search.sensor import diagnose_sensor
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.nouns.dwell_table import DwellTable
from planner.protocols import Sensor

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
    wide = with_read_temperature(c, strays_of(c.model.conditions, STARTS), STARTS)
    before, after = (x.r - x.J @ np.linalg.lstsq(x.J, x.r, rcond=1e-10)[0] for x in (c, wide))
    assert np.std(after) < 0.7 * np.std(before)


# ---------------------------------------------------------------- whole campaigns at few chamber points

FACES = np.concatenate([np.eye(3), -np.eye(3)])
RATES = (-300.0, -100.0, 100.0, 300.0)


def _warming(seed: int, rooms: tuple[float, ...], g_sensitivity: float = 0.0) -> DwellTable:
    """Twelve power-ons of a unit that warms itself by 0.5 K, rests and turns in any order, nothing hidden.

    60 ppm/K and 1.5e-4 g/K, read with 0.025 K of noise; g_sensitivity: deg/s/g of gyro y along x
    """
    rng = np.random.default_rng(seed)
    earth, g = np.radians(15.041 / 3600.0), 9.80665
    axes = np.concatenate([FACES, np.repeat(np.eye(3), len(RATES), axis=0)])
    rates = np.concatenate([np.zeros(6), np.radians(np.tile(RATES, 3))])
    count = len(axes)
    order = np.concatenate([rng.permutation(count) for _ in range(RUNS)])
    up, turns, run = axes[order], rates[order], np.repeat(np.arange(RUNS), count)
    time_on = np.tile(60.0 + 90.0 * np.arange(count), RUNS)
    true = np.array(rooms)[run % len(rooms)] + 0.5 * (1.0 - np.exp(-time_on / 800.0))
    warmer = (true - 20.0)[:, None]
    rate = up * (turns + earth * np.sin(0.97))[:, None]
    force = g * up

    def each(sigma: float) -> Array:
        return np.repeat(sigma * rng.normal(size=(RUNS, 3)), count, axis=0)

    gyro = rate * (1.0 + np.array([6e-5, -4e-5, 5e-5]) * warmer + each(2e-5)) + each(np.radians(1e-3))
    acc = force * (1.0 + np.array([-3e-5, 4e-5, 2e-5]) * warmer + each(2e-5)) + each(3e-4 * g)
    acc += g * np.array([1.5e-4, -1e-4, 1.2e-4]) * warmer
    gyro[:, 1] += np.radians(g_sensitivity) * up[:, 0]
    return DwellTable(
        run=run + 1,
        day=0.5 * run,
        time_on=time_on,
        duration=np.full(len(run), 30.0),
        temperature_degc=true + 0.025 * rng.normal(size=len(run)),
        temperature_rate=0.5 / 800.0 * np.exp(-time_on / 800.0),
        ref_rate=rate,
        ref_acc=force,
        gyro=gyro + np.radians(8e-5) * rng.normal(size=gyro.shape),
        acc=acc + 1e-5 * g * rng.normal(size=acc.shape),
        unit=np.full(len(run), "1"),
        source="warming",
    )


def _named(seed: int, rooms: tuple[float, ...], sensor: Sensor, g_sensitivity: float = 0.0) -> list[str]:
    table = _warming(seed, rooms, g_sensitivity)
    declared = ("bias", "bias_temperature", "scale_factor", "scale_factor_temperature", "misalignment")
    found = diagnose_sensor(prepared(table), sensor, declared, 1).found
    return [found.pool.blocks[b].name for b in found.all]


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.further("seed", range(3, 10))
@pytest.mark.parametrize("rooms", [(20.0,), (20.0, 45.0)])
def test_of_a_unit_that_warms_itself_at_few_points_nothing_goes_with_the_time(
    seed: int, rooms: tuple[float, ...]
) -> None:
    """It had been something over time and rate of 10 to 90 sigma, or a warm-up of the accelerometers."""
    assert _named(seed, rooms, "gyro") == []
    assert _named(seed, rooms, "accelerometer") == []


@pytest.mark.parametrize("seed", [1, 2])
def test_what_hides_beside_its_warming_is_found(seed: int) -> None:
    assert _named(seed, (20.0, 45.0), "gyro", 2e-4) == ["g_sensitivity"]
