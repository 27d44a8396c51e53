"""Sizes as a spec writes them: three digits and a unit, and nothing understated."""

from __future__ import annotations

import math

from planner.units import from_si


def plain(si: float, unit: str) -> str:
    """Three significant digits."""
    shown = "%" if unit in ("", "1") else unit
    return f"{from_si(si, shown):.3g}"


def written(si: float, unit: str) -> str:
    """A size with its unit, rounded up to three digits, so that nothing is understated."""
    shown = "%" if unit in ("", "1") else unit
    value = from_si(si, shown)
    if value > 0.0:
        step = 10.0 ** (math.floor(math.log10(value)) - 2)
        value = math.ceil(value / step - 1e-9) * step
    return f"{value:.3g} {shown}"
