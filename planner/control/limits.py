"""A plan against its benches: axes, rates, loads, stops, temperatures, and no two steps at once."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

from planner.control.orders import MotionError, UnknownArmError, motion_faults
from planner.nouns.bench import BenchFacts
from planner.nouns.step import Step
from planner.spec.axis_travel import travel_faults

_SAME_S = 1e-6
Wrong = tuple[Step, str]


def by_bench(steps: Sequence[Step]) -> dict[str, list[Step]]:
    """Every bench that has steps, with its own in the order of time."""
    found: dict[str, list[Step]] = {}
    for step in steps:
        found.setdefault(step.bench, []).append(step)
    return {bench: sorted(own, key=lambda s: (s.start_s, s.end_s)) for bench, own in found.items()}


def faults(
    benches: Mapping[str, BenchFacts], steps: Sequence[Step], *, arms_known: bool = False
) -> Iterator[Wrong]:
    """(step, what is wrong) of steps that their bench cannot make, bench by bench.

    No such bench or axis; rate, load or temperature beyond the limits; stops in the way; steps that overlap.
    arms_known: whether a load on an arm of unknown length is wrong too: somebody must turn it at a rate
    """
    for name, own in by_bench(steps).items():
        bench = benches.get(name)
        if bench is None:
            yield own[0], f"no bench '{name}' in the plan; it has {', '.join(benches) or 'none'}"
            continue
        yield from _each(bench, own, arms_known)
        yield from _overlaps(own)
        yield from travel_faults(own, bench.travel, bench.angular_acceleration_dps2)


def _each(bench: BenchFacts, steps: Sequence[Step], arms_known: bool) -> Iterator[Wrong]:
    known: dict[tuple[tuple[str, float], ...], list[MotionError]] = {}  # thousands of steps share few motions
    for step in steps:
        wrong = _temperature(bench, step.temperature_degc)
        if wrong:
            yield step, wrong
        key = tuple((step.motion or {}).items())
        if key not in known:
            known[key] = list(motion_faults(step.motion, bench))
        for fault in known[key]:
            if arms_known or not isinstance(fault, UnknownArmError):
                yield step, str(fault)


def _temperature(bench: BenchFacts, t: float | None) -> str | None:
    if t is None or t == bench.room_degc:
        return None
    if bench.chamber is None:
        return f"{t:g} degC, but {bench.name} has no chamber"
    low, high = bench.chamber.coldest_degc, bench.chamber.hottest_degc
    return None if low <= t <= high else f"{t:g} degC is outside the chamber's {low:g} .. {high:g} degC"


def _overlaps(steps: Sequence[Step]) -> Iterator[Wrong]:
    now = -math.inf
    for step in steps:
        if step.start_s < now - _SAME_S:
            yield step, "starts before the bench has done the step before it"
        now = max(now, step.end_s)
