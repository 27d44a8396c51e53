"""A run-to-run spread over the input: what all inputs have in common, and beside it what some have more.

    scale_factor: {run_to_run: {10 deg/s: 0.107 %, 500 deg/s: 0.122 %}}

A power-on draws s_0 z + √(s(u)² − s_0²) w, s_0 the least sigma of the table (K table 2.17): z at all inputs
alike, as K finds that a power-on keeps its place at different rates (figs 2.15, 2.16), w what a rate scatters
more. So s(u) is what scatters at u, and no record tells the mean better than s_0 lets it. z stays with the
scale factor; w is an error of its own, `scatter_over_input_at_…`, whose column carries the table. A plan as
published knows one figure for all inputs, the largest; there the budget stays as it is written.
"""

from __future__ import annotations

import numpy as np

from planner.effects._scatter_over_input import INPUT_UNIT, scatter_name
from planner.protocols import SENSORS, Sensor
from planner.spec.budget import INPUT_REACH, ErrorBudget, OverInput, RunToRun
from planner.spec.model import Spec
from planner.units import Quantity, dimension_of, from_si

SPREADS = "scale_factor"  # whose spread may depend on the input


def with_scatter(spec: Spec) -> Spec:
    """The spec with the spreads over the input in their two parts, where records are information."""
    if spec.planned_by == "published":
        return spec
    units = {sensor: _apart(sensor, getattr(spec.unit, sensor)) for sensor in SENSORS}
    changed: dict[str, dict[str, ErrorBudget]] = {sensor: found for sensor, found in units.items() if found}
    if not changed:
        return spec
    return spec.model_copy(update={"unit": spec.unit.model_copy(update=changed)})


def _apart(sensor: Sensor, budgets: dict[str, ErrorBudget]) -> dict[str, ErrorBudget]:
    """The budgets with the scale factor's excess beside it; {} where it is the same at all inputs."""
    budget = budgets.get(SPREADS)
    if budget is None or not budget.run_to_run_over_input:
        return {}
    points, sigma = np.transpose(budget.run_to_run_over_input)
    common, excess = sigma.min(), np.sqrt(sigma**2 - sigma.min() ** 2)
    found = {**budgets, SPREADS: _with(budget, budget, float(common))}
    if excess.max() > 0.0:
        within = excess[points >= INPUT_REACH * points[-1]].max()
        whole = float(within if within > 0.0 else excess.max())
        at = tuple(float(from_si(point, INPUT_UNIT[sensor])) for point in points)
        found[scatter_name(at, tuple((excess / whole).tolist()))] = _with(ErrorBudget(), budget, whole)
    return found


def _with(budget: ErrorBudget, told: ErrorBudget, sigma: float) -> ErrorBudget:
    """A budget with one sigma (SI) from power-on to power-on, in the unit and with the words of another's."""
    whole = told.run_to_run
    over = whole.value if isinstance(whole, RunToRun) else whole
    assert isinstance(over, OverInput)
    unit = next(q.unit for q in over.table.values())
    value = Quantity(sigma, dimension_of(unit), f"{from_si(sigma, unit):.6g} {unit}")
    spread = whole.model_copy(update={"value": value}) if isinstance(whole, RunToRun) else value
    return budget.model_copy(update={"run_to_run": spread})
