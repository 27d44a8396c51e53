"""The cheapest campaign → the nearest one whose records tell what it calibrates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from planner.plan.by_hand import in_room
from planner.plan.task import Task
from planner.plan.visits_to_observability import observable
from planner.records import Campaign, TestVisits


def observable_campaign(task: Task, chosen: Campaign) -> Campaign:
    """The campaign itself where it tells what it calibrates; else with tests at further temperatures.

    What is added is not proved to be the least. More records lower no allowance, so that the requirements
    stay met. Raises InputError, with the remedy, when nothing that may be added helps.
    """
    found = observable(task.spec, chosen.visits)
    if not found.added:
        return chosen
    cost = _cost(task, found.visits)
    return replace(chosen, visits=found.visits, objective=cost, proved=False, added=found.added)


def _cost(task: Task, visits: Sequence[TestVisits]) -> float:
    """Weighted seconds of one batch's work: every resource is paid for once, as far as it is used most."""
    used = [
        task.tariff.amounts(
            v.test, v.temperatures_degc, np.array([v.repeats]), room=in_room(task.spec, v.test)
        )[0]
        for v in visits
    ]
    return float(np.max(used, axis=0) @ task.tariff.prices)
