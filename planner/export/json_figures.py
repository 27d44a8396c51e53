"""JSON files of ours: their text, and their figures.

Figures have nine digits, in display units; null where a figure does not exist.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any

from planner.units import displayed

DIGITS = 9


def json_text(document: Mapping[str, Any]) -> str:
    """A tree as the text of its file. The same tree gives the same bytes."""
    return json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def figure(value: float) -> float | None:
    """The value to nine digits; None where it is infinite or none."""
    return float(f"{value:.{DIGITS}g}") if math.isfinite(value) else None


def shown(value: float, unit: str) -> float | None:
    """A value, SI, in its display unit."""
    return figure(displayed(value, unit)) if math.isfinite(value) else None
