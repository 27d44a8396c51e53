"""A history's CSV → series. One value a line, or one column a coefficient.

    unit,date,error,term,value,uncertainty,event          unit,day,gyro.bias x [deg/s],gyro.bias x +- [deg/s]
    u1,2026-01-05,gyro.bias,x,0.0021 deg/s,0.0004 deg/s,  u1,0,0.0021,0.0004

`date` (ISO) or `day` (a number, counted from any day 0); every value carries its unit, in the cell or in the
header; `uncertainty` (one sigma) and `event` may be absent. The events `repair` and `replacement` begin the
history anew, after `recalibration` the level does; any other word is kept as a remark. Empty cells are
missing values. `#` lines are comments.
"""

from __future__ import annotations

import csv
import difflib
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import date
from pathlib import Path

import numpy as np

from planner import catalog
from planner.errors import Fault, InputError, unusable_file
from planner.fleet.history import Event, History, Series
from planner.nouns.given_files import HISTORY
from planner.protocols import SENSORS
from planner.units import UnitError, check_unit, parse, to_si

HELP = "unit, day or date, error, term, value with unit, uncertainty, event"
LONG = ("error", "term", "value", "uncertainty", "event")
_WIDE = re.compile(r"(?P<error>\w+\.\w+) (?P<term>\w+)(?P<std> (\+-|±|std))? \[(?P<unit>[^\]]+)\]")
_MOST_FAULTS = 20
_CENTURY = 36525.0


@dataclass
class _Sheet:
    """What has been read so far."""

    file: str
    faults: list[Fault] = field(default_factory=list)
    points: dict[tuple[str, str, str], list[tuple[float, float, float]]] = field(default_factory=dict)
    display: dict[tuple[str, str, str], str] = field(default_factory=dict)
    events: dict[str, dict[Event, None]] = field(default_factory=dict)
    seen: set[tuple[str, ...]] = field(default_factory=set)
    doubled: int = 0
    dated: bool = False

    def fault(self, line: int, column: str, message: str) -> None:
        if len(self.faults) < _MOST_FAULTS:
            self.faults.append(Fault(self.file, line, 1, column, message, "P801"))


def read_history(path: Path) -> History:
    """The history of a CSV file.

    Raises InputError with every fault and its line: unreadable file, no or unknown columns, dates and days
    mixed, values without a unit or with one of another dimension, unknown errors and terms.
    """
    rows = _rows(path)
    if not rows:
        raise InputError(f"{path} is empty; a history has the columns {HELP}")
    names = [cell.strip() for cell in rows[0][1]]
    other = _other_separator(names)
    if other is not None:
        raise InputError(
            f"{path} is a history whose cells are parted by {other}, as spreadsheets write them; save it "
            "with commas between the cells and points in the numbers: unit,date,error,term,value"
        )
    sheet = _Sheet(str(path))
    _check_names(sheet, rows[0][0], names)
    if sheet.faults:
        raise InputError(f"{path} is no history; it has the columns {HELP}", sheet.faults)
    sheet.dated = "date" in names
    for line, cells in rows[1:]:
        if len(cells) != len(names):
            sheet.fault(line, "", f"has {len(cells)} cells, the header {len(names)}")
        else:
            _row(sheet, line, dict(zip(names, (c.strip() for c in cells), strict=True)))
    if sheet.faults:
        raise InputError(f"{path}: {len(sheet.faults)} faults", sheet.faults)
    return _history(sheet, path)


def is_history(path: Path) -> bool:
    """Whether a file's header is that of a history: `unit`, `day` or `date`, and no readings."""
    try:
        rows = _rows(path, 1)
    except InputError:
        return False
    names = {part.strip() for _, cells in rows[:1] for cell in cells for part in re.split(r"[;\t]", cell)}
    readings = {"gyro_x_dps", "acc_x_g"} & names
    return bool("unit" in names and {"day", "date"} & names and not readings)


def _other_separator(names: Sequence[str]) -> str | None:
    """`semicolons` or `tabs` if they part the header's names, None if commas do."""
    for sign, word in ((";", "semicolons"), ("\t", "tabs")):
        if any("unit" in [part.strip() for part in name.split(sign)] and sign in name for name in names):
            return word
    return None


def _rows(path: Path, most: int | None = None) -> list[tuple[int, list[str]]]:
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            reader = csv.reader(file)
            found = []
            for cells in reader:
                if cells and any(c.strip() for c in cells) and not cells[0].lstrip().startswith("#"):
                    found.append((reader.line_num, cells))
                if most is not None and len(found) >= most:
                    break
            return found
    except OSError as error:
        raise unusable_file(path, error, HISTORY) from error
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{path} is no CSV file: {error}") from error


def _check_names(sheet: _Sheet, line: int, names: Sequence[str]) -> None:
    for name in sorted({n for n in names if names.count(n) > 1}):
        sheet.fault(line, name, "stands more than once in the header")
    if "unit" not in names:
        sheet.fault(line, "unit", "column missing: which unit a row belongs to")
    if ("day" in names) == ("date" in names):
        both = "day" in names
        sheet.fault(line, "day", "give day or date, not both" if both else "column day or date missing")
    known = {"unit", "day", "date", *LONG}
    wide = [n for n in names if _WIDE.fullmatch(n)]
    for name in names:
        if name not in known and name not in wide:
            near = difflib.get_close_matches(name, sorted(known), 1, 0.7)
            hint = f"; did you mean {near[0]}?" if near else "; a column of values is `gyro.bias x [deg/s]`"
            sheet.fault(line, name, f"unknown column{hint}")
    if "value" in names:
        for name in ("error", "term"):
            if name not in names:
                sheet.fault(line, name, "column missing beside value")
    elif not wide:
        sheet.fault(
            line, "value", "no values: give error, term, value, or columns like `gyro.bias x [deg/s]`"
        )
    for name in wide:
        _known_term(sheet, line, *_parts(name)[:2])


