"""Navigation logs out of files: what a strapdown system says of attitude and velocity on a bench (K 2.3).

One row a sample, in any format that `planner reduce` reads:

    time_s, roll_deg, pitch_deg, heading_deg, v_north_mps, v_east_mps, v_down_mps
    optional: unit, run, day, record, temp_degc, lat_deg, alt_m,
              table_rate_{x,y,z}_dps   rate over the ground that the bench sets, in body axes
              table_acc_{x,y,z}_g      specific force that a centrifuge sets, in body axes, gravity included

`time_s` counts from power-on. A record is what goes on with the same unit, run and record, in the same
motion, without a gap; the system knows the bench's attitude and velocity at its first sample (aligned there,
as K's appendix 1 has it). Frames: body forward-right-down, north-east-down.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.errors import Fault, InputError
from planner.nouns.array import Array
from planner.nouns.navigation_log import NavigationLog, NavigationRecord
from planner.protocols import RawReader
from planner.units import STANDARD_GRAVITY_MPS2

ANGLES = ("roll_deg", "pitch_deg", "heading_deg")
VELOCITY = ("v_north_mps", "v_east_mps", "v_down_mps")
TABLE_RATE = ("table_rate_x_dps", "table_rate_y_dps", "table_rate_z_dps")
TABLE_ACC = ("table_acc_x_g", "table_acc_y_g", "table_acc_z_g")
REQUIRED = ("time_s", *ANGLES, *VELOCITY)
TEXTS = ("unit", "record")
KNOWN = (*REQUIRED, *TEXTS, "run", "day", "temp_degc", "lat_deg", "alt_m", *TABLE_RATE, *TABLE_ACC)
_GAP = 3.0  # median steps: what is longer begins a record
_FASTEST_MPS = 1000.0
_MOST_FAULTS = 20

Columns = Mapping[str, NDArray[Any]]


def read_navigation_log(path: Path, reader: RawReader, latitude: float | None) -> NavigationLog:
    """The log of a file. latitude: of the bench, rad, for a file without `lat_deg`.

    Raises InputError with every fault and its row: columns that are missing or unknown, cells that are no
    finite numbers, impossible angles and speeds, time that does not rise, no latitude, no record of two rows.
    """
    names = reader.names(path)
    _check_names(path, names)
    wanted = [name for name in names if name in KNOWN]
    blocks = list(reader.blocks(path, wanted, [t for t in TEXTS if t in names]))
    lost = [remark for block in blocks for remark in block.remarks if block.losses]
    if lost or not blocks:
        said = "; ".join(lost[:3]) or "a header is all there is"
        raise InputError(f"{path}: rows of a navigation log cannot be read: {said}")
    columns = {name: np.concatenate([block.columns[name] for block in blocks]) for name in wanted}
    lines = np.concatenate([block.sample for block in blocks]) + 1
    faults = list(_faults(str(path), columns, lines))
    if faults:
        raise InputError(f"{path}: {len(faults)} faults", faults[:_MOST_FAULTS])
    return _log(str(path), columns, lines, _latitude(path, columns, latitude))


def _check_names(path: Path, names: tuple[str, ...]) -> None:
    faults = []
    for name in REQUIRED:
        if name not in names:
            near = difflib.get_close_matches(name, [n for n in names if n not in KNOWN], 1, 0.6)
            meant = f"; is it {near[0]!r}?" if near else f"; a navigation log has {', '.join(REQUIRED)}"
            faults.append(Fault(str(path), 1, 1, name, f"there is no such column{meant}", "P731"))
    for triad in (TABLE_RATE, TABLE_ACC):
        missing = [name for name in triad if name not in names]
        if 0 < len(missing) < 3:
            faults += [
                Fault(str(path), 1, 1, name, "missing beside its other axes; give all three or none", "P731")
                for name in missing
            ]
    if faults:
        raise InputError(f"{path}: the columns are not those of a navigation log", faults)


def _faults(file: str, columns: Columns, lines: NDArray[np.int64]) -> Iterator[Fault]:
    may_lack = set(TABLE_ACC)  # an empty cell: gravity is all
    for name, values in columns.items():
        if name in TEXTS:
            continue
        bad = np.isinf(values) if name in may_lack else ~np.isfinite(values)
        for row in np.flatnonzero(bad)[:_MOST_FAULTS]:
            yield Fault(file, 0, 0, name, f"row {lines[row]} is empty or no finite number", "P732")
    for row in np.flatnonzero(np.abs(columns["pitch_deg"]) > 90.0)[:_MOST_FAULTS]:
        yield Fault(
            file, 0, 0, "pitch_deg", f"row {lines[row]}: {columns['pitch_deg'][row]:g} is beyond ±90", "P732"
        )
    for name in VELOCITY:
        for row in np.flatnonzero(np.abs(columns[name]) > _FASTEST_MPS)[:1]:
            said = f"row {lines[row]}: {columns[name][row]:g} m/s is no speed on a bench"
            yield Fault(file, 0, 0, name, said, "P732")


def _latitude(path: Path, columns: Columns, given: float | None) -> float:
    if "lat_deg" in columns:
        return float(np.radians(np.median(columns["lat_deg"])))
    if given is None:
        raise InputError(f"{path} has no lat_deg, and gravity is of it; give --latitude DEG of the bench")
    return given


def _log(file: str, columns: Columns, lines: NDArray[np.int64], latitude: float) -> NavigationLog:
    notes = []
    if "alt_m" not in columns:
        notes.append("no alt_m: the bench stands at sea level; 100 m of height are 3e-5 g")
    if not set(TABLE_RATE) <= set(columns):
        notes.append("no table_rate_{x,y,z}_dps: the unit is at rest in every record")
    records, short = [], 0
    for rows in _records(columns):
        if len(rows) < 2:
            short += 1
            continue
        step = np.diff(columns["time_s"][rows])
        if step.min() <= 0:
            row = rows[int(np.argmin(step)) + 1]
            fault = Fault(file, 0, 0, "time_s", f"row {lines[row]} does not rise", "P732")
            raise InputError(f"{file}: time runs back within a record", [fault])
        records.append(_record(columns, rows, lines, latitude))
    if short:
        notes.append(f"{short} records of one row say nothing and are left out")
    if not records:
        raise InputError(f"{file}: no record has two rows")
    return NavigationLog(tuple(records), file, tuple(notes))


def _records(columns: Columns) -> Iterator[NDArray[np.int64]]:
    """Rows of each record: the same unit, run, record and motion, without a gap or a restart of time."""
    time = columns["time_s"]
    new = np.zeros(len(time), dtype=bool)
    for name in (*TEXTS, "run", *TABLE_RATE, *TABLE_ACC):
        if name in columns:
            values = columns[name] if name in TEXTS else np.nan_to_num(columns[name], nan=np.inf)
            new[1:] |= values[1:] != values[:-1]
    step = np.diff(time)
    usual = float(np.median(step[step > 0])) if np.any(step > 0) else 1.0
    if "record" not in columns:
        new[1:] |= step > _GAP * usual
        new[1:] |= step < -_GAP * usual  # another power-on; what runs back a little is a fault
    yield from np.split(np.arange(len(time)), np.flatnonzero(new))


def _record(
    columns: Columns, rows: NDArray[np.int64], lines: NDArray[np.int64], latitude: float
) -> NavigationRecord:
    first = rows[0]
    stack = {key: _triad(columns, names)[rows] for key, names in (("a", ANGLES), ("v", VELOCITY))}
    turning = set(TABLE_RATE) <= set(columns)
    force = _triad(columns, TABLE_ACC)[first] if set(TABLE_ACC) <= set(columns) else np.full(3, np.nan)
    temperature = columns.get("temp_degc")
    return NavigationRecord(
        unit=str(columns["unit"][first]) if "unit" in columns else "unit",
        run=int(columns["run"][first]) if "run" in columns else 1,
        day=float(columns["day"][first]) if "day" in columns else 0.0,
        name=str(columns["record"][first]) if "record" in columns else "",
        time_s=np.asarray(columns["time_s"][rows], dtype=float),
        attitude=np.radians(stack["a"]),
        velocity=stack["v"],
        temperature_degc=np.full(len(rows), 20.0) if temperature is None else temperature[rows],
        latitude=latitude,
        altitude=float(columns["alt_m"][first]) if "alt_m" in columns else 0.0,
        table_rate=np.radians(_triad(columns, TABLE_RATE)[first]) if turning else np.zeros(3),
        table_force=force * STANDARD_GRAVITY_MPS2 if np.isfinite(force).all() else None,
        lines=lines[rows],
    )


def _triad(columns: Columns, names: tuple[str, ...]) -> Array:
    return np.column_stack([np.asarray(columns[name], dtype=float) for name in names])
