"""What a plan by information promises, counted again: agreement, edits, and faults in the planner's code."""

from __future__ import annotations

import copy
from dataclasses import replace
from itertools import chain
from typing import Any

import numpy as np
import pytest
import yaml

import planner.campaign.noise
import planner.information.curves
import planner.information.model_of
import planner.information.promise
import planner.information.seen
from planner.information import in_flight, told
from planner.information.model_of import flight_of
from planner.pipelines import planning
from planner.pipelines.promise import FlightOptions, verify
from planner.spec.starter import starter_text
from planner.verify.experiment import experiment, flown_with
from planner.verify.monte_carlo import fly
from planner.verify.outcome import outcomes
from planner.verify.prediction import Prediction
from planner.verify.recount_promise import (
    _check_allowances,
    _check_covariance,
    as_planned,
    check_promise,
)
from planner.verify.starts import anywhere
from planner.verify.workers import here
from tests.verify.plans import Planned, planned_from, sealed_again, several


def by_hand(**unit: Any) -> dict[str, Any]:
    """Every part of a promise matters: drift, curves between nodes, power-ons, the walk, directions."""
    spec = several()
    fixed = {"static": {"temperatures": 3, "repeats": 2}, "rates": {"temperatures": 1, "repeats": 2}}
    limits = ["900 m", "5 deg"]
    wide = [r | {"limit": limit} for r, limit in zip(spec["requirement"], limits, strict=False)]
    plan = spec["plan"] | {"fixed": fixed, "method": "information"}
    return spec | {"name": "by hand", "requirement": wide, "plan": plan, "unit": spec["unit"] | unit}


def prediction(one: Planned) -> Prediction:
    return as_planned(experiment(one.document, one.loaded.spec, one.trajectory, seed=1))


def faults(one: Planned) -> list[str]:
    """Checks of the promise that find one."""
    return faults_in(one.document, prediction(one))


def faults_by(sound: Planned, foreseen: Prediction) -> list[str]:
    """The same of a plan made by the planner's code as it is patched now.

    Its steps are fixed by hand, so what is foreseen of the sound plan is foreseen of it: verify's code, which
    no patch here touches, has found those figures once.
    """
    one = planned_from(by_hand())
    assert one.document["steps"] == sound.document["steps"]
    return faults_in(one.document, foreseen)


def faults_in(document: dict[str, Any], foreseen: Prediction) -> list[str]:
    return [fault.where for f in check_promise(document, foreseen) for fault in f.faults]


@pytest.fixture(scope="module", name="sound")
def _sound() -> Planned:
    return planned_from(by_hand())


@pytest.fixture(scope="module", name="foreseen")
def _foreseen(sound: Planned) -> Prediction:
    """Of the sound plan's steps, which no edit below touches: its figures are found once for all edits."""
    return prediction(sound)


def test_a_plan_as_planner_wrote_it_agrees(sound):
    """Another, at any moment and at temperatures of all kinds, in tests/verify/test_recount.py."""
    assert sound.document["method"] == "information"
    options = FlightOptions(flights=0, through_files=0)
    found = verify(sound.loaded, sound.document, options, lambda message: None)
    assert found.recount.ok, found.recount.faults[:5]
    assert {"promise", "allowances", "shares"} <= {c.name for c in found.recount.checks}


def test_references_that_err_and_noise_are_in_both(sound):
    """A mounting is one and the same for all records of an installation; no number of repeats averages it."""
    spec = by_hand(noise={"gyro": "3 deg/sqrt(h)", "accelerometer": "5 mg/sqrt(Hz)"})
    bench = spec["benches"]["rate_table"]
    accuracy = {"level": "0.2 deg", "mounting": "0.1 deg", "rate": "0.1 %"}
    spec["benches"] = {"rate_table": bench | {"accuracy": accuracy}}
    one = planned_from(spec)
    assert not faults(one)
    larger, smaller = (p.document["families"]["kink"]["0"] for p in (one, sound))
    assert larger > 1.02 * smaller


