"""A raw recording as samples in SI and body axes, block by block, with an account of what is missing."""

from __future__ import annotations

import difflib
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner import catalog
from planner.errors import InputError
from planner.nouns.array import Array
from planner.protocols import RawBlock, RawReader
from planner.recordings.column_map import (
    AXES,
    AxisColumns,
    ColumnMap,
    constant,
    factor,
    standard_map,
    unsigned,
)
from planner.units import ZERO_CELSIUS_K

HEAD_BYTES = 8192
READ = "read"  # the count of samples that came through
STANDARD_TRIADS = ("gyro_{}_dps", "acc_{}_g", "ref_rate_{}_dps", "ref_acc_{}_g")
DWELL_NAMES = ("run", "duration_s")  # of a table that is reduced already
STANDARD_SINGLES = ("time_s", "temp_degc", "step")
CHANNELS = tuple(f"{sensor}_{axis}" for sensor in ("gyro", "acc") for axis in AXES)


@dataclass(frozen=True)
class Samples:
    """n consecutive samples.

    time: (n,) s since the first sample of the recording; values: (n, 6) gyros rad/s, accelerometers m/s^2,
    NaN for a sensor that the recording lacks; temperature_degc: (n,), NaN where absent
    reference: (n, 6) or None; label: (n,) names of the plan's steps or None; good: (n,) what may be used
    spike: (n,) what is left out for a spike
    """

    time: Array
    values: Array
    temperature_degc: Array
    reference: Array | None
    label: NDArray[np.str_] | None
    good: NDArray[np.bool_]
    spike: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.time)

    def __getitem__(self, rows: slice | NDArray[np.bool_]) -> Samples:
        columns: list[Any] = [None if a is None else a[rows] for a in vars(self).values()]
        return Samples(*columns)


def joined(parts: Sequence[Samples]) -> Samples:
    """Samples one behind the other."""
    together = zip(*(vars(part).values() for part in parts), strict=True)
    columns: list[Any] = [None if c[0] is None else np.concatenate(c) for c in together]
    return Samples(*columns)


@dataclass
class Account:
    """What happened to the samples of a recording: reason -> number; remarks: sentences with places.

    repeats: samples that are the one before to the last digit, which stay
    """

    counts: Counter[str] = field(default_factory=Counter)
    repeats: int = 0
    remarks: list[str] = field(default_factory=list)

    def note(self, remark: str, most: int = 5) -> None:
        """Keep a remark, the first few only; the counts tell the rest."""
        if len(self.remarks) < most and remark not in self.remarks:
            self.remarks.append(remark)


def reader_of(path: Path, name: str | None = None) -> RawReader:
    """The reader for a file, by name or by what the file holds. Raises InputError when none fits."""
    readers = catalog.readers()
    if name is not None:
        if name not in readers:
            raise InputError(f"no reader is called {name!r}; there are {', '.join(readers)}")
        return readers[name]
    try:
        with path.open("rb") as file:
            head = file.read(HEAD_BYTES)
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror}") from error
    if not head:
        raise InputError(f"{path} is empty")
    for reader in sorted(readers.values(), key=lambda r: r.name == "text"):  # text takes what is left
        if reader.recognises(path, head):
            return reader
    broken = "".join(f"; {one}" for one in catalog.unloadable("readers"))
    raise InputError(f"{path} is of no format that can be read; there are {', '.join(readers)}{broken}")


