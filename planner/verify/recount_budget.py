"""The allowances counted again: every part from the spec's budgets and the plan's temperatures and repeats.

estimate = q(n) s / √n,   q the two-sided normal or Student's quantile, s of one repeat (recount_spread)

(K 2.5.2, eq. 27; K prints 2.96 for 99 %, the value is 2.576.)
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from planner import catalog
from planner.nouns.array import Array
from planner.nouns.sensor import ErrorName
from planner.protocols import SENSORS
from planner.spec.budget import ErrorBudget
from planner.spec.model import PercentileRule, Spec
from planner.spec.temperature_residual import MeasuredCurve
from planner.units import UnitError, dimension_of, unit_factor
from planner.verify.asked_steps import in_room
from planner.verify.findings import Document, Findings
from planner.verify.recount_spread import spreads_of_records
from planner.verify.recount_together import SAME, added_together

PART_NAMES = ("run_to_run", "in_run", "storage", "temperature", "estimate")


def check_budget(document: Document, spec: Spec, by_information: bool = False) -> list[Findings]:
    """Tests, repeats and why, allowances and their parts.

    A plan by information may leave a test out, has K's half-widths beside it only, and allowances of another
    kind.
    """
    tests = Findings("tests", "tests, temperatures and repeats are those that the spec allows")
    repeats = Findings("repeats", "half-widths are q(n) s / √n, and the repeats reach what is needed")
    parts = Findings("allowances", "parts are those of the budgets, and add up to what is allowed")
    _check_tests(tests, document, spec)
    if by_information:
        _check_beside(repeats, document, spec)
        return [tests, repeats]
    _check_all_are_made(tests, document, spec)
    reasons = _check_reasons(repeats, document, spec)
    _check_allowances(parts, document, spec, reasons)
    return [tests, repeats, parts]


# ---------------------------------------------------------------- tests


def _check_tests(found: Findings, document: Document, spec: Spec) -> None:
    names = [t["test"] for t in document["tests"]]
    found.same("tests", sorted(names), sorted({*names} & set(spec.tests)))
    for t in document["tests"]:
        if t["test"] not in spec.tests:
            continue
        where, test = f"tests, {t['test']}", spec.tests[t["test"]]
        found.same(f"{where}, bench", t["bench"], test.bench)
        found.same(f"{where}, calibrates", t["calibrates"], list(test.calibrates))
        found.same(f"{where}, motions", t["motions"], test.motion_count)
        found.same(f"{where}, attended", t["attended"], _is_attended(document, t["test"]))
        found.same(f"{where}, temperatures", t["temperatures_degc"], sorted(set(t["temperatures_degc"])))
        found.same(f"{where}, repeats", len(t["repeats"]), len(t["temperatures_degc"]))
        _check_fixed(found, where, t, spec)


def _check_all_are_made(found: Findings, document: Document, spec: Spec) -> None:
    names = [t["test"] for t in document["tests"]]
    wanted = {
        name for name, test in spec.tests.items() if test.calibrates or _fixed(spec, name)[1] is not None
    }
    served = {e for t in document["tests"] for e in t["calibrates"]}
    for name in sorted(wanted - set(names)):
        if not set(spec.tests[name].calibrates) <= served or not spec.tests[name].calibrates:
            found.fault("tests", f"{name} is missing")


def _is_attended(document: Document, name: str) -> bool:
    return any(s["attended"] for s in document["steps"] if s["test"] == name)


def _fixed(spec: Spec, name: str) -> tuple[Any, Any]:
    """(temperatures, repeats) that the spec fixes, None where the planner chooses."""
    by_hand, test = spec.plan.fixed.get(name), spec.tests[name]
    t = (
        by_hand.temperatures
        if by_hand is not None and by_hand.temperatures is not None
        else test.temperatures
    )
    n = by_hand.repeats if by_hand is not None and by_hand.repeats is not None else test.repeats
    return t, n


def made_by_hand(spec: Spec) -> bool:
    """Whether the spec fixes temperatures and repeats of every test."""
    return all(
        _fixed(spec, name)[1] is not None
        and (_fixed(spec, name)[0] is not None or spec.benches[test.bench].chamber is None)
        for name, test in spec.tests.items()
    )


def _check_fixed(found: Findings, where: str, t: Document, spec: Spec) -> None:
    temperatures, repeats = _fixed(spec, t["test"])
    low, high = spec.plan.temperatures.range
    if in_room(spec, t["test"]):
        found.same(f"{where}, temperatures", t["temperatures_degc"], [spec.plan.temperatures.room])
    elif isinstance(temperatures, int):
        even = np.linspace(low, high, temperatures) if temperatures > 1 else np.array([(low + high) / 2])
        found.same(f"{where}, temperatures", t["temperatures_degc"], even.tolist(), 1e-6)
    elif isinstance(temperatures, tuple):
        found.same(f"{where}, temperatures", t["temperatures_degc"], sorted(temperatures))
    if repeats is not None:
        wanted = list(repeats) if isinstance(repeats, tuple) else [repeats] * len(t["temperatures_degc"])
        found.same(f"{where}, repeats", t["repeats"], wanted)
        return
    for n in t["repeats"]:
        found.at_most(f"{where}, repeats", spec.plan.repeats.least, n)
        found.at_most(f"{where}, repeats", n, spec.plan.repeats.most)


# ---------------------------------------------------------------- repeats


def _check_reasons(
    found: Findings, document: Document, spec: Spec
) -> dict[str, tuple[str, list[float], float]]:
    """Error -> its test, its temperatures, and the half-width that its repeats reach, SI."""
    reached: dict[str, tuple[str, list[float], float]] = {}
    added = _added(found, document, spec)
    for where, r, n in _reasons(document):
        if n is None or r["error"] not in budgets_of(spec) or r["test"] not in spec.tests:
            found.fault(where, f"no such error is measured there by test {r['test']}")
            continue
        if n < 1:  # no mean, so no half-width: √0 would be divided by
            found.fault(where, f"test {r['test']} is made {n} times there")
            continue
        unit = unit_said(document, r["error"])
        width = _check_reason(found, where, r, n, spec, added.get((r["error"], r["test"]), 0.0), unit)
        test, points, widest = reached.get(r["error"], (r["test"], [], 0.0))
        found.same(f"{where}, test", r["test"], test)
        reached[r["error"]] = (test, [*points, float(r["temperature_degc"])], max(widest, width))
    for name in calibrated_errors(spec):
        if name not in reached:
            found.fault("reasons", f"{name} is calibrated, but no repeats are given for it")
    for i, r in enumerate(document["reasons"]):
        within = added.get((r["error"], r["test"]), 0.0)
        unit = unit_said(document, r["error"])
        _check_needed(found, f"reasons {i}, {r['error']}", r, reached, spec, within, unit)
    return reached


def _check_beside(found: Findings, document: Document, spec: Spec) -> None:
    """K's half-widths of the same records, beside a plan that does not rest on them."""
    added = _added(found, document, spec)
    for where, r, n in _reasons(document):
        if n is None or n < 1 or r["error"] not in budgets_of(spec):
            found.fault(where, f"no such error is measured there by test {r['test']}")
            continue
        unit = unit_said(document, r["error"])
        _check_reason(found, where, r, n, spec, added.get((r["error"], r["test"]), 0.0), unit)
        found.same(f"{where}, needed_half_width", r["needed_half_width"], r["half_width"], 1e-8)
        wanted = "promise" if _fixed(spec, r["test"])[1] is None else "fixed"
        found.same(f"{where}, bound_by", r["bound_by"], wanted)


