"""Temperatures ordered under shifts, and batches passed through benches: the answer first, then the time.

Orders of up to seven temperatures are compared with every permutation; those of nine with a second method
that shares no table with the first, a depth-first search with bounds over the same laboratory, laid out shift
by shift (it would take minutes for fifteen). The order of fifteen is laid out again in the same way, and no
exchange of two temperatures and no move of one makes it shorter. Batches are equal, so nothing is gained by
another sequence: their passage is compared with the closed form of a flow shop of equal jobs and, with
shifts, with a recount that opens and closes the laboratory by the clock.

    python benchmarks/bench_schedule.py
"""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise, permutations
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))  # the small specs are the tests' own

from planner.nouns.choices import Campaign, TestVisits
from planner.plan.schedule_to_steps import makespan, steps
from planner.solvers.calendar import Calendar, calendar, constant
from planner.solvers.ordering import Stops, best_order
from planner.spec.model import Spec
from tests.specs import loaded, small, with_plan

HOUR, DAY = 3600.0, 86400.0
SEEDS = (1, 2, 3, 4, 5)
TEMPERATURES = 15
SEARCHED = 9
ROOM = 20.0
UP, DOWN, SOAK = 240.0, 120.0, 1800.0  # K/h and seconds: 4 and 2 K/min, 30 min, as the published chamber
START = 8 * HOUR  # Monday
REQUIRED_ORDER_S = 0.2
REQUIRED_BATCHES_S = 0.2
BATCHES = 5


@dataclass(frozen=True)
class Laboratory:
    """Work at every temperature: `repeats` of a powered record that people begin, then a cool-down."""

    temperatures: np.ndarray
    repeats: np.ndarray
    hours: Calendar
    windows: tuple[tuple[float, float], ...]

    powered, attended, off = 800.0, 60.0, 900.0


def laboratory(count: int, seed: int) -> Laboratory:
    """Mondays to Fridays 08:00 to 17:00; 3 to 12 repeats at each temperature."""
    rng = np.random.default_rng(seed)
    windows = tuple((d * DAY + 8 * HOUR, d * DAY + 17 * HOUR) for d in range(5))
    places = np.linspace(-60, 60, count)
    return Laboratory(places, rng.integers(3, 13, count), calendar(7 * DAY, windows), windows)


def stops(lab: Laboratory) -> Stops:
    """What the solver is given, from the chamber's speeds and the tests."""
    t = lab.temperatures
    rise = t[None, :] - t[:, None]
    once = lab.hours.passage([(0.0, lab.attended)], lab.powered).then(constant(lab.off, 7 * DAY))
    return Stops(
        travel(t - ROOM) + SOAK,
        travel(rise) + SOAK,
        travel(ROOM - t),
        [once.times(int(n)) for n in lab.repeats],
    )


def travel(rise: np.ndarray) -> np.ndarray:
    """Seconds of a ramp."""
    return np.where(rise > 0, rise / UP, -rise / DOWN) * HOUR


def laid_out(lab: Laboratory, k: int, t: float) -> float:
    """When the work at temperature k is done, repeat by repeat, by looking at the clock: no passages."""
    for _ in range(int(lab.repeats[k])):
        week, now = divmod(t, 7 * DAY)
        for opens, closes in (*lab.windows, (lab.windows[0][0] + 7 * DAY, math.inf)):
            if now <= closes - lab.attended + 1e-6:
                t = week * 7 * DAY + max(now, opens)
                break
        t += lab.powered + lab.off
    return t


def home_at(lab: Laboratory, order: tuple[int, ...]) -> float:
    """The same for a whole order."""
    t, now = START, ROOM
    for k in order:
        there = float(lab.temperatures[k])
        t = laid_out(lab, k, t + float(travel(np.array(there - now))) + SOAK)
        now = there
    return t + float(travel(np.array(ROOM - now)))


def nothing_is_earlier(lab: Laboratory, target: float) -> bool:
    """Whether no order is home before `target`: depth first, pruned by what is left without any waiting.

    What is left takes at least its work, its soaks, and a way over all remaining temperatures and home. An
    order that has come to the same set and the same last temperature no earlier than another is dropped.
    """
    n = len(lab.temperatures)
    work = lab.repeats * (lab.powered + lab.off) + SOAK
    seen: dict[tuple[int, int], float] = {}
    stack = [(START, ROOM, -1, 0)]
    while stack:
        t, now, last, done = stack.pop()
        left = [k for k in range(n) if not done >> k & 1]
        if not left:
            if t + float(travel(np.array(ROOM - now))) < target - 1e-3:
                return False
            continue
        if t + work[left].sum() + least_way(lab, now, left) >= target - 1e-3:
            continue
        if seen.get((done, last), math.inf) <= t + 1e-9:
            continue
        seen[done, last] = t
        for k in left:
            there = float(lab.temperatures[k])
            ramp = (there - now) / UP if there > now else (now - there) / DOWN
            stack.append((laid_out(lab, k, t + ramp * HOUR + SOAK), there, k, done | 1 << k))
    return True


def least_way(lab: Laboratory, now: float, left: list[int]) -> float:
    """Seconds from `now` over the lowest and the highest that are left, in either order, to the room."""
    low, high = float(lab.temperatures[left[0]]), float(lab.temperatures[left[-1]])

    def way(*places: float) -> float:
        return sum(max(b - a, 0) / UP + max(a - b, 0) / DOWN for a, b in pairwise(places))

    return HOUR * min(way(now, low, high, ROOM), way(now, high, low, ROOM))


