"""Power-ons whose days or times are not those of their records: by their order.

A campaign numbers its power-ons as they come. Where all but one or two of many are in the order of the
moments at which they were switched on, day − time since power-on where the day is that of the record, those
have the day or the time of another.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array
from planner.nouns.dwell_table import DwellTable

LEAST_RUNS = 12  # power-ons for each mistake, which say in which order they are numbered
MOST = 2  # out of their order: two that changed places; more are numbered in another way
SECONDS = 86400.0
SAME_MOMENT = 5.0  # s, by which the records of one power-on may differ about when it was switched on
MOVES = 60.0  # s of days within a power-on, from which the days are those of its records


@dataclass(frozen=True)
class OutOfOrder:
    """Power-ons that are not where their numbers say. what: `day` or `time since power-on`"""

    runs: tuple[int, ...]
    what: str


def out_of_order(table: DwellTable) -> OutOfOrder | None:
    """The one or two power-ons that are not in the order of their numbers; None where that is no order."""
    if {"run", "day"} & set(table.absent):
        return None
    runs, starts = by_run(table)
    if len(runs) < LEAST_RUNS:
        return None
    order = np.lexsort((table.time_on, table.run))
    day = np.minimum.reduceat(table.day[order], starts)
    found = _astray(day)
    if _few(found, runs):
        return OutOfOrder(tuple(int(runs[i]) for i in found), "day")
    if len(found) or not _days_are_of_records(table, order, starts):
        return None
    switched_on = np.minimum.reduceat((table.day - table.time_on / SECONDS)[order], starts)
    found = _astray(switched_on + SAME_MOMENT / SECONDS * np.arange(len(runs)) / len(runs))
    if _few(found, runs):
        return OutOfOrder(tuple(int(runs[i]) for i in found), "time since power-on")
    return None


def _few(found: Sequence[int], runs: NDArray[np.int64]) -> bool:
    """Whether places out of order are mistakes among many; neighbours that changed places are one mistake."""
    mistakes = 1 if len(found) == MOST and found[1] - found[0] == 1 else len(found)
    return 0 < len(found) <= MOST and len(runs) >= LEAST_RUNS * mistakes


def by_run(table: DwellTable) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Numbers of the power-ons, and the first of the sorted rows of each."""
    runs, count = np.unique(table.run, return_counts=True)
    return runs, np.concatenate([[0], np.cumsum(count)[:-1]]).astype(np.int64)


def _days_are_of_records(table: DwellTable, order: NDArray[np.int64], starts: NDArray[np.int64]) -> bool:
    """Whether days run on within power-ons as the times do."""
    day, t = table.day[order], table.time_on[order]
    ran = np.maximum.reduceat(day, starts) - np.minimum.reduceat(day, starts)
    moment = day - t / SECONDS
    apart = np.maximum.reduceat(moment, starts) - np.minimum.reduceat(moment, starts)
    return bool(np.max(ran) * SECONDS > MOVES and np.all(apart * SECONDS < SAME_MOMENT))


def _astray(values: Array) -> list[int]:
    """Places outside the longest run of values that do not fall (patience sorting); of two swapped both."""
    ends: list[float] = []
    last: list[int] = []
    before = [-1] * len(values)
    for i, v in enumerate(values.tolist()):
        k = bisect_right(ends, v)
        before[i] = last[k - 1] if k else -1
        ends[k : k + 1], last[k : k + 1] = [v], [i]
    kept = set(_chain(before, last[-1]))
    out = [i for i in range(len(values)) if i not in kept]
    return _swapped(values, out[0]) if len(out) == 1 else out


def _chain(before: list[int], i: int) -> Iterator[int]:
    while i >= 0:
        yield i
        i = before[i]


def _swapped(values: Array, i: int) -> list[int]:
    """A value and the neighbour with which it changed places, where that is what happened."""
    for j in (i - 1, i + 1):
        if 0 <= j < len(values):
            turned = values.copy()
            turned[[i, j]] = turned[[j, i]]
            if np.all(np.diff(turned) >= 0.0):
                return sorted((i, j))
    return [i]
