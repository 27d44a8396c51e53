"""A budget says the same of every form in which it may be written."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.spec.budget import IN_RUN_TIME_S, ErrorBudget
from planner.spec.flight_temperature import TemperatureShares
from planner.spec.temperature_residual import CURVE_NAMES, CurveName
from planner.units import STANDARD_GRAVITY_MPS2
from tests.spec.example import changed, faults, loaded

MG = 1e-3 * STANDARD_GRAVITY_MPS2
TABLE = {"20 degC": "1 mg", "-55 degC": "3 mg"}


def budget(**parts: object) -> ErrorBudget:
    return ErrorBudget.model_validate(parts)


def test_an_empty_budget_has_nothing() -> None:
    b = budget()
    assert (b.systematic_size, b.in_run_sigma, b.storage_sigma, b.run_to_run_largest) == (0.0,) * 4
    assert (b.has_run_to_run, b.run_to_run_table, b.temperature_correlation) == (False, None, None)
    assert (b.residual_table, b.measured_curve, b.whole_variation) == (None, None, 0.0)
    assert not b.run_to_run_sigma(np.array([[0.0], [20.0]])).any()


@pytest.mark.parametrize(
    ("written", "time"),
    [
        ("2 mg", IN_RUN_TIME_S),
        ({"value": "2 mg"}, 600.0),
        ({"value": "2 mg", "correlation_time": "2 h"}, 7200.0),
    ],
)
def test_in_run_in_every_form(written: object, time: float) -> None:
    b = budget(in_run=written)
    assert b.in_run_sigma == pytest.approx(2 * MG)
    assert b.in_run_time == time


@pytest.mark.parametrize("length", [None, "40 K"])
@pytest.mark.parametrize("value", ["2 mg", TABLE])
def test_run_to_run_in_every_form(value: object, length: str | None) -> None:
    parts = {"value": value, **({} if length is None else {"temperature_correlation": length})}
    for b in (budget(run_to_run=parts), *([budget(run_to_run=value)] if length is None else [])):
        assert b.has_run_to_run
        assert b.temperature_correlation == (None if length is None else 40.0)
        at = b.run_to_run_sigma(np.array([-90.0, -55.0, -17.5, 20.0, 80.0])) / MG
        np.testing.assert_allclose(at, [3, 3, 2, 1, 1] if value is TABLE else [2] * 5, rtol=1e-12)
        assert b.run_to_run_largest == pytest.approx((3 if value is TABLE else 2) * MG)
        assert [*(b.run_to_run_table or {})] == ([-55.0, 20.0] if value is TABLE else [])


@given(st.lists(st.floats(-80.0, 90.0), min_size=1, max_size=5))
def test_no_spread_is_more_than_the_largest(degc: list[float]) -> None:
    b = budget(run_to_run={"value": TABLE, "temperature_correlation": "10 K"})
    sigma = b.run_to_run_sigma(np.array(degc))
    assert sigma.shape == (len(degc),)
    assert (sigma <= b.run_to_run_largest * (1 + 1e-12)).all()


@pytest.mark.parametrize("figure", [None, "largest", "sigma"])
def test_a_residual_table_says_what_its_numbers_are(figure: str | None) -> None:
    written = {5: "1 mg", 1: "4 mg", **({} if figure is None else {"figure": figure})}
    b = budget(systematic="3 mg", temperature_residual=written)
    assert b.residual_figure == (figure or "largest")
    assert b.residual_table == pytest.approx({1: 4 * MG, 5: MG})
    assert [*(b.residual_table or {})] == [1, 5]
    assert b.measured_curve is None
    assert b.whole_variation == pytest.approx(4 * MG)


def test_a_measured_curve_comes_in_order_and_is_no_table() -> None:
    b = budget(systematic="3 mg", temperature_residual={"curve": {"20 degC": "-5 mg", "-10 degC": "1 mg"}})
    assert b.measured_curve is not None
    np.testing.assert_array_equal(b.measured_curve.temperatures_degc, [-10.0, 20.0])
    np.testing.assert_allclose(b.measured_curve.values, [MG, -5 * MG])
    assert (b.residual_table, b.residual_figure) == (None, "largest")
    assert b.whole_variation == pytest.approx(5 * MG)


@pytest.mark.parametrize("name", [None, *CURVE_NAMES])
def test_a_table_may_name_the_family_of_its_curves(name: CurveName | None) -> None:
    b = budget(temperature_residual={1: "4 mg", 5: "1 mg", **({} if name is None else {"curve": name})})
    assert b.curve_family_name == name
    assert [*(b.residual_table or {})] == [1, 5]
    assert (b.measured_curve, b.measured_curves) == (None, ())


def test_curves_of_several_units_are_no_curve_of_one_and_no_table() -> None:
    written = [{"20 degC": f"{-k} mg", "-10 degC": "1 mg"} for k in (1, 7, 2)]
    b = budget(systematic="3 mg", temperature_residual={"curve": written})
    assert [one.values.tolist() for one in b.measured_curves] == [
        pytest.approx([MG, -k * MG]) for k in (1, 7, 2)
    ]
    assert (b.residual_table, b.measured_curve, b.curve_family_name) == (None, None, None)
    assert b.whole_variation == pytest.approx(7 * MG)


@pytest.mark.parametrize("value", ["2 mg", TABLE])
def test_a_spread_may_be_an_estimate(value: object) -> None:
    b = budget(run_to_run={"value": value, "power_ons": 12})
    assert (b.power_ons, b.temperature_correlation) == (12, None)
    assert budget(run_to_run={"value": value}).power_ons is None
    assert budget(run_to_run=value).power_ons is None
    assert b.run_to_run_largest == budget(run_to_run=value).run_to_run_largest


# ---------------------------------------------------------------- in a spec

AT_THE_END = "  fixed: {gyro_drift: {temperatures: 15, repeats: 15}}\n"


def test_what_a_spec_leaves_out_is_sixty_days_and_perfect() -> None:
    spec = loaded(changed()).spec
    assert (spec.flown_after, spec.flown_after_days) == (60 * 86400.0, 60.0)
    assert spec.initial_alignment is None
    assert set(spec.benches["rate_table"].accuracy.model_dump().values()) == {0.0}


def test_what_a_spec_leaves_out_is_planned_by_information_and_flies_anywhere() -> None:
    spec = loaded(changed()).spec
    plan = spec.plan
    assert (plan.method, plan.temperature_estimator, plan.redundancy) == ("information", "lines", 1)
    assert plan.temperatures.step == 5.0
    assert [r.temperature for r in spec.requirement] == ["range"]


def test_the_keys_of_the_method_are_read() -> None:
    keys = "method: published\n  temperature_estimator: lines\n  redundancy: 0\n  confidence: 90 %"
    spec = loaded(changed(("confidence: 95 %", keys), ("candidates: [1,", "step: 2 K, candidates: [1,"))).spec
    plan = spec.plan
    assert (plan.method, plan.temperature_estimator, plan.redundancy) == ("published", "lines", 0)
    assert plan.temperatures.step == 2.0


@pytest.mark.parametrize("word", ["range", "worst", "flight"])
def test_where_the_flights_start_is_a_word(word: str) -> None:
    spec = loaded(changed(("worst_case}", f"rss, temperature: {word}}}"))).spec
    assert spec.requirement[0].temperature == word


@given(st.dictionaries(st.integers(-60, 60), st.floats(0.01, 100.0), min_size=1, max_size=5))
def test_weights_of_temperatures_are_shares(weights: dict[int, float]) -> None:
    found = TemperatureShares.model_validate({"distribution": {f"{t} degC": w for t, w in weights.items()}})
    assert found.temperatures_degc.tolist() == sorted(weights)
    assert found.shares.sum() == pytest.approx(1.0)
    np.testing.assert_allclose(
        found.shares * sum(weights.values()), [weights[t] for t in sorted(weights)], rtol=1e-12
    )


def test_a_spec_says_when_and_how_it_flies_and_how_well_its_bench_is_known() -> None:
    end = "flown_after: 10 d\ninitial_alignment: {roll_pitch: 0.05 deg, heading: 0.5 deg}\n"
    known = "    accuracy: {level: 0.01 deg, mounting: 20 arcsec, rate: 20 ppm, temperature: 0.1 K}\n"
    text = changed((AT_THE_END, AT_THE_END + end), ("    axes: 2\n", "    axes: 2\n" + known))
    found = loaded(text)
    spec = found.spec
    assert spec.flown_after_days == pytest.approx(10.0)
    assert spec.initial_alignment is not None
    assert np.degrees(spec.initial_alignment.roll_pitch) == pytest.approx(0.05)
    assert np.degrees(spec.initial_alignment.heading) == pytest.approx(0.5)
    accuracy = spec.benches["rate_table"].accuracy
    assert np.degrees(accuracy.level) == pytest.approx(0.01)
    assert np.degrees(accuracy.mounting) * 3600 == pytest.approx(20.0)
    assert (accuracy.rate, accuracy.temperature) == (pytest.approx(2e-5), pytest.approx(0.1))
    assert not [w for w in found.warnings if "accuracy" in w.path]


def test_a_rate_that_nothing_turns_at_is_a_remark() -> None:
    text = changed(("  centrifuge: {", "  centrifuge: {accuracy: {rate: 20 ppm}, "))
    (remark,) = [w for w in loaded(text).warnings if "accuracy" in w.path]
    assert remark.path == "benches.centrifuge.accuracy.rate"
    assert "turns" in remark.message


@pytest.mark.parametrize(
    ("budget", "why"),
    [
        (
            "scale_factor: {systematic: 0.5 %, run_to_run: 20 ppm}",
            "unit.accelerometer.scale_factor has it already",
        ),
        ("misalignment: {systematic: 0.5 deg}", "scale_factor is fitted, and has it"),
    ],
)
def test_what_changes_over_temperature_has_the_budget_of_what_changes(budget: str, why: str) -> None:
    """A declared scale factor has a table, with a budget of its own or without one."""
    own = "scale_factor: {systematic: 0.5 %, run_to_run: 20 ppm}"
    beside = f"{budget}\n    scale_factor_temperature: {{systematic: 10 ppm/K}}"
    by_chance = ("limit: 10 m, rule: worst_case", "limit: 900 m, rule: {percentile: 95 %}")
    (fault,) = faults(changed((own, beside), by_chance))
    assert (fault.code, fault.path) == ("P314", "unit.accelerometer.scale_factor_temperature")
    assert fault.message.startswith(why)
    assert "unit.accelerometer.scale_factor.temperature_residual" in fault.message


def test_an_error_of_the_bench_is_none_of_the_units() -> None:
    own = "scale_factor: {systematic: 0.5 %, run_to_run: 20 ppm}"
    (fault,) = faults(changed((own, f"{own}\n    lever_arm: {{systematic: 1 cm}}")))
    assert (fault.code, fault.path) == ("P315", "unit.accelerometer.lever_arm")
    assert "effects: [lever_arm, …]" in fault.message
