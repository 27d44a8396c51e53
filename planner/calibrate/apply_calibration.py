"""A calibration's tables applied to a file: a dwell table, or a raw recording block by block."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

import numpy as np

from planner import catalog
from planner.calibrate.correction import corrected, needing
from planner.dwells.dwell_files import SUFFIXES, read_dwells, write_dwells
from planner.dwells.table_rows import rows_of
from planner.errors import InputError
from planner.nouns.array import Array
from planner.nouns.calibration import NORMAL_DEGC, Tables
from planner.nouns.conditions import POSSIBLE_DEGC
from planner.nouns.dwell_table import DwellTable
from planner.protocols import Condition, Sensor
from planner.recordings.column_map import ColumnMap
from planner.recordings.formats import reader_of
from planner.recordings.raw_to_dwells import sampling_rate
from planner.recordings.recording import Recording, recordings_of
from planner.recordings.samples import READ, Account, Samples
from planner.recordings.temperature import alive, rates
from planner.recordings.windows import windows_of
from planner.units import from_si, unit_factor
from planner.whole_files import temporary_beside

COLUMNS = (
    "time_s",
    "temp_degc",
    *(f"gyro_{axis}_dps" for axis in "xyz"),
    *(f"acc_{axis}_g" for axis in "xyz"),
)


def is_dwell_table(path: Path) -> bool:
    """Whether the file has the columns `run` and `duration_s` of a dwell table."""
    reader = reader_of(path)
    if reader.name not in ("text", "parquet", "hdf5"):
        return False
    names = {name.removeprefix("dwells/") for name in reader.names(path)}
    return {"run", "duration_s"} <= names


def correct_dwells(path: Path, out: Path, tables: Mapping[Sensor, Tables]) -> tuple[int, list[str]]:
    """Correct a dwell table's file; its rows, and notes."""
    _refuse_same(path, out)
    given = read_dwells(path, motions=True)
    order = np.lexsort((given.time_on, given.run, given.unit))  # an effect may ask for the rows before a row
    table = rows_of(corrected(rows_of(given, order), tables), np.argsort(order))
    write_dwells(table, out)
    notes = [*table.notes, *_lacking(table, tables)]
    return len(table), [*notes, *_beyond(table.temperature_degc, tables)]


def correct_recording(
    path: Path, out: Path, tables: Mapping[Sensor, Tables], columns: ColumnMap | None
) -> tuple[int, list[str]]:
    """Correct a raw recording into a CSV of COLUMNS, in bounded memory; rows, and notes.

    Samples that are no numbers, or padding, stay in their place as nan. Raises InputError as `Recording`
    does, and when `out` cannot be written or is no text file.
    """
    if SUFFIXES.get(out.suffix.lower(), "csv") != "csv":
        raise InputError(f"{out}: a corrected recording is a text table; name it .csv")
    _refuse_same(path, out)
    found = recordings_of(path, columns)
    recording, account = found[0], Account()
    seen = _Warmth(tables)
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        handle, name = temporary_beside(out)
    except OSError as error:
        raise InputError(f"cannot write {out}: {error.strerror}") from error
    try:
        with os.fdopen(handle, "wb") as file:
            _write(file, found, account, seen, tables)
        os.chmod(name, 0o644)  # mkstemp makes files that only their owner can read
        os.replace(name, out)
    except OSError as error:
        raise InputError(f"cannot write {out}: {error.strerror}") from error
    finally:
        name.unlink(missing_ok=True)
    notes = [*_missing(recording, tables), *seen.notes(recording), *_losses(account)]
    return account.counts[READ], [*notes, *_beyond(np.array([seen.low, seen.high]), tables)]


def _refuse_same(path: Path, out: Path) -> None:
    if path.resolve() == out.resolve():
        raise InputError(f"{out} is the recording itself; write the corrected one elsewhere")


@dataclass(frozen=True)
class _Warming:
    """Temperature over a recording: (m,) times in s, one at least; degC and K/s at them."""

    time: Array
    temperature_degc: Array
    rate: Array

    def before(self, time: float) -> _Warming:
        """What was before an instant."""
        past = self.time < time
        return _Warming(self.time[past], self.temperature_degc[past], self.rate[past])


_NO_PAST = _Warming(*np.zeros((3, 0)))


