"""Which rows of a dwell table belong together: one unit at one temperature, or one unit on one visit."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array
from planner.nouns.dwell_table import DwellTable

APART_K = 3.0  # chambers hold ±2 °C, and the unit's own thermometer follows
APART_DAYS = 3.0  # a check lasts a day or two; checks follow each other by weeks


def by_temperature(table: DwellTable) -> NDArray[np.int64]:
    """(n,) number of the unit and temperature."""
    return _numbered(table, table.temperature_degc, APART_K)


def by_visit(table: DwellTable) -> NDArray[np.int64]:
    """(n,) number of the unit and visit: rows whose days follow each other closely."""
    return _numbered(table, table.day, APART_DAYS)


def _numbered(table: DwellTable, value: Array, apart: float) -> NDArray[np.int64]:
    """Groups of rows of a unit whose values, in order, are nowhere further apart."""
    order = np.lexsort((value, table.unit))
    new = (table.unit[order][1:] != table.unit[order][:-1]) | (np.diff(value[order]) > apart)
    numbers = np.empty(len(table), dtype=np.int64)
    numbers[order] = np.concatenate([[0], np.cumsum(new)])
    return numbers
