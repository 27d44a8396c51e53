"""What a diagnosis.json says beside effects: suspect references, rows left out, budgets, refusals."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from planner.nouns.diagnosis import BudgetExceeded, ReferenceSuspect, Refused, RowLeftOut, UnitDiagnosis
from planner.units import from_si, unit_factor

_DIGITS = 9


def findings_document(found: UnitDiagnosis) -> dict[str, Any]:
    """The keys of diagnosis.json that stand for them."""
    return {
        "reference_suspects": [_suspect(s) for s in found.reference_suspects],
        "rows_left_out": [_row(r) for r in found.rows_left_out],
        "budget_exceeded": [_budget(b) for b in found.budget_exceeded],
        "refused": [
            {"effect": r.effect, "channels": [_channel(c) for c in r.channels], "why": r.why}
            for r in found.refused
        ],
    }


def _suspect(s: ReferenceSuspect) -> dict[str, Any]:
    return {
        "hypothesis": s.hypothesis,
        "value": _number(s.value),
        "unit": s.unit,
        "ci95": [_number(s.low), _number(s.high)],
        "channels": [_channel(c) for c in s.channels],
        "p_value": _number(s.p_value),
        "check": s.check,
        "separated_by": _number(s.separated_by),
        "strength_sigma": _number(s.strength),
        "sensor_error": s.alias or None,
        "record": s.record or None,
    }


def _row(r: RowLeftOut) -> dict[str, Any]:
    return {
        "run": r.run,
        "step": r.step or None,
        "channel": _channel(r.channel),
        "size_sigma": _number(r.size),
        "guess": r.guess,
        "condition": r.condition,
    }


def _budget(b: BudgetExceeded) -> dict[str, Any]:
    return {
        "error": b.error,
        "part": b.part,
        "measured": _shown(b.measured, b.unit),
        "ci95": [_shown(b.low, b.unit), _shown(b.high, b.unit)],
        "budget": _shown(b.budget, b.unit),
        "unit": b.unit,
        "channel": _channel(b.channel) or None,
    }


def _channel(name: str) -> str:
    return name.replace("accelerometer_", "acc_")


def _shown(si: float, unit: str) -> float | None:
    return _number(from_si(si, unit)) if math.isfinite(si) else None


def _number(value: float) -> float | None:
    return float(f"{value:.{_DIGITS}g}") if math.isfinite(value) else None


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
    low, high = (_float(x) for x in s["ci95"])
    return ReferenceSuspect(
        s["hypothesis"],
        _float(s["value"]),
        low,
        high,
        s["unit"],
        tuple(s["channels"]),
        _float(s["p_value"]),
        _float(s["strength_sigma"], math.inf),
        s["check"],
        _float(s["separated_by"], math.inf),
        s.get("sensor_error") or "",
        s.get("record") or "",
    )


def _row_from(r: Mapping[str, Any]) -> RowLeftOut:
    size = _float(r["size_sigma"], math.inf)
    return RowLeftOut(int(r["run"]), r["step"] or "", r["channel"], size, r["guess"], r.get("condition", ""))


def _budget_from(b: Mapping[str, Any]) -> BudgetExceeded:
    factor = unit_factor(b["unit"])[0]
    measured, low, high, budget = (
        _float(x) * factor for x in (b["measured"], b["ci95"][0], b["ci95"][1], b["budget"])
    )
    return BudgetExceeded(
        b["error"], b["part"], measured, low, high, budget, b["unit"], b.get("channel") or ""
    )


def _float(value: Any, absent: float = math.nan) -> float:
    return absent if value is None else float(value)
