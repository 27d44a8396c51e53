"""What the first screen of a diagnosis says besides the verdict: the sizes found, and what to do next."""

from __future__ import annotations

import math
from collections.abc import Sequence

from planner.nouns.diagnosis import Diagnosis, FoundEffect, FoundTerm
from planner.nouns.sensor import short
from planner.report.numbers import SPACE, digits, hours
from planner.report.subjects.diagnosis_words import in_words, joined, plain_name

MOST_SIZES = 3  # effects on the first screen; the table below has all


def sizes_sentence(found: Sequence[FoundEffect]) -> str:
    """Every effect's best told coefficient with its 95 % interval, the strongest effects first."""
    strongest = sorted(found, key=lambda e: -e.strength)[:MOST_SIZES]
    said = [s for s in map(_size, strongest) if s]
    return f"Sizes with 95 % intervals: {'; '.join(said)}." if said else ""


def _size(e: FoundEffect) -> str:
    told = [t for t in e.terms if not t.parameter and math.isfinite(t.high - t.low)]
    if not told:
        return ""
    t = max(told, key=lambda t: abs(t.value) / max(t.high - t.low, 1e-300))
    value, low, high = (digits(x / t.scale, 3) for x in (t.value, t.low, t.high))
    return f"{plain_name(e.effect)} {_term(t)} {value}{SPACE}{t.unit} ({low} … {high})"


def _term(t: FoundTerm) -> str:
    """Where it is: the channel, and the term where a channel has several."""
    return short(t.channel) if t.name == t.channel[-1] else f"{short(t.channel)} {t.name}"


def next_sentence(diagnosis: Diagnosis) -> str:
    """What to do next: the bench before the sensor, what tells rivals apart, then the spec."""
    found = diagnosis.found
    if found.faults:
        checks = joined(list(dict.fromkeys(s.check for s in found.faults)))
        return f"Next: {checks}; then measure again."
    if diagnosis.next_measurement:
        m = diagnosis.next_measurement[0]
        told = " from ".join(map(plain_name, m.separates))
        return f"Next: {in_words(m)} on the {m.bench.replace('_', ' ')} tells {told}, {hours(m.time_s)} h."
    if any(not c.helps for c in diagnosis.navigation):
        return "Next: records that tell the coefficients better: these leave the flight worse."
    if found.fitted:
        return "Next: `planner update` declares what was found and plans again."
    if found.unknown:
        return "Next: `planner update` widens the budget by what is left without a name."
    if found.budget_exceeded:
        return "Next: `planner update` writes the spreads as measured and plans again."
    if found.rows_left_out:
        return "Next: look at the rows left out, and repeat their records."
    return ""
