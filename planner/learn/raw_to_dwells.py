"""Raw recordings -> dwell table: rests found, spikes left out, temperature and its rate, an account of all.

Two passes over each file, both in bounded memory: windows, from which rests and rows follow; then the longest
rest once more for the Allan deviation.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from planner.errors import InputError
from planner.learn.allan import LEAST_SAMPLES, AllanResult, allan
from planner.learn.column_map import ColumnMap
from planner.learn.plan_records import PlannedRecord, labelled
from planner.learn.plausible import jumps_between, suspicious
from planner.learn.recording import CHANNELS, Account, Recording, Samples
from planner.learn.reduction import LeftOut, Reduction, RowAccount
from planner.learn.rests import Segment, segments_of, steps_of, used_channels
from planner.learn.segments_to_rows import Row, cut, row_of, table_of
from planner.learn.temperature import alive
from planner.learn.windows import Windows, windows_of
from planner.records import Array

RECORD_LIMITS_S = (10.0, 600.0)  # the temperature rate needs 10 s; K's longest record is 300 s
MOST_ALLAN_SAMPLES = 1 << 18
LEAST_ALLAN_S = 30.0


@dataclass(frozen=True)
class _File:
    """One recording, half reduced."""

    recording: Recording
    unit: str
    run: int
    rate: float
    windows: Windows
    segments: tuple[Segment, ...]
    account: Account


def reduce_recordings(
    paths: Sequence[Path], columns: ColumnMap | None = None, records: Sequence[PlannedRecord] | None = None
) -> Reduction:
    """The dwell table of recordings, each of one power-on.

    columns: the map; without it the columns must be named as a dwell table's, with `time_s`
    records: the plan's records; without them rests are found, or taken from the column of steps
    Raises InputError for files that cannot be read or whose readings cannot be meant, and when nothing rests.
    """
    files = [_opened(Path(path), columns, number, records) for number, path in enumerate(paths)]
    if not files:
        raise InputError("no recording is given")
    results, longest = _allan_of(files)
    record, bound = _recommended(results)
    rows, left_out = _rows(files, columns, record)
    if not rows:
        reasons = sorted({part.reason for part in left_out})
        raise InputError(f"{files[0].recording.path}: nothing gives a row: {'; '.join(reasons)}")
    notes = _notes(files, rows, left_out, longest, record, bound)
    table = replace(table_of(rows, files[0].recording.columns), notes=tuple(notes))
    return Reduction(
        table=replace(table, source=", ".join(str(path) for path in paths)),
        rows=tuple(_row_account(row) for row in rows),
        left_out=tuple(left_out),
        counts={str(file.recording.path): dict(file.account.counts) for file in files},
        allan=tuple(results),
        record=record,
        record_is_bound=bound,
        rates_hz={str(file.recording.path): file.rate for file in files},
    )


def _opened(
    path: Path, columns: ColumnMap | None, number: int, records: Sequence[PlannedRecord] | None
) -> _File:
    recording = Recording(path, columns)
    account = Account()
    rate = sampling_rate(recording)
    blocks: Iterable[Samples] = recording.samples(account)
    wanted = recording.columns.records
    if wanted == "plan" or (records and wanted is None):
        if not records:
            raise InputError("the map takes the records from the plan; give it with --plan")
        blocks = labelled(blocks, records, recording.columns.plan_time)
    elif wanted == "rests" or recording.columns.step is None:
        blocks = (replace(block, label=None) for block in blocks)
    windows = windows_of(iter(blocks), rate)
    if not len(windows):
        raise InputError(f"{path} is too short: fewer samples than one window of {8 / rate:.3g} s needs")
    segments = steps_of(windows) if windows.label is not None else segments_of(windows, 1.5 / rate)
    said = suspicious(windows, segments)
    if said:
        raise InputError(f"{path}: {said}")
    unit = recording.columns.unit or path.stem
    return _File(
        recording, unit, recording.columns.run + number, rate, windows, tuple(segments), account
    )


def sampling_rate(recording: Recording) -> float:
    """Hz: the map's, or from the times of the first block. Raises InputError when they contradict."""
    first = next(iter(recording.samples()))
    given = recording.columns.rate
    if recording.columns.time is None or len(first) < 3:
        if given is None:
            raise InputError(f"{recording.path} has too few samples to tell the sampling rate; give rate")
        return given
    step = float(np.median(np.diff(first.time)))
    if step <= 0 or not np.isfinite(step):
        raise InputError(f"{recording.path}: the time does not rise")
    if given is not None and abs(given * step - 1) > 0.05:
        raise InputError(
            f"{recording.path}: the map says {given:g} Hz, the time column {1 / step:g} Hz; is its unit right?"
        )
    return 1 / step


# ---------------------------------------------------------------- rows


def _rows(
    files: Sequence[_File], columns: ColumnMap | None, record: float | None
) -> tuple[list[Row], list[LeftOut]]:
    rows: list[Row] = []
    left_out: list[LeftOut] = []
    for file in files:
        living = alive(file.windows)
        settings = file.recording.columns
        longest = settings.record or (record and float(np.clip(record, *RECORD_LIMITS_S))) or RECORD_LIMITS_S[1]
        number = 0
        for segment in file.segments:
            reason = _why_not(file, segment, settings.shortest)
            parts = () if reason else cut(file.windows, segment, longest)
            for part in parts:
                number += 1
                label = part.label or f"rest_{number:03d}"
                row = row_of(file.windows, part, living, label, file.unit, file.run, file.rate, settings)
                if row is None:
                    left_out.append(_left(file, part, "the temperature sensor is dead"))
                else:
                    rows.append(row)
            if reason:
                left_out.append(_left(file, segment, reason))
    return rows, left_out


