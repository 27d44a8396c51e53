"""What is wrong or odd in a dwell table: values in another unit than the name says, rows that cannot be."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.dwells.dwell_columns import AXES, COLUMNS, SINGLES, TRIADS, RawDwells
from planner.dwells.mix_ups import mix_ups
from planner.dwells.table_rows import alike
from planner.errors import Fault, InputError
from planner.nouns.array import Array
from planner.nouns.dwell_table import DwellTable
from planner.quantities import DAY_S

MOST_FAULTS = 20
HOTTEST_DEGC = 200.0  # no inertial unit is calibrated hotter; room temperature in kelvin is 293
COLDEST_DEGC = -200.0
LEAST_COPY = 2  # rows; one that is the same may be chance where readings are coarse
TURNS_DPS = 5.0  # ten times the largest bias of a MEMS gyro: what reads more than that apart is turned
_WITHOUT = {c.name: c.without for c in SINGLES} | {c.name: t.without for t in TRIADS for c in t.columns()}


def check_values(raw: RawDwells) -> None:
    """Refuse what cannot be meant: one InputError with every fault, each with its line.

    Cells that are no finite numbers, counts that are not whole, impossible temperatures and times, padding
    with zeros, another unit or axis than the column says, doubled rows, time that runs back within a run,
    one run number for several power-ons, one power-on under several run numbers.
    """
    faults = list(_not_numbers(raw))
    if not faults:
        faults = [*_impossible(raw), *_padding(raw), *_order(raw)]
        faults += [] if faults else _copies(raw)
        faults += [Fault(raw.file, 0, 0, *said, "P703") for said in mix_ups(_triads(raw))]
    if faults:
        kept = faults[:MOST_FAULTS]
        more = f", the first {MOST_FAULTS} of them" if len(faults) > len(kept) else ""
        raise InputError(f"{raw.file}: {len(faults)} faults{more}", kept)


def _triads(raw: RawDwells) -> dict[str, Array]:
    """Field -> (n, 3) values in the file's units, of the triads that the file has."""
    found = {}
    for field in ("ref_rate", "ref_acc", "gyro", "acc"):
        parts = [raw.columns.get(c.name) for c in COLUMNS if c.field == field]
        if all(part is not None for part in parts):
            found[field] = np.column_stack([np.asarray(part, dtype=np.float64) for part in parts])
    return found


def _not_numbers(raw: RawDwells) -> Iterator[Fault]:
    for column in COLUMNS:
        values = raw.columns.get(column.name)
        if values is None or column.kind == "text":
            continue
        if values.dtype.kind not in "fiu":
            yield Fault(raw.file, 0, 0, column.name, f"must hold numbers, not {values.dtype}", "P701")
            continue
        for row in np.flatnonzero(~np.isfinite(values))[:MOST_FAULTS]:
            said = "empty or not a number" if np.isnan(values[row]) else "infinite"
            yield raw.fault(
                row, column.name, f"{said}; leave the row out, or the whole column if not measured"
            )
        if column.kind == "count":
            whole = (values == np.round(values)) & (np.abs(values) < 2**53)
            for row in np.flatnonzero(np.isfinite(values) & ~whole)[:MOST_FAULTS]:
                yield raw.fault(row, column.name, f"{values[row]:g} is not a whole number")


def _impossible(raw: RawDwells) -> Iterator[Fault]:
    temperature = raw.columns.get("temp_degc")
    if temperature is not None:
        strange = np.flatnonzero((temperature > HOTTEST_DEGC) | (temperature < COLDEST_DEGC))
        kelvin = len(strange) == len(temperature) and temperature.min() > 0
        for row in strange[: 1 if kelvin else MOST_FAULTS]:
            guess = "; this column looks like kelvin, subtract 273.15" if kelvin else ""
            yield raw.fault(row, "temp_degc", f"{temperature[row]:g} degC is not possible{guess}")
    for name in ("time_on_s", "duration_s", "n_samples"):
        values = raw.columns.get(name)
        if values is None:
            continue
        for row in np.flatnonzero(values < 0)[:MOST_FAULTS]:
            yield raw.fault(row, name, f"{values[row]:g} is negative")


def _padding(raw: RawDwells) -> Iterator[Fault]:
    """Rows in which accelerometers and gyros all read exactly zero: at rest a triad reads 1 g."""
    triads = _triads(raw)
    if "acc" not in triads:
        return
    measured = np.column_stack([triads[field] for field in ("gyro", "acc") if field in triads])
    for row in np.flatnonzero(~measured.any(axis=1))[:MOST_FAULTS]:
        yield raw.fault(row, "", "every sensor reads exactly 0, so the row looks like padding; leave it out")


# ---------------------------------------------------------------- order


def _order(raw: RawDwells) -> Iterator[Fault]:
    """Doubled rows, time that does not rise within a run, a run number on days that one run cannot span."""
    run, time = raw.columns.get("run"), raw.columns.get("time_on_s")
    if run is None or time is None:
        return
    group = _groups(raw, run)
    order = np.argsort(group, kind="stable")
    same = np.flatnonzero(np.diff(group[order]) == 0)
    before, after = order[same], order[same + 1]
    wrong = time[after] <= time[before]
    for first, second in zip(before[wrong][:MOST_FAULTS], after[wrong][:MOST_FAULTS], strict=True):
        yield raw.fault(second, "time_on_s", _backwards(raw, first, second, run, time))
    day = raw.columns.get("day")
    if day is not None:
        passed = np.abs(day[after] - day[before]) * DAY_S
        # half a day of slack: some write the whole day of the calendar
        jumped = (passed > np.abs(time[after] - time[before]) + DAY_S / 2 + 1.0) & ~wrong
        for first, second in zip(before[jumped][:MOST_FAULTS], after[jumped][:MOST_FAULTS], strict=True):
            said = f"run {run[second]:.0f} is on day {day[first]:g} and on day {day[second]:g}"
            yield raw.fault(second, "run", f"{said}; every power-on needs a number of its own")


