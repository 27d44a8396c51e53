"""What a comparison needs of a plan.json document, as records; a broken one is refused with its place."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from planner.errors import InputError
from planner.nouns.plan import PlannedTest, Step

PlanDocument = Mapping[str, Any]
MICROSECONDS = 1_000_000  # in a second


@dataclass(frozen=True)
class Figure:
    """One requirement as plan.json tells it: limit and achieved in `unit`."""

    error: str
    at: str
    rule: str
    unit: str
    limit: float
    achieved: float


@dataclass(frozen=True)
class PlanFacts:
    """One plan; allowances: (error, unit) -> allowed."""

    name: str
    sha256: str
    time_us: int
    power_on_us: int
    gap: float | None
    steps: tuple[Step, ...]
    tests: Mapping[str, PlannedTest]
    requirements: tuple[Figure, ...]
    allowances: Mapping[tuple[str, str], float]


def plan_facts(document: PlanDocument, number: int) -> PlanFacts:
    """The facts of the `number`-th plan. Raises InputError naming the key that is missing or wrong."""
    place = "the document"
    try:
        place = "spec"
        spec = document["spec"]
        name, sha256 = str(spec.get("name") or "plan"), str(spec.get("sha256") or "")
        place = "time_s, power_on_s or gap"
        time_us, power_on_us = (
            microseconds(document["time_s"]),
            microseconds(document.get("power_on_s") or 0.0),
        )
        gap = document.get("gap")
        place = "steps"
        steps = tuple(map(_step, document["steps"]))
        place = "tests"
        tests = {str(row["test"]): _test(row) for row in document["tests"]}
        place = "requirements"
        requirements = tuple(map(_figure, document["requirements"]))
        place = "allowances"
        rows = (document.get("allowances") or {}).items()
        allowances = {(str(error), str(row["unit"])): float(row["allowed"]) for error, row in rows}
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        raise InputError(f"plan {number} is not a plan.json: {place} cannot be read ({error!r})") from None
    return PlanFacts(name, sha256, time_us, power_on_us, gap, steps, tests, requirements, allowances)


def microseconds(seconds: float) -> int:
    """Seconds in whole microseconds. Raises ValueError or OverflowError for what is not finite."""
    return round(float(seconds) * MICROSECONDS)


def length(step: Step) -> int:
    """How long a step lasts, in microseconds."""
    return microseconds(step.end_s) - microseconds(step.start_s)


def _step(row: Mapping[str, Any]) -> Step:
    degc, repeat, test = row.get("temperature_degc"), row.get("repeat"), row.get("test")
    step = Step(
        id=str(row.get("id", "")),
        bench=str(row["bench"]),
        action=str(row["action"]),
        start_s=float(row["start_s"]),
        end_s=float(row["end_s"]),
        test=None if test is None else str(test),
        temperature_degc=None if degc is None else float(degc),
        repeat=None if repeat is None else int(repeat),
        motion=dict(row.get("motion") or {}),
        units=int(row.get("units") or 1),
    )
    if not math.isfinite(step.start_s + step.end_s):
        raise ValueError(f"step {step.id} has no finite times")
    return step


def _test(row: Mapping[str, Any]) -> PlannedTest:
    return PlannedTest(
        test=str(row["test"]),
        bench=str(row["bench"]),
        temperatures_degc=tuple(map(float, row["temperatures_degc"])),
        repeats=tuple(map(int, row["repeats"])),
        time_s=float(row.get("time_s") or 0.0),
        power_on_s=float(row.get("power_on_s") or 0.0),
        calibrates=tuple(map(str, row.get("calibrates") or ())),
        motions=int(row.get("motions") or 1),
    )


def _figure(row: Mapping[str, Any]) -> Figure:
    return Figure(
        error=str(row["error"]),
        at=str(row.get("at", "end")),
        rule=_rule(row.get("rule")),
        unit=str(row["unit"]),
        limit=float(row["limit"]),
        achieved=float(row["achieved"]),
    )


def _rule(rule: object) -> str:
    """`worst_case`, or `percentile 95 %` of a mapping as the spec writes it."""
    if isinstance(rule, Mapping):
        return ", ".join(f"{key} {value}" for key, value in rule.items())
    return str(rule)
