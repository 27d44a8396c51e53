"""Effects that change with temperature by their own equation: promised and flown as warm as flights start."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest

from planner.physics.error_dynamics import errors_at
from planner.plan.flight_response import FlightResponse
from planner.verify.beside import NOTHING
from planner.verify.experiment import flown_with
from planner.verify.flight_columns import columns_of
from planner.verify.monte_carlo import fly
from planner.verify.outcome import outcomes
from planner.verify.prediction import Prediction
from planner.verify.starts import anywhere
from planner.verify.workers import here
from tests.verify.plans import Planned, planned_from
from tests.verify.test_recount_promise import by_hand, faults, faults_in, prediction

FLIGHTS = 1500  # a 95 % quantile is known to 2 %, one sigma
NAMES = ("g_sensitivity_temperature", "drift_curve_over_temperature", "misalignment_temperature")


def warm() -> dict[str, Any]:
    """g-sensitivity per kelvin, zero at the 20 degC of the trajectory, large where flights start."""
    gyro = by_hand()["unit"]["gyro"]
    own = {"systematic": "0.02 deg/s/g/K", "run_to_run": "0.0004 deg/s/g/K"}
    spec = by_hand(gyro=gyro | {"g_sensitivity_temperature": own})
    static = spec["tests"]["static"]
    asked = [*static["calibrates"], "gyro.g_sensitivity_temperature"]
    tests = spec["tests"] | {"static": static | {"calibrates": asked}}
    return spec | {"effects": [*spec["effects"], "g_sensitivity_temperature"], "tests": tests}


@pytest.fixture(scope="module", name="one")
def _one() -> Planned:
    return planned_from(warm())


@pytest.fixture(scope="module", name="foreseen")
def _foreseen(one: Planned) -> Prediction:
    """By verify's code, which no patch here touches: found once for all tests."""
    return prediction(one)


def test_both_models_count_them(one, foreseen):
    assert not faults_in(one.document, foreseen)
    without = planned_from(by_hand())
    larger, smaller = (max(f["0"] for f in p.document["families"].values()) for p in (one, without))
    assert larger > 1.05 * smaller


def test_they_are_flown_as_foreseen(one, foreseen):
    p = foreseen
    flown = flown_with(p.e, anywhere(p.e.spec), "kink")
    tally = fly(flown, FLIGHTS, here, lambda message: None).tally
    for o in outcomes(flown, tally, one.document, p.e.spec):
        assert p.drawn(o.index, "kink", flown.starts) == pytest.approx(o.at_promise, rel=0.06)


def test_a_planner_that_flies_them_at_the_trajectorys_temperature_is_found_out(one, foreseen, monkeypatch):
    def cold(self: FlightResponse, along: Any, instants: Any, components: slice) -> Any:
        return self.errors[list(instants)][None, :, components]

    monkeypatch.setattr(FlightResponse, "started", cold)
    forgetful = planned_from(warm())
    assert forgetful.document["steps"] == one.document["steps"]
    assert faults_in(forgetful.document, foreseen)


@pytest.mark.parametrize("effect", NAMES)
def test_columns_at_a_start_are_those_of_a_flight_which_is_so_warm(one, effect):
    assert one.trajectory is not None
    flight, at = one.trajectory, np.array([0.0, float(one.trajectory.time_s[-1])])
    made = partial(columns_of, errors=[("gyro", effect)], moments=at, beside=NOTHING)
    ours = made(flight, range_degc=(-37.0, 62.0))
    for degc in (-37.0, -21.5, 20.0, 60.0):
        own = made(replace(flight, temperature_degc=np.full_like(flight.temperature_degc, degc)))
        found, wanted = (
            c.at(c.responses(end_of(c), "gyro", effect), effect, np.full(2, degc)) for c in (ours, own)
        )
        np.testing.assert_allclose(found, wanted, atol=1e-9 * max(float(np.abs(wanted).max()), 1.0))


def end_of(columns: Any) -> Any:
    """(3, p) position at the end that every column adds."""
    t = columns.trajectory
    return errors_at(t, columns.forcing, columns.active, columns.count, [float(t.time_s[-1])]).position[0]


def test_a_flight_from_outside_the_range_counts_at_its_end_in_both():
    """No budget describes curves out there: continued, they are whatever the last step of a drawn one is."""
    spec = warm()
    spec["plan"]["temperatures"] = spec["plan"]["temperatures"] | {"range": ["-40 degC", "60 degC"]}
    shares = {"distribution": {"-60 degC": 1, "20 degC": 1}}
    spec["requirement"] = [r | {"temperature": shares} for r in spec["requirement"]]
    assert not faults(planned_from(spec))
