"""What is in a recording: clock, rests, temperature, noise, gaps, saturation, odd axes; and its map."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from planner.dwells.table_rows import MOTION
from planner.errors import InputError
from planner.nouns.progress import Progress
from planner.recordings.allan import AllanResult
from planner.recordings.clocks import Clock
from planner.recordings.column_map import ColumnMap, map_of, read_map
from planner.recordings.guess_map import guessed_map
from planner.recordings.hand_turns import Rest, calm, motion_rows
from planner.recordings.plausible import jumps_between, saturated
from planner.recordings.raw_to_dwells import doubted, rows_of_file, scanned
from planner.recordings.recording import recordings_of
from planner.recordings.reduction import ScannedFile
from planner.recordings.rest_allan import noise_of
from planner.recordings.rests import span
from planner.recordings.samples import CHANNELS, READ
from planner.recordings.temperature import alive
from planner.recordings.windows import longest_gap
from planner.units import STANDARD_GRAVITY_MPS2 as G

MOST_POWER_ONS = 12  # that a page shows


@dataclass(frozen=True)
class Gap:
    """Seconds without samples, from `start` on."""

    start: float
    seconds: float


@dataclass(frozen=True)
class Looked:
    """One power-on. rests: with their rows; turns: pieces of hand turns; findings: sentences on what is odd.

    left_out: reason -> seconds without a row; gravity: |f| in g at every rest, none without accelerometers
    """

    file: ScannedFile
    clock: Clock | None
    rests: tuple[Rest, ...]
    turns: int
    left_out: dict[str, float]
    gaps: tuple[Gap, ...]
    gravity: tuple[float, ...]
    findings: tuple[str, ...]

    @property
    def seconds(self) -> float:
        """From the first sample to the last."""
        return float(self.file.windows.end[-1] - self.file.windows.start[0])


@dataclass(frozen=True)
class Look:
    """A recording looked at: its map as text, whether that was guessed, its first power-ons, their noise."""

    path: Path
    map_text: str
    guessed: bool
    power_ons: tuple[Looked, ...]
    more: int
    allan: tuple[AllanResult, ...]
    noise_place: str


def look(paths: Sequence[Path], columns: Path | None, progress: Progress) -> Look:
    """What is in a recording, read by a map or by the one that is guessed.

    Raises InputError when it cannot be read; readings that cannot be meant are among the findings.
    """
    path = paths[0]
    if columns is None:
        progress(f"guessing the columns of {path}")
        text = guessed_map(paths)
        made = map_of(text.encode(), path)
    else:
        text, made = columns.read_text(encoding="utf-8", errors="replace"), read_map(columns)
    found = recordings_of(path, made)
    files, run = [], made.first_run
    for number, recording in enumerate(found[:MOST_POWER_ONS]):
        progress(f"reading {path}, power-on {number + 1} of {len(found)}")
        files.append(scanned(recording, run + number, len(found) > 1, None, progress))
    if not files:
        raise InputError(f"{path} has no samples")
    progress("noise of the longest rest")
    noise = noise_of(files)
    looked = tuple(_looked(file, made) for file in files)
    more = max(0, len(found) - MOST_POWER_ONS)
    return Look(path, text, columns is None, looked, more, noise.allan, noise.place)


def _looked(file: ScannedFile, columns: ColumnMap) -> Looked:
    rows, without = rows_of_file(file, None)
    rests, loud = calm(file, rows)
    left_out: dict[str, float] = {}
    for segment, reason in [*without, *loud]:
        left_out[reason] = left_out.get(reason, 0.0) + span(file.windows, segment)
    turns = len({row.step[: len(MOTION) + 4] for row in motion_rows(file, rests)})
    gravity = [float(np.linalg.norm(rest.row.mean[3:]) / G) for rest in rests] if columns.acc else []
    findings = tuple(_findings(file, rests))
    gaps = tuple(_gaps(file))
    return Looked(file, file.recording.clock, tuple(rests), turns, left_out, gaps, tuple(gravity), findings)


def _gaps(file: ScannedFile) -> Iterator[Gap]:
    """Between windows and within them, in order of time."""
    windows, longest = file.windows, longest_gap(file.rate)
    found = [
        Gap(float(windows.end[i]), float(windows.start[i + 1] - windows.end[i]))
        for i in np.flatnonzero(windows.start[1:] - windows.end[:-1] > longest)
    ]
    for i in np.flatnonzero(~windows.whole):
        samples = windows.count[i] + windows.left_out[i]
        seconds = float(windows.end[i] - windows.start[i] - max(samples - 2, 0) / file.rate)
        if seconds > longest:
            found.append(Gap(float(windows.start[i]), seconds))
    yield from sorted(found, key=lambda gap: gap.start)


def _findings(file: ScannedFile, rests: Sequence[Rest]) -> Iterator[str]:
    """What its reader should look at, the worst first."""
    if said := doubted(file):
        yield said
    if not rests:
        yield "nothing rests: no dwell table can be made of it"
    for reason, count in file.account.counts.items():
        if reason != READ:
            yield f"{count} samples left out while reading: {reason.replace('_', ' ')}"
    yield from file.account.remarks
    yield from saturated(file.windows)
    yield from jumps_between(file.windows, file.segments)
    variance = np.nan_to_num(file.windows.variance).max(axis=0, initial=0.0)
    for channel in np.flatnonzero(np.isfinite(file.windows.mean).any(axis=0) & (variance == 0)):
        yield f"{CHANNELS[channel]} never changes: it is dead, or no sensor"
    if file.recording.whole.temperature is not None and not alive(file.windows).all():
        share = 100.0 * (~alive(file.windows)).mean()
        yield f"the temperature cannot be believed in {share:.0f} % of the time"
