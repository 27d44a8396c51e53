"""The tables of a plan: records in, cells of text out."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from planner.nouns.allowances import AllowedErrors
from planner.nouns.choices import RepeatReason
from planner.nouns.plan import GeneticPlan, Plan
from planner.nouns.sensitivities import Sensitivities
from planner.report.blocks import Bar, Cell, Table, table
from planner.report.contributions import PART_NAMES, PARTS, Contribution
from planner.report.numbers import (
    SPACE,
    degrees,
    degrees_celsius,
    digits,
    display_unit,
    hours,
    in_unit,
    level,
    percent,
    runs,
)
from planner.report.time_spent import HEADINGS, Spent, by_action, by_bench, by_temperature, by_test
from planner.units import from_si, unit_factor

if TYPE_CHECKING:
    from planner.plan.spec_to_sensitivity import SensitivityRow

_FEW = 5  # columns of numbers that fit beside two of names
_BARE = re.compile(r"/\(([^/()]+)\)")  # `m/(g)` reads better as `m/g`
_VECTOR = "error | axis | per | north, m | east, m | up, m | length, m"


def budget_tables(plan: Plan, budgets: Sequence[Sequence[Contribution]]) -> tuple[Table, ...]:
    """Every error: its allowance and parts in its own unit, and what it adds to every requirement.

    One table for one requirement; with several, the contributions stand in a table of their own.
    """
    order = [c.error for c in budgets[0]] if budgets else [a.error for a in plan.allowances]
    parts, added = _parts_table(plan, order), _contributions_table(plan, order, budgets)
    if len(budgets) > 1:
        return parts, added
    rows = tuple(a + b[1:] for a, b in zip(parts.rows, added.rows, strict=True))
    wide = parts.wide + added.columns[1:2]
    return (Table(parts.caption, parts.columns + added.columns[1:], rows, wide=wide),)


def _parts_table(plan: Plan, order: Sequence[str]) -> Table:
    labels = tuple(PART_NAMES[part] for part in PARTS)
    by_name = {a.error: a for a in plan.allowances}
    rows: list[tuple[Cell, ...]] = []
    for a in (by_name[error] for error in order):
        values = [a.allowed, *(a.parts[part] for part in PARTS)]
        cells = (digits(in_unit(v, a.unit)) for v in values)
        rows.append((_breakable(a.error), display_unit(a.unit), *cells))
    columns = ("error", "unit", "allowed", *labels)
    return Table("Allowed sensor errors and their parts", columns, tuple(rows), wide=labels)


def _contributions_table(
    plan: Plan, order: Sequence[str], budgets: Sequence[Sequence[Contribution]]
) -> Table:
    columns = ["error"]
    for i, achieved in enumerate(plan.requirements):
        title = "" if len(plan.requirements) == 1 else f" of {i + 1}: {achieved.error.replace('_', ' ')}"
        columns += [f"{achieved.unit} per unit", f"share{title}"]
    units = {a.error: unit_factor(display_unit(a.unit))[0] for a in plan.allowances}
    rows: list[tuple[Cell, ...]] = []
    for error in order:
        cells: list[Cell] = [_breakable(error)]
        for achieved, budget in zip(plan.requirements, budgets, strict=True):
            own = next(c for c in budget if c.error == error)
            cells += [digits(own.per_unit * units[error] / unit_factor(achieved.unit)[0]), percent(own.share)]
        rows.append(tuple(cells))
    return Table("What every error adds to the requirements", tuple(columns), tuple(rows))


def sensitivity_table(plan: Plan, sensitivities: Sensitivities | None) -> Table | None:
    """Position error at the end of the flight per unit of every column, or the plan's own list without it."""
    given = is_given(plan, sensitivities)
    if sensitivities is not None and not given:
        return columns_table(sensitivities)
    if not plan.sensitivities:
        return None
    rows = tuple(
        (f.error, _axis(f.axis), digits(f.value), _BARE.sub(r"/\1", f.unit))
        if "(" in f.unit
        else (f.error, _axis(f.axis), digits(f.value / 100), f"{f.unit}/%")  # a ratio: per cent reads better
        for f in plan.sensitivities
    )
    caption = "Coefficients as the spec gives them" if given else "Sensitivities"
    return table(caption, "error | axis | value | unit", rows)


def is_given(plan: Plan, sensitivities: Sensitivities | None) -> bool:
    """Whether the coefficients were published ones, for all axes together, instead of simulated."""
    listed = [f.axis for f in plan.sensitivities]
    return "all" in ([c.axis for c in sensitivities.columns] if sensitivities else listed)


