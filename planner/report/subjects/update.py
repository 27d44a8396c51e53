"""An updated spec: the difference in its text, then hours and metres before and after."""

from __future__ import annotations

from collections.abc import Iterator
from math import isfinite
from typing import Any, Protocol

from planner.nouns.diagnosis import Diagnosis, NavigationCost
from planner.nouns.plan import Plan
from planner.report.blocks import Difference, Report, Table, Text, existing, section, table
from planner.report.numbers import NOTHING, digits, hours, in_unit


class Change(Protocol):
    """What was changed in a spec."""

    @property
    def changes(self) -> tuple[str, ...]:
        """A sentence for each change."""
        ...

    @property
    def notes(self) -> tuple[str, ...]:
        """What a person should know."""
        ...

    @property
    def diff(self) -> str:
        """The difference of the texts."""
        ...


class Plans(Protocol):
    """The plans of the old and of the new spec, where they exist."""

    @property
    def old(self) -> Plan | None:
        """Of the old spec."""
        ...

    @property
    def new(self) -> Plan | None:
        """Of the new spec."""
        ...

    @property
    def why(self) -> tuple[str, ...]:
        """Why there is none."""
        ...


def update_document(change: Change, plans: Plans | None, diagnosis: Diagnosis) -> dict[str, Any]:
    """The same for scripts: hours, and navigation errors in the requirements' units."""
    document: dict[str, Any] = {
        "changes": list(change.changes),
        "notes": list(change.notes),
        "diff": change.diff,
    }
    if plans is not None:
        rows = list(_rows(plans, diagnosis))
        document["plans"] = {
            "old": _figures(plans.old),
            "new": _figures(plans.new),
            "why_not": list(plans.why),
            "really": [
                {
                    "error": error,
                    "unit": unit,
                    "promised": promised,
                    "with_what_was_found": really,
                    "new": new,
                }
                for error, unit, promised, really, new in rows
            ],
        }
    return document


def _figures(plan: Plan | None) -> dict[str, Any] | None:
    if plan is None:
        return None
    return {
        "time_s": plan.time_s,
        "power_on_s": plan.power_on_s,
        "requirements": [
            {
                "error": r.error,
                "limit": in_unit(r.limit, r.unit),
                "achieved": in_unit(r.achieved, r.unit),
                "unit": r.unit,
            }
            for r in plan.requirements
        ],
    }


def _rows(
    plans: Plans, diagnosis: Diagnosis
) -> Iterator[tuple[str, str, float | None, float | None, float | None]]:
    """Per requirement: promised by the old plan, flown by it, promised by the new plan.

    Flown: with what was found as the old calibration leaves it, its own coefficients bent by it included.
    """
    some = plans.old or plans.new
    for i, r in enumerate(() if some is None else some.requirements):
        old = None if plans.old is None else in_unit(plans.old.requirements[i].achieved, r.unit)
        new = None if plans.new is None else in_unit(plans.new.requirements[i].achieved, r.unit)
        cost = _flown(diagnosis.navigation[i]) if i < len(diagnosis.navigation) else 0.0
        adds = "worst" in r.rule
        extra = in_unit(cost, r.unit)
        really = None if old is None else old + extra if adds else (old**2 + extra**2) ** 0.5
        yield r.error, r.unit, old, really, new


def _flown(cost: NavigationCost) -> float:
    return cost.as_calibrated if isfinite(cost.as_calibrated) else cost.before


def update_report(change: Change, plans: Plans | None, diagnosis: Diagnosis) -> Report:
    """Difference, changes, hours and metres."""
    why = (Text(f"note: {why}") for why in plans.why) if plans else ()
    parts = (
        section("difference", "What was changed", Difference(change.diff) if change.diff else None),
        section("plans", "Before and after", *why, _table(plans, diagnosis) if plans else None),
    )
    return Report("Update of a spec", "", "", sections=existing(*parts))


def _table(plans: Plans, diagnosis: Diagnosis) -> Table | None:
    time = [None if p is None else hours(p.time_s) for p in (plans.old, plans.old, plans.new)]
    rows = [("campaign, h", *(t or NOTHING for t in time))]
    for error, unit, *sizes in _rows(plans, diagnosis):
        cells = (NOTHING if x is None else digits(x) for x in sizes)
        rows.append((f"{error.replace('_', ' ')}, {unit}", *cells))
    some = plans.old or plans.new
    for r in () if some is None else some.requirements:
        limit = digits(in_unit(r.limit, r.unit))
        rows.append((f"limit of {r.error.replace('_', ' ')}, {r.unit}", limit, limit, limit))
    return table("Before and after", " | old plan, promised | old plan, flown | new plan, promised", rows)
