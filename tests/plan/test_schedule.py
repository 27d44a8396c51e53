"""Timelines under shifts, overlap, orders and batches, recounted from the spec's own words."""

from collections import Counter, defaultdict
from itertools import pairwise, permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.nouns.choices import Campaign, TestVisits
from planner.nouns.step import Step
from planner.plan.bench_timing import best_of
from planner.plan.repeats_to_schedule import campaign, visits_of
from planner.plan.schedule_to_steps import bench_timings, makespan, steps
from planner.spec.model import Spec
from tests.laws.test_planning import shortest_of_all, task_of
from tests.specs import loaded, planned, shared, small, with_limit, with_plan

DAYS = ["mon", "tue", "wed", "thu", "fri", "sat", "sun"]
WEEKDAYS = {"days": DAYS[:5], "from": "08:00", "to": "17:00", "start": "mon 08:00"}


def laboratory(rng: np.random.Generator) -> dict:
    """Two benches, four tests with cool-downs shorter and longer than the soak, random rules."""
    spec = small()
    chamber = spec["benches"]["rate_table"]["chamber"]
    minutes = [0, 5, 15, 30, 45, 60]

    def some(least: int = 0) -> str:
        return f"{max(least, int(rng.choice(minutes)))} min"

    def bench(kind: str) -> dict:
        own = {"kind": kind, "install": some(), "remove": some(), "move": f"{rng.choice([0, 10])} s"}
        soaked = chamber | {"soak": some()}
        return own | {"units": int(rng.integers(1, 4)), "chamber": soaked}

    def test(name: str, *errors: str) -> dict:
        times = {
            "record": some(5),
            "gap": some(),
            "cool_down": some(),
            "power_on": f"{rng.choice([0, 60])} s",
        }
        own = {"bench": name, "calibrates": list(errors), "motions": int(rng.integers(1, 4))}
        return own | times | {"attended": bool(rng.random() < 0.5)}

    spec["benches"] = {"one": bench("rate_table"), "two": bench("levelled_plate")}
    spec["tests"] = {
        "a": test("one", "gyro.bias"),
        "b": test("one", "accelerometer.bias"),
        "c": test("two", "gyro.bias", "accelerometer.bias"),
    }
    room = {"low": -70, "middle": 20, "high": 75}[str(rng.choice(["low", "middle", "high"]))]
    ranges = spec["plan"]["temperatures"] | {"room": f"{room} degC"}
    return with_plan(
        spec,
        temperatures=ranges,
        order=str(rng.choice(["free", "up", "down", "up_and_down"])),
        overlap=["cool_down"] if rng.random() < 0.6 else [],
        repeats={"least": 2, "most": 4},
    )


def with_people(spec: dict, rng: np.random.Generator) -> dict:
    """Shifts of ten hours and more: one repeat of any test fits into them."""
    days = [day for day in DAYS if rng.random() < 0.6] or ["wed"]
    opens = int(rng.integers(0, 12))
    closes = opens + int(rng.integers(10, 13))
    shift = {"days": days, "from": f"{opens:02d}:00", "to": f"{closes:02d}:00"}
    start = {"start": f"{rng.choice(DAYS)} {rng.integers(0, 24):02d}:30"}
    return with_plan(spec, shifts=shift | (start if rng.random() < 0.5 else {}))


def random_visits(spec: Spec, rng: np.random.Generator) -> tuple[TestVisits, ...]:
    found = []
    for name in spec.tests:
        points = sorted({float(t) for t in rng.choice([-60, -30, 0, 20, 30, 60], rng.integers(1, 5))})
        if rng.random() < 0.85 or not found:
            found.append(
                TestVisits(name, tuple(points), tuple(int(n) for n in rng.integers(1, 4, len(points))))
            )
    return tuple(found)


def timeline_of(spec: Spec, visits: tuple[TestVisits, ...]) -> tuple[Step, ...]:
    return steps(spec, Campaign(visits, (), 0.0, 0.0, True))