def check_small_orders() -> None:
    """Every permutation of up to seven temperatures, laid out by the clock."""
    for count in range(1, 8):
        lab = laboratory(count, count)
        best = min(home_at(lab, order) for order in permutations(range(count)))
        order = best_order(stops(lab), START)
        assert abs(home_at(lab, order) - best) < 1e-3, (count, order)


def batches(hours: np.ndarray, shifts: bool) -> tuple[Spec, tuple[TestVisits, ...]]:
    """Five batches through benches in the room: installed, recorded for these hours, removed."""
    names = [f"bench_{i}" for i in range(len(hours))]
    bench = {"install": "30 min", "remove": "20 min", "kind": "rate_table", "axes": 2, "units": 2}
    errors = (["gyro.bias"], ["accelerometer.bias"], [])
    tests = {
        f"test_{i}": {
            "bench": name,
            "calibrates": errors[i],
            "record": f"{int(h)} h",
            "temperatures": "room",
            "repeats": 2,
        }
        for i, (name, h) in enumerate(zip(names, hours, strict=True))
    }
    raw = with_plan(small(benches=dict.fromkeys(names, bench), tests=tests), units=2 * BATCHES)
    if shifts:
        raw = with_plan(raw, shifts={"from": "08:00", "to": "17:00"})
    return loaded(raw).spec, tuple(TestVisits(name, (ROOM,), (2,)) for name in tests)


def recounted(hours: np.ndarray, shifts: bool) -> float:
    """When the last batch has left the last bench, by looking at the clock."""

    def attended(t: float, seconds: float) -> float:
        while shifts and not any(
            d * DAY + 8 * HOUR - 1e-6 <= (START + t) % (7 * DAY) <= d * DAY + 17 * HOUR - seconds + 1e-6
            for d in range(5)
        ):
            day = math.floor((START + t) / DAY + 1e-9)
            opens = day * DAY + 8 * HOUR - START
            t = opens if opens > t + 1e-6 else opens + DAY
        return t + seconds

    free = np.zeros(len(hours))
    for _ in range(BATCHES):
        ready = 0.0
        for m, h in enumerate(hours):
            done = attended(max(ready, free[m]), 1800.0) + 2 * h * HOUR
            ready = free[m] = attended(done, 1200.0)
    return float(free[-1])


def check_batches() -> None:
    """Σp + (b − 1) max p without shifts; recounted with them; steps end with the makespan."""
    for benches in (2, 3):
        for seed in SEEDS:
            hours = np.random.default_rng(seed).integers(1, 30, benches)
            each = 2 * hours * HOUR + 3000.0
            spec, visits = batches(hours, False)
            assert makespan(spec, visits) == each.sum() + (BATCHES - 1) * each.max()
            spec, visits = batches(hours, True)
            assert abs(makespan(spec, visits) - recounted(hours, True)) < 1e-3
            laid = steps(spec, Campaign(visits, (), 0.0, 0.0, True))
            assert abs(max(step.end_s for step in laid) - makespan(spec, visits)) < 1e-3


def fastest(work: Callable[[], object], times: int = 5) -> float:
    """Seconds of the fastest run: what the machine can do when nobody else asks for it."""
    found = []
    for _ in range(times):
        begin = time.perf_counter()
        work()
        found.append(time.perf_counter() - begin)
    return min(found)


def neighbours(order: tuple[int, ...]) -> Iterator[tuple[int, ...]]:
    """Every exchange of two and every move of one."""
    for i, k in enumerate(order):
        rest = [*order[:i], *order[i + 1 :]]
        for j in range(len(order)):
            yield (*rest[:j], k, *rest[j:])
            swapped = list(order)
            swapped[i], swapped[j] = swapped[j], swapped[i]
            yield tuple(swapped)


def main() -> None:
    """Answers, then times."""
    check_small_orders()
    check_batches()
    for seed in SEEDS[:2]:
        lab = laboratory(SEARCHED, seed)
        assert nothing_is_earlier(lab, home_at(lab, best_order(stops(lab), START)))
    print(f"orders of 1 to 7 temperatures: as good as the best permutation; {BATCHES} batches: likewise")
    for seed in SEEDS:
        lab = laboratory(TEMPERATURES, seed)
        order = best_order(stops(lab), START)
        home = home_at(lab, order)
        assert abs(stops(lab).home_at(order, START) - home) < 1e-3
        assert all(home_at(lab, other) >= home - 1e-3 for other in neighbours(order))
        up = home_at(lab, tuple(range(TEMPERATURES)))
        seconds = fastest(lambda lab=lab: best_order(stops(lab), START))
        print(
            f"{TEMPERATURES} temperatures, seed {seed}: {home / HOUR:.2f} h (upwards {up / HOUR:.2f} h), "
            f"proved in {seconds * 1000:.0f} ms"
        )
        assert seconds < REQUIRED_ORDER_S
    for benches in (2, 3):
        spec, visits = batches(np.random.default_rng(1).integers(1, 30, benches), True)
        seconds = fastest(lambda spec=spec, visits=visits: makespan(spec, visits))
        print(
            f"{BATCHES} batches on {benches} benches, with shifts: "
            f"{makespan(spec, visits) / HOUR:.1f} h, in {seconds * 1e3:.1f} ms"
        )
        assert seconds < REQUIRED_BATCHES_S


if __name__ == "__main__":
    main()
