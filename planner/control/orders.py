"""A step's motion → what each axis is told, in absolute angles and rates, so that it can be sent twice."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Literal

from planner.nouns.bench import BenchFacts
from planner.spec.axis_travel import outside, reduced, same_attitude
from planner.units import STANDARD_GRAVITY_MPS2

Motion = Mapping[str, float]
_KEY = re.compile(r"(position|rate)_([1-6])_(deg|dps)")
_ROUNDING = 1e-9  # plan.json holds twelve digits


class MotionError(ValueError):
    """A motion that this bench cannot make, and why."""


class UnknownArmError(MotionError):
    """A load on an arm whose length nobody gave."""


@dataclass(frozen=True)
class AxisOrder:
    """One axis, held at an angle in deg or turned at a rate in deg/s."""

    axis: int
    mode: Literal["position", "rate"]
    value: float


def orders(motion: Motion | None, bench: BenchFacts) -> tuple[AxisOrder, ...]:
    """What a motion tells the axes, by axis. Raises MotionError for what the bench cannot do.

    A load a of a centrifuge is the rate of its arm R about axis 1, ω = √(|a|/R) (K 4.3.3); the sign of the
    load is the way the unit is mounted, not the way the arm turns.
    """
    found = tuple(sorted((_order(k, v, bench) for k, v in (motion or {}).items()), key=lambda o: o.axis))
    axes = [order.axis for order in found]
    if len(set(axes)) < len(axes):
        raise MotionError("an axis is both held and turned")
    return found


def motion_faults(motion: Motion | None, bench: BenchFacts) -> Iterator[MotionError]:
    """Every part of a motion that the bench cannot do."""
    try:
        orders(motion, bench)
    except MotionError as whole:
        faults = [fault for k, v in (motion or {}).items() if (fault := _fault(k, v, bench))]
        yield from faults or [whole]


def fastest_dps(motions: Iterable[Motion | None], bench: BenchFacts) -> float:
    """The fastest rate that motions ask of any axis, deg/s; 0 when nothing turns."""
    wanted = (order for motion in motions for order in orders(motion, bench))
    return max((abs(order.value) for order in wanted if order.mode == "rate"), default=0.0)


def _fault(key: str, value: float, bench: BenchFacts) -> MotionError | None:
    try:
        _order(key, value, bench)
    except MotionError as error:
        return error
    return None


def _order(key: str, value: float, bench: BenchFacts) -> AxisOrder:
    if key == "acceleration_g":
        return AxisOrder(1, "rate", arm_rate_dps(value, bench))
    match = _KEY.fullmatch(key)
    if match is None or (match[1] == "position") != (match[3] == "deg"):
        raise MotionError(f"unknown motion {key!r}")
    axis = int(match[2])
    if axis > bench.axes:
        raise MotionError(f"axis {axis} is named, but the bench has {bench.axes}")
    if match[1] == "rate":
        _check(value, f"{value:g} deg/s", bench.rate_dps, f"axis {axis}, {bench.rate_dps or 0.0:g} deg/s")
        return AxisOrder(axis, "rate", float(value))
    return AxisOrder(axis, "position", _inside(value, axis, bench))


def arm_rate_dps(load_g: float, bench: BenchFacts) -> float:
    """The arm's rate for a load, deg/s. Raises MotionError without an arm or over a limit."""
    _check(load_g, f"{load_g:g} g", bench.acceleration_g, f"the load, {bench.acceleration_g or 0.0:g} g")
    if bench.arm_m is None:
        raise UnknownArmError(
            f"the arm of {bench.name} is not known: add 'arm: 1.5 m' to the bench in the spec, or --arm 1.5"
        )
    rate = math.degrees(math.sqrt(abs(load_g) * STANDARD_GRAVITY_MPS2 / bench.arm_m))
    said = f"{load_g:g} g on an arm of {bench.arm_m:g} m is {rate:.1f} deg/s, which"
    _check(rate, said, bench.rate_dps, f"the arm, {bench.rate_dps or 0.0:g} deg/s")
    return rate


def _check(value: float, said: str, limit: float | None, what: str) -> None:
    if not math.isfinite(value):
        raise MotionError(said)
    if limit is not None and abs(value) > limit * (1 + _ROUNDING):
        raise MotionError(f"{said} is over the limit of {what}")


def _inside(value: float, axis: int, bench: BenchFacts) -> float:
    """The same attitude within the stops of the axis, or within one turn of a continuous one."""
    if not math.isfinite(value):
        raise MotionError(f"{value} deg")
    if axis not in bench.travel:
        return float(reduced(value))
    same = same_attitude(value, bench.travel[axis])
    if same is None:
        raise MotionError(outside(value, axis, bench.travel[axis]))
    return float(same)