@settings(deadline=None, max_examples=50)
@given(st.integers(0, 2**32 - 1))
def test_without_shifts_the_timeline_takes_what_the_tariff_says(seed):
    rng = np.random.default_rng(seed)
    task = task_of(laboratory(rng))
    rows = tuple(int(rng.integers(len(r))) for r in task.rows)
    timeline = timeline_of(task.spec, visits_of(task, rows))
    assert timeline[-1].end_s == pytest.approx(task.problem.cost(rows), rel=1e-12)


@settings(deadline=None, max_examples=25)
@given(st.integers(0, 2**32 - 1), st.floats(7, 20))
def test_no_selection_is_cheaper_with_overlap(seed, limit):
    rng = np.random.default_rng(seed)
    spec = with_plan(with_limit(laboratory(rng), f"{limit:.3f} m"), overlap=["cool_down"], order="free")
    narrow = spec["plan"]["temperatures"] | {"candidates": [1, 3]}
    task = task_of(with_plan(spec, temperatures=narrow, quantile="normal"))
    best = shortest_of_all(task)
    if best is not None:
        assert campaign(task).objective == pytest.approx(best, rel=1e-9)


@pytest.mark.parametrize("seed", range(24))
@pytest.mark.further("seed", range(24, 60))
def test_a_laboratory_could_work_by_the_timeline(seed):
    rng = np.random.default_rng(seed)
    raw = laboratory(rng)
    raw = with_people(raw, rng) if seed % 4 else raw
    raw = with_plan(raw, units=int(rng.integers(1, 8))) if seed % 3 else raw
    spec = loaded(raw).spec
    visits = random_visits(spec, rng)
    timeline = timeline_of(spec, visits)
    used = [b for b in spec.benches if any(spec.tests[v.test].bench == b for v in visits)]
    for bench in used:
        own = [step for step in timeline if step.bench == bench]
        assert all(b.start_s >= a.end_s for a, b in pairwise(own))
        for load in by_batch(own).values():
            check_bench(spec, bench, load, visits)
    for unit in units_of(spec, used, timeline):
        check_batch(spec, unit)
    assert makespan(spec, visits) == pytest.approx(max(step.end_s for step in timeline), abs=1e-5)
    if raw["plan"].get("shifts"):
        check_people(raw, timeline)


def by_batch(timeline):
    found = defaultdict(list)
    for step in timeline:
        found[step.id.split("/")[0] if step.id[0] == "b" and step.id[1:3].isdigit() else ""].append(step)
    return found


def units_of(spec, used, timeline):
    """Every unit with its steps: the loads of each bench take all units once, in their order."""
    count = spec.plan.units
    found = [[] for _ in range(count or 1)]
    for bench in used:
        loads = by_batch([step for step in timeline if step.bench == bench])
        assert list(loads) == sorted(loads)
        through = 0
        for load in loads.values():
            (size,) = {step.units for step in load}
            assert size <= spec.benches[bench].units
            for unit in found[through : through + size] if count else found:
                unit += load
            through += size
        assert through == (count or spec.benches[bench].units)
    return found


def check_batch(spec, batch):
    """One place at a time, benches in the order of the spec, and the unit cools down between power-ons."""
    assert len({step.id for step in batch}) == len(batch)
    assert all(b.start_s >= a.end_s - 1e-6 for a, b in pairwise(batch))
    order = [list(spec.benches).index(step.bench) for step in batch]
    assert order == sorted(order)
    off = None
    for step in batch:
        if step.action == "power_off":
            test = spec.tests[step.test]
            off = step.end_s + test.gap + test.cool_down
        if step.action == "power_on" and off is not None:
            assert step.start_s >= off - 1e-6


