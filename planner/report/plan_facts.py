"""What a comparison needs of a plan.json document, as a record; a broken one is refused with its place."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from planner.nouns.plan_file import ComparedPlan, RequirementFigures, TestFigures, plan_part
from planner.nouns.step import Step

PlanDocument = Mapping[str, Any]
MICROSECONDS = 1_000_000  # in a second


@dataclass(frozen=True)
class PlanFacts:
    """One plan; allowances: (error, unit) -> allowed."""

    name: str
    sha256: str
    time_us: int
    power_on_us: int
    gap: float | None
    steps: tuple[Step, ...]
    tests: Mapping[str, TestFigures]
    requirements: tuple[RequirementFigures, ...]
    allowances: Mapping[tuple[str, str], float]


def plan_facts(document: PlanDocument, number: int) -> PlanFacts:
    """The facts of the `number`-th plan. Raises InputError naming every key that is missing or wrong."""
    plan = plan_part(document, ComparedPlan, f"plan {number}")
    return PlanFacts(
        name=plan.spec.name or "plan",
        sha256=plan.spec.sha256,
        time_us=microseconds(plan.time_s),
        power_on_us=microseconds(plan.power_on_s),
        gap=plan.gap,
        steps=plan.steps,
        tests={test.test: test for test in plan.tests},
        requirements=tuple(plan.requirements),
        allowances={(error, a.unit): a.allowed for error, a in plan.allowances.items()},
    )


def microseconds(seconds: float) -> int:
    """Seconds in whole microseconds."""
    return round(seconds * MICROSECONDS)


def length(step: Step) -> int:
    """How long a step lasts, in microseconds."""
    return microseconds(step.end_s) - microseconds(step.start_s)
