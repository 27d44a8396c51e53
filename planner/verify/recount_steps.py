"""The steps counted again: what the spec's tests ask for, laid end to end, against what the plan says.

From the spec and the plan's `tests` (temperatures, repeats) every bench's actions follow, with their lengths
(K 2.6, eq. 28). The plan may choose the order of the temperatures within `plan.order`, and nothing else.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

from planner.spec.copies import copies
from planner.spec.model import Spec, Test
from planner.spec.motions import motions_of, turned_by_hand
from planner.verify.findings import Findings, is_same
from planner.verify.recount_hours import earliest
from planner.verify.recount_loads import (
    CLOCK,
    check_sizes,
    loads_by_number,
    loads_of,
    steps_on,
    taken_by,
    used_benches,
)

Document = Mapping[str, Any]


@dataclass(frozen=True)
class Expected:
    """One action as the spec has it; block: of which number, for what must not be torn apart."""

    id: str
    action: str
    seconds: float
    temperature: float | None
    test: str | None = None
    repeat: int | None = None
    motion: Mapping[str, float] | None = None
    attended: bool = False
    block: int = 0
    rate: float | None = None  # K/min of a chamber that moves evenly


def check_steps(document: Document, spec: Spec) -> list[Findings]:
    """Order, durations, places and people of every step; limits of the benches; sums."""
    order = Findings("steps", "every step is one that the spec's tests ask for, in order, as long as it says")
    limits = Findings("limits", "rates, loads, stops, temperatures and ramps within the benches' limits")
    hours = Findings("hours", "what needs people is done in their hours, and waits no longer than it must")
    sums = Findings("sums", "total, power-on hours and the times of the tests are those of the steps")
    steps = list(document["steps"])
    ids = [step["id"] for step in steps]
    for repeated in sorted({i for i in ids if ids.count(i) > 1}) if len(set(ids)) < len(ids) else []:
        order.fault(f"step {repeated}", "occurs more than once")
    if not all(a["start_s"] <= b["start_s"] + CLOCK for a, b in pairwise(steps)):
        order.fault("steps", "are not in the order of their starts")
    sizes = loads_of(document, spec)
    several = max((len(own) for own in sizes.values()), default=1) > 1
    gone: list[tuple[int, float]] = []  # how many units have left the bench before, and when
    for bench in used_benches(document, spec):
        loads = loads_by_number(steps_on(document, spec, bench))
        order.same(f"loads of {bench}", sorted(loads), list(range(1, len(sizes[bench]) + 1)))
        check_sizes(order, spec, bench, sizes[bench])
        free = dict.fromkeys(copies(bench, spec.benches[bench].count), 0.0)
        through, left = 0, list[tuple[int, float]]()
        for number, units in enumerate(sizes[bench], start=1):
            through += units
            ready = next((when for count, when in gone if count >= through), 0.0 if not gone else gone[-1][1])
            own, prefix = loads.get(number, []), f"b{number:02d}/" if several else ""
            on = taken_by(order, own, bench, free)
            begin = max(min(free.values()), ready)
            free[on] = _check_bench(order, hours, document, spec, (bench, on), own, begin, prefix)
            left.append((through, free[on]))
            for step in own:
                order.same(f"step {step['id']}, units", step["units"], units)
        gone = left
    used = {on for bench in used_benches(document, spec) for on in copies(bench, spec.benches[bench].count)}
    for step in steps:
        if step["bench"] not in used:
            order.fault(f"step {step['id']}", f"is on {step['bench']}, on which no test is planned")
        else:
            _check_limits(limits, step, spec)
    _check_sums(sums, document, steps, {bench: len(own) for bench, own in sizes.items()})
    return [order, limits, hours, sums]


# ---------------------------------------------------------------- one batch on one bench


def _check_bench(
    order: Findings,
    hours: Findings,
    document: Document,
    spec: Spec,
    where: tuple[str, str],
    steps: Sequence[Document],
    begin: float,
    prefix: str,
) -> float:
    """Compares step by step; when the load leaves the bench. where: the bench of the tests, the load's own"""
    bench, on = where
    temperatures = _order_of(steps, document, spec, bench)
    _check_order(order, spec, bench, temperatures)
    wanted = [replace(e, id=on + e.id[len(bench) :]) for e in expected(document, spec, bench, temperatures)]
    clock, now, index = begin, spec.plan.temperatures.room, 0
    for i, e in enumerate(wanted):
        if index >= len(steps):
            order.fault(f"{bench}", f"ends before {prefix}{e.id}; {len(wanted) - i} steps are missing")
            return clock
        if i == 0 or wanted[i - 1].block != e.block:
            block = [x for x in wanted[i:] if x.block == e.block]
            clock, index = _waited(hours, order, spec, steps, index, clock, block, prefix, now)
            if index >= len(steps):
                order.fault(f"{bench}", f"ends before {prefix}{e.id}")
                return clock
        step = steps[index]
        _check_step(order, step, e, prefix, clock)
        clock, index = float(step["end_s"]), index + 1
        now = now if e.temperature is None else e.temperature
    for step in steps[index:]:
        order.fault(f"step {step['id']}", "is not asked for by any test of the spec")
    return clock


