"""Dwell tables in and out of files: CSV with `#` comments, Parquet, HDF5 (interfaces, section 4).

The file's units are those of its column names; SI and radians inside. Notes travel with the table: `# note:`
lines of a CSV, the metadata of a Parquet file, an attribute of an HDF5 file.
"""

from __future__ import annotations

import difflib
import io
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.dwells.dwell_checks import absent_notes, check_values, odd_notes
from planner.dwells.dwell_columns import AXES, BY_NAME, COLUMNS, SINGLES, TRIADS, DwellColumn, RawDwells
from planner.dwells.table_rows import without_motions
from planner.errors import Fault, InputError
from planner.nouns.dwell_table import DwellTable
from planner.units import unit_factor
from planner.whole_files import write_whole

SUFFIXES = {".csv": "csv", ".parquet": "parquet", ".pq": "parquet", ".h5": "hdf5", ".hdf5": "hdf5"}
NOTE = "note: "
DIGITS = 15  # what a double holds for certain; the conversion to degrees would leave 0.30000000000000004


# ---------------------------------------------------------------- reading


def read_dwells(path: Path, motions: bool = False) -> DwellTable:
    """The dwell table of a file; motions: with the pieces of hand turns, which only few methods can use.

    Columns that the file lacks are None, or stand at a neutral value and are listed in `absent`; both are
    said in the notes. Raises InputError with every fault found and its line: torn or ragged rows, unknown
    or doubled columns, cells that are no finite numbers, values in another unit than the column's name says,
    doubled rows, time that runs back within a run, a run number used for two power-ons.
    """
    path = Path(path)
    raw = _READERS[dwell_form(path)](path)
    _check_names(raw)
    check_values(raw)
    table = _table(raw)
    del raw
    _give_back()
    records = without_motions(table)
    notes = [*table.notes, *odd_notes(records)]
    if len(records) < len(table):
        notes.append(
            f"{len(table) - len(records)} rows are pieces of hand turns, for rests_and_turns and cube"
        )
    if not len(records):
        raise InputError(f"{path}: every row is a piece of a hand turn; no record is left")
    return _with_notes(table if motions else records, notes)


def dwell_form(path: Path) -> str:
    """`csv`, `parquet` or `hdf5`, by the suffix. Raises InputError for another."""
    known = SUFFIXES.get(path.suffix.lower())
    if known is None and path.suffix.lower() not in (".txt", ".tsv", ".dat", ""):
        raise InputError(f"{path}: a dwell table is a .csv, .parquet or .h5 file")
    return known or "csv"


def _give_back() -> None:
    """What pyarrow keeps of its buffers for later: as much as a table of a million rows itself."""
    arrow = sys.modules.get("pyarrow")
    if arrow is not None:
        arrow.default_memory_pool().release_unused()


def _read_csv(path: Path) -> RawDwells:
    from planner.readers._delimited import layout_of, text_blocks

    layout = layout_of(path, strict=True)
    if not layout.named:
        raise InputError(f"{path} has no header; its first line must name the columns: unit,run,day,…")
    _check_doubles(str(path), layout.names)
    texts = [c.name for c in COLUMNS if c.kind == "text" and c.name in layout.names]
    wanted = [name for name in layout.names if name in BY_NAME]
    if not wanted:
        return RawDwells(str(path), {}, layout.names)
    blocks = list(text_blocks(path, layout, wanted, texts))
    bad = [fault for block in blocks for fault in block.bad]
    if bad:
        raise InputError(f"{path}: {len(bad)} rows cannot be read", bad[:20])
    if not blocks:
        raise InputError(f"{path} has no rows: a header is all there is")
    columns = {name: np.concatenate([block.columns[name] for block in blocks]) for name in wanted}
    lines = np.concatenate([block.lines for block in blocks])
    notes = [text[len(NOTE) :] for text in layout.comments if text.startswith(NOTE)]
    torn = blocks[-1].torn
    if torn:  # its last number may be a part of the number that was meant
        columns, lines = {name: values[:-1] for name, values in columns.items()}, lines[:-1]
        notes.append(f"line {torn}, the last, has no line end and may be cut, so it is left out")
    return RawDwells(str(path), columns, layout.names, lines, tuple(notes))


