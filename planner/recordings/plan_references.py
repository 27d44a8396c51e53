"""What a plan's records expose the unit to: the reference of every step, from its motion and the latitude."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from planner.campaign.exposure import exposure
from planner.nouns.array import Array
from planner.nouns.plan_file import PlanOnBenches, plan_part
from planner.nouns.step import Step


def references_of(document: Mapping[str, Any], latitude: float) -> dict[str, Array]:
    """Step -> (6,) true inertial rate (rad/s, the Earth's included) and specific force (m/s^2) in the body.

    document: tree of plan.json; latitude: of the bench, rad. A record on a centrifuge whose arm the plan does
    not name is left out, since its rate √(a/R) is not known. Raises InputError for what is no plan,
    or does not describe its benches.
    """
    plan = plan_part(document, PlanOnBenches)
    records = [step for step in plan.steps if step.action == "record"]
    motions = _motions(records)
    found = {}
    for step in records:
        bench = plan.benches.get(step.bench)
        arm, axes = (None, 2) if bench is None else (bench.arm_m, bench.axes)
        if "acceleration_g" in (step.motion or {}) and arm is None:
            continue
        seen = exposure(step.motion, step.seconds, latitude, arm=arm, mount=_mount(step, motions, axes))
        found[step.id] = np.concatenate([seen.rate, seen.specific_force])
    return found


def _motion(step: Step) -> int | None:
    number = re.search(r"/m(\d+)$", step.id)
    return None if number is None else int(number[1])


def _motions(records: list[Step]) -> dict[str | None, int]:
    """Test -> its number of motions."""
    found: dict[str | None, int] = {}
    for step in records:
        found[step.test] = max(found.get(step.test, 0), _motion(step) or 0)
    return found


def _mount(step: Step, motions: Mapping[str | None, int], axes: int) -> int:
    """Body axis along axis 1: z; on a table of one axis x, y, z for a third of the motions each."""
    number, count = _motion(step), motions.get(step.test, 0)
    if axes > 1 or number is None or count < 3:
        return 2
    return min(2, 3 * (number - 1) // count)
