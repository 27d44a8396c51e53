"""Which rests are quiet, and the hand turns between them in pieces: what the gyros turned by in each.

A piece is a few windows in which the unit turns by a few degrees, so that one axis serves; its rate is the
mean over its duration, which reaches from the last window of one rest that is used to the first of the next.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from planner.nouns.array import Array
from planner.recordings.reduction import ScannedFile
from planner.recordings.rests import Segment, used_channels
from planner.recordings.samples import CHANNELS
from planner.recordings.segments_to_rows import Row, row_of
from planner.recordings.temperature import alive
from planner.recordings.windows import Windows, longest_gap
from planner.units import from_si

LONGEST_S = 60.0  # of a turn: over which a gyro bias of 0.01 deg/s turns by 0.6 deg
PIECE = np.radians(
    2.0
)  # of one piece: gravity after 16 hand turns is then missed as by every sample; by 8 deg, 20 % more
PIECE_S = 0.5
LOUD = 2.5  # times the deviation of the other rests: what scatters more is no rest
LEAST_RESTS = 3  # by whose middle one is judged


@dataclass(frozen=True)
class Rest:
    """A stretch with the row that it gives."""

    segment: Segment
    row: Row


def calm(file: ScannedFile, rests: Sequence[Rest]) -> tuple[list[Rest], list[tuple[Segment, str]]]:
    """The rests that are as quiet as the others, and those that are not, with the reason."""
    judged = [rest for rest in rests if rest.segment.kind == "rest"]
    if len(judged) < LEAST_RESTS:
        return list(rests), []
    usual = np.median([rest.row.spread for rest in judged], axis=0) * used_channels(file.windows)
    quiet, loud = [], []
    for rest in rests:
        channel = _loudest(rest.row.spread, usual)
        if rest.segment.kind == "rest" and channel is not None:
            loud.append((rest.segment, _said(channel, rest.row.spread, usual)))
        else:
            quiet.append(rest)
    return quiet, loud


def _loudest(spread: Array, usual: Array) -> int | None:
    """The channel that scatters most over LOUD times the usual, or None."""
    ratio = np.where(usual > 0, spread / np.where(usual > 0, usual, 1.0), 0.0)
    ratio = np.nan_to_num(ratio)
    return int(np.argmax(ratio)) if ratio.max() > LOUD else None


def _said(channel: int, spread: Array, usual: Array) -> str:
    unit = "deg/s" if channel < 3 else "m/s^2"
    here, there = (from_si(float(x[channel]), unit) for x in (spread, usual))
    return (
        f"is not quiet: {CHANNELS[channel]} scatters by {here:.3g} {unit}, by {there:.3g} at the other rests"
    )


# ---------------------------------------------------------------- hand turns


def motion_rows(file: ScannedFile, rests: Sequence[Rest]) -> list[Row]:
    """The pieces of every turn between two rests, where both kinds of sensor saw it from end to end.

    None of a bench that names its references, or its steps: there motions are not for the gyros to tell.
    """
    settings = file.recording.whole
    known = settings.ref_rate is not None or settings.ref_acc is not None or file.windows.label is not None
    if known or not settings.motions or not all(file.recording.has):
        return []
    found: list[Row] = []
    living = alive(file.windows)
    for number, (a, b) in enumerate(pairwise(rests), start=1):
        first, last = _between(a.segment, b.segment)
        if not _is_turn(file, a, b, first, last):
            continue
        pieces = list(_pieces(file.windows, a.row.mean[:3], first, last))
        rows = [
            row_of(
                file.windows,
                Segment("motion", i, k, file.windows.count[i:k] > 0),
                living,
                f"motion_{number:03d}_{place:02d}",
                file.unit,
                file.run,
                file.rate,
                settings,
            )
            for place, (i, k) in enumerate(pieces, start=1)
        ]
        if all(row is not None for row in rows):
            whole = [row for row in rows if row is not None]
            found += _tiled(file.windows, whole, pieces)
    return found


def _between(a: Segment, b: Segment) -> tuple[int, int]:
    """Windows first … last − 1 between those that two rests use."""
    return a.first + int(np.flatnonzero(a.quiet)[-1]) + 1, b.first + int(np.flatnonzero(b.quiet)[0])


def _is_turn(file: ScannedFile, a: Rest, b: Rest, first: int, last: int) -> bool:
    """Whether windows without gaps lead from one rest to the next within a minute, and something moved."""
    between = file.windows[max(0, first - 1) : last + 1]
    if a.segment.last >= b.segment.first or last <= first:
        return False  # one rest in two parts
    gaps = between.start[1:] - between.end[:-1] > longest_gap(file.rate)
    whole = between.whole.all() and (between.count >= 2).all() and not gaps.any()
    return bool(whole and file.windows.start[last] - file.windows.end[first - 1] <= LONGEST_S)


def _pieces(windows: Windows, bias: Array, first: int, last: int) -> Iterator[tuple[int, int]]:
    """Windows i … k − 1 of each piece."""
    turned, start = 0.0, first
    for i in range(first, last):
        spacing = windows.start[i + 1] - windows.start[i]
        step = float(np.linalg.norm(windows.mean[i, :3] - bias)) * spacing
        if i > start and (turned + step > PIECE or windows.start[i + 1] - windows.start[start] > PIECE_S):
            yield start, i
            turned, start = 0.0, i
        turned += step
    if start < last:
        yield start, last


def _tiled(windows: Windows, rows: Sequence[Row], pieces: Sequence[tuple[int, int]]) -> Iterator[Row]:
    """The rows with durations that leave no time between them out."""
    for row, (i, k) in zip(rows, pieces, strict=True):
        spacing = np.diff(windows.start[i : k + 1])
        duration = float(spacing.sum())
        rate = spacing @ windows.turned[i:k] / duration
        mean = np.concatenate([rate, row.mean[3:]])
        start = float(windows.start[i])
        yield replace(row, mean=mean, start=start, end=start + duration, duration=duration)