def _warming(recording: Recording, tables: Mapping[Sensor, Tables]) -> _Warming | None:
    """The temperature over the recording, where an effect needs its rate and it is known.

    The file is read once more for that: the slope at an instant needs the five seconds after it too, and must
    not depend on where a block ends.
    """
    if not _asking(tables, "temperature_rate") or recording.whole.temperature is None:
        return None
    windows = windows_of(recording.even_samples(Account()), sampling_rate(recording))
    at, rate = rates(windows)
    if not len(at):
        return None
    known = alive(windows)
    middle = (windows.start + windows.end)[known] / 2.0
    inside = np.clip(at, middle[0], middle[-1])  # half a window at both ends goes on with the rate there
    return _Warming(
        at, np.interp(inside, middle, windows.temperature_degc[known]) + rate * (at - inside), rate
    )


@dataclass
class _Warmth:
    """The temperature at which each sample is corrected: the last one that the sensor gave alive."""

    tables: Mapping[Sensor, Tables]
    warming: _Warming | None = None
    last: float = np.nan
    low: float = np.inf
    high: float = -np.inf
    held: int = field(default=0)

    def at(self, samples: Samples) -> Array:
        """(n,) degC; before the first known one that one, without any that of normal conditions."""
        value = samples.temperature_degc
        with np.errstate(invalid="ignore"):
            known = (value >= POSSIBLE_DEGC[0]) & (value <= POSSIBLE_DEGC[1])
        self.held += int((~known).sum())
        if not known.any():
            return np.full(len(value), self.last if np.isfinite(self.last) else self._fallback())
        first = float(value[known][0]) if not np.isfinite(self.last) else self.last
        place = np.maximum.accumulate(np.where(known, np.arange(len(value)), -1))
        found = np.where(place >= 0, value[place], first)
        self.last = float(found[-1])
        self.low, self.high = min(self.low, float(found.min())), max(self.high, float(found.max()))
        return np.asarray(found)

    def rate(self, samples: Samples) -> Array:
        """(n,) K/s; zero where the recording does not tell."""
        if self.warming is None:
            return np.zeros(len(samples))
        return np.interp(samples.time, self.warming.time, self.warming.rate)

    def past(self, samples: Samples) -> _Warming:
        """What was before a block, where an effect asks for the rows before a row; else nothing."""
        if self.warming is None or not any(_remembers(one) for one in self.tables.values()):
            return _NO_PAST
        return self.warming.before(float(samples.time[0]))

    def _fallback(self) -> float:
        return next(iter(self.tables.values())).fallback_degc if self.tables else NORMAL_DEGC

    def _cost(self) -> str:
        """What a correction without a temperature leaves of the biases at most, in words."""
        units = {"gyro": "deg/s", "accelerometer": "g"}
        return " and ".join(
            f"{from_si(t.without_temperature, units[s]):.2g} {units[s]} of the {s}s"
            for s, t in self.tables.items()
        )

    def notes(self, recording: Recording) -> Iterator[str]:
        """Where the temperature was not measured."""
        without = (
            f"corrected as at {self._fallback():.1f} degC, which leaves up to {self._cost()} "
            "over the table's temperatures"
        )
        if recording.whole.temperature is None:
            yield f"the recording has no temperature: {without}"
        elif self.held and self.low > self.high:
            yield f"the temperature sensor is dead in all samples: {without}"
        elif self.held:
            yield f"the temperature sensor is dead in {self.held} samples: corrected at its last reading"
        names = _asking(self.tables, "temperature_rate")
        if names and self.warming is None:
            yield f"the recording does not tell the rate of temperature: {joined(names)} not corrected"


# ---------------------------------------------------------------- blocks


def _write(
    file: BinaryIO,
    found: Sequence[Recording],
    account: Account,
    seen: _Warmth,
    tables: Mapping[Sensor, Tables],
) -> None:
    """Every power-on one behind the other, told apart by the column `run` where there are several."""
    import pyarrow as pa
    from pyarrow import csv

    several = len(found) > 1
    file.write((",".join(["run", *COLUMNS] if several else COLUMNS) + "\n").encode())
    style = csv.WriteOptions(include_header=False, quoting_style="none")
    for number, recording in enumerate(found, start=found[0].whole.first_run):
        seen.warming, seen.last = _warming(recording, tables), np.nan
        for samples in recording.samples(account):
            block = _corrected_block(samples, seen, recording.whole, tables)
            columns = dict(zip(COLUMNS, block.T, strict=True))
            runs = {"run": np.full(len(samples), number)} if several else {}
            csv.write_csv(pa.table({**runs, **columns}), file, style)


def _corrected_block(
    samples: Samples, warmth: _Warmth, columns: ColumnMap, tables: Mapping[Sensor, Tables]
) -> Array:
    """(n, 8) values of COLUMNS."""
    rows = corrected(_as_dwells(samples, warmth, columns), tables)
    table = rows_of(rows, np.arange(len(rows) - len(samples), len(rows)))
    nothing = np.full((len(samples), 3), np.nan)
    gyro = nothing if table.gyro is None else table.gyro / unit_factor("deg/s")[0]
    acc = nothing if table.acc is None else table.acc / unit_factor("g")[0]
    readings = np.where(samples.good[:, None], np.hstack([gyro, acc]), np.nan)
    return np.column_stack([samples.time, samples.temperature_degc, readings])


