"""What an undeclared effect costs in flight: the linear combination, and what the declared model takes up."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from planner.diagnose.diagnosis_to_navigation import _taken_up, navigation_costs
from planner.diagnose.diagnosis_to_residual import unit_fits
from planner.measurement import evaluate
from planner.nouns.diagnosis import UnitDiagnosis
from planner.plan.spec_to_sensitivity import conditions_of, sensitivities
from planner.plan.spec_to_trajectory import trajectory_of
from planner.spec.load import load_spec
from tests.calibrate.world import Layout, campaign
from tests.diagnose.found import found_effect
from tests.specs import SHIPPED

SPEC = load_spec(SHIPPED / "small_uav_worst_case.yaml").spec
LAYOUT = Layout(temperatures=(-40.0, 20.0, 60.0), rate_temperatures=(20.0,), later=())
TABLE = campaign(1, (), LAYOUT)
FLIGHT = trajectory_of(SPEC.trajectory, Path())
VALUE = 1e-5


def cost(*effects, spec=SPEC):
    found = UnitDiagnosis("u1", "explained", effects, (), (), (), (), ())
    (only, *_) = navigation_costs(effects, unit_fits(TABLE, SPEC, found), spec, FLIGHT)
    return only


def test_it_is_the_column_of_planner_sensitivity_times_the_coefficients():
    effect = found_effect("g_sensitivity", "gyro_y", VALUE, 0.1 * VALUE)
    columns = sensitivities(FLIGHT, ["gyro.g_sensitivity"])
    mine = [i for i, c in enumerate(columns.columns) if c.axis.startswith("y")]
    vectors = columns.position[-1][:, mine]
    found = cost(effect)
    assert found.before == pytest.approx(np.linalg.norm(vectors.sum(axis=1)) * VALUE, rel=1e-9)
    assert found.after == pytest.approx(np.linalg.norm(vectors, axis=0).sum() * 0.1 * VALUE, rel=1e-9)
    assert found.error == "position"
    assert found.limit == 300.0


def test_twice_the_coefficients_cost_twice_and_half_the_interval_leaves_half():
    once = cost(found_effect("g_sensitivity", "gyro_x", VALUE, 0.2 * VALUE))
    twice = cost(found_effect("g_sensitivity", "gyro_x", 2 * VALUE, 0.1 * VALUE))
    assert twice.before == pytest.approx(2 * once.before)
    assert twice.after == pytest.approx(0.5 * once.after)


def test_effects_on_two_channels_add_as_vectors():
    one, other = (found_effect("g_sensitivity", f"gyro_{a}", VALUE, 1e-7) for a in "xz")
    first, second, both = cost(one), cost(other), cost(one, other)
    assert both.before <= first.before + second.before + 1e-9
    assert both.after == pytest.approx(first.after + second.after)


def test_a_stricter_confidence_leaves_more_of_the_same_interval():
    effect = found_effect("g_sensitivity", "gyro_x", VALUE, 0.2 * VALUE)
    strict = SPEC.model_copy(update={"plan": SPEC.plan.model_copy(update={"confidence": 0.99})})
    # two-sided Student quantiles with 60 degrees of freedom: 2.660 / 2.000
    assert cost(effect, spec=strict).after / cost(effect).after == pytest.approx(2.6603 / 2.0003, rel=1e-3)


def test_no_effect_costs_nothing():
    assert (
        navigation_costs((), unit_fits(TABLE, SPEC, UnitDiagnosis("u", "clean", *[()] * 6)), SPEC, FLIGHT)
        == ()
    )


@pytest.mark.parametrize("effect", ["g_squared_sensitivity", "scale_factor_nonlinearity", "warm_up"])
def test_what_the_declared_model_takes_up_is_the_change_of_its_fit(effect):
    """Oracle: fit the table with and without the effect in it; the predictions in flight differ by that."""
    found = found_effect(effect, "gyro_z", 1e-4 if effect != "g_squared_sensitivity" else 1e-6, 1e-9)
    value = found.terms[0].value
    fits = unit_fits(TABLE, SPEC, UnitDiagnosis("u1", "explained", (found,), (), (), (), (), ()))
    (channel,) = [c for c in fits.channels if c.channel == "gyro_z"]
    J, v = channel.before.J, channel.before.v
    column = column_of(effect)(TABLE.conditions())
    with_it = fits.table.gyro[:, 2] + value * column_of(effect)(fits.table.conditions())
    assert np.any(column)
    # the two fits, same weights: one step of Gauss-Newton from one to the other
    white = v.whiten(np.column_stack([J, with_it - fits.table.gyro[:, 2]]))
    delta = np.linalg.lstsq(white[:, :-1], white[:, -1], rcond=None)[0]
    flight = conditions_of(FLIGHT, 0, 200)
    model = replace(channel.before.model, conditions=flight)
    moved = (
        evaluate(model, channel.before.theta + delta).predicted
        - evaluate(model, channel.before.theta).predicted
    )
    taken = _taken_up(
        found, lambda c: np.column_stack([np.zeros((len(c.day), 2)), column_of(effect)(c)]), fits
    )
    # products of scale factor and misalignment are second order: 1e-2 of the change at most
    np.testing.assert_allclose(value * taken(flight)[:, 2], moved, rtol=0.02, atol=1e-3 * np.abs(moved).max())


def column_of(effect: str):
    from planner import catalog

    known = catalog.effects()[effect]
    index = [t.name for t in known.terms("gyro")].index("z")
    return lambda conditions: known.regressors("gyro", conditions)[:, 2, index]


def test_an_uncertain_time_constant_leaves_something_even_with_a_sure_coefficient():
    from planner.nouns.diagnosis import FoundTerm

    sure = found_effect("warm_up", "gyro_x", 1e-4, 0.0, {"time_constant": 600.0})
    tau = FoundTerm("time_constant", "gyro_x", 600.0, 300.0, 900.0, 60.0, "s", parameter=True)
    vague = replace(sure, terms=(*sure.terms, tau))
    assert cost(sure).after == pytest.approx(0.0, abs=1e-12)
    assert cost(vague).after > 0.0
    assert cost(vague).before == pytest.approx(cost(sure).before)


def test_every_requirement_has_an_entry_in_their_order():
    spec = load_spec(SHIPPED / "helicopter.yaml").spec
    effect = found_effect("g_squared_sensitivity", "gyro_x", 1e-6, 1e-7)
    fits = unit_fits(TABLE, SPEC, UnitDiagnosis("u1", "explained", (effect,), (), (), (), (), ()))
    flight = trajectory_of(spec.trajectory, Path())
    found = navigation_costs((effect,), fits, spec, flight)
    assert [c.error for c in found] == [r.error for r in spec.requirement]
    assert [c.limit for c in found] == [r.limit.si for r in spec.requirement]


def test_what_changes_with_temperature_costs_what_it_does_where_flights_start():
    """(T − 20 °C) k: nothing at the 20 °C of the trajectory, 75 times k per kelvin where the range begins."""
    spec = load_spec(SHIPPED / "helicopter.yaml").spec
    flight = trajectory_of(spec.trajectory, Path())
    effect = found_effect("g_sensitivity_temperature", "gyro_y", VALUE / 75.0, 1e-9)
    plain = found_effect("g_sensitivity", "gyro_y", VALUE, 1e-7)
    nowhere = spec.model_copy(
        update={
            "requirement": tuple(r.model_copy(update={"temperature": "flight"}) for r in spec.requirement)
        }
    )

    def costs(one, spec):
        fits = unit_fits(TABLE, SPEC, UnitDiagnosis("u1", "explained", (one,), (), (), (), (), ()))
        return [c.before for c in navigation_costs((one,), fits, spec, flight)]

    assert costs(effect, spec) == pytest.approx(costs(plain, spec), rel=1e-9)
    assert costs(effect, nowhere) == pytest.approx([0.0, 0.0], abs=1e-9)


def test_a_percentile_of_what_is_left_is_that_of_random_coefficients():
    """Oracle: draw the coefficients from their intervals and count."""
    spec = load_spec(SHIPPED / "tactical_leg.yaml").spec
    effect = found_effect("g_sensitivity", "gyro_y", VALUE, 1e-6)
    fits = unit_fits(TABLE, SPEC, UnitDiagnosis("u1", "explained", (effect,), (), (), (), (), ()))
    flight = trajectory_of(spec.trajectory, Path())
    (found,) = navigation_costs((effect,), fits, spec, flight)
    columns = sensitivities(flight, ["gyro.g_sensitivity"])
    mine = [i for i, c in enumerate(columns.columns) if c.axis.startswith("y")]
    draws = np.random.default_rng(1).normal(scale=1e-6 / 1.96, size=(200_000, 3))
    length = np.linalg.norm(draws @ columns.position[-1][:2, mine].T, axis=1)
    # 200 000 draws know the quantile to 0.4 %
    assert found.after == pytest.approx(np.quantile(length, 0.9), rel=0.02)


def test_an_effect_that_the_flight_does_not_excite_costs_nothing_and_that_is_said():
    found = cost(found_effect("temperature_rate", "gyro_x", 1e-3, 1e-5))
    assert found.before == 0.0
    assert "nothing on this flight excites" in found.how


def test_ageing_is_flown_on_the_last_day_of_the_data():
    found = cost(found_effect("ageing", "gyro_x", 1e-11, 1e-13))
    bias = sensitivities(FLIGHT, ["gyro.bias"])
    seconds = float(TABLE.day.max()) * 86_400.0
    assert found.before == pytest.approx(np.linalg.norm(bias.position[-1][:, 0]) * 1e-11 * seconds, rel=1e-9)
    assert "last day of the data" in found.how
