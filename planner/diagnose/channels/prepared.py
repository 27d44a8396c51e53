"""One unit's dwell table → rows fit for judging: run by run, none twice, with references, not too many."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.calibrate.reference_table import with_references
from planner.dwells.table_rows import alike, by_run, rows_of
from planner.nouns.array import Array
from planner.nouns.dwell_table import DwellTable
from planner.spec.model import Unit
from planner.units import STANDARD_GRAVITY_MPS2

WHOLE = 30_000  # rows that are judged as they are, in some 1.5 GB; of tables up to half as long again
MOST_ROWS = 8_000  # of larger ones; six channels with all candidates then take 400 MB
ONE_WAY_UP = 0.9995  # cosine, 2 deg: rows whose accelerometers agree to that have one attitude
A_LEVEL = 0.3 / 60.0  # K/s, 0.3 K/min: chambers hold a ramp to that
LEAST_OF_MANY = 60  # power-ons that stay when not all are judged
ROUNDED = 1e-12  # of the largest input, what sines of whole half turns leave of none
FINE = 0.9  # distinct values of a channel a distinct row, from which equal readings are copies
ONE_G = 0.05  # share of g within which a mean reading at rest is gravity alone
FEW_WAYS = 10  # rows a way, below which the accelerometers cannot be their own reference


@dataclass(frozen=True)
class Prepared:
    """table: rows run by run; starts: (g,) first row of every run; where: (N,) row of each full row or −1

    full: the table as it came, with references; once: its rows without those that are another one again
    sensors: those that can be judged; notes: sentences
    attitude: (N,) number of each full row's attitude when the accelerometers are their own reference
    unit: what the spec says of the sensors, if there is one
    """

    table: DwellTable
    starts: NDArray[np.int64]
    full: DwellTable
    once: NDArray[np.int64]
    where: NDArray[np.int64]
    sensors: tuple[str, ...]
    notes: tuple[str, ...]
    attitude: NDArray[np.int64] | None = None
    unit: Unit | None = None

    def attitudes(self) -> tuple[Array, Array]:
        """(n, k) and (N, k) indicators of the attitudes, whose means are unseen; k = 0 with a reference."""
        if self.attitude is None:
            return np.empty((len(self.table), 0)), np.empty((len(self.full), 0))
        mine = np.zeros(len(self.table), dtype=np.int64)
        mine[self.where[self.where >= 0]] = self.attitude[self.where >= 0]
        every = np.eye(self.attitude.max() + 1)
        return every[mine], every[self.attitude]


def prepared(table: DwellTable, unit: Unit | None = None) -> Prepared:
    """What the diagnosis works on. Raises InputError when nothing can be made of the accelerometers."""
    full, sensors, notes, attitude = referenced(table)
    kept, again = _once(full)
    if len(kept) < len(full):
        notes.append(f"{len(full) - len(kept)} rows are the same as others and count once")
    table, where = full if len(kept) == len(full) else rows_of(full, kept), again
    most = WHOLE if len(table) <= 1.5 * WHOLE else MOST_ROWS
    block = _blocks(table, most)
    if block.max(initial=0) + 1 < len(table):
        notes.append(f"{len(table)} rows averaged to {block.max() + 1} of one condition in a run each")
        table, where = _averaged(table, block), block[where]
    chosen = _some_runs(table, most)
    if len(chosen) < len(table):
        runs = len(np.unique(table.run[chosen])), len(np.unique(table.run))
        notes.append(
            f"{runs[0]} of {runs[1]} power-ons are judged, evenly chosen; more tell no other verdict"
        )
        place = np.full(len(table), -1)
        place[chosen] = np.arange(len(chosen))
        table, where = rows_of(table, chosen), place[where]
    order = np.lexsort((table.time_on, table.run))
    ordered, starts = by_run(table)
    where = np.where(where >= 0, np.argsort(order)[where], -1)
    return Prepared(ordered, starts, full, kept, where, sensors, tuple(notes), attitude, unit)


def _without_rounding(table: DwellTable) -> DwellTable:
    """References where rounding of nothing is nothing: a lean of 1e15 deg made readings of 1e-17 g."""
    return replace(table, ref_rate=_rounded(table.ref_rate), ref_acc=_rounded(table.ref_acc))


def _rounded(u: Array | None) -> Array | None:
    if u is None:
        return None
    rounding = (u != 0.0) & (np.abs(u) <= ROUNDED * np.abs(u).max(initial=0.0))
    return np.where(rounding, 0.0, u) if rounding.any() else u


def _ramps_levelled(table: DwellTable) -> DwellTable:
    """Rates of temperature that stand at a few levels are taken as these: the readings of them are noisy.

    Within a power-on a sensitive sensor would otherwise say that it does not follow the noise, and deny the
    effect. A rate that changes all the time stays as it was read.
    """
    rate = table.temperature_rate
    order = np.argsort(rate)
    cluster = np.cumsum(np.diff(rate[order], prepend=rate[order[:1]]) > A_LEVEL)
    firsts = np.flatnonzero(np.diff(cluster, prepend=-1))
    ends = np.append(firsts[1:], len(rate)) - 1
    if len(rate) == 0 or np.any(rate[order][ends] - rate[order][firsts] > 2.0 * A_LEVEL):
        return table
    levelled = np.empty_like(rate)
    middles = [float(np.median(part)) for part in np.split(rate[order], firsts[1:])]
    levelled[order] = np.array(middles)[cluster - cluster[0]]
    return replace(table, temperature_rate=levelled)


def referenced(
    table: DwellTable,
) -> tuple[DwellTable, tuple[str, ...], list[str], NDArray[np.int64] | None]:
    """The table with references and levelled ramps, the sensors that can be judged, notes, attitudes."""
    table, notes = _ramps_levelled(_without_rounding(table)), list[str]()
    sensors = [s for s, y in (("gyro", table.gyro), ("accelerometer", table.acc)) if y is not None]
    if table.ref_acc is not None or table.acc is None:
        full = with_references(table)
        if full.ref_acc is None and "accelerometer" in sensors:
            sensors.remove("accelerometer")
        return full, tuple(sensors), notes, None
    way = _ways_up(table, table.acc)
    if way.max() + 1 <= len(table) / FEW_WAYS:
        notes.append(
            f"no ref_acc: each of the {way.max() + 1} attitudes is taken as constant, |f| = g along the mean "
            "reading; what is common to all rows of an attitude cannot be seen"
        )
        full = with_references(replace(table, ref_acc=_mean_directions(table.acc, way)))
        return full, tuple(sensors), notes, way
    notes.append("no ref_acc: the calibrated accelerometers are the reference and cannot be judged by it")
    sensors.remove("accelerometer")
    return with_references(table), tuple(sensors), notes, None


def _ways_up(table: DwellTable, acc: Array) -> NDArray[np.int64]:
    """(n,) number of the attitude: rows whose readings have one direction, and one size on a centrifuge.

    Rows that follow each other without a jump have one attitude however far a reading drifts meanwhile.
    """
    order = np.lexsort((table.time_on, table.run))
    y = acc[order]
    size = np.maximum(np.linalg.norm(y, axis=1), 1e-300)
    direction = y / size[:, None]
    near = np.sum(direction[1:] * direction[:-1], axis=1) > ONE_WAY_UP
    near &= np.abs(size[1:] / size[:-1] - 1.0) < ONE_G
    stay = np.concatenate([[0], np.cumsum(~(near & (np.diff(table.run[order]) == 0)))])
    counts = np.bincount(stay)
    means = np.array([np.bincount(stay, y[:, k]) for k in range(3)]).T / counts[:, None]
    way = np.empty(len(acc), dtype=np.int64)
    way[order] = _alike(means, len(acc) // FEW_WAYS)[stay]
    return way


def _alike(means: Array, most: int) -> NDArray[np.int64]:
    """(m,) clusters of mean readings of one direction and size; each its own beyond `most` clusters."""
    size = np.maximum(np.linalg.norm(means, axis=1), 1e-300)
    direction = means / size[:, None]
    way = np.full(len(means), -1, dtype=np.int64)
    count = 0
    while (way < 0).any() and count <= most:
        first = int(np.argmax(way < 0))
        alike = np.abs(size / size[first] - 1.0) < ONE_G
        way[(way < 0) & alike & (direction @ direction[first] > ONE_WAY_UP)] = count
        count += 1
    way[way < 0] = np.arange(count, count + int((way < 0).sum()))
    return way


def _mean_directions(acc: Array, way: NDArray[np.int64]) -> Array:
    """(n, 3) mean reading of each attitude, of size g where it is near; a centrifuge's stays as it reads."""
    means = np.array([np.bincount(way, acc[:, k]) for k in range(3)]).T / np.bincount(way)[:, None]
    size = np.maximum(np.linalg.norm(means, axis=1), 1e-300)
    near = np.abs(size / STANDARD_GRAVITY_MPS2 - 1.0) < ONE_G
    return np.asarray((means * np.where(near, STANDARD_GRAVITY_MPS2 / size, 1.0)[:, None])[way])


