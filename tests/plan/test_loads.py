"""Loads of unequal benches: every size that there is, against those that are chosen."""

from __future__ import annotations

from itertools import pairwise, product

import numpy as np
import pytest

from planner.nouns.choices import Campaign, TestVisits
from planner.plan.loads import chosen_loads, total_time
from planner.plan.schedule_to_steps import bench_timings, makespan, steps
from planner.spec.copies import copies, with_copies
from tests.specs import loaded, small, with_plan

HOUR = 3600.0


def shop(hours, sizes, units, **plan):
    """A spec whose i-th bench takes a load for hours[i] and holds sizes[i]; its visits."""
    spec = with_plan(small(), units=units, **plan)
    names = [f"bench_{i}" for i in range(len(hours))]
    spec["benches"] = {n: {"kind": "rate_table", "units": size} for n, size in zip(names, sizes, strict=True)}
    test = {"calibrates": ["gyro.bias", "accelerometer.bias"], "temperatures": "room"}
    spec["tests"] = {
        f"test_{name}": test | {"bench": name, "record": f"{h} h"}
        for name, h in zip(names, hours, strict=True)
    }
    found = loaded(spec).spec
    return found, [TestVisits(f"test_{name}", (20.0,), (1,)) for name in names]


def all_sizes(spec, timings):
    """The least total of all load sizes that there are."""
    names = [t.work.bench for t in timings]
    units = spec.plan.units
    best = np.inf
    for sizes in product(*(range(1, spec.benches[n].units + 1) for n in names)):
        each = {n: [min(s, units - i) for i in range(0, units, s)] for n, s in zip(names, sizes, strict=True)}
        best = min(best, total_time(timings, each))
    return best


@pytest.mark.parametrize("seed", range(12))
def test_chosen_loads_against_all(seed):
    rng = np.random.default_rng([seed, 46])
    benches = int(rng.integers(2, 4))
    hours = rng.integers(1, 13, benches).tolist()
    spec, visits = shop(hours, rng.integers(1, 7, benches).tolist(), int(rng.integers(3, 21)))
    timings = bench_timings(spec, visits)
    least = all_sizes(spec, timings)
    assert makespan(spec, visits) <= 1.05 * least + 1e-6  # 4 % at most in a thousand of them
    assert makespan(spec, visits) >= least - 1e-6


def test_large_benches_are_not_filled_by_what_the_least_one_takes():
    """4, 6 and 10 places, the large one slow: five loads of ten, thirteen of four in its shadow."""
    spec, visits = shop([1.0, 1.0, 12.0], [4, 6, 10], 50)
    timings = bench_timings(spec, visits)
    assert chosen_loads(spec, timings)["bench_2"] == 10
    hours = makespan(spec, visits) / HOUR
    assert hours == pytest.approx(5 * 12.0 + 3.0 + 1.0, abs=0.1)  # ten units take three loads of the first
    assert hours < 0.5 * 13 * 12.0  # batches of four


def test_one_more_bench_of_a_kind_halves_the_bottleneck():
    spec, visits = shop([1.0, 6.0], [4, 4], 40)
    now, more = makespan(spec, visits), makespan(spec, visits, count={"bench_1": 2})
    assert now == pytest.approx((1 + 10 * 6) * HOUR)
    assert more == pytest.approx((1 + 5 * 6 + 1) * HOUR)


@pytest.mark.parametrize(("units", "count"), [(40, 2), (40, 3), (3, 2), (5, 4)])
def test_benches_of_a_kind_take_loads_in_turn(units, count):
    """`count` in the spec: the total of as many benches; none has two loads at once."""
    spec, visits = shop([1.0, 6.0], [4, 4], units)
    benches = {
        n: b.model_copy(update={"count": count if n == "bench_1" else 1}) for n, b in spec.benches.items()
    }
    many = with_copies(spec.model_copy(update={"benches": benches}))
    made = steps(many, Campaign(tuple(visits), (), 0.0, 0.0, False))
    assert max(s.end_s for s in made) == pytest.approx(makespan(spec, visits, count={"bench_1": count}))
    assert {s.bench for s in made} <= {"bench_0", *copies("bench_1", count)}
    assert all(s.bench in s.id.split("/") for s in made)
    for bench in {s.bench for s in made}:
        own = [s for s in made if s.bench == bench]
        assert all(a.end_s <= b.start_s + 1e-6 for a, b in pairwise(own))


def test_an_hour_of_work_on_many_benches_is_an_hour():
    spec, visits = shop([1.0], [1], 7)
    one = {"bench_0": spec.benches["bench_0"].model_copy(update={"count": 7})}
    assert makespan(spec.model_copy(update={"benches": one}), visits) == pytest.approx(HOUR)
    assert makespan(spec, visits) == pytest.approx(7 * HOUR)
