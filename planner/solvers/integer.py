"""Choosing one row per group at least total cost, where rows share resources: an integer program, proved.

The program is planner.solvers.integer_problem's. Solved with HiGHS through scipy.optimize.milp.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from planner.solvers.integer_form import standard_form
from planner.solvers.integer_problem import Array, Cut, Indices, Problem, Rows
from planner.solvers.quiet import nothing_on_stdout

# So many rows of least reduced cost per group nearly always hold the optimum; the proof then looks at every
# row that could beat what they gave.
FIRST_LOOK_ROWS = 30


Check = Callable[[Rows], Cut | None]
Told = Callable[[float, float], None]


@dataclass(frozen=True)
class Choice:
    """The chosen row of each group (caller's numbers), cost, proved lower bound, whether the proof ended."""

    rows: Rows
    cost: float
    bound: float
    proved: bool

    @property
    def gap(self) -> float:
        """(cost − bound) / cost."""
        return max(0.0, self.cost - self.bound) / self.cost if self.cost > 0 else 0.0


def solve(
    problem: Problem,
    *,
    check: Check | None = None,
    start: Rows | None = None,
    time_limit: float = 120.0,
    most_solves: int = 400,
    told: Told | None = None,
) -> Choice | None:
    """The cheapest selection within the limits, with its proof; None when there is none.

    start: a selection that is known to be acceptable, to begin with; told: the cost of the best so far and
    the bound, whenever they are better known.

    check: asked about every selection found; returns a cut that removes it (for a condition that no linear
    row can say, such as an exact percentile) or None to accept it. Every cut must keep all acceptable
    selections, so that the bound of each relaxation stays a bound. When time or solves run out, the best
    accepted selection is returned with the bound proved so far and `proved` False. Raises TimeoutError when
    they run out before any selection was found.
    """
    deadline = time.monotonic() + time_limit
    folded = fold_private_resources(problem)
    relaxed = _relaxation(folded)
    if relaxed is None:
        return None
    if told is not None and start is not None:
        told(problem.cost(start), relaxed.bound)
    likely = [np.argsort(r, kind="stable")[:FIRST_LOOK_ROWS] for r in relaxed.reduced_costs]
    first = _solve_with_cuts(_restricted(folded, likely), check, deadline, most_solves)
    known = [] if start is None else [Choice(start, problem.cost(start), relaxed.bound, False)]
    known += [] if first.choice is None else [first.choice]
    ceiling = min((choice.cost * (1 + 1e-9) for choice in known), default=np.inf)
    # a row that costs more than the whole slack between bound and ceiling is in no better selection
    possible = [np.flatnonzero(relaxed.bound + r <= ceiling) for r in relaxed.reduced_costs]
    if first.finished and all(np.isin(p, k).all() for p, k in zip(possible, likely, strict=True)):
        return _cheapest(known, np.inf, finished=True)
    if told is not None and known:
        told(min(choice.cost for choice in known), relaxed.bound)
    second = _solve_with_cuts(_restricted(folded, possible), check, deadline, most_solves)
    known = ([] if second.choice is None else [second.choice]) + known
    if not known and not second.finished:
        raise TimeoutError(f"no selection was found within {time_limit:g} s and {most_solves} solves")
    return _cheapest(known, max(second.bound, relaxed.bound), finished=second.finished)


def _cheapest(known: Sequence[Choice], bound: float, *, finished: bool) -> Choice | None:
    """The best selection with what is proved of it: nothing cheaper when the search has ended."""
    best = min(known, key=lambda choice: choice.cost, default=None)
    return best and replace(best, bound=best.cost if finished else min(bound, best.cost), proved=finished)


@dataclass(frozen=True)
class _Run:
    """Outcome of one relaxation with its cuts; finished without a choice means that there is none."""

    choice: Choice | None
    bound: float
    finished: bool


def monotone_cut(problem: Problem, chosen: Rows) -> Cut:
    """Removes every selection that is nowhere better than `chosen`.

    Valid for any condition that can only get worse when contributions grow:
    Σ_g [contribution_gr >= contribution of the chosen row] x_gr <= groups − 1.
    """
    worse = []
    for group, r in zip(problem.groups, chosen, strict=True):
        worse.append(np.all(group.contribution >= group.contribution[r], axis=1).astype(float))
    return Cut(tuple(worse), len(problem.groups) - 1)


def fold_private_resources(problem: Problem) -> Problem:
    """A resource that only one group uses is simply part of that group's cost."""
    users = np.array([np.any(group.amounts > 0, axis=0) for group in problem.groups]).sum(axis=0)
    private = (users <= 1) & (problem.forced <= 0)
    groups = tuple(
        replace(
            g, cost=g.cost + g.amounts[:, private] @ problem.prices[private], amounts=g.amounts[:, ~private]
        )
        for g in problem.groups
    )
    within = None if problem.within is None else _renumbered(problem.within, ~private)
    kept = replace(problem, prices=problem.prices[~private], forced=problem.forced[~private])
    return replace(kept, groups=groups, within=within)


def _renumbered(within: Indices, kept: NDArray[np.bool_]) -> Indices:
    """`within` of the resources that are kept; one whose surrounding resource went has none."""
    number = np.where(kept, np.cumsum(kept) - 1, -1)
    return np.where(within < 0, -1, number[within])[kept]


def _restricted(problem: Problem, rows: Sequence[Indices]) -> Problem:
    """The problem with only these rows of each group."""
    kept = tuple(group.take(np.sort(r)) for group, r in zip(problem.groups, rows, strict=True))
    return replace(problem, groups=kept)


@dataclass(frozen=True)
class _Relaxed:
    """Linear relaxation: its cost is a bound; choosing a row raises it by at least the row's reduced cost."""

    bound: float
    reduced_costs: tuple[Array, ...]


def _relaxation(problem: Problem) -> _Relaxed | None:
    """The linear program without integrality; None when even that has no answer."""
    from scipy.optimize import linprog
    from scipy.sparse import vstack

    form = standard_form(problem, ())
    two_sided = form.low == form.high
    upper, lower = np.isfinite(form.high) & ~two_sided, np.isfinite(form.low) & ~two_sided
    answer = linprog(
        form.objective,
        A_ub=vstack([form.matrix[upper], -form.matrix[lower]], format="csr"),
        b_ub=np.concatenate([form.high[upper], -form.low[lower]]),
        A_eq=form.matrix[two_sided],
        b_eq=form.low[two_sided],
        bounds=np.column_stack([form.least, form.most]),
        method="highs",
    )
    if answer.status == 2:
        return None
    starts = np.cumsum([len(group.cost) for group in problem.groups])[:-1]
    rows = sum(len(group.cost) for group in problem.groups)
    if answer.status != 0:  # no relaxation in time: nothing can be said about any row
        zeros = np.zeros(rows)
        return _Relaxed(_free_bound(problem), tuple(np.split(zeros, starts)))
    reduced = np.maximum(answer.lower.marginals[:rows], 0.0)
    return _Relaxed(float(answer.fun) - 1e-6 * abs(answer.fun), tuple(np.split(reduced, starts)))


def _free_bound(problem: Problem) -> float:
    """What any selection costs at least, without looking at the limits."""
    folded = fold_private_resources(problem)
    paid = np.where(folded.prices < 0, 1.0, folded.forced)
    return sum(float(g.cost.min()) for g in folded.groups) + float(folded.prices @ paid)


def _solve_with_cuts(problem: Problem, check: Check | None, deadline: float, most_solves: int) -> _Run:
    """Solve, ask `check`, cut, repeat: the last bound holds for the uncut problem."""
    cuts: list[Cut] = []
    bound = _free_bound(problem)
    for _ in range(most_solves):
        answer = _milp(problem, cuts, max(deadline - time.monotonic(), 0.5))
        if answer is None:
            return _Run(None, np.inf, True)
        positions, proved_bound, finished = answer
        bound = max(bound, proved_bound)
        if positions is None:
            break
        rows = tuple(int(g.index[r]) for g, r in zip(problem.groups, positions, strict=True))
        cut = check(rows) if check else None
        if not problem.within_limits(positions):  # HiGHS keeps a limit to 1e-6 only; this one was overstepped
            cut = _scatter(monotone_cut(problem, positions), problem)
        if cut is None:
            cost = problem.cost(positions)
            return _Run(Choice(rows, cost, cost if finished else min(bound, cost), finished), bound, finished)
        cuts.append(cut)
        if time.monotonic() > deadline:
            break
    return _Run(None, bound, False)


def _scatter(cut: Cut, problem: Problem) -> Cut:
    """Coefficients by position -> by the caller's row numbers."""
    wide = []
    for group, coefficients in zip(problem.groups, cut.coefficients, strict=True):
        by_number = np.zeros(int(group.index.max()) + 1)
        by_number[group.index] = coefficients
        wide.append(by_number)
    return Cut(tuple(wide), cut.limit)


def _milp(problem: Problem, cuts: Sequence[Cut], seconds: float) -> tuple[Rows | None, float, bool] | None:
    """One HiGHS run: positions (None if it found none in time), lower bound, finished; None if infeasible."""
    from scipy.optimize import Bounds, LinearConstraint, milp

    form = standard_form(problem, cuts)
    with nothing_on_stdout():
        result = milp(
            form.objective,
            constraints=LinearConstraint(form.matrix, form.low, form.high),
            integrality=form.integral,
            bounds=Bounds(form.least, np.where(form.integral, 1.0, form.most)),
            options={"mip_rel_gap": 0.0, "time_limit": seconds},
        )
    if result.status == 2:
        return None
    if result.x is None:
        return None, -np.inf, False
    starts = np.cumsum([0, *(len(g.cost) for g in problem.groups)])
    positions = tuple(int(result.x[a:b].argmax()) for a, b in pairwise(starts))
    bound = -np.inf if result.mip_dual_bound is None else float(result.mip_dual_bound)
    return positions, bound, result.status == 0
