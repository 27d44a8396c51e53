"""The allowances of plan.json, back in SI.

A plan by information gives every part as what its requirement's quantile makes of one sigma
(`information.to_plan`); the allowed region takes quantiles itself, so its parts are sigmas.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from planner.errors import InputError
from planner.information.allowed import largest_quantile
from planner.nouns.allowances import Allowance
from planner.nouns.plan_file import AllowanceFigures, PlanAllowances, plan_part
from planner.spec.model import Spec
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


def by_probability(document: Mapping[str, Any]) -> bool:
    """Whether a plan says that it promises what will be flown."""
    return document.get("method") == "information"


def in_sigmas(allowances: Sequence[Allowance], spec: Spec) -> tuple[Allowance, ...]:
    """Allowances of a plan by information with one sigma of every part; the allowed size stays."""
    z = largest_quantile(spec)
    return tuple(
        Allowance(
            a.error, a.unit, a.allowed, **{n: x / z for n, x in a.parts.items()}, calibrated=a.calibrated
        )
        for a in allowances
    )
