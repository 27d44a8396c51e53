"""Spec → what is known of every sensor error."""

from __future__ import annotations

from planner import catalog
from planner.nouns.allowances import ErrorModel
from planner.plan.campaign_to_spread import with_campaign_spreads
from planner.plan.records_to_spread import with_spreads
from planner.protocols import SENSORS, Sensor
from planner.spec.budget import ErrorBudget
from planner.spec.model import Spec
from planner.spec.own_units import own_unit


def error_models(spec: Spec) -> tuple[ErrorModel, ...]:
    """Every error that the spec gives a budget for, in the order of the catalogue.

    An error whose effect the spec does not declare, or that no test serves, is not calibrated and stays whole
    in the budget (`calibrated` False; the spec's warnings say why).
    """
    found = [
        _error_model(spec, sensor, effect, getattr(spec.unit, sensor)[effect])
        for effect in _budgeted(spec)
        for sensor in SENSORS
        if effect in getattr(spec.unit, sensor)
    ]
    return with_campaign_spreads(spec, with_spreads(spec, found))


def _budgeted(spec: Spec) -> list[str]:
    """Effects with a budget on some sensor in the order of the catalogue, then measured curves, by name."""
    named = {effect for sensor in SENSORS for effect in getattr(spec.unit, sensor)}
    listed = [e for e in catalog.effects() if e in named]
    return [*listed, *sorted(named.difference(listed))]


def _error_model(spec: Spec, sensor: Sensor, effect: str, budget: ErrorBudget) -> ErrorModel:
    name = f"{sensor}.{effect}"
    served = any(name in test.calibrates for test in spec.tests.values())
    declared = effect in spec.effects
    return ErrorModel(
        name=name,
        unit=own_unit(spec, sensor, effect),
        systematic=budget.systematic_size,
        run_to_run=_run_to_run(budget),
        in_run=budget.in_run_sigma,
        in_run_time=budget.in_run_time,
        storage=budget.storage_sigma,
        whole_variation=budget.whole_variation,
        calibrated=declared and served,
    )


def _run_to_run(budget: ErrorBudget) -> tuple[tuple[float, float], ...]:
    """(temperature, sigma) pairs; a constant is one pair at NaN."""
    table = budget.run_to_run_table
    return ((float("nan"), budget.run_to_run_largest),) if table is None else tuple(table.items())
