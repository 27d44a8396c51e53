"""A power-on whose readings sit on the curves of another temperature: a setpoint mistyped, a file swapped.

The declared tables get a node of their own where nobody else soaks, and nothing is missing; where others
soak, the power-on looks like a spread, or like an effect that came with it. Smooth curves of the others say
what it reads at any temperature T + d,

    χ²(d) = eᵀ (I + Z C Zᵀ)⁻¹ e,   e = y − Z β,   Z = V^(−½) X(T + d) of its rows; β, C of all the others,

summed over the channels. It was at T + d where at T it is off beyond chance, at T + d nothing is left to
explain, and several channels say so that have their curves each.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.channels.prepared import Prepared
from planner.diagnose.channels.read_temperature import STILL_K_S
from planner.diagnose.findings.lagging_thermometer import (
    CHI2_95,
    CHI2_999,
    Seen,
    curves,
    degree_of,
    seen_of,
    shifted,
)
from planner.diagnose.hypotheses.pool import inverse
from planner.diagnose.search.sensor import SensorFound
from planner.dwells.table_rows import rows_of
from planner.nouns.array import Array
from planner.nouns.diagnosis import ReferenceSuspect, RowLeftOut
from planner.nouns.dwell_table import DwellTable
from planner.solvers.distributions import chi_square_tail
from planner.solvers.random_effects import covariance
from planner.temperature_table import GAP_K, temperature_nodes

LEAST_RUNS = 4  # power-ons: three of which say what the fourth reads
TRIED = 3  # power-ons that are furthest off
OFF = 1e-9  # p of all channels' χ² at the temperature that was read, from which another one is tried
STEP_K = 0.5  # between temperatures that are tried
LEAST_K = 5.0  # kelvins: a chamber's own gradient is less, and a lag has a name of its own
LEFT = 1e-3  # p of what is left at the other temperature
SEVERAL = 3  # channels that must say it by themselves: the others may have flat curves
RANK = 1e-8  # of the largest direction, below which the other power-ons tell nothing


@dataclass(frozen=True)
class Another:
    """The temperature at which a power-on was, with its 95 % interval, degC; read: what it says.

    channels: that say so; strength: √(χ²(0) − χ²(d))
    """

    run: int
    value: float
    low: float
    high: float
    read: float
    channels: tuple[str, ...]
    strength: float

    @property
    def said(self) -> str:
        """The guess, one sentence."""
        return (
            f"temperature of run {self.run} looks like {self.value:.0f} degC where {self.read:.0f} degC is "
            "written: its readings sit on the curves of the others there"
        )

    def rows(self, table: DwellTable) -> Iterator[RowLeftOut]:
        """Its rows, as findings."""
        for i in np.flatnonzero(table.run == self.run).tolist():
            step = "" if table.step is None else str(table.step[i])
            condition = f"{table.temperature_degc[i]:.1f} degC, {table.time_on[i]:.0f} s on"
            yield RowLeftOut(self.run, step, "all", self.strength, self.said, condition)

    @property
    def suspect(self) -> ReferenceSuspect:
        """What is to be looked up."""
        check = f"look up the chamber's log of run {self.run}: {self.said}; its rows are left out"
        return ReferenceSuspect(
            "wrong_record", self.value, self.low, self.high, "degC", self.channels,
            float(chi_square_tail(self.strength**2, 1)), self.strength, check, 0.0,
        )  # fmt: skip


def of_another_temperature(found: Sequence[SensorFound], data: Prepared) -> Another | None:
    """The one power-on that was at another temperature than is written, or None."""
    table = data.table
    sizes = np.diff(np.append(data.starts, len(table)))
    if len(sizes) < LEAST_RUNS or np.ptp(table.temperature_degc) < LEAST_K:
        return None
    moves = np.logical_or.reduceat(np.abs(table.temperature_rate) > STILL_K_S, data.starts)
    seen = [seen_of(s, axis) for s in found for axis in s.found.pool.state]
    names = [c.name for s in found for c in s.channels]
    degrees = _degrees(table, data.starts)
    fitted = {d: [_fitted(one, table, data.starts, d) for one in seen] for d in np.unique(degrees).tolist()}
    off = np.zeros((len(seen), len(sizes)))
    for d, channels in fitted.items():
        off[:, degrees == d] = np.array([f.squares() for f in channels])[:, degrees == d]
    scale = np.maximum(np.median(off / sizes, axis=1), 1.0)
    total = np.sum(off / scale[:, None], axis=0)
    p = np.array([float(chi_square_tail(x, len(seen) * n)) for x, n in zip(total, sizes, strict=True)])
    order = np.argsort(-np.where(moves, 0.0, total / sizes))[:TRIED]
    far = [int(q) for q in order if not moves[q] and p[q] < OFF]
    tried = (_tried(fitted[int(degrees[q])], names, scale, data, q) for q in far)
    return max((one for one in tried if one is not None), key=lambda one: one.strength, default=None)


def _tried(
    channels: Sequence[_Fitted], names: Sequence[str], scale: Array, data: Prepared, q: int
) -> Another | None:
    """What a power-on is where its readings say another temperature."""
    table = data.table
    mine = rows_of_run(data.starts, q, len(table))
    t, others = table.temperature_degc[mine], np.delete(table.temperature_degc, mine)
    low, high = others.min() - t.min() - GAP_K, others.max() - t.max() + GAP_K
    shifts = np.arange(low, max(high, low + STEP_K), STEP_K)
    shifts = np.append(0.0, shifts[np.abs(shifts) >= LEAST_K])
    if len(shifts) < SEVERAL:
        return None
    squares = np.array([f.at(q, shifts) for f in channels]) / scale[:, None]
    total = squares.sum(axis=0)
    best = 1 + int(np.argmin(total[1:]))
    falls = squares[:, 0] - squares[:, best]
    says = falls > CHI2_999
    rest = float(chi_square_tail(float(total[best]), len(channels) * len(mine)))
    if says.sum() < SEVERAL or falls.min() < -CHI2_999 or rest < LEFT:
        return None
    before, middle, after = (float(x) for x in total[[max(best - 1, 1), best, min(best + 1, len(total) - 1)]])
    bend = max(before - 2.0 * middle + after, 0.0) / 2.0  # of S, at a step on either side
    moved = float(np.clip((before - after) / max(4.0 * bend, 1e-300), -0.5, 0.5)) * STEP_K
    half = STEP_K * float(np.sqrt(CHI2_95 / max(bend, 1e-2)))
    read, value = float(np.median(t)), float(np.median(t) + shifts[best]) + moved
    return Another(
        int(table.run[mine[0]]), value, value - half, value + half, read,
        tuple(name for name, one in zip(names, says, strict=True) if one),
        float(np.sqrt(total[0] - total[best])),
    )  # fmt: skip


def _degrees(table: DwellTable, starts: NDArray[np.int64]) -> NDArray[np.int64]:
    """(g,) of the curves that the others tell of each power-on: fewer where a temperature is its alone."""
    t, run = table.temperature_degc, np.repeat(np.arange(len(starts)), np.diff(np.append(starts, len(table))))
    nodes = temperature_nodes(t)
    nearest = np.argmin(np.abs(t[:, None] - nodes), axis=1)
    first, last = np.full(len(nodes), len(starts)), np.full(len(nodes), -1)
    np.minimum.at(first, nearest, run)
    np.maximum.at(last, nearest, run)
    degrees = np.full(len(starts), degree_of(table))
    for q in np.unique(first[first == last]).tolist():
        degrees[q] = degree_of(rows_of(table, run != q))
    return degrees


@dataclass(frozen=True)
class _Fitted:
    """One channel under curves of a degree over temperature. table: its rows, run by run

    β: (k,) of columns of a size (k,), by all power-ons; gram: (g, k, k) ZᵀZ, h: (g, k) Zᵀe and s: (g,) eᵀe
    of each. The level of a power-on that is its own (`fixed_runs`) the others do not tell, and it stays free.
    """

    seen: Seen
    table: DwellTable
    starts: NDArray[np.int64]
    degree: int
    size: Array
    beta: Array
    gram: Array
    h: Array
    s: Array

    def squares(self) -> Array:
        """(g,) χ² of every power-on at the temperature that was read: s + hᵀ (Σ G − G)⁺ h.

        Directions of its own have nothing of h; columns are of length one, and RANK keeps those from 0 / 0.
        """
        others = self.gram.sum(axis=0) - self.gram + RANK * np.eye(len(self.size))
        told = np.linalg.solve(others, self.h[:, :, None])[:, :, 0]
        return np.asarray(self.s + np.sum(self.h * told, axis=1))

    def at(self, q: int, shifts: Array) -> Array:
        """(d,) χ² of a power-on at other temperatures, its rows whitened by themselves."""
        rows, noise = rows_of_run(self.starts, q, len(self.table)), self.seen.w.noise
        mine = noise.covariance.effects.at(np.arange(len(self.starts)) == q)
        block = covariance(mine, noise.variances.theta)
        G = self.gram.sum(axis=0) - self.gram[q]
        beta = self.beta + inverse(G) @ (self.h.sum(axis=0) - self.h[q])
        t = self.table.temperature_degc
        X = self.seen.columns(curves(t, t[rows], self.degree), rows)
        white = block.whiten(np.column_stack([X, self.seen.y[rows]]))
        Z = white[:, :-1] @ shifted(t, -shifts, self.degree, len(beta)) / self.size
        e = white[:, -1] - Z @ beta
        b = np.einsum("dnk,dn->dk", Z, e)
        told = np.einsum("dj,djk,dk->d", b, inverse(G + np.swapaxes(Z, 1, 2) @ Z), b)
        return np.asarray(np.sum(e**2, axis=1) - told)


def _fitted(seen: Seen, table: DwellTable, starts: NDArray[np.int64], degree: int) -> _Fitted:
    t = table.temperature_degc
    X = seen.columns(curves(t, t, degree))
    white = seen.w.noise.whiten(np.column_stack([X, seen.y]))
    size = np.maximum(np.linalg.norm(white[:, :-1], axis=0), 1e-300)
    Z = white[:, :-1] / size
    beta = np.linalg.lstsq(Z, white[:, -1], rcond=RANK)[0]
    e = white[:, -1] - Z @ beta
    parts = list(zip(np.split(Z, starts[1:]), np.split(e, starts[1:]), strict=True))
    return _Fitted(
        seen, table, starts, degree, size, beta,
        np.array([z.T @ z for z, _ in parts]), np.array([z.T @ x for z, x in parts]),
        np.array([x @ x for _, x in parts]),
    )  # fmt: skip


def rows_of_run(starts: NDArray[np.int64], q: int, n: int) -> NDArray[np.int64]:
    """Rows of a power-on."""
    return np.arange(starts[q], np.append(starts, n)[q + 1])
