"""The planning problem of one spec in the solver's terms: errors are groups, their choices rows.

The contributions of a row to the requirements are constants, so worst_case and rss are linear in the rows
(parts add, or their squares do); an exact percentile is bracketed by rss here and finished elsewhere.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from planner.nouns.allowances import Allowance, ErrorModel
from planner.nouns.array import Array
from planner.nouns.choices import Campaign, ErrorMenu, TestVisits
from planner.nouns.sensitivities import Constraint
from planner.plan.budget import allowance, constant_parts, uncalibrated
from planner.plan.by_hand import hand_made_visits, in_room
from planner.plan.costs import Tariff
from planner.plan.rows import ErrorRows, error_rows
from planner.solvers.gaussian_length import percentile
from planner.solvers.integer_problem import Group, Problem
from planner.solvers.linear_combination import combination, weights
from planner.spec.model import Spec

# From this probability on the squared quantile is convex in the covariance (tested over random ones).
TANGENT_FROM = 0.9
MIXTURES = 2000
MIXTURE_MARGIN = 1e-3


@dataclass(frozen=True)
class Task:
    """The planning problem of one spec in the solver's terms.

    rows: one entry per calibrated error, in the order of `models`; left: models that nobody calibrates
    by_hand: tests that the spec fixes altogether; they are made in any case
    """

    spec: Spec
    constraints: tuple[Constraint, ...]
    models: tuple[ErrorModel, ...]
    left: tuple[ErrorModel, ...]
    by_hand: tuple[TestVisits, ...]
    tariff: Tariff
    rows: tuple[ErrorRows, ...]
    problem: Problem

    @property
    def errors(self) -> tuple[str, ...]:
        """Names of the calibrated errors."""
        return tuple(model.name for model in self.models)


def within_seconds(task: Task, seconds: float) -> Task:
    """The same with another time for its proofs."""
    plan = task.spec.plan.model_copy(update={"time_limit": min(seconds, task.spec.plan.time_limit)})
    return replace(task, spec=task.spec.model_copy(update={"plan": plan}))


def planning_task(
    spec: Spec, models: Sequence[ErrorModel], menus: Sequence[ErrorMenu], constraints: Sequence[Constraint]
) -> Task:
    """Errors, menus and requirements as groups, rows and limits."""
    served = {menu.error for menu in menus}
    calibrated = tuple(model for model in models if model.name in served)
    left = tuple(model for model in models if model.name not in served)
    by_hand = hand_made_visits(spec)
    visited = [t for menu in menus for p in menu.points for t in p.temperatures_degc]
    tariff = Tariff(spec, [*visited, *(t for visit in by_hand for t in visit.temperatures_degc)])
    rows = tuple(error_rows(model.name, menus, tariff) for model in calibrated)
    limits = np.array([_limit(c) - _constant(c, calibrated, left) for c in constraints])
    groups = tuple(
        Group(np.zeros(len(r)), _contributions(constraints, r), r.amounts, np.arange(len(r))) for r in rows
    )
    forced = [_forced_amounts(spec, visit, tariff) for visit in by_hand]
    least = np.max([np.zeros(len(tariff.prices)), *forced], axis=0)
    problem = Problem(groups, tariff.prices, limits, least, tariff.within)
    return Task(spec, tuple(constraints), calibrated, left, by_hand, tariff, rows, problem)


def row_sizes(model: ErrorModel, rows: ErrorRows, rule: str) -> Array:
    """(R,) size of the error in every row, by a rule."""
    parts = constant_parts(model)
    if rule == "worst_case":
        return np.asarray(sum(parts) + rows.residual + rows.half_width)
    return np.asarray(np.sqrt(sum(p**2 for p in parts) + rows.residual**2 + rows.half_width**2))


def allowances(task: Task, chosen: Campaign, rule: str) -> tuple[Allowance, ...]:
    """The allowance of every error in a campaign, in the order of the spec's errors."""
    by_name = {model.name: model for model in task.models}
    calibrated = [
        allowance(by_name[choice.error], choice.points.residual, choice.half_width, rule)
        for choice in chosen.choices
    ]
    return (*calibrated, *(uncalibrated(model, rule) for model in task.left))


