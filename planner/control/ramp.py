"""An even ramp of a chamber as a stair of setpoints, which its air smooths."""

from __future__ import annotations

import math

STAIR_K = 0.2  # between two setpoints: two of the tenths that many a controller takes


def stair(begin: float, end: float) -> list[float]:
    """Setpoints in degC from one temperature to another, each for as long as the others."""
    count = max(1, math.ceil(abs(end - begin) / STAIR_K - 1e-9))
    return [begin + (end - begin) * (k + 0.5) / count for k in range(count)]
