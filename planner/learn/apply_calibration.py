"""A calibration's tables applied to a file: a dwell table, or a raw recording block by block."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from planner.calibration import Tables
from planner.errors import InputError
from planner.learn.column_map import ColumnMap
from planner.learn.correction import corrected
from planner.learn.dwell_files import read_dwells, write_dwells
from planner.learn.recording import Recording, Samples
from planner.measured import DwellTable
from planner.protocols import Sensor
from planner.records import Array
from planner.units import unit_factor

HEADER = "time_s,temp_degc,gyro_x_dps,gyro_y_dps,gyro_z_dps,acc_x_g,acc_y_g,acc_z_g"


def is_dwell_table(path: Path) -> bool:
    """Whether the file is a dwell table: text with columns `run` and `duration_s`, or a binary one."""
    if path.suffix.lower() in (".parquet", ".pq", ".h5", ".hdf5"):
        try:
            read_dwells(path)
        except InputError:
            return False
        return True
    try:
        with path.open(encoding="utf-8", errors="replace") as file:
            first = next((line for line in file if line.strip() and not line.startswith("#")), "")
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror}") from error
    return {"run", "duration_s"} <= {name.strip() for name in first.split(",")}


def correct_dwells(path: Path, out: Path, tables: Mapping[Sensor, Tables]) -> tuple[int, list[str]]:
    """Correct a dwell table's file; its rows, and notes."""
    table = corrected(read_dwells(path), tables)
    write_dwells(table, out)
    return len(table), [*table.notes, *_beyond(table.temperature_degc, tables)]


def correct_recording(
    path: Path, out: Path, tables: Mapping[Sensor, Tables], columns: ColumnMap | None
) -> tuple[int, list[str]]:
    """Correct a raw recording into a CSV of the columns of HEADER, in bounded memory; rows, and notes.

    Time since power-on counts from the first sample. Raises InputError as `Recording` does, and when the
    folder of `out` cannot be written.
    """
    recording = Recording(path, columns)
    notes: list[str] = []
    if any(e.effect == "temperature_rate" for t in tables.values() for e in t.extra):
        notes.append("a recording has no temperature rate: that effect is not corrected")
    rows, low, high = 0, np.inf, -np.inf
    try:
        handle, name = tempfile.mkstemp(prefix=f".{out.name}.", dir=out.parent)
    except OSError as error:
        raise InputError(f"cannot write {out}: {error.strerror}") from error
    try:
        with os.fdopen(handle, "w", encoding="ascii") as file:
            file.write(HEADER + "\n")
            for samples in recording.samples():
                np.savetxt(file, _corrected_block(samples, tables), fmt="%.9g", delimiter=",")
                rows += len(samples)
                low = min(low, np.nanmin(samples.temperature_degc, initial=np.inf))
                high = max(high, np.nanmax(samples.temperature_degc, initial=-np.inf))
        os.chmod(name, 0o644)
        os.replace(name, out)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise
    if not np.isfinite(low):
        notes.append("the recording has no temperature: corrected as at the middle of the table")
    return rows, [*notes, *_beyond(np.array([low, high]), tables)]


def _corrected_block(samples: Samples, tables: Mapping[Sensor, Tables]) -> Array:
    table = corrected(_as_dwells(samples, tables), tables)
    nothing = np.full((len(samples), 3), np.nan)
    gyro = nothing if table.gyro is None else table.gyro / unit_factor("deg/s")[0]
    acc = nothing if table.acc is None else table.acc / unit_factor("g")[0]
    return np.column_stack([samples.time, samples.temperature_degc, gyro, acc])


def _as_dwells(samples: Samples, tables: Mapping[Sensor, Tables]) -> DwellTable:
    """Every sample as a record of its own; without a thermometer at the middle of the table."""
    n, zero = len(samples), np.zeros(len(samples))
    middle = float(np.median(next(iter(tables.values())).temperature_degc)) if tables else 20.0
    warmth = np.where(np.isfinite(samples.temperature_degc), samples.temperature_degc, middle)
    gyro, acc = samples.values[:, :3], samples.values[:, 3:]
    return DwellTable(
        unit=np.full(n, "1"),
        run=np.ones(n, dtype=np.int64),
        day=zero,
        time_on=samples.time,
        duration=zero,
        temperature_degc=warmth,
        temperature_rate=zero,
        ref_rate=None,
        ref_acc=None,
        gyro=None if np.isnan(gyro).all() else gyro,
        acc=None if np.isnan(acc).all() else acc,
    )


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
