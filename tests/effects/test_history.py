"""What the rows before a row say of it: the way in which the temperature came."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from planner.effects import hysteresis, thermal_lag
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from tests.effects.conditions import random_conditions


def at(temperature: list[float], rate: list[float] | None = None) -> Conditions:
    """K/min."""
    few = random_conditions(np.random.default_rng(1), len(temperature))
    per_s = np.array(rate or [0.0] * len(temperature)) / 60.0
    return replace(few, temperature_degc=np.array(temperature), temperature_rate=per_s)


def way(conditions: Conditions) -> Array:
    return np.asarray(2.0 * hysteresis.EFFECT.drive("gyro", conditions, {}))


def test_a_unit_that_warms_itself_keeps_the_way_in_which_it_came() -> None:
    """From 60 degC down to 20, where it warms by 2.9 K; from −40 up to 20.5, where the chamber strays."""
    cooled = at([60.0, 20.0, 21.0, 22.0, 22.9], [0.0, 0.4, 0.3, 0.2, 0.1])
    np.testing.assert_array_equal(way(cooled), [1.0, -1.0, -1.0, -1.0, -1.0])
    heated = at([-40.0, 20.5, 19.5, 18.0, 19.0])
    np.testing.assert_array_equal(way(heated), [-1.0, 1.0, 1.0, 1.0, 1.0])


def test_the_way_turns_three_kelvins_from_where_the_temperature_turned() -> None:
    """By steps of 1 K up to 30 degC and down again: after 26.9, which no step to the next row would show."""
    up, down = list(np.arange(20.0, 31.0)), list(np.arange(29.0, 19.0, -1.0))
    found = way(at(up + down))
    np.testing.assert_array_equal(found[:4], 0.0)
    np.testing.assert_array_equal(found[4:14], 1.0)
    np.testing.assert_array_equal(found[14:], -1.0)


def test_a_chamber_that_ramps_has_its_way_at_once() -> None:
    ramping = at([40.0, 41.0, 40.5, 39.9, 39.8], [1.0, 1.0, -1.0, -1.0, 0.0])
    np.testing.assert_array_equal(way(ramping), [1.0, 1.0, -1.0, -1.0, -1.0])


def test_strays_of_a_soaked_chamber_are_no_change_that_a_lag_follows() -> None:
    """Rows of one power-on, warmer by less than 3 K and by more; a ramp; between power-ons nothing."""
    lags = thermal_lag.EFFECT
    one = replace(at([20.0, 20.1, 22.5, 19.9]), time_on=np.array([10.0, 20.0, 30.0, 40.0]))
    assert not lags.driven(one)
    assert lags.driven(replace(one, temperature_degc=np.array([20.0, 21.0, 22.0, 23.5])))
    assert lags.driven(replace(one, temperature_rate=np.full(4, 1.0 / 60.0)))
    apart = replace(one, time_on=np.array([10.0, 20.0, 10.0, 20.0]))
    assert not lags.driven(replace(apart, temperature_degc=np.array([20.0, 20.1, 60.0, 60.1])))
