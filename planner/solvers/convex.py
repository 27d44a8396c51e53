"""Exact optima by convex programming: corners of the allowed region, the campaign without whole numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Any

import numpy as np

from planner.errors import InfeasibleError
from planner.records import Array, Constraint, Rule
from planner.solvers.limit_surface import LimitSurface
from planner.solvers.linear_combination import weights

EVEN = "even"
# cvxpy's interior points stop at 1e-8; a hundred times that tells a wrong model from an unfinished solve
_AGREEMENT = 1e-6


class Corners:
    """Corners of the region {lower <= ε <= upper, every constraint met} of E errors.

        maximise ε_j               with every other error at its lower bound        `error(j)`
        maximise λ                 with ε = lower + λ (upper − lower), λ <= 1       `even()`

    worst_case is linear and rss a second-order cone; cvxpy solves them, parametrised by the objective so
    that the second corner takes milliseconds. Its answer, good to eight digits, is then taken to the last
    digit along the ray that it found. Percentiles are no convex set, but grow with every error: there the
    search along the ray alone is exact. Raises InfeasibleError if the lower bounds already exceed a limit.
    """

    def __init__(
        self, constraints: Sequence[Constraint], errors: Sequence[str], lower: Array, upper: Array
    ) -> None:
        self.lower, self.upper = np.asarray(lower, dtype=float), np.asarray(upper, dtype=float)
        self._surface = LimitSurface(constraints, errors)
        if self._surface.load(self.lower) > 1.0:
            raise InfeasibleError("the smallest possible errors already exceed the limit")
        convex = all(constraint.rule != "percentile" for constraint in constraints)
        self._program = _CornerProgram(constraints, errors, self.lower, self.upper) if convex else None

    def error(self, index: int) -> Array:
        """(E,) the corner in which error `index` is largest."""
        return self._along(np.eye(len(self.lower))[index], index)

    def even(self) -> Array:
        """(E,) the point in which all errors are relaxed by the same share of their range."""
        return self._along(np.ones(len(self.lower)), None)

    def _along(self, pattern: Array, index: int | None) -> Array:
        direction = pattern * (self.upper - self.lower)
        share = float(self._surface.reach(self.lower, direction, np.ones(())))
        if self._program is not None:
            certified = self._program.solve(index)
            if abs(certified - share) > _AGREEMENT:
                raise ArithmeticError(f"convex optimum {certified} and search {share} disagree")
        return np.asarray(self.lower + share * direction)


class _CornerProgram:
    """The convex program of all corners; variables are shares x of the range, 0 <= x <= 1, and λ <= x."""

    def __init__(
        self, constraints: Sequence[Constraint], errors: Sequence[str], lower: Array, upper: Array
    ) -> None:
        cp = _cvxpy()
        self._share, self._least = cp.Variable(len(errors)), cp.Variable()
        self._objective = cp.Parameter(len(errors) + 1, nonneg=True)
        sizes = lower + cp.multiply(upper - lower, self._share)
        held = [self._share >= 0, self._share <= 1, self._least >= 0, self._share >= self._least]
        goal = cp.Maximize(self._objective @ cp.hstack([self._share, self._least]))
        self._problem = cp.Problem(goal, held + _limits(constraints, errors, sizes))

    def solve(self, index: int | None) -> float:
        """The largest share of its range that error `index` (None: all at once) can have."""
        self._objective.value = np.eye(self._objective.size)[-1 if index is None else index]
        _solved(self._problem)
        return float(self._problem.value)


def _limits(constraints: Sequence[Constraint], errors: Sequence[str], sizes: Any) -> list[Any]:
    """value / limit <= 1 for every constraint of the two convex rules."""
    cp = _cvxpy()
    rows = {
        rule: np.array([weights(c, errors) / c.limit for c in constraints if c.rule == rule])
        for rule in ("worst_case", "rss")
    }
    held = []
    if len(rows["worst_case"]):
        held.append(rows["worst_case"] @ sizes <= 1)
    if len(rows["rss"]):
        squares = cp.multiply(rows["rss"], cp.reshape(sizes, (1, len(errors)), order="C"))
        held.append(cp.norm(squares, 2, axis=1) <= 1)
    return held


@dataclass(frozen=True)
class RelaxedTime:
    """value: least Σ cost·n; half_widths, repeats: (E,); dual: (R,) cost saved per unit of more slack."""

    value: float
    half_widths: Array
    repeats: Array
    dual: Array


def relaxed_time(
    cost: Array, spread: Array, weights: Array, slack: Array, rule: Rule, lower_repeats: Array
) -> RelaxedTime:
    """The campaign's cost if repeats need not be whole: a lower bound, and what more slack is worth.

        minimise Σ_j c_j n_j,   n_j = (q_j / d_j)² >= lower_repeats_j            (K eq 27)
        subject to  Σ_j w_rj d_j <= R_r  (worst_case)   or   Σ_j w_rj² d_j² <= R_r²  (rss), every r

    cost: (E,) per repeat, > 0; spread: (E,) q = quantile × standard deviation, SI, > 0; lower_repeats: (E,)
    or a number, > 0; weights: (R, E) per SI unit of half-width; slack: (R,) what the requirements leave for
    the estimates (rss: root of squares). The dual is −d value / d slack, so cost per unit of the limit.
    Raises InfeasibleError if a requirement leaves nothing, ValueError for rule percentile and bad sizes.
    """
    if rule == "percentile":
        raise ValueError("a percentile is not convex in the half-widths; use rss as its bound")
    cost, spread, least = (
        np.asarray(a, dtype=float) for a in np.broadcast_arrays(cost, spread, lower_repeats)
    )
    weights, slack = (
        np.atleast_2d(np.asarray(weights, dtype=float)),
        np.atleast_1d(np.asarray(slack, dtype=float)),
    )
    if not ((cost > 0).all() and (spread > 0).all() and (least > 0).all() and (weights >= 0).all()):
        raise ValueError("cost, spread and lower_repeats must be positive, weights not negative")
    if ((slack <= 0) & (weights > 0).any(axis=1)).any():
        raise InfeasibleError("a requirement leaves nothing for the estimates")
    widest = spread / np.sqrt(least)
    loads = weights * widest / np.where(slack > 0, slack, 1.0)[:, None]
    share, dual = _relaxation(cost * least, loads, 1 if rule == "worst_case" else 2)
    repeats = least / share**2
    return RelaxedTime(float(cost @ repeats), widest * share, repeats, dual / slack)


def _relaxation(cost: Array, loads: Array, power: int) -> tuple[Array, Array]:
    """Shares x <= 1 that minimise Σ c x⁻² with Σ (l x)^power <= 1, and the duals per relative slack.

    In y = (x / x₀)^power it is Σ c x₀⁻² y^(−2/power) with linear constraints, convex for both rules. x₀ is
    the answer if the tightest requirement stood alone, so the solver sees figures near one.
    """
    cp = _cvxpy()
    start = _alone(cost, loads, power)
    y = cp.Variable(len(cost), pos=True)
    terms = cost / start**2
    limits = ((loads * start) ** power) @ y <= 1
    objective = cp.Minimize(terms / terms.sum() @ cp.power(y, -2 // power))
    _solved(cp.Problem(objective, [limits, y <= start**-power]))
    share = np.minimum(start * y.value ** (1 / power), 1.0)
    return share, np.atleast_1d(limits.dual_value) * terms.sum() * power


def _alone(cost: Array, loads: Array, power: int) -> Array:
    """Lagrange's x of each constraint alone, ∝ (c / l^power)^(1/(2 + power)); the least of them, <= 1."""
    with np.errstate(divide="ignore"):
        pattern = (cost / loads**power) ** (1 / (2 + power))
    used = np.where(loads > 0, loads * np.where(loads > 0, pattern, 0.0), 0.0)
    length = (used**power).sum(axis=1, keepdims=True) ** (1 / power)
    with np.errstate(invalid="ignore"):
        alone = np.where(loads > 0, pattern / length, np.inf)
    return np.asarray(np.minimum(alone.min(axis=0), 1.0))


def _cvxpy() -> Any:
    """The package, imported late (it costs a second) and untyped (its stubs miss most atoms)."""
    return import_module("cvxpy")


def _solved(problem: Any) -> None:
    """Solve with the interior-point method of cvxpy; raise ArithmeticError unless it proved the optimum."""
    problem.solve(solver="CLARABEL")
    if problem.status != "optimal":
        raise ArithmeticError(f"the convex program ended {problem.status}")
