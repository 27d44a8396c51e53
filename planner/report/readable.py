"""One unit for each error of a result: that of its allowance, which is the spec's own."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace

from planner.nouns.plan import Plan
from planner.nouns.sensitivities import Sensitivities
from planner.report.numbers import NOTHING, digits, display_unit, in_unit


def units_of(plan: Plan) -> Mapping[str, str]:
    """Error -> the unit of its allowance."""
    return {a.error: a.unit for a in plan.allowances}


def sensitivities_in(sensitivities: Sensitivities, units: Mapping[str, str]) -> Sensitivities:
    """The sensitivities with the units of their columns renamed."""
    columns = tuple(replace(c, unit=units.get(c.error, c.unit)) for c in sensitivities.columns)
    return replace(sensitivities, columns=columns)


def shown_in(unit: str, values: Iterable[float]) -> tuple[str, ...]:
    """SI values to three digits in their unit, and that unit; `–` for what is not finite."""
    cells = (digits(in_unit(v, unit), 3) if math.isfinite(v) else NOTHING for v in values)
    return (*cells, display_unit(unit))
