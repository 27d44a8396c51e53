"""Sensor errors → temperature points: how many, which ones, and the residual that each choice leaves.

Evenly spread points with the residual of the spec's table (K table 2.10); where a curve over temperature was
measured, also the points that minimise its worst piecewise-linear residual (dynamic programming).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from planner import catalog
from planner.errors import InputError
from planner.nouns.choices import PointMenu, TemperaturePoints
from planner.nouns.sensor import ErrorName
from planner.plan.by_hand import chosen_by_hand, temperatures_of
from planner.solvers.breakpoints import optimal_breakpoints, table_residual
from planner.spec.budget import ErrorBudget
from planner.spec.even_points import even_points
from planner.spec.model import Spec
from planner.spec.temperature_residual import MeasuredCurve


def point_menus(spec: Spec) -> tuple[PointMenu, ...]:
    """What every calibrated error may choose in every test that serves it.

    An error without a temperature residual needs one point only, or rides along with another error's points.
    Raises InputError when no candidate number of points has a residual.
    """
    pairs = [
        (error, test)
        for test in spec.tests
        for error in spec.tests[test].calibrates
        if ErrorName(error).effect in spec.effects
    ]
    own = {pair: _points(spec, *pair) for pair in pairs}
    return tuple(
        PointMenu(error, test, own[error, test] or _joining(spec, error, test, own)) for error, test in pairs
    )


def _points(spec: Spec, error: str, test: str) -> tuple[TemperaturePoints, ...]:
    """Placements from the spec alone; empty for an error that may join any temperature."""
    budget = _budget(spec, error)
    by_hand = chosen_by_hand(spec, test)
    if by_hand is not None:
        temperatures, placement = temperatures_of(spec, by_hand)
        return (TemperaturePoints(temperatures, residual_at(spec, error, temperatures), placement),)
    if budget.temperature_residual is None or not _removable(spec, error):
        return ()
    choice = spec.plan.temperatures
    if budget.measured_curve is not None:
        return _points_on_curve(budget.measured_curve, choice.candidates, *choice.range)
    return _points_of_table(spec, error, budget.residual_table or {})


def _joining(
    spec: Spec, error: str, test: str, own: Mapping[tuple[str, str], tuple[TemperaturePoints, ...]]
) -> tuple[TemperaturePoints, ...]:
    """What an error that does not vary with temperature may choose: it can ride along with any other.

    Every set of points that another error on the same bench may choose, and one point in the middle of the
    range or at either end (the ends are in every even spread of two or more).
    """
    bench, (low, high) = spec.tests[test].bench, spec.plan.temperatures.range
    middle = even_points(low, high, 1)
    sets = {
        p.temperatures_degc
        for (_, other), points in own.items()
        if spec.tests[other].bench == bench
        for p in points
        if p.placement != "room"
    }
    residual = residual_at(spec, error, middle)
    joined = sorted({middle, (low,), (high,), *sets} if sets else {middle}, key=lambda t: (len(t), t))
    return tuple(TemperaturePoints(t, residual, "joining") for t in joined)


def residual_at(spec: Spec, error: str, temperatures: tuple[float, ...]) -> float:
    """The residual that a given list of temperatures leaves: never more optimistic than the spec's table."""
    budget = _budget(spec, error)
    if budget.temperature_residual is None:
        return 0.0
    if not _removable(spec, error):
        return budget.whole_variation
    if budget.measured_curve is not None:
        x, y = budget.measured_curve.temperatures_degc, budget.measured_curve.values
        nodes = np.sort(np.array(temperatures))
        return table_residual(x, y, nodes, np.interp(nodes, x, y))
    residual = budget.residual_table or {}
    usable = [n for n in residual if n <= len(temperatures)]
    if spec.plan.temperatures.interpolate and usable:
        return _interpolated(residual, (len(temperatures),))[len(temperatures)]
    return residual[max(usable)] if usable else budget.whole_variation


def _budget(spec: Spec, error: str) -> ErrorBudget:
    sensor, effect = ErrorName(error).parts
    found: ErrorBudget = getattr(spec.unit, sensor)[effect]
    return found


def _removable(spec: Spec, error: str) -> bool:
    """Whether the declared model has the temperature table that takes the variation of this error out."""
    return catalog.varies_as_declared(ErrorName(error).effect, spec.effects)


def _points_of_table(spec: Spec, error: str, table: Mapping[int, float]) -> tuple[TemperaturePoints, ...]:
    choice = spec.plan.temperatures
    usable = _interpolated(table, choice.candidates) if choice.interpolate else table
    found = tuple(
        TemperaturePoints(even_points(*choice.range, n), usable[n], "even")
        for n in sorted(set(choice.candidates))
        if n in usable and n <= max(table)  # beyond the table more soaks would buy nothing
    )
    if not found:
        raise InputError(
            f"{error}: none of plan.temperatures.candidates {list(choice.candidates)} stands in its "
            f"temperature_residual table ({sorted(table)}); "
            "add one, or set plan.temperatures.interpolate: true"
        )
    return found


def _interpolated(table: Mapping[int, float], candidates: tuple[int, ...]) -> dict[int, float]:
    """Residuals between the tabulated numbers of points, linear in the number; the last one beyond it."""
    numbers = sorted(table)
    values = [table[n] for n in numbers]
    return {n: float(np.interp(n, numbers, values)) for n in candidates if n >= numbers[0]}


def _points_on_curve(
    measured: MeasuredCurve, candidates: tuple[int, ...], low: float, high: float
) -> tuple[TemperaturePoints, ...]:
    """For every candidate number the optimal placement on the measured curve, and the even one beside it."""
    x, y = measured.temperatures_degc, measured.values
    inside = (x >= low) & (x <= high)
    x, y = x[inside], y[inside]
    if len(x) < 2:
        raise InputError(
            "a measured temperature_residual curve needs two points inside plan.temperatures.range"
        )
    best = optimal_breakpoints(x, y, min(max(candidates), len(x)))
    found = []
    for n in sorted(set(candidates)):
        even = even_points(low, high, n)
        nodes = np.array(even)
        found.append(TemperaturePoints(even, table_residual(x, y, nodes, np.interp(nodes, x, y)), "even"))
        if n <= len(best):
            placed = tuple(float(x[i]) for i in best[n - 1].indices)
            found.append(TemperaturePoints(placed, best[n - 1].residual, "optimal"))
    return tuple(found)