def _read_parquet(path: Path) -> RawDwells:
    import pyarrow.parquet as pq
    from pyarrow import ArrowException

    try:
        with pq.ParquetFile(path) as file:
            names, metadata = file.schema_arrow.names, file.schema_arrow.metadata or {}
            _check_doubles(str(path), names)
            known = [name for name in names if name in BY_NAME]
            # one by one: a whole table beside its copy is twice the memory
            columns = {name: file.read([name]).column(0).to_numpy() for name in known}
        written = metadata.get(b"notes", b"").decode("utf-8", "replace")
    except (ArrowException, OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path} is not a whole Parquet file: {error}") from error
    return RawDwells(str(path), columns, tuple(names), None, tuple(filter(None, written.split("\n"))))


def _read_hdf5(path: Path) -> RawDwells:
    import h5py

    from planner.readers._arrays import same_length

    try:
        with h5py.File(path, "r") as file:
            group = file.get("dwells", file)
            names = tuple(name for name in group if isinstance(group[name], h5py.Dataset))
            columns = {name: _dataset(group[name]) for name in names if name in BY_NAME}
            notes = tuple(filter(None, str(group.attrs.get("notes", "")).split("\n")))
    except (OSError, RuntimeError, KeyError, ValueError, TypeError) as error:
        raise InputError(f"{path} is not a whole HDF5 file: {error}") from error
    wrong = [name for name, values in columns.items() if values.ndim != 1]
    if wrong:
        raise InputError(f"{path}: {', '.join(wrong)} must have one dimension, one value a row")
    same_length(path, columns)
    return RawDwells(str(path), columns, names, None, notes)


def _dataset(dataset: Any) -> NDArray[Any]:
    values = dataset[()]
    return np.char.decode(values.astype("S"), "utf-8") if values.dtype.kind in "OS" else np.asarray(values)


_READERS: Mapping[str, Callable[[Path], RawDwells]] = {
    "csv": _read_csv,
    "parquet": _read_parquet,
    "hdf5": _read_hdf5,
}


# ---------------------------------------------------------------- names


def _check_doubles(file: str, names: Sequence[str]) -> None:
    doubled = sorted({name for name in names if list(names).count(name) > 1})
    if doubled:
        raise InputError(
            f"{file}: column {', '.join(map(repr, doubled))} stands more than once in the header"
        )


def _check_names(raw: RawDwells) -> None:
    """Unknown names that look like a known one, and triads of which an axis is missing, are faults."""
    header = int(raw.lines[0]) - 1 if raw.lines is not None and len(raw.lines) else 0
    faults = []
    for name in raw.names:
        near = difflib.get_close_matches(name, [n for n in BY_NAME if n not in raw.names], 1, 0.75)
        if name not in BY_NAME and near:
            faults.append(
                Fault(raw.file, header, 1, name, f"unknown column; did you mean {near[0]}?", "P702")
            )
    for triad in TRIADS:
        missing = [c.name for c in triad.columns() if c.name not in raw.names]
        if 0 < len(missing) < len(AXES):
            said = f"missing beside its other axes; give {triad.pattern.format('{x,y,z}')} or none"
            faults += [Fault(raw.file, header, 1, name, said, "P702") for name in missing]
    if not any(c.name in raw.names for c in COLUMNS if c.field in ("gyro", "acc")):
        said = "holds neither gyro_{x,y,z}_dps nor acc_{x,y,z}_g, so it is no dwell table"
        what = "`planner reduce` makes one from recordings"
        if "roll_deg" in raw.names:
            what = "a log of attitude and velocity goes with `--method sins_outputs`"
        faults.append(Fault(raw.file, header, 1, "", f"{said}; {what}", "P702"))
    if faults:
        raise InputError(f"{raw.file}: the columns are not those of a dwell table", faults)
    if not len(next(iter(raw.columns.values()))):
        raise InputError(f"{raw.file} has a header and no rows")


# ---------------------------------------------------------------- record


def _table(raw: RawDwells) -> DwellTable:
    fields: dict[str, Any] = {}
    rows = len(next(iter(raw.columns.values())))
    absent = []
    for column in SINGLES:
        if column.name in raw.columns:
            fields[column.field] = _values(column, raw.columns[column.name])
        elif column.absent is not None:
            fields[column.field] = np.full(rows, column.absent)
            absent.append(column.name)
    if "run" in absent and "time_on_s" not in absent:
        fields["run"] = _power_ons(fields["unit"], fields["time_on"])
    for triad in TRIADS:
        parts = [raw.columns.get(c.name) for c in triad.columns()]
        known = [_values(c, p) for c, p in zip(triad.columns(), parts, strict=True) if p is not None]
        fields[triad.field] = np.column_stack(known) if known else None
        if not known and triad.expected:
            absent += [c.name for c in triad.columns()]
    unused = [name for name in raw.names if name not in BY_NAME]
    notes = list(raw.notes)
    notes += absent_notes(absent)
    notes += [f"columns that mean nothing here: {', '.join(unused)}"] if unused else []
    return DwellTable(**fields, source=raw.file, notes=tuple(dict.fromkeys(notes)), absent=tuple(absent))


