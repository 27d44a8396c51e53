"""The allowances of plan.json, back in SI."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from planner.errors import InputError
from planner.nouns.allowances import Allowance
from planner.units import UnitError, unit_factor


def plan_allowances(document: Mapping[str, Any]) -> tuple[Allowance, ...]:
    """Every allowance of a plan's tree. Raises InputError when one cannot be read."""
    try:
        return tuple(_allowance(error, a) for error, a in document["allowances"].items())
    except (KeyError, TypeError, ValueError, AttributeError, UnitError) as error:
        where = document.get("path", "the plan")
        raise InputError(f"{where}: its allowances cannot be read ({error!r}); plan again") from error


def _allowance(error: str, a: Mapping[str, Any]) -> Allowance:
    scale, parts = unit_factor(a["unit"])[0], a["parts"]
    return Allowance(
        error=error,
        unit=a["unit"],
        allowed=float(a["allowed"]) * scale,
        run_to_run=float(parts["run_to_run"]) * scale,
        in_run=float(parts["in_run"]) * scale,
        storage=float(parts["storage"]) * scale,
        temperature=float(parts["temperature"]) * scale,
        estimate=float(parts["estimate"]) * scale,
        calibrated=bool(a["calibrated"]),
    )
