"""Where histories come from: CSV files, earlier calibrations, dwell tables with days; and their horizon."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from datetime import date, timedelta
from pathlib import Path

import numpy as np

from planner.errors import InputError, unusable_file
from planner.fleet.allowed_region import AllowedRegion
from planner.fleet.calibration_documents import (
    CalibratedUnit,
    at_temperature,
    is_calibration,
    node_temperatures,
    read_calibration,
)
from planner.fleet.check_groups import APART_K, by_visit
from planner.fleet.check_residual import MeasuredResidual, check_residuals
from planner.fleet.drift import Correction
from planner.fleet.history import History, Series
from planner.fleet.history_files import is_history, read_history
from planner.nouns.allowances import ErrorModel
from planner.nouns.array import Array
from planner.nouns.dwell_table import DwellTable
from planner.nouns.given_files import HISTORY

HORIZON_DAYS = 365.0
LONGEST_DAYS = 3650.0
ROOM_DEGC = 20.0


SourceFiles = History | tuple[DwellTable, ...]


def source_files(inputs: Sequence[str], read: Callable[[Path], DwellTable]) -> SourceFiles:
    """Files of one kind, read; `FILE@2026-03-01` or `FILE@45` says the day of a calibration.

    read: reads a dwell table. Raises InputError for files of several kinds, calibrations without a day, and
    whatever the files lack.
    """
    kinds = {_kind(text) for text in inputs}
    if len(kinds) > 1:
        raise InputError(f"give files of one kind, not {' and '.join(sorted(kinds))}")
    kind = kinds.pop()
    if kind == "calibrations":
        return _of_calibrations([_split(text) for text in inputs])
    if kind == "histories":
        return _joined([read_history(Path(text)) for text in inputs])
    return tuple(read(Path(text)) for text in inputs)


def gathered_history(
    read: SourceFiles, models: Sequence[ErrorModel], region: AllowedRegion, start: date | None
) -> History:
    """What `source_files` read → one history.

    start: the calendar date of day 0, if the user gives one. Raises InputError for tables without days or
    without any error that counts.
    """
    found = (
        read if isinstance(read, History) else _joined([_of_dwells(table, models, region) for table in read])
    )
    if start is not None:
        if found.start is not None:
            raise InputError("--start is for histories that count days; this one has dates")
        found = replace(found, start=start)
    return found


def check_days(history: History, today: date | None) -> None:
    """Raises InputError for values from the future: a slip of the year would bend every drift."""
    if history.start is None:
        return
    now = today or date.today()
    late = [s for s in history.series if history.start + timedelta(days=float(s.day.max())) > now]
    if late:
        worst = max(late, key=lambda s: float(s.day.max()))
        raise InputError(
            f"{history.source}: {worst.name} has a value on "
            f"{history.label(float(worst.day.max()))}, which is "
            f"after today, {now}; correct the date, or say with --today which day it is"
        )


def today_of(history: History, today: date | None) -> float:
    """Today as a day of the history's count; of a history that counts days only, its last one."""
    if history.start is None:
        return history.last_day
    return float(((today or date.today()) - history.start).days)


def horizon(history: History, until: str | None, today: float | None = None) -> float:
    """--until, days from today (at least from the last value) or a date, as a day of the history's count.

    Raises InputError for what is neither, for the past, and beyond ten years.
    """
    last = max(history.last_day, history.last_day if today is None else today)
    if until is None:
        return last + HORIZON_DAYS
    try:
        ahead = float(until.split()[0]) if until.split()[1:] in ([], ["d"], ["days"]) else float(until)
    except (ValueError, IndexError):
        ahead = _days_to(history, until) - last
    if not 1.0 <= ahead <= LONGEST_DAYS:
        raise InputError(
            f"--until {until}: must lie 1 to {LONGEST_DAYS:.0f} days after {history.label(last)}, "
            "which is today or the last value"
        )
    return last + ahead


def _days_to(history: History, text: str) -> float:
    try:
        wanted = date.fromisoformat(text)
    except ValueError:
        raise InputError(f"--until {text!r}: write days such as 180, or a date like 2027-03-01") from None
    if history.start is None:
        raise InputError("--until is a date, but the history counts days; say with --start when day 0 was")
    return float((wanted - history.start).days)


def correction_of(text: str, history: History) -> Correction:
    """What corrects the unit; `auto`: calibrations replace each other, other values are residuals already."""
    if text == "auto":
        return "last" if history.source == "calibrations" else "none"
    known: dict[str, Correction] = {"none": "none", "first": "first", "last": "last"}
    if text in known:
        return known[text]
    raise InputError(f"--corrected-by must be auto, none, first or last, not {text!r}")


def _kind(text: str) -> str:
    path = Path(_split(text)[0])
    if not path.exists():
        raise unusable_file(path, "does not exist", HISTORY)
    if is_calibration(path):
        return "calibrations"
    return "histories" if is_history(path) else "dwell tables"


def _split(text: str) -> tuple[str, str | None]:
    """`FILE@DAY` -> file and day; a file whose name has an @ is itself."""
    file, sign, when = text.rpartition("@")
    return (file, when) if sign and not Path(text).exists() else (text, None)