def test_what_a_thermometer_that_errs_makes_of_the_curves_is_in_both(monkeypatch):
    """A chamber 2 K off reads every unknown curve 2 K further on; no number of repeats averages it."""
    spec = by_hand()
    bench = spec["benches"]["rate_table"]
    spec["benches"] = {"rate_table": bench | {"accuracy": {"temperature": "2 K"}}}
    one = planned_from(spec)
    foreseen = prediction(one)
    assert not faults_in(one.document, foreseen)
    monkeypatch.setattr(planner.information.model_of, "misread_of", lambda *asked: None)
    found = faults_in(planned_from(spec).document, foreseen)
    assert {"families, cosines, requirement 0", "allowances, gyro.bias, estimate"} <= {*found}


def test_a_table_that_errs_in_rate_loads_no_accelerometer():
    """Of part of a turn gravity's mean across the axis is left; it goes with no square of the rate."""
    spec = yaml.safe_load(starter_text())
    spec["benches"]["rate_table"]["accuracy"] = {"rate": "20 ppm"}
    at = ["-50 degC", "0 degC", "50 degC"]
    spec["plan"]["fixed"] = {"rates": {"temperatures": at, "repeats": 2}}
    spec["requirement"][0]["limit"] = "300 m"
    del spec["tests"]["static"]
    assert not faults(planned_from(spec))


def test_a_tilted_table_loads_what_turns_about_a_level_axis():
    """Gravity along the axis stays in the mean of a turn; it had been left out of what is promised."""
    spec = yaml.safe_load(starter_text())
    spec["benches"]["rate_table"]["accuracy"] = {"level": "0.05 deg"}
    at = {"temperatures": ["-50 degC", "0 degC", "50 degC"], "repeats": 2}
    spec["plan"]["fixed"] = {"rates": at, "static": at}
    spec["requirement"][0]["limit"] = "300 m"
    assert not faults(planned_from(spec))


@pytest.mark.parametrize("inner", [35])
@pytest.mark.further("inner", [25, 45])
def test_parts_at_the_worst_temperature_are_means_over_the_range(inner):
    """Tables that reach beyond their nodes err most at the ends, which are not a 41st of the range each."""
    spec = by_hand()
    spec["requirement"] = [spec["requirement"][0] | {"temperature": "worst", "at": "end"}]
    static = {"temperatures": [f"{-inner} degC", "0 degC", f"{inner} degC"], "repeats": 2}
    spec["plan"] = spec["plan"] | {"fixed": spec["plan"]["fixed"] | {"static": static}}
    one = planned_from(spec)
    foreseen = prediction(one)
    checks = [_check_allowances(one.document, foreseen), _check_covariance(one.document, foreseen)]
    assert not [fault for found in checks for fault in found.faults]


ALIGNED = ({"roll_pitch": "0.5 deg", "heading": "3 deg"}, {"self_aligned": True, "heading": "3 deg"})


@pytest.mark.parametrize("alignment", ALIGNED, ids=["given", "self-aligned"])
def test_the_initial_attitude_is_in_both(sound, alignment, monkeypatch):
    """Given, it adds; self-aligned, its tilt takes back part of what the accelerometers do in a minute."""
    one = planned_from(by_hand() | {"initial_alignment": alignment})
    foreseen = prediction(one)
    assert not faults_in(one.document, foreseen)
    with_it, without = (p.document["families"]["kink"]["0"] for p in (one, sound))
    assert (with_it > 1.02 * without) == ("roll_pitch" in alignment)
    assert abs(with_it / without - 1.0) > 0.02

    def perfect(spec, trajectory, deadline=None):
        return flight_of(spec.model_copy(update={"initial_alignment": None}), trajectory, deadline)

    monkeypatch.setattr(planning, "flight_of", perfect)
    assert faults_in(planned_from(by_hand() | {"initial_alignment": alignment}).document, foreseen)


def test_what_is_foreseen_is_flown(sound, foreseen):
    """1500 flights: a 95 % quantile is known to 2 %, one sigma, a root mean square to 1.5 %."""
    p, e = foreseen, foreseen.e
    for family in ("kink", "matern"):
        flown = flown_with(e, anywhere(e.spec), family)
        tally = fly(flown, 1500, here, lambda message: None)
        for o in outcomes(flown, tally.tally, sound.document, e.spec):
            assert p.drawn(o.index, family, flown.starts) == pytest.approx(o.at_promise, rel=0.06)
            assert p.figures(o.index, flown.starts, (family,))[family] == pytest.approx(
                o.at_promise, rel=0.06
            )


