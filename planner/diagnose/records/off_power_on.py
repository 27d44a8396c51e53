"""A power-on that is off as a whole: the unit mounted anew, a reference of another run, a hand on the table.

Its rows are too many to be spikes, and as noise they would widen the spreads of every channel: the unit then
exceeds its budgets, and nothing else is found beside them. Of what a search leaves of each power-on, about
its mean, it has many times as much as the others, on several channels at once; or one channel has so much
more in it than in any other that no spread explains it (`one_channel_off`), or its levels are off on several
channels (`levels_off`). Spikes are no such thing, though several channels have one each in the same power-on:
its farthest row counts on no channel.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.channels.orthogonal import clear, orthonormal
from planner.diagnose.channels.prepared import Prepared
from planner.diagnose.channels.unseen_runs import cells_of
from planner.diagnose.records.left_out import whole_run
from planner.diagnose.records.levels_off import level_off, levels_off
from planner.diagnose.records.one_channel_off import alone
from planner.diagnose.search.sensor import SensorFound
from planner.nouns.array import Array
from planner.nouns.diagnosis import RowLeftOut
from planner.nouns.dwell_table import DwellTable

LEAST_RUNS = 8  # power-ons, from which the middle one says what is usual
LEAST_ALIKE = 4  # others, where these are fewer: one channel is so far off in 1 of 100 by spreads alone
LEAST_ROWS = 3  # of a power-on, about whose mean something is left
FARTHER = 25.0  # times the square of the middle power-on: five sigma in every row
REPEATED = 0.5  # share of its rows whose motion another power-on has: the others say what it should read
EITHER = 2  # power-ons, of which one is off and nothing tells which
CHANNELS = 3  # of a unit: its own change at one power-on is of one; of heavy tails three are so in 1 of 1e4


@dataclass(frozen=True)
class Off:
    """The power-on that is off as a whole. runs: its number, or those of two of which either may be it

    channels: that show it
    """

    runs: tuple[int, ...]
    channels: tuple[str, ...]

    def rows(self, table: DwellTable) -> Iterator[RowLeftOut]:
        """Their rows, as findings."""
        for i in np.flatnonzero(np.isin(table.run, self.runs)).tolist():
            run, step = int(table.run[i]), "" if table.step is None else str(table.step[i])
            few = self.channels if len(self.channels) < CHANNELS else ()
            guess = whole_run(run, few, [r for r in self.runs if r != run])
            said = f"{table.temperature_degc[i]:.1f} degC, {table.time_on[i]:.0f} s on"
            for name in self.channels:
                yield RowLeftOut(run, step, name, float("inf"), guess, said)


def off_power_on(found: Sequence[SensorFound], data: Prepared) -> Off | None:
    """The one power-on that is off as a whole, or None: where there are more it is no accident.

    Of fewer than LEAST_RUNS three channels must say the same of one that the others contradict.
    """
    run = data.table.run[data.starts]
    sizes = np.diff(np.append(data.starts, len(data.table)))
    if len(run) <= LEAST_ALIKE:
        return None
    told = (sizes >= LEAST_ROWS) & (_repeated(data, sizes) >= REPEATED)
    ratios = np.array([r for s in found for r in _ratios(s, data, sizes)])
    every = tuple(c.name for s in found for c in s.channels)
    if len(ratios) >= CHANNELS and len(run) >= LEAST_RUNS:
        ratio = np.sort(ratios, axis=0)[-CHANNELS]
        off = np.flatnonzero(told & (ratio > FARTHER))
        if len(off) == 1:
            return Off((int(run[off[0]]),), every)
        off = levels_off(found, data, told, CHANNELS)
        if 0 < len(off) <= EITHER:
            return Off(tuple(run[off].tolist()), every)
    places, channels = alone(found, data, told)
    if not places and len(run) >= LEAST_RUNS:
        off, name = level_off(found, data, told)
        return Off(tuple(run[off].tolist()), (name,)) if 0 < len(off) <= EITHER else None
    if not places or (len(run) < LEAST_RUNS and len(channels) < CHANNELS):
        return None
    return Off(tuple(run[places].tolist()), every if len(channels) >= CHANNELS else tuple(channels))


def _ratios(s: SensorFound, data: Prepared, sizes: NDArray[np.int64]) -> Iterator[Array]:
    """(g,) square a row of each power-on over the middle one's, about their means, of every channel.

    Without the row whose absence leaves least, Σ d² − d_k² n / (n − 1) about the mean of the others: one row
    that alone is far is a spike (`left_out`), and the power-on no farther off than its other rows are.
    """
    for c in s.channels:
        left = _left(s, c.axis)
        means = np.add.reduceat(left, data.starts) / sizes
        about = (left - np.repeat(means, sizes)) ** 2
        farthest = np.maximum.reduceat(about, data.starts) * sizes / np.maximum(sizes - 1, 1)
        others = np.maximum(np.add.reduceat(about, data.starts) - farthest, 0.0)
        square = others / np.maximum(sizes - 2, 1)
        usual = np.median(square[sizes >= LEAST_ROWS]) if np.any(sizes >= LEAST_ROWS) else np.inf
        yield np.asarray(square / max(float(usual), 1e-300))


def _left(s: SensorFound, axis: int) -> Array:
    """(n,) whitened, what the declared model and all that is believed leave of a channel."""
    w, pool = s.found.pool.state[axis], s.found.pool
    mine = [pool.blocks[b].columns[axis] for b in s.found.all if axis in pool.blocks[b].columns]
    if not mine:
        return w.z
    basis = orthonormal(clear(w.Q, w.noise.whiten(np.column_stack(mine))), 1e-6)
    return np.asarray(w.z - basis @ (basis.T @ w.z))


def _repeated(data: Prepared, sizes: NDArray[np.int64]) -> Array:
    """(g,) share of each power-on's rows whose motion, load and ramp another one has too.

    At any temperature: what the declared model has of it each power-on tells by itself.
    """
    conditions = data.table.conditions()
    cells = cells_of(replace(conditions, temperature_degc=np.zeros(len(conditions.day))))
    which = np.repeat(np.arange(len(sizes)), sizes)
    pairs = np.unique(np.column_stack([cells, which]), axis=0)
    several = np.bincount(pairs[:, 0], minlength=int(cells.max()) + 1) > 1
    return np.asarray(np.add.reduceat(several[cells].astype(float), data.starts) / sizes)
