"""Rules for the unit: every budget has the unit of its error, sizes that can be, tables that agree."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import pairwise
from typing import Any

from planner import catalog
from planner.effects._scatter_over_input import INPUT_UNIT
from planner.nouns.sensor import ErrorName
from planner.protocols import Sensor
from planner.spec.budget import ErrorBudget, InRun, OverInput, RunToRun
from planner.spec.places import did_you_mean
from planner.spec.review import Review
from planner.spec.rules_requirement import wrong_unit
from planner.spec.scatter import SPREADS
from planner.spec.temperature_residual import MeasuredCurve, MeasuredCurves, ResidualTable
from planner.spec.yaml12 import Path
from planner.units import Quantity, UnitError, to_degc


def budgets(sheet: Review) -> None:
    """All rules for all budgets."""
    if sheet.whole("unit") and not any(True for _ in sheet.budgets()):
        sheet.fault(
            "P301",
            ("unit",),
            "no sensor error has a budget; add e.g. 'gyro: {bias: {run_to_run: 0.002 deg/s}}'",
        )
    for sensor, effect, path, budget in sheet.budgets():
        if not _known(sheet, sensor, effect, path):
            continue
        if sheet.written(path) == {}:
            sheet.fault(
                "P302", path, "is an empty budget; give at least 'run_to_run', or remove it", key=True
            )
        unit = catalog.effects()[effect].units[sensor]
        for where, quantity, signed in _quantities(sheet, path, budget):
            _check(sheet, where, quantity, unit, signed=signed)
        _of_the_bench(sheet, effect, path)
        _carried(sheet, sensor, effect, path)
        _tables(sheet, path, budget)
        _over_input(sheet, sensor, effect, path, budget)
        _uses(sheet, f"{sensor}.{effect}", path, budget)


def _known(sheet: Review, sensor: str, effect: str, path: Path) -> bool:
    known = catalog.effects()
    if effect not in known:
        here = [name for name, one in known.items() if sensor in one.sensors]
        sheet.fault("P303", path, f"unknown effect '{effect[:40]}'{did_you_mean(effect, here)}", key=True)
        return False
    if sensor not in known[effect].sensors:
        other = ", ".join(known[effect].sensors)
        sheet.fault("P304", path, f"'{effect}' does not exist on {sensor}s, only on: {other}", key=True)
        return False
    return True


def _quantities(sheet: Review, path: Path, budget: ErrorBudget) -> Iterator[tuple[Path, Quantity, bool]]:
    """(path, value, whether it may be negative) of every number of a budget, table entries included."""
    for name in ("systematic", "run_to_run", "in_run", "storage", "temperature_residual"):
        for where, value in _plain(path, name, budget):
            if isinstance(value, Quantity):
                yield where, value, False
            elif isinstance(value, OverInput):
                yield from (((*where, q.text), sigma, False) for q, sigma in value.table.items())
            elif isinstance(value, Mapping):
                yield from _entries(sheet, where, value, "curve" in where)


def _plain(
    path: Path, name: str, budget: ErrorBudget
) -> list[tuple[Path, Quantity | Mapping[Any, Quantity] | OverInput | None]]:
    """Where the number or the tables of one part of a budget stand, and what they are, in whatever form."""
    value = getattr(budget, name)
    if isinstance(value, InRun | RunToRun):
        return [((*path, name, "value"), value.value)]
    if isinstance(value, MeasuredCurve):
        return [((*path, name, "curve"), value.curve)]
    if isinstance(value, MeasuredCurves):
        return [((*path, name, "curve", unit), curve) for unit, curve in enumerate(value.curve)]
    return [((*path, name), value.table if isinstance(value, ResidualTable) else value)]


def _entries(
    sheet: Review, path: Path, table: Mapping[float, Quantity], signed: bool
) -> Iterator[tuple[Path, Quantity, bool]]:
    for key, where in _written_keys(sheet, path):
        if key in table:
            yield where, table[key], signed


def _written_keys(sheet: Review, path: Path) -> Iterator[tuple[float, Path]]:
    """(number of points or temperature, path) of a table's entries, as they stand in the file."""
    written = sheet.written(path)
    for key in written if isinstance(written, dict) else ():
        try:
            yield (key if isinstance(key, int) else to_degc(key)), (*path, key)
        except UnitError:  # the field itself has said so
            continue


def _check(sheet: Review, path: Path, quantity: Quantity, unit: str, *, signed: bool) -> None:
    wrong = wrong_unit(quantity, unit)
    if wrong:
        sheet.fault("P305", path, wrong)
    elif not signed and quantity.si < 0:
        sheet.fault("P306", path, f"{quantity.text!r} is negative; this size is zero or more")


def _tables(sheet: Review, path: Path, budget: ErrorBudget) -> None:
    for name in ("run_to_run", "temperature_residual"):
        for where, _ in _plain(path, name, budget):
            once(sheet, where)
    residual = budget.temperature_residual
    if isinstance(residual, ResidualTable):
        _falls(sheet, (*path, "temperature_residual"), residual.table)
    elif isinstance(residual, MeasuredCurve):
        _covers(sheet, (*path, "temperature_residual", "curve"), residual)
    elif isinstance(residual, MeasuredCurves):
        for number, unit in enumerate(residual.units):
            _covers(sheet, (*path, "temperature_residual", "curve", number), unit)


