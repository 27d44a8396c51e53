"""What a gyro reads at each temperature whatever its rate, before any error model: its bias there.

Of the cheapest units it is 20 deg/s and another one at each temperature: beside a rate of 10 deg/s it looks
as if another axis had turned, and beside 50 as a reading that no error of a sensor explains. Rests say it
by themselves; without them a temperature where the unit turned both ways, by the median of both.
"""

from __future__ import annotations

import numpy as np

from planner.nouns.array import Array
from planner.nouns.dwell_table import DwellTable
from planner.temperature_table import GAP_K, temperature_nodes

REST = float(np.radians(1.0))  # rad/s
FEWEST = 3  # rows that say it
BALANCED = 0.2  # of the mean speed about an axis that the mean rate may be, where the unit turned both ways


def bias_of_temperatures(table: DwellTable) -> Array:
    """(n, 3) rad/s of every row's temperature; 0 where nothing says it."""
    found = np.zeros((len(table), 3))
    if table.gyro is None or table.ref_rate is None or not len(table):
        return found
    off = table.gyro - table.ref_rate
    nodes = temperature_nodes(table.temperature_degc)
    at = np.argmin(np.abs(table.temperature_degc[:, None] - nodes), axis=1)
    near = np.abs(table.temperature_degc - nodes[at]) <= GAP_K
    rests = np.linalg.norm(table.ref_rate, axis=1) < REST
    for k in range(len(nodes)):
        mine = near & (at == k)
        still = mine & rests
        says = still if np.count_nonzero(still) >= FEWEST else mine
        if np.count_nonzero(says) < FEWEST:
            continue
        mean, speed = (np.mean(x[says], axis=0) for x in (table.ref_rate, np.abs(table.ref_rate)))
        told = (np.abs(mean) <= BALANCED * speed) | (speed < REST)
        found[mine] = np.where(told, np.nanmedian(off[says], axis=0), 0.0)
    return np.nan_to_num(found)
