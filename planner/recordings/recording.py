"""A raw recording as samples in SI and body axes, block by block, with an account of what is missing."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from functools import cached_property
from pathlib import Path

import numpy as np

from planner.errors import InputError
from planner.nouns.array import Array
from planner.protocols import RawBlock
from planner.recordings.clocks import Clock, SampleClock, clock_of, evened
from planner.recordings.column_map import (
    AXES,
    AxisColumns,
    ColumnMap,
    PowerOns,
    UnitColumn,
    constant,
    factor,
    is_written_time,
    plain_unit,
    standard_map,
    unsigned,
)
from planner.recordings.followers import Follower, Source, sources_of
from planner.recordings.formats import reader_of
from planner.recordings.parts import Part, parts_of
from planner.recordings.samples import READ, Account, Samples
from planner.units import ZERO_CELSIUS_K

HELD_BYTES = 1 << 26  # of a file of several power-ons that stays in memory while they are read
STANDARD_TRIADS = ("gyro_{}_dps", "acc_{}_g", "ref_rate_{}_dps", "ref_acc_{}_g")
DWELL_NAMES = ("run", "duration_s")  # of a table that is reduced already
STANDARD_SINGLES = ("time_s", "temp_degc", "step")
AGAIN = " (column "  # what follows a name that stands in the header once more


def recordings_of(path: Path, columns: ColumnMap | None = None) -> list[Recording]:
    """The recordings of a file, one for every power-on that the map tells apart."""
    whole = Recording(path, columns)
    return [whole.of(part) for part in whole.parts()]


def other_files(path: Path, columns: ColumnMap | None) -> list[Path]:
    """The files that the map joins to a recording, apart from its own; none for one that is joined itself."""
    if columns is None:
        return []
    try:
        found = sources_of(path, columns)
    except InputError:  # said when the file is read, unless it is one that another one takes along
        return []
    return [source.path for source in found if source.path.resolve() != found[0].path.resolve()]


class Recording:
    """One power-on of a file with its map: `samples()` reads it from the start every time it is asked."""

    def __init__(self, path: Path, columns: ColumnMap | None = None, source: Source | None = None) -> None:
        sources = [source] if source else [] if columns is None else sources_of(path, columns)
        self.path = sources[0].path if sources else path
        self.others = sources[1:]
        self.stem = path.name if path.is_dir() else path.stem
        given = sources[0].columns if sources else None
        self.reader = reader_of(self.path, given.format if given else None)
        self.given = self.reader.names(self.path, given.skip_lines if given else 0)
        if given is None and set(DWELL_NAMES) <= set(self.given):
            raise InputError(_which(path, self.given))
        if given is None:
            _refuse_near_misses(path, self.given)
        found = given or standard_map(self.given)
        if found is None:
            raise InputError(_which(path, self.given))
        self.columns = found
        self.whole = found if columns is None else columns
        self._where = dict(sources[0].where) if sources else {}
        self.names = _names(self.path, found, self.given, self._where)
        self.part = Part({self.names[c]: text for c, text in self._where.items()})
        self._held: dict[tuple[str, ...], list[RawBlock]] = {}

    def parts(self) -> list[Part]:
        """The power-ons that the map tells apart. Raises InputError when the file cannot be read."""
        return parts_of(self.path, self.reader, self.columns, self.names, self.given)

    def of(self, part: Part) -> Recording:
        """The recording of one of its power-ons."""
        other = Recording.__new__(Recording)
        vars(other).update({k: v for k, v in vars(self).items() if k != "clock"})
        together = part.together and not self.part.where
        other.part = replace(part, where={**self.part.where, **part.where}, together=together)
        return other

    @property
    def unit(self) -> str:
        """The name of the inertial unit: the part's, the map's, or the file's."""
        if self.part.unit is not None:
            return self.part.unit
        return self.columns.unit if isinstance(self.columns.unit, str) else self.stem

    @property
    def has(self) -> tuple[bool, bool]:
        """Whether there are gyros, and accelerometers."""
        return self.whole.gyro is not None, self.whole.acc is not None

    @cached_property
    def clock(self) -> Clock | None:
        """The clock by the first samples; None where there is no column of times, or too few of them."""
        if self.columns.time is None:
            return None
        first = next(iter(self.samples()), None)
        return None if first is None else clock_of(first.time)

    def samples(self, account: Account | None = None) -> Iterator[Samples]:
        """The samples in blocks; what is missing goes to the account.

        Raises InputError when time runs back for good, or the recording is empty.
        """
        account = account or Account()
        followers = [self._follower(source, account) for source in self.others]
        rows, last = 0, np.zeros((0, 6))
        for start, samples in self._timed(account):
            for source, follower in zip(self.others, followers, strict=True):
                samples = _with(samples, follower.at(samples.time + start), source.keys)
            rows += len(samples)
            last = _count_repeats(last, samples, account, self._used)
            yield _sound(samples, account, self._used)
        if not rows:
            raise InputError(f"{self.path} has no samples{self._of_part()}")
        for follower in followers:
            follower.close(self.path)
            account.note(follower.remark)
        account.counts[READ] += rows

    def even_samples(self, account: Account | None = None) -> Iterator[Samples]:
        """The same; where the clock jitters, the means of equal steps."""
        clock = self.clock
        if clock is None or not clock.jitters:
            return self.samples(account)
        return self._evened(account or Account(), clock)

    def _evened(self, account: Account, clock: Clock) -> Iterator[Samples]:
        rows = 0
        for samples in evened(self.samples(account), clock.step):
            rows += len(samples)
            yield samples
        read = account.counts[READ]
        account.counts[READ] = rows
        low, high = account.steps
        account.note(
            f"the clock jitters: steps of {1e3 * low:.3g} to {1e3 * high:.0f} ms, usually "
            f"{1e3 * clock.usual:.3g}, deviation {1e3 * clock.deviation:.3g}; {read} samples are taken "
            f"together in {rows} steps of {1e3 * clock.step:.3g} ms"
        )

    def name(self, source: str | int) -> str:
        """The column's name for a source of the map."""
        return self.names[source]

    @property
    def _used(self) -> list[int]:
        gyro, acc = self.has
        return [*(range(3) if gyro else ()), *(range(3, 6) if acc else ())]

    def _of_part(self) -> str:
        said = ", ".join(f"{name} {text}" for name, text in self.part.where.items())
        return f" where {said}" if said else ""

    def _follower(self, source: Source, account: Account) -> Follower:
        other = Recording(source.path, self.whole, source)
        runs = self.columns.run
        if isinstance(runs, PowerOns) and runs.clock is not None and self.part.run is not None:
            parts = other.parts()
            number = self.part.run - runs.first
            if number >= len(parts):
                raise InputError(f"{source.path} has {len(parts)} power-ons, {self.path} more")
            other = other.of(parts[number])
        else:
            where = {
                n: t for n, t in self.part.where.items() if n in other.given and n not in self._where_names
            }
            alike = (part for part in other.parts() if dict(part.where) == where) if where else ()
            other = other.of(next(iter(alike), Part(where)))
        return Follower(other._timed(account), str(source.path))

    @property
    def _where_names(self) -> set[str]:
        return {self.names[c] for c in self._where}

    def _timed(self, account: Account) -> Iterator[tuple[float, Samples]]:
        """(start of the file's clock, samples of this file alone with times from that start)."""
        clock = SampleClock(self.path, self.columns, self.names, account)
        rows = 0
        texts = self._texts()
        wanted = list(dict.fromkeys([*self.names.values(), *self.part.where]))
        for block in self._blocks(wanted, texts):
            past = self.part.last is not None and len(block.sample) and block.sample[0] >= self.part.last
            if past:
                break
            mine = self._renumbered(self.part.taken(block), rows)
            account.counts.update(mine.losses)
            for remark in mine.remarks:
                account.note(remark)
            if len(mine.sample):
                samples = clock.timed(mine, self._samples(mine))
                rows += len(samples)
                yield clock.start or 0.0, samples
        clock.close(rows)

    def _blocks(self, wanted: list[str], texts: list[str]) -> Iterable[RawBlock]:
        """The file's blocks; those of a small file of many power-ons are held: each would read it anew."""
        if self.part == Part() or self.path.stat().st_size > HELD_BYTES:
            return self.reader.blocks(self.path, wanted, texts, self.columns.skip_lines)
        key = (*wanted, "", *texts)
        if key not in self._held:
            self._held[key] = list(self.reader.blocks(self.path, wanted, texts, self.columns.skip_lines))
        return self._held[key]

    def _renumbered(self, block: RawBlock, rows: int) -> RawBlock:
        """Of rows that a column tells apart the samples are counted on, without holes."""
        if not self.part.where or self.part.together:
            return block
        return replace(block, sample=np.arange(rows, rows + len(block.sample)))

    def _texts(self) -> list[str]:
        found = list(self.part.where)
        columns = self.columns
        found += [self.names[columns.step]] if columns.step is not None else []
        if columns.time is not None and is_written_time(columns.time.unit):
            found.append(self.names[columns.time.column])
        return found

    def _samples(self, block: RawBlock) -> Samples:
        n, columns = len(block.sample), self.columns
        nothing = np.full((n, 3), np.nan)
        gyro, acc = (self._triad(part, block) for part in (columns.gyro, columns.acc))
        rate, force = (self._triad(part, block) for part in (columns.ref_rate, columns.ref_acc))
        known = self.whole.ref_rate is not None or self.whole.ref_acc is not None
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
        """(n, 3) ± ((reading − zero) · scale + offset), SI."""
        if part is None:
            return None
        axes = []
        for i, axis in enumerate(AXES):
            source = getattr(part, axis)
            fixed = constant(source, part.unit)
            if fixed is not None:
                axes.append(np.full(len(block.sample), fixed))
                continue
            sign, _ = unsigned(source)
            reading = block.columns[self.name(source)]
            with np.errstate(over="ignore", invalid="ignore"):  # what is not finite is told as such
                value = (reading - part.zero[i]) * part.scales[i] + part.offset[i]
                axes.append(value * (sign * factor(part.unit)))
        return np.column_stack(axes)

    def _temperature(self, block: RawBlock) -> Array:
        part = self.columns.temperature
        if part is None:
            return np.full(len(block.sample), np.nan)
        sign, _ = unsigned(part.column)
        reading = block.columns[self.name(part.column)]
        with np.errstate(over="ignore", invalid="ignore"):
            value = (reading - part.zero) * (sign * part.scale) + part.offset
        unit = plain_unit(part.unit)
        return value - ZERO_CELSIUS_K if unit == "K" else (value - 32.0) / 1.8 if unit == "degF" else value


