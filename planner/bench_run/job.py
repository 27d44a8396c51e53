"""plan.json → what the runner works from: the steps, and the benches in the units of their languages."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from planner.errors import InputError
from planner.nouns.plan import Step
from planner.quantities import DAY_S, WEEKDAYS

BY_HAND = "levelled_plate"  # a kind of bench without a drive: the operator is the table


@dataclass(frozen=True)
class ChamberFacts:
    """What the chamber can do; rates in K/min, None where the plan knows none."""

    coldest_degc: float
    hottest_degc: float
    heating_k_per_min: float | None = None
    cooling_k_per_min: float | None = None
    soak_s: float = 0.0


@dataclass(frozen=True)
class BenchFacts:
    """What the bench can do, None: not limited. travel: axis -> (least, most) deg of an axis with stops."""

    name: str
    kind: str
    axes: int
    room_degc: float
    rate_dps: float | None = None
    angular_acceleration_dps2: float | None = None
    acceleration_g: float | None = None
    arm_m: float | None = None
    chamber: ChamberFacts | None = None
    travel: Mapping[int, tuple[float, float]] = field(default_factory=dict)

    @property
    def driven(self) -> bool:
        """Whether it has a drive that takes commands."""
        return self.kind != BY_HAND


@dataclass(frozen=True)
class Job:
    """A campaign to execute: the plan's hash, its steps in order, its benches by name.

    shifts: (opens, closes) in which people are there, seconds from Monday 00:00; start_s: when in that week
    the plan begins; any_time: people are there whenever they are needed, whatever the shifts
    """

    plan_sha256: str
    steps: tuple[Step, ...]
    benches: Mapping[str, BenchFacts]
    shifts: tuple[tuple[float, float], ...] = ()
    start_s: float = 0.0
    any_time: bool = False

    def on(self, bench: str) -> Job:
        """The part of the job that is done on one bench. Raises InputError when there is none."""
        steps = tuple(step for step in self.steps if step.bench == bench)
        if not steps:
            known = ", ".join(self.used_benches)
            raise InputError(f"the plan has no steps on a bench '{bench}'; it has some on {known}")
        return replace(self, steps=steps)

    @property
    def used_benches(self) -> tuple[str, ...]:
        """The benches that steps are made on, in their order."""
        return tuple(dict.fromkeys(step.bench for step in self.steps))


def job_from(
    document: Mapping[str, Any],
    *,
    arm_m: float | None = None,
    travel: Mapping[int, tuple[float, float]] | None = None,
    any_time: bool = False,
) -> Job:
    """The job of a checked plan.

    arm_m: of a centrifuge whose arm the plan does not know; travel: stops, instead of the plan's own
    """
    shifts = tuple((float(s["opens_s"]), float(s["closes_s"])) for s in document.get("shifts", ()))
    return Job(
        document["plan_sha256"],
        tuple(_step(step) for step in document["steps"]),
        {name: _bench(name, facts, arm_m, travel or {}) for name, facts in document["benches"].items()},
        shifts=() if any_time else shifts,
        start_s=_moment(document.get("start")),
        any_time=any_time,
    )


def _moment(words: str | None) -> float:
    """`tue 08:30` as seconds from Monday 00:00; 0 when the plan says nothing."""
    if words is None:
        return 0.0
    day, time = words.split()
    hours, minutes = time.split(":")
    return DAY_S * WEEKDAYS.index(day) + 3600.0 * int(hours) + 60.0 * int(minutes)


def _step(step: Mapping[str, Any]) -> Step:
    return Step(
        id=step["id"],
        bench=step["bench"],
        action=step["action"],
        start_s=float(step["start_s"]),
        end_s=float(step["end_s"]),
        test=step["test"],
        temperature_degc=None if step["temperature_degc"] is None else float(step["temperature_degc"]),
        repeat=step["repeat"],
        motion=step["motion"],
        units=step["units"],
        attended=bool(step.get("attended")),
    )


def _bench(
    name: str, facts: Mapping[str, Any], arm_m: float | None, travel: Mapping[int, tuple[float, float]]
) -> BenchFacts:
    limits, chamber = facts["limits"], facts["chamber"]
    return BenchFacts(
        name=name,
        kind=facts["kind"],
        axes=facts["axes"],
        room_degc=float(facts["room_degc"]),
        rate_dps=limits["rate_dps"],
        angular_acceleration_dps2=limits["angular_acceleration_dps2"],
        acceleration_g=limits["acceleration_g"],
        arm_m=arm_m if facts["arm_m"] is None else facts["arm_m"],
        chamber=None if chamber is None else ChamberFacts(**{k: chamber[k] for k in _CHAMBER}),
        travel=_stops(limits) | dict(travel),
    )


def _stops(limits: Mapping[str, Any]) -> dict[int, tuple[float, float]]:
    given = limits.get("travel_deg", {})
    return {int(axis): (float(least), float(most)) for axis, (least, most) in given.items()}


_CHAMBER = ("coldest_degc", "hottest_degc", "heating_k_per_min", "cooling_k_per_min", "soak_s")
