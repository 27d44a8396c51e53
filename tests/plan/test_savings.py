"""What a campaign's schedule shows beside its steps: batches, savings of the rules, the trade-off curve."""

from collections import defaultdict

import pytest

from planner.report.subjects.plan_schedule import RULES, schedule
from tests.specs import planned, shared, small, with_plan


def two_benches(**plan: object) -> dict:
    spec = with_plan(small(), **plan)
    bench = spec["benches"]["rate_table"] | {"kind": "rate_table", "units": 4}
    spec["benches"] = {"first": bench, "second": bench | {"install": "10 min"}}
    for test, name in zip(spec["tests"].values(), spec["benches"], strict=True):
        test["bench"] = name
    return spec


def test_batches_follow_one_another_through_the_benches():
    once = planned(two_benches()).plan
    on_bench = defaultdict(float)
    for step in once.steps:
        on_bench[step.bench] += step.end_s - step.start_s
    plan = planned(two_benches(units=18)).plan  # 4 + 4 + 4 + 4 + 2
    assert plan.time_s == pytest.approx(sum(on_bench.values()) + 4 * max(on_bench.values()))
    assert plan.power_on_s == once.power_on_s
    assert [(t.test, t.time_s) for t in plan.tests] == [(t.test, t.time_s) for t in once.tests]
    assert plan.steps[0].id.startswith("b01/")
    assert {s.units for s in plan.steps if s.id.startswith("b05/")} == {2}
    # whichever bench is the bottleneck, and it is not always the same: more than 1 + (5 − 1)/2 of one passage
    assert 3 * once.time_s < plan.bound_s <= plan.time_s
    saved = {s.rule: s.hours for s in plan.savings}
    assert saved["parallel_benches"] == pytest.approx((5 * once.time_s - plan.time_s) / 3600)
    singly = sum(on_bench.values()) + 17 * max(on_bench.values())
    assert saved["capacity"] == pytest.approx((singly - plan.time_s) / 3600)


def test_one_batch_has_no_number():
    plan, alone = planned(two_benches(units=3)).plan, planned(two_benches()).plan
    assert [step.id for step in plan.steps] == [step.id for step in alone.steps]
    assert {step.units for step in plan.steps} == {3}
    assert plan.time_s == alone.time_s
    assert plan.proved


def test_a_shared_record_saves_the_records_that_serve_every_error():
    """Two errors at the same temperatures from each record, 300 s and a gap of 15 min."""
    plan = planned(shared()).plan
    (saving,), (test,) = plan.savings, plan.tests
    points = {
        error: {r.temperature_degc for r in plan.reasons if r.error == error} for error in test.calibrates
    }
    made = dict(zip(test.temperatures_degc, test.repeats, strict=True))
    apart = sum(made[t] for temperatures in points.values() for t in temperatures)
    assert saving.rule == "shared_records"
    assert saving.hours == pytest.approx((apart - sum(test.repeats)) * 1200 / 3600)
    assert saving.hours > 0


def test_the_curve_falls_and_its_ends_are_the_two_optima():
    spec = with_plan(small(), trade_off=True)
    plan = planned(spec).plan
    times, powers = ([getattr(p, key) for p in plan.trade_off] for key in ("time_s", "power_on_s"))
    assert times == sorted(times)
    assert powers == sorted(powers, reverse=True)
    assert times[0] == planned(small()).plan.time_s
    assert powers[-1] == planned(with_plan(small(), minimise="power_on")).plan.power_on_s


def test_a_unit_that_does_not_live_long_enough_is_named():
    spec = small()
    spec["unit"] = spec["unit"] | {"service_life": "0.5 h"}
    assert any("service_life" in note for note in planned(spec).plan.notes)
    spec["unit"] = spec["unit"] | {"service_life": "500 h"}
    assert not any("service_life" in note for note in planned(spec).plan.notes)


def test_the_report_shows_what_the_rules_save_and_the_curve():
    plan = planned(two_benches(units=9, overlap=["cool_down"], trade_off=True)).plan
    section = schedule(plan)
    tables = [block for block in section.blocks if block.kind == "table"]
    assert [row[0] for row in tables[0].rows] == [RULES[s.rule][0] for s in plan.savings]
    assert {s.rule for s in plan.savings} == {"overlap", "parallel_benches", "capacity"}
    assert len(tables[1].rows) == len({(p.time_s, p.power_on_s) for p in plan.trade_off})
    assert schedule(planned(small()).plan) is None  # no rule is on: nothing to say
