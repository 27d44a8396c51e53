"""A spec whose spreads or limits are smaller or larger: a better sensor of its kind, a looser requirement."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Literal

from planner.nouns.sensor import ErrorName
from planner.spec.budget import ErrorBudget, InRun, RunToRun
from planner.spec.model import Spec
from planner.spec.temperature_residual import MeasuredCurve, MeasuredCurves, ResidualTable
from planner.units import Quantity

Part = Literal["run_to_run", "in_run", "storage", "temperature"]
PARTS: tuple[Part, ...] = ("run_to_run", "in_run", "storage", "temperature")
_KEYS = {"temperature": "temperature_residual"}


def scaled(spec: Spec, error: ErrorName, factor: float, parts: tuple[Part, ...] = PARTS) -> Spec:
    """The spec with some parts of one error's budget multiplied."""
    budgets = getattr(spec.unit, error.sensor)
    new = scaled_budget(budgets[error.effect], factor, parts)
    return spec.model_copy(
        update={"unit": spec.unit.model_copy(update={error.sensor: {**budgets, error.effect: new}})}
    )


def with_limits(spec: Spec, factor: float) -> Spec:
    """The spec with every limit multiplied."""
    wanted = [r.model_copy(update={"limit": _times(r.limit, factor)}) for r in spec.requirement]
    return spec.model_copy(update={"requirement": type(spec.requirement)(wanted)})


def scaled_budget(budget: ErrorBudget, factor: float, parts: tuple[Part, ...]) -> ErrorBudget:
    """One budget with some of its parts multiplied."""
    keys = [_KEYS.get(part, part) for part in parts]
    changed = {key: _times(getattr(budget, key), factor) for key in keys if getattr(budget, key) is not None}
    return budget.model_copy(update=changed)


def _times(value: Any, factor: float) -> Any:
    """A quantity, a table of them, or what is written round them, multiplied."""
    if isinstance(value, Quantity):
        return replace(value, si=value.si * factor, text=f"{factor:g} × {value.text}")
    if isinstance(value, dict):
        return {key: _times(one, factor) for key, one in value.items()}
    if isinstance(value, tuple):
        return tuple(_times(one, factor) for one in value)
    if isinstance(value, InRun | RunToRun):
        return value.model_copy(update={"value": _times(value.value, factor)})
    if isinstance(value, MeasuredCurve | MeasuredCurves):
        return value.model_copy(update={"curve": _times(value.curve, factor)})
    if isinstance(value, ResidualTable):
        return value.model_copy(update={"table": _times(value.table, factor)})
    raise TypeError(f"no spread can be written as {type(value).__name__}")
