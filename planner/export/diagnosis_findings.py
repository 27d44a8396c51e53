"""What a diagnosis.json says beside effects: suspect references, rows left out, budgets, refusals."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from planner.export.json_figures import figure, shown
from planner.nouns.diagnosed_spreads import BudgetExceeded, SpreadInFlight
from planner.nouns.diagnosis import ReferenceSuspect, Refused, RowLeftOut, UnitDiagnosis
from planner.nouns.sensor import short
from planner.units import unit_factor


def findings_document(found: UnitDiagnosis) -> dict[str, Any]:
    """The keys of diagnosis.json that stand for them."""
    return {
        "reference_suspects": [_suspect(s) for s in found.reference_suspects],
        "rows_left_out": [_row(r) for r in found.rows_left_out],
        "budget_exceeded": [_budget(b) for b in found.budget_exceeded],
        "refused": [
            {"effect": r.effect, "channels": [short(c) for c in r.channels], "why": r.why}
            for r in found.refused
        ],
    }


def _suspect(s: ReferenceSuspect) -> dict[str, Any]:
    return {
        "hypothesis": s.hypothesis,
        "value": figure(s.value),
        "unit": s.unit,
        "ci95": [figure(s.low), figure(s.high)],
        "channels": [short(c) for c in s.channels],
        "p_value": figure(s.p_value),
        "check": s.check,
        "separated_by": figure(s.separated_by),
        "strength_sigma": figure(s.strength),
        "sensor_error": s.alias or None,
        "record": s.record or None,
        "stated_accuracy": figure(s.stated) if s.stated else None,
        "chance_by_accuracy": figure(s.chance) if s.stated else None,
        "within_accuracy": s.expected if s.stated else None,
    }


def _row(r: RowLeftOut) -> dict[str, Any]:
    return {
        "run": r.run,
        "step": r.step or None,
        "channel": short(r.channel),
        "size_sigma": figure(r.size),
        "guess": r.guess,
        "condition": r.condition,
    }


def _budget(b: BudgetExceeded) -> dict[str, Any]:
    return {
        "error": b.error,
        "part": b.part,
        "measured": shown(b.measured, b.unit),
        "ci95": [shown(b.low, b.unit), shown(b.high, b.unit)],
        "budget": shown(b.budget, b.unit),
        "unit": b.unit,
        "channel": short(b.channel) or None,
        "flight": None if b.flight is None else _flight(b.flight),
    }


def _flight(f: SpreadInFlight) -> dict[str, Any]:
    """What the spread makes of one flight: budgeted, measured, and the plan's promise with it."""
    return {
        "error": f.error,
        "unit": f.unit,
        "limit": shown(f.limit, f.unit),
        "budgeted": shown(f.budgeted, f.unit),
        "measured": shown(f.measured, f.unit),
        "promised": shown(f.promised, f.unit),
        "rule": "worst_case" if f.worst_case else "squares",
    }


# ---------------------------------------------------------------- reading back


def findings_from(d: Mapping[str, Any]) -> dict[str, Any]:
    """The same of a tree, by the names of UnitDiagnosis; a file of before has none."""
    return {
        "reference_suspects": tuple(map(_suspect_from, d.get("reference_suspects", ()))),
        "rows_left_out": tuple(map(_row_from, d.get("rows_left_out", ()))),
        "budget_exceeded": tuple(map(_budget_from, d.get("budget_exceeded", ()))),
        "refused": tuple(Refused(r["effect"], tuple(r["channels"]), r["why"]) for r in d.get("refused", ())),
    }


def _suspect_from(s: Mapping[str, Any]) -> ReferenceSuspect:
    low, high = (float_from(x) for x in s["ci95"])
    return ReferenceSuspect(
        s["hypothesis"],
        float_from(s["value"]),
        low,
        high,
        s["unit"],
        tuple(s["channels"]),
        float_from(s["p_value"]),
        float_from(s["strength_sigma"], math.inf),
        s["check"],
        float_from(s["separated_by"], math.inf),
        s.get("sensor_error") or "",
        s.get("record") or "",
        float(s.get("stated_accuracy") or 0.0),
        float_from(s["chance_by_accuracy"]) if s.get("stated_accuracy") else 1.0,
    )


def _row_from(r: Mapping[str, Any]) -> RowLeftOut:
    size = float_from(r["size_sigma"], math.inf)
    return RowLeftOut(int(r["run"]), r["step"] or "", r["channel"], size, r["guess"], r.get("condition", ""))


def _budget_from(b: Mapping[str, Any]) -> BudgetExceeded:
    factor = unit_factor(b["unit"])[0]
    measured, low, high, budget = (
        float_from(x) * factor for x in (b["measured"], b["ci95"][0], b["ci95"][1], b["budget"])
    )
    return BudgetExceeded(
        b["error"], b["part"], measured, low, high, budget, b["unit"], b.get("channel") or "",
        _flight_from(b.get("flight")),
    )  # fmt: skip


def _flight_from(f: Mapping[str, Any] | None) -> SpreadInFlight | None:
    if f is None:
        return None
    factor = unit_factor(f["unit"])[0]
    limit, budgeted, measured, promised = (
        float_from(f[key]) * factor for key in ("limit", "budgeted", "measured", "promised")
    )
    return SpreadInFlight(
        f["error"], f["unit"], limit, budgeted, measured, promised, f["rule"] == "worst_case"
    )


def float_from(value: Any, absent: float = math.nan) -> float:
    """A figure; `absent` for null. Raises TypeError for a truth value, which is no number."""
    if isinstance(value, bool):
        raise TypeError(f"{value!r} is no number")
    return absent if value is None else float(value)
