"""Units in which the figures of one plan read best: 0.19 deg/h rather than 0.000053 deg/s.

An error keeps the display unit of its effect while its size there is a thousandth or more; below that the
next finer unit of the field is taken. Only the names of units change, never a value: values are SI.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace

from planner.nouns.allowances import AllowedErrors
from planner.nouns.plan import Plan
from planner.nouns.sensitivities import Sensitivities
from planner.report.numbers import NOTHING, digits, display_unit, in_unit
from planner.units import from_si

_FINER: Mapping[str, tuple[str, ...]] = {
    "deg/s": ("deg/s", "deg/h"),
    "g": ("g", "mg", "ug"),
    "1": ("%", "ppm"),
    "%": ("%", "ppm"),
    "deg": ("deg", "arcsec"),
}
_LEAST = 1e-3  # as small as a figure may be before it is all zeros


def readable_unit(unit: str, size: float) -> str:
    """The unit for an error of SI `size` whose effect has the display unit `unit`: `deg/s/g` -> `deg/h/g`."""
    head, rest = _split(unit)
    candidates = [finer + rest for finer in _FINER.get(head, (head,))]
    return next((u for u in candidates if not 0 < abs(from_si(size, u)) < _LEAST), candidates[-1])


def units_of(plan: Plan) -> Mapping[str, str]:
    """Error -> readable unit of its allowance."""
    return {a.error: readable_unit(a.unit, a.allowed) for a in plan.allowances}


def plan_in(plan: Plan, units: Mapping[str, str]) -> Plan:
    """The plan with the units of its allowances renamed."""
    return replace(
        plan, allowances=tuple(replace(a, unit=units.get(a.error, a.unit)) for a in plan.allowances)
    )


def allowed_in(allowed: AllowedErrors, units: Mapping[str, str]) -> AllowedErrors:
    """The allowed errors with their units renamed; what `units` lacks, by its smallest size."""
    own = {e: units.get(e) or readable_unit(allowed.units[e], allowed.smallest[e]) for e in allowed.errors}
    return replace(allowed, units=own)


def sensitivities_in(sensitivities: Sensitivities, units: Mapping[str, str]) -> Sensitivities:
    """The sensitivities with the units of their columns renamed."""
    columns = tuple(replace(c, unit=units.get(c.error, c.unit)) for c in sensitivities.columns)
    return replace(sensitivities, columns=columns)


def _split(unit: str) -> tuple[str, str]:
    """`deg/s/g` -> `deg/s`, `/g`; `1/K` -> `1`, `/K`."""
    if unit.startswith("deg/s"):
        return "deg/s", unit[len("deg/s") :]
    head, slash, rest = (unit or "1").partition("/")
    return head, slash + rest


def shown_in(unit: str, size: float, values: Iterable[float]) -> tuple[str, ...]:
    """SI values to three digits in the unit that suits `size`, and that unit; `–` for what is not finite."""
    shown = readable_unit(unit, size)
    cells = (digits(in_unit(v, shown), 3) if math.isfinite(v) else NOTHING for v in values)
    return (*cells, display_unit(shown))