def _with(samples: Samples, other: Samples, keys: tuple[str, ...]) -> Samples:
    """The samples with what another file has of them."""
    values, reference = samples.values.copy(), samples.reference
    places = {"gyro": slice(0, 3), "acc": slice(3, 6), "ref_rate": slice(0, 3), "ref_acc": slice(3, 6)}
    good = samples.good.copy()
    for key in keys:
        if key in ("gyro", "acc"):
            values[:, places[key]] = other.values[:, places[key]]
            good &= other.good
        elif key in places and reference is not None and other.reference is not None:
            reference = reference.copy()
            reference[:, places[key]] = other.reference[:, places[key]]
    degc = other.temperature_degc if "temperature" in keys else samples.temperature_degc
    return replace(samples, values=values, reference=reference, temperature_degc=degc, good=good)


def already_dwells(path: Path) -> str:
    """What is wrong with a dwell table as a recording."""
    return f"{path} is a dwell table already; `planner calibrate` and `planner diagnose` take it"


def _which(path: Path, names: tuple[str, ...]) -> str:
    if set(DWELL_NAMES) <= set(names):
        return already_dwells(path)
    like = "gyro: {x: …, y: …, z: …, unit: deg/s}"
    return (
        f"{path}: say with --columns which column is what, as in `{like}`; `planner reduce --guess {path}` "
        f"writes such a map; the file has {', '.join(names[:30])}"
    )


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


