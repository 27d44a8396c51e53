"""Exact percentiles for the integer program: selections are judged exactly, and cut off when they fail."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from planner.nouns.array import Array
from planner.nouns.sensitivities import Constraint
from planner.plan.budget import uncalibrated
from planner.plan.task import TANGENT_FROM, Task, row_sizes
from planner.solvers.integer import monotone_cut
from planner.solvers.integer_problem import Cut, Rows
from planner.solvers.linear_combination import combination

# The integer program keeps a cut to 1e-6 of its right-hand side, which is why tangents are scaled to one;
# a selection that breaks its tangent by less than this might come back again and again.
SOLVER_TOLERANCE = 1e-5


def objection(task: Task, rows: Rows, *, cautious: bool = False) -> Cut | None:
    """A cut when the chosen rows break a percentile requirement, which rss alone cannot tell exactly.

    cautious: cut by tangents at every probability. Where the squared quantile is concave they also remove
    selections that would do, so that way finds good campaigns but proves nothing.
    """
    for constraint in task.constraints:
        if constraint.rule != "percentile":
            continue
        squares = _squares(task, rows)
        names = [*task.errors, *(model.name for model in task.left)]
        length = combination(constraint, names)
        if float(length(np.sqrt(squares))) > constraint.limit * (1 + 1e-9):
            return _tangent_cut(task, constraint, names, squares, rows, cautious)
    return None


def _squares(task: Task, rows: Rows) -> Array:
    """(E + left,) squared size of every error for the chosen rows."""
    own = [row_sizes(m, r, "rss")[row] for m, r, row in zip(task.models, task.rows, rows, strict=True)]
    alone = [uncalibrated(model, "rss").allowed for model in task.left]
    return np.array([*own, *alone]) ** 2


def _tangent_cut(
    task: Task, constraint: Constraint, names: Sequence[str], squares: Array, rows: Rows, cautious: bool
) -> Cut:
    """Σ_j (∂q²/∂a_j) a_j <= limit², a = squared sizes: the tangent of the convex set q(a) <= limit.

    q² is homogeneous of degree one in a, so that the tangent passes through the origin. For p >= 0.9 the
    squared quantile is convex in the covariance (tested over random covariances); below that only the
    selections that are nowhere better are cut off.
    """
    assert constraint.percentile is not None
    if constraint.percentile < TANGENT_FROM and not cautious:
        return monotone_cut(task.problem, rows)
    slope = _gradient(lambda a: combination(constraint, names)(np.sqrt(a)) ** 2, squares)
    limit = constraint.limit**2 * (1 + 1e-7)
    if float(slope @ squares) <= limit * (1 + SOLVER_TOLERANCE):
        return monotone_cut(task.problem, rows)
    coefficients = [
        s / limit * row_sizes(m, r, "rss") ** 2
        for s, m, r in zip(slope, task.models, task.rows, strict=False)
    ]
    alone = slope[len(task.models) :] @ squares[len(task.models) :]
    return Cut(tuple(coefficients), 1.0 - float(alone) / limit)


def _gradient(function: Callable[[Array], Array], at: Array) -> Array:
    """Central differences of fourth order; the step leaves 1e-9 relative error on a smooth function."""
    slope = np.zeros(len(at))
    for j, a in enumerate(at):
        h = 1e-2 * a
        if h == 0:
            continue
        shifted = np.repeat(at[None, :], 4, axis=0)
        shifted[:, j] += np.array([-2, -1, 1, 2]) * h
        values = function(shifted)
        slope[j] = float(values @ np.array([1, -8, 8, -1])) / (12 * h)
    return slope
