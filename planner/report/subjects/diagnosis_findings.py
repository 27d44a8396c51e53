"""What a diagnosis says beside effects: suspect references, rows left out, budgets, what was refused."""

from __future__ import annotations

import math
from collections.abc import Sequence

from planner.diagnose.budget_to_navigation import together
from planner.nouns.diagnosed_spreads import BudgetExceeded, CampaignCost, SpreadInFlight
from planner.nouns.diagnosis import (
    NavigationCost,
    ReferenceSuspect,
    ResidualChange,
    RowLeftOut,
    UnitDiagnosis,
)
from planner.nouns.sensor import short
from planner.report.blocks import Items, Table, table
from planner.report.numbers import SPACE, digits, hours, in_unit, quantity
from planner.report.subjects.diagnosis_words import chance, length, of_the_unit, plain_name

SMALL, PPM = 0.01, 1e-6  # a share below which it is told in millionths
MOST_ROWS = 40  # of those left out that a page lists
NAMES = {
    "base_tilt": "base off level",
    "mounting": "unit mounted crooked",
    "local_gravity": "local gravity wrong",
    "table_rate": "table's rate wrong",
    "azimuth": "azimuth of the fixture wrong",
    "earth_rate": "the Earth's rate left out",
    "thermometer_lag": "thermometer behind the unit",
    "thermometer_offset": "thermometer reads otherwise",
    "wrong_label": "labels of faces turned",
    "mixed_units": "rows of another unit",
    "stuck_channel": "channel stuck",
    "wrong_record": "readings far from their reference",
}


def suspect_name(hypothesis: str) -> str:
    """What people call a hypothesis about a reference."""
    return NAMES.get(hypothesis, hypothesis.replace("_", " "))


def suspects_table(suspects: Sequence[ReferenceSuspect]) -> Table | None:
    """Every reference that explains the residual better than a sensor."""
    return table(
        "References that are suspect; separated: from the best error of a sensor in their place",
        "reference | size | 95 % interval | unit | stated, 1 σ | channels | p | separated, σ | look at",
        (
            (
                suspect_name(s.hypothesis),
                digits(s.value / _one(s), 3),
                f"{digits(s.low / _one(s), 3)} … {digits(s.high / _one(s), 3)}",
                s.unit if _one(s) == 1.0 else "ppm",
                digits(s.stated / _one(s), 3) if s.stated else "",
                ", ".join(map(short, s.channels)),
                chance(s.p_value),
                digits(s.separated_by, 3) if math.isfinite(s.separated_by) else "",
                "nothing: within the stated accuracy" if s.expected else s.check,
            )
            for s in suspects
        ),
        wide=("p", "separated, σ", "channels"),
    )


def _one(s: ReferenceSuspect) -> float:
    """What its sizes are counted in: a small share in ppm."""
    return PPM if s.unit == "1" and abs(s.value) < SMALL else 1.0


def told_by(suspects: Sequence[ReferenceSuspect]) -> Items | None:
    """Each suspect against its stated accuracy; the sensor's error that no record tells it from."""
    stated = tuple(map(_against_stated, (s for s in suspects if s.stated)))
    said = stated + tuple(
        f"Acting on every record that has it, {suspect_name(s.hypothesis)} is one with {of_the_unit(s)}; "
        f"{s.record} would tell."
        for s in suspects
        if s.alias
    )
    return Items(said) if said else None


