"""Chosen temperatures and repeats → the timeline: every step on every bench, in order, with its times.

The unit goes from bench to bench in the order of the spec. On a bench: install; what is done in the room;
then the temperatures, each a ramp, a soak and its tests; back to the room; remove. Without working hours the
temperatures come in the order of least chamber travel; with them in the order that is finished first.
Several units go through the benches in loads, each bench in its own (planner.plan.loads): a load is put on
as soon as its units have left the bench before and the bench is free. A step that needs people waits for a
shift; the waiting is a `pause` on the bench.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING

from planner.nouns.choices import Campaign, TestVisits
from planner.nouns.step import Step
from planner.plan.bench_timing import BenchTiming
from planner.plan.bench_work import (
    Action,
    BenchWork,
    Block,
    bench_work,
    ramp_action,
    ramp_time,
    stop_blocks,
    temperature_name,
)
from planner.plan.costs import repeat_power_on
from planner.plan.loads import begins, load_sizes, total_time
from planner.spec.attendance import is_attended
from planner.spec.copies import copies
from planner.spec.model import Spec

if TYPE_CHECKING:  # `check` lays steps and makes no plan, whose records take 15 ms to define
    from planner.nouns.plan import PlannedTest


def steps(spec: Spec, campaign: Campaign, *, first_only: bool = False) -> tuple[Step, ...]:
    """The whole campaign in the order of its starts, times in seconds from its start.

    first_only: of every bench's first load alone, which is all that one unit meets
    """
    timings = bench_timings(spec, campaign.visits)
    sizes = load_sizes(spec, timings)
    begun, several = begins(timings, sizes), max((len(own) for own in sizes.values()), default=1) > 1
    found: list[Step] = []
    for timing in timings:
        name = timing.work.bench
        each = copies(name, timing.count)
        loads = list(zip(sizes[name], begun[name], strict=True))
        for number, (units, (begin, copy)) in enumerate(loads[:1] if first_only else loads, start=1):
            prefix = f"b{number:02d}/" if several else ""
            own = _on_bench(spec, timing, begin, prefix, units)
            found += (_elsewhere(step, name, each[copy]) for step in own) if copy else own
    place = {name: i for i, name in enumerate(spec.benches)}
    return tuple(sorted(found, key=lambda s: (s.start_s, place[s.bench]))) if several else tuple(found)


def bench_timings(spec: Spec, visits: Sequence[TestVisits]) -> list[BenchTiming]:
    """The benches that are used, in the order of the spec."""
    found = []
    for name in spec.benches:
        own = [visit for visit in visits if spec.tests[visit.test].bench == name]
        if own:
            found.append(BenchTiming(spec, bench_work(spec, name, own)))
    return found


def makespan(
    spec: Spec,
    visits: Sequence[TestVisits],
    *,
    in_parallel: bool = True,
    count: Mapping[str, int] = MappingProxyType({}),
) -> float:
    """Seconds until the last load has left the last bench, without laying out the steps.

    in_parallel: benches work on different units; else a load waits until the one before has gone
    count: of benches, instead of how many the spec has
    """
    timings = bench_timings(spec, visits)
    sizes = load_sizes(spec, timings)
    if in_parallel:
        return total_time(timings, sizes, count)
    clock = 0.0
    for _ in range(max((len(own) for own in sizes.values()), default=1)):
        for timing in timings:
            clock = timing.end(clock)
    return clock


def planned_tests(
    spec: Spec, visits: Sequence[TestVisits], timeline: Sequence[Step]
) -> tuple[PlannedTest, ...]:
    """What each test does and how long its own steps take for one load, without ramps, soaks, installing."""
    from planner.nouns.plan import PlannedTest

    loads = {name: len(own) for name, own in load_sizes(spec, bench_timings(spec, visits)).items()}
    time = dict.fromkeys(spec.tests, 0.0)
    for step in timeline:
        if step.test is not None:
            time[step.test] += step.end_s - step.start_s
    return tuple(
        PlannedTest(
            test=visit.test,
            bench=spec.tests[visit.test].bench,
            temperatures_degc=visit.temperatures_degc,
            repeats=visit.repeats,
            time_s=round(time[visit.test] / loads[spec.tests[visit.test].bench], 6),
            power_on_s=round(sum(visit.repeats) * repeat_power_on(spec, spec.tests[visit.test]), 6),
            calibrates=spec.tests[visit.test].calibrates,
            motions=spec.tests[visit.test].motion_count,
            attended=is_attended(spec, visit.test),
        )
        for visit in visits
    )


def _on_bench(spec: Spec, timing: BenchTiming, ready: float, prefix: str, units: int) -> Iterator[Step]:
    """One batch on one bench, from `ready` on."""
    clock, now = ready, spec.plan.temperatures.room
    for block in _blocks(spec, timing, timing.order(ready)):
        begin = timing.begin(block, clock)
        if begin > clock:
            wait = Action(f"{block.actions[0].id}/wait", "pause", 0.0, temperature_degc=now)
            yield _step(wait, timing.work, clock, begin, prefix, units)
            clock = begin
        for action in block.actions:
            end = clock + action.seconds
            yield _step(action, timing.work, clock, end, prefix, units)
            clock, now = end, now if action.temperature_degc is None else action.temperature_degc


def _elsewhere(step: Step, bench: str, copy: str) -> Step:
    """The step on another bench of the same kind."""
    head, _, rest = step.id.partition(f"{bench}/")
    return replace(step, id=f"{head}{copy}/{rest}", bench=copy)


def _blocks(spec: Spec, timing: BenchTiming, order: Sequence[int]) -> Iterator[Block]:
    work, room = timing.work, spec.plan.temperatures.room
    name, chamber, now = work.bench, spec.benches[work.bench].chamber, room
    yield from work.before
    for k in order:
        assert chamber is not None  # only benches with a chamber have stops
        t = work.stops[k].temperature_degc
        place = temperature_name(t)
        ramp = ramp_time(chamber, now, t)
        if ramp:
            yield ramp_action(name, place, t, ramp)
        if chamber.soak:
            yield Block((Action(f"{name}/{place}/soak", "soak", chamber.soak, temperature_degc=t),))
        yield from stop_blocks(spec, name, work.stops[k])
        now = t
    if chamber and (back := ramp_time(chamber, now, room)):
        yield ramp_action(name, "room", room, back)
    yield from work.after


def _step(a: Action, work: BenchWork, start: float, end: float, prefix: str, units: int) -> Step:
    return Step(
        id=f"{prefix}{a.id}",
        bench=work.bench,
        action=a.action,
        start_s=start,
        end_s=end,
        test=a.test,
        temperature_degc=a.temperature_degc,
        repeat=a.repeat,
        motion=a.motion,
        units=units,
        attended=a.attended,
        temperature_rate_degc_min=a.temperature_rate_degc_min,
    )
