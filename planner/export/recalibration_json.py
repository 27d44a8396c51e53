"""recalibration.json: visits, hours and what they renew, per unit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import date
from typing import Any

from planner import __version__
from planner.export.json_figures import figure
from planner.fleet.history import day_label
from planner.fleet.sessions import Session
from planner.fleet.store import Visit
from planner.fleet.visit_plans import PlannedVisit, ShortestVisit, StorePlan


def recalibration_document(
    plans: Sequence[StorePlan],
    shortest: Sequence[ShortestVisit],
    start: date | None,
    spec: Mapping[str, str],
    notes: Sequence[str],
    sessions: Sequence[Session] = (),
) -> dict[str, Any]:
    """The tree of recalibration.json."""
    return {
        "planner": __version__,
        "spec": dict(spec),
        "start": None if start is None else start.isoformat(),
        "units": [_plan(p, [s for s in shortest if s.unit == p.unit], start) for p in plans],
        "sessions": [_session(s, start) for s in sessions],
        "notes": list(notes),
    }


def _session(s: Session, start: date | None) -> dict[str, Any]:
    return {
        "day": figure(s.day),
        "date": day_label(start, s.day),
        "units": list(s.units),
        "time_s": figure(s.time_s),
        "by_themselves_s": figure(s.alone_s),
        "fits": s.fits,
    }


def _plan(p: StorePlan, shortest: Sequence[ShortestVisit], start: date | None) -> dict[str, Any]:
    return {
        "unit": p.unit,
        "time_s": figure(p.time_s),
        "whole": p.whole,
        "proved": p.proved,
        "overdue": p.overdue,
        "kept_until_day": figure(p.kept_until),
        "kept_until": day_label(start, p.kept_until),
        "visits": [_planned(v, start) for v in p.visits],
        "shortest": [_shortest(s, start) for s in shortest],
        "binding": [
            {"term": name, "share_of_limit": figure(share), "renewable": can}
            for name, share, can in p.binding
        ],
        "load": {
            "day": [figure(d) for d in p.days],
            "with": [figure(x) for x in p.load],
            "without": [figure(x) for x in p.without],
        },
    }


def _planned(v: PlannedVisit, start: date | None) -> dict[str, Any]:
    return {
        "day": figure(v.day),
        "date": day_label(start, v.day),
        **_visit(v.visit),
        "load_before": figure(v.load_before),
        "load_after": figure(v.load_after),
        "renews": list(v.renewed),
    }


def _shortest(s: ShortestVisit, start: date | None) -> dict[str, Any]:
    return {
        "day": figure(s.day),
        "until_day": figure(s.until),
        "until": day_label(start, s.until),
        **(_visit(s.visit) if s.visit is not None else {"time_s": None}),
        "load_without": figure(s.load_without),
        "load_with": figure(s.load_with),
        "renews": list(s.renewed),
    }


def _visit(v: Visit) -> dict[str, Any]:
    return {"rest_power_ons": v.rests, "turn_power_ons": v.turns, "time_s": figure(v.time_s)}
