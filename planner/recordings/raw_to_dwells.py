"""Raw recordings -> dwell table: rests found, spikes left out, temperature and its rate, an account of all.

Two passes over each file, both in bounded memory: windows, from which rests and rows follow; then the longest
rest once more for the Allan deviation.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from planner import catalog
from planner.dwells.mix_ups import mix_ups
from planner.errors import Fault, InputError, unusable_file
from planner.nouns.array import Array
from planner.nouns.dwell_table import DwellTable
from planner.nouns.given_files import RECORDING
from planner.nouns.progress import Progress, silent
from planner.recordings.axis_check import axis_fault
from planner.recordings.clocks import Clock
from planner.recordings.column_map import ColumnMap
from planner.recordings.hand_turns import Rest, calm, motion_rows
from planner.recordings.plan_records import PlannedRecord, labelled
from planner.recordings.plausible import suspicious
from planner.recordings.recording import Recording, other_files, recordings_of
from planner.recordings.reduction import LeftOut, Reduction, ScannedFile
from planner.recordings.reduction_notes import notes_of
from planner.recordings.rest_allan import RECORD_LIMITS_S, noise_of, snippet
from planner.recordings.rests import Segment, segments_of, steps_of
from planner.recordings.samples import Account, Samples
from planner.recordings.segments_to_rows import Row, cut, row_of, table_of
from planner.recordings.temperature import alive
from planner.recordings.windows import longest_gap, windows_of
from planner.units import unit_factor

LEAST_WINDOWS = 3  # of a rest by which readings are judged
LEAST_SAMPLES = 16  # of one of several power-ons in a file


def reduce_recordings(
    paths: Sequence[Path],
    columns: ColumnMap | None = None,
    records: Sequence[PlannedRecord] | None = None,
    references: Mapping[str, Array] | None = None,
    progress: Progress = silent,
) -> Reduction:
    """The dwell table of recordings, each of one power-on.

    columns: the map; without it the columns must be named as a dwell table's, with `time_s`
    records: the plan's records; without them rests are found, or taken from the column of steps
    references: step -> (6,) true rate (rad/s) and specific force (m/s^2), for recordings without their own
    Raises InputError for files that cannot be read or whose readings cannot be meant, and when nothing rests.
    """
    _distinct(paths)
    found = [file for path in paths for file in _in_folder(Path(path), columns)]
    files, left_out = _files(found, columns, records, progress)
    progress("noise of the longest rest")
    noise = noise_of(files)
    rows, motions, without = _rows(files, None if noise.is_bound else noise.record)
    left_out += without
    if not rows:
        raise InputError(f"{files[0].recording.path}: nothing gives a row: {_reasons(left_out)}")
    _refuse_copies(files, rows)
    rows, said = _referenced(rows, references)
    settings = files[0].recording.whole
    table = table_of(rows, settings)
    _refuse_mix_ups(table, files[0].recording.path)
    notes = [*notes_of(files, rows, left_out, noise.place), *said, *_of_motions(motions)]
    if records and references is None and table.ref_rate is None:
        notes.append("no references: with --latitude they are taken from the plan's motions")
    return Reduction(
        table=replace(table, notes=tuple(notes), source=", ".join(str(path) for path in paths)),
        rows=tuple(rows),
        left_out=tuple(left_out),
        counts={file.name: dict(file.account.counts) for file in files},
        allan=noise.allan,
        record=noise.record,
        record_is_bound=noise.is_bound,
        snippet=snippet(noise.record),
        rates_hz={file.name: file.rate for file in files},
        clocks={file.name: clock for file in files if (clock := _clock(file)) is not None},
        motions=table_of(motions, settings) if motions else None,
        noise=noise.samples,
    )


# ---------------------------------------------------------------- files


def _distinct(paths: Sequence[Path]) -> None:
    if not paths:
        raise InputError("no recording is given")
    seen: set[Path] = set()
    for path in paths:
        whole = Path(path).resolve()
        if whole in seen:
            raise InputError(f"{path} is given twice; every power-on counts once")
        seen.add(whole)


def _in_folder(path: Path, columns: ColumnMap | None) -> list[Path]:
    """A file itself; of a folder its recordings, unless the map says which of its files hold what."""
    joined = columns is not None and any(part.file is not None for part in columns.parts.values())
    if not path.is_dir() or joined:
        return [path]
    suffixes = {suffix for reader in catalog.readers().values() for suffix in reader.suffixes}
    found = sorted(file for file in path.iterdir() if file.is_file() and file.suffix.lower() in suffixes)
    if not found:
        raise unusable_file(path, "is a folder without a recording", RECORDING)
    return found


def _files(
    paths: Sequence[Path],
    columns: ColumnMap | None,
    records: Sequence[PlannedRecord] | None,
    progress: Progress,
) -> tuple[list[ScannedFile], list[LeftOut]]:
    """Every power-on of every file; those of several in one file that are too short to be one are left out.

    A file that the map joins to another is no power-on of its own.
    """
    others = {other.resolve() for path in paths for other in other_files(path, columns)}
    files: list[ScannedFile] = []
    left_out: list[LeftOut] = []
    for path in paths:
        if path.resolve() in others:
            continue
        progress(f"reading {path}")
        found = recordings_of(path, columns)
        base = max((file.run for file in files), default=found[0].whole.first_run - 1) + 1
        for number, recording in enumerate(found):
            part = recording.part.run
            run = base + (number if part is None else part - recording.whole.first_run)
            if len(found) > 1 and (samples := _few(recording)):
                reason = f"only {samples} samples of this power-on"
                left_out.append(LeftOut(recording.unit, run, "motion", 0.0, 0.0, samples, reason))
                continue
            progress(
                f"reading {path}" + (f", power-on {number + 1} of {len(found)}" if len(found) > 1 else "")
            )
            file = scanned(recording, run, len(found) > 1, records, progress)
            if said := doubted(file):
                raise InputError(f"{recording.path}: {said}")
            files.append(file)
    if not files:
        raise InputError(f"{paths[0]}: {_reasons(left_out)}")
    return files, left_out


def _few(recording: Recording) -> int:
    """The number of samples of a power-on that has too few to be one, else 0."""
    count = 0
    for block in recording.samples():
        count += len(block)
        if count >= LEAST_SAMPLES:
            return 0
    return count


def _reasons(left_out: Sequence[LeftOut]) -> str:
    return "; ".join(sorted({part.reason for part in left_out}))


def scanned(
    recording: Recording,
    run: int,
    of_several: bool,
    records: Sequence[PlannedRecord] | None = None,
    progress: Progress = silent,
) -> ScannedFile:
    """A recording in windows, with its rests and motions. Raises InputError when it cannot be read."""
    account = Account()
    rate = sampling_rate(recording)
    windows = windows_of(_told(_labelled(recording, account, records), recording.path, progress), rate)
    segments = steps_of(windows) if windows.label is not None else segments_of(windows, longest_gap(rate))
    name = f"{recording.path}, run {run}" if of_several else str(recording.path)
    return ScannedFile(recording, recording.unit, run, rate, windows, tuple(segments), account, name)


def _told(blocks: Iterable[Samples], path: Path, progress: Progress) -> Iterator[Samples]:
    """The blocks, each told of when it comes."""
    for block in blocks:
        if len(block):
            progress(f"reading {path}: {block.time[-1] / 60.0:.1f} min")
        yield block


def doubted(file: ScannedFile) -> str:
    """A sentence on readings that cannot be meant: units, axes, signs; or nothing."""
    rests = [s for s in file.segments if s.kind == "rest" and s.last - s.first >= LEAST_WINDOWS]
    return suspicious(file.windows, rests) or axis_fault(file.windows, rests)


def _clock(file: ScannedFile) -> Clock | None:
    clock = file.recording.clock
    return clock if clock is not None and clock.jitters else None


def _labelled(
    recording: Recording, account: Account, records: Sequence[PlannedRecord] | None
) -> Iterable[Samples]:
    """The samples, named by the plan's records, by the column of steps, or not at all."""
    blocks = recording.even_samples(account)
    wanted = recording.whole.records
    if wanted == "plan" and not records:
        raise InputError("the map takes the records from the plan; give it with --plan")
    if wanted == "whole":
        return (replace(block, label=np.full(len(block), "record")) for block in blocks)
    if wanted == "rests" or (wanted is None and not records and recording.whole.step is None):
        return (replace(block, label=None) for block in blocks)
    if wanted == "plan" or (records and recording.whole.step is None):
        return labelled(blocks, records or (), recording.whole.plan_time_of(recording.path))
    return blocks