def _check_step(order: Findings, step: Document, e: Expected, prefix: str, clock: float) -> None:
    where = f"step {step['id']}"
    order.same(f"{where}, id", step["id"], prefix + e.id)
    for key, value in (
        ("action", e.action),
        ("test", e.test),
        ("repeat", e.repeat),
        ("temperature_degc", e.temperature),
        ("attended", e.attended),
        ("motion", e.motion),
    ):
        order.same(f"{where}, {key}", step[key], value)
    order.same(f"{where}, temperature_rate_degc_min", step.get("temperature_rate_degc_min"), e.rate)
    if abs(step["start_s"] - clock) > CLOCK:
        order.fault(where, f"starts at {step['start_s']:.9g} s, the step before it ends at {clock:.9g} s")
    length = step["end_s"] - step["start_s"]
    if abs(length - e.seconds) > CLOCK:
        order.fault(where, f"takes {length:.9g} s, the spec says {e.seconds:.9g} s")


def _order_of(steps: Sequence[Document], document: Document, spec: Spec, bench: str) -> list[float]:
    """The chamber's temperatures in the order in which the plan goes there."""
    if spec.benches[bench].chamber is None:
        return []
    planned = set(chamber_temperatures(document, spec, bench))
    found = []
    for step in steps:
        t = step["temperature_degc"]
        own = step["test"] is not None  # its ramps lead aside, to what may be another's temperature
        named = step["action"] == "record" if own else step["action"] in ("ramp", "soak")
        room = str(step["id"]).split("/")[-2:-1] == ["room"] or "/room/" in str(step["id"])
        if named and not room and t is not None and float(t) in planned and float(t) not in found:
            found.append(float(t))
    return found + sorted(planned - set(found))


def _check_order(order: Findings, spec: Spec, bench: str, found: Sequence[float]) -> None:
    turns = sum((b - a) * (c - b) < 0 for a, b, c in zip(found, found[1:], found[2:], strict=False))
    up, down = list(found) == sorted(found), list(found) == sorted(found, reverse=True)
    allowed = {"up": up, "down": down, "up_and_down": turns <= 1, "free": True}[spec.plan.order]
    if not allowed:
        order.fault(bench, f"temperatures come as {list(found)}, plan.order is {spec.plan.order}")
    least = spec.plan.temperatures.room
    lengths = sum(abs(b - a) for a, b in zip([least, *found], [*found, least], strict=True))
    shortest = 2 * (max([least, *found]) - min([least, *found]))
    if not spec.plan.shifts and lengths > shortest + 1e-6 and spec.plan.order in ("free", "up_and_down"):
        order.fault(bench, f"the chamber travels {lengths:g} K, {shortest:g} K would do")