class Recording:
    """One file with its map: `samples()` reads it again from the start every time it is asked."""

    def __init__(self, path: Path, columns: ColumnMap | None = None) -> None:
        self.path = path
        self.reader = reader_of(path, columns.format if columns else None)
        self.names = self.reader.names(path, columns.skip_lines if columns else 0)
        if columns is None and set(DWELL_NAMES) <= set(self.names):
            raise InputError(_which(path, self.names))
        if columns is None:
            _refuse_near_misses(path, self.names)
        found = columns or standard_map(self.names)
        if found is None:
            raise InputError(_which(path, self.names))
        self.columns = found
        self._sources = _sources(path, found, self.names)

    def samples(self, account: Account | None = None) -> Iterator[Samples]:
        """The samples in blocks; what is missing goes to the account.

        Raises InputError when time runs back for good, or the recording is empty.
        """
        account = account or Account()
        texts = [self.name(self.columns.step)] if self.columns.step is not None else []
        time = self.columns.time
        clock = _Clock(self.path, self.columns, self.name(time.column) if time else "", account)
        rows, last = 0, np.zeros((0, 6))
        for block in self.reader.blocks(self.path, self._sources, texts, self.columns.skip_lines):
            account.counts.update(block.losses)
            for remark in block.remarks:
                account.note(remark)
            samples = clock.timed(block, self._samples(block))
            rows += len(samples)
            last = _count_repeats(last, samples, account)
            yield _sound(samples, account)
        if not rows:
            raise InputError(f"{self.path} has no samples")
        account.counts[READ] += rows
        clock.close(rows)

    def name(self, source: str | int) -> str:
        """The column's name for a source of the map."""
        return _name(self.path, source, self.names)

    def _samples(self, block: RawBlock) -> Samples:
        n, columns = len(block.sample), self.columns
        nothing = np.full((n, 3), np.nan)
        gyro, acc = (self._triad(part, block) for part in (columns.gyro, columns.acc))
        rate, force = (self._triad(part, block) for part in (columns.ref_rate, columns.ref_acc))
        known = rate is not None or force is not None
        both = [nothing if part is None else part for part in (rate, force)]
        return Samples(
            time=np.zeros(n),
            values=np.hstack([nothing if part is None else part for part in (gyro, acc)]),
            temperature_degc=self._temperature(block),
            reference=np.hstack(both) if known else None,
            label=None if columns.step is None else block.columns[self.name(columns.step)].astype(np.str_),
            good=np.ones(n, dtype=bool),
            spike=np.zeros(n, dtype=bool),
        )

    def _triad(self, part: AxisColumns | None, block: RawBlock) -> Array | None:
        if part is None:
            return None
        axes = []
        for axis in AXES:
            source = getattr(part, axis)
            fixed = constant(source, part.unit)
            if fixed is not None:
                axes.append(np.full(len(block.sample), fixed))
                continue
            sign, column = unsigned(source)
            axes.append(block.columns[self.name(column)] * (sign * part.scale * factor(part.unit)))
        return np.column_stack(axes)

    def _temperature(self, block: RawBlock) -> Array:
        part = self.columns.temperature
        if part is None:
            return np.full(len(block.sample), np.nan)
        sign, column = unsigned(part.column)
        value = block.columns[self.name(column)] * (sign * part.scale) + part.offset
        return value - ZERO_CELSIUS_K if part.unit == "K" else value


def _which(path: Path, names: tuple[str, ...]) -> str:
    if set(DWELL_NAMES) <= set(names):
        return f"{path} is a dwell table already; `planner calibrate` and `planner diagnose` take it"
    like = "gyro: {x: …, y: …, z: …, unit: deg/s}"
    return f"{path}: say with --columns which column is what, as in `{like}`; it has {', '.join(names[:30])}"


def _refuse_near_misses(path: Path, names: tuple[str, ...]) -> None:
    """Without a map a column that is nearly one of ours, or a triad without an axis, would be lost."""
    known = [pattern.format(axis) for pattern in STANDARD_TRIADS for axis in AXES] + list(STANDARD_SINGLES)
    for pattern in STANDARD_TRIADS:
        columns = [pattern.format(axis) for axis in AXES]
        missing = [name for name in columns if name not in names]
        if 0 < len(missing) < len(AXES):
            raise InputError(f"{path} has no column {missing[0]!r} beside its other axes")
    for name in names:
        near = difflib.get_close_matches(name, [k for k in known if k not in names], 1, 0.8)
        if name not in known and near:
            raise InputError(
                f"{path}: column {name!r} is nearly {near[0]!r}: is it that? Else give a map with --columns"
            )


