"""The flows after a campaign: checks → accepted units; histories → dates; spec → recalibrations in store."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import date
from pathlib import Path
from typing import Any

from planner.dwells.dwell_files import read_dwells
from planner.errors import InputError
from planner.fleet.acceptance import UnitAcceptance, accepted
from planner.fleet.allowed_region import allowed_region
from planner.fleet.basis import Basis, Recalibrated
from planner.fleet.calibration_documents import (
    CalibratedUnit,
    calibration_residuals,
    is_calibration,
    read_calibration,
)
from planner.fleet.check_groups import by_temperature
from planner.fleet.check_residual import MeasuredResidual, check_residuals
from planner.fleet.drift import Correction, FleetForecast, forecast_channels, unit_dates
from planner.fleet.history import History, cleaned
from planner.fleet.history_sources import check_days, correction_of, gathered_history, horizon
from planner.fleet.judge import ErrorRates
from planner.fleet.plan_allowances import plan_allowances
from planner.fleet.store import StoreBench
from planner.fleet.visits import (
    Growth,
    ShortestVisit,
    StorePlan,
    StorePlanner,
    grid,
    growth_of,
    renewable,
)
from planner.pipelines import planning
from planner.plan.budget import common_rule
from planner.plan.repeats_to_schedule import campaign
from planner.plan.task import allowances as allowances_of
from planner.quantities import DAY_S
from planner.spec.load import LoadedSpec
from planner.spec.recalibration import Recalibration

Progress = Callable[[str], None]


@dataclass(frozen=True)
class Accepted:
    """The units of a batch."""

    basis: Basis
    units: tuple[UnitAcceptance, ...]
    rates: ErrorRates
    sources: tuple[str, ...]
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Forecasted:
    """A fleet's forecast with what it was held against."""

    basis: Basis
    fleet: FleetForecast


def basis_of(loaded: LoadedSpec, plan: Mapping[str, Any] | None, progress: Progress) -> Basis:
    """Spec, and a plan's tree if there is one → the region of its errors; without a plan it is chosen now."""
    navigation = planning.navigate(loaded, progress)
    notes: list[str] = []
    if plan is not None:
        allowances = plan_allowances(plan)
        if plan["spec"].get("sha256") not in (None, "", loaded.sha256):
            notes.append("the plan was made from another state of the spec; its allowances were taken")
    else:
        progress("choosing temperatures and repeats, as there is no plan")
        task = planning.task_of(loaded.spec, navigation)
        allowances = allowances_of(task, campaign(task), common_rule(navigation.constraints))
    region = allowed_region(navigation.constraints, allowances)
    if not region.terms:
        raise InputError(f"no requirement of {loaded.path} feels any error that its plan allows for")
    if region.split:
        notes.append("published coefficients hold for all axes together: each axis got its equal share")
    return Basis(loaded, region, navigation.models, navigation.constraints, tuple(notes))


# ---------------------------------------------------------------- accept


def accept(
    inputs: Sequence[Path],
    loaded: LoadedSpec,
    plan: Mapping[str, Any] | None,
    rates: ErrorRates,
    progress: Progress,
    *,
    as_residual: bool = False,
) -> Accepted:
    """Dwell tables of checks, and calibrations → every unit accepted, rejected or undecided."""
    basis = basis_of(loaded, plan, progress)
    found, notes = _residuals(inputs, basis, progress, as_residual)
    progress("judging")
    units = accepted(found, basis.region, loaded.spec.plan.temperatures.range, rates)
    return Accepted(basis, units, rates, tuple(map(str, inputs)), (*basis.notes, *notes))


def _residuals(
    inputs: Sequence[Path], basis: Basis, progress: Progress, as_residual: bool
) -> tuple[list[MeasuredResidual], list[str]]:
    found: list[MeasuredResidual] = []
    calibrations: dict[str, list[CalibratedUnit]] = {}
    notes: list[str] = []
    seen: set[str] = set()
    for path in inputs:
        progress(f"reading {path}")
        if is_calibration(path):
            one = read_calibration(path)
            calibrations.setdefault(one.unit, []).append(one)
            continue
        table = read_dwells(path)
        measured = check_residuals(table, by_temperature(table), basis.models, basis.region)
        again = seen & {m.unit for m in measured}
        if again:
            notes.append(f"{', '.join(sorted(again))} stands in several files: taken as one unit")
        seen |= {m.unit for m in measured}
        notes += table.notes
        found += measured
    for unit, units in calibrations.items():
        if unit in seen:
            notes.append(f"{unit}: its check was judged, not its calibration")
            continue
        found += calibration_residuals(units, basis.region, as_residual=as_residual)
    if calibrations and not as_residual:
        notes.append(_how_calibrations(calibrations))
    return found, notes


def _how_calibrations(calibrations: Mapping[str, Sequence[CalibratedUnit]]) -> str:
    if any(len(c) > 1 for c in calibrations.values()):
        return "several calibrations of a unit: the first corrects, the last minus the first is the residual"
    return "a calibration alone: its coefficients are corrected, what their intervals leave was judged"


# ---------------------------------------------------------------- forecast


