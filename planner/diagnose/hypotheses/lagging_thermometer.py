"""A thermometer that lags the unit: by how much, and what is left once the temperatures are put right.

The declared curves were fitted to readings that lag and took most of the lag up; its size is therefore that
at which the declared model, fitted anew to T + τ dT/dt, leaves least,

    S(τ) = Σ_channels |V^(−½) (y − ŷ_τ)|²,     95 %: S(τ) − S(τ₀) ≤ 3.84 s²

and what a search of those temperatures no longer finds was the thermometer's.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from planner.diagnose.hypotheses.channels import channel
from planner.diagnose.hypotheses.orthogonal import clear, orthonormal
from planner.diagnose.hypotheses.prepared import Prepared
from planner.diagnose.hypotheses.sensor import SensorFound
from planner.nouns.array import Array
from planner.nouns.diagnosis import ReferenceSuspect
from planner.nouns.dwell_table import DwellTable

NAME = "thermometer_lag"
LAGS_S = (30.0, 60.0, 100.0, 150.0, 200.0, 300.0, 450.0, 600.0, 900.0)
CHI2_95 = 3.84
FINE = 5  # points between two of the grid


@dataclass(frozen=True)
class Lag:
    """Seconds by which the unit's temperature is ahead of the reading, with its 95 % interval."""

    value: float
    low: float
    high: float


def lag_of(found: Sequence[SensorFound], data: Prepared, declared: tuple[str, ...]) -> Lag | None:
    """The lag of the sensors that suspect the thermometer; None where none does, or no lag leaves less."""
    mine = [(s, b) for s in found for b in s.found.library if s.found.pool.blocks[b].name == NAME]
    if not mine:
        return None
    coarse = np.array([s * t for t in LAGS_S for s in (-1.0, 1.0)] + [0.0])
    coarse.sort()
    left = np.array([_left(mine, data, declared, float(lag)) for lag in coarse])
    k = int(np.clip(np.argmin(left), 1, len(coarse) - 2))
    fine = np.linspace(coarse[k - 1], coarse[k + 1], 2 * FINE + 1)
    around = np.array([_left(mine, data, declared, float(lag)) for lag in fine])
    a, b, _ = np.polyfit(fine - fine.mean(), around, 2)
    if a <= 0.0:
        return None
    value = float(np.clip(fine.mean() - b / (2.0 * a), fine[0], fine[-1]))
    s2 = max(around.min() / max(sum(len(x.found.pool.state) for x, _ in mine) * len(data.table), 1), 1.0)
    half = float(np.sqrt(CHI2_95 * s2 / a))
    return Lag(value, value - half, value + half) if abs(value) > half else None


def _left(
    mine: Sequence[tuple[SensorFound, int]], data: Prepared, declared: tuple[str, ...], lag: float
) -> float:
    """S(τ) over the channels of the sensors."""
    table = ahead(data.table, lag)
    conditions, total = table.conditions(), 0.0
    for s, _ in mine:
        readings: Array | None = table.gyro if s.sensor == "gyro" else table.acc
        assert readings is not None  # it was searched
        for axis, w in s.found.pool.state.items():
            c = channel(s.sensor, axis, conditions, readings[:, axis], declared)
            white = w.noise.whiten(np.column_stack([c.r, c.J, w.noise.fixed_runs]))
            total += float(np.sum(clear(orthonormal(white[:, 1:]), white[:, 0]) ** 2))
    return total


def ahead(table: DwellTable, lag: float) -> DwellTable:
    """The table with the temperatures that the unit had, T + τ dT/dt."""
    return replace(table, temperature_degc=table.temperature_degc + lag * table.temperature_rate)


def with_lag(suspect: ReferenceSuspect, lag: Lag) -> ReferenceSuspect:
    """The suspicion with the size that the declared model itself tells."""
    return replace(suspect, value=lag.value, low=lag.low, high=lag.high)