# ---------------------------------------------------------------- edits


def edited(one: Planned, change, foreseen: Prediction) -> list[str]:
    document = copy.deepcopy(one.document)
    change(document)
    return faults_in(sealed_again(document), foreseen)


def _figure(d):
    d["families"]["kink"]["0"] *= 0.97


def _families_swapped(d):
    d["families"]["cubic"], d["families"]["cosines"] = d["families"]["cosines"], d["families"]["cubic"]


def _another_binds(d):
    own = {name: figures["0"] for name, figures in d["families"].items()}
    d["requirements"][0]["family"] = min(own, key=own.get)


def _achieved(d):
    d["requirements"][0]["achieved"] *= 0.99


def _elsewhere(d):
    d["requirements"][1]["temperature"] = "flight"


def _one_family_less(d):
    del d["families"]["matern"]


def _part(d):
    d["allowances"]["gyro.bias"]["parts"]["temperature"] *= 0.9


def _allowed(d):
    d["allowances"]["gyro.bias"]["allowed"] *= 1.001


def _share(d):
    d["requirements"][0]["shares"]["gyro.bias"] *= 1.3


@pytest.mark.parametrize(
    ("change", "where"),
    [
        (_figure, "families, kink, requirement 0"),
        (_families_swapped, "families, cubic, requirement 0"),
        (_another_binds, "requirements 0, family"),
        (_achieved, "requirements 0, achieved"),
        (_elsewhere, "requirements 1, temperature"),
        (_one_family_less, "families"),
        (_part, "allowances, gyro.bias, temperature"),
        (_allowed, "allowances, gyro.bias, allowed"),
        (_share, "requirements 0, shares, gyro.bias"),
    ],
)
def test_an_edit_is_found_where_it_is(sound, foreseen, change, where):
    assert where in edited(sound, change, foreseen)


# ---------------------------------------------------------------- faults in the planner's code alone


def test_no_power_on_of_the_flights_own(sound, foreseen, monkeypatch):
    whole = in_flight.drawn_in_flight
    monkeypatch.setattr(in_flight, "drawn_in_flight", lambda *asked: (whole(*asked)[0], None))
    assert "families, kink, requirement 0" in faults_by(sound, foreseen)


def test_no_run_to_run_in_the_campaign(sound, foreseen, monkeypatch):
    whole = planner.campaign.noise._from_spec

    def quiet(c, *asked):
        return 0.0 if c.kind == "run_to_run" else whole(c, *asked)

    monkeypatch.setattr(planner.campaign.noise, "_from_spec", quiet)
    assert "allowances, accelerometer.bias, estimate" in faults_by(sound, foreseen)


def test_drift_that_is_left_out(monkeypatch):
    whole = planner.campaign.noise._from_spec

    def still(c, *asked):
        return 0.0 if c.kind == "in_run" else whole(c, *asked)

    monkeypatch.setattr(planner.campaign.noise, "_from_spec", still)
    spec = by_hand()
    spec["unit"]["gyro"]["bias"] |= {"in_run": "0.006 deg/s", "run_to_run": "0.0005 deg/s"}
    assert "allowances, gyro.bias, estimate" in faults(planned_from(spec))


def test_the_curve_halved(sound, foreseen, monkeypatch):
    curves = planner.information.curves.Curves
    moment, seen = curves._moment, curves._seen
    monkeypatch.setattr(curves, "_moment", lambda self, *asked: 0.25 * moment(self, *asked))
    assert "families, kink, requirement 1" in faults_by(sound, foreseen)
    monkeypatch.setattr(curves, "_moment", moment)
    monkeypatch.setattr(curves, "_seen", lambda self, *asked: 0.5 * seen(self, *asked))
    found = faults_by(sound, foreseen)
    assert {f"families, {name}, requirement 0" for name in ("cosines", "kink", "cubic", "matern")} <= {*found}