def columns_table(sensitivities: Sensitivities) -> Table | None:
    """Every column of the linear combination: position error at the end of the flight per display unit."""
    rows = []
    for i, column in enumerate(sensitivities.columns):
        unit = display_unit(column.unit)
        vector = sensitivities.position[-1, :, i] * unit_factor(unit)[0]
        values = [*vector, float(np.linalg.norm(vector))]
        rows.append((column.error, _axis(column.axis), unit, *(digits(v) for v in values)))
    return table(f"Position error after {sensitivities.time_s[-1]:g} s of flight", _VECTOR, rows)


def rows_table(rows: Sequence[SensitivityRow], units: Mapping[str, str]) -> Table | None:
    """The same from rows that carry their unit: each per the error's unit in `units`, else its own."""
    cells = []
    for r in rows:
        unit = display_unit(units.get(r.error, r.per))
        scale = unit_factor(unit)[0] / unit_factor(r.per)[0]
        vector = [scale * x for x in (r.north_m, r.east_m, r.up_m)]
        numbers = (digits(x) for x in (*vector, math.hypot(*vector)))
        cells.append((r.error, r.axis, unit, *numbers))
    times = {r.time_s for r in rows}
    when = f"at {digits(times.pop())} s" if len(times) == 1 else "each column at its worst moment"
    return table(f"Position error {when}", _VECTOR, cells)


def bounds_table(allowed: AllowedErrors) -> Table | None:
    """Between what every error may lie: the best that the bench can reach, and uncalibrated."""
    return table(
        "Bounds of the sensor errors",
        "error | smallest | largest | unit",
        (
            (
                e,
                *(digits(in_unit(x[e], allowed.units[e])) for x in (allowed.smallest, allowed.largest)),
                _unit_of(allowed, e),
            )
            for e in allowed.errors
        ),
    )


def _unit_of(allowed: AllowedErrors, error: str) -> str:
    return display_unit(allowed.units[error])


def _axis(axis: str) -> str:
    return "all together" if axis == "all" else axis


def tests_table(plan: Plan) -> Table | None:
    """What every test does."""
    return table(
        "What every test does",
        "test | temperatures, °C | repeats at each | h | bench | motions | records | powered, h | calibrates",
        (
            (
                _breakable(test.test),
                degrees(test.temperatures_degc),
                runs([str(n) for n in test.repeats]),
                hours(test.time_s),
                _breakable(test.bench),
                str(test.motions),
                str(sum(test.repeats) * test.motions),
                hours(test.power_on_s),
                _breakable(", ".join(test.calibrates)) or "nothing: timed only",
            )
            for test in plan.tests
        ),
        wide=("calibrates", "motions", "records", "powered, h"),
    )


def hours_tables(plan: Plan) -> tuple[Table, ...]:
    """The campaign's hours split four ways; every table sums to the whole."""
    steps, time_s = plan.steps, plan.time_s
    return (
        _hours_table("By action", by_action(steps, time_s), time_s),
        _hours_table("By test", by_test(steps, time_s), time_s),
        _hours_table("By chamber temperature, °C", by_temperature(steps, time_s), time_s),
        _hours_table("By bench", by_bench(steps, time_s), time_s),
    )


def reasons_table(plan: Plan) -> Table | None:
    """Why this number: one row for every different computation, its temperatures together."""
    if not plan.reasons:
        return None
    units = {a.error: a.unit for a in plan.allowances}
    groups: dict[tuple[object, ...], list[RepeatReason]] = {}
    for reason in plan.reasons:
        groups.setdefault(_reason_key(reason), []).append(reason)
    rows = [_reason_row(g[0], [r.temperature_degc for r in g], units) for g in groups.values()]
    return table(
        f"Repeats: n ≥ (t·s/d)², {_quantiles(plan.reasons)}",
        "error | test | at, °C | unit | (t·s/d)² | n | half-width reached | set by",
        rows,
    )


def corners_table(allowed: AllowedErrors | None, *, compact: bool = False) -> Table | None:
    """The corners of the Pareto set: what the genetic algorithm found beside the exact optimum.

    With few errors every corner shows all of them, else (or if `compact`) only its own error.
    """
    if allowed is None:
        return None
    return _own_corners(allowed) if compact or len(allowed.errors) > _FEW else _whole_corners(allowed)


