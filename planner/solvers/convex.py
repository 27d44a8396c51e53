"""Exact optima by convex programming: corners of the allowed region, the campaign without whole numbers."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Any

import numpy as np

from planner.errors import InfeasibleError
from planner.nouns.array import Array, Rule
from planner.nouns.sensitivities import Constraint
from planner.solvers.limit_surface import ROUNDING, LimitSurface
from planner.solvers.linear_combination import weights

EVEN = "even"
# share of the limit; interior points stop at 1e-8, and a wrong model would be off by much more than this
_AGREEMENT = 1e-5


class Corners:
    """Corners of the region {lower <= ε <= upper, every constraint met} of E errors.

        maximise ε_j               with every other error at its lower bound        `error(j)`
        maximise λ                 with ε = lower + λ (upper − lower), λ <= 1       `even()`

    worst_case is linear and rss a second-order cone; cvxpy solves them, parametrised by the objective so
    that the second corner takes milliseconds. Since all rules grow with every error, the same corners lie on
    known rays; the search along the ray gives the last digits, and is all there is for percentiles, whose
    region need not be convex. Raises InfeasibleError if the lower bounds already exceed a limit, and
    ArithmeticError should program and search ever disagree.
    """

    def __init__(
        self, constraints: Sequence[Constraint], errors: Sequence[str], lower: Array, upper: Array
    ) -> None:
        self.lower, self.upper = np.asarray(lower, dtype=float), np.asarray(upper, dtype=float)
        self._surface = LimitSurface(constraints, errors)
        if self._surface.load(self.lower) > 1.0 + ROUNDING:
            raise InfeasibleError("the smallest possible errors already exceed the limit")
        convex = all(constraint.rule != "percentile" for constraint in constraints)
        axes = np.diag(self.upper - self.lower)
        scale = self._surface.reach(self.lower, axes, np.ones(len(axes)))
        scaled = (constraints, errors, self.lower, self.upper, np.where(scale > 0, scale, 1.0))
        self._program = _CornerProgram(*scaled) if convex else None

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
            self._check(self._program.solve(index), share, direction)
        return np.asarray(self.lower + share * direction)

    def _check(self, certified: float | None, share: float, direction: Array) -> None:
        """The program's optimum must be the search's, or use the limit as fully; None: it did not finish."""
        if certified is None or abs(certified - share) <= _AGREEMENT * share:
            return
        used = float(self._surface.load(self.lower + max(certified, 0.0) * direction))
        if abs(used - 1.0) > _AGREEMENT:
            raise ArithmeticError(f"convex optimum {certified} and search {share} disagree")


class _CornerProgram:
    """The convex program of all corners; variables are shares x of the range, 0 <= x <= 1, and λ <= x.

    scale: (E,) how far each x can go alone; the solver sees x / scale, which is near one at every corner.
    """

    def __init__(
        self,
        constraints: Sequence[Constraint],
        errors: Sequence[str],
        lower: Array,
        upper: Array,
        scale: Array,
    ) -> None:
        cp = _cvxpy()
        self._scale = np.append(scale, scale.min())
        self._objective = cp.Parameter(len(errors) + 1, nonneg=True)
        x = cp.Variable(len(errors) + 1)  # the last one is λ
        shares = cp.multiply(self._scale, x)
        sizes = lower + cp.multiply(upper - lower, shares[:-1])
        held = [x >= 0, shares <= 1, shares[:-1] / self._scale[-1] >= x[-1]]
        goal = cp.Maximize(self._objective @ x)
        self._problem = cp.Problem(goal, held + _limits(constraints, errors, sizes))

    def solve(self, index: int | None) -> float | None:
        """The largest share of its range that error `index` (None: all at once) can have; None if unknown."""
        which = -1 if index is None else index
        self._objective.value = np.eye(len(self._scale))[which]
        return float(self._problem.value * self._scale[which]) if _solved(self._problem) else None


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
    y, inverse = cp.Variable(len(cost)), cp.Variable(len(cost))
    terms = cost / start**2
    price = inverse if power == 2 else cp.square(inverse)
    # y·inverse >= 1 as a quadratic cone: the power cones behind y^(−2) stall on some problems
    inverted = cp.SOC(y + inverse, cp.vstack([y - inverse, np.full(len(cost), 2.0)]), axis=0)
    limits = ((loads * start) ** power) @ y <= 1
    objective = cp.Minimize(terms / terms.sum() @ price)
    if not _solved(cp.Problem(objective, [limits, inverted, cp.multiply(start**power, y) <= 1])):
        raise ArithmeticError("the relaxed campaign could not be solved")
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


def _solved(problem: Any) -> bool:
    """Whether the interior-point method proved the optimum, to 1e-10 of the objective."""
    error: Any = import_module("cvxpy.error").SolverError
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # an inaccurate end is told by the status
            problem.solve(solver="CLARABEL", tol_gap_abs=1e-10, tol_gap_rel=1e-10)
    except error:
        return False
    return bool(problem.status == "optimal")
