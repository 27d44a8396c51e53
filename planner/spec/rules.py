"""What one field of a spec cannot tell: whether its parts fit together. Each finding has its place."""

from __future__ import annotations

from planner.spec.plugins import plugins_load
from planner.spec.review import Review
from planner.spec.rules_alignment import initial_alignment
from planner.spec.rules_benches import benches
from planner.spec.rules_flight_temperature import flight_temperatures
from planner.spec.rules_method import method
from planner.spec.rules_noise import noise
from planner.spec.rules_plan import plan
from planner.spec.rules_ramps import ramps
from planner.spec.rules_recalibration import recalibration
from planner.spec.rules_requirement import effects_declared, requirements, sensitivities, trajectory
from planner.spec.rules_schedule import schedule
from planner.spec.rules_tests import tests
from planner.spec.rules_travel import travel
from planner.spec.rules_unit import budgets


def review(sheet: Review) -> None:
    """Apply every rule; faults and warnings are noted on the sheet.

    The rules ask the plug-ins: when one that the spec names cannot be used, that is all that is said.
    """
    if not plugins_load(sheet):
        return
    for rule in (
        requirements,
        flight_temperatures,
        trajectory,
        sensitivities,
        effects_declared,
        budgets,
        noise,
        benches,
        tests,
        ramps,
        travel,
        plan,
        method,
        schedule,
        recalibration,
        initial_alignment,
    ):
        rule(sheet)