def sampling_rate(recording: Recording) -> float:
    """Hz: the map's, or from the times of the first block. Raises InputError when they contradict."""
    first = next(iter(recording.samples()), None)
    given = recording.columns.rate
    if first is None:
        raise InputError(f"{recording.path} has no samples")
    if recording.columns.time is None or len(first) < 3:
        if given is None:
            raise InputError(f"{recording.path} has too few samples to tell the sampling rate; give rate")
        return given
    clock = recording.clock
    if clock is None:
        raise InputError(f"{recording.path}: the time does not rise")
    if given is not None and abs(given * clock.mean - 1) > 0.05 and abs(given * clock.step - 1) > 0.05:
        raise InputError(
            f"{recording.path}: the map says {given:g} Hz, the time column {1 / clock.step:g} Hz; "
            "are units right?"
        )
    return 1 / clock.step


# ---------------------------------------------------------------- rows


def _rows(files: Sequence[ScannedFile], best: float | None) -> tuple[list[Row], list[Row], list[LeftOut]]:
    """Rows, those of hand turns between them, and the stretches that gave none.

    best: s, what a rest is cut into; None: 600 s
    """
    rows: list[Row] = []
    motions: list[Row] = []
    left_out: list[LeftOut] = []
    for file in files:
        found, without = rows_of_file(file, best)
        quiet, loud = calm(file, found)
        rows += [rest.row for rest in quiet]
        turns = motion_rows(file, quiet)
        motions += turns
        left_out += [_left(file, part, reason) for part, reason in [*without, *loud]]
    return rows, motions, left_out