def _reasons(document: Document) -> Iterator[tuple[str, Document, int | None]]:
    """Where every reason stands, itself, and how often its test is made there (None: not said)."""
    made = {
        (t["test"], float(x)): n
        for t in document["tests"]
        for x, n in zip(t["temperatures_degc"], t["repeats"], strict=False)
    }
    for i, r in enumerate(document["reasons"]):
        where = f"reasons {i}, {r['error']} at {r['temperature_degc']:g} degC"
        yield where, r, made.get((r["test"], float(r["temperature_degc"])))


def _added(found: Findings, document: Document, spec: Spec) -> dict[tuple[str, str], float]:
    """(error, test) -> what the records add to the spread of a repeat, SI.

    Where no test alone tells an error, all of them together do: the plan's own figure is held to verify's,
    and what follows from it to the plan's.
    """
    added = spreads_of_records(spec)
    tests: dict[str, list[str]] = {}
    for error, test in added:
        tests.setdefault(error, []).append(test)
    alone = [e for e, names in tests.items() if all(np.isinf(added[e, t]) for t in names)]
    for error, own in added_together(document, spec, alone, made_by_hand(spec)).items():
        rows = [(i, r) for i, r in enumerate(document["reasons"]) if r["error"] == error]
        for i, r in rows[:1]:
            factor = unit_factor(unit_said(document, error))[0]
            run = _spread(budgets_of(spec)[error], float(r["temperature_degc"]), 0.0)
            where = f"reasons {i}, {error}, spread of all tests together"
            found.same(where, r["spread"], math.hypot(run, own) / factor, SAME)
            own = math.sqrt(max((r["spread"] * factor) ** 2 - run**2, 0.0))
        added |= dict.fromkeys(((error, test) for test in tests[error]), own)
    return added


