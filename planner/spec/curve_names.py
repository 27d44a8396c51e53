"""For which families of temperature curves a spec's promise must hold."""

from __future__ import annotations

from typing import Literal

from planner.protocols import SENSORS
from planner.spec.budget import ErrorBudget
from planner.spec.model import Spec
from planner.spec.temperature_residual import CURVE_NAMES, CurveName

FamilyName = Literal[CurveName, "measured"]
FAMILY_NAMES: tuple[FamilyName, ...] = (*CURVE_NAMES, "measured")


def families_of(spec: Spec) -> tuple[FamilyName, ...]:
    """The families that count: what the errors name if all name theirs, else all four.

    `measured` beside the four: an error's one measured curve is that curve, up to its sign, and whoever names
    none has cosines. Curves of several units are a family of their own whatever the others are: they name it.
    Without any curve one family is as good as another.
    """
    asked = {_asked(b) for b in _curved(spec)}
    if None in asked or "one unit" in asked:
        return FAMILY_NAMES if "one unit" in asked else CURVE_NAMES
    return tuple(name for name in FAMILY_NAMES if name in asked) or ("cosines",)


def _curved(spec: Spec) -> list[ErrorBudget]:
    """The budgets with a curve over temperature."""
    budgets = [b for sensor in SENSORS for b in getattr(spec.unit, sensor).values()]
    return [b for b in budgets if b.temperature_residual is not None]


def _asked(budget: ErrorBudget) -> FamilyName | Literal["one unit"] | None:
    """The family that one error names."""
    if budget.measured_curve is not None:
        return "one unit"
    return "measured" if budget.measured_curves else budget.curve_family_name
