"""Rows of dwell tables: some of them, and run by run."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.nouns.dwell_table import DwellTable


def rows_of(table: DwellTable, keep: NDArray[Any]) -> DwellTable:
    """Some rows of a table: (n,) flags or indices."""
    cut: dict[str, Any] = {
        name: value[keep] for name, value in vars(table).items() if isinstance(value, np.ndarray)
    }
    return replace(table, **cut)


def by_run(table: DwellTable) -> tuple[DwellTable, NDArray[np.int64]]:
    """The table with the rows of a run together, in the order of time, and the first row of every run."""
    ordered = rows_of(table, np.lexsort((table.time_on, table.run)))
    starts = np.flatnonzero(np.append(True, np.diff(ordered.run) != 0))
    return ordered, starts.astype(np.int64)
