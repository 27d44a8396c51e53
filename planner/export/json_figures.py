"""Figures as JSON files hold them: nine digits, in display units, null where a figure does not exist."""

from __future__ import annotations

import math

from planner.units import displayed

DIGITS = 9


def figure(value: float) -> float | None:
    """The value to nine digits; None where it is infinite or none."""
    return float(f"{value:.{DIGITS}g}") if math.isfinite(value) else None


def shown(value: float, unit: str) -> float | None:
    """A value, SI, in its display unit."""
    return figure(displayed(value, unit)) if math.isfinite(value) else None