def check_bench(spec, name, own, visits):
    """Without gaps; every record where it belongs; ramps and soaks as long as the chamber needs."""
    bench, now, soaked, order = spec.benches[name], spec.plan.temperatures.room, 0.0, []
    assert all(a.end_s == pytest.approx(b.start_s, abs=1e-6) for a, b in pairwise(own))
    records = Counter()
    for step in own:
        if step.action == "ramp":
            speed = bench.chamber.heating if step.temperature_degc > now else bench.chamber.cooling
            assert step.end_s - step.start_s == pytest.approx(abs(step.temperature_degc - now) / speed)
            now, soaked = step.temperature_degc, 0.0
            order.append(now)
        elif step.action == "soak":
            soaked = step.end_s - step.start_s
            order.append(step.temperature_degc)
        elif step.action == "record":
            assert step.temperature_degc == now
            assert soaked >= bench.chamber.soak
            records[step.test, now] += 1
        else:
            assert step.temperature_degc == now
    assert now == spec.plan.temperatures.room
    expected = {
        (v.test, t): n * spec.tests[v.test].motion_count
        for v in visits
        if spec.tests[v.test].bench == name
        for t, n in zip(v.temperatures_degc, v.repeats, strict=True)
    }
    assert records == expected
    check_order(spec.plan.order, [t for t in dict.fromkeys(order) if any(t == at for _, at in expected)])


def check_order(rule, order):
    top = order.index(max(order))
    if rule == "down":
        assert order == sorted(order, reverse=True)
    elif rule == "up":
        assert order == sorted(order)
    elif rule == "up_and_down":
        assert order[: top + 1] == sorted(order[: top + 1])
        assert order[top:] == sorted(order[top:], reverse=True)


def check_people(raw, timeline):
    """Attended steps lie within one shift, read from the spec as it is written; what waits, waits for one."""
    shift = raw["plan"]["shifts"]
    clock = [int(shift[key][:2]) for key in ("from", "to")]
    opens = sorted(24 * DAYS.index(day) + clock[0] for day in shift["days"])
    if "start" in shift:
        day, time = shift["start"].split()
        start = 24 * DAYS.index(day) + int(time[:2]) + 0.5
    else:
        start = opens[0]
    for step in timeline:
        attended = step.action in ("install", "remove")
        if step.test is not None and raw["tests"][step.test]["attended"]:
            attended |= step.action in ("power_on", "move")
        if attended:
            a, b = ((start + s / 3600) for s in (step.start_s, step.end_s))
            inside = [
                a >= w + 168 * k - 1e-6 and b <= w + 168 * k + clock[1] - clock[0] + 1e-6
                for w in opens
                for k in range(-1, int(b / 168) + 1)
            ]
            assert any(inside)


@pytest.mark.parametrize("seed", range(12))
def test_no_order_that_is_allowed_finishes_earlier(seed):
    """The whole bench, laid out step by step, against every permutation of its temperatures."""
    rng = np.random.default_rng(seed)
    spec = loaded(with_people(laboratory(rng), rng)).spec
    visits = tuple(TestVisits(n, (-60.0, -20.0, 30.0, 60.0), (2, 1, 3, 1)) for n in ("a", "b"))
    (timing,) = bench_timings(spec, visits)
    end = timeline_of(spec, visits)[-1].end_s
    others = []
    for order in permutations(range(4)):
        timing.order = lambda ready, order=order: order
        if allowed(spec.plan.order, order):
            others.append(timing.end(0.0))
    assert end == pytest.approx(min(others), abs=1e-5)


def allowed(rule, order):
    top, rising = order.index(3), list(range(4))
    ways = {
        "free": True,
        "up": list(order) == rising,
        "down": list(order) == rising[::-1],
        "up_and_down": list(order[: top + 1]) == sorted(order[: top + 1])
        and list(order[top:]) == sorted(order[top:], reverse=True),
    }
    return ways[rule]