def _over_input(sheet: Review, sensor: Sensor, effect: str, path: Path, budget: ErrorBudget) -> None:
    """A spread over the input is the scale factor's, its inputs are what the sensor senses, each once."""
    for where, table in _plain(path, "run_to_run", budget):
        if not isinstance(table, OverInput):
            continue
        if effect != SPREADS:
            message = f"only the spread of {SPREADS} may depend on the input; give one number"
            sheet.fault("P324", where, message, key=True)
            continue
        seen: set[float] = set()
        for at in table.table:
            wrong = wrong_unit(at, INPUT_UNIT[sensor])
            if wrong or at.si <= 0.0 or at.si in seen:
                reason = wrong or ("stands here twice" if at.si in seen else "is not above zero")
                sheet.fault(
                    "P325", (*where, at.text), f"{at.text!r} is no input of its own here: {reason}", key=True
                )
            seen.add(at.si)


def once(sheet: Review, path: Path) -> None:
    """Every temperature of a table stands there once, in whatever words."""
    seen: set[float] = set()
    for key, entry in _written_keys(sheet, path):
        if key in seen:
            sheet.fault(
                "P307", entry, "this temperature stands here twice in different words; keep one", key=True
            )
        seen.add(key)


def _falls(sheet: Review, path: Path, table: Mapping[int, Quantity]) -> None:
    """More temperature points never leave a larger residual (plateaus are real: K table 2.10)."""
    numbers = sorted(table)
    for fewer, more in pairwise(numbers):
        if table[more].si > table[fewer].si:
            sheet.fault(
                "P308",
                (*path, more),
                f"{more} points leave {table[more].text}, more than the {table[fewer].text} of {fewer}; "
                "a residual cannot grow with the number of points",
            )


def _covers(sheet: Review, path: Path, measured: MeasuredCurve) -> None:
    if not sheet.whole("plan", "temperatures", "range") or not sheet.whole(*path):
        return
    low, high = sheet.spec.plan.temperatures.range
    if len(measured.curve) >= 2 and sum(low <= t <= high for t in measured.curve) < 2:
        sheet.fault(
            "P309",
            path,
            f"fewer than two temperatures lie in plan.temperatures.range, {low:g} to {high:g} degC",
            key=True,
        )


def _uncalibrated(sheet: Review) -> str:
    """What becomes of a declared error that no test names: the two methods differ."""
    if sheet.by_information:
        return "it is fitted all the same, from what the records of all tests tell of it"
    return "the error stays whole in the budget"


def _of_the_bench(sheet: Review, effect: str, path: Path) -> None:
    """An error of the bench does not fly: as one of the unit it would."""
    if catalog.effects()[effect].bench_only:
        sheet.fault(
            "P315",
            path,
            f"{effect} is of the bench and does not fly, so the unit has no budget of it; to have it fitted "
            f"declare it in effects: [{effect}, …], and what references are known to is benches.….accuracy",
            key=True,
        )


def _carried(sheet: Review, sensor: str, effect: str, path: Path) -> None:
    """What another error's table carries has no budget of its own.

    Tables over the whole range, as the published method places them, take a slope out whole; those of a plan
    by information may have one node, and its curves are the residuals of the table alone.
    """
    known = catalog.effects()[effect]
    plain = known.temperature_of
    if not (sheet.by_information and known.tabled and plain is not None):
        return
    whose = f"unit.{sensor}.{plain}"
    if plain in getattr(sheet.spec.unit, sensor):
        why = f"{whose} has it already"
    elif plain in sheet.spec.effects:
        why = f"{plain} is fitted, and has it"
    else:
        return
    sheet.fault(
        "P314",
        path,
        f"{why}: what changes over temperature is that budget's temperature_residual, "
        f"e.g. {whose}.temperature_residual: {{1: …, 3: …}}",
        key=True,
    )


def _uses(sheet: Review, error: str, path: Path, budget: ErrorBudget) -> None:
    """What a budget says must be of use to the plan: is the error calibrated, and over temperature?"""
    effect = ErrorName(error).effect
    if not (sheet.whole("effects") and sheet.whole("tests")):
        return
    declared = set(sheet.spec.effects)
    if effect not in declared:
        sheet.warn(
            "P311",
            path,
            f"'effects' does not declare {effect}: the error stays whole in the budget",
            key=True,
        )
        return
    if error not in sheet.calibrated():
        unused = [n for n, test in sheet.spec.tests.items() if error in test.calibrates]
        but = f" (0 repeats of {', '.join(unused)})" if unused else ""
        sheet.warn("P312", path, f"no test calibrates it{but}: {_uncalibrated(sheet)}", key=True)
        return
    if budget.temperature_residual is not None and not catalog.varies_as_declared(effect, declared):
        needed = " or ".join(catalog.temperature_effects(effect))
        sheet.warn(
            "P313",
            (*path, "temperature_residual"),
            f"'effects' does not declare {needed}: temperature points take nothing out",
            key=True,
        )
