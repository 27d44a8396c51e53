"""Chosen temperatures and repeats → the timeline: every step on every bench, in order, with its times.

The unit goes from bench to bench in the order of the spec. On a bench: install; what is done in the room;
then the temperatures in the order of least chamber travel, each a ramp, a soak and its tests; back to the
room; remove. One repeat of a test is one power-on (the run-to-run spread is what repeats average):
power_on, then for each motion a move, a record and a gap; the unit is off during the last gap and the
cool-down of the repeat.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from planner import catalog
from planner.plan.by_hand import in_room
from planner.plan.costs import repeat_power_on
from planner.protocols import BenchKind
from planner.records import Campaign, PlannedTest, Step, TestVisits
from planner.solvers.ordering import sweep
from planner.spec.model import Bench, Chamber, Motion, Spec, Test
from planner.units import from_si


@dataclass(frozen=True)
class Action:
    """A step before it has a place in time."""

    id: str
    action: str
    seconds: float
    test: str | None = None
    temperature_degc: float | None = None
    repeat: int | None = None
    motion: Mapping[str, float] | None = None


def steps(spec: Spec, campaign: Campaign) -> tuple[Step, ...]:
    """The whole campaign, benches one after the other, times in seconds from its start."""
    clock, found = 0.0, []
    for name, bench in spec.benches.items():
        visits = [visit for visit in campaign.visits if spec.tests[visit.test].bench == name]
        if not visits:
            continue
        for a in _bench_actions(spec, name, visits):
            found.append(
                Step(
                    id=a.id,
                    bench=name,
                    action=a.action,
                    start_s=clock,
                    end_s=clock + a.seconds,
                    test=a.test,
                    temperature_degc=a.temperature_degc,
                    repeat=a.repeat,
                    motion=a.motion,
                    units=bench.units,
                )
            )
            clock = found[-1].end_s
    return tuple(found)


def planned_tests(spec: Spec, campaign: Campaign, timeline: Sequence[Step]) -> tuple[PlannedTest, ...]:
    """What each test does and how long its own steps take, without installing, ramps and soaks."""
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
            time_s=round(time[visit.test], 6),
            power_on_s=round(sum(visit.repeats) * repeat_power_on(spec, spec.tests[visit.test]), 6),
            calibrates=spec.tests[visit.test].calibrates,
            motions=spec.tests[visit.test].motion_count,
        )
        for visit in campaign.visits
    )


def _bench_actions(spec: Spec, name: str, visits: Sequence[TestVisits]) -> Iterator[Action]:
    bench, room = spec.benches[name], spec.plan.temperatures.room
    if bench.install:
        yield Action(f"{name}/install", "install", bench.install, temperature_degc=room)
    for visit in visits:
        if in_room(spec, visit.test):
            yield from _test_actions(spec, visit.test, room, visit.repeats[0], place="room")
    if bench.chamber is not None:
        yield from _chamber_actions(spec, name, bench.chamber, visits)
    if bench.remove:
        yield Action(f"{name}/remove", "remove", bench.remove, temperature_degc=room)


def _chamber_actions(
    spec: Spec, name: str, chamber: Chamber, visits: Sequence[TestVisits]
) -> Iterator[Action]:
    inside = [visit for visit in visits if not in_room(spec, visit.test)]
    room = now = spec.plan.temperatures.room
    for t in sweep(sorted({t for visit in inside for t in visit.temperatures_degc})):
        place = temperature_name(t)
        ramp = _ramp_time(chamber, now, t)
        if ramp:
            yield Action(f"{name}/{place}/ramp", "ramp", ramp, temperature_degc=t)
        if chamber.soak:
            yield Action(f"{name}/{place}/soak", "soak", chamber.soak, temperature_degc=t)
        for visit in inside:
            if t in visit.temperatures_degc:
                repeats = visit.repeats[visit.temperatures_degc.index(t)]
                yield from _test_actions(spec, visit.test, t, repeats, place)
        now = t
    back = _ramp_time(chamber, now, room)
    if back:
        yield Action(f"{name}/room/ramp", "ramp", back, temperature_degc=room)


def _test_actions(spec: Spec, name: str, t: float, repeats: int, place: str) -> Iterator[Action]:
    test = spec.tests[name]
    bench = spec.benches[test.bench]
    motions = _motions(spec, test)
    for r in range(1, repeats + 1):
        run = f"{test.bench}/{place}/{name}/r{r:02d}"
        blank = Action(run, "", 0.0, name, t, r)
        yield replace(blank, id=f"{run}/power_on", action="power_on", seconds=test.power_on)
        for m, motion in enumerate(motions, start=1):
            last = m == len(motions)
            if motion is not None or bench.move:
                yield replace(blank, id=f"{run}/m{m}/move", action="move", seconds=bench.move, motion=motion)
            yield replace(blank, id=f"{run}/m{m}", action="record", seconds=test.record, motion=motion)
            if last:
                yield replace(blank, id=f"{run}/power_off", action="power_off")
            action, seconds = ("cool_down", test.gap + test.cool_down) if last else ("pause", test.gap)
            if seconds:
                yield replace(blank, id=f"{run}/m{m}/{action}", action=action, seconds=seconds)


def _ramp_time(chamber: Chamber, start: float, end: float) -> float:
    speed = chamber.heating if end > start else chamber.cooling
    return abs(end - start) / speed if speed else 0.0


def temperature_name(t: float) -> str:
    """A temperature as it stands in step ids: `-30`, `-51.43`."""
    return f"{round(t, 2):g}"


def _motions(spec: Spec, test: Test) -> Sequence[Mapping[str, float] | None]:
    """The test's motions by axis; standard motions of the kind of bench when the spec only counts them."""
    if isinstance(test.motions, int):
        bench = spec.benches[test.bench]
        kind = catalog.benches()[bench.kind or test.bench] if _has_kind(spec, test.bench) else None
        return [None] * test.motions if kind is None else _standard_motions(kind, bench, test)
    return [_by_axis(motion) for motion in test.motions]


def _standard_motions(kind: BenchKind, bench: Bench, test: Test) -> Sequence[Mapping[str, float]]:
    limits = bench.limits
    return kind.motions(
        test.motion_count,
        bench.axes,
        calibrates=test.calibrates,
        rate_limit_dps=math.inf if limits.rate is None else from_si(limits.rate, "deg/s"),
        load_limit_g=math.inf if limits.acceleration is None else from_si(limits.acceleration, "g"),
    )


def _has_kind(spec: Spec, bench: str) -> bool:
    return (spec.benches[bench].kind or bench) in catalog.benches()


def _by_axis(motion: Motion) -> Mapping[str, float]:
    units = {"position": ("deg", "deg"), "rate": ("deg/s", "dps"), "acceleration": ("g", "g")}
    found = {}
    for key, value in motion.model_dump(exclude_none=True).items():
        unit, suffix = units[key.split("_")[0]]
        found[f"{key}_{suffix}"] = round(from_si(value, unit), 9)
    return found
