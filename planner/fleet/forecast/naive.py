"""It stays as it is: the last value, with what a random walk of the size of its own steps would add.

ŷ(T + h) = y(T),   var = q h,   q = Σ (Δy)² / ΣΔt over the n − 1 steps,   Student's t with n − 1
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planner.fleet.forecast._method import Forecast, Past, too_short
from planner.nouns.array import Array


class Naive:
    """The forecast that every other method has to beat."""

    name = "naive"
    least = 2
    slow = False
    needs = ""

    def forecast(self, series: Sequence[Past], ahead: Sequence[Array]) -> list[Forecast | str]:
        """One per series, ahead (h,) days."""
        return [too_short(self, s) or _one(s, h) for s, h in zip(series, ahead, strict=True)]


def _one(series: Past, ahead: Array) -> Forecast:
    q = float(np.sum(np.diff(series.value) ** 2) / np.sum(np.diff(series.day)))
    mean = np.full(len(ahead), series.value[-1])
    return Forecast(mean, np.sqrt(q * ahead), 0.0, len(series) - 1.0)


METHOD = Naive()
