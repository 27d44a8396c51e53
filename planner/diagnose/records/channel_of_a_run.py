"""One channel of one power-on that reads in another unit of measurement, or from another instrument.

Row by row it shows only where the channel has an input (`no_readings`); at rest a gyro has none, and its bias
of .2 deg/s reads 720 in deg/h. As noise it is a run-to-run of 200 deg/s, beside which nothing is missing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.records.no_readings import LEAST_RATE, NoReading
from planner.nouns.dwell_table import DwellTable

LEAST_RUNS = 4  # power-ons with rests: of three the range of two says little of a third
LEAST_ROWS = 3  # rests of a power-on
FARTHER = 20.0  # times the range of the other power-ons' levels: of spreads of t₃ among five 1 in 1e5
LEAST_LEVEL = float(np.radians(5.0))  # 20 deg/s of a cheap unit is its bias and no change from run to run
HALF = 0.5  # of its input, that a channel has in a row that tells
MOST_OF = 0.8  # of a power-on's telling rows that are far: then the others of it are not as they say either


def off_at_rest(table: DwellTable, kept: NDArray[np.bool_]) -> list[NoReading]:
    """The power-on whose rests read far from all others' on a gyro, for each channel that has one.

    |l_r − m| > FARTHER · max |l_j − m|,   l the median of y − u at rest, m that of the other power-ons' j ≠ r
    """
    if table.gyro is None or table.ref_rate is None:
        return []
    off = table.gyro - table.ref_rate
    rests = kept & (np.linalg.norm(table.ref_rate, axis=1) < LEAST_RATE) & np.isfinite(off).all(axis=1)
    runs, count = np.unique(table.run[rests], return_counts=True)
    runs = runs[count >= LEAST_ROWS]
    if len(runs) < LEAST_RUNS:
        return []
    levels = np.array([np.median(off[rests & (table.run == r)], axis=0) for r in runs.tolist()])
    found = []
    for axis in range(3):
        far = int(np.argmax(np.abs(levels[:, axis] - np.median(levels[:, axis]))))
        others = np.delete(levels[:, axis], far)
        middle = float(np.median(others))
        reach = max(float(np.abs(others - middle).max()), LEAST_LEVEL / FARTHER)
        if abs(levels[far, axis] - middle) > FARTHER * reach:
            found.append(NoReading("gyro", axis, kept & (table.run == runs[far]), False))
    return found


def with_their_power_ons(
    table: DwellTable, kept: NDArray[np.bool_], found: Sequence[NoReading]
) -> list[NoReading]:
    """The same, with all rows of a power-on in which a channel is off wherever it has an input.

    A channel in m/s² reads 9.8 times its bias where it has none: left in, that was a run-to-run of 200 mg.
    """
    return [one if one.stuck else replace(one, rows=_whole(table, kept, one)) for one in found]


def _whole(table: DwellTable, kept: NDArray[np.bool_], one: NoReading) -> NDArray[np.bool_]:
    """(n,) its rows, with the others of such power-ons."""
    u = table.ref_rate if one.sensor == "gyro" else table.ref_acc
    if u is None:
        return one.rows
    size = np.linalg.norm(u, axis=1)
    least = LEAST_RATE if one.sensor == "gyro" else 0.0
    tells = kept & (np.abs(u[:, one.axis]) >= HALF * size) & (size > 0.0) & (size >= least)
    rows = one.rows.copy()
    for run in np.unique(table.run[one.rows]).tolist():
        mine = table.run == run
        telling = np.count_nonzero(mine & tells)
        if telling >= LEAST_ROWS and np.count_nonzero(mine & tells & one.rows) >= MOST_OF * telling:
            rows |= mine & kept
    return rows
