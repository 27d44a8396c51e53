"""What a gyro reads at each temperature whatever its rate, before any error model: its bias there.

Of the cheapest units it is 20 deg/s and another one at each temperature: beside a rate of 10 deg/s it looks
as if another axis had turned, and beside 50 as a reading that no error of a sensor explains. Rests say it
by themselves; without them a temperature where the unit turned both ways, by the median of both. Between
such temperatures, and where a ramp passes by, it goes from one to the next as a table over temperature does.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array
from planner.nouns.dwell_table import DwellTable
from planner.temperature_table import REACH_K, hats, temperature_nodes

REST = float(np.radians(1.0))  # rad/s
FEWEST = 3  # rows that say it
BALANCED = 0.2  # of the mean speed about an axis that the mean rate may be, where the unit turned both ways


def bias_of_temperatures(table: DwellTable) -> Array:
    """(n, 3) rad/s of every row's temperature; 0 where nothing says it.

        b(T) = Σ_k h_k(T) b_k,   b_k at the mean temperature of the rows that say it

    On a ramp a unit of 5 deg/s changes by 2 deg/s from one node to the next: rows between them, left at 0,
    read 13 deg/s "where the reference says 10".
    """
    found = np.zeros((len(table), 3))
    if table.gyro is None or table.ref_rate is None or not len(table):
        return found
    off, rate = table.gyro - table.ref_rate, table.ref_rate
    nodes = temperature_nodes(table.temperature_degc)
    at = np.argmin(np.abs(table.temperature_degc[:, None] - nodes), axis=1)
    rests = np.linalg.norm(rate, axis=1) < REST
    says = [rows for k in range(len(nodes)) if (rows := _saying(at == k, rests)) is not None]
    for axis in range(3):
        told = [rows for rows in says if _either_way(rate[rows, axis])]
        if told:
            where = np.array([np.mean(table.temperature_degc[rows]) for rows in told])
            values = np.array([np.nanmedian(off[rows, axis]) for rows in told])
            found[:, axis] = hats(table.temperature_degc, where, REACH_K) @ values
    return np.nan_to_num(found)


def _saying(mine: NDArray[np.bool_], rests: NDArray[np.bool_]) -> NDArray[np.int64] | None:
    """The rows of a temperature that say its bias: its rests if they are enough, else all; None: too few."""
    for rows in (np.flatnonzero(mine & rests), np.flatnonzero(mine)):
        if len(rows) >= FEWEST:
            return rows
    return None


def _either_way(rate: Array) -> bool:
    """Whether a rate (n,) about one axis was as much one way as the other, or none at all."""
    speed = float(np.mean(np.abs(rate)))
    return speed < REST or abs(float(np.mean(rate))) <= BALANCED * speed