def _against_stated(s: ReferenceSuspect) -> str:
    unit = "ppm" if _one(s) == PPM else s.unit
    stated = f"{digits(s.stated / _one(s), 3)}{'' if unit == '1' else SPACE + unit}"
    often = (
        "is often off by so much: no fault, and the plan counts it."
        if s.expected
        else f"is off by so much with chance {chance(s.chance)}: out of its accuracy, or wrongly entered."
    )
    return (
        f"{suspect_name(s.hypothesis).capitalize()}: the spec states {stated} (one sigma) of each "
        f"coefficient; such a bench {often}"
    )


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
    """Spreads of this unit that are larger than the spec's budget, and what each makes of a flight."""
    return table(
        "Budgets that this unit exceeds",
        "error | part | channel | measured | 95 % interval | budget | in flight | as budgeted",
        (
            (
                b.error,
                b.part.replace("_", " "),
                short(b.channel) or "all",
                quantity(b.measured, b.unit, 3),
                f"{digits(in_unit(b.low, b.unit), 2)} … {digits(in_unit(b.high, b.unit), 2)}",
                quantity(b.budget, b.unit, 3),
                "" if b.flight is None else quantity(b.flight.measured, b.flight.unit, 3),
                "" if b.flight is None else quantity(b.flight.budgeted, b.flight.unit, 3),
            )
            for b in exceeded
        ),
    )


def exceeded_sentence(exceeded: Sequence[BudgetExceeded], campaign: CampaignCost | None = None) -> str:
    """Noisier than its budget: the spread that costs most, what all make of a flight, hours of a campaign."""
    worst = max(exceeded, key=_weight)
    what = f"{worst.error} {worst.part.replace('_', ' ')} on {short(worst.channel) or 'all channels'}"
    others = f", and {len(exceeded) - 1} more" if len(exceeded) > 1 else ""
    return (
        f"The unit exceeds its budget: {what} {quantity(worst.measured, worst.unit, 3)} against "
        f"{quantity(worst.budget, worst.unit, 3)}{others}{_metres_said(together(exceeded))}."
        f"{_hours_said(campaign)}"
    )


def _weight(b: BudgetExceeded) -> tuple[float, float]:
    """By what a flight has of it beyond the budget; where no flight is known by the ratio to the budget."""
    f = b.flight
    more = 0.0 if f is None else (f.measured**2 - f.budgeted**2) / f.limit**2
    return more, b.measured / max(b.budget, 1e-300)


def _metres_said(f: SpreadInFlight | None) -> str:
    if f is None:
        return ""
    measured, budgeted = (quantity(x, f.unit, 3) for x in (f.measured, f.budgeted))
    said = f"; in flight {measured} where the budget says {budgeted}"
    if not math.isfinite(f.promised):
        return f"{said}, of a limit of {quantity(f.limit, f.unit, 3)}"
    promised, total = (quantity(x, f.unit, 4) for x in (f.promised, f.total))
    return f"{said}: {promised} promised become {total} of {quantity(f.limit, f.unit, 3)}"


def _hours_said(campaign: CampaignCost | None) -> str:
    """What keeping the requirement with these spreads takes on the bench."""
    if campaign is None:
        return ""
    if not math.isfinite(campaign.after):
        return f" With these spreads no campaign keeps the requirement: {campaign.why}"
    before, after = hours(campaign.before), hours(campaign.after)
    if before == after:
        return f" The campaign of {before} h keeps the requirement with them too."
    return f" With these spreads the campaign takes {after} h instead of {before} h."


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
    parts = [_change_said(r) for r in mine[:3]]
    return f"Residual on unseen runs: {'; '.join(parts)}." if parts else ""


def _change_said(r: ResidualChange) -> str:
    """Channel, before → after and the floor; where only its loudest records rise, what judged a name."""
    before, after, floor = (digits(in_unit(x, r.unit), 3) for x in (r.before, r.after, r.noise_floor))
    plain = f"{before} → {after}{SPACE}{r.unit}"
    if not r.rises_by_the_loudest:
        return f"{short(r.channel)} {plain} (noise floor {floor})"
    return (
        f"{short(r.channel)} {digits(r.weighed_before, 3)} → {digits(r.weighed_after, 3)}{SPACE}σ, each "
        f"record weighed by its noise, where 1 is noise alone (unweighed {plain}, by the loudest records; "
        f"noise floor {floor})"
    )
