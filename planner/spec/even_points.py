"""Temperatures that a number stands for: `temperatures: 5`."""

from __future__ import annotations


def even_points(low: float, high: float, count: int) -> tuple[float, ...]:
    """`count` temperatures evenly spread over the range, both ends included; one point is the middle."""
    if count == 1:
        return ((low + high) / 2,)
    # rounded to 1e-6 K so that unions of spreads have no rounding twins (−60 + 4·30 and −60 + 8·15)
    return tuple(round(low + (high - low) * i / (count - 1), 6) + 0.0 for i in range(count))
