"""A claim must be as sure by the calibration's fit as by the search: 95 % is little among a hundred names."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.channels.prepared import prepared
from planner.diagnose.dwells_to_diagnosis import UNSURE, told_from_zero
from planner.diagnose.findings.declared_and_found import ChannelEstimates, Together, declared_and_found
from planner.diagnose.findings.sure_by_the_fit import chance_by_the_fit
from planner.diagnose.hypotheses.found import ALPHA
from planner.diagnose.search.sensor import begin
from planner.nouns.dwell_table import DwellTable
from planner.protocols import Sensor
from tests.diagnose.found import found_effect
from tests.diagnose.hall import Hall, Noise, axes_apart, days, hidden, read
from tests.diagnose.worlds import DECLARED, spec

ASYMMETRY = "scale_factor_asymmetry"


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_square_of_one_coefficient_is_that_of_its_t(seed: int) -> None:
    hall, axis = days(seed, 16), seed % 3
    table = hidden(read(hall, seed), "gyro", axis, 1e-5 * np.abs(hall.rate[:, axis]))
    fit = declared_and_found(table, spec(), "gyro", [ASYMMETRY], [axis])[axis]
    c, together = fit.terms[ASYMMETRY, "xyz"[axis]], fit.together[ASYMMETRY]
    assert together.rank == 1
    assert together.square == pytest.approx((c.value / c.standard_error) ** 2, rel=1e-9)
    assert together.freedom == pytest.approx(c.freedom)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_of_several_coefficients_all_are_asked_together(seed: int) -> None:
    """No combination of them is surer than all together, and one alone is not as sure."""
    hall, axis = days(seed, 16), seed % 3
    warmer = (hall.temperature - 20.0)[:, None] * hall.up
    table = hidden(read(hall, seed), "gyro", axis, warmer @ np.array([2e-5, -3e-5, 1e-5]))
    fit = declared_and_found(table, spec(), "gyro", ["g_sensitivity_temperature"], [axis])[axis]
    each = [(c.value / c.standard_error) ** 2 for c in fit.terms.values()]
    together = fit.together["g_sensitivity_temperature"]
    assert together.rank == 3
    assert max(each) < together.square


def test_a_size_that_goes_with_a_time_constant_is_not_asked() -> None:
    hall = days(1, 16)
    table = hidden(read(hall, 1), "gyro", 0, 5e-3 * np.exp(-hall.time_on / 200.0))
    fit = declared_and_found(table, spec(), "gyro", ["warm_up"], [0])[0]
    assert "warm_up" not in fit.together


def test_a_hundred_names_ask_more_than_an_interval() -> None:
    """At 3.5 sigma one of a hundred names is there by chance once in twenty campaigns; at six it is not."""
    begun = begin(prepared(read(axes_apart(1), 1)), "gyro", DECLARED)
    b = next(i for i, x in enumerate(begun.pool.blocks) if x.key == (ASYMMETRY, (0,)))

    def chance(sigma: float, freedom: float = 200.0) -> float:
        told = ChannelEstimates({}, {}, (), {ASYMMETRY: Together(sigma**2, 1, freedom)})
        return chance_by_the_fit(begun.pool, {0: told}, b)

    assert chance(2.4) > chance(3.5) > ALPHA > chance(6.0) > 0.0
    assert chance(3.5, np.inf) > ALPHA > chance(6.0) > chance(6.0, np.inf) > 0.0  # spreads of the spec
    assert chance_by_the_fit(begun.pool, {1: ChannelEstimates({}, {}, ())}, b) == 0.0


@pytest.mark.parametrize(("sensor", "name"), [("gyro", "g_sensitivity"), ("accelerometer", "lever_arm")])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_one_coefficient_is_as_sure_as_it_is_known_itself(seed: int, sensor: Sensor, name: str) -> None:
    """Another one known by six power-ons made 9.8 sigma of it no surer than chance; nothing stays nothing.

    Whether or not the search takes each of them for the only one there may be: a lever arm of 30 sigma.
    """
    begun = begin(prepared(read(axes_apart(seed), seed)), sensor, DECLARED)
    b = next(i for i, x in enumerate(begun.pool.blocks) if x.name == name and 0 in x.columns)
    assert begun.pool.blocks[b].apart == (name == "g_sensitivity")

    def chance(sigma: float, freedom: float) -> float:
        each = ((sigma**2, freedom), (1.0, 5.7), (0.1, 200.0))
        told = Together(sigma**2 + 1.1, 3, min(f for _, f in each), each)
        return chance_by_the_fit(begun.pool, {0: ChannelEstimates({}, {}, (), {name: told})}, b)

    assert chance(9.8, 26.0) < ALPHA < chance(3.5, 200.0)
    assert chance(9.8, 5.7) > ALPHA  # badly known itself


def test_what_the_fit_is_not_sure_of_is_no_name() -> None:
    sure = found_effect("misalignment_temperature", "accelerometer_z", -3.1e-7, 2.5e-7)
    assert told_from_zero([sure])[0] == [sure]
    stands, falls, rest = told_from_zero([replace(sure, chance_by_fit=0.2)])
    assert not stands
    assert [(r.effect, r.why) for r in falls] == [("misalignment_temperature", UNSURE)]
    assert not rest


def _one_way_each(seed: int, power_ons: int) -> tuple[DwellTable, int]:
    """An asymmetry of a gyro that power-ons turn one way each, each with a scale factor of its own."""
    hall, axis = days(seed, power_ons), seed % 3
    kept = (hall.turn[:, axis] == 0.0) | ((hall.turn[:, axis] > 0.0) == (hall.run % 2 == 0))
    hall = Hall(*(x[kept] for x in vars(replace(hall, temperature=np.full(len(kept), 20.0))).values()))
    table = read(hall, seed, gyro=Noise(4e-4, 1e-3, scale=2e-5))
    return hidden(table, "gyro", axis, 3e-3 * np.abs(hall.turn[:, axis])), axis


@pytest.mark.parametrize("seed", [721, 722, 723])
def test_what_few_power_ons_tell_is_asked_by_thrice_the_budgets_too(seed: int) -> None:
    """By one degree of freedom 71 sigma were no surer than chance among a hundred names."""
    table, axis = _one_way_each(seed, 4)
    told = declared_and_found(table, spec(), "gyro", [ASYMMETRY], [axis])[axis].together[ASYMMETRY]
    assert told.freedom < 8.0
    assert told.budgeted > 0.0
    begun = begin(prepared(read(axes_apart(1), 1)), "gyro", DECLARED)
    b = next(i for i, x in enumerate(begun.pool.blocks) if x.key == (ASYMMETRY, (axis,)))

    def chance(one: Together) -> float:
        return chance_by_the_fit(begun.pool, {axis: ChannelEstimates({}, {}, (), {ASYMMETRY: one})}, b)

    assert chance(told) < ALPHA
    assert chance(replace(told, square=71.0**2, freedom=1.1, budgeted=0.0)) > ALPHA
    assert chance(replace(told, square=9.0, freedom=1.1, budgeted=9.0)) > ALPHA
    table, axis = _one_way_each(seed, 24)
    many = declared_and_found(table, spec(), "gyro", [ASYMMETRY], [axis])[axis].together[ASYMMETRY]
    assert many.budgeted == 0.0  # they tell the spread themselves


def test_nothing_is_asked_by_budgets_that_the_spec_does_not_have() -> None:
    table, axis = _one_way_each(721, 4)
    unit = spec().unit
    scale = unit.gyro["scale_factor"].model_copy(update={"run_to_run": None})
    gyro = {**unit.gyro, "scale_factor": scale}
    bare = spec().model_copy(update={"unit": unit.model_copy(update={"gyro": gyro})})
    told = declared_and_found(table, bare, "gyro", [ASYMMETRY], [axis])[axis].together[ASYMMETRY]
    assert told.freedom < 8.0
    assert told.budgeted == 0.0
