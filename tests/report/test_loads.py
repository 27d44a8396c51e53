"""A plan of several loads says when each is where, and which of them the end waits for."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.nouns.plan import Plan
from planner.nouns.step import Step
from planner.plan.campaign_to_plan import idle_benches
from planner.report.blocks import Items, Picture, Table
from planner.report.charts.gantt import campaign_picture
from planner.report.page import html
from planner.report.subjects.plan import plan_report
from planner.report.subjects.plan_loads import critical_path, loads_of, moment
from tests.report import sample
from tests.specs import loaded, small

HOUR = 3600.0


def step(bench: str, load: int, start_h: float, end_h: float, units: int = 4) -> Step:
    at = (start_h * HOUR, end_h * HOUR)
    return Step(f"b{load:02d}/{bench}/install", bench, "install", *at, units=units)


def flow(first_h: list[float], second_h: list[float]) -> list[Step]:
    """Loads go through a table and then a centrifuge: each waits for its bench and for the bench before."""
    steps, table, arm = [], 0.0, 0.0
    for i, (a, b) in enumerate(zip(first_h, second_h, strict=True), start=1):
        steps.append(step("table", i, table, table + a))
        table += a
        arm = max(arm, table)
        steps.append(step("arm", i, arm, arm + b))
        arm += b
    return steps


def plan_of(steps: list[Step]) -> Plan:
    return replace(sample.plan(), steps=tuple(steps), time_s=max(s.end_s for s in steps))


lengths = st.lists(st.tuples(st.integers(1, 9), st.integers(1, 9)), min_size=2, max_size=6)


@given(lengths)
def test_the_critical_path_of_a_flow_shop_is_as_long_as_the_campaign(found: list[tuple[int, int]]) -> None:
    steps = flow([a for a, _ in found], [b for _, b in found])
    chain = critical_path(loads_of(steps))
    assert chain[0].start_s == 0.0
    assert chain[-1].end_s == max(s.end_s for s in steps)
    assert sum(x.end_s - x.start_s for x in chain) == pytest.approx(chain[-1].end_s)


def test_the_report_names_the_loads_and_what_the_end_waits_for() -> None:
    plan = plan_of(flow([3, 3, 3], [1, 5, 1]))
    part = next(s for s in plan_report(plan).sections if s.id == "loads")
    (table,) = (b for b in part.blocks if isinstance(b, Table))
    (path,) = (b for b in part.blocks if isinstance(b, Items))
    assert sum(bool(row[-1]) for row in table.rows) == 4
    assert path.items[2] == "load 2 on arm, 4 units: 6.00 h to 11.00 h, 5.00 h"
    pictures = [b for b in part.blocks if isinstance(b, Picture)]
    assert len(pictures) == 6
    assert all(p.folded for p in pictures)
    assert html(plan_report(plan)).count("<summary>Load ") == 6


def test_one_batch_has_no_such_section() -> None:
    assert all(s.id != "loads" for s in plan_report(sample.plan()).sections)


@pytest.mark.parametrize(
    ("start", "hours_on", "said"),
    [("mon 08:00", 0, "mon 08:00"), ("mon 08:00", 25.5, "tue 09:30"), ("sun 23:00", 2, "week 2, mon 01:00")],
)
def test_moments_are_days_of_the_week_where_there_are_shifts(start: str, hours_on: float, said: str) -> None:
    assert moment(replace(sample.plan(), start=start), hours_on * HOUR) == said


def test_a_bench_that_no_test_uses_is_noted_and_a_copy_is_not() -> None:
    spec = small()
    spec["benches"]["spare"] = dict(spec["benches"]["rate_table"]) | {"kind": "rate_table"}
    spec["benches"]["rate_table"] = spec["benches"]["rate_table"] | {"count": 2}
    found = [*idle_benches(loaded(spec).spec, [step("rate_table", 1, 0, 1)])]
    assert found == ["benches.spare: idle: this plan makes no test on it"]


def test_the_chart_marks_where_each_load_begins_and_names_the_hours_of_a_short_campaign() -> None:
    plan = plan_of(flow([6, 6, 6], [1, 5, 1]))
    drawn = campaign_picture(replace(plan, start="mon 08:00")).svg
    assert [drawn.count(f">load {n}<") for n in (1, 2, 3, 4)] == [2, 2, 2, 0]  # on both benches
    assert [f">{hour}<" in drawn for hour in ("06:00", "12:00", "18:00")] == [False, True, True]  # 19 h
    alone = [replace(s, id=s.id.partition("/")[2]) for s in plan.steps[:1]]
    assert ">load" not in campaign_picture(plan_of(alone)).svg
