"""plan.json → what the runner works from: the steps, and the benches in the units of their languages."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import date

from planner.errors import InputError
from planner.nouns.bench import BenchFacts, Stops
from planner.nouns.plan_file import typed_plan
from planner.nouns.step import Step
from planner.quantities import DAY_S, FIRST_MONDAY, week_seconds


@dataclass(frozen=True)
class Job:
    """A campaign to execute: the plan's hash, its steps in order, its benches by name.

    shifts: (opens, closes) in which people are there, seconds from Monday 00:00; start_s: when in that week
    the plan begins; any_time: people are there whenever they are needed, whatever the shifts
    monday_s: Monday of the first week from the first one of 1970, 0 where the plan has no date; period_s:
    after which the shifts come again
    """

    plan_sha256: str
    steps: tuple[Step, ...]
    benches: Mapping[str, BenchFacts]
    shifts: tuple[tuple[float, float], ...] = ()
    start_s: float = 0.0
    any_time: bool = False
    monday_s: float = 0.0
    period_s: float = 7 * DAY_S

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
    document: object,
    *,
    arm_m: float | None = None,
    travel: Mapping[int, Stops] | None = None,
    any_time: bool = False,
) -> Job:
    """The job of a plan's tree.

    arm_m: of a centrifuge whose arm the plan does not know; travel: stops, instead of the plan's own
    Raises InputError for a tree that is no plan.
    """
    plan = typed_plan(document)
    monday_s = _monday(plan.first_day)
    benches = {
        name: replace(bench, arm_m=bench.arm_m or arm_m, travel={**bench.travel, **(travel or {})})
        for name, bench in plan.benches.items()
    }
    return Job(
        plan.plan_sha256,
        plan.steps,
        benches,
        shifts=() if any_time else tuple((shift.opens_s, shift.closes_s) for shift in plan.shifts),
        start_s=monday_s + (week_seconds(plan.start) if plan.start else 0.0),
        any_time=any_time,
        monday_s=monday_s,
        period_s=plan.shifts_period_s,
    )


def _monday(day: date | None) -> float:
    """Seconds from FIRST_MONDAY to the Monday of a day's week; 0 without a day."""
    return 0.0 if day is None else (day - FIRST_MONDAY).days // 7 * 7 * DAY_S
