"""A power-on whose levels are off on several channels at once: a shock, another supply, zeros that were lost.

Its records agree with each other, so that nothing is off about its mean (`off_power_on`), and what it adds to
the spread from power-on to power-on hides it: one of sixty that is ten sigma off makes that spread 1.6 times
as wide on every channel, and budgets are exceeded. Of readings whitened by the noise and clear of what is
declared and of what is believed of the bench,

    t_r = hᵀz / |h|,   h the rows of power-on r,   off where |t_r| > FARTHER · median |t| / 0.6745

on three channels: a power-on draws each of its biases by itself. On one channel alone it is where |t_r| is
more than four times as far, no other power-on comes near it and no draw of the budget is so large. What a
search believes of the sensors is not taken off: of two power-ons at one temperature a shock of one was a
drift over temperature of all channels.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.channels.orthogonal import clear, orthonormal
from planner.diagnose.channels.prepared import Prepared
from planner.diagnose.references.references import hypothesis
from planner.diagnose.search.sensor import SensorFound
from planner.nouns.array import Array
from planner.protocols import Sensor

FARTHER = 6.0  # sigma by the middle power-on: of three channels at once, with tails of t₃, 1 in 1e6 power-ons
ALONE = 25.0  # sigma of one channel: of tails of t₃ 1 in 1e4, hardly any of which stands out so
NEAREST = 1.0 / 3.0  # of it, that any other power-on of the channel may be
BUDGETED = 6.0  # run-to-run sigmas of the spec's budget: more is no draw
GAUSS = 0.6745  # median of |t| of one sigma
LEAST = 0.05  # of a column's square, that what is declared must leave of it: else the level is its own
EITHER = 0.9  # cosine of two levels, from which one says nearly what the other says
MOST_CELLS = 10_000_000  # rows times power-ons: more are recordings


def levels_off(
    found: Sequence[SensorFound], data: Prepared, told: NDArray[np.bool_], channels: int
) -> NDArray[np.int64]:
    """Places of the power-on, of those that others repeat (`told`), that is off on so many channels.

    With another one that may be it as well, where the two alone have a temperature; none where several are.
    """
    none = np.zeros(0, dtype=np.int64)
    if len(data.table) * len(data.starts) > MOST_CELLS:
        return none
    each = [_Levels.of(s, axis) for s in found for axis in s.found.pool.state]
    if len(each) < channels:
        return none
    far = np.array([x.far(x.t) for x in each])
    off = told & (np.sort(far, axis=0)[-channels] > FARTHER)
    if not off.any():
        return none
    best = int(np.argmax(np.where(off, np.sum(far**2, axis=0), 0.0)))
    rest = np.array([x.far(x.without(best)) for x in each])
    if np.any(told & (np.sort(rest, axis=0)[-channels] > FARTHER)):
        return none
    alike = np.median([np.abs(x.cosine[best]) for x in each if x.known[best]], axis=0) > EITHER
    return np.flatnonzero(alike & off)


def level_off(
    found: Sequence[SensorFound], data: Prepared, told: NDArray[np.bool_]
) -> tuple[NDArray[np.int64], str]:
    """Places of the power-on that is off on one channel alone, and its name; one that may be it as well.

    None where two channels have one, or where another power-on is as far off on any.
    """
    none = np.zeros(0, dtype=np.int64), ""
    if len(data.table) * len(data.starts) > MOST_CELLS:
        return none
    off = []
    for s in found:
        for c in s.channels:
            x = _Levels.of(s, c.axis)
            best = int(np.argmax(np.where(x.known, np.abs(x.t), 0.0)))
            rest = np.where(x.known, np.abs(x.without(best)), 0.0)
            usual = float(np.median(rest[x.known])) / GAUSS if x.known.any() else np.inf
            stands_out = np.abs(x.t[best]) * np.array([1.0 / ALONE, NEAREST]) > [usual, rest.max()]
            if told[best] and stands_out.all() and abs(x.size[best]) > BUDGETED * _budget(data, s.sensor):
                off.append((np.flatnonzero((x.cosine[best] ** 2 > EITHER**2) & told), c.name))
    return off[0] if len(off) == 1 else none


def _budget(data: Prepared, sensor: Sensor) -> float:
    """Run-to-run sigma of the biases, SI, 0 without one."""
    budgets = {} if data.unit is None else getattr(data.unit, sensor)
    return float(budgets["bias"].run_to_run_largest or 0.0) if "bias" in budgets else 0.0


@dataclass(frozen=True)
class _Levels:
    """What a channel says of the level of each power-on: t (g,) in sigma; cosine: (g, g) of the columns h.

    known: (g,) whose level something else tells; size: (g,) the level, SI
    """

    t: Array
    cosine: Array
    known: NDArray[np.bool_]
    size: Array

    @classmethod
    def of(cls, s: SensorFound, axis: int) -> _Levels:
        w, pool = s.found.pool.state[axis], s.found.pool
        blocks = [pool.blocks[b] for b in s.found.library if axis in pool.blocks[b].columns]
        mine = [b.columns[axis] for b in blocks if hypothesis(b.name).bench_only]
        basis = w.Q
        if mine:
            more = orthonormal(clear(w.Q, w.noise.whiten(np.column_stack(mine))), 1e-6)
            basis = np.column_stack([w.Q, more])
        whole, met = w.noise.levels(np.column_stack([clear(basis, w.z), basis]))
        gram = whole - met[:, 1:] @ met[:, 1:].T  # of the levels clear of the basis
        known = np.diag(gram) > LEAST * np.diag(whole)
        size = np.where(known, 1.0 / np.sqrt(np.where(known, np.diag(gram), 1.0)), 0.0)
        return cls(met[:, 0] * size, gram * np.outer(size, size), known, met[:, 0] * size**2)

    def without(self, k: int) -> Array:
        """(g,) t beside a level of power-on k of its own."""
        left = np.maximum(1.0 - self.cosine[k] ** 2, 0.0)
        told = left > LEAST
        return np.where(told, (self.t - self.cosine[k] * self.t[k]) / np.sqrt(np.where(told, left, 1.0)), 0.0)

    def far(self, t: Array) -> Array:
        """(g,) |t| in sigma by the middle one of those that something else tells."""
        usual = float(np.median(np.abs(self.t[self.known]))) / GAUSS if self.known.mean() > 0.5 else np.inf
        return np.asarray(np.abs(t) / max(usual, 1e-300))
