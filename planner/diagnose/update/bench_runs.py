"""What the spec's benches can do in one power-on, as the conditions of its records.

The tests of the spec as they stand, and what they do not do: rests on all faces, a long watch of one rest,
turns at all rates, loads, a rest while the chamber ramps; at the ends and in the middle of the temperatures,
now and a month later. All within the limits of bench and chamber.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from planner import catalog
from planner.campaign.design import DEFAULT_LATITUDE
from planner.campaign.exposure import exposure, mounting
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions, in_records
from planner.plan.bench_work import ramp_time, ways_aside
from planner.plan.motions_to_records import record_middles
from planner.spec.attendance import record_time
from planner.spec.model import Bench, Spec, Test
from planner.spec.motions import motions_of
from planner.spec.ramp import rates_of

LATER_DAYS = 30.0  # a month: what ages or steps between power-ons has moved by then
WATCH_S = (15.0, 60.0, 150.0, 300.0, 600.0, 1200.0, 2400.0, 3600.0)  # ends of the records of a long watch
RECORD_S = 60.0  # of a rest where the spec has no test to be like
RAMP_RECORDS = 3  # tell the slope of a ramp from a curve
_STANDARD: Mapping[str, tuple[str, int]] = {  # what it is called -> what it would calibrate, records
    "rests": ("accelerometer.bias", 6),
    "turns": ("gyro.scale_factor", 30),
    "loads": ("gyro.g_sensitivity", 16),
}
_NEEDS = {"turns": "rate", "loads": "acceleration", "rests": "gravity"}
_ARM = "acceleration"  # a bench that loads the unit neither rests nor only turns


@dataclass(frozen=True)
class BenchRun:
    """One power-on of one unit: what is done, and the conditions of its m records.

    what: a test of the spec, or `rests`, `turns`, `loads`, `watch`, `ramp`; test: its name, or ""
    duration: (m,) s; repeat_s: one repeat; once_s: install, ramps and soak, paid once
    """

    bench: str
    what: str
    test: str
    motions: tuple[Mapping[str, float], ...]
    conditions: Conditions
    duration: Array
    repeat_s: float
    once_s: float


def bench_runs(spec: Spec, temperatures_degc: Sequence[float], day: float) -> list[BenchRun]:
    """Every run worth considering; temperatures_degc: those of the data; day: the last one of the data."""
    return [
        dated
        for name, bench in spec.benches.items()
        if (bench.kind or name) in catalog.benches()
        for at in _temperatures(spec, bench, temperatures_degc)
        for run in _runs(spec, name, bench, at, day)
        for dated in (run, _later(run))
    ]


def run_of_test(spec: Spec, name: str, temperature_degc: float | None = None, day: float = 0.0) -> BenchRun:
    """One repeat of a test of the spec."""
    test = spec.tests[name]
    bench = spec.benches[test.bench]
    at = spec.plan.temperatures.room if temperature_degc is None else temperature_degc
    found = [m or {} for m in motions_of(test.bench, bench, test)]
    return _run(spec, test.bench, name, name, found, test, at, day)


def standard_run(spec: Spec, bench: str, what: str, day: float = 0.0) -> BenchRun | None:
    """One power-on of `rests`, `turns` or `loads` on a bench; None when its kind cannot."""
    found = spec.benches[bench]
    kind = catalog.benches().get(found.kind or bench)
    if kind is None or _NEEDS[what] not in kind.excites or (_ARM in kind.excites) != (what == "loads"):
        return None
    error, count = _STANDARD[what]
    test = _like(spec, bench, error, count)
    motions = [m or {} for m in motions_of(bench, found, test)]
    return _run(spec, bench, what, "", motions, test, spec.plan.temperatures.room, day)


def run_of_trial(spec: Spec, bench: str, error: str, count: int) -> BenchRun:
    """One repeat of a test of `count` standard motions that would calibrate an error on a bench."""
    test = _like(spec, bench, error, count)
    motions = [m or {} for m in motions_of(bench, spec.benches[bench], test)]
    return _run(spec, bench, "trial", "", motions, test, spec.plan.temperatures.room, 0.0)


def _runs(spec: Spec, name: str, bench: Bench, at: float, day: float) -> Iterator[BenchRun]:
    for test in spec.tests:
        if spec.tests[test].bench == name:
            yield run_of_test(spec, test, at, day)
    for what in _STANDARD:
        run = standard_run(spec, name, what, day)
        if run is not None:
            yield _at(spec, run, at)
    yield _watch(spec, name, at, day)
    yield from _ramps(spec, name, bench, at, day)


def _later(run: BenchRun) -> BenchRun:
    return replace(run, conditions=replace(run.conditions, day=run.conditions.day + LATER_DAYS))


def _temperatures(spec: Spec, bench: Bench, seen: Sequence[float]) -> tuple[float, ...]:
    """The coldest, the middle and the warmest of the data's temperatures that the chamber reaches."""
    room = spec.plan.temperatures.room
    if bench.chamber is None:
        return (room,)
    low, high = bench.chamber.range
    inside = sorted({round(t) for t in seen if low <= t <= high})
    if not inside:
        return (room,)
    return tuple(float(t) for t in sorted({inside[0], inside[len(inside) // 2], inside[-1]}))


def _like(spec: Spec, bench: str, error: str, count: int, record: float | None = None) -> Test:
    """A test of a bench with the manners of the spec's tests there."""
    others = [t for t in spec.tests.values() if t.bench == bench]
    return Test.model_construct(
        bench=bench,
        calibrates=(error,),
        motions=count,
        record=record or max((t.record for t in others), default=RECORD_S),
        gap=0.0,
        power_on=max((t.power_on for t in others), default=0.0),
        cool_down=max((t.cool_down for t in others), default=0.0),
        temperatures=None,
        repeats=None,
        attended=None,
    )


def _run(
    spec: Spec,
    bench: str,
    what: str,
    test: str,
    motions: Sequence[Mapping[str, float]],
    like: Test,
    at: float,
    day: float,
) -> BenchRun:
    b = spec.benches[bench]
    m = len(motions)
    seen = [
        exposure(motion, like.record, DEFAULT_LATITUDE, arm=b.arm, mount=mounting(k, m, b.axes))
        for k, motion in enumerate(motions)
    ]
    means = Conditions(
        rate=np.array([e.rate for e in seen]),
        specific_force=np.array([e.specific_force for e in seen]),
        temperature_degc=np.full(m, at),
        temperature_rate=np.array(list(rates_of(like, m))),
        time_on=record_middles(b, like, m),
        day=np.full(m, day),
    )
    repeat = like.power_on + m * record_time(b, like) + like.cool_down + sum(ways_aside(spec, like))
    duration = np.full(m, like.record)
    conditions = in_records(means, duration)
    return BenchRun(bench, what, test, tuple(motions), conditions, duration, repeat, _once(spec, bench, at))


def _at(spec: Spec, run: BenchRun, at: float) -> BenchRun:
    warm = replace(run.conditions, temperature_degc=np.full(len(run.duration), at))
    return replace(run, conditions=warm, once_s=_once(spec, run.bench, at))


def _once(spec: Spec, bench: str, at: float) -> float:
    b, room = spec.benches[bench], spec.plan.temperatures.room
    chamber = b.chamber
    if chamber is None:
        return b.install + b.remove
    return b.install + b.remove + ramp_time(chamber, room, at) + chamber.soak + ramp_time(chamber, at, room)


def _watch(spec: Spec, bench: str, at: float, day: float) -> BenchRun:
    """One rest for an hour from power-on, records closer together at its beginning."""
    run = _run(spec, bench, "watch", "", [{}] * len(WATCH_S), _like(spec, bench, "gyro.bias", 1), at, day)
    ends = np.array(WATCH_S)
    duration = np.minimum(np.diff(np.concatenate([[0.0], ends])), RECORD_S)
    cool_down = _like(spec, bench, "gyro.bias", 1).cool_down
    return replace(
        run,
        conditions=replace(run.conditions, time_on=ends - duration / 2.0),
        duration=duration,
        repeat_s=float(ends[-1]) + cool_down,
    )


def _ramps(spec: Spec, name: str, bench: Bench, at: float, day: float) -> Iterator[BenchRun]:
    """A rest while the chamber goes through a temperature, up and down."""
    chamber = bench.chamber
    if chamber is None:
        return
    for speed, sign in ((chamber.heating, 1.0), (chamber.cooling, -1.0)):
        if not speed:
            continue
        like = _like(spec, name, "gyro.bias", 1, min(RECORD_S, 4.0 / speed))
        run = _run(spec, name, "ramp", "", [{}] * RAMP_RECORDS, like, at, day)
        drift = sign * speed * (run.conditions.time_on - run.conditions.time_on.mean())
        yield replace(
            run,
            conditions=replace(
                run.conditions,
                temperature_degc=np.clip(at + drift, *chamber.range),
                temperature_rate=np.full(RAMP_RECORDS, sign * speed),
            ),
        )