def _whole_corners(allowed: AllowedErrors) -> Table | None:
    rows: list[tuple[Cell, ...]] = []
    for corner in allowed.corners:
        for name, by, values in ((corner.name, "genetic", corner.genetic), ("", "exact", corner.exact)):
            cells = [digits(in_unit(values.get(e, math.nan), allowed.units[e])) for e in allowed.errors]
            rows.append((_corner(name), by, *cells, percent(corner.gap, 2) if by == "genetic" else ""))
    errors = " | ".join(f"{_breakable(e)}, {_unit_of(allowed, e)}" for e in allowed.errors)
    return table("Corners of the allowed errors", f"largest | by | {errors} | below exact", rows)


def _corner(name: str) -> str:
    return "all evenly" if name == "even" else _breakable(name)


def _own_corners(allowed: AllowedErrors) -> Table | None:
    rows = []
    for corner in allowed.corners:
        own = corner.name in allowed.units
        unit = allowed.units[corner.name] if own else "1"
        found = [
            digits(in_unit(x[corner.name], unit)) if own else "–" for x in (corner.genetic, corner.exact)
        ]
        rows.append((_corner(corner.name), *found, display_unit(unit) if own else "", percent(corner.gap, 2)))
    return table("Corners of the allowed errors", "largest | genetic | exact | unit | below exact", rows)


def genetic_table(plan: Plan) -> Table | None:
    """The campaign that the genetic algorithm finds beside the plan; by information: of one batch's work."""
    if plan.genetic is None:
        return None
    informed = plan.method == "information"
    own = plan.objective_value if informed else plan.time_s
    rows = (("this plan", hours(own), "0", "–", "–"), _genetic_row(plan.genetic))
    return table(
        f"The genetic algorithm's campaign beside the {'plan' if informed else 'exact one'}",
        "found by | h | longer by | generations | evaluations",
        rows,
    )


# ---------------------------------------------------------------- rows


def _breakable(name: str) -> str:
    """With zero-width spaces where a narrow cell may break."""
    return name.replace(".", ".\u200b").replace("_", "_\u200b")


def _hours_table(caption: str, rows: Sequence[Spent], time_s: float) -> Table:
    largest = max((row.share for row in rows), default=1.0) or 1.0
    cells: list[tuple[Cell, ...]] = [
        (_heading(row.name), hours(row.seconds), percent(row.share), str(row.count), Bar(row.share / largest))
        for row in rows
    ]
    count = sum(row.count for row in rows)
    cells.append(("all", hours(time_s), percent(1.0), str(count), Bar(0.0)))
    return Table(caption, ("", "h", "share", "steps", ""), tuple(cells), total=True)


def _heading(name: str) -> str:
    """Actions are words, temperatures numbers; benches and tests keep the names that the spec gives them."""
    if name in HEADINGS:
        return name.replace("_", " ")
    try:
        return degrees_celsius(float(name))
    except ValueError:
        return name


def _reason_key(r: RepeatReason) -> tuple[object, ...]:
    numbers = (r.spread, r.confidence, r.quantile, r.half_width, r.needed_half_width)
    return (r.test, r.error, r.repeats, r.quantile_name, r.bound_by, *(f"{x:.6g}" for x in numbers))


def _reason_row(r: RepeatReason, temperatures: Sequence[float], units: Mapping[str, str]) -> tuple[Cell, ...]:
    unit = display_unit(units[r.error])
    spread, needed, reached = (from_si(x, unit) for x in (r.spread, r.needed_half_width, r.half_width))
    if math.isfinite(needed) and needed > 0:
        n = digits((r.quantile * spread / needed) ** 2)
        formula = f"({digits(r.quantile)} · {digits(spread)} / {digits(needed)})² = {n}".replace(" ", SPACE)
    else:
        formula = "no half-width is asked for" if needed else "–"
    where = degrees(sorted(temperatures))
    return (
        _breakable(r.error),
        _breakable(r.test),
        where,
        unit,
        formula,
        str(r.repeats),
        digits(reached),
        r.bound_by,
    )


def _quantiles(reasons: Sequence[RepeatReason]) -> str:
    kinds = dict.fromkeys((r.quantile_name, r.confidence) for r in reasons)
    return "; ".join(f"{name} quantile t at {level(confidence)} confidence" for name, confidence in kinds)


def _genetic_row(genetic: GeneticPlan) -> tuple[Cell, ...]:
    history = genetic.history
    facts = (str(history.generations), str(history.evaluations))
    return ("genetic algorithm", hours(genetic.time_s), percent(genetic.gap, 2), *facts)
