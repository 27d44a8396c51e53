"""The allowances of plan.json, back in SI."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from planner.errors import InputError
from planner.nouns.allowances import Allowance
from planner.nouns.plan_file import AllowanceFigures, PlanAllowances, plan_part
from planner.units import UnitError, unit_factor


def plan_allowances(document: Mapping[str, Any]) -> tuple[Allowance, ...]:
    """Every allowance of a plan's tree. Raises InputError when one cannot be read."""
    where = str(document.get("path", "the plan"))
    given = plan_part(document, PlanAllowances, where).allowances
    try:
        return tuple(_allowance(error, a) for error, a in given.items())
    except UnitError as error:
        raise InputError(f"{where}: its allowances cannot be read ({error}); plan again") from error


def _allowance(error: str, a: AllowanceFigures) -> Allowance:
    scale = unit_factor(a.unit)[0]
    parts = {name: value * scale for name, value in a.parts}
    return Allowance(error=error, unit=a.unit, allowed=a.allowed * scale, calibrated=a.calibrated, **parts)
