"""Errors that the unit has and no effect is declared for: they lead the estimates of the others astray."""

from __future__ import annotations

from typing import Any

import pytest
import yaml

import planner.campaign.noise
import planner.information.kinds
from planner.pipelines.promise import FlightOptions, verify
from planner.verify.prediction import Prediction
from tests.specs import SHIPPED
from tests.verify.plans import Planned, assert_flown_as_foreseen, planned_from
from tests.verify.test_recount_promise import by_hand, faults, faults_in, prediction

FLIGHTS = 1500  # a 95 % quantile is known to 2 %, one sigma


def undeclared() -> dict[str, Any]:
    """g-sensitivity (a constant, a curve, draws of power-ons) and nonlinearity beside scale factor.

    The curve is small: verify knows a quantile that curves alone make to some 2 %, by 4000 of them.
    """
    unit = by_hand()["unit"]
    beside = {
        "g_sensitivity": {
            "systematic": "0.03 deg/s/g",
            "run_to_run": "0.01 deg/s/g",
            "temperature_residual": {1: "0.02 deg/s/g", 3: "0.006 deg/s/g", 5: "0.002 deg/s/g"},
        },
        "scale_factor_nonlinearity": {"systematic": "4 %", "run_to_run": "0.5 %"},
    }
    return by_hand(gyro=unit["gyro"] | beside)


@pytest.fixture(scope="module", name="one")
def _one() -> Planned:
    return planned_from(undeclared())


@pytest.fixture(scope="module", name="foreseen")
def _foreseen(one: Planned) -> Prediction:
    """By verify's code, which no patch here touches: found once for all tests."""
    return prediction(one)


def test_both_models_count_them(one, foreseen):
    assert not faults_in(one.document, foreseen)


def test_they_are_flown_as_foreseen(one, foreseen):
    assert_flown_as_foreseen(one, foreseen, FLIGHTS, 0.06)


@pytest.mark.parametrize(
    ("module", "name"),
    [
        (planner.information.kinds, "_lead_astray"),  # constants and curves
        (planner.campaign.noise, "unfitted_columns"),  # draws of power-ons
    ],
)
def test_a_planner_that_forgets_them_is_found_out(one, foreseen, module, name, monkeypatch):
    monkeypatch.setattr(module, name, lambda *_: {})
    forgetful = planned_from(undeclared())
    assert forgetful.document["steps"] == one.document["steps"]
    assert faults_in(forgetful.document, foreseen)


@pytest.mark.parametrize("name", ["tactical"])
@pytest.mark.further("name", ["consumer", "industrial"])
def test_the_specs_from_data_sheets_promise_what_is_counted_again(name):
    """They budget for nonlinearity and g-sensitivity, and declare neither. The campaign is fixed by hand."""
    spec = yaml.safe_load((SHIPPED / "from_datasheets" / f"{name}.yaml").read_text())
    spec["plan"]["fixed"] = {
        "static": {"temperatures": 4, "repeats": 2},
        "rates": {"temperatures": 7, "repeats": 2},
    }
    assert not faults(planned_from(spec))


@pytest.mark.parametrize("name", ["consumer"])
@pytest.mark.further("name", ["industrial", "tactical"])
def test_what_calibrate_makes_of_their_records_is_what_was_promised(name):
    """Calibrate took the misfit as noise of records: estimates were 119 and 191 m apart where 38 may be."""
    spec = yaml.safe_load((SHIPPED / "from_datasheets" / f"{name}.yaml").read_text())
    spec["plan"]["fixed"] = {"rates": {"temperatures": 8, "repeats": 2}}
    one = planned_from(spec)
    found = verify(one.loaded, one.document, FlightOptions(flights=8, through_files=2), lambda said: None)
    assert found.files.ok, found.files.faults
    assert max(c.apart / c.may for c in found.files.checks) < 0.2
