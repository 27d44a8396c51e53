"""A plan against its benches, before anything leaves: axes, rates, loads, temperatures, time to travel."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from planner.errors import Fault, InputError
from planner.export._scripts import by_bench
from planner.export.plan_schema import BenchFacts, PlanDocument, PlannedStep, typed_plan
from planner.spec.axis_travel import Stops, same_attitude, travel_faults
from planner.units import STANDARD_GRAVITY_MPS2

MOST_FAULTS = 20  # a limit that is too low is broken by thousands of steps alike
_ROUNDING = 1e-9  # plan.json holds twelve digits


def checked_plan(document: Mapping[str, object]) -> PlanDocument:
    """The typed plan, every step within the limits of its bench.

    Raises InputError naming the steps that are not: no such bench or axis; rate, load or temperature beyond
    the limits; times that run backwards or overlap; a move that the axis cannot make in its time.
    """
    plan = typed_plan(document)
    faults = [fault for bench, steps in by_bench(plan).items() for fault in _bench(plan, bench, steps)]
    if faults:
        more = f" ({len(faults)} in all)" if len(faults) > MOST_FAULTS else ""
        raise InputError(f"the plan is more than its benches can do{more}", faults[:MOST_FAULTS])
    return plan


def _bench(plan: PlanDocument, name: str, steps: list[PlannedStep]) -> Iterator[Fault]:
    bench = plan.benches.get(name)
    if bench is None:
        others = ", ".join(plan.benches) or "none"
        yield Fault(
            "plan.json", 0, 0, f"steps.{steps[0].id}", f"no bench '{name}' in the plan; it has {others}"
        )
        return
    known: dict[tuple[tuple[str, float], ...], list[str]] = {}  # thousands of steps share a few motions
    for step in steps:
        for message in [*_temperature(bench, step.temperature_degc), *_motions(bench, step.motion, known)]:
            yield Fault("plan.json", 0, 0, f"steps.{step.id}", message)
    stopped = travel_faults(steps, bench.stops, bench.limits.angular_acceleration_dps2)
    for step, message in [*_order(steps), *stopped, *_travel(bench, steps)]:
        yield Fault("plan.json", 0, 0, f"steps.{step.id}", message)


def _temperature(bench: BenchFacts, t: float | None) -> Iterator[str]:
    if t is None or t == bench.room_degc:
        return
    if bench.chamber is None:
        yield f"{t:g} degC, but the bench has no chamber"
        return
    low, high = bench.chamber.coldest_degc, bench.chamber.hottest_degc
    if not low <= t <= high:
        yield f"{t:g} degC is outside the chamber's {low:g} .. {high:g} degC"


def _motions(
    bench: BenchFacts,
    motion: Mapping[str, float] | None,
    known: dict[tuple[tuple[str, float], ...], list[str]],
) -> list[str]:
    if motion is None:
        return []
    key = tuple(motion.items())
    if key not in known:
        known[key] = [message for name, value in key for message in _motion(bench, name, value)]
    return known[key]


def _motion(bench: BenchFacts, key: str, value: float) -> Iterator[str]:
    rate, load = bench.limits.rate_dps, bench.limits.acceleration_g
    if key == "acceleration_g":
        if load is not None and abs(value) > load * (1 + _ROUNDING):
            yield f"{value:g} g is beyond the bench's {load:g} g"
        turn = 0.0 if bench.arm_m is None else centrifuge_rate_dps(value, bench.arm_m)
        if rate is not None and turn > rate * (1 + _ROUNDING):
            yield f"{value:g} g on an arm of {bench.arm_m:g} m is {turn:.1f} deg/s, beyond {rate:g} deg/s"
        return
    quantity, axis, _ = key.split("_")
    if int(axis) > bench.axes:
        yield f"axis {axis} is named, but the bench has {bench.axes}"
    if quantity == "rate" and rate is not None and abs(value) > rate * (1 + _ROUNDING):
        yield f"{value:g} deg/s is beyond the bench's {rate:g} deg/s"


def centrifuge_rate_dps(load_g: float, arm_m: float) -> float:
    """ω = sqrt(a / R) of an arm, in deg/s (K 4.3.3: a = R ω²)."""
    return math.degrees(math.sqrt(abs(load_g) * STANDARD_GRAVITY_MPS2 / arm_m))


def _order(steps: list[PlannedStep]) -> Iterator[tuple[PlannedStep, str]]:
    now = -math.inf
    for step in steps:
        if step.end_s < step.start_s:
            yield step, "ends before it starts"
        if step.start_s < now - 1e-6:
            yield step, "starts before the bench has done the step before it"
        now = max(now, step.end_s)


def _travel(bench: BenchFacts, steps: list[PlannedStep]) -> Iterator[tuple[PlannedStep, str]]:
    """Moves for which the plan leaves too little time at the bench's own limits.

    A turning axis stops in the wait before the move, as far as there is one. A move without time of its own
    is made in that wait altogether.
    """
    rate, acceleration = bench.limits.rate_dps, bench.limits.angular_acceleration_dps2
    if rate is None or acceleration is None:
        return  # nobody said how fast it is
    before: Mapping[str, float] = {}
    since = steps[0].start_s
    for step in steps:
        if step.action == "record":
            before, since = step.motion or {}, step.end_s
        if step.action != "move" or not step.motion:
            continue
        wait, own = step.start_s - since, step.end_s - step.start_s
        stop = max((abs(v) for k, v in before.items() if k.startswith("rate")), default=0.0) / acceleration
        go = max(
            _axis_time(k, before, value, rate, acceleration, bench.stops) for k, value in step.motion.items()
        )
        need, left = (go + max(0.0, stop - wait), own) if own else (go + stop, wait)
        if need > left + 1e-3:
            yield step, f"needs {need:.2f} s to move, the plan leaves {left:.2f} s"


def _axis_time(
    key: str,
    before: Mapping[str, float],
    value: float,
    rate: float,
    acceleration: float,
    stops: Mapping[int, Stops],
) -> float:
    """Seconds from rest to the rate, or to the position: the shortest way, straight between stops.

    Half a turn, or all of the travel, if nobody knows where the axis was.
    """
    if not key.startswith("position"):
        return abs(value) / acceleration if key.startswith("rate") else 0.0
    way = _way(before.get(key), value, stops.get(int(key.split("_")[1])))
    ramp = rate**2 / acceleration  # the way of speeding up and slowing down
    return 2 * math.sqrt(way / acceleration) if way < ramp else way / rate + rate / acceleration


def _way(start: float | None, end: float, stops: Stops | None) -> float:
    """Degrees from one position to another."""
    if stops is None:
        return 180.0 if start is None else abs((end - start + 180.0) % 360.0 - 180.0)
    places = [None if x is None else same_attitude(x, stops) for x in (start, end)]
    if places[0] is None or places[1] is None:
        return stops[1] - stops[0]
    return abs(places[1] - places[0])
