"""An integer program as matrices: the standard form that HiGHS takes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.solvers.integer_problem import Array, Cut, Indices, Problem


@dataclass(frozen=True)
class StandardForm:
    """min objective·v, low <= matrix v <= high, least <= v <= most; first the rows' columns (`integral`)."""

    objective: Array
    matrix: Any
    low: Array
    high: Array
    least: Array
    most: Array
    integral: NDArray[np.bool_]


@dataclass(frozen=True)
class _Row:
    """low <= Σ values · v[columns] <= high."""

    columns: Indices
    values: Array
    low: float
    high: float


def standard_form(problem: Problem, cuts: Sequence[Cut]) -> StandardForm:
    """The program with its cuts: columns of the rows, group by group, then the amounts of the resources."""
    from scipy.sparse import coo_array

    starts = np.cumsum([0, *(len(g.cost) for g in problem.groups)])
    count = int(starts[-1])
    rows = [
        *_one_each(problem, starts),
        *_limits(problem, count),
        *_saved(problem, starts),
        *_paid(problem, starts),
        *_cut_away(problem, cuts, count),
    ]
    place = np.repeat(np.arange(len(rows)), [len(row.columns) for row in rows])
    columns, values = (
        np.concatenate(part) for part in zip(*((r.columns, r.values) for r in rows), strict=True)
    )
    shape = (len(rows), count + len(problem.prices))
    return StandardForm(
        objective=np.concatenate([*(g.cost for g in problem.groups), problem.prices]),
        matrix=coo_array((values, (place, columns)), shape=shape).tocsr(),
        low=np.array([row.low for row in rows]),
        high=np.array([row.high for row in rows]),
        least=np.concatenate([np.zeros(count), problem.forced]),
        most=np.concatenate([np.full(count, np.inf), np.where(problem.prices < 0, 1.0, np.inf)]),
        integral=np.arange(count + len(problem.prices)) < count,
    )


def _one_each(problem: Problem, starts: Indices) -> Iterator[_Row]:
    """Σ_r x_gr = 1."""
    for group, start in zip(problem.groups, starts[:-1], strict=True):
        yield _Row(np.arange(start, start + len(group.cost)), np.ones(len(group.cost)), 1.0, 1.0)


def _limits(problem: Problem, count: int) -> Iterator[_Row]:
    """Σ contribution x <= limit, by the limit's size."""
    for c in np.flatnonzero(np.isfinite(problem.limits)):
        limit = problem.limits[c]
        unit = abs(limit) or 1.0
        values = np.concatenate([g.contribution[:, c] for g in problem.groups]) / unit
        yield _Row(np.arange(count), values, -np.inf, limit / unit)


def _saved(problem: Problem, starts: Indices) -> Iterator[_Row]:
    """Of a negative price: y_k <= forced_k + Σ amount x, and y_k <= y of the resource that it is within."""
    count = int(starts[-1])
    for k in np.flatnonzero(problem.prices < 0):
        own = [s + np.flatnonzero(g.amounts[:, k]) for g, s in zip(problem.groups, starts[:-1], strict=True)]
        users = np.concatenate([*own, [count + k]])
        yield _Row(users, np.append(np.full(len(users) - 1, -1.0), 1.0), -np.inf, float(problem.forced[k]))
        if problem.within is not None and problem.within[k] >= 0:
            both = np.array([count + k, count + problem.within[k]])
            yield _Row(both, np.array([1.0, -1.0]), -np.inf, 0.0)


def _paid(problem: Problem, starts: Indices) -> Iterator[_Row]:
    """y_k >= Σ_r amount_grk x_gr, group by group."""
    for k in np.flatnonzero(problem.prices >= 0):
        for group, start in zip(problem.groups, starts[:-1], strict=True):
            uses = np.flatnonzero(group.amounts[:, k])
            if len(uses):
                columns = np.append(start + uses, starts[-1] + k)
                yield _Row(columns, np.append(-group.amounts[uses, k], 1.0), 0.0, np.inf)


def _cut_away(problem: Problem, cuts: Sequence[Cut], count: int) -> Iterator[_Row]:
    """Each cut, its coefficients by position."""
    for cut in cuts:
        parts = [c[g.index] for c, g in zip(cut.coefficients, problem.groups, strict=True)]
        yield _Row(np.arange(count), np.concatenate(parts), -np.inf, cut.limit)