@dataclass(frozen=True)
class ForecastOptions:
    """How to forecast. until: days after the last value, or a date; today: for dates in the future."""

    until: str | None = None
    method: str = "auto"
    confidence: float = 0.95
    correction: str = "auto"
    today: date | None = None
    start: date | None = None


def history_of(inputs: Sequence[str], basis: Basis, options: ForecastOptions, progress: Progress) -> History:
    """Histories, calibrations and dwell tables → one history, cleaned."""
    progress("reading the history")
    raw = gathered_history(inputs, basis.models, basis.region, options.start, read_dwells)
    check_days(raw, options.today)
    return cleaned(raw)


def forecast(
    inputs: Sequence[str],
    loaded: LoadedSpec,
    plan: Mapping[str, Any] | None,
    options: ForecastOptions,
    progress: Progress,
) -> Forecasted:
    """A history → forecasts with intervals, and the date until which each unit keeps its requirements."""
    basis = basis_of(loaded, plan, progress)
    return Forecasted(basis, _forecast_on(inputs, basis, options, progress))


def _forecast_on(
    inputs: Sequence[str], basis: Basis, options: ForecastOptions, progress: Progress
) -> FleetForecast:
    history = history_of(inputs, basis, options, progress)
    until = horizon(history, options.until)
    correction: Correction = correction_of(options.correction, history)
    models = {m.name: m for m in basis.models}
    channels, scored, used = forecast_channels(
        history, models, until, options.confidence, options.method, correction, progress
    )
    units = unit_dates(channels, basis.region, until, history.last_day, options.confidence, progress)
    notes = tuple(dict.fromkeys((*basis.notes, *history.notes)))
    return FleetForecast(history, channels, units, scored, used, options.confidence, until, correction, notes)


def options_of(
    until: str | None,
    method: str,
    confidence: float,
    corrected_by: str,
    today: str | None,
    start: str | None,
) -> ForecastOptions:
    """Options from words. Raises InputError for a confidence or a date that is none."""
    if not 50.0 <= confidence < 100.0:
        raise InputError(f"--confidence must lie between 50 and 100 %, not {confidence:g}")
    return ForecastOptions(
        until, method, confidence / 100, corrected_by, _date("--today", today), _date("--start", start)
    )


def _date(option: str, text: str | None) -> date | None:
    try:
        return None if text is None else date.fromisoformat(text)
    except ValueError:
        raise InputError(f"{option} {text!r} is no date; write it like 2026-03-01") from None


# ---------------------------------------------------------------- recalibrate


def recalibrate(
    loaded: LoadedSpec,
    plan: Mapping[str, Any] | None,
    inputs: Sequence[str],
    options: ForecastOptions,
    progress: Progress,
) -> Recalibrated:
    """Spec, and histories if there are any → the schedule of visits that costs least hours.

    Raises InputError for a spec that says nothing of recalibration.
    """
    asked = loaded.spec.recalibration
    if asked is None:
        raise InputError(
            f"{loaded.path} says nothing of recalibration; add e.g. `recalibration: "
            f"{{rest: 5 min}}`: what may "
            "be done in store"
        )
    basis = basis_of(loaded, plan, progress)
    bench = StoreBench(asked, basis.models, basis.region)
    over = _growths(inputs, basis, asked, options, progress)
    plans: list[StorePlan] = []
    shortest: list[ShortestVisit] = []
    for unit, growth in over.growths.items():
        progress(f"{unit}: the schedule that costs least hours")
        planner = StorePlanner(unit, basis.region, growth, bench, options.confidence)
        plans.append(planner.schedule())
        shortest += planner.ladder()
    growth = next(iter(over.growths.values()))
    can = renewable(basis.region, bench, growth, options.confidence)
    return Recalibrated(basis, bench, growth, tuple(plans), tuple(shortest), can, over.start, over.notes)


@dataclass(frozen=True)
class _OverTime:
    """How the errors of every unit grow in store. start: of day 0, if it is known."""

    growths: Mapping[str, Growth]
    start: date | None
    notes: tuple[str, ...]


def _growths(
    inputs: Sequence[str], basis: Basis, asked: Recalibration, options: ForecastOptions, progress: Progress
) -> _OverTime:
    """Of every unit with a history; without histories as the spec says."""
    period, confidence = asked.period / DAY_S, options.confidence
    if not inputs:
        days = grid(_period(options.until, period))
        alone = {"spec": growth_of(basis.region, basis.models, days, confidence)}
        return _OverTime(alone, options.start, basis.notes)
    found = _forecast_on(inputs, basis, replace(options, until=options.until or f"{period:g}"), progress)
    days = grid(found.until - found.history.last_day, found.history.last_day)
    growths = {
        unit: growth_of(
            basis.region, basis.models, days, confidence, [c for c in found.channels if c.series.unit == unit]
        )
        for unit in found.history.units
    }
    return _OverTime(growths, found.history.start, found.notes)


def _period(until: str | None, usual: float) -> float:
    """--until without a history: days."""
    if until is None:
        return usual
    try:
        days = float(until.split()[0])
    except (ValueError, IndexError):
        raise InputError(f"--until {until!r}: without a history write days, such as 180") from None
    if not 1.0 <= days <= 3650.0:
        raise InputError(f"--until {until}: must lie between 1 and 3650 days")
    return days
