"""What curves the errors have where the promise is put to one family of them."""

from __future__ import annotations

from collections.abc import Mapping

from planner import catalog
from planner.protocols import SENSORS, Sensor
from planner.spec.budget import ErrorBudget
from planner.spec.curve_names import families_of
from planner.spec.model import Spec
from planner.verify.curve_shapes import SHAPES
from planner.verify.curves import Curves, OneUnits, family, several_units, table_of

MEASURED = "measured"  # as the units that were measured; errors with tables are cosines


def budgets_of(spec: Spec) -> dict[tuple[Sensor, str], ErrorBudget]:
    """(sensor, effect) -> its budget."""
    return {(s, e): budget for s in SENSORS for e, budget in getattr(spec.unit, s).items()}


def usual_family(spec: Spec) -> str:
    """Where nobody says which one binds: cosines, or the measured curve itself where there is one."""
    every = families_of(spec)
    return MEASURED if MEASURED in every else every[0]


def curves_in(spec: Spec, name: str) -> Mapping[tuple[Sensor, str], Curves]:
    """(sensor, effect) -> the curves of its units, where the promise is put to one family."""
    low, high = spec.plan.temperatures.range
    found = {error: _curves(budget, name, low, high) for error, budget in budgets_of(spec).items()}
    return {error: curves for error, curves in found.items() if curves is not None}


def _curves(budget: ErrorBudget, name: str, low: float, high: float) -> Curves | None:
    if budget.measured_curves:
        return several_units([(m.temperatures_degc, m.values) for m in budget.measured_curves])
    shape = name if name in SHAPES else SHAPES[0]
    one = budget.measured_curve
    if one is not None and name == MEASURED:
        return OneUnits(one.temperatures_degc, one.values)
    if one is not None:
        table = table_of(one.temperatures_degc, one.values, low, high)
        return family(table, low, high, "largest", shape)
    if not budget.residual_table:
        return None
    named = budget.curve_family_name or shape
    return family(budget.residual_table, low, high, budget.residual_figure, named)


def with_tables(spec: Spec) -> dict[tuple[Sensor, str], ErrorBudget]:
    """All budgets, and empty ones of declared effects that have none: their calibration finds some.

    The bench's own effects do not fly, and an effect that a table carries is found in the table of the one
    that it changes.
    """
    budgets = budgets_of(spec)
    known = catalog.effects()
    for name in spec.effects:
        carrier = known[name].temperature_of if known[name].tabled else name
        if carrier is not None and not known[carrier].bench_only:
            for sensor in SENSORS:
                if sensor in known[name].sensors:
                    budgets.setdefault((sensor, carrier), ErrorBudget())
    return budgets
