"""Power-ons in which the thermometer stood still or was not read: one value, to the last digit, in them all.

A thermometer that lives hardly ever reads the same twice in a row. Of m pairs of records that follow each
other in the power-ons where it lives e are alike, and k pairs where it does not are so by chance with

    p = ((e + 1) / (m + 2))^k

(Laplace), for one power-on or for several in a row that all have the same value. What only a bench of its own
has, on which nobody reads a thermometer and all write the 20 degC of the hall, is no fault.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.records.times_of_records import by_run
from planner.diagnose.references.bench_directions import loaded
from planner.effects._bench_frame import turning
from planner.effects._history import RAMP
from planner.nouns.dwell_table import DwellTable

ROWS = 3  # of a power-on: two readings may be alike by rounding
LIVES = 2  # soaked power-ons in which it does: on ramps alone it moves by itself
CHANCE = 1e-5  # over all power-ons that may be it
LEFT = 3  # power-ons that must stay, or nothing can be said without those


def still_thermometer(table: DwellTable) -> tuple[int, ...]:
    """The power-ons, in a row, whose temperature is one value to the last digit; none where others repeat."""
    runs, starts = by_run(table)
    if "temperature_degc" in table.absent:
        return ()
    order = np.lexsort((table.time_on, table.run))
    t, sizes = table.temperature_degc[order], np.diff(np.append(starts, len(table)))
    low, high = np.minimum.reduceat(t, starts), np.maximum.reduceat(t, starts)
    alike = low == high
    long = alike & (sizes >= ROWS)
    if not long.any():
        return ()
    value = low[int(np.argmax(long))]
    mine = np.flatnonzero(alike & (low == value))
    of_one = np.ptp(mine) == len(mine) - 1  # in a row
    if not of_one or np.any(long & (low != value)) or len(runs) - len(mine) < LEFT:
        return ()
    there = np.repeat(np.isin(np.arange(len(runs)), mine), sizes)
    others = t[~there]
    if (len(others) - len(np.unique(others))) * ROWS >= len(others):
        return ()
    kinds, soaked = _kinds(table, order, starts), _soaked(table, order, starts)
    elsewhere = np.isin(np.arange(len(runs)), mine, invert=True)
    if np.count_nonzero(soaked & elsewhere) < LIVES or not np.isin(kinds[mine], kinds[elsewhere]).any():
        return ()
    pairs = np.diff(np.repeat(np.arange(len(runs)), sizes)) == 0
    lives = pairs & ~there[1:]
    p = (np.count_nonzero(lives & (np.diff(t) == 0.0)) + 1.0) / (np.count_nonzero(lives) + 2.0)
    chance = len(runs) * p ** (np.count_nonzero(there) - 1.0)
    return tuple(int(runs[i]) for i in mine) if chance < CHANCE else ()


def _kinds(table: DwellTable, order: NDArray[np.int64], starts: NDArray[np.int64]) -> NDArray[np.int64]:
    """(g,) what a power-on holds: 1 rests, 2 turns, 4 loads, and their sums."""
    conditions = table.conditions()
    load, turn = loaded(conditions)[order], turning(conditions)[order]
    each = np.where(load, 4, np.where(turn, 2, 1))
    return np.asarray(np.bitwise_or.reduceat(each, starts))


def _soaked(table: DwellTable, order: NDArray[np.int64], starts: NDArray[np.int64]) -> NDArray[np.bool_]:
    """(g,) whether the chamber holds or settles in most records of a power-on."""
    ramps = np.split(np.abs(table.temperature_rate[order]) > RAMP, starts[1:])
    return np.array([np.count_nonzero(one) * 2 < len(one) for one in ramps])
