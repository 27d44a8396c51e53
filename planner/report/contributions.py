"""From metres to each sensor error to its parts: what every part of every error adds to every requirement."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planner.nouns.allowances import Allowance
from planner.nouns.plan import Achieved, Plan
from planner.nouns.sensitivities import Constraint
from planner.solvers.linear_combination import combined, weights

PARTS = ("run_to_run", "in_run", "storage", "temperature", "estimate")
PART_NAMES = {  # in words; white noise and alignment are of a flight alone
    "run_to_run": "run to run",
    "in_run": "in run",
    "storage": "storage",
    "temperature": "temperature residual",
    "estimate": "estimate (repeats)",
    "noise": "white noise",
    "alignment": "initial alignment",
}


@dataclass(frozen=True)
class Contribution:
    """What one error adds to one requirement.

    share: of the achieved value (worst_case) or of its square (rss, percentile); parts: the same, split by
    part in the order of `PARTS`; per_unit: SI of the requirement per SI unit of the error, NaN if unknown
    """

    error: str
    share: float
    parts: tuple[float, ...]
    per_unit: float


def is_sum(achieved: Achieved) -> bool:
    """Whether contributions add up as they are; otherwise their squares do."""
    return achieved.rule == "worst_case"


def contributions(plan: Plan, index: int, constraints: Sequence[Constraint]) -> tuple[Contribution, ...]:
    """All errors that contribute to requirement `index`, the largest first."""
    achieved = plan.requirements[index]
    total = math.fsum(achieved.shares.values())
    binding = binding_constraint(plan, index, constraints)
    found = [
        Contribution(
            allowance.error,
            share := (achieved.shares.get(allowance.error, 0.0) / total if total > 0 else 0.0),
            tuple(share * part for part in part_shares(allowance, is_sum(achieved))),
            _per_unit(binding, allowance.error),
        )
        for allowance in plan.allowances
    ]
    return tuple(sorted(found, key=lambda c: -c.share))


def part_shares(allowance: Allowance, adds: bool) -> tuple[float, ...]:
    """Each part's share of the allowance (`adds`) or of its square, in the order of `PARTS`; 0 if it is 0."""
    values = [allowance.parts[name] if adds else allowance.parts[name] ** 2 for name in PARTS]
    total = math.fsum(values)
    return tuple(value / total if total > 0 else 0.0 for value in values)


def binding_constraint(plan: Plan, index: int, constraints: Sequence[Constraint]) -> Constraint | None:
    """The constraint of requirement `index` that leaves least room: its own instant when `at: any`."""
    own = [c for c in constraints if c.requirement == index]
    if len(own) < 2:
        return own[0] if own else None
    errors = [a.error for a in plan.allowances]
    sizes = np.array([a.allowed for a in plan.allowances])
    used = [float(combined(c, errors, sizes)) / c.limit for c in own]
    return own[int(np.argmax(used))]


def _per_unit(constraint: Constraint | None, error: str) -> float:
    return math.nan if constraint is None else float(weights(constraint, [error])[0])
