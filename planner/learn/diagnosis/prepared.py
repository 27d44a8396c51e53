"""One unit's dwell table → rows fit for judging: run by run, none twice, with references, not too many."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.learn.reference_table import with_references
from planner.learn.table_rows import by_run, rows_of
from planner.measured import DwellTable
from planner.records import Array
from planner.units import STANDARD_GRAVITY_MPS2

MOST_ROWS = 30_000  # more tell no other verdict, they are averaged in place
ONE_WAY_UP = 0.9995  # cosine, 2 deg: rows whose accelerometers agree to that have one attitude
FEW_WAYS = 10  # rows a way, below which the accelerometers cannot be their own reference


@dataclass(frozen=True)
class Prepared:
    """table: rows run by run; starts: (g,) first row of every run; where: which row each of the full table is

    full: the table as it came, with references; sensors: those that can be judged; notes: sentences
    """

    table: DwellTable
    starts: NDArray[np.int64]
    full: DwellTable
    where: NDArray[np.int64]
    sensors: tuple[str, ...]
    notes: tuple[str, ...]


def prepared(table: DwellTable) -> Prepared:
    """What the diagnosis works on. Raises InputError when nothing can be made of the accelerometers."""
    full, sensors, notes = _referenced(table)
    kept, again = _once(full)
    if len(kept) < len(full):
        notes.append(f"{len(full) - len(kept)} rows are the same as others and count once")
    once = rows_of(full, kept)
    order = np.lexsort((once.time_on, once.run))
    ordered, starts = by_run(once)
    where = np.argsort(order)[again]
    block = _blocks(ordered, starts)
    if block.max(initial=0) + 1 < len(ordered):
        notes.append(f"{len(ordered)} rows averaged to {block.max() + 1} of neighbours under one condition")
        ordered, starts = by_run(_averaged(ordered, block))
        where = block[where]
    return Prepared(ordered, starts, full, where, sensors, tuple(notes))


def _referenced(table: DwellTable) -> tuple[DwellTable, tuple[str, ...], list[str]]:
    notes: list[str] = []
    sensors = [s for s, y in (("gyro", table.gyro), ("accelerometer", table.acc)) if y is not None]
    if table.ref_acc is not None or table.acc is None:
        full = with_references(table)
        if full.ref_acc is None and "accelerometer" in sensors:
            sensors.remove("accelerometer")
        return full, tuple(sensors), notes
    way = _ways_up(table.acc)
    if way.max() + 1 <= len(table) / FEW_WAYS:
        notes.append(
            f"no ref_acc: each of the {way.max() + 1} attitudes is taken as constant, |f| = g along the mean "
            "reading; what is common to all rows of an attitude cannot be seen"
        )
        return (
            with_references(replace(table, ref_acc=_mean_directions(table.acc, way))),
            tuple(sensors),
            notes,
        )
    notes.append("no ref_acc: the calibrated accelerometers are the reference and cannot be judged by it")
    sensors.remove("accelerometer")
    return with_references(table), tuple(sensors), notes


def _ways_up(acc: Array) -> NDArray[np.int64]:
    """(n,) number of the attitude: rows whose readings have one direction."""
    direction = acc / np.maximum(np.linalg.norm(acc, axis=1, keepdims=True), 1e-300)
    way = np.full(len(acc), -1, dtype=np.int64)
    count = 0
    while (way < 0).any() and count <= len(acc) / FEW_WAYS:
        first = int(np.argmax(way < 0))
        way[(way < 0) & (direction @ direction[first] > ONE_WAY_UP)] = count
        count += 1
    way[way < 0] = np.arange(count, count + int((way < 0).sum()))
    return way


def _mean_directions(acc: Array, way: NDArray[np.int64]) -> Array:
    sums = np.array([np.bincount(way, acc[:, k]) for k in range(3)]).T
    unit = sums / np.maximum(np.linalg.norm(sums, axis=1, keepdims=True), 1e-300)
    return np.asarray(STANDARD_GRAVITY_MPS2 * unit[way])


def _once(table: DwellTable) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Rows that are not the same as an earlier one in run, time and readings; which of them each row is."""
    parts = [table.run, table.time_on]
    parts += [y[:, k] for y in (table.gyro, table.acc) if y is not None for k in range(3)]
    _, first, again = np.unique(np.column_stack(parts), axis=0, return_index=True, return_inverse=True)
    kept = np.sort(first)
    return kept, np.argsort(np.argsort(first))[again.ravel()]


def _blocks(table: DwellTable, starts: NDArray[np.int64]) -> NDArray[np.int64]:
    """(n,) block of every row: neighbours in one run that share their references to a part in a thousand."""
    if len(table) <= MOST_ROWS:
        return np.arange(len(table))
    size = -(-len(table) // MOST_ROWS)
    changed = np.zeros(len(table), dtype=bool)
    changed[starts] = True
    for reference in (table.ref_rate, table.ref_acc):
        if reference is not None:
            level = np.round(reference / (1e-3 * max(float(np.abs(reference).max()), 1e-9)))
            changed[1:] |= np.any(np.diff(level, axis=0) != 0, axis=1)
    segment = np.cumsum(changed) - 1
    within = np.arange(len(table)) - np.flatnonzero(changed)[segment]
    new = changed | (within % size == 0)
    return np.asarray(np.cumsum(new) - 1)


def _averaged(table: DwellTable, block: NDArray[np.int64]) -> DwellTable:
    """Means over the blocks; a block lasts as long as its records together."""
    count = np.bincount(block).astype(float)
    first = np.unique(block, return_index=True)[1]

    def mean(x: Array) -> Array:
        if x.ndim == 2:
            return np.array([np.bincount(block, x[:, k]) / count for k in range(x.shape[1])]).T
        return np.asarray(np.bincount(block, x) / count)

    fields = ("day", "time_on", "temperature_degc", "temperature_rate", "ref_rate", "ref_acc", "gyro", "acc")
    averaged: dict[str, Any] = {
        name: mean(getattr(table, name)) for name in fields if getattr(table, name) is not None
    }
    duration = np.bincount(block, table.duration).astype(float)
    return replace(rows_of(table, first), duration=duration, **averaged)
