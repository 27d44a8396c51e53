"""A plan counted again: as planner wrote it everything agrees; any edit that is sealed again is found."""

from __future__ import annotations

import ast
import copy
import math
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import planner.verify
from planner.nouns.trajectory import Trajectory
from planner.protocols import Sensor
from planner.verify import recount_navigation
from planner.verify.experiment import experiment
from planner.verify.lengths import length_quantile
from planner.verify.prediction import Prediction
from planner.verify.recount import Recount, is_by_information, recount
from planner.verify.recount_promise import as_planned, check_promise
from planner.verify.recount_sensitivities import Slopes, slopes_of
from tests.specs import small
from tests.verify.plans import SPECS, plan_of, planned_from, sealed_again

UNCOUNTED = {  # what a search found on the way, and words (planner.verify.recount.NOT_RECOUNTED)
    ("planner",),
    ("packages",),
    ("notes",),
    ("savings",),
    ("trade_off",),
    ("hours_per_limit",),
    ("genetic",),
    ("schema_version",),
    ("prices",),
    ("worth",),
    ("proved_of",),
    ("plan_sha256",),
}


def places(tree: Any, at: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """The place of every figure and word in a tree."""
    if isinstance(tree, dict):
        return [p for key, value in tree.items() for p in places(value, (*at, key))]
    if isinstance(tree, list):
        return [p for i, value in enumerate(tree) for p in places(value, (*at, i))]
    return [at]


def value_at(tree: Any, place: tuple[Any, ...]) -> Any:
    for part in place:
        tree = tree[part]
    return tree


def changed(document: dict[str, Any], place: tuple[Any, ...], value: Any) -> dict[str, Any]:
    edited = copy.deepcopy(document)
    value_at(edited, place[:-1])[place[-1]] = value
    return sealed_again(edited)


def is_rounding(document: dict[str, Any], place: tuple[Any, ...]) -> bool:
    """A coefficient that is zero but for rounding, or adds nothing beside the error's other axes."""
    value = value_at(document, place)
    if place[0] != "sensitivities" or not isinstance(value, float):
        return isinstance(value, float) and 0.0 < abs(value) < 1e-9
    mine = document["sensitivities"][place[1]]
    same = [
        s
        for s in document["sensitivities"]
        if (s["error"], s["requirement"]) == (mine["error"], mine["requirement"])
    ]
    return abs(value) < 0.03 * max(s["value"] for s in same)


def is_navigated(place: tuple[Any, ...]) -> bool:
    """Figures of flights: the recount's own agree with the plan's to a thousandth, not to all digits."""
    return place[0] in ("sensitivities", "requirements") and place[-1] in ("value", "achieved")


def is_drawn(document: dict[str, Any], place: tuple[Any, ...]) -> bool:
    """Figures of a plan by information: both sides draw curves, so that they agree to 2 % of the whole."""
    if document["method"] != "information":
        return False
    return place[0] in ("families", "covariance") or "parts" in place or "shares" in place


def is_little(document: dict[str, Any], place: tuple[Any, ...]) -> bool:
    """A part, share or correlation of less than a tenth: thrice as much may be within 2 % of the squares."""
    if not is_drawn(document, place) or place[0] == "families":
        return False
    if place[0] == "covariance":
        if "matrix" not in place:
            return False
        (i, j), matrix = place[2:], document["covariance"]["matrix"]
        return bool(abs(matrix[i][j]) < 0.1 * np.sqrt(matrix[i][i] * matrix[j][j]))
    every = np.abs(list(value_at(document, place[:-1]).values()))
    whole = np.linalg.norm(every) if "parts" in place else every.sum()
    return bool(abs(value_at(document, place)) < 0.1 * whole)


@pytest.fixture(autouse=True)
def _a_flight_is_integrated_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Edits of a plan leave its flight as it is: what is flown of a trajectory is the same at every count."""
    monkeypatch.setattr(recount_navigation, "slopes_of", slopes_once)


def slopes_once(trajectory: Trajectory, errors: Sequence[tuple[Sensor, str]], instants: np.ndarray) -> Slopes:
    key = (id(trajectory), tuple(errors), instants.tobytes())
    if key not in FLOWN:
        FLOWN[key] = trajectory, slopes_of(trajectory, errors, instants)
    return FLOWN[key][1]


FLOWN: dict[tuple[int, tuple[tuple[Sensor, str], ...], bytes], tuple[Trajectory, Slopes]] = {}


@cache
def promised(name: str) -> Prediction | None:
    plan = plan_of(name)
    return as_planned(experiment(plan.document, plan.loaded.spec, plan.trajectory, seed=1))


def counted(name: str, document: dict[str, Any]) -> Recount:
    """As verify counts: what is promised, too, where the plan is by information."""
    plan = plan_of(name)
    found = recount(document, plan.loaded, plan.trajectory)
    if found.ok and is_by_information(document):
        found = found.and_also(check_promise(document, promised(name)))
    return found


@st.composite
def other(draw: st.DrawFn, value: Any, coarse: bool = False, drawn: bool = False) -> Any:
    """Something else of the same kind; numbers from a part in a hundred thousand to a factor of three."""
    if isinstance(value, bool):
        return not value
    if isinstance(value, int) and not isinstance(value, bool):
        return value + draw(st.sampled_from([-2, -1, 1, 2, 7]))
    if isinstance(value, float):
        fine = [0.997, 1.003] if coarse else [1 - 1e-5, 1 + 1e-5]
        factor = draw(st.sampled_from([*([] if drawn else [*fine, 0.9, 1.1]), 0.3, 3.0, -1.0]))
        return value * factor if value else 0.125
    if value is None:
        return draw(st.sampled_from([1, 0.5]))
    return value + draw(st.sampled_from(["x", "/1", " "]))


@pytest.mark.parametrize("name", SPECS)
def test_a_plan_as_planner_wrote_it_agrees_in_every_figure(name):
    plan = plan_of(name)
    found = counted(name, plan.document)
    assert found.ok, found.faults[:5]
    assert found.figures > 6 * len(plan.document["steps"])
    assert is_by_information(plan.document) == ("promise" in {c.name for c in found.checks})


@pytest.mark.parametrize("minimise", ["power_on", {"time": 1, "power_on": 0.5}, {"time": 3, "power_on": 20}])
def test_a_plan_that_weighs_hours_and_power_on_agrees(minimise):
    """What is made least is said in the planner's words; others were called a fault of the plan."""
    spec = small()
    plan = planned_from(spec | {"plan": spec["plan"] | {"minimise": minimise}})
    found = recount(plan.document, plan.loaded, plan.trajectory)
    assert found.ok, found.faults[:5]


# an example where a flight is integrated takes half a second: 72 edits of six plans, every part as likely
@pytest.mark.parametrize("name", SPECS)
@settings(deadline=None, max_examples=12)
@given(data=st.data())
def test_any_edit_that_is_sealed_again_is_found(name, data):
    plan = plan_of(name)
    tree = plan.document
    every = [
        p
        for p in places(tree)
        if p[:1] not in UNCOUNTED and not is_rounding(tree, p) and not is_little(tree, p)
    ]
    # steps are most of a plan: without a choice of its own the rest would hardly ever be edited
    group = data.draw(st.sampled_from(sorted({p[0] for p in every})))
    place = data.draw(st.sampled_from([p for p in every if p[0] == group]))
    value = data.draw(other(value_at(tree, place), is_navigated(place), is_drawn(tree, place)))
    assert not counted(name, changed(tree, place, value)).ok, place


@pytest.mark.parametrize("name", SPECS)
@settings(deadline=None, max_examples=6)
@given(data=st.data())
def test_steps_taken_out_doubled_or_swapped_are_found(name, data):
    plan = plan_of(name)
    steps = copy.deepcopy(plan.document["steps"])
    i = data.draw(st.integers(0, len(steps) - 1))
    how = data.draw(st.sampled_from(["out", "twice", "swapped"]))
    if how == "out":
        del steps[i]
    elif how == "twice":
        steps.insert(i, copy.deepcopy(steps[i]))
    else:
        j = data.draw(st.integers(0, len(steps) - 1).filter(lambda j: j != i))
        steps[i], steps[j] = steps[j], steps[i]
    assert not recount(sealed_again(plan.document | {"steps": steps}), plan.loaded, plan.trajectory).ok


@pytest.mark.parametrize("name", ["small", "flown"])
def test_a_repeat_taken_out_everywhere_is_found(name):
    """Steps, tests and sums all agree with each other: only the spec's quantile tells."""
    plan = plan_of(name)
    document = copy.deepcopy(plan.document)
    test = document["tests"][0]
    last = test["repeats"][0]
    gone = [
        s
        for s in document["steps"]
        if s["test"] == test["test"]
        and s["temperature_degc"] == test["temperatures_degc"][0]
        and s["repeat"] == last
    ]
    seconds = sum(s["end_s"] - s["start_s"] for s in gone)
    end = max(s["end_s"] for s in gone)
    document["steps"] = [s for s in document["steps"] if s not in gone]
    for s in document["steps"]:
        if s["start_s"] >= end - 1e-6:
            s["start_s"] -= seconds
            s["end_s"] -= seconds
    test["repeats"][0] = last - 1
    test["time_s"] -= seconds
    document["time_s"] -= seconds
    found = recount(sealed_again(document), plan.loaded, plan.trajectory)
    assert {f.check for f in found.faults} & {"repeats", "tests", "allowances"}


def test_an_edit_that_is_not_sealed_again_breaks_the_seal():
    plan = plan_of("small")
    edited = copy.deepcopy(plan.document)
    edited["notes"] = ["all is well"]
    assert [f.check for f in recount(edited, plan.loaded, plan.trajectory).faults] == ["seal"]


@pytest.mark.parametrize(
    "broken",
    [{"steps": None}, {"steps": [1]}, {"allowances": {"gyro.bias": 1}}, {"time_s": "1"}, {"tests": [{}]}],
)
def test_another_shape_is_a_fault_and_no_crash(broken):
    plan = plan_of("small")
    found = recount(sealed_again(plan.document | broken), plan.loaded, plan.trajectory)
    assert {f.check for f in found.faults} == {"shape"}


def test_a_plan_of_another_spec_is_found():
    plan, other_plan = plan_of("small"), plan_of("shared")
    found = recount(plan.document, other_plan.loaded, other_plan.trajectory)
    assert any(f.where == "spec, sha256" for f in found.faults)


def test_the_recount_imports_nothing_of_the_planner():
    """Sharing no arithmetic: neither the stages nor their solvers."""
    folder = Path(planner.verify.__file__).parent
    seen, waiting = set(), ["planner.verify.recount"]
    while waiting:
        module = waiting.pop()
        if module in seen:
            continue
        seen.add(module)
        tree = ast.parse((folder / f"{module.rsplit('.', 1)[1]}.py").read_text())
        names = [n.module or "" for n in ast.walk(tree) if isinstance(n, ast.ImportFrom)]
        names += [a.name for n in ast.walk(tree) if isinstance(n, ast.Import) for a in n.names]
        assert not [
            n for n in names if n.startswith(("planner.plan", "planner.solvers", "planner.pipelines"))
        ]
        if module.startswith("planner.verify.recount"):
            waiting += [n for n in names if n.startswith("planner.verify.recount")]
    assert len(seen) > 2


@pytest.mark.parametrize(
    ("variances", "probability", "length"),
    [
        ([1.0], 0.95, 1.959963984540054),
        ([1.0, 1.0], 0.95, math.sqrt(-2.0 * math.log(0.05))),  # Rayleigh
        ([1.0, 1.0, 1.0], 0.95, 2.7954834829151074),  # Maxwell: root of the chi-squared quantile 7.814728
        ([4.0, 1e-9, 0.0], 0.9, 2.0 * 1.6448536269514722),
    ],
)
def test_the_length_quantile_is_that_of_the_closed_form(variances, probability, length):
    # 1e-9 of variance beside 4 moves the length by 1e-10; the integral is good to 1e-9
    assert length_quantile(np.diag(variances), probability) == pytest.approx(length, rel=2e-9)


@pytest.mark.filterwarnings("error")
def test_a_test_made_no_times_is_found_without_dividing_by_zero() -> None:
    one = plan_of("several")
    reason = next(i for i, r in enumerate(one.document["reasons"]) if r["error"] == "gyro.bias")
    edited = changed(one.document, ("reasons", reason, "repeats"), 0)
    for test in edited["tests"]:
        test["repeats"] = [0 for _ in test["repeats"]]
    found = recount(sealed_again(edited), one.loaded, one.trajectory)
    assert any("is made 0 times there" in str(fault) for fault in found.faults)


def test_a_spread_that_leaves_the_drift_between_records_out_is_found() -> None:
    one = plan_of("several")
    place, reason = next(
        (i, r) for i, r in enumerate(one.document["reasons"]) if r["error"] == "accelerometer.bias"
    )
    assert reason["spread"] > 0.001  # g; the budget's run-to-run alone
    edited = changed(one.document, ("reasons", place, "spread"), 0.001)
    assert not recount(edited, one.loaded, one.trajectory).ok


def test_a_load_on_a_bench_that_is_not_free_first_is_found() -> None:
    document = copy.deepcopy(plan_of("attended").document)
    benches = {s["id"][:3]: s["bench"] for s in document["steps"]}
    assert benches == {"b01": "rate_table", "b02": "rate_table-2", "b03": "rate_table"}
    for step in document["steps"]:
        if step["id"].startswith("b02"):
            step["bench"], step["id"] = "rate_table", step["id"].replace("rate_table-2", "rate_table")
    faults = counted("attended", sealed_again(document)).faults
    assert any("waits for rate_table, where another one is free" in fault.what for fault in faults)
