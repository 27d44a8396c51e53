"""What so many hours can keep: the least limits, and the grade of sensor."""

from __future__ import annotations

from typing import Any

from planner.information.afford import Affordable, Grade
from planner.report.blocks import Report, Table, existing, section
from planner.report.numbers import digits, hours, percent, quantity
from planner.spec.model import NAVIGATION_ERRORS, Spec
from planner.units import from_si


def afford_document(found: Affordable, spec: Spec) -> dict[str, Any]:
    """The same for scripts."""
    return {
        "time_s": found.found.timeline[-1].end_s,
        "load": found.load,
        "cut_short": list(found.cut),
        "requirements": [
            {
                "error": wanted.error,
                "unit": (unit := NAVIGATION_ERRORS[wanted.error]),
                "limit": from_si(wanted.limit.si, unit),
                "least_limit": from_si(least, unit),
                "achieved": from_si(achieved, unit),
            }
            for wanted, least, achieved in zip(
                spec.requirement, found.limits, found.found.foreseen.largest, strict=True
            )
        ],
        "tests": [
            {"test": v.test, "temperatures_degc": list(v.temperatures_degc), "repeats": list(v.repeats)}
            for v in found.found.visits
        ],
        "sensor": [
            {"error": g.error or "all", "factor": g.factor, "at_least": g.at_least} for g in found.grades
        ],
    }


def afford_report(found: Affordable, spec: Spec, wanted_hours: float) -> Report:
    """What `planner afford` says."""
    kept = "are kept" if found.load <= 1.0 else "are NOT kept"
    return Report(
        kind="What the hours can keep",
        title=spec.name,
        answer=f"{hours(found.found.timeline[-1].end_s)} h of {digits(wanted_hours)} h",
        sentences=(
            f"The limits of the spec {kept}: {percent(found.load)} of them is used.",
            *(f"plan.time_limit cut short {what}: less may be possible." for what in found.cut),
        ),
        sections=existing(
            section("limits", "The least limits", _limits(found, spec)),
            section("campaign", "The campaign", _campaign(found)),
            section("sensor", "The sensor", _sensor(found)),
        ),
    )


def _limits(found: Affordable, spec: Spec) -> Table:
    rows = [
        (
            wanted.error,
            quantity(wanted.limit.si, unit),
            quantity(achieved, unit),
            quantity(least, unit),
        )
        for wanted, least, achieved in zip(
            spec.requirement, found.limits, found.found.foreseen.largest, strict=True
        )
        for unit in (NAVIGATION_ERRORS[wanted.error],)
    ]
    heads = ("requirement", "limit", "reached", "least limit, all scaled alike")
    return Table("What the campaign keeps", heads, tuple(rows))


def _campaign(found: Affordable) -> Table:
    rows = [
        (v.test, ", ".join(digits(t) for t in v.temperatures_degc), ", ".join(map(str, v.repeats)))
        for v in found.found.visits
    ]
    return Table("The most accurate campaign found within the hours", ("test", "°C", "repeats"), tuple(rows))


def _sensor(found: Affordable) -> Table:
    rows = [(g.error or "all errors together", _factor(g)) for g in found.grades]
    caption = "By what its spreads may be multiplied while this campaign keeps the limits of the spec"
    return Table(caption, ("error", "factor"), tuple(rows))


def _factor(grade: Grade) -> str:
    if grade.factor is None:
        return "none suffices"
    return f"{'at least ' if grade.at_least else ''}{digits(grade.factor, 3)}"
