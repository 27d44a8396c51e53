"""What must hold of every plan, whatever the spec."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.errors import InfeasibleError
from planner.nouns.sensitivities import Constraint
from planner.plan.allowance_to_repeats import error_menus
from planner.plan.budget import size
from planner.plan.errors_to_points import point_menus
from planner.plan.repeats_to_schedule import campaign, visits_of
from planner.plan.schedule_to_steps import steps
from planner.plan.spec_to_errors import error_models
from planner.plan.spec_to_sensitivity import constraints
from planner.plan.task import Task, planning_task
from planner.solvers.linear_combination import combined
from tests.specs import loaded, planned, planned_exactly, shared, small, with_limit, with_plan

RULES = ["worst_case", "rss", {"percentile": "95 %"}, {"percentile": "70 %"}]


def task_of(spec: dict) -> Task:
    found = loaded(spec).spec
    models = error_models(found)
    menus = error_menus(found, models, point_menus(found))
    return planning_task(found, models, menus, constraints(found, None))


def shortest_of_all(task: Task) -> float | None:
    """Every selection of rows, priced by its timeline, judged by its own rule: no integer program."""
    best = None
    for rows in product(*(range(len(r)) for r in task.rows)):
        chosen = [r.points(i).residual for r, i in zip(task.rows, rows, strict=True)]
        widths = [float(r.half_width[i]) for r, i in zip(task.rows, rows, strict=True)]
        sizes = [
            size((m.largest_run_to_run, m.in_run, m.storage, residual, width), c.rule)
            for c in task.constraints
            for m, residual, width in zip(task.models, chosen, widths, strict=True)
        ]
        per_constraint = np.array(sizes).reshape(len(task.constraints), -1)
        if any(
            float(combined(c, task.errors, s)) > c.limit * (1 + 1e-9)
            for c, s in zip(task.constraints, per_constraint, strict=True)
        ):
            continue
        cost = task.problem.cost(rows)
        best = cost if best is None else min(best, cost)
    return best


@settings(deadline=None, max_examples=25)
@given(
    st.floats(6.5, 20),
    st.sampled_from(RULES),
    st.sampled_from(["normal", "student"]),
    st.booleans(),
    st.sampled_from(["time", "power_on", {"time": 1.0, "power_on": 2.0}]),
)
def test_no_selection_is_cheaper(limit, rule, quantile, together, minimise):
    spec = with_limit(shared() if together else small(), f"{limit:.3f} m", rule=rule)
    spec = with_plan(spec, quantile=quantile, minimise=minimise, repeats={"least": 2, "most": 9})
    task = task_of(spec)
    best = shortest_of_all(task)
    if best is None:
        with pytest.raises(InfeasibleError):
            campaign(task)
        return
    found = campaign(task)
    assert found.proved
    assert found.objective == pytest.approx(best, rel=1e-9)


@settings(deadline=None, max_examples=20)
@given(st.floats(8, 20), st.sampled_from(RULES), st.booleans())
def test_a_tighter_limit_never_gives_a_shorter_campaign(limit, rule, together):
    base = shared() if together else small()
    times = []
    for factor in (1.0, 1.2):
        try:
            spec = with_limit(base, f"{limit * factor:.4f} m", rule=rule)
            times.append(campaign(task_of(spec)).objective)
        except InfeasibleError:
            times.append(np.inf)
    assert times[0] >= times[1] - 1e-9


@settings(deadline=None, max_examples=15)
@given(st.floats(8, 20), st.sampled_from(["normal", "student"]))
def test_more_confidence_never_gives_a_shorter_campaign(limit, quantile):
    times = []
    for confidence in ("80 %", "99 %"):
        spec = with_plan(with_limit(small(), f"{limit:.4f} m"), confidence=confidence, quantile=quantile)
        try:
            times.append(campaign(task_of(spec)).objective)
        except InfeasibleError:
            times.append(np.inf)
    assert times[0] <= times[1] + 1e-9


@pytest.mark.parametrize("rule", RULES)
def test_a_record_shared_by_two_sensors_never_takes_longer_than_two_records(rule):
    limit = "11 m"
    together = planned_exactly(with_limit(shared(), limit, rule=rule))
    apart = planned_exactly(with_limit(small(), limit, rule=rule))
    assert together.time_s < apart.time_s


@pytest.mark.parametrize("rule", RULES)
def test_units_scale_out(rule):
    metres = planned_exactly(with_limit(small(), "11 m", rule=rule))
    kilometres = planned_exactly(with_limit(small(), "0.011 km", rule=rule))
    assert metres.time_s == kilometres.time_s
    per_hour = small()
    per_hour["sensitivities"]["given"]["gyro.bias"] = f"{578.5 / 3600!r} m/(deg/h)"
    assert planned_exactly(with_limit(per_hour, "11 m", rule=rule)).time_s == metres.time_s


@pytest.mark.parametrize("seed", [1])
@pytest.mark.further("seed", [2])
@pytest.mark.parametrize("rule", RULES)
def test_the_genetic_algorithm_never_beats_the_proof(rule, seed):
    plan = planned(with_plan(with_limit(shared(), "10 m", rule=rule), seed=seed)).plan
    assert plan.genetic.time_s >= plan.objective_bound - 1e-6


@settings(deadline=None, max_examples=30)
@given(st.integers(0, 2**32 - 1), st.floats(0.9, 0.999))
def test_the_squared_quantile_is_convex_where_tangents_cut(seed, probability):
    """Tangent cuts are valid only if q²(Σ a_j M_j) is convex in a."""
    rng = np.random.default_rng(seed)
    errors = [f"e{j}" for j in range(4)]
    vectors = {e: rng.normal(size=(rng.integers(1, 4), 3)) * rng.lognormal(size=3) for e in errors}
    constraint = Constraint(0, "position", "m", "percentile", 1.0, 0.0, vectors, probability)
    a, b = rng.lognormal(sigma=2, size=(2, 20, 4))
    middle = combined(constraint, errors, np.sqrt((a + b) / 2)) ** 2
    ends = combined(constraint, errors, np.sqrt(a)) ** 2 + combined(constraint, errors, np.sqrt(b)) ** 2
    assert np.all(middle <= ends / 2 * (1 + 1e-9))


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 2**32 - 1), st.booleans())
def test_the_timeline_takes_what_the_tariff_says(seed, together):
    task = task_of(shared() if together else small())
    rng = np.random.default_rng(seed)
    rows = tuple(int(rng.integers(len(r))) for r in task.rows)
    from planner.nouns.choices import Campaign

    visits = visits_of(task, rows)
    timeline = steps(task.spec, Campaign(visits, (), 0.0, 0.0, True))
    assert timeline[-1].end_s == pytest.approx(task.problem.cost(rows), rel=1e-12)


@pytest.mark.parametrize(("tight", "loose"), [("11 m", "30 m"), ("30 m", "9 m")])
def test_requirements_of_different_rules_are_planned_together(tight, loose):
    spec = small()
    spec["requirement"] = [
        {"error": "position", "limit": tight, "rule": "worst_case"},
        {"error": "position", "limit": loose, "rule": {"percentile": "95 %"}},
    ]
    task = task_of(with_plan(spec, repeats={"least": 2, "most": 9}))
    best = shortest_of_all(task)
    assert best is not None
    assert campaign(task).objective == pytest.approx(best, rel=1e-9)
    plan = planned(spec).plan
    assert all(requirement.met for requirement in plan.requirements)
    assert plan.genetic.time_s >= plan.time_s - 1e-6