def _check_reason(
    found: Findings, where: str, r: Document, n: int, spec: Spec, added: float, unit: str
) -> float:
    budget = budgets_of(spec)[r["error"]]
    factor = unit_factor(unit)[0]
    spread = _spread(budget, float(r["temperature_degc"]), added)
    q = quantile(spec.plan.confidence, spec.plan.quantile, n)
    width = float(_widths(spread, np.array(q / np.sqrt(n))))
    for key, wanted in (
        ("unit", unit),
        ("repeats", n),
        ("confidence", spec.plan.confidence),
        ("quantile", spec.plan.quantile),
        ("quantile_value", q),
        ("spread", spread / factor),
        ("half_width", width / factor),
    ):
        found.same(f"{where}, {key}", r[key], wanted, 1e-8)
    if r["error"] not in spec.tests[r["test"]].calibrates:
        found.fault(where, f"{r['test']} does not calibrate it")
    return width


def _check_needed(
    found: Findings,
    where: str,
    r: Document,
    reached: Mapping[str, tuple[str, list[float], float]],
    spec: Spec,
    added: float,
    unit: str,
) -> None:
    """What is needed is reached, is the half-width of a whole number of repeats, and says what binds."""
    if r["error"] not in reached:
        return
    found.at_most(f"{where}, half_width", r["half_width"], r["needed_half_width"], 1e-8 * r["half_width"])
    _, fixed = _fixed(spec, r["test"])
    budget, factor = budgets_of(spec)[r["error"]], unit_factor(unit)[0]
    needed = r["needed_half_width"] * factor
    least = spec.plan.repeats.least
    kind, confidence = spec.plan.quantile, spec.plan.confidence
    numbers = np.arange(1, max(spec.plan.repeats.most, r["repeats"]) + 1)
    widths = np.array([quantile(confidence, kind, int(n)) for n in numbers]) / np.sqrt(numbers)
    points = reached[r["error"]][1]
    levels = np.array([_widths(_spread(budget, t, added), widths) for t in points])
    figures = levels[np.isfinite(levels)]
    if not np.any(np.abs(figures - needed) <= 1e-8 * max(needed, 1e-300) + 1e-300):
        found.fault(f"{where}, needed_half_width", "is not the half-width of any whole number of repeats")
    own = _widths(_spread(budget, float(r["temperature_degc"]), added), widths)
    enough = [int(n) for n, w in zip(numbers, own, strict=True) if n >= least and w <= needed * (1 + 1e-9)]
    wanted = "fixed"
    if fixed is None:
        wanted = "shared" if enough and r["repeats"] > enough[0] else "accuracy"
        if wanted == "accuracy" and r["repeats"] == least:
            wanted = "least"
    found.same(f"{where}, bound_by", r["bound_by"], wanted)


def _widths(spread: float, widths: Array) -> Array:
    """Half-widths of a spread from those of a unit spread; one repeat tells what does not scatter."""
    return spread * widths if spread > 0 else np.zeros_like(widths)


def quantile(confidence: float, kind: str, n: int) -> float:
    """Two-sided; Student's with n − 1 degrees of freedom is infinite for a single repeat."""
    from scipy.special import ndtri, stdtrit

    upper = 0.5 + confidence / 2
    if kind == "normal":
        return float(ndtri(upper))
    return float(stdtrit(n - 1, upper)) if n > 1 else float("inf")


def _spread(budget: ErrorBudget, t: float, added: float) -> float:
    """Of one repeat, SI: run-to-run at a temperature, and in squares what its records add."""
    return math.hypot(float(budget.run_to_run_sigma(np.array(t))), added)


def budgets_of(spec: Spec) -> dict[str, ErrorBudget]:
    """Error -> its budget, of both sensors."""
    return {
        f"{sensor}.{effect}": budget
        for sensor in SENSORS
        for effect, budget in getattr(spec.unit, sensor).items()
    }