# ---------------------------------------------------------------- what the spec asks for


def expected(document: Document, spec: Spec, name: str, temperatures: Sequence[float]) -> Iterator[Expected]:
    """The actions of one batch on one bench, without waiting."""
    bench, room = spec.benches[name], spec.plan.temperatures.room
    people = bench.attended is not False
    chamber, now, block = bench.chamber, room, 0
    inside = _chamber_tests(document, spec, name)
    if bench.install:
        yield Expected(f"{name}/install", "install", bench.install, room, attended=people, block=block)
    for test in document["tests"]:
        if test["bench"] == name and in_room(spec, test["test"]):
            for e in _repeats(spec, test["test"], room, test["repeats"][0], "room", block):
                block = e.block
                yield e
    for t in temperatures:
        assert chamber is not None
        place = f"{round(t, 2):g}"
        speed = chamber.heating if t > now else chamber.cooling
        if speed and t != now:
            block += 1
            yield Expected(f"{name}/{place}/ramp", "ramp", abs(t - now) / speed, t, block=block)
        if chamber.soak:
            block += 1
            yield Expected(f"{name}/{place}/soak", "soak", chamber.soak, t, block=block)
        for e in _at_temperature(spec, inside, t, place, block):
            block = e.block
            yield e
        now = t
    if chamber and now != room and (speed := chamber.heating if room > now else chamber.cooling):
        block += 1
        yield Expected(f"{name}/room/ramp", "ramp", abs(room - now) / speed, room, block=block)
    wait = _cool_down_before_leaving(spec, name) if inside else 0.0
    if wait:
        block += 1
        yield Expected(f"{name}/room/cool_down", "cool_down", wait, room, block=block)
    if bench.remove:
        yield Expected(f"{name}/remove", "remove", bench.remove, room, attended=people, block=block + 1)


def in_room(spec: Spec, name: str) -> bool:
    """Whether a test is made at room temperature, outside the chamber's cycle."""
    fixed = spec.plan.fixed.get(name)
    said = fixed.temperatures if fixed is not None and fixed.temperatures is not None else None
    said = spec.tests[name].temperatures if said is None else said
    return said == "room" or (said is None and spec.benches[spec.tests[name].bench].chamber is None)


def chamber_temperatures(document: Document, spec: Spec, bench: str) -> list[float]:
    """Temperatures of the tests that are made in a bench's chamber, the coldest first."""
    return sorted({t for _, ts, _ in _chamber_tests(document, spec, bench) for t in ts})


def _chamber_tests(document: Document, spec: Spec, bench: str) -> list[tuple[str, list[float], list[int]]]:
    """(test, temperatures, repeats) of what is done in the chamber, in the order of the spec."""
    found = {t["test"]: t for t in document["tests"] if t["bench"] == bench}
    return [
        (name, [float(x) for x in found[name]["temperatures_degc"]], list(found[name]["repeats"]))
        for name in spec.tests
        if name in found and not in_room(spec, name) and spec.benches[bench].chamber is not None
    ]


def _at_temperature(
    spec: Spec, tests: Sequence[tuple[str, list[float], list[int]]], t: float, place: str, block: int
) -> Iterator[Expected]:
    """The tests of one temperature; where the last cool-down may overlap, the longest one comes last."""
    mine = [(name, repeats[ts.index(t)]) for name, ts, repeats in tests if t in ts]
    soaked = [pair for pair in mine if spec.tests[pair[0]].temperature == "soak"]
    mine = [*soaked, *(pair for pair in mine if pair not in soaked)]
    spared = [_overlap(spec, name) for name, _ in mine]
    if max(spared, default=0.0) > 0:
        mine = [pair for _, pair in sorted(zip(spared, mine, strict=True), key=lambda item: item[0])]
    every = [list(_repeats(spec, name, t, n, place, 0)) for name, n in mine]
    flat = [e for actions in every for e in actions]
    saved = max(spared, default=0.0)
    if saved and flat:
        last = flat[-1]
        rest = last.seconds - saved
        flat[-1:] = [] if rest <= 0 else [replace(last, seconds=rest)]
    number, before = block, None
    for e in flat:
        key = (e.test, e.block)
        number += key != before
        before = key
        yield replace(e, block=number)


