"""The parts of an error's budget and how they make up its size.

    worst_case: ε = run_to_run + in_run + storage + temperature + estimate;  otherwise the squares add.

Run-to-run stays in the budget whatever is calibrated, because every flight is a new power-on: a calibration
removes the mean, never the spread.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from planner.nouns.allowances import Allowance, ErrorModel
from planner.nouns.array import Array
from planner.nouns.sensitivities import Constraint
from planner.solvers.linear_combination import combination


def constant_parts(model: ErrorModel) -> tuple[float, float, float]:
    """Run-to-run, in-run and storage: what no choice of the campaign changes."""
    return model.largest_run_to_run, model.in_run, model.storage


def size(parts: Sequence[float] | Array, rule: str) -> float:
    """Size of an error from its parts by the rule of a requirement."""
    values = np.asarray(parts)
    return float(values.sum()) if rule == "worst_case" else float(np.sqrt((values**2).sum()))


def allowance(model: ErrorModel, temperature: float, estimate: float, rule: str) -> Allowance:
    """The allowance of one error with a given temperature residual and half-width."""
    parts = (*constant_parts(model), temperature, estimate)
    return Allowance(model.name, model.unit, size(parts, rule), *parts)


def uncalibrated(model: ErrorModel, rule: str) -> Allowance:
    """What an error amounts to when nobody calibrates it."""
    return replace(allowance(model, 0.0, model.whole_variation, rule), calibrated=False)


def common_rule(constraints: Sequence[Constraint]) -> str:
    """The rule by which `allowed` sums the parts: the strictest of the requirements'."""
    return "worst_case" if any(c.rule == "worst_case" for c in constraints) else "rss"


def reached(constraint: Constraint, allowances: Sequence[Allowance]) -> float:
    """The navigation error that these allowances make, by the constraint's own rule, SI."""
    sizes = np.array([size(tuple(a.parts.values()), constraint.rule) for a in allowances])
    return float(combination(constraint, [a.error for a in allowances])(sizes))


def binding_parts(
    constraint: Constraint, allowances: Sequence[Allowance], weight: Mapping[str, float]
) -> tuple[tuple[str, float], ...]:
    """Share of every part of every error in the constraint's sum (or sum of squares), largest first."""
    power = 1 if constraint.rule == "worst_case" else 2
    terms = {
        f"{a.error} {_part_name(a, part)}": (weight[a.error] * value) ** power
        for a in allowances
        for part, value in a.parts.items()
    }
    total = sum(terms.values()) or 1.0
    return tuple(sorted(((name, value / total) for name, value in terms.items()), key=lambda item: -item[1]))


def _part_name(allowance: Allowance, part: str) -> str:
    return "not calibrated" if part == "estimate" and not allowance.calibrated else part