def rows_of_file(file: ScannedFile, best: float | None) -> tuple[list[Rest], list[tuple[Segment, str]]]:
    """The rows of one power-on with their stretches, and the stretches without one and why."""
    living = alive(file.windows)
    settings = file.recording.whole
    longest = settings.record or float(np.clip(best or RECORD_LIMITS_S[1], *RECORD_LIMITS_S))
    found: list[Rest] = []
    without: list[tuple[Segment, str]] = []
    for segment in file.segments:
        reason = _why_not(file, segment, settings.shortest)
        if reason:
            without.append((segment, reason))
            continue
        for part in cut(file.windows, segment, longest):
            label = part.label or f"{part.kind}_{len(found) + 1:03d}"
            row = row_of(file.windows, part, living, label, file.unit, file.run, file.rate, settings)
            if row is None:
                without.append((part, "the temperature sensor is dead"))
            elif part.kind == "rest" and row.duration < settings.shortest:
                without.append((part, f"shorter than {settings.shortest:g} s"))
            else:
                found.append(Rest(part, row))
    return found, without


def _why_not(file: ScannedFile, segment: Segment, shortest: float) -> str:
    part = file.windows[segment.first : segment.last]
    if (part.count < 2).all():
        return "samples are no numbers, or padding"
    if (~part.whole | (part.count < 2)).all():
        longest = 1e3 * file.account.steps[1]
        return f"gaps in time: steps of up to {longest:.4g} ms at {file.rate:.4g} Hz"
    if segment.kind == "turn" and (part.reference is None or not np.isfinite(part.reference[:, :3]).all()):
        return "turns steadily, and the map names no ref_rate"
    if segment.kind == "motion":
        return segment.note or ("no step of the plan" if file.windows.label is not None else "moves")
    if part.end[-1] - part.start[0] + 1 / file.rate < shortest:
        return f"shorter than {shortest:g} s"
    return "" if segment.quiet.any() else "no window without disturbance"


def _left(file: ScannedFile, segment: Segment, reason: str) -> LeftOut:
    part = file.windows[segment.first : segment.last]
    samples = int((part.count + part.left_out).sum())
    return LeftOut(
        file.unit, file.run, segment.kind, float(part.start[0]), float(part.end[-1]), samples, reason
    )


def _refuse_copies(files: Sequence[ScannedFile], rows: Sequence[Row]) -> None:
    """Two recordings with a row that is the same to the last bit are one recording under two names."""
    seen: dict[bytes, Row] = {}
    names = {(file.unit, file.run): file.recording.path for file in files}
    for row in rows:
        if not row.spread.any():
            continue
        other = seen.setdefault(row.mean.tobytes() + row.spread.tobytes(), row)
        if (other.unit, other.run) != (row.unit, row.run):
            first, second = names[other.unit, other.run], names[row.unit, row.run]
            raise InputError(f"{second} holds the same samples as {first}; every power-on counts once")


# ---------------------------------------------------------------- references


def _referenced(rows: list[Row], references: Mapping[str, Array] | None) -> tuple[list[Row], list[str]]:
    """The rows with the plan's references, when every row has one and the recording has none of its own."""
    if references is None:
        return rows, []
    if any(row.reference is not None for row in rows):
        return rows, ["the recording has references of its own, so the plan's are not taken"]
    unknown = [row.step for row in rows if row.step not in references]
    if unknown:
        return rows, [f"no references: the plan does not tell them for {len(unknown)} rows, as {unknown[0]}"]
    return [replace(row, reference=references[row.step]) for row in rows], []


def _of_motions(motions: Sequence[Row]) -> list[str]:
    seconds = sum(row.duration for row in motions)
    said = (
        f"{seconds:.1f} s between rests are kept as {len(motions)} rows of kind motion, for rests_and_turns"
    )
    return [said] if motions else []


def _refuse_mix_ups(table: DwellTable, path: Path) -> None:
    """Raises InputError when the readings contradict their references: unit, axis or sign."""
    triads = {"gyro": table.gyro, "acc": table.acc, "ref_rate": table.ref_rate, "ref_acc": table.ref_acc}
    shown = {
        field: values / unit_factor("deg/s" if field in ("gyro", "ref_rate") else "g")[0]
        for field, values in triads.items()
        if values is not None
    }
    faults = [Fault(str(path), 0, 0, *said, "P703") for said in mix_ups(shown)]
    if faults:
        raise InputError(f"{path}: readings and references contradict each other", faults)
