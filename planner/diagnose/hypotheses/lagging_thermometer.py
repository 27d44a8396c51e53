"""A thermometer that lags the unit: by how much, and what is left once the temperatures are put right.

The declared curves were fitted to readings that lag and took most of the lag up; its size is therefore that
at which smooth curves over T + τ dT/dt leave least,

    S(τ) = Σ_channels min |V^(−½) (y − p(T) − κ(T) v − …)|²,     95 %: S(τ) − S(τ₀) ≤ 3.84 s²

p, κ polynomials, for a table's nodes would come and go as the ramps' rows move; v the misaligned input; T of
soaked rows their power-on's mean. What a search of those temperatures no longer finds was the thermometer's.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.polynomial.chebyshev import chebvander

from planner.diagnose.hypotheses.orthogonal import clear, orthonormal
from planner.diagnose.hypotheses.prepared import Prepared
from planner.diagnose.hypotheses.read_temperature import STILL_K_S, straying
from planner.diagnose.hypotheses.sensor import SensorFound
from planner.diagnose.hypotheses.whitened import Whitened
from planner.measurement import evaluate, jacobian
from planner.nouns.array import Array
from planner.nouns.diagnosis import ReferenceSuspect
from planner.nouns.dwell_table import DwellTable
from planner.temperature_table import temperature_nodes

NAME = "thermometer_lag"
LAGS_S = (30.0, 60.0, 100.0, 150.0, 200.0, 300.0, 450.0, 600.0, 900.0)
CHI2_95 = 3.84
FINE = 5  # points between two of the grid
MOST_DEGREE = 7  # a unit's curve over 120 K; fewer where the points at which the chamber soaks are fewer


@dataclass(frozen=True)
class Lag:
    """Seconds by which the unit's temperature is ahead of the reading, with its 95 % interval."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class _Seen:
    """One channel. y, v: (n,) reading and misaligned input; others: (n, k) columns without a temperature."""

    w: Whitened
    y: Array
    v: Array
    others: Array

    def left(self, basis: Array) -> float:
        """What curves of a basis (n, d) over temperature leave of it, in noise."""
        X = np.column_stack([basis, basis * self.v[:, None], self.others, self.w.noise.fixed_runs])
        white = self.w.noise.whiten(np.column_stack([self.y, X]))
        return float(np.sum(clear(orthonormal(white[:, 1:]), white[:, 0]) ** 2))


def lag_of(found: Sequence[SensorFound], data: Prepared) -> Lag | None:
    """The lag by all channels of all sensors; None where none suspects the thermometer, or none leaves less.

    Every channel that was searched has its say: accelerometers whose bias is steep know a lag best, and may
    yet have called it something else.
    """
    if not any(s.found.pool.blocks[b].name == NAME for s in found for b in s.found.library):
        return None
    table = _calmed(data)
    seen = [_seen(w) for s in found for w in s.found.pool.state.values()]
    coarse = np.array([*(-lag for lag in reversed(LAGS_S)), 0.0, *LAGS_S])
    left = np.array([_left(seen, table, float(lag)) for lag in coarse])
    k = int(np.clip(np.argmin(left), 1, len(coarse) - 2))
    fine = np.linspace(coarse[k - 1], coarse[k + 1], 2 * FINE + 1)
    around = np.array([_left(seen, table, float(lag)) for lag in fine])
    a, b, _ = np.polyfit(fine - fine.mean(), around, 2)
    if a <= 0.0:
        return None
    value = float(np.clip(fine.mean() - b / (2.0 * a), fine[0], fine[-1]))
    s2 = max(float(around.min()) / (len(seen) * len(data.table)), 1.0)
    half = float(np.sqrt(CHI2_95 * s2 / a))
    return Lag(value, value - half, value + half) if abs(value) > half else None


def _calmed(data: Prepared) -> DwellTable:
    """The table without the thermometer's noise where the chamber soaks: it bends every curve's foot."""
    t = data.table
    stray = straying(t.temperature_degc, t.temperature_rate, data.starts)
    return replace(t, temperature_degc=t.temperature_degc - stray)


def _seen(w: Whitened) -> _Seen:
    c = w.channel
    parts = evaluate(c.model, c.theta)
    plain = [
        i
        for i, x in enumerate(c.model.columns())  # of the whole model: c.J has what was found taken out
        if not np.isfinite(x.node_degc) and not x.parameter and x.effect not in c.found
    ]
    return _Seen(w, c.y, parts.v, jacobian(c.model, c.theta, parts)[:, plain])


def _left(seen: Sequence[_Seen], table: DwellTable, lag: float) -> float:
    """S(τ)."""
    t = ahead(table, lag).temperature_degc
    middle, half = (t.max() + t.min()) / 2.0, max(float(np.ptp(t)) / 2.0, 1.0)
    basis = chebvander((t - middle) / half, _degree(table))
    return sum(one.left(basis) for one in seen)


def _degree(table: DwellTable) -> int:
    still = np.abs(table.temperature_rate) <= STILL_K_S
    points = len(temperature_nodes(table.temperature_degc[still])) if still.any() else MOST_DEGREE + 1
    return int(np.clip(points - 1, 1, MOST_DEGREE))


def ahead(table: DwellTable, lag: float) -> DwellTable:
    """The table with the temperatures that the unit had, T + τ dT/dt."""
    return replace(table, temperature_degc=table.temperature_degc + lag * table.temperature_rate)


def with_lag(suspect: ReferenceSuspect, lag: Lag) -> ReferenceSuspect:
    """The suspicion with the size that the declared model itself tells."""
    return replace(suspect, value=lag.value, low=lag.low, high=lag.high)