def _why_not(file: _File, segment: Segment, shortest: float) -> str:
    if segment.kind == "gap":
        return "samples are missing"
    if segment.kind == "motion":
        return segment.note or ("no step of the plan" if file.windows.label is not None else "moves")
    duration = file.windows.end[segment.last - 1] - file.windows.start[segment.first]
    if duration + 1 / file.rate < shortest:
        return f"shorter than {shortest:g} s"
    return "" if segment.quiet.any() else "no window without disturbance"


def _left(file: _File, segment: Segment, reason: str) -> LeftOut:
    start, end = float(file.windows.start[segment.first]), float(file.windows.end[segment.last - 1])
    return LeftOut(file.unit, file.run, segment.kind, start, end, reason)


def _row_account(row: Row) -> RowAccount:
    return RowAccount(row.unit, row.run, row.step, row.start, row.end, row.n_samples, row.left_out)


# ---------------------------------------------------------------- Allan


def _allan_of(files: Sequence[_File]) -> tuple[list[AllanResult], str]:
    """Of the longest rest of all files, every channel; and where it is."""
    best: tuple[float, _File, Segment] | None = None
    for file in files:
        for segment in file.segments:
            if segment.kind not in ("rest", "step"):
                continue
            span = float(file.windows.end[segment.last - 1] - file.windows.start[segment.first])
            if span >= LEAST_ALLAN_S and (best is None or span > best[0]):
                best = (span, file, segment)
    if best is None:
        return [], ""
    span, file, segment = best
    values, rate = _of_segment(file, segment)
    if len(values) < LEAST_SAMPLES:
        return [], ""
    used = used_channels(file.windows)
    results = [allan(values[:, i], rate, CHANNELS[i]) for i in np.flatnonzero(used)]
    value = file.windows.temperature_degc[segment.first : segment.last]
    known = value[np.isfinite(value)]
    over = f", over which the temperature moves by {np.ptp(known):.3g} K" if len(known) and np.ptp(known) > 2 else ""
    return results, f"{span:.0f} s of {file.unit}{over}"


def _of_segment(file: _File, segment: Segment) -> tuple[Array, float]:
    """(n, 6) readings of a segment at a rate in Hz, averaged so that they are at most 262 144.

    Samples that were left out are bridged by the one before: they are few, and a hole would shift the rest.
    """
    start, end = file.windows.start[segment.first], file.windows.end[segment.last - 1]
    factor = max(1, int(np.ceil((end - start) * file.rate / MOST_ALLAN_SAMPLES)))
    parts, rest = [], np.zeros((0, 6))
    for block in file.recording.samples():
        inside = (block.time >= start) & (block.time <= end)
        if not inside.any():
            if parts and block.time[0] > end:
                break
            continue
        rest = np.vstack([rest, _bridged(block[inside])])
        whole = len(rest) // factor * factor
        parts.append(rest[:whole].reshape(-1, factor, 6).mean(axis=1))
        rest = rest[whole:]
    return np.vstack(parts) if parts else rest, file.rate / factor


def _bridged(samples: Samples) -> Array:
    from planner.learn.spikes import spikes

    used = np.isfinite(samples.values).any(axis=0)
    values = samples.values.copy()
    bad = ~np.isfinite(values[:, used]).all(axis=1) | ~samples.good
    near = np.maximum.accumulate(np.where(bad, 0, np.arange(len(values))))
    values = values[near]
    if used.any():
        odd = spikes(values[:, used], 1)
        values = values[np.maximum.accumulate(np.where(odd, 0, np.arange(len(values))))]
    return np.asarray(values)


def _recommended(results: Sequence[AllanResult]) -> tuple[float | None, bool]:
    """The shortest best time over the channels: past it some channel gets worse; whether it is a bound."""
    if not results:
        return None, False
    told = [one for one in results if not one.at_end]
    if told:
        return float(min(one.best_time for one in told)), False
    return float(min(one.best_time for one in results)), True


# ---------------------------------------------------------------- notes


def _notes(
    files: Sequence[_File],
    rows: Sequence[Row],
    left_out: Sequence[LeftOut],
    longest: str,
    record: float | None,
    bound: bool,
) -> list[str]:
    notes = []
    for file in files:
        counts = ", ".join(f"{count} {reason.replace('_', ' ')}" for reason, count in file.account.counts.items())
        notes += [f"{file.unit} run {file.run}: left out while reading: {counts}"] if counts else []
        notes += [f"{file.unit} run {file.run}: {remark}" for remark in file.account.remarks]
        notes += [f"{file.unit} run {file.run}: {said}" for said in jumps_between(file.windows, file.segments)]
    if files[0].recording.columns.time_on is None:
        notes.append("the map gives no time_on, so time since power-on counts from the first sample")
    notes += _tallies(rows, left_out)
    if record is not None:
        least = "at least " if bound else ""
        notes.append(f"best averaging time of one dwell, by Allan deviation of {longest}: {least}{record:.3g} s")
    return list(dict.fromkeys(notes))


def _tallies(rows: Sequence[Row], left_out: Sequence[LeftOut]) -> list[str]:
    """How many rows, and how many stretches gave none, by reason."""
    notes = [note for row in rows for note in row.notes]
    total: dict[str, int] = {}
    for row in rows:
        for reason, count in row.left_out.items():
            total[reason] = total.get(reason, 0) + count
    said = "".join(f", {count} samples left out as {reason}" for reason, count in total.items())
    notes.append(f"{len(rows)} rows of {sum(row.n_samples for row in rows)} samples{said}")
    for reason in sorted({part.reason for part in left_out}):
        these = [part for part in left_out if part.reason == reason]
        seconds = sum(part.end - part.start for part in these)
        notes.append(f"{len(these)} stretches, {seconds:.1f} s, gave no row: {reason}")
    return notes

