"""Rows of a table in the order of their power-ons, off the centrifuge, and what is asked of each channel."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.channels.prepared import LEAST_OF_MANY
from planner.diagnose.references.bench_directions import loaded
from planner.nouns.array import Array
from planner.nouns.dwell_table import DwellTable
from planner.temperature_table import hats, temperature_nodes

MOST_ROWS = 20_000  # of which another unit is asked; 1e6 take minutes and gigabytes


@dataclass(frozen=True)
class InOrder:
    """Rows off the centrifuge in the order of their power-ons. run: (n,) 0 … runs − 1, number: as read"""

    table: DwellTable
    order: NDArray[np.int64]
    run: NDArray[np.int64]
    number: NDArray[np.int64]

    @property
    def temperature(self) -> Array:
        """(n,) degC."""
        return self.table.temperature_degc[self.order]

    @property
    def weights(self) -> Array:
        """(n, nodes) straight lines over temperature."""
        return hats(self.temperature, temperature_nodes(self.temperature), 0.0)

    @property
    def sensors(self) -> Sequence[tuple[Array, Array]]:
        """Reading and reference (n, 3) of each sensor that has both."""
        t, found = self.table, []
        if t.gyro is not None and t.ref_rate is not None:
            found.append((t.gyro[self.order], t.ref_rate[self.order]))
        if t.acc is not None and t.ref_acc is not None:
            found.append((t.acc[self.order], t.ref_acc[self.order]))
        return found

    def means(self, x: Array) -> Array:
        """(runs, k) of columns (n, k)."""
        return np.array([np.bincount(self.run, c) for c in x.T]).T / np.bincount(self.run)[:, None]


def in_order(table: DwellTable, kept: NDArray[np.bool_]) -> InOrder:
    """The rows (n,) that are kept, of evenly chosen power-ons where they are many."""
    rows = np.flatnonzero(kept)
    rows = rows[
        ~loaded(table.conditions().at(rows))
    ]  # what is asked of these goes with them: the table stays
    rows = rows[_of_some_runs(table.run[rows])]
    order = rows[np.lexsort((table.time_on[rows], table.run[rows]))]
    number, run = np.unique(table.run[order], return_inverse=True)
    return InOrder(table, order, run, number)


def _of_some_runs(run: NDArray[np.int64]) -> NDArray[np.bool_]:
    """(n,) rows of evenly chosen power-ons, about MOST_ROWS: another unit shows in a few of them."""
    every = np.unique(run)
    keep = max(LEAST_OF_MANY, int(len(every) * MOST_ROWS / max(len(run), 1)))
    if keep >= len(every):
        return np.ones(len(run), dtype=bool)
    return np.isin(run, every[np.linspace(0, len(every) - 1, keep).round().astype(int)])


def that_stay(y: Array, u: Array, rows: InOrder, axis: int) -> Array:
    """(n, 3 + nodes) leans, the scale factor over temperature, and what the reading is beyond its input."""
    own = u[:, [axis]]
    return np.column_stack([np.delete(u, axis, axis=1), rows.weights * own, y[:, None] - own])
