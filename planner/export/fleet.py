"""accept.json and forecast.json: units and channels in display units, numbers that do not exist as null."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from planner import __version__
from planner.export.json_figures import figure, shown
from planner.fleet.acceptance import ChannelAcceptance, UnitAcceptance, counts
from planner.fleet.allowed_region import AllowedRegion
from planner.fleet.check_plan import Check
from planner.fleet.dates import FleetForecast, UnitDate
from planner.fleet.drift import ChannelForecast
from planner.fleet.judge import ErrorRates
from planner.fleet.validation import MethodScore

if TYPE_CHECKING:
    from planner.nouns.array import Array


def accept_document(
    units: Sequence[UnitAcceptance],
    region: AllowedRegion,
    rates: ErrorRates,
    spec: Mapping[str, str],
    notes: Sequence[str],
) -> dict[str, Any]:
    """The tree of accept.json."""
    return {
        "planner": __version__,
        "spec": dict(spec),
        "rates": {"good_rejected": rates.good_rejected, "bad_accepted": rates.bad_accepted},
        "counts": dict(counts(units)),
        "units": [_unit(u, region) for u in units],
        "notes": list(notes),
    }


def _unit(u: UnitAcceptance, region: AllowedRegion) -> dict[str, Any]:
    c = region.constraints[u.constraint]
    return {
        "unit": u.unit,
        "verdict": u.verdict,
        "binds": {
            "requirement": c.requirement,
            "error": c.error,
            "rule": c.rule,
            "at_s": figure(c.time_s),
            "value": shown(u.value, c.unit),
            "limit": shown(u.limit, c.unit),
            "unit": c.unit,
        },
        "load": figure(u.load),
        "load_interval": [figure(u.low), figure(u.high)],
        "temperatures_degc": [figure(t) for t in u.temperatures_degc],
        "power_ons": u.power_ons,
        "records": u.records,
        "further_power_ons": None if u.further is None else figure(u.further),
        "further_records": None if u.further_records is None else figure(u.further_records),
        "decidable": u.further is None or math.isfinite(u.further),
        "channels": [_channel(ch) for ch in u.channels],
        "notes": list(u.notes),
    }


def _channel(ch: ChannelAcceptance) -> dict[str, Any]:
    return {
        "channel": ch.channel,
        "term": ch.term,
        "place": ch.place,
        "residual": shown(ch.residual, ch.unit),
        "ci95_half": shown(ch.uncertainty, ch.unit),
        "planned": shown(ch.planned, ch.unit),
        "room": shown(ch.room, ch.unit),
        "unit": ch.unit,
        "share_of_limit": figure(ch.share),
        "temperature_degc": figure(ch.temperature_degc),
    }


def checks_document(
    checks: Sequence[Check], rates: ErrorRates, spec: Mapping[str, str], notes: Sequence[str]
) -> dict[str, Any]:
    """The tree of check_plan.json: the cheapest check first."""
    return {
        "planner": __version__,
        "spec": dict(spec),
        "rates": {"good_rejected": rates.good_rejected, "bad_accepted": rates.bad_accepted},
        "checks": [
            {
                "load": figure(c.load),
                "decides": figure(c.decides),
                "temperatures_degc": list(c.temperatures_degc),
                "tests": [{"test": t.test, "motions": [f + 1 for f in t.faces]} for t in c.tests],
                "power_ons_per_temperature": c.power_ons,
                "time_s": figure(c.time_s),
                "looks": c.looks,
                "expected_power_ons_per_temperature": figure(c.expected),
            }
            for c in checks
        ],
        "notes": list(notes),
    }


def forecast_document(fleet: FleetForecast, region: AllowedRegion, spec: Mapping[str, str]) -> dict[str, Any]:
    """The tree of forecast.json."""
    return {
        "planner": __version__,
        "spec": dict(spec),
        "history": fleet.history.source,
        "start": None if fleet.history.start is None else fleet.history.start.isoformat(),
        "confidence": fleet.confidence,
        "until_day": figure(fleet.until),
        "until": fleet.history.label(fleet.until),
        "today_day": figure(fleet.today),
        "today": fleet.history.label(fleet.today),
        "corrected_by": fleet.correction,
        "methods": dict(fleet.methods),
        "validation": [_score(s, fleet) for s in fleet.scores],
        "units": [_date(u, fleet, region) for u in fleet.by_urgency],
        "channels": [_forecast(c, fleet) for c in fleet.channels],
        "suspects": list(fleet.history.suspects),
        "notes": list(fleet.notes),
    }


def _score(s: MethodScore, fleet: FleetForecast) -> dict[str, Any]:
    unit = next(c.series.display for c in fleet.channels if c.series.error == s.kind)
    return {
        "error": s.kind,
        "method": s.method,
        "cases": s.cases,
        "rmse": shown(s.rmse, unit),
        "naive_rmse": shown(s.naive_rmse, unit),
        "coverage": figure(s.coverage),
        "interval_score": shown(s.score, unit),
        "unit": unit,
        "widened_by": figure(s.factor),
        "beats_naive": s.beats_naive,
        "recommended": s.recommended,
        "why_not": s.why or None,
    }


def _date(u: UnitDate, fleet: FleetForecast, region: AllowedRegion) -> dict[str, Any]:
    c = region.constraints[u.constraint]
    known = u.outcome != "unknown"
    return {
        "unit": u.unit,
        "outcome": u.outcome,
        "overdue": u.due_now,
        "day": None if u.day is None else figure(u.day),
        "date": None if u.day is None else fleet.history.label(u.day),
        "binds": {"requirement": c.requirement, "error": c.error, "rule": c.rule} if known else None,
        "largest_terms": [{"term": name, "share_of_limit": figure(share)} for name, share in u.terms],
        "load": {
            "day": _numbers(u.days),
            "median": _numbers(u.middle),
            "upper": _numbers(u.upper),
        }
        if known
        else None,
        "notes": list(u.notes),
    }


def _forecast(c: ChannelForecast, fleet: FleetForecast) -> dict[str, Any]:
    s, unit = c.series, c.series.display
    known = {
        "unit": s.unit,
        "error": s.error,
        "term": s.term,
        "method": c.method,
        "points": len(s),
        "display_unit": unit,
        "day": _numbers(s.day),
        "value": [shown(float(v), unit) for v in s.value],
        "corrected_by": shown(c.correction, unit),
        "why_not": c.why or None,
    }
    if c.forecast is None:
        return known
    half = c.forecast.half_width(fleet.confidence)
    return known | {
        "drift_per_week": shown(7 * c.rate, unit),
        "drift_per_week_ci95_half": shown(7 * c.rate_half, unit),
        "forecast": {
            "day": _numbers(s.day[-1] + c.ahead),
            "value": [shown(float(v), unit) for v in c.forecast.mean],
            "half_width": [shown(float(v), unit) for v in half],
        },
    }


def _numbers(values: Array) -> list[float | None]:
    return [figure(float(v)) for v in np.asarray(values)]
