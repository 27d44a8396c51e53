"""What every effect must satisfy, whatever it models."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings

from planner.catalog import effects
from planner.effects._channels import AXES
from planner.nouns.conditions import Conditions
from planner.protocols import Effect, Sensor
from planner.units import dimension_of
from tests.effects.conditions import one, random_conditions, seeds, select
from tests.work import calls

CASES = [(effect, sensor) for effect in effects().values() for sensor in effect.sensors]
every_effect = pytest.mark.parametrize(
    ("effect", "sensor"), CASES, ids=[f"{sensor}.{effect.name}" for effect, sensor in CASES]
)
OUTPUT = {"gyro": "deg/s", "accelerometer": "g"}
# what one unit of the coefficient is multiplied by; a misalignment's angle stands for its sine
DRIVEN_BY = {
    "bias_temperature": "K",
    "temperature_rate": "K/s",
    "ageing": "s",
    "g_sensitivity": "g",
    "g_squared_sensitivity": "g*g",
    "scale_factor_temperature": "K",
    "scale_factor_acceleration": "g",
    "scale_factor_acceleration_squared": "g*g",
    "misalignment": "/rad",
    "misalignment_temperature": "K/rad",
    "arm_bending": "g/rad",
    "lever_arm": "/s/s",
    "vibration_rectification": "g*g",
    "drift": "s",
    "drift_curve_temperature": "K",
    "thermal_lag": "K",
    "g_product_sensitivity": "g*g",
    "g_sensitivity_temperature": "g*K",
}
# biases that are powers of the sensor's own input
POWERS = {
    ("cross_coupling", "gyro"),
    ("cross_coupling", "accelerometer"),
    ("vibration_rectification", "accelerometer"),
}
HISTORY = {"thermal_lag", "hysteresis"}  # what came before a row is part of its conditions
SHARED = {"earth_rate", "arm_bending", "arm_length", "lever_arm"}  # one Earth, one arm: all channels feel it


def test_the_effects_of_this_release_are_all_there() -> None:
    assert set(effects()) >= {
        "bias",
        "scale_factor",
        "misalignment",
        "g_sensitivity",
        "g_squared_sensitivity",
        "scale_factor_nonlinearity",
        "scale_factor_asymmetry",
        "scale_factor_acceleration",
        "bias_temperature",
        "scale_factor_temperature",
        "temperature_rate",
        "warm_up",
        "ageing",
        "bias_step",
        "misalignment_temperature",
        "earth_rate",
        "arm_bending",
        "lever_arm",
    }


@every_effect
def test_offers_itself_as_the_protocol_says(effect: Effect, sensor: Sensor) -> None:
    assert isinstance(effect, Effect)
    assert set(effect.units) == set(effect.sensors)
    names = [term.name for term in effect.terms(sensor)]
    assert len(set(names)) == len(names) >= 1
    assert effect.name in SHARED or all(set(name.split()[0]) <= set(AXES) for name in names)


@every_effect
def test_coefficient_times_regressor_has_the_dimension_of_the_output(effect: Effect, sensor: Sensor) -> None:
    sensed = "" if effect.group == "bias" else OUTPUT[sensor]
    squared = f"{OUTPUT[sensor]}*{OUTPUT[sensor]}"
    driven = squared if effect.name == "cross_coupling" else DRIVEN_BY.get(effect.name, "")
    factors = [effect.units[sensor], driven, sensed]
    factors.sort(key=lambda factor: factor.endswith(")"))  # where the grammar takes parentheses
    product = "*".join(factor for factor in factors if factor not in ("", "1"))
    assert dimension_of(product.replace("*/", "/")) == dimension_of(OUTPUT[sensor])


@every_effect
@settings(deadline=None, max_examples=10)
@given(seed=seeds)
def test_regressors_are_finite_with_one_column_a_term(effect: Effect, sensor: Sensor, seed: int) -> None:
    regressors = effect.regressors(sensor, random_conditions(np.random.default_rng(seed), 7))
    assert regressors.shape == (7, 3, len(effect.terms(sensor)))
    assert regressors.dtype == np.float64
    assert np.isfinite(regressors).all()


@every_effect
def test_a_term_acts_on_the_channel_that_its_name_begins_with(effect: Effect, sensor: Sensor) -> None:
    random = random_conditions(np.random.default_rng(1), 2000)
    level = one(force=(9.8, 0.0, 0.0))  # the only condition in which north is known
    regressors = np.concatenate([effect.regressors(sensor, c) for c in (random, level)])
    for column, term in enumerate(effect.terms(sensor)):
        others = [channel for channel, axis in enumerate(AXES) if axis != term.name[0]]
        assert np.all(regressors[:, others, column] == 0.0) != (effect.name in SHARED)
        assert np.any(regressors[:, :, column] != 0.0)


@every_effect
@settings(deadline=None, max_examples=10)
@given(seed=seeds)
def test_rows_know_nothing_of_each_other(effect: Effect, sensor: Sensor, seed: int) -> None:
    if effect.name in HISTORY:
        return
    rng = np.random.default_rng(seed)
    conditions, rows = random_conditions(rng, 9), rng.permutation(9)[:5]
    whole = effect.regressors(sensor, conditions)
    np.testing.assert_array_equal(effect.regressors(sensor, select(conditions, rows)), whole[rows])


@every_effect
def test_no_rows_and_the_conditions_left_as_they_were(effect: Effect, sensor: Sensor) -> None:
    conditions = random_conditions(np.random.default_rng(2), 4)
    before = select(conditions, np.arange(4))
    effect.regressors(sensor, conditions)[:] = 7.0  # the answer is the caller's own
    for name in Conditions.__dataclass_fields__:
        np.testing.assert_array_equal(getattr(conditions, name), getattr(before, name))
    assert len(effect.regressors(sensor, select(conditions, np.arange(0)))) == 0


@every_effect
def test_scale_factors_and_misalignments_add_nothing_at_zero_input(effect: Effect, sensor: Sensor) -> None:
    sensed_zero = {"rate" if sensor == "gyro" else "specific_force": np.zeros((6, 3))}
    random = random_conditions(np.random.default_rng(3), 6)
    fields = {name: getattr(random, name) for name in Conditions.__dataclass_fields__}
    regressors = effect.regressors(sensor, Conditions(**(fields | sensed_zero)))
    powers = (effect.name, sensor) in POWERS
    assert np.all(regressors == 0.0) == (effect.group != "bias" or powers)


SCALE_FACTORS = [(effect, sensor) for effect, sensor in CASES if effect.group == "scale_factor"]


@pytest.mark.parametrize(("effect", "sensor"), SCALE_FACTORS)
def test_a_scale_factor_is_a_relative_error_of_its_own_channel(effect: Effect, sensor: Sensor) -> None:
    conditions = random_conditions(np.random.default_rng(4), 30)
    sensed = conditions.rate if sensor == "gyro" else conditions.specific_force
    regressors = effect.regressors(sensor, conditions)
    relative = np.diagonal(regressors, axis1=1, axis2=2) / sensed
    assert np.isfinite(relative).all()
    small = one(rate=tuple(1e-9 * conditions.rate[0]), force=tuple(1e-9 * conditions.specific_force[0]))
    assert np.abs(effect.regressors(sensor, small)).max() <= 1e-9 * np.abs(sensed[0]).max() * 1.0001


@every_effect
def test_ten_thousand_instants_are_one_call(effect: Effect, sensor: Sensor) -> None:
    """A loop over instants would call functions for each; seconds are in benchmarks/bench_start.py."""
    before, few, many = (random_conditions(np.random.default_rng(5), n) for n in (100, 100, 10_000))
    effect.regressors(sensor, before)  # imports are no work of its own; answers stay with their conditions
    assert calls(lambda: effect.regressors(sensor, many)) == calls(lambda: effect.regressors(sensor, few))