def _overlap(spec: Spec, name: str) -> float:
    test = spec.tests[name]
    chamber = spec.benches[test.bench].chamber
    if chamber is None or "cool_down" not in spec.plan.overlap or in_room(spec, name):
        return 0.0
    return min(test.gap + test.cool_down, chamber.soak)


def _cool_down_before_leaving(spec: Spec, name: str) -> float:
    """What the unit must still cool before it may be powered on the next bench."""
    used = [b for b in spec.benches if any(t.bench == b for t in spec.tests.values())]
    later = used[used.index(name) + 1 :]
    if not later:
        return 0.0
    longest = max(_overlap(spec, test) for test in spec.tests if spec.tests[test].bench == name)
    way = spec.benches[name].remove + min(spec.benches[b].install for b in later)
    return max(0.0, longest - way)


def _repeats(spec: Spec, name: str, t: float, repeats: int, place: str, block: int) -> Iterator[Expected]:
    """One power-on a repeat: for every motion a move, a record, a gap; off for the last gap and cool-down."""
    test = spec.tests[name]
    bench = spec.benches[test.bench]
    motions = motions_of(test.bench, bench, test)
    if test.attended is None:
        by_hand: tuple[bool, ...] = turned_by_hand(test.bench, bench, motions)
    else:
        by_hand = (test.attended,) * len(motions)
    start = t - _aside(test)
    for r in range(1, repeats + 1):
        run = f"{test.bench}/{place}/{name}/r{r:02d}"
        if bench.chamber and bench.chamber.cooling and start != t:
            block += 1
            way = (t - start) / bench.chamber.cooling
            yield Expected(f"{run}/aside", "ramp", way, start, name, r, block=block)
        block += 1
        yield from _powered(test, run, t, r, motions, by_hand, bench.move, block)
        off = test.gap + test.cool_down
        if off:
            block += 1
            yield Expected(f"{run}/m{len(motions)}/cool_down", "cool_down", off, start, name, r, block=block)
        if bench.chamber and bench.chamber.heating and start != t:
            block += 1
            yield Expected(
                f"{run}/back", "ramp", (t - start) / bench.chamber.heating, t, name, r, block=block
            )


def _aside(test: Test) -> float:
    """Kelvins from a test's temperature to where its ramps turn: half a record and the lead, at its rate."""
    return 0.0 if test.ramp is None else (test.record / 2.0 + test.ramp.lead) * test.ramp.ramp


def _powered(
    test: Test,
    run: str,
    t: float,
    r: int,
    motions: Sequence[Mapping[str, float] | None],
    by_hand: Sequence[bool],
    move: float,
    block: int,
) -> Iterator[Expected]:
    name = run.split("/")[-2]
    people = bool(test.attended)
    now, aside = t - _aside(test), _aside(test)
    yield Expected(f"{run}/power_on", "power_on", test.power_on, now, name, r, None, people, block)
    for m, motion in enumerate(motions, start=1):
        if motion is not None or move:
            yield Expected(f"{run}/m{m}/move", "move", move, now, name, r, motion, by_hand[m - 1], block)
        if test.ramp is None:
            yield Expected(f"{run}/m{m}", "record", test.record, t, name, r, motion, False, block)
        else:
            up = 1.0 if m % 2 else -1.0
            rate, lead, now = up * 60.0 * test.ramp.ramp, test.ramp.lead, t + up * aside
            met = t - up * test.ramp.ramp * test.record / 2.0
            on = (name, r, None, False, block, rate)
            if lead:
                yield Expected(f"{run}/m{m}/lead", "ramp", lead, met, *on)
            yield Expected(f"{run}/m{m}", "record", test.record, t, name, r, motion, False, block, rate)
            yield Expected(f"{run}/m{m}/tail", "ramp", lead, now, *on)
        if m < len(motions) and test.gap:
            yield Expected(f"{run}/m{m}/pause", "pause", test.gap, now, name, r, None, False, block)
    yield Expected(f"{run}/power_off", "power_off", 0.0, now, name, r, None, False, block)


