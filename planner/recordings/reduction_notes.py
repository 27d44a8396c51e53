"""What a reader of a reduced table should know: losses, oddities, jumps and the recommendation."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from planner.recordings.plausible import jumps_between, saturated
from planner.recordings.reduction import LeftOut, ScannedFile
from planner.recordings.samples import READ
from planner.recordings.segments_to_rows import Row
from planner.recordings.temperature import alive

MANY_REPEATS = 0.001  # six channels of coarse digits repeat by chance less often


def notes_of(
    files: Sequence[ScannedFile], rows: Sequence[Row], left_out: Sequence[LeftOut], longest: str
) -> list[str]:
    """All notes in the order in which they matter to the reader, none twice."""
    notes = [note for file in files for note in _of_file(file)]
    notes += _of_map(files)
    notes += _odd_rows(rows)
    notes += _tallies(rows, left_out)
    if longest:
        notes.append(f"the noise terms are those of {longest}")
    return list(dict.fromkeys(notes))


def _of_file(file: ScannedFile) -> Iterator[str]:
    where = f"{file.unit} run {file.run}"
    lost = [f"{n} {reason.replace('_', ' ')}" for reason, n in file.account.counts.items() if reason != READ]
    if lost:
        yield f"{where}: left out while reading: {', '.join(lost)}"
    if file.account.repeats > MANY_REPEATS * file.account.counts[READ]:
        yield (
            f"{where}: {file.account.repeats} samples repeat the one before to the last digit: held, or "
            "written twice; they count as samples"
        )
    for remark in file.account.remarks:
        yield f"{where}: {remark}"
    for said in (*jumps_between(file.windows, file.segments), *saturated(file.windows)):
        yield f"{where}: {said}"
    if file.recording.whole.temperature is not None:
        yield from _dead_temperature(file, where)


def _dead_temperature(file: ScannedFile, where: str) -> Iterator[str]:
    living = alive(file.windows)
    if not living.any():
        yield f"{where}: the temperature sensor is dead throughout, so the rows have no temperature"
    elif not living.all():
        dead = np.flatnonzero(~living)
        seconds = (file.windows.end - file.windows.start)[dead].sum() + len(dead) / file.rate
        at = file.windows.start[dead[0]]
        yield f"{where}: the temperature sensor is dead for {seconds:.1f} s, first at {at:.1f} s"


def _of_map(files: Sequence[ScannedFile]) -> Iterator[str]:
    columns = files[0].recording.whole
    if columns.time_on is None:
        yield "the map gives no time_on, so time since power-on counts from the first sample"
    if columns.unit is None and len(files) > 1:
        yield "the map names no unit, so every file is taken as a unit of its own; name it with unit: …"


def _odd_rows(rows: Sequence[Row]) -> Iterator[str]:
    """Each oddity once, with the number of rows and the first of them."""
    found: dict[str, list[Row]] = {}
    for row in rows:
        for note in row.notes:
            found.setdefault(note, []).append(row)
    for note, these in found.items():
        first = these[0]
        yield f"{note} in {len(these)} rows, first {first.unit} run {first.run} {first.step}"


def _tallies(rows: Sequence[Row], left_out: Sequence[LeftOut]) -> Iterator[str]:
    """How many rows, and how many stretches gave none, by reason."""
    total: dict[str, int] = {}
    for row in rows:
        for reason, count in row.left_out.items():
            total[reason] = total.get(reason, 0) + count
    said = "".join(
        f", {count} samples left out as {reason.replace('_', ' ')}" for reason, count in total.items()
    )
    yield f"{len(rows)} rows of {sum(row.n_samples for row in rows)} samples{said}"
    for reason in sorted({part.reason for part in left_out}):
        these = [part for part in left_out if part.reason == reason]
        seconds, samples = sum(p.end - p.start for p in these), sum(p.samples for p in these)
        yield f"{len(these)} stretches, {samples} samples, {seconds:.1f} s, gave no row: {reason}"
