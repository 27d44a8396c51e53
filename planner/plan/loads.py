"""How many units each bench takes at once, and when they leave it: a flow shop of unequal benches.

Units go through the benches in the order of the spec. A bench takes a load when it is free and all units of
the load have left the bench before; how long it takes does not depend on how many they are. Full loads are
the fewest; smaller ones let the next bench begin earlier. Which it is decides the total time.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import accumulate
from types import MappingProxyType

from planner.plan.bench_timing import BenchTiming
from planner.spec.model import Spec

EVEN = 4  # numbers of even loads that are tried
PASSES = 3  # over the benches, each size chosen given the others
SOONER_S = 1e-6


def load_sizes(spec: Spec, timings: Sequence[BenchTiming]) -> dict[str, tuple[int, ...]]:
    """Bench -> units of each of its loads, of the least total time found; without `plan.units` one load."""
    return _sizes(spec, timings, chosen_loads(spec, timings))


def chosen_loads(spec: Spec, timings: Sequence[BenchTiming]) -> dict[str, int]:
    """Bench -> how many units it takes at once: downhill from full loads, and from equal ones."""
    names = [timing.work.bench for timing in timings]
    full = {name: spec.benches[name].units for name in names}
    if spec.plan.units is None or len(names) < 2:
        return full
    starts = [full, dict.fromkeys(names, min(full.values()))]
    found = [_downhill(spec, timings, each) for each in starts[: 1 if starts[0] == starts[1] else 2]]
    return min(found, key=lambda one: one[0])[1]


def _downhill(
    spec: Spec, timings: Sequence[BenchTiming], each: dict[str, int]
) -> tuple[float, dict[str, int]]:
    """(total, sizes) when no other size of one bench is done sooner."""
    least = total_time(timings, _sizes(spec, timings, each))
    for _ in range(PASSES):
        before = dict(each)
        for name in before:
            for size in _worth_trying(spec, list(before), name):
                other = each | {name: size}
                found = total_time(timings, _sizes(spec, timings, other))
                if found < least - SOONER_S:
                    each, least = other, found
        if each == before:
            break
    return least, each


def _worth_trying(spec: Spec, names: Sequence[str], name: str) -> list[int]:
    """Capacities of other benches, and even loads, from the fewest on."""
    most, units = spec.benches[name].units, spec.plan.units or 1
    fewest = math.ceil(units / most)
    even = {math.ceil(units / number) for number in range(fewest, fewest + EVEN)}
    return sorted(even | {n for other in names if (n := spec.benches[other].units) <= most})


def _sizes(spec: Spec, timings: Sequence[BenchTiming], each: Mapping[str, int]) -> dict[str, tuple[int, ...]]:
    units = spec.plan.units
    return {
        name: (each[name],)
        if units is None
        else tuple(min(each[name], units - i) for i in range(0, units, each[name]))
        for name in (timing.work.bench for timing in timings)
    }


def begins(
    timings: Sequence[BenchTiming],
    sizes: Mapping[str, Sequence[int]],
    count: Mapping[str, int] = MappingProxyType({}),
) -> dict[str, list[tuple[float, int]]]:
    """Bench -> when each of its loads is put on, s, and on which of its copies.

    count: of benches, instead of how many the spec has
    """
    left: list[tuple[int, float]] = []  # up to which unit, when they have left the bench before
    found: dict[str, list[tuple[float, int]]] = {}
    for timing in timings:
        name, place = timing.work.bench, 0
        free = [(0.0, copy) for copy in range(count.get(name, timing.count))]
        own = list[tuple[int, float]]()
        found[name] = []
        for last in accumulate(sizes[name]):
            while place < len(left) - 1 and left[place][0] < last:
                place += 1
            since, copy = free[0]
            begin = max(since, left[place][1] if left else 0.0)
            end = timing.end(begin)
            free = sorted([*free[1:], (end, copy)])
            found[name].append((begin, copy))
            own.append((last, end))
        left = own
    return found


def total_time(
    timings: Sequence[BenchTiming],
    sizes: Mapping[str, Sequence[int]],
    count: Mapping[str, int] = MappingProxyType({}),
) -> float:
    """Seconds until the last load has left the last bench."""
    if not timings:
        return 0.0
    last = timings[-1]
    return last.end(begins(timings, sizes, count)[last.work.bench][-1][0])