def test_what_curve_and_tables_have_in_common_dropped(sound, foreseen, monkeypatch):
    """The estimate follows the unit's own curve: without that cross-covariance the curve counts twice."""

    def alone(self, found, R, i, families):
        S, rho = R.shape[2], R.shape[3]
        return np.zeros((R.shape[1], len(families), S, rho, rho))

    monkeypatch.setattr(planner.information.seen.Seen, "_across", alone)
    assert "families, kink, requirement 1" in faults_by(sound, foreseen)


def test_the_curve_in_flight_dropped_from_what_is_drawn(sound, foreseen, monkeypatch):
    """Then only what the estimates make of a curve is left of it."""
    whole = planner.information.promise.Promise.through_curves

    def grounded(self, counts):
        found = whole(self, counts)
        for one in chain(*found):
            one.weights[..., -1] = 0.0
        return found

    monkeypatch.setattr(planner.information.promise.Promise, "through_curves", grounded)
    assert "families, kink, requirement 0" in faults_by(sound, foreseen)


def test_covariances_between_coefficients_dropped(monkeypatch):
    """With rates at one temperature a scale factor's node hangs together with those of the bias."""
    whole = told.inverse

    def diagonal(M):
        C, inflated = whole(M)
        return C * np.eye(C.shape[-1]), inflated

    monkeypatch.setattr(told, "inverse", diagonal)
    spec = by_hand()
    # two faces up and down on one axis: bias and scale factor are told apart by differences alone
    spec["tests"]["static"]["motions"] = [
        {"position_1": "0 deg", "position_2": p} for p in ("0 deg", "60 deg", "120 deg", "240 deg")
    ]
    spec["unit"]["accelerometer"]["scale_factor"] = {"systematic": "0.1 %", "run_to_run": "0.05 %"}
    assert faults(planned_from(spec))


def test_families_that_are_mixed_up(sound, foreseen, monkeypatch):
    curves = planner.information.curves.Curves
    moments, pool = curves.moments, curves.pool
    other = {"kink": "cubic", "cubic": "kink"}

    def mixed(self, degc):
        found = moments(self, degc)
        return {name: found[other.get(name, name)] for name in found}

    monkeypatch.setattr(curves, "moments", mixed)
    monkeypatch.setattr(curves, "pool", lambda self, name, *of: pool(self, other.get(name, name), *of))
    each = {f"families, {name}, requirement {k}" for name in other for k in (0, 1)}
    assert each <= {*faults_by(sound, foreseen)}


def test_a_wrong_plan_is_broken_whatever_flies(sound):
    document = copy.deepcopy(sound.document)
    _figure(document)
    wrong = replace(sound, document=sealed_again(document))
    options = FlightOptions(flights=100, through_files=0)
    found = verify(wrong.loaded, wrong.document, options, lambda message: None)
    assert found.verdict == "broken"
    assert all(o.verdict == "kept" for o in found.outcomes)


def test_curves_that_are_drawn_say_what_their_second_moment_does_not():
    """One error that matters, tables of three even nodes: what these leave has a largest value, no tail."""
    spec = by_hand()
    gyro = spec["unit"]["gyro"]["bias"] | {"run_to_run": "1e-6 deg/s", "in_run": "1e-6 deg/s"}
    spec["unit"] = {"gyro": {"bias": gyro}, "accelerometer": {"bias": {"run_to_run": "1e-6 g"}}}
    spec["requirement"] = [{"error": "heading", "limit": "9 deg", "rule": {"percentile": "99 %"}}]
    spec["tests"] = {"static": spec["tests"]["static"]}
    spec["plan"]["fixed"] = {"static": {"temperatures": 3, "repeats": 2}}
    spec["effects"] = ["bias", "bias_temperature"]
    one = planned_from(spec)
    p = prediction(one)
    starts = anywhere(p.e.spec)
    gaussian, drawn = p.figures(0, starts, ("cubic",))["cubic"], p.drawn(0, "cubic", starts)
    tally = fly(flown_with(p.e, starts, "cubic"), 3000, here, lambda message: None)
    (o,) = outcomes(flown_with(p.e, starts, "cubic"), tally.tally, one.document, p.e.spec)
    assert drawn < 0.9 * gaussian
    assert drawn == pytest.approx(o.at_promise, rel=0.1)  # 30 of 3000 flights lie beyond
