"""What the records of one repeat add to the spread of a coefficient: closed forms and laws."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.nouns.allowances import ErrorModel
from planner.plan.confidence import spread_at
from planner.plan.spec_to_errors import error_models
from planner.spec.budget import IN_RUN_TIME_S
from planner.spec.load import load_spec
from planner.units import STANDARD_GRAVITY_MPS2 as G
from planner.verify.recount_spread import spreads_of_records
from tests.specs import SHIPPED, loaded, small

MILLI_G = 1e-3 * G
TAU = IN_RUN_TIME_S


def six_faces(drift: str = "", noise: str = "", **test: Any) -> dict[str, Any]:
    """Accelerometer bias and scale factor from six rests, under Student's quantile."""
    spec = small()
    bias = {"systematic": "20 mg", "run_to_run": "1 mg"} | ({"in_run": drift} if drift else {})
    unit: dict[str, Any] = {
        "accelerometer": {"bias": bias, "scale_factor": {"systematic": "0.5 %", "run_to_run": "0.01 %"}}
    }
    if noise:
        unit["noise"] = {"accelerometer": noise}
    bench = spec["benches"]["rate_table"] | {"axes": 2, "move": "5 s"}
    static = {
        "bench": "rate_table",
        "calibrates": ["accelerometer.bias", "accelerometer.scale_factor"],
        "motions": 6,
        "record": "60 s",
        "power_on": "30 s",
    }
    return spec | {
        "sensitivities": "simulated",
        "unit": unit,
        "effects": ["bias", "scale_factor"],
        "benches": {"rate_table": bench},
        "tests": {"static": static | test},
        "plan": spec["plan"] | {"quantile": "student"},
    }


def within(spec: dict[str, Any], test: str = "static") -> dict[str, float]:
    return {m.name: m.within[test] for m in error_models(loaded(spec).spec) if test in m.within}


def test_without_drift_and_noise_it_is_the_published_spread() -> None:
    for model in error_models(loaded(six_faces()).spec):
        assert spread_at(model, [20.0], "static")[0] == pytest.approx(spread_at(model, [20.0])[0], rel=1e-9)


def test_a_scale_factor_is_half_the_difference_of_two_faces_between_which_the_bias_drifts() -> None:
    # κ = (y₊ − y₋) / 2g:  s² = 2 σ² (1 − ρ) / 4g², faces one after the other
    rho = np.exp(-65.0 / TAU)
    wanted = 0.5 * MILLI_G * np.sqrt((1.0 - rho) / 2.0) / G
    assert within(six_faces("0.5 mg"))["accelerometer.scale_factor"] == pytest.approx(wanted, rel=1e-9)


def test_a_bias_is_the_mean_of_a_drift_that_hardly_moves_between_the_records() -> None:
    times = 65.0 * np.arange(6)
    kept = np.exp(-np.abs(times[:, None] - times[None, :]) / TAU)
    wanted = 0.5 * MILLI_G * np.sqrt(kept.mean())
    found = within(six_faces("0.5 mg"))["accelerometer.bias"]
    assert found == pytest.approx(wanted, rel=1e-9)
    assert 0.8 < found / (0.5 * MILLI_G) < 1.0  # not a sixth of its square: six records see one drift


def test_noise_falls_with_the_root_of_the_time_recorded() -> None:
    found = within(six_faces(noise="0.2 mg/sqrt(Hz)"))
    assert found["accelerometer.bias"] == pytest.approx(0.2 * MILLI_G / np.sqrt(6 * 60.0), rel=1e-9)
    assert found["accelerometer.scale_factor"] == pytest.approx(
        0.2 * MILLI_G / np.sqrt(2 * 60.0) / G, rel=1e-9
    )


def test_drift_and_noise_add_in_squares() -> None:
    both = within(six_faces("0.5 mg", "0.2 mg/sqrt(Hz)"))
    alone = [within(six_faces("0.5 mg")), within(six_faces(noise="0.2 mg/sqrt(Hz)"))]
    for error, value in both.items():
        assert value == pytest.approx(np.hypot(*(one[error] for one in alone)), rel=1e-6)


