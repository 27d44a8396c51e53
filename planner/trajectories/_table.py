"""Reads a trajectory's CSV into an array, or says in which line what is wrong. Nothing is guessed or dropped.

The table is read by numpy's parser, in a stream; only when that refuses are the lines gone through one by one
to name the faults. A last line without its line end may have been cut within a number, which still reads as a
number: it is taken only if it goes on like the lines before it.
"""

from __future__ import annotations

import difflib
import math
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from planner.errors import Fault, InputError
from planner.nouns.array import Array

COLUMNS = (
    "time_s",
    "lat_deg",
    "lon_deg",
    "alt_m",
    "v_north_mps",
    "v_east_mps",
    "v_down_mps",
    "roll_deg",
    "pitch_deg",
    "heading_deg",
)
VELOCITY, ATTITUDE = COLUMNS[4:7], COLUMNS[7:]  # all three may be left out
OPTIONAL = ("temp_degc",)
MOST_ROWS = 2_000_000  # 1.8 GB at work; five and a half hours at 100 Hz
MOST_FAULTS = 20  # beyond that they repeat each other
_LONGEST_LINE = 4096
_LONGEST_TOP = 10_000  # comment lines
_CHUNK = 1 << 20
_TURNS = ("lon_deg", "roll_deg", "heading_deg")  # 359.9 may be followed by 0.1


@dataclass(frozen=True)
class Table:
    """A trajectory file as read: `values` (m, columns) in the file's units, and where its rows stand.

    first_line: line of the first row; blank lines may follow, so `line` looks a row up in the file
    derived: of the columns those that the file left out, and in words how they were derived
    """

    path: Path
    columns: tuple[str, ...]
    values: Array
    first_line: int
    derived: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()

    def column(self, name: str) -> Array:
        """(m,) values of one column."""
        return self.values[:, self.columns.index(name)]

    def line(self, row: int) -> int:
        """Line of the file, from 1, of a row, from 0."""
        for index, (number, _text) in enumerate(_rows(self.path, self.first_line)):
            if index == row:
                return number
        return 0

    def fault(self, code: str, row: int, column: str, message: str) -> Fault:
        """A fault at a row's value of a column."""
        written = column in self.columns and column not in self.derived
        number = 1 + self.columns.index(column) if written else 0
        return Fault(self.path.name, self.line(row), number, column, message, code)


def read_table(path: Path) -> Table:
    """Reads the file. Raises InputError with the place of everything that is wrong with its text."""
    _check_bytes(path)
    header_line, header = _header(path)
    columns = _named(path, header_line, header)
    values = _values(path, header_line, columns)
    table = Table(path, columns, values, header_line + 1)
    if len(values) < 2:
        raise refusal(
            path, [Fault(path.name, 0, 0, "", "has one row; a trajectory needs two or more", "P601")]
        )
    _check_last_line(table)
    return table


def refusal(path: Path, faults: Sequence[Fault]) -> InputError:
    """The error that carries the faults of a file."""
    return InputError(f"{path.name[:80]} cannot be used as a trajectory", faults[:MOST_FAULTS])


def _whole(path: Path, message: str) -> InputError:
    return refusal(path, [Fault(path.name[:80], 0, 0, "", message, "P601")])


def _check_bytes(path: Path) -> None:
    """Refuses what is no file, empty, binary or too long, without loading it."""
    lines = 0
    try:
        if not path.is_file():
            what = "is a folder" if path.is_dir() else f"there is no such file in {path.parent}"
            raise _whole(path, f"{what}; give a CSV of a flight, which `planner init --flight` begins")
        with path.open("rb") as stream:
            while chunk := stream.read(_CHUNK):
                if b"\0" in chunk:
                    raise _whole(path, "is a binary file; a trajectory is a CSV text file")
                if len(chunk) == _CHUNK and b"\n" not in chunk:
                    raise _whole(
                        path, "has no line end within a megabyte; a trajectory is a table of short lines"
                    )
                lines += chunk.count(b"\n")
                if lines > MOST_ROWS + _LONGEST_TOP:
                    raise _whole(path, f"has more than {MOST_ROWS:,} rows; thin it out or cut it")
    except (OSError, ValueError) as error:  # also a name that no file system takes
        raise _whole(path, f"cannot be read ({type(error).__name__})") from None


def _header(path: Path) -> tuple[int, str]:
    """Number and text of the first line that is neither blank nor a comment."""
    try:
        with path.open(encoding="utf-8-sig", newline="") as stream:
            for number in range(1, _LONGEST_TOP):
                line = stream.readline(_LONGEST_LINE)
                if not line:
                    raise _whole(path, "is empty; expected a header line and two or more rows")
                if len(line) >= _LONGEST_LINE:
                    raise _whole(path, f"line {number} is too long for a table")
                if line.strip() and not line.lstrip().startswith("#"):
                    return number, line.strip()
    except UnicodeDecodeError:
        raise _whole(path, "is not UTF-8 text; a trajectory is a CSV text file") from None
    raise _whole(path, "has no header line")