def unit_said(document: Document, error: str) -> str:
    """The unit in which the plan gives the figures of an error."""
    return str(document["allowances"][error]["unit"])


def check_unit_said(found: Findings, where: str, unit: object, error: str) -> None:
    """It may be any unit of the error's dimension: figures are read by it, and held to the spec's in SI."""
    sensor, effect = ErrorName(error).parts
    try:
        right = dimension_of(str(unit)) == dimension_of(catalog.effects()[effect].units[sensor])
    except UnitError:
        right = False
    found.figures += 1
    if not right:
        found.fault(where, f"{unit!r} is no unit of {error}")


def calibrated_errors(spec: Spec) -> list[str]:
    """Declared errors with a budget that some test calibrates."""
    served = {e for t in spec.tests.values() for e in t.calibrates}
    return [name for name in budgets_of(spec) if ErrorName(name).effect in spec.effects and name in served]


# ---------------------------------------------------------------- allowances


def sums(spec: Spec) -> bool:
    """Whether `allowed` is the sum of the parts: if any requirement is a worst case; else squares add."""
    return any(not isinstance(r.rule, PercentileRule) and r.rule == "worst_case" for r in spec.requirement)


def _check_allowances(
    found: Findings, document: Document, spec: Spec, reached: Mapping[str, tuple[str, list[float], float]]
) -> None:
    budgets = budgets_of(spec)
    found.same("allowances", sorted(document["allowances"]), sorted(budgets))
    calibrated = calibrated_errors(spec)
    for name, a in document["allowances"].items():
        if name not in budgets:
            continue
        where, unit = f"allowances, {name}", unit_said(document, name)
        found.same(f"{where}, calibrated", a["calibrated"], name in calibrated)
        wanted = _parts(spec, name, budgets[name], reached.get(name) if name in calibrated else None)
        factor = unit_factor(unit)[0]
        for part, value in zip(PART_NAMES, wanted, strict=True):
            found.same(f"{where}, {part}", a["parts"][part], value / factor, 1e-8)
        values = np.array(list(a["parts"].values()))
        size = values.sum() if sums(spec) else np.sqrt((values**2).sum())
        found.same(f"{where}, allowed", a["allowed"], float(size), 1e-8)


def _parts(
    spec: Spec, name: str, budget: ErrorBudget, reached: tuple[str, list[float], float] | None
) -> tuple[float, ...]:
    """The five parts, SI; of an error that nobody calibrates the whole size is the estimate's."""
    constant = (budget.run_to_run_largest, budget.in_run_sigma, budget.storage_sigma)
    if reached is None:
        return (*constant, 0.0, _whole(budget))
    _, points, width = reached
    return (*constant, _residual(spec, name, budget, sorted(points)), width)


def _whole(budget: ErrorBudget) -> float:
    curve, table = budget.measured_curve, budget.residual_table or {}
    values = [*table.values()] if curve is None else np.abs(curve.values).tolist()
    return float(max([budget.systematic_size, *values]))


def _residual(spec: Spec, name: str, budget: ErrorBudget, points: Sequence[float]) -> float:
    """What a table at these temperatures leaves, by the spec's table or on its measured curve."""
    if budget.temperature_residual is None:
        return 0.0
    tables = set(catalog.temperature_effects(ErrorName(name).effect))
    if tables and not tables & set(spec.effects):  # with nothing declared that follows it, all of it stays
        return _whole(budget)
    if budget.measured_curve is not None:
        return _on_curve(spec, name, budget.measured_curve, points)
    residual = budget.residual_table or {}
    usable = [n for n in residual if n <= len(points)]
    if not usable:
        return _whole(budget)
    if spec.plan.temperatures.interpolate:
        numbers = sorted(residual)
        return float(np.interp(len(points), numbers, [residual[n] for n in numbers]))
    return residual[max(usable)]


def _on_curve(spec: Spec, name: str, measured: MeasuredCurve, points: Sequence[float]) -> float:
    """Largest distance of the table from the curve's points."""
    x, y = measured.temperatures_degc, measured.values
    low, high = spec.plan.temperatures.range
    test = next((t for t in spec.tests.values() if name in t.calibrates), None)
    by_hand = test is not None and any(
        _fixed(spec, n)[0] is not None for n, t in spec.tests.items() if name in t.calibrates
    )
    inside = np.ones(len(x), bool) if by_hand else (x >= low) & (x <= high)
    table = np.interp(x, points, np.interp(points, x[inside], y[inside]))
    return float(np.abs(y - table)[inside].max())
