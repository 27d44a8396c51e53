"""The flows in store: spec and plan → region of errors; histories → dates; spec → recalibrations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import date, timedelta
from typing import Any

from planner.dwells.dwell_files import read_dwells
from planner.errors import InputError
from planner.fleet.allowed_region import allowed_region
from planner.fleet.basis import Basis, Recalibrated
from planner.fleet.dates import FleetForecast, unit_dates
from planner.fleet.drift import AUTO, Correction, forecast_channels
from planner.fleet.growth import Growth, growth_of
from planner.fleet.history import History, ordered
from planner.fleet.history_sources import (
    SourceFiles,
    check_days,
    correction_of,
    gathered_history,
    horizon,
    source_files,
    today_of,
)
from planner.fleet.plan_allowances import by_probability, in_sigmas, plan_allowances
from planner.fleet.sessions import Session, WorkingDays, on_one_calendar
from planner.fleet.shocks import without_shocks
from planner.fleet.store import StoreBench
from planner.fleet.suspects import without_suspects
from planner.fleet.validation import left_out
from planner.fleet.visit_plans import ShortestVisit, StorePlan
from planner.fleet.visits import StorePlanner, grid, renewable
from planner.nouns.progress import Progress
from planner.pipelines.navigation import navigate, task_of
from planner.pipelines.planning import informed
from planner.plan.budget import common_rule
from planner.plan.repeats_to_schedule import campaign
from planner.plan.task import allowances as allowances_of
from planner.quantities import DAY_S
from planner.solvers.one_thread import one_thread
from planner.spec.attendance import windows_of
from planner.spec.days_off import days_off_between
from planner.spec.load import LoadedSpec
from planner.spec.recalibration import Recalibration


@dataclass(frozen=True)
class Forecasted:
    """A fleet's forecast with what it was held against."""

    basis: Basis
    fleet: FleetForecast


def basis_of(loaded: LoadedSpec, plan: Mapping[str, Any] | None, progress: Progress) -> Basis:
    """Spec, and a plan's tree if there is one → the region of its errors; without a plan it is chosen now."""
    navigation = navigate(loaded, progress)
    notes: list[str] = []
    spec = loaded.spec
    if plan is not None:
        allowances = plan_allowances(plan)
        if by_probability(plan):
            allowances = in_sigmas(allowances, spec)
        if plan["spec"].get("sha256") not in (None, "", loaded.sha256):
            notes.append("the plan was made from another state of the spec; its allowances were taken")
    elif spec.planned_by == "information":
        progress("planning the campaign, as there is no plan")
        made = informed(loaded, navigation, progress, beside=False).plan
        allowances = in_sigmas(made.allowances, spec)
    else:
        progress("choosing temperatures and repeats, as there is no plan")
        task = task_of(loaded.spec, navigation)
        allowances = allowances_of(task, campaign(task), common_rule(navigation.constraints))
    region = allowed_region(navigation.constraints, allowances)
    if not region.terms:
        raise InputError(f"no requirement of {loaded.path} feels any error that its plan allows for")
    if region.split:
        notes.append("published coefficients hold for all axes together: each axis got its equal share")
    return Basis(loaded, region, navigation.models, navigation.constraints, tuple(notes))


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


def history_of(read: SourceFiles, basis: Basis, options: ForecastOptions, progress: Progress) -> History:
    """Histories, calibrations and dwell tables → one history, cleaned."""
    progress("cleaning the history")
    raw = gathered_history(read, basis.models, basis.region, options.start)
    check_days(raw, options.today)
    own = {m.name: m.unit for m in basis.models}
    raw = replace(raw, series=tuple(replace(s, display=own.get(s.error, s.display)) for s in raw.series))
    storage = {m.name: m.storage for m in basis.models}
    return without_shocks(without_suspects(ordered(raw), storage), storage, progress)


@one_thread()
def forecast(
    inputs: Sequence[str],
    loaded: LoadedSpec,
    plan: Mapping[str, Any] | None,
    options: ForecastOptions,
    progress: Progress,
) -> Forecasted:
    """A history → forecasts with intervals, and the date until which each unit keeps its requirements."""
    read = _sources(inputs, progress)
    basis = basis_of(loaded, plan, progress)
    return Forecasted(basis, forecast_on(read, basis, options, progress))