def _named(path: Path, line: int, header: str) -> tuple[str, ...]:
    """The header's column names, all known, none missing, none twice."""
    names = tuple(name.strip().strip('"') for name in header.split(","))
    expected = ",".join(COLUMNS)
    if len(names) == 1 and (";" in header or "\t" in header):
        raise refusal(path, [Fault(path.name, line, 1, "", "columns are separated by commas", "P602")])
    if all(_is_number(name) for name in names):
        raise refusal(
            path, [Fault(path.name, line, 1, "", f"the header is missing; expected {expected}", "P602")]
        )
    faults = [
        Fault(path.name, line, place, name, _unknown(name), "P603")
        for place, name in enumerate(names, start=1)
        if name not in COLUMNS + OPTIONAL
    ]
    faults += [
        Fault(path.name, line, place, name, "this column stands here twice", "P604")
        for place, name in enumerate(names, start=1)
        if name in names[: place - 1]
    ]
    faults += [Fault(path.name, line, 1, name, why, "P605") for name, why in _missing(names)]
    if faults:
        raise refusal(path, faults)
    return names


def _missing(names: Sequence[str]) -> Iterator[tuple[str, str]]:
    """(column, what is wrong) of those that must be there: positions, and of a triple all or none."""
    for group in (COLUMNS[:4], VELOCITY, ATTITUDE):
        there = [name for name in group if name in names]
        for name in group:
            if name in there or (not there and group in (VELOCITY, ATTITUDE)):
                continue
            beside = f" beside {there[0]}; give all three, or none of them: then they are derived"
            yield name, f"this column is missing{beside if group in (VELOCITY, ATTITUDE) else ''}"


def _unknown(name: str) -> str:
    near = difflib.get_close_matches(name.lower(), COLUMNS + OPTIONAL, n=1)
    return f"unknown column; did you mean {near[0]}?" if near else "unknown column"


def _values(path: Path, header_line: int, columns: tuple[str, ...]) -> Array:
    """(m, columns) all finite numbers."""
    try:
        with path.open(encoding="utf-8-sig") as stream:
            for _ in range(header_line):
                stream.readline()
            with warnings.catch_warnings(action="ignore"):  # numpy warns of no rows; we refuse them below
                values = np.loadtxt(stream, delimiter=",", comments=None, ndmin=2)
    except (ValueError, UnicodeDecodeError):
        raise refusal(path, _text_faults(path, header_line, columns)) from None
    if values.shape[0] == 0:
        raise _whole(path, "has a header but no rows")
    if values.shape[1] != len(columns) or not np.isfinite(values).all():
        raise refusal(path, _text_faults(path, header_line, columns))
    return np.asarray(values, dtype=float)


def _text_faults(path: Path, header_line: int, columns: tuple[str, ...]) -> list[Fault]:
    """The first faults of the rows' text, found line by line."""
    faults: list[Fault] = []
    for number, text in _rows(path, header_line + 1):
        fields = text.split(",")
        if len(fields) != len(columns):
            message = f"{len(fields)} values; the header has {len(columns)} columns"
            faults.append(Fault(path.name, number, 1, "", message, "P606"))
        else:
            pairs = enumerate(zip(columns, fields, strict=True), start=1)
            faults += [
                Fault(
                    path.name, number, place, name, f"{field.strip()[:40]!r} is not a finite number", "P606"
                )
                for place, (name, field) in pairs
                if not _is_number(field)
            ]
        if len(faults) >= MOST_FAULTS:
            break
    return faults or [Fault(path.name, 0, 0, "", "is not a table of numbers separated by commas", "P606")]


def _rows(path: Path, first_line: int) -> Iterator[tuple[int, str]]:
    """Numbers and texts of the lines that are rows."""
    with path.open(encoding="utf-8-sig", errors="replace") as stream:
        for number, text in enumerate(stream, start=1):
            if number >= first_line and text.strip():
                yield number, text


def _is_number(text: str) -> bool:
    try:
        return math.isfinite(float(text)) and "_" not in text
    except ValueError:
        return False


def _check_last_line(table: Table) -> None:
    """Refuses a last line without line end whose last number may have been cut short."""
    with table.path.open("rb") as stream:
        stream.seek(0, 2)
        stream.seek(max(0, stream.tell() - 100 * _LONGEST_LINE))
        tail = stream.read().decode("utf-8", errors="replace")
    if tail.endswith(("\n", "\r")):
        return
    fields = [line.rsplit(",", 1)[-1].strip() for line in tail.split("\n")[-100:] if line.strip()]
    before = [field for field in fields[:-1] if _is_number(field)]
    shortest = min((_decimals(field) for field in before), default=math.inf)
    if _decimals(fields[-1]) < shortest or not _goes_on(table):
        last = len(table.values) - 1
        message = (
            f"the last line has no line end and its last value {fields[-1]!r} does not go on like the lines "
            "before: the file looks cut off; delete that line, or end it if it is whole"
        )
        raise refusal(table.path, [table.fault("P607", last, table.columns[-1], message)])


def _decimals(number: str) -> int:
    mantissa = number.lower().split("e")[0]
    return len(mantissa.split(".")[1]) if "." in mantissa else 0


def _goes_on(table: Table) -> bool:
    """Whether the very last value is as near to the straight continuation as those of the rows before it."""
    values = table.values[-100:, -1]
    steps = np.diff(values)
    if table.columns[-1] in _TURNS:
        steps = (steps + 180.0) % 360.0 - 180.0
    if len(steps) < 3:
        return False
    bends = np.abs(np.diff(steps))
    return bool(bends[-1] <= 4.0 * bends[:-1].max() + 1e-6 * max(1.0, float(np.abs(values).max())))