# ---------------------------------------------------------------- people


def _waited(
    hours: Findings,
    order: Findings,
    spec: Spec,
    steps: Sequence[Document],
    index: int,
    clock: float,
    block: Sequence[Expected],
    prefix: str,
    now: float,
) -> tuple[float, int]:
    """Skips the pause before a block if there must be one; the clock at which the block begins."""
    begin = earliest(spec, block, clock)
    if begin <= clock + CLOCK:
        return clock, index
    step = steps[index]
    wait = Expected(f"{block[0].id}/wait", "pause", begin - clock, now)
    where = f"step {step['id']}"
    if not is_same(step["id"], prefix + wait.id):
        hours.fault(where, f"needs people at {clock:.9g} s, who come at {begin:.9g} s")
        return clock, index
    _check_step(hours, step, wait, prefix, clock)
    return float(step["end_s"]), index + 1


# ---------------------------------------------------------------- limits and sums


def _check_limits(limits: Findings, step: Document, spec: Spec) -> None:
    bench, where = spec.benches[step["bench"]], f"step {step['id']}"
    for axis, value in (step["motion"] or {}).items():
        kind, *rest = axis.split("_")
        if kind == "rate" and bench.limits.rate is not None:
            limits.at_most(f"{where}, {axis}", abs(math.radians(value)), bench.limits.rate)
        elif kind == "acceleration" and bench.limits.acceleration is not None:
            limits.at_most(f"{where}, {axis}", abs(value) * 9.80665, bench.limits.acceleration)
        elif kind == "position" and int(rest[0]) in bench.limits.travel:
            low, high = bench.limits.travel[int(rest[0])]
            limits.at_most(f"{where}, {axis}", math.radians(value), high)
            limits.at_most(f"{where}, {axis}", -math.radians(value), -low)
    t, rate = step["temperature_degc"], step.get("temperature_rate_degc_min")
    if rate is not None and bench.chamber is not None:
        fastest = bench.chamber.heating if rate > 0 else bench.chamber.cooling
        if fastest is not None:
            limits.at_most(f"{where}, temperature_rate_degc_min", abs(rate) / 60.0, fastest)
    if t is not None and bench.chamber is not None and t != spec.plan.temperatures.room:
        low, high = bench.chamber.range
        limits.at_most(f"{where}, temperature_degc", t, high)
        limits.at_most(f"{where}, temperature_degc", -t, -low)


def _check_sums(
    sums: Findings, document: Document, steps: Sequence[Document], loads: Mapping[str, int]
) -> None:
    end = max((s["end_s"] for s in steps), default=0.0)
    sums.same("time_s", document["time_s"], end, 1e-9)
    powered, since = dict.fromkeys((t["test"] for t in document["tests"]), 0.0), 0.0
    lasting = dict(powered)
    for step in sorted(steps, key=lambda s: (s["bench"], s["start_s"], s["end_s"])):
        if step["test"] in lasting:
            lasting[step["test"]] += step["end_s"] - step["start_s"]
            if step["action"] == "power_on":
                since = step["start_s"]
            elif step["action"] == "power_off":
                powered[step["test"]] += step["end_s"] - since
    for test in document["tests"]:
        name, many = test["test"], loads[test["bench"]]
        sums.same(f"tests, {name}, time_s", test["time_s"], lasting[name] / many, 1e-7)
        sums.same(f"tests, {name}, power_on_s", test["power_on_s"], powered[name] / many, 1e-7)
    whole = sum(powered[t["test"]] / loads[t["bench"]] for t in document["tests"])
    sums.same("power_on_s", document["power_on_s"], whole, 1e-7)
