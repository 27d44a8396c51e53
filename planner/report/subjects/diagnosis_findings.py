"""What a diagnosis says beside effects: suspect references, rows left out, budgets, what was refused."""

from __future__ import annotations

import math
from collections.abc import Sequence

from planner.nouns.diagnosis import (
    BudgetExceeded,
    NavigationCost,
    ReferenceSuspect,
    ResidualChange,
    RowLeftOut,
    UnitDiagnosis,
)
from planner.report.blocks import Items, Table, table
from planner.report.numbers import SPACE, digits, in_unit, quantity
from planner.report.subjects.diagnosis_words import chance, joined, length, plain_name, short

MOST_ROWS = 40  # of those left out that a page lists
NAMES = {
    "base_tilt": "base off level",
    "mounting": "unit mounted crooked",
    "local_gravity": "local gravity wrong",
    "table_rate": "table's rate wrong",
    "azimuth": "azimuth of the fixture wrong",
    "thermometer_lag": "thermometer behind the unit",
    "wrong_label": "labels of faces turned",
    "mixed_units": "rows of another unit",
}


def suspect_name(hypothesis: str) -> str:
    """What people call a hypothesis about a reference."""
    return NAMES.get(hypothesis, hypothesis.replace("_", " "))


def suspects_sentence(suspects: Sequence[ReferenceSuspect]) -> str:
    """Reference suspect: …"""
    return f"reference suspect: {joined([_told(s) for s in suspects])}"


def _told(s: ReferenceSuspect) -> str:
    if s.unit in ("rows", "run"):
        return f"{suspect_name(s.hypothesis)} ({s.unit} {digits(s.value, 4)})"
    return f"{suspect_name(s.hypothesis)} ({digits(s.value, 3)}{'' if s.unit == '1' else SPACE + s.unit})"


def suspects_table(suspects: Sequence[ReferenceSuspect]) -> Table | None:
    """Every reference that explains the residual better than a sensor."""
    return table(
        "References that are suspect; separated: from the best error of a sensor in their place",
        "reference | size | 95 % interval | unit | channels | p | separated, σ | look at",
        (
            (
                suspect_name(s.hypothesis),
                digits(s.value, 3),
                f"{digits(s.low, 3)} … {digits(s.high, 3)}",
                s.unit,
                ", ".join(map(short, s.channels)),
                chance(s.p_value),
                digits(s.separated_by, 3) if math.isfinite(s.separated_by) else "",
                s.check,
            )
            for s in suspects
        ),
        wide=("p", "separated, σ", "channels"),
    )


def told_by(suspects: Sequence[ReferenceSuspect]) -> Items | None:
    """For each suspect that is one with a sensor's error on all records: which, and what would tell."""
    said = tuple(
        f"Acting on every record, {suspect_name(s.hypothesis)} is one with a common {plain_name(s.alias)} of "
        f"the {s.channels[0].split('_')[0]}s; {s.record} would tell."
        for s in suspects
        if s.alias
    )
    return Items(said) if said else None


def left_out_table(rows: Sequence[RowLeftOut]) -> Table | None:
    """The records that no model of the unit follows."""
    return table(
        "Rows left out: findings of their own"
        + (f" (the first {MOST_ROWS})" if len(rows) > MOST_ROWS else ""),
        "run | step | condition | channel | size, σ | looks like",
        (
            (
                str(r.run),
                r.step,
                r.condition,
                short(r.channel),
                digits(r.size, 3) if math.isfinite(r.size) else "of the size of the reading",
                r.guess,
            )
            for r in rows[:MOST_ROWS]
        ),
    )


def refused_table(found: UnitDiagnosis) -> Table | None:
    """What was tried and did not enter."""
    return table(
        "Tried and not entered, and why",
        "effect | channels | why",
        ((plain_name(r.effect), ", ".join(map(short, r.channels)), r.why) for r in found.refused),
    )


def exceeded_table(exceeded: Sequence[BudgetExceeded]) -> Table | None:
    """Spreads of this unit that are larger than the spec's budget."""
    return table(
        "Budgets that this unit exceeds",
        "error | part | channel | measured | 95 % interval | budget",
        (
            (
                b.error,
                b.part.replace("_", " "),
                short(b.channel),
                quantity(b.measured, b.unit, 3),
                f"{digits(in_unit(b.low, b.unit), 2)} … {digits(in_unit(b.high, b.unit), 2)}",
                quantity(b.budget, b.unit, 3),
            )
            for b in exceeded
        ),
    )


def exceeded_sentence(exceeded: Sequence[BudgetExceeded]) -> str:
    """Noisier than its budget: …"""
    worst = max(exceeded, key=lambda b: b.measured / max(b.budget, 1e-300))
    what = f"{worst.error} {worst.part.replace('_', ' ')} on {short(worst.channel)}"
    return (
        f"The unit exceeds its budget: {what} "
        f"{quantity(worst.measured, worst.unit, 3)} against {quantity(worst.budget, worst.unit, 3)}."
    )


def worse_sentence(c: NavigationCost) -> str:
    """Compensation does not help in flight: …"""
    return (
        f"Compensation does not help in flight: {length(max(c.before, c.as_calibrated), c)} without, "
        f"{length(c.after, c)} with it; `planner update` does not declare it."
    )


def change_sentence(found: UnitDiagnosis, residual: Sequence[ResidualChange]) -> str:
    """Residual before → after with the noise floor, of the channels on which something was found."""
    on = [
        *(e.channels for e in found.effects),
        *(s.channels for s in found.reference_suspects),
        *(u.channels for u in found.unknown),
    ]
    touched = {short(c) for channels in on for c in channels}
    mine = [r for r in residual if short(r.channel) in touched and r.held_out]
    parts = [
        f"{short(r.channel)} {digits(in_unit(r.before, r.unit), 3)} → {digits(in_unit(r.after, r.unit), 3)}"
        f"{SPACE}{r.unit} (noise floor {digits(in_unit(r.noise_floor, r.unit), 3)})"
        for r in mine[:3]
    ]
    return f"Residual on unseen runs: {'; '.join(parts)}." if parts else ""