def _sources(path: Path, columns: ColumnMap, names: tuple[str, ...]) -> list[str]:
    """Names of the columns that the map needs. Raises InputError for those that the file lacks."""
    wanted: list[str | int] = [] if columns.step is None else [columns.step]
    wanted += [part.column for part in (columns.time, columns.temperature) if part is not None]
    for part in (columns.gyro, columns.acc, columns.ref_rate, columns.ref_acc):
        if part is not None:
            axes = [getattr(part, axis) for axis in AXES]
            wanted += [source for source in axes if constant(source, part.unit) is None]
    found = list(dict.fromkeys(_name(path, source, names) for source in wanted))
    doubled = [name for name in found if names.count(name) > 1]
    if doubled:
        raise InputError(f"{path}: column {doubled[0]!r} stands more than once in the header")
    return found


def _name(path: Path, source: str | int, names: tuple[str, ...]) -> str:
    from planner.spec.places import did_you_mean

    _, column = unsigned(source)
    if isinstance(column, int):
        if not 1 <= column <= len(names):
            raise InputError(f"{path} has {len(names)} columns; the map asks for number {column}")
        return names[column - 1]
    if column not in names:
        raise InputError(f"{path} has no column {column!r}{did_you_mean(column, names)}")
    return column


def _sound(samples: Samples, account: Account) -> Samples:
    """Marks samples that are no numbers, and padding: every sensor exactly zero."""
    used = samples.values[:, ~np.isnan(samples.values).all(axis=0)]
    broken = ~np.isfinite(used).all(axis=1)
    padding = ~broken & ~used.any(axis=1) if used.shape[1] >= 3 else np.zeros(len(samples), dtype=bool)
    account.counts.update({"not_finite": int(broken.sum())} if broken.any() else {})
    account.counts.update({"zero_padding": int(padding.sum())} if padding.any() else {})
    return replace(samples, good=samples.good & ~broken & ~padding)


def _count_repeats(last: Array, samples: Samples, account: Account) -> Array:
    """Counts samples that are the one before to the last digit; returns the last sample, (1, 6)."""
    values = np.vstack([last, samples.values])
    if len(values) < 2:
        return values
    used = ~np.isnan(values).all(axis=0)
    same = (values[1:, used] == values[:-1, used]).all(axis=1) & values[1:, used].any(axis=1)
    account.repeats += int(same.sum()) if used.sum() >= 3 else 0
    return values[-1:]


class _Clock:
    """Time of the samples: from the column, or from the rate and the number of each sample."""

    def __init__(self, path: Path, columns: ColumnMap, column: str, account: Account) -> None:
        self.path, self.columns, self.column, self.account = path, columns, column, account
        self.start: float | None = None
        self.last = -np.inf
        self.dropped = 0

    def timed(self, block: RawBlock, samples: Samples) -> Samples:
        """The samples with their times; those whose time does not rise are left out and counted."""
        part = self.columns.time
        if part is None:
            assert self.columns.rate is not None  # the map was checked
            return replace(samples, time=block.sample / self.columns.rate)
        raw = block.columns[self.column]
        time = (raw * part.scale + part.offset) * factor(part.unit)
        finite = np.isfinite(time)
        if self.start is None and finite.any():
            self.start = float(time[finite][0])
        time = time - (self.start or 0.0)
        before = np.maximum.accumulate(np.concatenate([[self.last], np.where(finite, time, -np.inf)]))[:-1]
        rises = finite & (time > before)
        if not rises.all():
            first = int(np.flatnonzero(~rises)[0])
            self.dropped += int((~rises).sum())
            self.account.counts["time_not_rising"] += int((~rises).sum())
            self.account.note(f"time does not rise at sample {int(block.sample[first]) + 1}")
        self.last = max(self.last, float(np.max(time, where=finite, initial=-np.inf)))
        return replace(samples, time=time)[rises]

    def close(self, rows: int) -> None:
        """Raises InputError when so much ran back that the clock must have been set, or files joined."""
        if self.dropped > 0.01 * (rows + self.dropped) + 2:
            raise InputError(
                f"{self.path}: time does not rise in {self.dropped} of {rows + self.dropped} samples "
                f"({'; '.join(self.account.remarks[:1])}); was the clock set, or were recordings joined?"
            )