def _as_dwells(samples: Samples, warmth: _Warmth, columns: ColumnMap) -> DwellTable:
    """Every sample as a record of its own; before them, without readings, what an effect may remember."""
    past = warmth.past(samples)
    n = len(past.time) + len(samples)
    values = np.vstack([np.zeros((len(past.time), 6)), samples.values])
    return DwellTable(
        unit=np.full(n, "1"),
        run=np.ones(n, dtype=np.int64),
        day=np.full(n, columns.day or 0.0),
        time_on=np.append(past.time, samples.time) + (columns.time_on or 0.0),
        duration=np.zeros(n),
        temperature_degc=np.append(past.temperature_degc, warmth.at(samples)),
        temperature_rate=np.append(past.rate, warmth.rate(samples)),
        ref_rate=None,
        ref_acc=None,
        gyro=values[:, :3] if columns.gyro is not None else None,
        acc=values[:, 3:] if columns.acc is not None else None,
    )


def _remembers(tables: Tables) -> bool:
    """Whether an effect of a calibration asks for the rows before a row."""
    return any(getattr(catalog.effects()[term.effect], "history", False) for term in tables.extra)


# ---------------------------------------------------------------- notes


def _asking(tables: Mapping[Sensor, Tables], condition: Condition) -> list[str]:
    """Names of the effects of either sensor that need a condition."""
    return list(dict.fromkeys(name for sensor in tables for name in needing(tables, sensor, condition)))


def joined(names: Sequence[str]) -> str:
    """`ageing is` or `ageing, bias_step are`: the subject of a sentence."""
    return f"{', '.join(names)} {'is' if len(names) == 1 else 'are'}"


def _missing(recording: Recording, tables: Mapping[Sensor, Tables]) -> Iterator[str]:
    """What the calibration asks for and the recording does not hold."""
    columns = recording.whole
    of_the_day, since_power_on = _asking(tables, "day"), _asking(tables, "time_on")
    if of_the_day and columns.day is None:
        yield f"the map gives no day: {joined(of_the_day)} corrected as on day 0"
    if since_power_on and columns.time_on is None:
        yield (
            f"the map gives no time_on: {joined(since_power_on)} corrected with time since power-on "
            "counted from the first sample"
        )
    by_force, by_rate = needing(tables, "gyro", "specific_force"), needing(tables, "accelerometer", "rate")
    if columns.acc is None and by_force:
        yield f"the recording has no accelerometers: {joined(by_force)} not corrected on the gyros"
    if columns.gyro is None and by_rate:
        yield f"the recording has no gyros: {joined(by_rate)} not corrected on the accelerometers"
    for sensor, part in (("gyro", columns.gyro), ("accelerometer", columns.acc)):
        if part is not None and sensor not in tables:
            yield f"the calibration has no {sensor}: its readings are as they were"


def _lacking(table: DwellTable, tables: Mapping[Sensor, Tables]) -> Iterator[str]:
    """What the calibration asks for and a dwell table does not hold."""
    columns: tuple[tuple[Condition, str, str], ...] = (
        ("temperature_rate", "temp_rate_degc_min", "at a steady temperature"),
        ("time_on", "time_on_s", "as at power-on"),
        ("day", "day", "as on day 0"),
    )
    for condition, column, how in columns:
        names = _asking(tables, condition)
        if names and column in table.absent:
            yield f"the table has no column {column}: {joined(names)} corrected {how}"


def _losses(account: Account) -> Iterator[str]:
    lost = [f"{n} {reason.replace('_', ' ')}" for reason, n in account.counts.items() if reason != READ]
    if lost:
        yield f"not corrected: {', '.join(lost)}"
    yield from account.remarks


def _beyond(temperature_degc: Array, tables: Mapping[Sensor, Tables]) -> Iterator[str]:
    """A note for every sensor whose table does not reach the temperatures."""
    t = temperature_degc[np.isfinite(temperature_degc)]
    for sensor, one in tables.items():
        low, high = one.temperature_degc[0] - one.reach, one.temperature_degc[-1] + one.reach
        outside = len(t) > 0 and (t.min() < low or t.max() > high)
        if outside and len(one.temperature_degc) > 1:
            yield (
                f"{sensor}: temperatures from {t.min():.1f} to {t.max():.1f} degC leave the table "
                f"({low:.1f} to {high:.1f} degC); beyond it the end value is taken"
            )
