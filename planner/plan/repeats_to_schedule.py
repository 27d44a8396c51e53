"""Repeat menus → the campaign of least cost, proved: temperatures, repeats and allowances chosen together.

The errors are the groups of an integer program (`planner.solvers.integer`); a row of an error is one set of
temperature points with one level of repeats in one test. Installations, soaks, ramps and records are shared
resources: a soak is paid once per distinct temperature and bench, a record that serves several errors once.
The contributions of a row to the requirements are constants, so worst_case and rss are linear in the rows
(parts add, or their squares do); an exact percentile is bracketed by rss and finished by exact evaluation.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from decimal import Decimal

import numpy as np

from planner.errors import InfeasibleError, StoppedEarly
from planner.nouns.choices import Campaign, ErrorChoice, TestVisits
from planner.nouns.sensitivities import Constraint
from planner.plan.budget import binding_parts, reached
from planner.plan.by_hand import is_hand_made
from planner.plan.confidence import half_widths
from planner.plan.percentile_cuts import objection
from planner.plan.task import TANGENT_FROM, Task, extreme_allowances, row_sizes
from planner.solvers.integer import Choice, Told, solve
from planner.solvers.integer_problem import Rows
from planner.solvers.linear_combination import weights
from planner.units import from_si


def campaign(task: Task, told: Told | None = None) -> Campaign:
    """The cheapest campaign that meets every constraint, with its proof.

    A spec that fixes every test by hand is only timed: its campaign is returned whether it meets the
    requirements or not. told: the cost of the best so far and the bound, whenever they are better known.
    Raises InfeasibleError (what binds, nearest limit) when even the most repeats at the
    best points do not suffice, and StoppedEarly when nothing was found within `plan.time_limit`.
    """
    if is_hand_made(task.spec):
        task = _unlimited(task)
    else:
        _refuse_the_impossible(task)
    limit = task.spec.plan.time_limit
    try:
        choice = solve(
            task.problem,
            check=lambda rows: objection(task, rows),
            start=_beginning(task),
            time_limit=limit,
            told=told,
        )
    except TimeoutError as error:
        raise StoppedEarly(f"{error}; give plan.time_limit more, or fewer candidates") from None
    if choice is None:
        raise InfeasibleError("the requirements can be met one by one but not together")
    return campaign_of(task, choice)


def campaign_of(task: Task, choice: Choice) -> Campaign:
    """The campaign behind a choice of rows."""
    visits = visits_of(task, choice.rows)
    explained = [_explain(task, e, row, visits) for e, row in enumerate(choice.rows)]
    return Campaign(visits, tuple(explained), choice.cost, choice.bound, choice.proved)


def _beginning(task: Task) -> Rows | None:
    """A selection that meets the requirements, so that there is an answer when time runs out.

    Every error as small as it can be; for percentiles below the tangents' range a better one, found with
    tangents that cut too much.
    """
    safest = tuple(
        int(row_sizes(m, r, "worst_case").argmin()) for m, r in zip(task.models, task.rows, strict=True)
    )
    known = [safest] if task.problem.within_limits(safest) and objection(task, safest) is None else []
    if any(c.percentile is not None and c.percentile < TANGENT_FROM for c in task.constraints):
        limit = task.spec.plan.time_limit / 4
        with suppress(TimeoutError):
            found = solve(
                task.problem, check=lambda rows: objection(task, rows, cautious=True), time_limit=limit
            )
            known += [] if found is None else [found.rows]
    return min(known, key=task.problem.cost, default=None)


def visits_of(task: Task, rows: Rows) -> tuple[TestVisits, ...]:
    """The union of what the chosen rows need, test by test in the order of the spec."""
    needed: dict[str, dict[float, int]] = {
        visit.test: dict(zip(visit.temperatures_degc, visit.repeats, strict=True)) for visit in task.by_hand
    }
    for options, row in zip(task.rows, rows, strict=True):
        at = needed.setdefault(options.test(row), {})
        points = options.points(row).temperatures_degc
        for t, n in zip(points, options.repeats(row), strict=True):
            at[t] = max(at.get(t, 0), n)
    return tuple(
        TestVisits(test, tuple(sorted(needed[test])), tuple(needed[test][t] for t in sorted(needed[test])))
        for test in task.spec.tests
        if test in needed
    )


def _unlimited(task: Task) -> Task:
    free = replace(task.problem, limits=np.full(len(task.constraints), np.inf))
    return replace(task, constraints=(), problem=free)


def _refuse_the_impossible(task: Task) -> None:
    """Raise when a requirement is not met although every error is as small as the bench can make it.

    All such requirements are named, each at the instant that is worst for it.
    """
    beyond: dict[int, Impossible] = {}
    for constraint in task.constraints:
        best, _ = extreme_allowances(task, constraint.rule)
        value = reached(constraint, best)
        worse = beyond.get(constraint.requirement)
        if value > constraint.limit * (1 + 1e-9) and (worse is None or value > worse.value):
            names = [a.error for a in best]
            weight = dict(zip(names, weights(constraint, names), strict=True))
            beyond[constraint.requirement] = Impossible(
                constraint, value, binding_parts(constraint, best, weight)
            )
    if beyond:
        first = next(iter(beyond.values()))
        raise InfeasibleError(
            "; ".join(map(_impossible, beyond.values())),
            requirement=first.constraint.requirement,
            binds=first.binds,
            nearest_limit=first.value,
        )


@dataclass(frozen=True)
class Impossible:
    """A requirement that no campaign meets: the least that is reached, SI, and the parts that make it up."""

    constraint: Constraint
    value: float
    binds: tuple[tuple[str, float], ...]


def _impossible(found: Impossible) -> str:
    """What cannot be met, the nearest limit that can, and the parts that make up most of it."""
    constraint, value, unit = found.constraint, found.value, found.constraint.unit
    shares = ", ".join(f"{part} {share:.0%}" for part, share in found.binds[:4] if share >= 0.005)
    return (
        f"requirement {constraint.requirement + 1} ({constraint.error} within "
        f"{figure(from_si(constraint.limit, unit))} {unit}) cannot be met: "
        f"with every error as small as the bench can make it, "
        f"{figure(from_si(value, unit))} {unit} are reached; what binds: {shares}; "
        f"the nearest limit that can be met is {rounded_up(from_si(value, unit))} {unit}"
    )


def figure(value: float) -> str:
    """Six digits, never 3.1e+07."""
    return f"{Decimal(f'{value:.6g}'):f}"


def rounded_up(value: float, digits: int = 4) -> str:
    """A figure rounded up to a few digits, so that a limit set to it can be met."""
    step = 10.0 ** (math.floor(math.log10(value)) - digits + 1)
    return f"{Decimal(f'{math.ceil(value / step) * step:.{digits}g}'):f}"  # 31180, not 3.118e+04


def _explain(task: Task, e: int, row: int, visits: Sequence[TestVisits]) -> ErrorChoice:
    """What the error was given; records shared with another error can make its half-width smaller."""
    rows, model = task.rows[e], task.models[e]
    points = rows.points(row)
    visit = next(v for v in visits if v.test == rows.test(row))
    made = dict(zip(visit.temperatures_degc, visit.repeats, strict=True))
    repeats = [made[t] for t in points.temperatures_degc]
    return ErrorChoice(
        error=rows.error,
        test=visit.test,
        points=points,
        needed_repeats=rows.repeats(row),
        needed_half_width=float(rows.half_width[row]),
        half_width=float(half_widths(task.spec, model, visit.test, points.temperatures_degc, repeats).max()),
    )
