"""What a diagnosis looked for in vain, and what these data cannot show."""

from __future__ import annotations

from planner import catalog
from planner.nouns.diagnosis import NotFound, UnitDiagnosis
from planner.report.blocks import Table, table
from planner.report.numbers import SPACE, digits, quantity
from planner.report.subjects.diagnosis_words import plain_name

MOST_TERMS = 4  # that are written by name


def limits_table(found: UnitDiagnosis) -> Table | None:
    """Effects looked for in vain: no larger than this."""
    return table(
        "Looked for and not found: upper limits, 95 %",
        "effect | sensor | no larger than",
        ((plain_name(n.effect), n.sensor, _limit(n)) for n in found.not_found),
    )


def _limit(n: NotFound) -> str:
    """`0.024 deg/s (time constant 15 s; z alone)`: the parameters at which it holds; terms if not all."""
    effect = catalog.effects()[n.effect]
    units = {p.name: "" if p.unit == "1" else SPACE + p.unit for p in effect.parameters}
    at = [f"{plain_name(name)} {digits(value, 2)}{units[name]}" for name, value in n.nonlinear.items()]
    if len(n.terms) > MOST_TERMS:
        at.append(f"{len(n.terms)} of {len(effect.terms(n.sensor))} terms")
    elif n.terms:
        at.append(f"{', '.join(n.terms)} alone")
    size = quantity(n.upper_limit, n.unit, 2)
    return f"{size} ({'; '.join(at)})" if at else size


def untestable_table(found: UnitDiagnosis) -> Table | None:
    """Effects that these data cannot show."""
    return table(
        "Untestable, and why",
        "effect | sensor | why",
        ((plain_name(u.effect), u.sensor or "both", u.why) for u in found.untestable),
    )
