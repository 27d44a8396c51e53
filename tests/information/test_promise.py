"""The promise against units drawn one by one, fitted by dense least squares and flown (brute_force)."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from planner.information.exact import Foreseen, foreseen, laid_out
from planner.information.model_of import Flight
from tests.information import cases
from tests.information.brute_force import Fleet
from tests.information.cases import Everything, Tree, visits

UNITS = 2000  # an rms is then known to 1-2 %, a quantile to 2 %; curves by 2000 on the other side add 1.6 %
REQUIREMENTS: tuple[Tree, ...] = (
    {"error": "position", "rule": {"percentile": "95 %"}, "temperature": "range"},
    {"error": "horizontal", "rule": "rss", "temperature": "worst"},
    {"error": "north", "rule": {"percentile": "80 %"}, "temperature": "flight", "at": "30 s"},
    {
        "error": "horizontal",
        "rule": {"percentile": "90 %"},
        "temperature": {"distribution": {"-15 degC": 1, "30 degC": 2}},
        "at": "any",
    },
    {"error": "up", "rule": "rss", "temperature": {"distribution": {"35 degC": 1}}},
    {"error": "position", "rule": "rss", "temperature": "range", "at": "any"},
)


def tree(trajectory: str, **more: object) -> Tree:
    """Every kind of spread at once; tables of biases and of the accelerometers' scale factor."""
    gyro = {
        "bias": {
            "systematic": "0.05 deg/s",
            "run_to_run": {"-20 degC": "0.003 deg/s", "40 degC": "0.001 deg/s"},
            "in_run": {"value": "0.001 deg/s", "correlation_time": "200 s"},
            "storage": "0.002 deg/s",
            "temperature_residual": {1: "0.02 deg/s", 3: "0.008 deg/s", 5: "0.004 deg/s"},
        },
        "scale_factor": {"systematic": "0.5 %", "run_to_run": "0.05 %"},
        "g_sensitivity": {"systematic": "0.001 deg/s/g", "run_to_run": "0.0005 deg/s/g"},
    }
    accelerometer = {
        "bias": {
            "systematic": "20 mg",
            "run_to_run": "1 mg",
            "in_run": "0.5 mg",
            "storage": "1 mg",
            "temperature_residual": {1: "15 mg", 3: "5 mg", 5: "2.5 mg"},
        },
        "scale_factor": {
            "systematic": "0.5 %",
            "run_to_run": "0.05 %",
            "temperature_residual": {1: "0.2 %", 3: "0.1 %", 5: "0.05 %"},
        },
    }
    chamber = {"range": ["-60 degC", "80 degC"], "heating": "4 K/min", "cooling": "2 K/min", "soak": "30 min"}
    faces = ["gyro.bias", "gyro.g_sensitivity", "accelerometer.bias", "accelerometer.scale_factor"]
    timed = {"bench": "rate_table", "motions": 6, "power_on": "30 s"}
    return {
        "planner": 1,
        "name": "flown",
        "trajectory": cases.TRAJECTORIES[trajectory],
        "requirement": [r | {"limit": "1000000 m"} for r in REQUIREMENTS],
        "unit": {
            "noise": {"gyro": "0.1 deg/sqrt(h)", "accelerometer": "0.05 m/s/sqrt(h)"},
            "gyro": gyro,
            "accelerometer": accelerometer,
        },
        "effects": ["bias", "bias_temperature", "scale_factor", "scale_factor_temperature", "g_sensitivity"],
        "benches": {"rate_table": {"axes": 2, "install": "30 min", "chamber": chamber}},
        "tests": {
            "static": {**timed, "calibrates": faces, "record": "60 s", "cool_down": "10 min"},
            "rates": {**timed, "calibrates": ["gyro.scale_factor"], "record": "20 s", "cool_down": "1 min"},
        },
        "plan": {
            "temperatures": {"range": ["-20 degC", "40 degC"], "step": "10 K"},
            "repeats": {"least": 1, "most": 5},
        },
    } | more


CAMPAIGN = visits(("static", (-20.0, 10.0, 30.0), (2, 2, 1)), ("rates", (10.0,), (2,)))


@cache
def promised(trajectory: str) -> tuple[Flight, Foreseen]:
    flight = cases.flight(tree(trajectory))
    return flight, foreseen(flight, laid_out(flight, CAMPAIGN))


def flown(flight: Flight, family: str, seed: int = 1) -> list[float]:
    fleet = Fleet(
        flight.spec, flight.response, laid_out(flight, CAMPAIGN), family, UNITS, np.random.default_rng(seed)
    )
    return [fleet.figure(wanted) for wanted in flight.spec.requirement]


@pytest.mark.parametrize(
    ("trajectory", "family"),
    [("warming", "kink")],
)
@pytest.mark.further(("trajectory", "family"), [("turn", "cubic"), ("level", "cosines")])
def test_what_is_promised_is_what_flies(trajectory: str, family: str) -> None:
    flight, found = promised(trajectory)
    np.testing.assert_allclose(found.families[family], flown(flight, family), rtol=0.05)


@pytest.mark.parametrize("family", ["kink"])
@pytest.mark.further("family", ["cubic"])
def test_a_thermometer_that_errs_misreads_the_curves(family: str) -> None:
    """2 K off: every unknown curve is read that much further on, on all records of a bench alike.

    By the slope of the curve: of waves that are hardly longer than the offset it would be up to 10 % wrong.
    """
    benches = tree("level")["benches"]
    bench = benches["rate_table"] | {"accuracy": {"temperature": "2 K"}}
    flight = cases.flight(tree("level", benches={"rate_table": bench}))
    found = foreseen(flight, laid_out(flight, CAMPAIGN))
    np.testing.assert_allclose(found.families[family], flown(flight, family), rtol=0.05)
    _, right = promised("level")
    assert np.all(np.array(found.families[family]) > 1.015 * np.array(right.families[family]))
    every = Everything(flight)
    quick = every.promise.figures(cases.counts_of(every.offers, CAMPAIGN)[None])[0]
    np.testing.assert_allclose(quick, found.promise.figures(found.counts)[0], rtol=0.01)


def test_the_search_and_the_promise_see_the_same_flights() -> None:
    """The quick figure of a campaign of half a day, sixty days before the flight, is the exact one to 1 %.

    By second moments, as the search sees curves; what drawn curves make of a quantile comes on top.
    """
    flight, found = promised("warming")
    every = Everything(flight)
    quick = every.promise.figures(cases.counts_of(every.offers, CAMPAIGN)[None])[0]
    np.testing.assert_allclose(quick, found.promise.figures(found.counts)[0], rtol=0.01)
    np.testing.assert_allclose(quick, found.figures, rtol=0.1)


def test_the_largest_over_the_families_is_the_promise() -> None:
    _, found = promised("level")
    every = np.array([*found.families.values()])
    np.testing.assert_array_equal(found.largest, every.max(axis=0))
    names = [*found.families]
    assert [found.binding(k) for k in range(len(REQUIREMENTS))] == [names[i] for i in every.argmax(axis=0)]


def test_a_campaign_that_does_not_tell_what_flies_promises_nothing() -> None:
    """One face a power-on: nobody tells bias from scale factor."""
    tests = tree("level")["tests"]
    one = tests | {"drift": tests["static"] | {"motions": 1, "calibrates": ["gyro.bias"]}}
    flight = cases.flight(tree("level", tests=one))
    found = foreseen(flight, laid_out(flight, visits(("drift", (-20.0, 10.0), (2, 2)))))
    assert np.all(np.isinf(found.largest))