@settings(deadline=None, max_examples=15)
@given(factor=st.floats(0.1, 10.0), drift=st.floats(0.1, 2.0), noise=st.floats(0.05, 2.0))
def test_all_sigmas_together_scale_the_spread(factor: float, drift: float, noise: float) -> None:
    one = within(six_faces(f"{drift} mg", f"{noise} mg/sqrt(Hz)"))
    spec = six_faces(f"{drift * factor} mg", f"{noise * factor} mg/sqrt(Hz)")
    for error, value in within(spec).items():
        assert value == pytest.approx(factor * one[error], rel=1e-6)  # weights differ by a floor of 1e-10


@settings(deadline=None, max_examples=15)
@given(drift=st.floats(0.1, 2.0), more=st.floats(1.0, 5.0), noise=st.floats(0.01, 1.0))
def test_more_drift_never_narrows(drift: float, more: float, noise: float) -> None:
    less = within(six_faces(f"{drift} mg", f"{noise} mg/sqrt(Hz)"))
    for error, value in within(six_faces(f"{drift * more} mg", f"{noise} mg/sqrt(Hz)")).items():
        assert value >= less[error] * (1 - 1e-9)


def test_the_published_quantile_takes_the_published_spread() -> None:
    spec = six_faces("0.5 mg", "0.2 mg/sqrt(Hz)")
    spec["plan"] = spec["plan"] | {"quantile": "normal"}
    assert within(spec) == {}


def test_published_coefficients_let_the_best_axis_stand_for_all() -> None:
    one_face = {"motions": 1, "calibrates": ["accelerometer.bias"]}
    spec = six_faces("0.5 mg", **one_face)
    given_too = spec | {"sensitivities": {"given": {"accelerometer.bias": "311 m/g"}}}
    # x and y lie level and feel the bias alone; z is at 1 g, where the scale factor's spread of this power-on
    # and that of its own estimate go with it
    assert within(given_too)["accelerometer.bias"] == pytest.approx(0.5 * MILLI_G, rel=1e-6)
    tilted = np.hypot(0.5 * MILLI_G, np.sqrt(2.0) * 1e-4 * G)
    assert within(spec)["accelerometer.bias"] == pytest.approx(tilted, rel=1e-6)


@pytest.mark.parametrize("name", sorted(path.stem for path in SHIPPED.glob("*.yaml")))
def test_the_recount_finds_the_same_spread_by_another_way(name: str) -> None:
    spec = load_spec(SHIPPED / f"{name}.yaml").spec
    counted = spreads_of_records(spec)
    models: tuple[ErrorModel, ...] = error_models(spec)
    planned = {(m.name, test): sigma for m in models for test, sigma in m.within.items()}
    assert planned.keys() == counted.keys()
    for key, sigma in planned.items():
        # run-to-run is added in squares: what is a millionth of it does not count
        largest = next(m.largest_run_to_run for m in models if m.name == key[0])
        assert counted[key] == pytest.approx(sigma, rel=1e-7, abs=1e-6 * largest), key


@pytest.mark.parametrize("lead", ["0 s", "90 s", "4 min"])
def test_the_recount_has_the_clock_of_a_ramp(lead: str) -> None:
    """Between two records on a ramp the chamber goes on for the lead of both: drift goes on as long."""
    spec = six_faces("0.5 mg", "0.05 m/s/sqrt(h)", temperature={"ramp": "1 K/min", "lead": lead})
    spec["requirement"] = [{"error": "position", "limit": "100 m", "rule": "rss"}]
    counted, planned = spreads_of_records(loaded(spec).spec), within(spec)
    assert {error: counted[error, "static"] for error in planned} == pytest.approx(planned, rel=1e-7)
    slower, soaked = planned["accelerometer.bias"], within(six_faces("0.5 mg", "0.05 m/s/sqrt(h)"))
    assert lead == "0 s" or slower < soaked["accelerometer.bias"]