def extreme_allowances(task: Task, rule: str) -> tuple[tuple[Allowance, ...], tuple[Allowance, ...]]:
    """Every error as small as the bench can make it, and as large as it may be: the bounds of the genes."""
    least, most = [], []
    for model, rows in zip(task.models, task.rows, strict=True):
        sizes = row_sizes(model, rows, rule)
        small, large = int(sizes.argmin()), int(sizes.argmax())
        least.append(allowance(model, float(rows.residual[small]), float(rows.half_width[small]), rule))
        cheap = allowance(model, float(rows.residual[large]), float(rows.half_width[large]), rule)
        most.append(max(cheap, uncalibrated(model, rule), key=lambda a: a.allowed))
    alone = [uncalibrated(model, rule) for model in task.left]
    return (*least, *alone), (*most, *alone)


def _forced_amounts(spec: Spec, visit: TestVisits, tariff: Tariff) -> Array:
    repeats = np.array([visit.repeats])
    room = in_room(spec, visit.test)
    return np.asarray(tariff.amounts(visit.test, visit.temperatures_degc, repeats, room=room)[0])


def _limit(constraint: Constraint) -> float:
    """What the sum of contributions may be: the limit, its square, or a square that no percentile exceeds."""
    if constraint.rule == "worst_case":
        return constraint.limit
    if constraint.rule == "rss":
        return constraint.limit**2
    if _is_low(constraint):
        return constraint.limit**2 / (1 - _excess_of_parts(constraint))
    return (constraint.limit / _least_percentile_of_unit_rms(constraint)) ** 2


def _row_weights(constraint: Constraint, errors: Sequence[str]) -> Array:
    """(E,) what one unit of each error adds: its weight, or for a low percentile its own percentile alone."""
    if not _is_low(constraint):
        return weights(constraint, errors)
    return np.array([float(combination(constraint, [error])(np.ones(1))) for error in errors])


def _is_low(constraint: Constraint) -> bool:
    return constraint.percentile is not None and constraint.percentile < TANGENT_FROM


def _excess_of_parts(constraint: Constraint) -> float:
    """By how much, at most, the errors' own squared percentiles add up to more than that of all together.

    For low probabilities q² is nearly concave in the covariance, so the sum over the errors hardly exceeds
    it. The largest relative excess is looked for among many mixtures of the errors; a margin goes on top.
    """
    names = list(constraint.vectors)
    alone = _row_weights(constraint, names) ** 2
    names, alone = [n for n, q in zip(names, alone, strict=True) if q > 0], alone[alone > 0]
    rng = np.random.default_rng(0)  # the same mixtures every time
    shares = rng.dirichlet(np.full(len(names), 0.3), MIXTURES)
    together = combination(constraint, names)(np.sqrt(shares / alone)) ** 2
    return max(0.0, float((1 - together).max())) + MIXTURE_MARGIN


def _least_percentile_of_unit_rms(constraint: Constraint) -> float:
    """The smallest p-quantile of the length among Gaussian vectors of unit root mean square length.

    Among all spectra the extremes lie where m of the k eigenvalues are equal and the others zero (Székely
    and Bakirov, Probab. Theory Relat. Fields 126, 2003); a margin of 1e-9 covers rounding.
    """
    assert constraint.percentile is not None
    components = max(np.atleast_2d(v).shape[1] for v in constraint.vectors.values())
    spectra = [np.diag([1 / m] * m + [0.0] * (components - m)) for m in range(1, components + 1)]
    return float(np.min(percentile(np.array(spectra), constraint.percentile))) * (1 - 1e-9)


def _power(constraint: Constraint) -> int:
    return 1 if constraint.rule == "worst_case" else 2


def _constant(constraint: Constraint, models: Sequence[ErrorModel], left: Sequence[ErrorModel]) -> float:
    """What the parts that no row decides add to the sum of contributions."""
    power = _power(constraint)
    parts: list[tuple[str, tuple[float, ...]]] = [(m.name, constant_parts(m)) for m in models]
    parts += [(model.name, (*constant_parts(model), model.whole_variation)) for model in left]
    weight = _row_weights(constraint, [name for name, _ in parts])
    return float(sum(sum((w * p) ** power for p in own) for w, (_, own) in zip(weight, parts, strict=True)))


def _contributions(constraints: Sequence[Constraint], rows: ErrorRows) -> Array:
    """(R, C) what temperature residual and estimate of each row add to each sum."""
    columns = []
    for constraint in constraints:
        power, weight = _power(constraint), float(_row_weights(constraint, [rows.error])[0])
        columns.append((weight * rows.residual) ** power + (weight * rows.half_width) ** power)
    return np.stack(columns, axis=1)
