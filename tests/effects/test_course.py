"""The temperature within a power-on, from readings with noise and from the rates that stand beside them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.effects import thermal_lag
from planner.effects._course import along_rates
from planner.effects._history import power_ons
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from tests.effects.conditions import random_conditions

WARMS_S = 900.0
TAU = 240.0


def warming(seed: int, power_ons: int = 20, records: int = 7) -> Conditions:
    """Power-ons of a unit that warms itself by 1.2 K, without noise."""
    rng = np.random.default_rng([seed, 83])
    t = np.concatenate([rng.uniform(60.0, 90.0) + 70.0 * np.arange(records) for _ in range(power_ons)])
    begins = np.repeat(rng.uniform(-40.0, 60.0, power_ons), records)
    gone = np.exp(-t / WARMS_S)
    few = random_conditions(rng, len(t))
    T, rate = begins + 1.2 * (1.0 - gone), 1.2 / WARMS_S * gone
    return replace(few, time_on=t, temperature_degc=T, temperature_rate=rate)


def read(c: Conditions, seed: int) -> Conditions:
    """Temperatures to 0.01 K with as much noise, rates to 0.001 K/min."""
    rng = np.random.default_rng([seed, 84])
    T = np.round(c.temperature_degc + rng.normal(0.0, 0.01, len(c.time_on)), 2)
    return replace(c, temperature_degc=T, temperature_rate=np.round(60.0 * c.temperature_rate, 3) / 60.0)


def behind(c: Conditions) -> Array:
    """T − T_b of a body of first order that begins with the unit, in closed form."""
    t = c.time_on
    return np.asarray(1.2 * TAU / (WARMS_S - TAU) * (np.exp(-t / WARMS_S) - np.exp(-t / TAU)))


def test_noise_of_readings_takes_nothing_of_a_lag() -> None:
    """By differences of readings it was off by 0.010 K of 0.09, and a fit had half of its coefficient."""
    off = []
    for seed in range(12):
        c = warming(seed)
        found = thermal_lag.EFFECT.drive("gyro", read(c, seed), {"time_constant": TAU})
        off.append(float(np.sqrt(np.mean((found - behind(c)) ** 2))))
    assert max(off) < 0.005  # 140 records know the two noises to a factor
    assert np.median(off) < 0.0025


@pytest.mark.parametrize("seed", range(6))
def test_readings_without_noise_are_left_as_they_are(seed: int) -> None:
    c = warming(seed)
    np.testing.assert_array_equal(along_rates(c, power_ons(c)).temperature_degc, c.temperature_degc)


@pytest.mark.parametrize("seed", range(3))
def test_a_chamber_that_moved_between_two_records_has_moved(seed: int) -> None:
    """Its rates are those of two soaks: 8 K lie between two records of the second power-on."""
    c = warming(seed)
    moved = read(replace(c, temperature_degc=c.temperature_degc + 8.0 * (np.arange(140) == 11)), seed)
    drawn = along_rates(moved, power_ons(moved)).temperature_degc
    np.testing.assert_allclose(drawn, moved.temperature_degc, atol=0.05)


@pytest.mark.parametrize("seed", range(3))
def test_rates_that_are_worse_than_readings_change_little(seed: int) -> None:
    """Rates to 0.1 K/min say nothing of 0.07: the readings stand, to their own noise."""
    c = read(warming(seed), seed)
    coarse = replace(c, temperature_rate=np.round(60.0 * c.temperature_rate, 1) / 60.0)
    drawn = along_rates(coarse, power_ons(coarse)).temperature_degc
    off = warming(seed).temperature_degc
    assert np.std(drawn - off) < 1.1 * np.std(coarse.temperature_degc - off)
