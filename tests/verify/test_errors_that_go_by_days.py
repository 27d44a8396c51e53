"""Ageing and a step of the bias are in flight what they have become on its day: planned, recounted, flown."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import planner.information.model_of
from planner.information.model_of import Flight, flight_of
from tests.verify.plans import Planned, assert_flown_as_foreseen, planned_from
from tests.verify.test_recount_promise import by_hand, faults_in, prediction

FLIGHTS = 1500  # a root of a mean square is known to 2 %, one sigma


def by_days(flown_after: str, **beside: Any) -> dict[str, Any]:
    """Neither is declared, for no campaign tells them; power-ons a day apart.

    Required are roots of mean squares: they are drawn evenly, and quantiles are promised as if by Gauss.
    """
    spec = by_hand()
    squares = [wanted | {"rule": "rss"} for wanted in spec["requirement"]]
    unit = spec["unit"]
    gyro = unit["gyro"] | {
        "bias_step": {"systematic": "0.004 deg/s"},
        "ageing": {"systematic": "0.0003 deg/s/day"},
    }
    tests = {name: test | {"cool_down": "1 day"} for name, test in spec["tests"].items()}
    return (
        spec
        | {"flown_after": flown_after, "unit": unit | {"gyro": gyro}, "tests": tests, "requirement": squares}
        | beside
    )


@pytest.fixture(scope="module", name="soon")
def _soon() -> Planned:
    """Flown so soon that the days of the campaign count, before the step's."""
    return planned_from(by_days("3 day"))


@pytest.fixture(scope="module", name="late")
def _late() -> Planned:
    return planned_from(by_days("40 day"))


def shares(one: Planned) -> dict[str, float]:
    found: dict[str, float] = one.document["requirements"][0]["shares"]
    return found


def test_a_share_of_the_promise_is_theirs_from_their_day_on(soon, late):
    assert shares(soon)["gyro.bias_step"] == 0.0 < shares(soon)["gyro.ageing"]
    assert shares(late)["gyro.bias_step"] > 0.0


@pytest.mark.parametrize("name", ["soon", "late"])
def test_they_are_counted_again_and_flown_as_foreseen(name, request):
    one = request.getfixturevalue(name)
    foreseen = prediction(one)
    assert not faults_in(one.document, foreseen)
    assert_flown_as_foreseen(one, foreseen, FLIGHTS, 0.06)


def test_a_planner_that_flies_on_the_day_of_the_calibration_is_found_out(late, monkeypatch):
    monkeypatch.setattr(planner.information.model_of, "on_its_day", lambda trajectory, *_: trajectory)
    monkeypatch.setattr(Flight, "after", lambda flight, span_days: flight)
    forgetful = planned_from(by_days("40 day"))
    assert forgetful.document["steps"] == late.document["steps"]
    assert faults_in(forgetful.document, prediction(late))


def test_a_planner_that_forgets_the_days_of_the_campaign_is_found_out(soon, monkeypatch):
    monkeypatch.setattr(Flight, "after", lambda flight, span_days: flight)
    forgetful = planned_from(by_days("3 day"))
    assert forgetful.document["steps"] == soon.document["steps"]
    assert faults_in(forgetful.document, prediction(soon))


@pytest.mark.parametrize(("span", "days"), [(0.0, 40.0), (7.5, 47.5)])
def test_ageing_in_flight_is_a_bias_of_as_many_days(late, span, days):
    """The response to ageing is that to a bias times the flight's day, eq. y_i += k_i · day."""
    flight = flight_of(late.loaded.spec, late.trajectory).after(span)
    errors = flight.response.errors  # (m, 9, K, F)
    of = {
        name: [i for i, f in enumerate(flight.response.flying) if str(f.error) == f"gyro.{name}"]
        for name in ("bias", "ageing", "bias_step")
    }
    bias, ageing, step = (errors[:, :, of[name]].sum(axis=2) for name in of)
    np.testing.assert_allclose(ageing, 86400.0 * days * bias, rtol=1e-9, atol=1e-9 * np.abs(ageing).max())
    np.testing.assert_allclose(step, bias, rtol=1e-9, atol=1e-9 * np.abs(step).max())


def test_a_flight_that_says_its_day_is_flown_on_it(late):
    said = by_days("40 day", trajectory=late.loaded.spec.trajectory | {"day": "20 day"})
    one = planned_from(said)
    assert shares(one)["gyro.bias_step"] == 0.0 < shares(one)["gyro.ageing"]
    assert not faults_in(one.document, prediction(one))
