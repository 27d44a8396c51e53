"""`check`, `plan` and verify's own estimator find the same coefficients that a plan does not tell."""

from __future__ import annotations

import json
from typing import Any

import pytest

from planner.errors import InputError
from planner.export.json import plan_text
from planner.nouns.choices import TestVisits
from planner.pipelines import navigation, published
from planner.pipelines.planning import exact_plan
from planner.plan.observable_campaign import refuse_what_no_campaign_observes
from planner.plan.spec_to_trajectory import trajectory_of
from planner.plan.visits_to_observability import asked_errors, unobservable_in
from planner.spec.load import LoadedSpec
from planner.verify.experiment import experiment
from planner.verify.weak import weak_coefficients
from tests.specs import loaded
from tests.verify.plans import flown

SIZE = {"systematic": "0.5 %", "run_to_run": "0.002 %"}
SPINS = [{"position_2": "0 deg", "rate_1": f"{rate} deg/s"} for rate in (100, -100, 200, -200)]
Named = set[tuple[str, str]]


def made_by_hand(temperatures: dict[str, list[int]], **motions: Any) -> dict[str, Any]:
    """Six faces and turns about three axes that calibrate bias and scale factor of both sensors."""
    spec = flown()
    unit, tests = spec["unit"], spec["tests"]
    unit["accelerometer"]["scale_factor"] = SIZE
    tests["static"]["calibrates"] = ["gyro.bias", "accelerometer.bias"]
    tests["faces"] = tests["static"] | {"calibrates": ["accelerometer.scale_factor"]}
    for test, asked in motions.items():
        tests[test] |= {"motions": asked}
    fixed = {
        test: {"temperatures": [f"{t} degC" for t in at], "repeats": 3} for test, at in temperatures.items()
    }
    spec["effects"] = [*spec["effects"], "scale_factor_temperature"]
    return spec | {"plan": spec["plan"] | {"quantile": "student", "fixed": fixed}}


def with_cubic(spec: dict[str, Any]) -> dict[str, Any]:
    spec["unit"]["gyro"]["scale_factor_nonlinearity"] = {"systematic": "0.1 %", "run_to_run": "0.002 %"}
    spec["tests"]["rates"]["calibrates"] = ["gyro.scale_factor", "gyro.scale_factor_nonlinearity"]
    return spec | {"effects": [*spec["effects"], "scale_factor_nonlinearity"]}


EVERYWHERE = {"static": [-60, 0, 60], "faces": [0], "rates": [0]}
ONCE = {"static": [0], "faces": [0], "rates": [0]}
Z = {("accelerometer.bias", "z"), ("accelerometer.scale_factor", "z")}
CUBIC = {(f"gyro.{e}", axis) for e in ("scale_factor", "scale_factor_nonlinearity") for axis in "xyz"}
LOADS = {("accelerometer.scale_factor", axis) for axis in "xyz"}  # of 1 g alone, beside its own cubic
CASES: dict[str, tuple[dict[str, Any], Named]] = {
    "six faces everywhere": (made_by_hand(EVERYWHERE), set()),
    "one face": (made_by_hand(EVERYWHERE, static=1), Z),
    "one face beside six": (made_by_hand(EVERYWHERE | {"faces": [-60, 0, 60]}, static=1), set()),
    "an axis missing": (
        made_by_hand(EVERYWHERE, rates=SPINS),
        {("gyro.scale_factor", "x"), ("gyro.scale_factor", "y")},
    ),
    "one speed": (with_cubic(made_by_hand(ONCE, rates=6)), CUBIC | LOADS),
    "several speeds": (with_cubic(made_by_hand(ONCE, rates=30)), set()),
    "temperatures missing": (
        made_by_hand({"static": [0], "faces": [0], "rates": [-60, 0, 60]}, rates=SPINS),
        Z | {("gyro.scale_factor", "x"), ("gyro.scale_factor", "y")},
    ),
}


def _checked(found: LoadedSpec) -> None:
    refuse_what_no_campaign_observes(found.spec)


@pytest.mark.parametrize("case", CASES)
def test_they_name_the_same(case: str, monkeypatch: pytest.MonkeyPatch) -> None:
    tree, wanted = CASES[case]
    found = loaded(tree)
    said = []
    for ask in (_checked, exact_plan):
        try:
            ask(found)
        except InputError as error:
            said.append(str(error))
    assert len(said) == (2 if wanted else 0)
    assert len(set(said)) == len(set(said[:1]))  # in the same words
    assert all(error in said[0] for error, _ in wanted)
    # planned all the same, so that verify has something to look at
    monkeypatch.setattr(navigation, "refuse_what_no_campaign_observes", lambda spec: None)
    monkeypatch.setattr(published, "observable_campaign", lambda task, chosen: chosen)
    plan = exact_plan(found)
    visits = [TestVisits(t.test, t.temperatures_degc, t.repeats) for t in plan.tests]
    assert {(str(u.error), u.term) for u in unobservable_in(found.spec, visits)} == wanted
    trajectory = trajectory_of(found.spec.trajectory, found.folder)
    e = experiment(json.loads(plan_text(plan)), found.spec, trajectory, seed=1)
    calibrated = asked_errors(found.spec)  # verify also names what is declared and nobody calibrates
    assert {(str(w.error), w.axis) for w in weak_coefficients(e) if w.error in calibrated} == wanted
