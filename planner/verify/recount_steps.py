"""The steps counted again: what the spec's tests ask for, laid end to end, against what the plan says.

From the spec and the plan's `tests` (temperatures, repeats) every bench's actions follow, with their lengths
(K 2.6, eq. 28). The plan may choose the order of the temperatures within `plan.order`, and nothing else.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

from planner.spec.copies import copies
from planner.spec.model import Spec
from planner.verify.asked_steps import Expected, chamber_temperatures, expected
from planner.verify.findings import Document, Findings, is_same
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
