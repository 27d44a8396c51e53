"""Faults put into the planner's code alone: verify, which shares none of it, must say broken each time."""

from __future__ import annotations

import copy
from dataclasses import replace

import numpy as np
import pytest

import planner.calibrate.apply_calibration
import planner.plan.errors_to_points as points
import planner.plan.records_to_spread as spread
import planner.plan.spec_to_errors as errors
import planner.plan.spec_to_sensitivity as sensitivity
from planner.pipelines.promise import FlightOptions, verify
from tests.specs import loaded
from tests.verify.plans import Planned, plan_of, planned_from, sealed_again, several


def by_hand() -> dict:
    """Every part of a promise matters: a spread from records, a curve, directions, a percentile."""
    spec = several()
    fixed = {
        "static": {"temperatures": 3, "repeats": 4},
        "rates": {"temperatures": 1, "repeats": 2},
    }
    wide = [
        r | {"limit": limit}
        for r, limit in zip(spec["requirement"], ["900 m", "5 deg", "50 m/s"], strict=True)
    ]
    return spec | {
        "name": "by hand",
        "requirement": wide,
        "plan": spec["plan"] | {"fixed": fixed, "method": "published"},
    }


def verified(one: Planned, flights: int = 0, files: int = 0):
    options = FlightOptions(flights=flights, through_files=files)
    return verify(one.loaded, one.document, options, lambda message: None)


def faulty_checks(one: Planned) -> set[str]:
    return {f.check for f in verified(one).recount.faults}


@pytest.fixture(scope="module", name="sound")
def _sound() -> Planned:
    return planned_from(by_hand())


def test_without_a_fault_nothing_is_found(sound):
    assert not faulty_checks(sound)


def test_run_to_run_set_to_zero(monkeypatch):
    whole = errors.error_models
    monkeypatch.setattr(errors, "_run_to_run", lambda budget: ((float("nan"), 0.0),))
    assert all(model.largest_run_to_run == 0.0 for model in whole(loaded(several()).spec))
    assert {"allowances", "repeats"} <= faulty_checks(planned_from(by_hand()))


def test_the_curve_halved(monkeypatch):
    whole = points.residual_at
    monkeypatch.setattr(points, "residual_at", lambda *asked: 0.5 * whole(*asked))
    assert "allowances" in faulty_checks(planned_from(by_hand()))


@pytest.mark.parametrize("dropped", ["drift", "noise", "draws of other errors"])
def test_a_part_of_the_covariance_of_a_repeat_dropped(monkeypatch, dropped):
    whole = spread.covariances

    def fewer(records, x, run, drift, white):
        run, drift = run * (dropped != "draws of other errors"), drift * [dropped != "drift", True]
        return whole(records, x, run, drift, 0.0 if dropped == "noise" else white)

    spec = by_hand()
    spec["unit"]["noise"] = {"gyro": "0.5 deg/sqrt(h)", "accelerometer": "1 mg/sqrt(Hz)"}
    # one face, so that the scale factor's draw stands in the bias, where six faces would cancel it
    spec["tests"]["static"]["motions"] = [{"position_1": "0 deg", "position_2": "0 deg"}] * 2
    spec["unit"]["accelerometer"]["scale_factor"] = {"systematic": "0.1 %", "run_to_run": "0.05 %"}
    assert not faulty_checks(planned_from(spec))
    monkeypatch.setattr(spread, "covariances", fewer)
    assert {"repeats", "allowances"} <= faulty_checks(planned_from(spec))


def test_drift_that_forgets_nothing_between_the_records(monkeypatch):
    """The cross-covariance of the records of one power-on."""
    whole = spread.covariances

    def uncorrelated(records, x, run, drift, white):
        V, U = whole(records, x, run, drift, white)
        return np.diag(np.diag(V)), U

    monkeypatch.setattr(spread, "covariances", uncorrelated)
    assert {"repeats", "allowances"} <= faulty_checks(planned_from(by_hand()))


@pytest.mark.parametrize("what", ["no tilt by gyro bias", "two per mille too little"])
def test_error_equations_that_are_wrong(monkeypatch, what):
    whole = sensitivity.propagate_errors

    def wrong(motion, forcing, **how):
        history = whole(motion, forcing, **how)
        if what == "no tilt by gyro bias":
            position = history.position.copy()
            position[:, :, :3] = 0.0
            return replace(history, position=position)
        return replace(history, position=0.998 * history.position)

    monkeypatch.setattr(sensitivity, "propagate_errors", wrong)
    assert {"requirements", "sensitivities"} & faulty_checks(planned_from(by_hand()))


@pytest.mark.parametrize("gone", ["static", "rates"])
def test_a_test_dropped_from_the_steps(gone):
    whole = plan_of("flown")
    document = copy.deepcopy(whole.document)
    document["steps"] = [s for s in document["steps"] if s["test"] != gone]
    one = replace(whole, document=sealed_again(document))
    found = verified(one, flights=2)  # that it flies at all: what is wrong is found by the recount
    assert found.verdict == "broken"
    assert {"steps", "sums"} <= {f.check for f in found.recount.faults}


@pytest.mark.parametrize("fault", ["scale factor 1 % off", "bias of the wrong sign", "tables upside down"])
def test_a_correction_that_is_wrong_is_found_through_files(monkeypatch, fault):
    """What the fast route never sees: the exported coefficients and `planner apply`."""
    flying = plan_of("flown")  # a worst case: nothing of its flights has to be foreseen for that
    whole = planner.calibrate.apply_calibration.corrected

    def wrong(table, tables):
        changed = {}
        for sensor, t in tables.items():
            if fault == "scale factor 1 % off":
                changed[sensor] = replace(t, scale=t.scale + 0.01)
            elif fault == "bias of the wrong sign":
                changed[sensor] = replace(t, bias=-t.bias)
            else:
                changed[sensor] = replace(t, bias=t.bias[:, ::-1])
        return whole(table, changed)

    monkeypatch.setattr(planner.calibrate.apply_calibration, "corrected", wrong)
    found = verified(flying, flights=2, files=1)
    assert found.verdict == "broken"
    assert "calibrate and verify's own estimator disagree" in str(found.files.faults[0])


def test_sound_units_go_through_files():
    one = plan_of("flown")
    found = verified(one, flights=2, files=2).files
    assert found.ok, found.faults
    assert len(found.checks) == 2 * len(one.loaded.spec.requirement)


def test_a_calibration_that_refuses_the_plans_table_is_a_fault(monkeypatch):
    from planner.errors import InputError
    from planner.pipelines import data

    def refuse(*asked):
        raise InputError("no such column")

    monkeypatch.setattr(data, "calibrate", refuse)
    found = verified(plan_of("flown"), flights=2, files=1)
    assert found.verdict == "broken"
    assert "refuses it: no such column" in str(found.files.faults[0])