def _groups(raw: RawDwells, run: NDArray[Any]) -> NDArray[np.int64]:
    """A number for every power-on of every unit."""
    keys = np.unique(run, return_inverse=True)[1].astype(np.int64)
    unit = raw.columns.get("unit")
    if unit is None:
        return keys
    units = np.unique(np.asarray(unit, dtype=np.str_), return_inverse=True)[1]
    return units.astype(np.int64) * (int(keys.max(initial=0)) + 1) + keys


def _backwards(raw: RawDwells, first: int, second: int, run: NDArray[Any], time: NDArray[Any]) -> str:
    if all(values[first] == values[second] for values in raw.columns.values()):
        place = f"line {raw.lines[first]}" if raw.lines is not None else f"row {first + 1}"
        return f"the row is the same as {place}; remove one"
    if time[first] == time[second]:
        return f"run {run[second]:.0f} has two rows at {time[second]:g} s"
    return (
        f"time runs back from {time[first]:g} s to {time[second]:g} s within run {run[second]:.0f}; sort the "
        "rows by time, or give every power-on a run number of its own"
    )


def _copies(raw: RawDwells) -> Iterator[Fault]:
    """Power-ons that repeat another one's records in every column that is measured: they fake certainty."""
    run = raw.columns.get("run")
    numbers = [c.name for c in COLUMNS if c.kind == "number" and c.name != "day" and c.name in raw.columns]
    if run is None or not any(name.startswith(("gyro", "acc")) for name in numbers):
        return
    values = [np.asarray(raw.columns[name], dtype=np.float64) for name in numbers]
    group = _groups(raw, run)
    order = np.argsort(group, kind="stable")
    starts = np.flatnonzero(np.diff(group[order], prepend=-1))
    ends = np.append(starts[1:], len(order))
    heads = np.column_stack([column[order[starts]] for column in values])
    which = alike(np.column_stack([heads, ends - starts]))[1]
    twice = np.flatnonzero(np.bincount(which)[which] > 1)  # only what begins alike can be the same
    unit = raw.columns.get("unit", np.full(len(group), ""))
    seen: dict[tuple[str, bytes], int] = {}
    for k in twice.tolist():
        rows = order[starts[k] : ends[k]]
        whole = np.concatenate([column[rows] for column in values]).tobytes()
        first = seen.setdefault((str(unit[rows[0]]), whole), int(rows[0]))
        if first != rows[0] and len(rows) >= LEAST_COPY:
            said = f"run {run[rows[0]]:.0f} repeats run {run[first]:.0f} in every reading; remove one of them"
            yield raw.fault(int(rows[0]), "run", said)


# ---------------------------------------------------------------- notes


def absent_notes(absent: Sequence[str]) -> list[str]:
    """What cannot be told without the columns that a file lacks, one sentence a consequence."""
    groups: dict[str, list[str]] = {}
    for name in absent:
        groups.setdefault(_WITHOUT[name], []).append(name)
    return [f"the file has no {', '.join(names)}: {said}" for said, names in groups.items()]


def check_rests(table: DwellTable) -> None:
    """Without ref_rate the unit is at rest in every row: raises InputError when its gyros say otherwise."""
    if table.ref_rate is not None or table.gyro is None or not len(table):
        return
    rate = np.degrees(table.gyro)
    about = np.abs(rate - np.median(rate, axis=0)).max(axis=0)
    if about.max() > TURNS_DPS:
        axis = int(np.argmax(about))
        low, high = rate[:, axis].min(), rate[:, axis].max()
        raise InputError(
            f"{table.source}: no ref_rate_{{x,y,z}}_dps, so every row is taken as a rest, but "
            f"gyro_{AXES[axis]} reads {low:.4g} to {high:.4g} deg/s; give the rates, or leave out what turns"
        )


def odd_notes(table: DwellTable) -> list[str]:
    """Sentences about what is odd but possible: constant and saturated channels."""
    notes: list[str] = []
    for name, values, reference in (
        ("gyro", table.gyro, table.ref_rate),
        ("acc", table.acc, table.ref_acc),
    ):
        if values is not None and len(values) >= 4:
            notes += _constant(name, values)
            notes += _saturated(name, values, reference) if reference is not None else []
    temperature = table.temperature_degc
    if len(table) >= 10 and "temp_degc" not in table.absent and np.ptp(temperature) == 0:
        notes.append(f"temp_degc is exactly {temperature[0]:g} in every row: is the sensor alive?")
    return notes


def _constant(name: str, values: Array) -> Iterator[str]:
    still = np.ptp(values, axis=0) == 0
    for axis in np.flatnonzero(still) if not still.all() else ():
        yield f"{name}_{AXES[axis]} reads the same in every row while the others move: it looks dead"


def _saturated(name: str, values: Array, reference: Array) -> Sequence[str]:
    """A channel is saturated when it repeats its extreme exactly while the reference moves (by over 2 %)."""
    notes: list[str] = []
    for axis, letter in enumerate(AXES):
        if np.ptp(values[:, axis]) == 0:
            continue  # dead, which is said already
        for extreme in (values[:, axis].max(), values[:, axis].min()):
            rows = values[:, axis] == extreme
            moved = np.ptp(reference[rows, axis])
            if rows.sum() >= 2 and moved > 0.02 * np.abs(reference[rows, axis]).max() > 0:
                notes.append(
                    f"{name}_{letter} stops at the same value in {rows.sum()} rows: it looks saturated"
                )
    return notes