def _once(table: DwellTable) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Rows whose readings are not those of an earlier one; which of them each row is.

    Coarse readings of many rows are the same by chance: there run and time must be the same too.
    """
    readings = np.column_stack([y for y in (table.gyro, table.acc) if y is not None])
    rows = np.column_stack([readings, table.temperature_degc])
    first, again = alike(rows)
    if not any(len(np.unique(y)) >= FINE * len(first) for y in readings.T):
        first, again = alike(np.column_stack([rows, table.run, table.time_on]))
    kept = np.sort(first)
    return kept, np.argsort(np.argsort(first))[again]


def _blocks(table: DwellTable, most: int) -> NDArray[np.int64]:
    """(n,) block of every row: neighbours in time among the rows of one run with one reference, to 1e-3."""
    if len(table) <= most:
        return np.arange(len(table))
    size = -(-len(table) // most)
    levels = [
        np.round(reference / (1e-3 * max(float(np.abs(reference).max()), 1e-9)))
        for reference in (table.ref_rate, table.ref_acc)
        if reference is not None
    ]
    condition = alike(np.column_stack([table.run, *levels]))[1]
    order = np.lexsort((table.time_on, condition))
    first = np.flatnonzero(np.diff(condition[order], prepend=-1))
    rank = np.arange(len(table)) - np.repeat(first, np.diff(np.append(first, len(table))))
    new = rank % size == 0
    block = np.empty(len(table), dtype=np.int64)
    block[order] = np.cumsum(new) - 1
    return block


def _some_runs(table: DwellTable, most: int) -> NDArray[np.int64]:
    """Rows of evenly chosen power-ons, about so many at most; all where these are no more or of few runs."""
    runs = np.unique(table.run)
    keep = max(LEAST_OF_MANY, int(len(runs) * most / len(table)))
    if len(table) <= 1.5 * most or keep >= len(runs):
        return np.arange(len(table))
    chosen = runs[np.unique(np.linspace(0, len(runs) - 1, keep).round().astype(int))]
    return np.flatnonzero(np.isin(table.run, chosen))


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
