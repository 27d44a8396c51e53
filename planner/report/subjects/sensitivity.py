"""The linear-combination coefficients, and the allowed sensor errors that follow from them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from planner.nouns.allowances import AllowedErrors
from planner.report.blocks import Report, Text, existing, section
from planner.report.numbers import percent
from planner.report.subjects import plan_tables

if TYPE_CHECKING:
    from planner.plan.spec_to_sensitivity import SensitivityRow


def sensitivity_report(rows: Sequence[SensitivityRow], units: Mapping[str, str]) -> Report:
    """The position error per unit of every column. units: error -> the spec's own unit of it."""
    table = section("sensitivities", "Sensitivities", plan_tables.rows_table(rows, units))
    return Report("Sensitivities", "", "", sections=existing(table))


def allowed_report(allowed: AllowedErrors) -> Report:
    """The corners of the allowed errors, genetic beside exact, and what the bench's best would use."""
    history = allowed.history
    tightness = [
        Text(f"requirement {i + 1}: the smallest errors that the bench can reach use {percent(share)}")
        for i, share in allowed.tightness.items()
    ]
    found = Text(
        f"genetic algorithm: {len(allowed.front)} Pareto points, {history.generations} generations, "
        f"{history.evaluations} evaluations ({history.stopped})"
    )
    bounds, corners = plan_tables.bounds_table(allowed), plan_tables.corners_table(allowed, compact=True)
    parts = section("allowed", "Allowed sensor errors", *tightness, bounds, corners, found)
    return Report("Allowed sensor errors", "", "", sections=existing(parts))