def _sources(inputs: Sequence[str], progress: Progress) -> SourceFiles:
    """The files of a history, read before the minutes that a plan takes."""
    progress("reading the history")
    return source_files(inputs, read_dwells)


def forecast_on(
    read: SourceFiles,
    basis: Basis,
    options: ForecastOptions,
    progress: Progress,
    *,
    validated: bool = True,
) -> FleetForecast:
    """A history against a region; validated: with rolling origins of every method."""
    found = drifts_on(read, basis, options, progress, validated=validated)
    units = unit_dates(found.channels, basis.region, found.until, found.today, options.confidence, progress)
    return replace(found, units=units)


def drifts_on(
    read: SourceFiles,
    basis: Basis,
    options: ForecastOptions,
    progress: Progress,
    *,
    validated: bool = True,
) -> FleetForecast:
    """A history's channels forecast, without the units' dates; validated: as `forecast_on`."""
    history = history_of(read, basis, options, progress)
    today = today_of(history, options.today)
    until = horizon(history, options.until, today)
    correction: Correction = correction_of(options.correction, history)
    models = {m.name: m for m in basis.models}
    channels, scored, used = forecast_channels(
        history, models, until, options.confidence, options.method, correction, progress, validated=validated
    )
    lacking = left_out() if validated and options.method == AUTO else ()
    notes = tuple(dict.fromkeys((*history.suspects, *basis.notes, *history.notes, *lacking)))
    return FleetForecast(
        history, channels, (), scored, used, options.confidence, until, correction, notes, today
    )


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


@one_thread()
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
    read = _sources(inputs, progress) if inputs else None
    basis = basis_of(loaded, plan, progress)
    bench = StoreBench(asked, basis.models, basis.region)
    growths, start, notes = _growths(read, basis, bench, asked.period / DAY_S, options, progress)
    planners = [StorePlanner(u, basis.region, g, bench, options.confidence) for u, g in growths.items()]
    plans: list[StorePlan] = []
    shortest: list[ShortestVisit] = []
    for planner in planners:
        progress(f"{planner.unit}: the schedule that costs least hours")
        plans.append(planner.schedule())
        shortest += planner.ladder()
    sessions: tuple[Session, ...] = ()
    made = tuple(plans)
    if inputs:
        progress("one calendar for all units")
        made, sessions = on_one_calendar(planners, plans, asked, _working_days(loaded, asked, start))
    growth = planners[0].growth
    can = renewable(basis.region, bench, growth, options.confidence)
    today = float(growth.days[0])
    return Recalibrated(basis, bench, growth, made, tuple(shortest), can, start, notes, today, sessions)


def _working_days(loaded: LoadedSpec, asked: Recalibration, start: date | None) -> WorkingDays:
    """Days of the spec's shifts, all days without shifts; never more hours than a shift has."""
    shifts = loaded.spec.plan.shifts
    if not shifts:
        return WorkingDays(start, frozenset(range(7)), asked.working_day)
    windows = [window for shift in shifts for window in windows_of(shift)]
    days = frozenset(int(opens // DAY_S) % 7 for opens, _ in windows)
    last = None if start is None else start + timedelta(days=asked.period / DAY_S + 2 * 366)
    off = () if start is None or last is None else days_off_between(loaded.spec, start, last)
    return WorkingDays(start, days, min(asked.working_day, max(b - a for a, b in windows)), frozenset(off))


def _growths(
    read: SourceFiles | None,
    basis: Basis,
    bench: StoreBench,
    period: float,
    options: ForecastOptions,
    progress: Progress,
) -> tuple[Mapping[str, Growth], date | None, tuple[str, ...]]:
    """How every unit grows from today on (`spec` when there is no history), the date of day 0, notes."""
    confidence = options.confidence
    if read is None:
        days = grid(_period(options.until, period))
        growths = {"spec": growth_of(basis.region, basis.models, days, confidence)}
        return growths, options.start or options.today, basis.notes
    asked = replace(options, until=options.until or f"{period:g}")
    found = drifts_on(read, basis, asked, progress, validated=False)
    days = grid(found.until - found.today, found.today)
    adds = any(c.rule == "worst_case" for c in basis.region.constraints)
    once = bench.left(1, 1)
    growths = {
        unit: growth_of(
            basis.region, basis.models, days, confidence,
            [c for c in found.channels if c.series.unit == unit], once, adds,
        )
        for unit in found.history.units
    }  # fmt: skip
    return growths, found.history.start, found.notes


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