def test_too_many_temperatures_take_the_better_monotone_order():
    rng = np.random.default_rng(1)
    raw = with_people(with_plan(laboratory(rng), order="free"), rng)
    raw["tests"]["a"]["attended"] = True
    spec = loaded(raw).spec
    points = tuple(np.linspace(-60, 60, 21))
    visits = (TestVisits("a", points, (1,) * 21),)
    (timing,) = bench_timings(spec, visits)
    assert not timing.is_exact
    ends = [makespan(loaded(with_plan(raw, order=order)).spec, visits) for order in ("up", "down")]
    assert timing.end(0.0) == pytest.approx(min(ends), abs=1e-6)
    assert best_of(timing._stops, "up", 0.0) == tuple(range(21))


def test_a_campaign_over_a_weekend():
    """By hand: install Friday 16:00-16:30; 15 h without people; remove waits for Monday 08:00."""
    spec = with_plan(shared(), shifts=WEEKDAYS | {"start": "fri 16:00"})
    spec["benches"]["rate_table"]["remove"] = "10 min"
    plan = planned(spec).plan
    wait, remove = plan.steps[-2:]
    assert (wait.id, wait.action, remove.action) == ("rate_table/remove/wait", "pause", "remove")
    assert remove.start_s == 64 * 3600  # Friday 16:00 to Monday 08:00
    assert plan.time_s == 64 * 3600 + 600
    assert plan.bound_s == planned(spec | {"plan": shared()["plan"]}).plan.time_s
    assert plan.gap == pytest.approx((plan.time_s - plan.bound_s) / plan.time_s)
    assert not plan.proved
    assert plan.work_proved


def test_a_lab_that_never_closes_changes_nothing():
    always = {"days": DAYS, "from": "00:00", "to": "24:00"}
    assert planned(with_plan(small(), shifts=always)).plan.steps == planned(small()).plan.steps


def test_the_direction_is_free_of_charge():
    up, down = (planned(with_plan(small(), order=order)).plan for order in ("up", "down"))
    assert up.time_s == pytest.approx(down.time_s, rel=1e-12)
    assert up.steps == planned(small()).plan.steps
    assert [s.temperature_degc for s in down.steps if s.action == "soak"] == [60.0, 30.0, 0.0, -30.0, -60.0]


def test_the_cool_down_between_records_of_one_temperature_stays():
    plain, overlapped = planned(small()).plan, planned(with_plan(small(), overlap=["cool_down"])).plan
    soaks = sum(step.action == "soak" for step in plain.steps)
    assert plain.time_s - overlapped.time_s == pytest.approx(soaks * 900)  # 15 min at each temperature
    cool_downs = [sum(s.action == "cool_down" for s in p.steps) for p in (plain, overlapped)]
    assert cool_downs[0] - cool_downs[1] == soaks
    assert [(s.rule, s.hours) for s in overlapped.savings] == [("overlap", soaks / 4)]


def test_the_unit_has_cooled_down_before_the_next_bench_switches_it_on():
    """The first bench lets go of the unit at once: what of the cool-down nothing covers is waited."""
    spec = with_plan(small(), overlap=["cool_down"])
    bench = spec["benches"]["rate_table"] | {"install": "0 s"}
    other = {"kind": "rate_table", "install": "4 min"}
    spec["benches"] = {"rate_table": bench, "second": other}
    more = spec["tests"]["gyro_drift"] | {"bench": "second", "temperatures": "room", "repeats": 1}
    spec["tests"] = spec["tests"] | {"again": more}
    timeline = planned(spec).plan.steps
    wait = next(step for step in timeline if step.id == "rate_table/room/cool_down")
    assert wait.end_s - wait.start_s == (15 - 4) * 60


def test_the_genetic_algorithm_never_beats_the_proof_with_overlap():
    for seed in (1, 2):
        rng = np.random.default_rng(seed)
        spec = with_plan(
            with_limit(laboratory(rng), "12 m"), overlap=["cool_down"], genetic={"generations": 20}
        )
        plan = planned(spec).plan
        assert plan.proved
        assert plan.genetic.time_s >= plan.objective_bound - 1e-6