def _power_ons(unit: NDArray[np.str_], time_on: NDArray[np.float64]) -> NDArray[np.int64]:
    """(n,) number of the power-on of every row: a new one where the time since power-on falls."""
    begins = (np.diff(time_on) <= 0) | (unit[1:] != unit[:-1])
    return np.concatenate([[1], 1 + np.cumsum(begins)])


def _values(column: DwellColumn, values: NDArray[Any]) -> NDArray[Any]:
    if column.kind == "text":
        return np.array(values, dtype=np.str_)
    if column.kind == "count":
        return np.asarray(values, dtype=np.float64).astype(np.int64)
    return np.asarray(values, dtype=np.float64) * unit_factor(column.unit)[0]


def _with_notes(table: DwellTable, notes: Sequence[str]) -> DwellTable:
    return replace(table, notes=tuple(dict.fromkeys(notes)))


# ---------------------------------------------------------------- writing


def write_dwells(table: DwellTable, path: Path) -> None:
    """Write a dwell table as .csv, .parquet or .h5; whole or not at all, same table, same bytes.

    Raises InputError for another suffix and when the folder cannot be written.
    """
    path = Path(path)
    write_whole(path, dwells_bytes(table, dwell_form(path)))


def dwells_bytes(table: DwellTable, form: str = "csv") -> bytes:
    """The bytes of a dwell table's file in the form `csv`, `parquet` or `hdf5`."""
    return _WRITERS[form](_columns(table), table.notes)


def _columns(table: DwellTable) -> dict[str, NDArray[Any]]:
    """Column name -> values in the file's unit, in the order of the interfaces."""
    found = {}
    for column in COLUMNS:
        values = getattr(table, column.field)
        if values is None or column.name in table.absent:
            continue
        one = values if column.axis is None else values[:, column.axis]
        found[column.name] = one if column.kind != "number" else _rounded(one / unit_factor(column.unit)[0])
    return found


def _rounded(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Values to 15 significant digits, without the last bits that the conversion of units leaves."""
    size = np.abs(values)
    known = np.isfinite(size) & (size > 1e-200)
    digits = np.floor(np.log10(size, where=known, out=np.zeros_like(size)))
    step = 10.0 ** np.abs(DIGITS - 1 - digits)  # a whole power of ten, so exact for what benches measure
    up = digits <= DIGITS - 1
    return np.where(known, np.where(up, np.round(values * step) / step, values), values)


def _csv_bytes(columns: Mapping[str, NDArray[Any]], notes: Sequence[str]) -> bytes:
    import pyarrow as pa
    from pyarrow import csv

    out = io.BytesIO()
    for note in notes:
        out.write(f"# {NOTE}{' '.join(note.split())}\n".encode())
    out.write((",".join(columns) + "\n").encode())
    texts = [values for values in columns.values() if values.dtype.kind == "U"]
    quoted = any(np.char.find(values, sign).max(initial=-1) >= 0 for values in texts for sign in ',"\n\r')
    style = "needed" if quoted else "none"
    csv.write_csv(pa.table(dict(columns)), out, csv.WriteOptions(include_header=False, quoting_style=style))
    return out.getvalue()


def _parquet_bytes(columns: Mapping[str, NDArray[Any]], notes: Sequence[str]) -> bytes:
    import pyarrow as pa
    import pyarrow.parquet as pq

    out = io.BytesIO()
    table = pa.table(dict(columns)).replace_schema_metadata({"notes": "\n".join(notes)})
    pq.write_table(table, out)
    return out.getvalue()


def _hdf5_bytes(columns: Mapping[str, NDArray[Any]], notes: Sequence[str]) -> bytes:
    import h5py

    out = io.BytesIO()
    with h5py.File(out, "w") as file:
        file.attrs["notes"] = "\n".join(notes)
        for name, values in columns.items():
            stored = np.char.encode(values, "utf-8") if values.dtype.kind == "U" else values
            file.create_dataset(name, data=stored, track_times=False)
    return out.getvalue()


_WRITERS: Mapping[str, Callable[[Mapping[str, NDArray[Any]], Sequence[str]], bytes]] = {
    "csv": _csv_bytes,
    "parquet": _parquet_bytes,
    "hdf5": _hdf5_bytes,
}