def _parts(name: str) -> tuple[str, str, bool, str]:
    match = _WIDE.fullmatch(name)
    assert match is not None
    return match["error"], match["term"], bool(match["std"]), match["unit"]


def _known_term(sheet: _Sheet, line: int, error: str, term: str) -> str | None:
    """The display unit of an error, None with a fault when it or its term does not exist."""
    sensor, _, effect = error.partition(".")
    if sensor not in SENSORS or effect not in catalog.effects():
        every = [f"{s}.{e}" for e, one in catalog.effects().items() for s in one.sensors]
        near = difflib.get_close_matches(error, every, 1, 0.6)
        sheet.fault(line, error, f"unknown error{f'; did you mean {near[0]}?' if near else ''}")
        return None
    one = catalog.effects()[effect]
    terms = [t.name for t in one.terms(sensor)]
    if term not in terms:
        sheet.fault(line, f"{error} {term}", f"no such term; {error} has {', '.join(terms)}")
        return None
    return str(one.units[sensor])


def _row(sheet: _Sheet, line: int, cells: Mapping[str, str]) -> None:
    if tuple(cells.values()) in sheet.seen:
        sheet.doubled += 1
        return
    sheet.seen.add(tuple(cells.values()))
    unit = cells["unit"]
    if not unit:
        sheet.fault(line, "unit", "empty: which unit is it?")
        return
    day = _day(sheet, line, cells)
    if day is None:
        return
    if cells.get("event"):
        sheet.events.setdefault(unit, {})[Event(day, cells["event"])] = None
    for error, term, value, uncertainty, shown in _values(sheet, line, cells):
        key = (unit, error, term)
        sheet.points.setdefault(key, []).append((day, value, uncertainty))
        sheet.display.setdefault(key, shown)


def _day(sheet: _Sheet, line: int, cells: Mapping[str, str]) -> float | None:
    text = cells["date" if sheet.dated else "day"]
    try:
        if sheet.dated:
            return float(date.fromisoformat(text).toordinal())
        day = float(text)
        if not np.isfinite(day) or abs(day) > _CENTURY:
            raise ValueError
        return day
    except ValueError:
        wanted = "a date like 2026-03-01" if sheet.dated else "a number of days"
        sheet.fault(line, "date" if sheet.dated else "day", f"{text[:30]!r} is not {wanted}")
        return None


def _values(
    sheet: _Sheet, line: int, cells: Mapping[str, str]
) -> Iterator[tuple[str, str, float, float, str]]:
    """(error, term, value, uncertainty, display unit) of the row's cells, SI."""
    if cells.get("value"):
        shown = _known_term(sheet, line, cells["error"], cells["term"])
        if shown is not None:
            value = _quantity(sheet, line, "value", cells["value"], shown)
            sigma = _quantity(sheet, line, "uncertainty", cells.get("uncertainty", ""), shown, positive=True)
            if value is not None:
                yield cells["error"], cells["term"], value, np.nan if sigma is None else sigma, shown
    sigmas = {_parts(n)[:2]: (n, c) for n, c in cells.items() if _WIDE.fullmatch(n) and _parts(n)[2] and c}
    for name, cell in cells.items():
        if not _WIDE.fullmatch(name) or _parts(name)[2] or not cell:
            continue
        error, term, _, written = _parts(name)
        shown = _known_term(sheet, line, error, term)
        if shown is None:
            continue
        value = _quantity(sheet, line, name, f"{cell} {written}", shown)
        other, text = sigmas.get((error, term), ("", ""))
        cell_sigma = f"{text} {_parts(other)[3]}" if other else ""
        sigma = _quantity(sheet, line, other, cell_sigma, shown, positive=True)
        if value is not None:
            yield error, term, value, np.nan if sigma is None else sigma, shown


def _quantity(
    sheet: _Sheet, line: int, column: str, text: str, shown: str, *, positive: bool = False
) -> float | None:
    if not text.strip():
        return None
    try:
        if shown not in ("", "1"):
            value = to_si(text, shown)
        else:
            quantity = parse(text)
            check_unit(quantity, shown)
            value = quantity.si
    except UnitError as error:
        sheet.fault(line, column, f"{error}; expected e.g. 0.002 {'%' if shown in ('', '1') else shown}")
        return None
    if positive and value <= 0:
        sheet.fault(line, column, "an uncertainty (one sigma) is larger than zero")
        return None
    return value


def _history(sheet: _Sheet, path: Path) -> History:
    if not sheet.points:
        raise InputError(f"{path} holds no value; fill the column value")
    first = min(p[0] for points in sheet.points.values() for p in points)
    origin = first if sheet.dated else 0.0
    series = []
    for (unit, error, term), points in sorted(sheet.points.items()):
        day, value, sigma = (np.array(column) for column in zip(*points, strict=True))
        events = tuple(replace(e, day=e.day - origin) for e in sheet.events.get(unit, ()))
        shown = sheet.display[unit, error, term]
        series.append(Series(unit, error, term, shown, day - origin, value, sigma, events))
    start = date.fromordinal(int(first)) if sheet.dated else None
    notes = [f"{sheet.doubled} rows stand twice; they were used once"] if sheet.doubled else []
    return History(tuple(series), str(path), start, tuple(notes))