def _joined(histories: Sequence[History]) -> History:
    """Histories of several files, the days counted from the first date of all."""
    if len(histories) == 1:
        return histories[0]
    starts = [h.start for h in histories]
    dated = [s for s in starts if s is not None]
    if dated and len(dated) < len(starts):
        raise InputError("some files have dates, others count days; give one kind")
    first = min(dated) if dated else None
    series: dict[tuple[str, str, str], list[Series]] = {}
    for h in histories:
        shift = float((h.start - first).days) if first is not None and h.start is not None else 0.0
        for s in h.series:
            moved = replace(
                s, day=s.day + shift, events=tuple(replace(e, day=e.day + shift) for e in s.events)
            )
            series.setdefault((s.unit, s.error, s.term), []).append(moved)
    merged = tuple(_merged(parts) for parts in series.values())
    notes = tuple(n for h in histories for n in h.notes)
    return History(merged, ", ".join(h.source for h in histories), first, notes)


def _merged(parts: Sequence[Series]) -> Series:
    day, value, sigma = (np.concatenate([getattr(p, k) for p in parts]) for k in ("day", "value", "sigma"))
    events = tuple(dict.fromkeys(e for p in parts for e in p.events))
    return replace(parts[0], day=day, value=value, sigma=sigma, events=events)


# ---------------------------------------------------------------- dwell tables


def _of_dwells(table: DwellTable, models: Sequence[ErrorModel], region: AllowedRegion) -> History:
    if "day" in table.absent:
        raise InputError(f"{table.source} has no column day, so it tells no drift")
    found = check_residuals(table, by_visit(table), models, region)
    usual, notes = _usual_temperature(found)
    found = tuple(m for m in found if abs(m.temperature_degc - usual) <= APART_K)
    series = []
    for unit in dict.fromkeys(m.unit for m in found):
        own = [m for m in found if m.unit == unit]
        for t, term in enumerate(region.terms):
            seen = [m for m in own if m.measured[t]]
            if seen:
                series.append(
                    Series(
                        unit,
                        term.error,
                        term.term,
                        term.unit,
                        np.array([m.day for m in seen]),
                        np.array([m.residual[t] for m in seen]),
                        np.sqrt([m.covariance[t, t] for m in seen]),
                    )
                )
    if not series:
        raise InputError(f"{table.source}: no visit tells any error that the requirements feel")
    return History(tuple(series), table.source, None, (*table.notes, *notes))


def _usual_temperature(found: Sequence[MeasuredResidual]) -> tuple[float, list[str]]:
    """The temperature at which most visits were made: drift is not to be mixed with temperature."""
    every: Array = np.array([m.temperature_degc for m in found])
    near = (np.abs(every[:, None] - every) <= APART_K).sum(axis=1)
    usual = float(every[int(np.argmax(near))])
    others = int(np.sum(np.abs(every - usual) > APART_K))
    said = f"{others} visits at other temperatures than {usual:.0f} degC were left out"
    return usual, [said] if others else []


# ---------------------------------------------------------------- calibrations


def _of_calibrations(files: Sequence[tuple[str, str | None]]) -> History:
    units = [read_calibration(Path(file), when) for file, when in files]
    lost = [u.source for u in units if u.when is None]
    if lost:
        raise InputError(
            f"{lost[0]}: on which day? write {lost[0]}@2026-03-01 or …@45, or keep calibrations in folders "
            "named by their dates"
        )
    days, start = _days([u.when or "" for u in units])
    points: dict[tuple[str, str, str], list[tuple[float, float, float]]] = {}
    shown: dict[tuple[str, str, str], str] = {}
    for unit, day in zip(units, days, strict=True):
        for error, term, display, value, sigma in _at_room(unit):
            points.setdefault((unit.unit, error, term), []).append((day, value, sigma))
            shown[unit.unit, error, term] = display
    series = tuple(
        Series(*key, shown[key], *np.transpose(sorted(p, key=lambda point: point[0])))
        for key, p in sorted(points.items())
    )
    return History(series, "calibrations", start)


def _at_room(unit: CalibratedUnit) -> list[tuple[str, str, str, float, float]]:
    nodes = node_temperatures(unit)
    room = min(max(ROOM_DEGC, nodes[0]), nodes[-1])
    found = []
    for term in unit.terms:
        weights = at_temperature(unit, term, room)
        sigma = float(np.sqrt(max(float(weights @ unit.covariance @ weights), 0.0)))
        found.append(
            (term.error, term.term, term.unit, float(weights @ unit.value), sigma if sigma > 0 else np.nan)
        )
    return found


def _days(texts: Sequence[str]) -> tuple[list[float], date | None]:
    try:
        dates = [date.fromisoformat(t) for t in texts]
        return [float((d - min(dates)).days) for d in dates], min(dates)
    except ValueError:
        pass
    try:
        return [float(t) for t in texts], None
    except ValueError:
        raise InputError(
            f"the days of calibrations must all be dates or all numbers, not {', '.join(texts[:4])}"
        ) from None
