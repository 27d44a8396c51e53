"""Rows of dwell tables: some of them, and run by run."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array
from planner.nouns.dwell_table import DwellTable

ONE_AXIS = 0.97  # share of all turning that lies about one axis: 14 deg apart at most
APART_S = 0.01  # pieces of one turn leave no time between them
MOTION = "motion"  # kind of the rows that are pieces of a hand turn


def rows_of(table: DwellTable, keep: NDArray[Any]) -> DwellTable:
    """Some rows of a table: (n,) flags or indices; the table itself where all of them stay."""
    if np.asarray(keep).dtype == np.bool_ and np.all(keep):
        return table
    cut: dict[str, Any] = {
        name: value[keep] for name, value in vars(table).items() if isinstance(value, np.ndarray)
    }
    return replace(table, **cut)


def alike(columns: Array) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """(m,) first row of every different row of columns (n, k), and (n,) which of those each row is.

    By a number made of the bits of a row, in a tenth of the time and memory of sorting rows; where two unlike
    rows have one number, by sorting rows after all.
    """
    bits = np.ascontiguousarray(columns + 0.0).view(np.uint64)  # −0 becomes 0
    odd = np.asarray(2 * np.random.default_rng(1).integers(1, 2**62, bits.shape[1]) + 1, dtype=np.uint64)
    number = np.zeros(len(bits), dtype=np.uint64)
    for k in range(bits.shape[1]):
        number = (number ^ bits[:, k]) * odd[k]
        number ^= number >> np.uint64(29)
    _, first, which = np.unique(number, return_index=True, return_inverse=True)
    if any(not np.array_equal(x[first][which], x) for x in columns.T):
        _, first, which = np.unique(columns, axis=0, return_index=True, return_inverse=True)
    return first.astype(np.int64), which.ravel().astype(np.int64)


def together(rests: DwellTable, motions: DwellTable) -> DwellTable:
    """Rests and motions of the same columns in one table, told apart by `kind`, in order of time.

    Notes and source are those of the rests.
    """
    joined: dict[str, Any] = {
        name: np.concatenate([value, getattr(motions, name)])
        for name, value in vars(rests).items()
        if isinstance(value, np.ndarray) and getattr(motions, name) is not None
    }
    joined["kind"] = np.repeat(["rest", MOTION], [len(rests), len(motions)])
    both = replace(rests, **joined)
    first = {unit: i for i, unit in reversed(list(enumerate(both.unit.tolist())))}
    place = np.array([first[unit] for unit in both.unit.tolist()])
    return rows_of(both, np.lexsort((both.time_on, both.run, place)))


def without_motions(table: DwellTable) -> DwellTable:
    """The table without the pieces of hand turns, which are no records at a known condition."""
    if table.kind is None or not (table.kind == MOTION).any():
        return table
    return rows_of(table, table.kind != MOTION)


def level(gyro: Array) -> Array:
    """(3,) what gyros (n, 3) read in the slowest quarter of the rows: their zero, roughly."""
    size = np.linalg.norm(gyro, axis=1)
    return np.asarray(np.median(gyro[size <= np.percentile(size, 25)], axis=0))


def whole_turns(table: DwellTable) -> DwellTable:
    """The pieces of each hand turn as one row: mean rate over the whole of it, gyro · duration = ∫ω dt.

    Only turns about one axis stay, whose other axes come to nothing in sum: of others no angle is known.
    """
    if table.kind is None or table.gyro is None or not (table.kind == MOTION).any():
        return without_motions(table)
    keep = np.asarray(table.kind != MOTION)
    zero = level(table.gyro[keep] if keep.any() else table.gyro)
    gyro, duration = table.gyro.copy(), table.duration.copy()
    ordered = np.lexsort((table.time_on, table.run, table.unit))
    moves, run, unit = ~keep[ordered], table.run[ordered], table.unit[ordered]
    half = table.duration[ordered] / 2.0
    apart = np.diff(table.time_on[ordered]) - half[1:] - half[:-1] > APART_S
    other = (run[1:] != run[:-1]) | (unit[1:] != unit[:-1]) | apart
    edges = np.flatnonzero((moves[1:] != moves[:-1]) | other) + 1
    for rows in np.split(ordered, edges):
        if keep[rows[0]]:
            continue
        angle = (table.gyro[rows] - zero) * table.duration[rows][:, None]
        whole, path = angle.sum(axis=0), float(np.linalg.norm(angle, axis=1).sum())
        first = rows[0]
        if np.abs(whole).max() > ONE_AXIS * path:
            keep[first], duration[first] = True, table.duration[rows].sum()
            gyro[first] = whole / duration[first] + zero
    return rows_of(replace(table, gyro=gyro, duration=duration), keep)


def by_run(table: DwellTable) -> tuple[DwellTable, NDArray[np.int64]]:
    """The table with the rows of a run together, in the order of time, and the first row of every run."""
    ordered = rows_of(table, np.lexsort((table.time_on, table.run)))
    starts = np.flatnonzero(np.append(True, np.diff(ordered.run) != 0))
    return ordered, starts.astype(np.int64)
