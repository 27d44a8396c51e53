"""Campaigns chosen with waiting and batches in sight, against every campaign that there is."""

from itertools import product

import pytest

from planner.pipelines.navigation import navigate, task_of
from planner.plan.campaign_by_total import by_total, least_loads, total
from planner.plan.repeats_to_schedule import campaign, visits_of
from tests.specs import loaded, planned, small, with_limit, with_plan

SHIFTS = {"days": ["mon", "tue", "wed", "thu", "fri"], "from": "08:00", "to": "14:00"}


def raw(seed: int) -> dict:
    """Two tests, one of them people's; one or two benches, shifts or batches or both; a dozen rows each."""
    plan: dict = {"repeats": {"least": 2, "most": 6}, "genetic": {"generations": 1}}
    if seed % 2:
        plan["shifts"] = SHIFTS
    if seed % 3 or not seed % 2:
        plan["units"] = 3 + seed % 4
    spec = with_plan(with_limit(small(), ("14 m", "12.5 m", "16 m")[seed % 3]), **plan)
    bench = spec["benches"]["rate_table"] | {"kind": "rate_table", "remove": "20 min", "units": 1 + seed % 2}
    spec["benches"] = {"first": bench, "second": bench | {"install": "2 h"}}
    for i, test in enumerate(spec["tests"].values()):
        test["bench"] = "second" if i and seed % 4 < 2 else "first"
        test["attended"] = bool((seed >> i) & 1)
        test["power_on"] = "10 min"
    return spec


def every_total(task) -> list[float]:
    """Totals of all selections within the limits."""
    selections = product(*(range(len(group.cost)) for group in task.problem.groups))
    visits = {visits_of(task, rows) for rows in selections if task.problem.within_limits(rows)}
    return [total(task.spec, each) for each in visits]


@pytest.mark.parametrize("seed", [2, 3, 4])
@pytest.mark.further("seed", [0, 1, *range(5, 12)])
def test_the_bound_holds_for_every_campaign_and_none_that_was_tried_is_shorter(seed):
    source = loaded(raw(seed))
    task = task_of(source.spec, navigate(source, lambda message: None))
    first = campaign(task)
    best = by_total(task, first)
    reached, totals = total(source.spec, best.visits), every_total(task)
    assert best.total_bound <= min(totals) * (1 + 1e-9)
    assert min(totals) <= reached * (1 + 1e-9)
    assert reached <= total(source.spec, first.visits)
    assert best.total_bound >= first.bound
    assert best.by_total == (best.visits != first.visits)
    # no law: the few candidates need not hold the best of all, but in these and the further cases they do
    assert reached == pytest.approx(min(totals), rel=1e-9)


def test_the_bottleneck_of_many_batches_decides():
    """Twenty batches: what the slow bench does counts twenty times, so its work is spared for the other's."""
    spec = with_plan(with_limit(small(), "16 m"), units=20, genetic={"generations": 1})
    bench = spec["benches"]["rate_table"] | {"kind": "rate_table"}
    spec["benches"] = {"first": bench, "second": bench}
    for test, name in zip(spec["tests"].values(), spec["benches"], strict=True):
        test["bench"] = name
    spec["tests"]["gyro_drift"]["record"] = "20 min"
    plan = planned(spec).plan
    source = loaded(spec)
    task = task_of(source.spec, navigate(source, lambda message: None))
    by_work = total(source.spec, campaign(task).visits)
    assert plan.by_total
    assert plan.time_s < 0.75 * by_work
    assert plan.proved  # the shares of the bottleneck make the bound tight
    assert plan.bound_s == pytest.approx(plan.time_s, rel=1e-9)
    assert any("another choice takes less work" in note for note in plan.notes)
    assert [least_loads(source.spec, name) for name in spec["benches"]] == [20, 20]


def test_a_bench_has_as_many_loads_as_its_own_size_asks_for():
    spec = with_plan(small(), units=13)
    bench = spec["benches"]["rate_table"] | {"kind": "rate_table"}
    spec["benches"] = {"large": bench | {"units": 6}, "little": bench | {"units": 2}}
    for test, name in zip(spec["tests"].values(), spec["benches"], strict=True):
        test["bench"] = name
    found = loaded(spec).spec
    assert [least_loads(found, name) for name in spec["benches"]] == [3, 7]
    assert least_loads(loaded(spec | {"plan": small()["plan"]}).spec, "little") == 1


def test_without_shifts_and_batches_nothing_is_looked_for():
    source = loaded(small())
    task = task_of(source.spec, navigate(source, lambda message: None))
    first = campaign(task)
    assert by_total(task, first) is first


def test_no_plan_on_the_trade_off_curve_is_beaten_by_another_one_on_it():
    spec = with_plan(with_limit(small(), "16 m"), units=20, trade_off=True, genetic={"generations": 1})
    bench = spec["benches"]["rate_table"] | {"kind": "rate_table"}
    spec["benches"] = {"first": bench, "second": bench}
    for test, name in zip(spec["tests"].values(), spec["benches"], strict=True):
        test["bench"] = name
    spec["tests"]["gyro_drift"]["record"] = "20 min"
    plan = planned(spec).plan
    assert plan.by_total
    for point in plan.trade_off:
        costs = [p.time_s + point.power_on_weight * p.power_on_s for p in plan.trade_off]
        assert point.time_s + point.power_on_weight * point.power_on_s == min(costs)
    assert plan.trade_off[0].time_s == plan.time_s  # of time alone, which is what was minimised