def _names(
    path: Path, columns: ColumnMap, given: tuple[str, ...], where: Mapping[str, str]
) -> dict[str | int, str]:
    """Source of the map -> the file's column. Raises InputError for those that the file lacks."""
    wanted: list[str | int] = [*where, *([] if columns.step is None else [columns.step])]
    if isinstance(columns.unit, UnitColumn):
        wanted.append(columns.unit.column)
    if isinstance(columns.run, PowerOns) and columns.run.column is not None:
        wanted.append(columns.run.column)
    if columns.time is not None:
        wanted += [columns.time.column, *([columns.time.plus.column] if columns.time.plus else [])]
    if columns.temperature is not None:
        wanted.append(columns.temperature.column)
    for part in (columns.gyro, columns.acc, columns.ref_rate, columns.ref_acc):
        if part is not None:
            axes = [getattr(part, axis) for axis in AXES]
            wanted += [source for source in axes if constant(source, part.unit) is None]
    found = {source: _name(path, source, given) for source in wanted}
    for source, name in found.items():
        again = isinstance(source, str) and (
            given.count(name) > 1 or any(other.startswith(name + AGAIN) for other in given)
        )
        if again:
            raise InputError(f"{path}: column {name!r} stands more than once in the header; give its number")
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


def _sound(samples: Samples, account: Account, used: list[int]) -> Samples:
    """Marks samples that are no numbers, and padding: every sensor exactly zero."""
    values = samples.values[:, used]
    broken = ~np.isfinite(values).all(axis=1)
    padding = ~broken & ~values.any(axis=1) if len(used) >= 3 else np.zeros(len(samples), dtype=bool)
    account.counts.update({"not_finite": int(broken.sum())} if broken.any() else {})
    account.counts.update({"zero_padding": int(padding.sum())} if padding.any() else {})
    return replace(samples, good=samples.good & ~broken & ~padding)


def _count_repeats(last: Array, samples: Samples, account: Account, used: list[int]) -> Array:
    """Counts samples that are the one before to the last digit; returns the last sample, (1, 6)."""
    values = np.vstack([last, samples.values])
    if len(values) < 2:
        return values
    same = (values[1:, used] == values[:-1, used]).all(axis=1) & values[1:, used].any(axis=1)
    account.repeats += int(same.sum()) if len(used) >= 3 else 0
    return values[-1:]
